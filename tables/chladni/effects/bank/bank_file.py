"""A bank's TOML file: areas, and the effect files that they name (docs/effects.md)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from chladni.effects.bank.areas import (
    LEAST_LEVEL_DB,
    LEAST_UM,
    MOST_MM,
    MOST_UM,
    Area,
    Bank,
    Circle,
    Everywhere,
    Polygon,
    Shape,
)
from chladni.effects.bank.layout import MAX_HYSTERESIS_UM, OCCASIONS
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import read_bank_file
from chladni.effects.effect import Effect
from chladni.effects.file_values import FileValue, read_toml
from chladni.effects.files import READERS, read_effect, shipped_effects
from chladni.sim.board.quantity import perhaps
from chladni.sim.errors import ArgumentError, Faults, InputError

BANK_SUFFIX = ".che"
KEYS = ("name", "hysteresis_mm", "effects", "svg", "area")
SHAPES = ("rectangle_mm", "circle_mm", "polygon_mm", "svg")
AREA_KEYS = ("name", *SHAPES, *OCCASIONS, "level_db", "level_um", "every_mm", "along")


@dataclass
class ReadBank:
    """A bank, and what of the effects' files a device cannot do, by effect."""

    bank: Bank
    left_out: dict[str, list[str]] = field(default_factory=dict)


def shipped_banks() -> dict[str, Path]:
    """Files of the banks that come with Chladni, by name."""
    folder = Path(__file__).resolve().parents[1] / "banks"
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def is_bank(name: str | Path) -> bool:
    """Whether a name or a file is a bank's; one that is an effect's too is an effect."""
    path = Path(name)
    if path.suffix.lower() == ".toml":
        return bool({"area", "effects"} & set(read_toml(path, "EFFECT").keys()))
    is_shipped = str(name) in shipped_banks() and str(name) not in shipped_effects()
    return is_shipped or path.suffix.lower() == BANK_SUFFIX


def bank_bytes(name: str | Path, argument: str = "bank") -> bytes:
    """A bank as a device has it: of a file that was built, or of what `read_bank` reads.

    Raises
    ------
    InputError
        As of `read_bank`.
    """
    if Path(name).suffix.lower() == BANK_SUFFIX:
        return pack_bank(read_bank_file(Path(name), argument))
    _check_name(name, argument, f".toml or {BANK_SUFFIX}")
    try:
        return pack_bank(read_bank(name, argument).bank)
    except InputError as error:
        is_told = error.file or isinstance(error, ArgumentError)
        raise (error if is_told else error.in_file(str(name))) from None


def read_bank(name: str | Path, argument: str = "bank") -> ReadBank:
    """The bank that a TOML file describes.

    Parameters
    ----------
    name
        Of a shipped bank, or a file; files that it names lie beside it.
    argument
        For errors.

    Raises
    ------
    InputError
        Keys are unknown, values out of their range, files not there, or areas name effects that no
        one defines; names the file, and of each the place and the value.
    """
    _check_name(name, argument, ".toml")
    path = shipped_banks().get(str(name), Path(name))
    file = read_toml(path, argument)
    effects, areas, faults = _Effects(path.parent), [], Faults()
    name, hysteresis_mm, shapes = path.stem[:15], 1.0, dict[str, Shape | InputError]()
    file.check_keys(KEYS, faults)
    with faults.kept():
        for one in file["effects"] if file["effects"].is_there else ():
            effects.use(one)
    with faults.kept():
        name = file["name"].text() if file["name"].is_there else name
    with faults.kept():
        hysteresis_mm = file["hysteresis_mm"].number(0.0, MAX_HYSTERESIS_UM / 1e3, hysteresis_mm)
    with faults.kept():
        shapes = _drawn_shapes(file["svg"], path.parent)
    with faults.kept():
        for own in file["area"] if file["area"].is_there else ():
            with faults.kept():
                areas.append(_area(own, effects, shapes))
    faults.tell()
    if not effects.found:
        raise file["area"].error("an area with an effect, or `effects`")
    try:
        bank = Bank(name, effects.found, tuple(areas), hysteresis_mm)
    except InputError as error:
        raise error.in_file(str(path)) from None
    return ReadBank(bank, effects.left_out)


def _check_name(name: str | Path, argument: str, endings: str) -> None:
    """Refuse what is no shipped bank and no TOML file; `endings` is for the message."""
    if str(name) in shipped_banks() or Path(name).suffix == ".toml":
        return
    expected = f"{', '.join(shipped_banks())}, or a file that ends in {endings}"
    hint = perhaps(name, shipped_banks())
    raise ArgumentError(argument, str(name), expected, hint=hint)


class _Effects:
    """Effects that were named, each read once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.found: dict[str, Effect] = {}
        self.left_out: dict[str, list[str]] = {}
        self._names: dict[str, str] = {}

    def use(self, own: FileValue) -> str:
        """The effect that a value names, a shipped one or a file: its name in the bank."""
        wanted = own.text()
        if wanted in self._names:
            return self._names[wanted]
        is_file = Path(wanted).suffix.lower() in READERS
        if not is_file and wanted not in shipped_effects():
            shipped = ", ".join(shipped_effects())
            expected = f"{shipped}, or a file that ends in {', '.join(READERS)}"
            raise own.error(expected, hint=perhaps(wanted, shipped_effects()))
        if is_file and not (self.folder / wanted).exists():
            raise own.error(f"a file that is there, in {self.folder}")
        read = read_effect(self.folder / wanted if is_file else wanted, field=own.place)
        name = Path(wanted).stem[:15] if is_file else wanted
        if name in self.found:
            raise own.error(f"a file whose name differs from the effect {name!r} that is there")
        self._names[wanted] = name
        self.found[name] = read.effect
        if read.left_out:
            self.left_out[name] = read.left_out
        return name


def _area(own: FileValue, effects: _Effects, shapes: dict[str, Shape | InputError]) -> Area:
    """With all that is wrong with it told at once."""
    faults, found = Faults(), dict[str, Any]()
    own.check_keys(AREA_KEYS, faults)
    readers: dict[str, Callable[[FileValue], object]] = {
        "name": FileValue.text,
        **dict.fromkeys(OCCASIONS, effects.use),
        "level_db": lambda value: value.number(LEAST_LEVEL_DB, 0.0),
        "level_um": lambda value: value.number(LEAST_UM, MOST_UM),
        "every_mm": lambda value: value.number(0.0, MOST_MM),
        "along": FileValue.text,
    }
    for key, reader in readers.items():
        if own[key].is_there or key == "name":
            with faults.kept():
                found[key] = reader(own[key])
    with faults.kept():
        found["shape"] = _shape(own, shapes)
    faults.tell()
    try:
        return Area(**found)
    except ArgumentError as error:
        place = f"{own.place}.{error.field}"
        raise InputError(place, error.value, error.expected, file=own.file) from None


def _shape(own: FileValue, shapes: dict[str, Shape | InputError]) -> Shape:
    given = [key for key in SHAPES if own[key].is_there]
    if len(given) > 1:
        raise own[given[1]].error(f"nothing beside {given[0]}")
    if not given:
        return Everywhere()
    value = own[given[0]]
    match given[0]:
        case "rectangle_mm":
            return Polygon.rectangle(*_numbers(value, 4, "[x0, y0, x1, y1]"))
        case "circle_mm":
            x, y, radius = _numbers(value, 3, "[x, y, radius]")
            return Circle((x, y), radius)
        case "polygon_mm":
            corners = [_numbers(one, 2, "[x, y]") for one in value]
            return Polygon(tuple((x, y) for x, y in corners))
    if value.text() not in shapes:
        known = ", ".join(sorted(shapes)[:20]) or "it has none"
        raise value.error(f"an id of the drawing: {known}")
    found = shapes[value.text()]
    if isinstance(found, InputError):
        raise found
    return found


def _numbers(own: FileValue, count: int, what: str) -> Any:
    values = [one.number(-MOST_MM, MOST_MM) for one in own]
    if len(values) != count:
        raise InputError(own.place, values, what, file=own.file)
    return values


def _drawn_shapes(own: FileValue, folder: Path) -> dict[str, Shape | InputError]:
    if not own.is_there:
        return {}
    # Drawings need a library of their own, most banks have none.
    from chladni.effects.bank.drawing import shapes_of_drawing  # noqa: PLC0415

    return shapes_of_drawing(folder / own.text(), own.place)
