"""Dataclass fields that know their key, unit and range in a board file."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from chladni.sim.errors import InputError

MM = 1e-3
"""A millimetre, in metres: places are given in the one and computed in the other."""


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
    """

    key: str
    scale: float
    low: float
    high: float
    count: int = 1
    integer: bool = False

    def expected(self) -> str:
        """What a right value looks like."""
        one = "a whole number" if self.integer else "a number"
        many = {1: one, 2: f"two {one[2:]}s", 0: f"a list of {one[2:]}s"}[self.count]
        return f"{many} from {self.low:g} to {self.high:g}"

    def check(self, value: object, *, where: str) -> None:
        """Raise `InputError` unless `value`, in the file's unit, is of the right kind and range."""
        values: list[object] = [value]
        if self.count != 1:
            if not isinstance(value, (list, tuple)):
                raise InputError(where, value, self.expected())
            values = list(value)
            if self.count and len(values) != self.count:
                raise InputError(where, value, self.expected())
        for item in values:
            if isinstance(item, bool) or not isinstance(item, (int, float)):
                raise InputError(where, value, self.expected())
            # First the range: an integer of 400 digits is no float.
            if not self.low <= item <= self.high or not math.isfinite(item):
                raise InputError(where, value, self.expected())
            if self.integer and not float(item).is_integer():
                raise InputError(where, value, self.expected())

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


def quantity(
    key: str,
    scale: float,
    low: float,
    high: float,
    *,
    count: int = 1,
    integer: bool = False,
    default: Any = dataclasses.MISSING,
) -> Any:
    """A dataclass field for a `Quantity`; see there for the parameters. `default` is in SI."""
    return dataclasses.field(
        default=default,
        metadata={"quantity": Quantity(key, scale, low, high, count=count, integer=integer)},
    )


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
