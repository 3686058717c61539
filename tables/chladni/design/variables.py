"""What of a board file is open: a range, a list, or `free`, wherever a value may stand."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from chladni.sim.board.catalogue import SHEETS
from chladni.sim.board.file import homes_of_keys
from chladni.sim.board.foundation import MATERIALS
from chladni.sim.errors import FaultsError, InputError

Document = dict[str, Any]
Where = tuple[str | int, ...]

THICKNESS: Where = ("plate", "thickness_mm")
THIN_MM = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.6]
PLASTIC_MM = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0]
STEEL_MM = [0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.0, 1.5, 2.0, 3.0]
SOLD_MM = {
    "acrylic": PLASTIC_MM,
    "polycarbonate": PLASTIC_MM,
    "glass": [0.55, 0.7, 1.1, 2.0, 3.0, 4.0, 5.0, 6.0],
    "aluminium": [0.2, 0.3, 0.5, 0.8, 1.0, 1.5, 2.0, 3.0],
    "steel": STEEL_MM,
    "stainless-steel": STEEL_MM,
    "brass": STEEL_MM,
    "pet": [0.1, 0.125, 0.175, 0.19, 0.25, 0.35, 0.5],
}
"""Sheets as plastics, glass and metal shops have them; of others as board makers do."""
FREE: dict[Where, Any] = {
    THICKNESS: {"any": THIN_MM},
    ("plate", "material"): {"any": list(SHEETS)},
    ("foundation", "stiffness_n_per_mm3"): {"from": 0.003, "to": 0.3},
    ("foundation", "thickness_mm"): {"any": [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]},
    ("foundation", "material"): {"any": list(MATERIALS)},
    ("magnet", "radius_mm"): {"any": [1.5, 2.0, 2.5, 3.0, 4.0, 5.0]},
    ("magnet", "height_mm"): {"any": [1.0, 1.5, 2.0, 3.0, 4.0, 5.0]},
    ("drive", "frequency_hz"): {"from": 80.0, "to": 300.0},
    ("focus", "quieter_db"): {"from": 1.0, "to": 8.0},
    ("focus", "reserve_db"): {"from": 0.0, "to": 2.0},
    ("focus", "silent_from_mm"): {"from": 14.0, "to": 20.0},
}
"""What `free` stands for: sheets, foams and disc magnets as they are sold, and where fingers feel
best. Anything else needs a range. Of a range, too, what is sold is taken; one with nothing sold in
it is searched as it is."""
EDGES = ("plate", "edges")
OCTAVES = 4.0
"""A positive range whose ends are so many times apart is searched by ratios."""


@dataclass(frozen=True)
class Range:
    """A number between two others.

    A search gives it a share from 0 to 1; a range of several octaves is divided by ratios.
    """

    where: Where
    low: float
    high: float
    most: float = 1.0
    is_whole = False
    also: tuple[Where, ...] = ()

    def value(self, share: float) -> float:
        """The number at a share."""
        share = min(max(share, 0.0), 1.0)
        if self.low > 0.0 and self.high >= OCTAVES * self.low:
            found = self.low * (self.high / self.low) ** share
        else:
            found = self.low + (self.high - self.low) * share
        # What a file shows is what was computed.
        return float(f"{found:.5g}")


@dataclass(frozen=True)
class Choice:
    """One of several values, in their order; a search gives it a number from 0 on."""

    where: Where
    options: tuple[Any, ...]
    also: tuple[Where, ...] = ()
    """Where else the same value goes."""
    is_whole = True

    @property
    def most(self) -> float:
        """The last one's number."""
        return len(self.options) - 1.0

    def value(self, number: float) -> Any:
        """The value of a number, the nearest whole one."""
        return self.options[round(min(max(number, 0.0), self.most))]


Variable = Range | Choice


def variables_of(document: Document) -> list[Variable]:
    """All that is open in a board's document, in its order.

    Feet that may be of the same parts are one choice: a builder buys one kind of them.

    Raises
    ------
    InputError
        A range is empty, a list has no choice in it, or `free` stands where it has no meaning.
    """
    found: list[Variable] = []
    feet: dict[str, int] = {}
    plate = document.get("plate")
    material = plate.get("material") if isinstance(plate, dict) else None
    sold = SOLD_MM.get(material, THIN_MM) if isinstance(material, str) else THIN_MM
    free = FREE | {THICKNESS: {"any": sold}}
    for own in _open(document, (), free):
        first = len(found)
        if isinstance(own, Choice) and own.where[::2] == ("springs", "part"):
            first = feet.setdefault(str(own.options), first)
        if first == len(found):
            found.append(own)
        else:
            found[first] = replace(found[first], also=(*found[first].also, own.where))
    return found


def _open(value: Any, where: Where, free: Mapping[Where, Any]) -> Iterator[Variable]:
    """What is open in a value; `free`: what that stands for in this document."""
    if value == "free" and where[:2] == EDGES:
        return  # there it is what edges are
    if value == "free":
        if where not in free:
            known = ", ".join(key_of(one) for one in free)
            expected = f"a range, as nothing says what may be here; 'free' can be: {known}, or "
            raise InputError(key_of(where), value, expected + "actuators")
        yield from _open(free[where], where, free)
    elif isinstance(value, dict) and value.keys() == {"from", "to"}:
        own = range_of(value, where)
        sold = [one for one in free.get(where, {}).get("any", []) if own.low <= one <= own.high]
        yield Choice(where, tuple(sold)) if sold else own
    elif isinstance(value, dict) and value.keys() == {"any"}:
        options = value["any"]
        if not isinstance(options, list) or not options:
            raise InputError(f"{key_of(where)}.any", options, "a list of one value or more")
        yield Choice(where, tuple(options))
    elif isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for key, entry in entries:
            yield from _open(entry, (*where, key), free)


def range_of(value: dict[str, Any], where: Where) -> Range:
    """A range as a document has it: `{ from = 0.2, to = 0.8 }`."""
    ends = [value["from"], value["to"]]
    for end in ends:
        if isinstance(end, bool) or not isinstance(end, int | float):
            raise InputError(key_of(where), value, "numbers for both ends of a range")
    if not ends[0] < ends[1]:
        raise InputError(key_of(where), value, "a range whose 'from' is less than its 'to'")
    return Range(where, float(ends[0]), float(ends[1]))


def filled(document: Document, variables: Sequence[Variable], numbers: Sequence[float]) -> Document:
    """The document with a value for each variable."""
    own = copy.deepcopy(document)
    for variable, number in zip(variables, numbers, strict=True):
        for where in (variable.where, *variable.also):
            inner: Any = own
            for key in where[:-1]:
                inner = inner[key]
            inner[where[-1]] = variable.value(number)
    return own


def never_tried(
    variables: Sequence[Variable], documents: Sequence[Document]
) -> dict[str, tuple[Any, ...]]:
    """Values of lists that none of the documents has, by their keys; lists with none left out."""
    found = {}
    for own in variables:
        if not isinstance(own, Choice):
            continue
        tried = [_at(document, own.where) for document in documents]
        if left := tuple(one for one in own.options if one not in tried):
            found[key_of(own.where)] = left
    return found


def _at(document: Document, where: Where) -> Any:
    """The value there; None where a board of the other driver has no such key."""
    found: Any = document
    for key in where[:-1]:
        found = found[key]
    return found.get(where[-1]) if isinstance(found, dict) else found[where[-1]]


def key_of(where: Where) -> str:
    """A place in a document as errors name it: `plate.size_mm[1]`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in where)
    return text.lstrip(".")


@contextlib.contextmanager
def openings_told(design_keys: Sequence[str]) -> Iterator[None]:
    """Let errors of a board's values say what a SPEC may have there, and what [design] has."""
    try:
        yield
    except InputError as error:
        for own in error.errors if isinstance(error, FaultsError) else [error]:
            if isinstance(own.value, str) and own.expected.startswith("one of:"):
                or_any = "or { any = […] } of them, to be searched"
                own.hinted(f"{own.hint}, {or_any}" if own.hint else or_any)
            if isinstance(own.value, str | dict) and "number" in own.expected:
                own.hinted('or "free", { any = […] } or { from = …, to = … }, to be searched')
            key = own.field.rpartition(".")[2]
            is_unknown = own.expected.startswith("a known key")
            if is_unknown and key in design_keys and key not in homes_of_keys():
                own.expected = "a known key: this one goes into [design]"
                own.hinted(own.hint)
        error.hinted(error.hint)
        raise
