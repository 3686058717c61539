"""Dataclass fields that know their key, unit and range in a board file."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from chladni.sim.errors import Faults, InputError, MissingError

Part = TypeVar("Part")

MM = 1e-3
"""A millimetre, in metres: places are given in the one and computed in the other."""
SAME_PLACE = 1e-6
"""Closer than this, in metres, two circles or two coils are at one place."""
METRES = "metres? these are millimetres"
ALONE = "the number alone, without quotes or a unit"
CENTIMETRES = "centimetres? these are millimetres"
MOST_METRES = 0.5
"""Lengths of a board that are all below this are taken for metres."""
OTHER_UNITS = {
    "_mm": (1e-3, "µm? this is in mm"),
    "_hz": (1e3, "kHz? this is in Hz"),
    "_gpa": (1e-3, "MPa? this is in GPa"),
    "_kg_m3": (1e3, "g/cm³? this is in kg/m³"),
    "_n_per_mm3": (1e-9, "N/m³? this is in N/mm³"),
}
"""By a key's ending: a number that is out of range is taken for one in this unit, if it is in range
then; the factor is to the file's unit."""


@dataclass(frozen=True)
class Quantity:
    """How a field is written in a board file.

    Parameters
    ----------
    key
        Name in the file; it carries the unit.
    scale
        Factor from the file's unit to SI.
    low, high
        Range allowed, in the file's unit, both ends included.
    count
        How many numbers: 1, 2 for a pair, 0 for a list of any length.
    integer
        Whether only whole numbers are allowed.
    is_written
        Whether a file that is written has it where it is the default, too.
    """

    key: str
    scale: float
    low: float
    high: float
    count: int = 1
    integer: bool = False
    is_written: bool = False

    def expected(self) -> str:
        """What a right value looks like."""
        one = "a whole number" if self.integer else "a number"
        many = {1: one, 2: f"two {one[2:]}s", 0: f"a list of {one[2:]}s"}[self.count]
        return f"{many} from {self.low:g} to {self.high:g}"

    def check(self, value: object, *, where: str) -> None:
        """Raise `InputError` unless `value`, in the file's unit, is of the right kind and range."""
        if self.count == 1:
            values = [value]
        elif isinstance(value, (list, tuple)) and (not self.count or len(value) == self.count):
            values = list(value)
        else:
            raise InputError(where, value, self.expected())
        if not all(self._is_right(item) for item in values):
            hint = METRES if self.key.endswith("_mm") and are_metres(values) else ""
            is_number_in_text = isinstance(value, str) and value[:1].isdigit()
            hint = ALONE if is_number_in_text else hint or self._other_unit(values)
            raise InputError(where, value, self.expected(), hint=hint)

    def _other_unit(self, values: Sequence[object]) -> str:
        """A hint where all numbers are in range in another unit; empty where that is not so."""
        numbers = [one for one in values if isinstance(one, int | float) and 0.0 < abs(one) < 1e9]
        for ending, (factor, text) in OTHER_UNITS.items():
            is_it = self.key.endswith(ending) and 0 < len(numbers) == len(values)
            if is_it and all(self._is_right(factor * one) for one in numbers):
                return text
        return ""

    def _is_right(self, item: object) -> bool:
        if isinstance(item, bool) or not isinstance(item, (int, float)):
            return False
        # First the range: an integer of 400 digits is no float.
        if not self.low <= item <= self.high or not math.isfinite(item):
            return False
        return not self.integer or float(item).is_integer()

    def to_si(self, value: Any) -> Any:
        """A checked value of the file in SI units."""
        if self.count != 1:
            return tuple(self._convert(item) for item in value)
        return self._convert(value)

    def from_si(self, value: Any) -> Any:
        """A value in SI units as the file would have it."""
        if self.count != 1:
            return tuple(self._restore(item) for item in value)
        return self._restore(value)

    def _convert(self, value: float) -> float | int:
        return int(value) if self.integer else float(value) * self.scale

    def _restore(self, value: float) -> float | int:
        # 12 digits undo the rounding of the conversion, so that messages show what was written.
        return int(value) if self.integer else float(f"{value / self.scale:.12g}")


def are_metres(lengths: Sequence[object]) -> bool:
    """Whether lengths look like metres where millimetres are meant: small, and not all nothing."""
    numbers = [abs(one) for one in lengths if isinstance(one, int | float)]
    return len(numbers) == len(lengths) and 0.0 < max(numbers, default=0.0) < MOST_METRES


def quantity(
    key: str,
    scale: float,
    low: float,
    high: float,
    *,
    count: int = 1,
    integer: bool = False,
    default: Any = dataclasses.MISSING,
    is_written: bool = False,
) -> Any:
    """A dataclass field for a `Quantity`; see there for the parameters. `default` is in SI."""
    own = Quantity(key, scale, low, high, count=count, integer=integer, is_written=is_written)
    return dataclasses.field(default=default, metadata={"quantity": own})


def quantities(cls: Any) -> dict[str, Quantity]:
    """Field name to `Quantity` of a dataclass (or of an instance), in order."""
    return {
        field.name: field.metadata["quantity"]
        for field in dataclasses.fields(cls)
        if "quantity" in field.metadata
    }


def check_ranges(instance: Any, where: str) -> None:
    """Raise `InputError` unless every quantity of a dataclass instance lies in its range."""
    for name, spec in quantities(instance).items():
        value = getattr(instance, name)
        if value is None:
            continue  # Left out, where there is no value to fall back on.
        try:
            restored = spec.from_si(value)
        except (TypeError, ValueError):
            raise InputError(f"{where}.{spec.key}", value, spec.expected()) from None
        spec.check(restored, where=f"{where}.{spec.key}")


def in_mm(place: tuple[float, float]) -> list[float]:
    """A place (m) as an error shows it."""
    return [float(f"{value / MM:.9g}") for value in place]


NO_BLOCKS: Mapping[str, str] = MappingProxyType({})


def keys_of(cls: type) -> dict[str, dataclasses.Field[Any]]:
    """The fields of a dataclass by their keys in a file."""
    specs = quantities(cls)
    return {
        specs[own.name].key if own.name in specs else own.name: own
        for own in dataclasses.fields(cls)
    }


def part_of(
    cls: type[Part],
    table: object,
    where: str,
    nested: Callable[[str, Any, str], Any],
    blocks: Mapping[str, str] = NO_BLOCKS,
) -> Part:
    """One dataclass of quantities from one TOML table.

    Parameters
    ----------
    where
        The table's own key, before those in it.
    nested
        Makes a field that is no quantity, of its name, its value and its key.
    blocks
        By a key, where it goes, such as "into [plate]": for who wrote it in another block.

    Raises
    ------
    InputError
        Names every key that is unknown, missing or out of its range.
    """
    if not isinstance(table, dict):
        raise InputError(where, table, f"a block of the form [{where}]")
    specs, faults, values = quantities(cls), Faults(), {}
    fields = keys_of(cls)
    required = [key for key, own in fields.items() if own.default is dataclasses.MISSING]
    with faults.kept():
        check_keys(table, list(fields), required=required, where=f"{where}.", blocks=blocks)
    for key, own in fields.items():
        if key not in table:
            continue
        with faults.kept():
            if own.name in specs:
                specs[own.name].check(table[key], where=f"{where}.{key}")
                values[own.name] = specs[own.name].to_si(table[key])
            else:
                check_choice(cls, own.name, table[key], f"{where}.{key}")
                values[own.name] = nested(own.name, table[key], f"{where}.{key}")
    faults.tell()
    return cls(**values)


@functools.cache
def _choices(cls: type) -> dict[str, tuple[object, ...]]:
    """By field, the words that it may have."""
    hints = get_type_hints(cls)
    return {name: get_args(own) for name, own in hints.items() if get_origin(own) is Literal}


def check_choice(cls: type, name: str, value: object, key: str) -> None:
    """Raise `InputError`, naming the key, if a field may not have this word."""
    options = _choices(cls).get(name)
    if options is not None and (not isinstance(value, str) or value not in options):
        words = [str(own) for own in options if own]
        known = "one of: " + ", ".join(map(repr, words))
        raise InputError(key, value, known, hint=perhaps(value, words))


ALSO_CALLED = {
    "feet": "springs",
    "foot": "springs",
    "coils": "actuators",
    "foam": "foundation",
    "magnets": "magnet",
    "touch": "panel",
}
"""What people write for a key of another name."""
MEANT = {
    "panel.pixels": "how many places the touch controller tells apart along each side, by its data "
    "sheet or its settings, such as [320, 640]",
    "springs.stiffness_n_per_mm": "how stiff the spring is; or `part` in its place, a rubber foot "
    "that is known, such as rubber-foot-6x6",
}
"""What is asked for by a key whose name does not say it, or what may stand in its place."""


def near_name(given: object, known: Iterable[str]) -> str | None:
    """The known name that is most like what was given, if any is."""
    return next(iter(difflib.get_close_matches(str(given), list(known), n=1)), None)


def perhaps(given: object, known: Iterable[str]) -> str:
    """A hint at that name; empty where none is like it."""
    close = near_name(given, known)
    return f"{close}, perhaps" if close else ""


def _unnumbered(key: str) -> str:
    return re.sub(r"\[\d+\]", "", key)


def check_keys(
    table: dict[str, Any],
    known: Sequence[str],
    *,
    required: Sequence[str],
    where: str,
    blocks: Mapping[str, str] = NO_BLOCKS,
) -> None:
    """Raise `InputError` that names every key that is not known, and every one that is missing."""
    faults = Faults()
    for key, value in table.items():
        if key not in known:
            meant = ALSO_CALLED.get(key)
            close = meant if meant in known else near_name(key, known)
            hint = f"{close!r}, perhaps" if close else f"one of: {', '.join(known)}"
            if key in blocks:
                hint = f"this one goes {blocks[key]}"
            with faults.kept():
                raise InputError(f"{where}{key}", value, f"a known key: {hint}")
    for key in required:
        if key not in table:
            with faults.kept():
                raise MissingError(f"{where}{key}", MEANT.get(_unnumbered(f"{where}{key}"), ""))
    faults.tell()
