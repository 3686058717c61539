"""Boards from TOML files, with every fault named by file, key and value."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import SHEETS, with_grommets, with_material, with_rubber_parts
from chladni.sim.board.checks import named
from chladni.sim.board.coil_checks import check_driver
from chladni.sim.board.electronics import Coil, Electronics, Panel, Sensing, Winding
from chladni.sim.board.fingers import Active, Focus, SeveralFingers, finger_from
from chladni.sim.board.foundation import CutOut, Foundation, Patch, Strips
from chladni.sim.board.gpio import CHIPS
from chladni.sim.board.parts import (
    EDGE_KINDS,
    Actuator,
    Drive,
    Edges,
    Hole,
    Image,
    Isolation,
    Magnet,
    Mass,
    Measured,
    MeasuredValue,
    Pin,
    Plate,
    Regions,
    Screw,
    Spring,
)
from chladni.sim.board.quantity import check_keys, keys_of, part_of, perhaps
from chladni.sim.board.winding_values import winding_makes
from chladni.sim.errors import ArgumentError, Faults, InputError
from chladni.sim.files import read_text, toml_document

Part = TypeVar("Part")

SECTIONS = {
    "plate": Plate,
    "drive": Drive,
    "image": Image,
    "regions": Regions,
    "electronics": Electronics,
}
FEATURE_CLASSES = {"screws": Screw, "pins": Pin, "springs": Spring, "masses": Mass, "holes": Hole}
OPTIONAL_SECTIONS = {
    "magnet": Magnet,
    "coil": Coil,
    "winding": Winding,
    "panel": Panel,
    "sensing": Sensing,
    "foundation": Foundation,
    "focus": Focus,
    "active": Active,
    "fingers": SeveralFingers,
    "measured": Measured,
}
KNOWN_KEYS = ["name", *SECTIONS, "actuators", *FEATURE_CLASSES, *OPTIONAL_SECTIONS, "finger"]
MOST_BYTES = 65_536
"""Of a board file; the template has 6,000, and a plate with a thousand features fits."""


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


def load_board(board: str | Path, field: str = "board") -> Board:
    """Read a board.

    Parameters
    ----------
    board
        Path of a TOML file, or the name of a shipped board (`paper`, `prototype`).
    field
        What asks for it, by which a file that is missing is told.

    Raises
    ------
    InputError
        The file is missing, is not TOML, or has a value that cannot be; names file and key.
    """
    path = file_of(board, shipped_boards(), field, "a board file")
    text = read_text(path, field, MOST_BYTES, "a board file", encoding="utf-8-sig")
    return parse_board(text, file=str(path))


def file_of(given: str | Path, shipped: Mapping[str, Path], field: str, what: str) -> Path:
    """The file of a path, also without .toml, or of a shipped name; errors name `field`, `what`.

    Raises
    ------
    InputError
        There is neither.
    """
    path, named = Path(given), Path(f"{given}.toml")
    is_shipped = str(given) in shipped
    if os.path.isfile(path) or (os.path.isfile(named) and not is_shipped):
        return path if os.path.isfile(path) else named
    if not is_shipped and not os.path.lexists(path):
        known = f"{what} that is there, or one of: {', '.join(shipped)}"
        raise ArgumentError(field, str(given), known, hint=perhaps(given, shipped))
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
    if "design" in document:
        hint = "`chladni design SPEC -o BOARD` makes a board of it"
        raise InputError("[design]", "a SPEC", "a board file", file=file, hint=hint)
    try:
        return board_from_document(named(document, file))
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
        return toml_document(text)
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


def board_from_document(document: dict[str, Any]) -> Board:
    """Make a board of a parsed file; `InputError` names every key that is wrong."""
    return Board(**parts_of(document))


def parts_of(document: dict[str, Any]) -> dict[str, Any]:
    """What a parsed file holds, by the fields of `Board`, each key and value checked by itself.

    Raises
    ------
    InputError
        Names every key that is missing, unknown or out of its range.
    """
    faults = Faults()
    with faults.kept():
        required = ["name", "plate", "actuators"]
        check_keys(document, KNOWN_KEYS, required=required, where="", blocks=homes_of_keys())
    document = {key: value for key, value in document.items() if key in KNOWN_KEYS}
    document = _completed(document, faults)
    parts: dict[str, Any] = {"name": document.get("name", "")}
    for key, cls in SECTIONS.items():
        if key in document:
            with faults.kept():
                parts[key] = part_from(cls, document[key], key)
    if "electronics" in parts:
        with faults.kept():
            check_driver(parts["electronics"], document["electronics"])
    for key, feature in FEATURE_CLASSES.items():
        with faults.kept():
            parts[key] = parts_from(feature, document.get(key, []), key)
    for key, optional in OPTIONAL_SECTIONS.items():
        parts[key] = None
        if key in document:
            with faults.kept():
                parts[key] = part_from(optional, document[key], key)
    with faults.kept():
        parts["finger"] = finger_from(document["finger"]) if "finger" in document else None
    if "actuators" in document:
        with faults.kept():
            parts["actuators"] = parts_from(Actuator, _named(document["actuators"]), "actuators")
    faults.tell()
    return parts


def _completed(document: dict[str, Any], faults: Faults) -> dict[str, Any]:
    """The document with what follows from the rest where it is left out.

    A block in which that fails is left out, so that no more of it is found wrong.
    """
    document = {"drive": {}, "regions": {}, "electronics": {}} | document
    if "plate" in document:
        sheet = None
        with faults.kept():
            sheet = with_material(document["plate"])
        # Any sheet's numbers, where its own are not known: all else of the plate is looked at.
        document["plate"] = sheet if sheet is not None else SHEETS["FR4"] | document["plate"]
    for complete, block in (
        (_with_points, "image"),
        (_with_panel, "panel"),
        (_with_winding, "coil"),
        (with_rubber_parts, "springs"),
        (with_grommets, "screws"),
    ):
        with faults.kept():
            document = complete(document)
            continue
        document.pop(block, None)
    return document


def _with_points(document: dict[str, Any]) -> dict[str, Any]:
    """With the points of the image."""
    sides = _sides_mm(document)
    if "image" in document or sides is None:
        return document
    return document | {"image": {"points": list(Image.usual(sides).points)}}


def _with_winding(document: dict[str, Any]) -> dict[str, Any]:
    """With what is left out of the coil, from its winding."""
    if "winding" not in document:
        return document
    winding = part_from(Winding, document["winding"], "winding")
    magnet = part_from(Magnet, document["magnet"], "magnet") if "magnet" in document else None
    coil, electronics = document.get("coil"), document["electronics"]
    takes_force = isinstance(coil, dict) and "force_factor_n_per_a" not in coil
    made = winding_makes(winding, magnet, force=takes_force)
    filled = dict(document)
    if isinstance(coil, dict) or (coil is None and "force_factor_n_per_a" in made):
        filled["coil"] = made | (coil or {})
    if isinstance(electronics, dict):
        filled["electronics"] = {"coil_ohm": made["resistance_ohm"]} | electronics
    return filled


def _with_panel(document: dict[str, Any]) -> dict[str, Any]:
    """With the lines of the panel's bus, where its chip has them, and the size of the plate."""
    panel, electronics = document.get("panel"), document["electronics"]
    if not (isinstance(panel, dict) and isinstance(electronics, dict)):
        return document
    chip, sides = electronics.get("chip"), _sides_mm(document)
    made: dict[str, Any] = {}
    if isinstance(chip, str) and chip in CHIPS:
        made["sda_pin"], made["scl_pin"], _ = CHIPS[chip].panel
    if sides is not None:
        made["size_mm"] = sides[::-1] if panel.get("rotation_deg") in (90, 270) else sides
    return document | {"panel": made | panel}


def _sides_mm(document: dict[str, Any]) -> list[float] | None:
    """The plate's sides, if they are numbers."""
    plate = document.get("plate")
    sides = plate.get("size_mm") if isinstance(plate, dict) else None
    if not isinstance(sides, list) or len(sides) != 2:
        return None
    return sides if all(isinstance(one, int | float) for one in sides) else None


def _named(actuators: object) -> object:
    """Actuators of which those without a name are called by their number."""
    if not isinstance(actuators, list):
        return actuators
    return [
        {"name": f"coil-{k}"} | own if isinstance(own, dict) else own
        for k, own in enumerate(actuators, 1)
    ]


def parts_from(cls: type[Part], entries: object, where: str) -> tuple[Part, ...]:
    """The same of every table in a list."""
    if not isinstance(entries, list):
        raise InputError(where, entries, f"blocks of the form [[{where}]]")
    faults, found = Faults(), []
    for k, entry in enumerate(entries):
        with faults.kept():
            found.append(part_from(cls, entry, f"{where}[{k}]"))
    faults.tell()
    return tuple(found)


def part_from(cls: type[Part], table: object, where: str) -> Part:
    """One dataclass of quantities from one TOML table, its keys and ranges checked."""
    return part_of(cls, table, where, _nested, homes_of_keys())


@lru_cache(maxsize=1)
def homes_of_keys() -> dict[str, str]:
    """Where a key goes: into a block that has it, or above all, where no block's head precedes."""
    homes: dict[str, list[str]] = {}
    for block, cls in (SECTIONS | OPTIONAL_SECTIONS).items():
        for key in keys_of(cls):
            homes.setdefault(key, []).append(f"[{block}]")
    above = dict.fromkeys(("name", "finger", "actuators"), "above all blocks")
    return {key: f"into {' or '.join(own)}" for key, own in homes.items()} | above


def _nested(name: str, value: Any, where: str) -> Any:
    """What is no number: a word, or a block within the block."""
    if name == "edges":
        return _edges(value)
    single: dict[str, type] = {"strips": Strips, "before": Isolation, "after": Isolation}
    if name in single:
        return part_from(single[name], value, where)
    blocks: dict[str, type] = {"cut_outs": CutOut, "patches": Patch, "values": MeasuredValue}
    return parts_from(blocks[name], value, where) if name in blocks else value


def _edges(value: object) -> Edges:
    """One word for all four edges, or a table with a word for each that is not free."""
    if isinstance(value, dict):
        names = list(Edges().kinds())
        check_keys(value, names, required=[], where="plate.edges.")
        return Edges(**value)
    if value not in EDGE_KINDS:
        expected = "one of: " + ", ".join(map(repr, EDGE_KINDS)) + ", or a table by edge"
        raise InputError("plate.edges", value, expected)
    return Edges(value, value, value, value)
