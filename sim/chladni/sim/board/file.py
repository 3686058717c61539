"""Boards from TOML files, with every fault named by file, key and value."""

from __future__ import annotations

import dataclasses
import difflib
import os
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from chladni.sim.board.board import Board
from chladni.sim.board.checks import check_driver
from chladni.sim.board.coil_checks import winding_makes
from chladni.sim.board.electronics import Coil, Electronics, Panel, Winding
from chladni.sim.board.finger import FINGERS, Finger
from chladni.sim.board.focus import Active, Focus, SeveralFingers
from chladni.sim.board.foundation import CutOut, Foundation, Strips
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.parts import (
    EDGE_KINDS,
    Actuator,
    Drive,
    Edges,
    Hole,
    Image,
    Magnet,
    Mass,
    Pin,
    Plate,
    Regions,
    Screw,
    Spring,
)
from chladni.sim.board.plate_materials import with_material
from chladni.sim.board.quantity import quantities
from chladni.sim.errors import ArgumentError, InputError, MissingError
from chladni.sim.files import read_text

Part = TypeVar("Part")

SECTIONS = {
    "plate": Plate,
    "drive": Drive,
    "image": Image,
    "regions": Regions,
    "electronics": Electronics,
}
FEATURE_CLASSES = {
    "screws": Screw,
    "pins": Pin,
    "springs": Spring,
    "masses": Mass,
    "holes": Hole,
}
OPTIONAL_SECTIONS = {
    "magnet": Magnet,
    "coil": Coil,
    "winding": Winding,
    "panel": Panel,
    "foundation": Foundation,
    "focus": Focus,
    "active": Active,
    "fingers": SeveralFingers,
}
OPTIONAL_KEYS = (*FEATURE_CLASSES, *OPTIONAL_SECTIONS, "finger")
MOST_BYTES = 65_536
"""Of a board file; the template has 6,000, and a plate with a thousand features fits."""
MOST_DOTS = 256
"""In a line. A key has three parts at most; what reading a key takes grows with their square."""
MOST_DEPTH = 16
"""Of lists and blocks within each other; a board needs five."""


def shipped_boards() -> dict[str, Path]:
    """Name to file of the boards that come with Chladni (the template is not one)."""
    files = sorted(_boards_directory().glob("*.toml"))
    return {file.stem: file for file in files if file.stem != "template"}


def shipped_specs() -> dict[str, Path]:
    """Name to file of the SPECs that come with Chladni: boards with values left open."""
    return {file.stem: file for file in sorted((_boards_directory() / "specs").glob("*.toml"))}


def _boards_directory() -> Path:
    here = Path(__file__).resolve()
    installed = here.parents[1] / "boards"
    return installed if installed.is_dir() else here.parents[4] / "boards"


def load_board(board: str | Path) -> Board:
    """Read a board.

    Parameters
    ----------
    board
        Path of a TOML file, or the name of a shipped board (`paper`, `prototype`).

    Raises
    ------
    InputError
        The file is missing, is not TOML, or has a value that cannot be; names file and key.
    """
    path = file_of(board, shipped_boards(), "board", "a board file")
    text = read_text(path, "board", MOST_BYTES, "a board file", encoding="utf-8-sig")
    return parse_board(text, file=str(path))


def file_of(given: str | Path, shipped: Mapping[str, Path], field: str, what: str) -> Path:
    """The file that a path or a shipped name means; `field` and `what` name it in errors.

    Raises
    ------
    InputError
        There is neither.
    """
    path = Path(given)
    if os.path.isfile(path):
        return path
    if str(given) not in shipped and not os.path.lexists(path):
        raise ArgumentError(field, str(given), f"{what}, or one of: {', '.join(shipped)}")
    return shipped.get(str(given), path)


def parse_board(text: str, *, file: str) -> Board:
    """A board from the text of its file.

    Parameters
    ----------
    file
        What errors call it.

    Raises
    ------
    InputError
        It is too long, is not TOML, or has a value that cannot be; names file and key.
    """
    document = parse_document(text, file=file)
    try:
        return board_from_document(document)
    except InputError as error:
        raise error.in_file(file) from None


def parse_document(
    text: str, field: str = "board", what: str = "a board file", *, file: str
) -> dict[str, Any]:
    """As `read_document`, of a file's text."""
    size = len(text.encode("utf-8", "replace"))
    if size > MOST_BYTES:
        raise ArgumentError(
            field, f"{size:,} bytes", f"{what} of at most {MOST_BYTES:,} bytes", file=file
        )
    try:
        return _document(text)
    except InputError as error:
        raise error.in_file(file) from None


def read_document(path: Path, field: str = "board", what: str = "a board file") -> dict[str, Any]:
    """A file's TOML document, shallow and with integers of 64 bits as TOML has them.

    Raises
    ------
    InputError
        The file is missing, too long, or no such document; `field` and `what` name it.
    """
    text = read_text(path, field, MOST_BYTES, what, encoding="utf-8-sig")
    return parse_document(text, field, what, file=str(path))


def _document(text: str) -> dict[str, Any]:
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") > MOST_DOTS:
            raise InputError(
                f"line {number}",
                f"{line.count('.')} dots",
                f"at most {MOST_DOTS}",
                hint="a key has three parts at most",
            )
    try:
        document = tomllib.loads(text)
    except RecursionError:
        raise _too_deep("syntax") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError("syntax", str(error), "a TOML document") from None
    except ValueError:  # Python reads no integer of more than 4,300 digits
        expected = "integers of 64 bits"
        raise InputError("syntax", "an integer of thousands of digits", expected) from None
    _check_values(document)
    return document


def _check_values(document: dict[str, Any]) -> None:
    """Refuse what nests too deep or is no TOML integer. Without recursion, which has a limit."""
    left: list[tuple[Any, tuple[str, ...]]] = [(document, ())]
    while left:
        value, where = left.pop()
        if len(where) > MOST_DEPTH:
            raise _too_deep("".join(where).lstrip("."))
        if isinstance(value, dict):
            left += [(own, (*where, "." + key)) for key, own in value.items()]
        elif isinstance(value, list):
            left += [(own, (*where, f"[{number}]")) for number, own in enumerate(value)]
        elif isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise InputError("".join(where).lstrip("."), value, "an integer of 64 bits")


def _too_deep(where: str) -> InputError:
    expected = f"blocks and lists at most {MOST_DEPTH} deep"
    return InputError(where, "deeper ones", expected, hint="a board needs five")


def board_from_document(document: dict[str, Any]) -> Board:
    """Make a board of a parsed file; `InputError` names the key that is wrong."""
    known = ["name", *SECTIONS, "actuators", *OPTIONAL_KEYS]
    _check_keys(document, known, required=["name", *SECTIONS, "actuators"], where="")
    document = _with_winding(document | {"plate": with_material(document["plate"])})
    document = _with_panel_lines(document)
    parts: dict[str, Any] = {
        key: part_from(cls, document[key], key) for key, cls in SECTIONS.items()
    }
    check_driver(parts["electronics"], document["electronics"])
    features: dict[str, Any] = {
        key: _parts(cls, document.get(key, []), key) for key, cls in FEATURE_CLASSES.items()
    }
    for key, optional in OPTIONAL_SECTIONS.items():
        parts[key] = part_from(optional, document[key], key) if key in document else None
    parts["finger"] = _finger(document["finger"]) if "finger" in document else None
    return Board(
        name=document["name"],
        **features,
        actuators=_parts(Actuator, document["actuators"], "actuators"),
        **parts,
    )


def _with_winding(document: dict[str, Any]) -> dict[str, Any]:
    """The document with what is left out of its coil filled in from its winding."""
    if "winding" not in document:
        return document
    winding = part_from(Winding, document["winding"], "winding")
    magnet = part_from(Magnet, document["magnet"], "magnet") if "magnet" in document else None
    coil, electronics = document.get("coil"), document["electronics"]
    takes_force = isinstance(coil, dict) and "force_factor_n_per_a" not in coil
    made = winding_makes(winding, magnet, force=takes_force)
    filled = dict(document)
    if isinstance(coil, dict):
        filled["coil"] = made | coil
    if isinstance(electronics, dict):
        filled["electronics"] = {"coil_ohm": made["resistance_ohm"]} | electronics
    return filled


def _with_panel_lines(document: dict[str, Any]) -> dict[str, Any]:
    """The document with the lines of its panel's bus filled in: where its chip has them."""
    panel, electronics = document.get("panel"), document["electronics"]
    if not (isinstance(panel, dict) and isinstance(electronics, dict)):
        return document
    chip = electronics.get("chip")
    if not (isinstance(chip, str) and chip in CHIPS):
        return document
    sda, scl, _ = CHIPS[chip].panel
    return document | {"panel": {"sda_pin": sda, "scl_pin": scl} | panel}


def _parts(cls: type[Part], entries: object, where: str) -> tuple[Part, ...]:
    if not isinstance(entries, list):
        raise InputError(where, entries, f"blocks of the form [[{where}]]")
    return tuple(part_from(cls, entry, f"{where}[{k}]") for k, entry in enumerate(entries))


def part_from(cls: type[Part], table: object, where: str) -> Part:
    """One dataclass of quantities from one TOML table, its keys and ranges checked."""
    if not isinstance(table, dict):
        raise InputError(where, table, f"a block of the form [{where}]")
    specs = quantities(cls)
    fields = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    keys = [specs[name].key if name in specs else name for name in fields]
    required = [
        key
        for key, field in zip(keys, dataclasses.fields(cls), strict=True)  # type: ignore[arg-type]
        if field.default is dataclasses.MISSING
    ]
    _check_keys(table, keys, required=required, where=f"{where}.")
    values = {}
    for name, key in zip(fields, keys, strict=True):
        if key not in table:
            continue
        if name in specs:
            specs[name].check(table[key], where=f"{where}.{key}")
            values[name] = specs[name].to_si(table[key])
        else:
            values[name] = _nested(name, table[key], f"{where}.{key}")
    return cls(**values)


def _nested(name: str, value: Any, where: str) -> Any:
    """What is no number: a word, or a block within the block."""
    if name == "edges":
        return _edges(value)
    if name == "strips":
        return part_from(Strips, value, where)
    return _parts(CutOut, value, where) if name == "cut_outs" else value


def _finger(value: object) -> Finger:
    """A finger by name, or by its numbers."""
    if isinstance(value, str) and value in FINGERS:
        return FINGERS[value]
    if not isinstance(value, dict):
        known = ", ".join(map(repr, FINGERS))
        raise InputError("finger", value, f"one of: {known}, or a block of the form [finger]")
    if "name" in value:
        _check_keys(value, ["name"], required=[], where="finger.")
        return _finger(value["name"])
    return part_from(Finger, value, "finger")


def _edges(value: object) -> Edges:
    """One word for all four edges, or a table with a word for each that is not free."""
    if isinstance(value, dict):
        names = list(Edges().kinds())
        _check_keys(value, names, required=[], where="plate.edges.")
        return Edges(**value)
    if value not in EDGE_KINDS:
        expected = "one of: " + ", ".join(map(repr, EDGE_KINDS)) + ", or a table by edge"
        raise InputError("plate.edges", value, expected)
    return Edges(value, value, value, value)


def _check_keys(
    table: dict[str, Any], known: list[str], *, required: list[str], where: str
) -> None:
    for key, value in table.items():
        if key not in known:
            close = difflib.get_close_matches(key, known, n=1)
            hint = f"{close[0]!r}, perhaps" if close else f"one of: {', '.join(known)}"
            raise InputError(f"{where}{key}", value, f"a known key: {hint}")
    for key in required:
        if key not in table:
            raise MissingError(f"{where}{key}")
