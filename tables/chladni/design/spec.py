"""What a design is asked for: a board file in which values are open, and a `[design]` block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.design.keep_out import KeepOut, check_keep_outs
from chladni.design.pins import check_coils, check_pins, chip_of, of_its_driver, with_derived
from chladni.design.variables import (
    Choice,
    Document,
    Variable,
    filled,
    openings_told,
    range_of,
    variables_of,
)
from chladni.design.weights import (
    COSTS,
    FINGER_TERMS,
    OF_COILS,
    OF_FINGERS,
    PLAIN_WEIGHTS,
    weights_of,
)
from chladni.sim.board.checks import named
from chladni.sim.board.file import (
    file_of,
    homes_of_keys,
    parse_document,
    part_from,
    parts_from,
    parts_of,
    read_document,
    shipped_specs,
)
from chladni.sim.board.quantity import CENTIMETRES, MM, check_keys, keys_of, quantity
from chladni.sim.errors import ArgumentError, Faults, InputError, MissingError

COILS = 64
"""That a board without electronics may have."""
MOST_EVALUATIONS = 1_000_000
SPACING = 8e-3
"""m between coils where neither winding nor magnet is given."""
GAP_MM = 0.5  # between windings, or magnets, side by side
BESIDE_SETTINGS = ("coils", "keep_out", "symmetric", "weights")
"""Keys of `[design]` that are no plain quantities."""
FIELD, WHAT = "spec", "a design's TOML file"
"""As errors name it."""
PACKED = np.pi / np.sqrt(12.0)
"""Share of an area that equal circles can cover."""


@dataclass(frozen=True)
class DesignSettings:
    """Limits and search settings of a `[design]` block; lengths in m, mass in g.

    Attributes
    ----------
    coil_spacing
        Least distance of two coils' centres; if left out, what windings and magnets need.
    edge
        Least distance of a coil's centre from the plate's edges; a magnet's radius if left out.
    mass_g, first_natural_hz
        The most that plate and magnets may weigh; the least first natural frequency of the plate.
    finger_um
        The least under the finger, 10th percentile, if it is told (`evaluate.least_um`).
    evaluations
        How many boards the search may look at.
    samples, pitch
        Random boards and places by which it compares them.
    """

    coil_spacing: float = quantity("coil_spacing_mm", MM, 0.1, 500.0, default=SPACING)
    edge: float | None = quantity("edge_mm", MM, 0.0, 2500.0, default=None)
    mass_g: float | None = quantity("mass_g", 1.0, 1e-3, 1e6, default=None)
    first_natural_hz: float | None = quantity("first_natural_hz", 1.0, 1.0, 1e5, default=None)
    finger_um: float | None = quantity("finger_um", 1.0, 0.0, 1000.0, default=None)
    evaluations: int = quantity("evaluations", 1.0, 1, MOST_EVALUATIONS, integer=True, default=200)
    samples: int = quantity("samples", 1.0, 1, 1000, integer=True, default=4)
    pitch: float = quantity("pitch_mm", MM, 0.5, 500.0, default=6e-3)


DESIGN_KEYS = [*keys_of(DesignSettings), *BESIDE_SETTINGS]


@dataclass(frozen=True)
class Spec:
    """A design's question.

    Attributes
    ----------
    document
        A board's, with open values in it and without `[design]`.
    variables
        What is open, coils' places aside.
    coils
        Numbers of coils to look at where places are free; empty where actuators are given.
    symmetric
        Whether coils are placed alike on both sides of the middle lines. None: where the plate
        with what holds it is alike there.
    weights
        By term.
    """

    document: Document
    variables: tuple[Variable, ...]
    coils: tuple[int, ...]
    settings: DesignSettings = DesignSettings()
    keep_out: tuple[KeepOut, ...] = ()
    symmetric: bool | None = None
    weights: Mapping[str, float] = field(default_factory=lambda: dict(PLAIN_WEIGHTS))

    @property
    def places_are_free(self) -> bool:
        """Whether coils are to be placed."""
        return bool(self.coils)

    @property
    def is_for_several(self) -> bool:
        """As its boards are."""
        return "fingers" in self.document and "focus" not in self.document

    @property
    def finger_counts(self) -> tuple[int, ...]:
        """Numbers of fingers that are weighed together; none where one finger's focus is alone."""
        counts = tuple(count for name, count in FINGER_TERMS.items() if name in self.weights)
        return counts or ((2,) if OF_FINGERS & self.weights.keys() else ())


def read_spec(spec: str | Path) -> Spec:
    """Read a SPEC.

    Parameters
    ----------
    spec
        Path of a TOML file, or the name of a shipped one (`strip`, `strip-open`, `pad-open`).

    Raises
    ------
    InputError
        The file, or something in it, is wrong; names file, key and value.
    """
    path = file_of(spec, shipped_specs(), FIELD, WHAT)
    return _in_file(read_document(path, FIELD, WHAT), str(path))


def parse_spec(text: str, *, file: str) -> Spec:
    """A SPEC from the text of its file, which errors call `file`.

    Raises
    ------
    InputError
        As `read_spec`.
    """
    return _in_file(parse_document(text, FIELD, WHAT, file=file), file)


def _in_file(document: Document, file: str) -> Spec:
    try:
        return spec_of(named(document, file))
    except InputError as error:
        raise error.in_file(file) from None


def spec_of(document: Document) -> Spec:
    """The question that a document asks; an error names all that is wrong with it."""
    board = {"actuators": "free"} | {k: v for k, v in document.items() if k != "design"}
    block = document.get("design", {})
    if not isinstance(block, dict):
        raise InputError("design", block, "a block of the form [design]")
    own, faults = dict(block), Faults()
    coils = own.pop("coils", None)
    keep_out, weights = own.pop("keep_out", []), own.pop("weights", None)
    symmetric = own.pop("symmetric", None)
    own.setdefault("coil_spacing_mm", _spacing_mm(board))
    board = with_derived(board)
    with faults.kept():
        check_keys(own, DESIGN_KEYS, required=[], where="design.", blocks=homes_of_keys())
    with faults.kept():
        known = {key: value for key, value in own.items() if key in DESIGN_KEYS}
        settings = part_from(DesignSettings, known, "design")
    with faults.kept():
        if symmetric is not None and not isinstance(symmetric, bool):
            raise InputError("design.symmetric", symmetric, "true or false")
    with faults.kept():
        kept_out = parts_from(KeepOut, keep_out, "design.keep_out")
    with faults.kept():
        wanted = weights_of(weights)
        felt = sorted(OF_COILS & set(weights or ()))
        if felt and not {"coil", "winding"} & document.keys():
            raise MissingError("coil", f"design.weights.{felt[0]} counts micrometres")
    with faults.kept():
        counts = _coil_counts(board, coils)
        given = board["actuators"]
        most = max(counts, default=len(given) if isinstance(given, list) else COILS)
        check_pins(document.get("electronics"), most)
    with faults.kept():
        variables = _variables(board)
        if any(own.where == ("fingers", "apart_mm") for own in variables):
            expected = "one number: no search chooses what it is rated by"
            raise InputError("fingers.apart_mm", board["fingers"]["apart_mm"], expected)
    faults.tell()
    if not variables and not counts:
        raise ArgumentError(
            "spec",
            "nothing free",
            'a range { from = …, to = … }, a list { any = […] } or "free" somewhere',
            hint="chladni board score looks at a board that is all given",
        )
    own_board = _with_purpose(board, wanted)
    spec = Spec(own_board, variables, counts, settings, kept_out, symmetric, wanted)
    _check_room(spec)
    return spec


def _variables(board: Document) -> tuple[Variable, ...]:
    """What a board leaves open, coils' places aside, its other keys and values checked."""
    given = {key: value for key, value in board.items() if value != "free"}
    found = tuple(variables_of(given))
    _check_values(given, found, np.zeros(len(found)))
    for number, own in zip(np.eye(len(found)), found, strict=True):
        for k in range(1, round(own.most) + 1) if own.is_whole else ():
            _check_values(given, found, k * number)
    return found


def _check_values(given: Document, found: Sequence[Variable], at: NDArray[np.float64]) -> None:
    one: Document = {"actuators": []} | filled(given, found, at.tolist())
    if not one.get("image", {}).get("points", True):
        del one["image"]
    if isinstance(electronics := one.get("electronics"), dict):
        is_open = any(own.where == ("electronics", "drive") for own in found)
        one["electronics"] = of_its_driver(electronics, 0, is_open=is_open)
    with openings_told(DESIGN_KEYS):
        parts_of(one)


def _with_purpose(board: Document, weights: Mapping[str, float]) -> Document:
    """With the block that says what the board is for, as its weights have it.

    So the tables of the board that is found are made for what it was found for.
    """
    several = OF_FINGERS & weights.keys()
    if several and "fingers" not in board:
        board = board | {"fingers": {}}
    if (not several or weights.keys() - several - COSTS) and "focus" not in board:
        board = board | {"focus": {}}
    return board


def _spacing_mm(board: Document) -> float:
    """How close coils can be wound and magnets glued."""
    winding, magnet = board.get("winding"), board.get("magnet")
    widths = [winding.get("outer_mm") if isinstance(winding, dict) else None]
    if isinstance(magnet, dict) and isinstance(magnet.get("radius_mm"), int | float):
        widths.append(2.0 * magnet["radius_mm"])
    known = [width + GAP_MM for width in widths if isinstance(width, int | float)]
    return max(known, default=SPACING / MM)


def _coil_counts(board: Document, coils: Any) -> tuple[int, ...]:
    """How many coils a board may have; empty where its actuators are given."""
    if board.get("actuators") != "free":
        if coils is not None:
            expected = "nothing where actuators are given"
            raise InputError(
                "design.coils", coils, expected, hint='leave it out, or write actuators = "free"'
            )
        return ()
    if coils is None:
        raise MissingError("design.coils", "how many coils: a number, a range or a list")
    if isinstance(coils, dict) and coils.keys() == {"from", "to"}:
        ends = range_of(coils, ("design", "coils"))
        found: Sequence[Any] = range(int(ends.low), int(ends.high) + 1)
    elif isinstance(coils, dict) and coils.keys() == {"any"} and isinstance(coils["any"], list):
        found = coils["any"]
    else:
        found = [coils]
    electronics = board.get("electronics")
    own = electronics if isinstance(electronics, dict) else {}
    pins, channels = own.get("pwm_pins", []), chip_of(own).channels
    most = min(channels, len(pins)) if isinstance(pins, list) and pins else COILS
    for count in found:
        check_coils(count, most, channels)
    if not found:
        raise InputError("design.coils", coils, "one number of coils or more")
    return tuple(dict.fromkeys(found))


def _check_room(spec: Spec) -> None:
    """Refuse more coils than the largest plate can hold, and keep-outs beside it."""
    if not spec.places_are_free:
        return
    sides = [_largest(spec, axis) for axis in (0, 1)]
    check_keep_outs(spec.keep_out, sides)
    edge, apart = spec.settings.edge or 0.0, spec.settings.coil_spacing
    # Circles of the spacing's diameter round every centre lie within this rectangle.
    area = np.prod([max(side - 2.0 * edge, 0.0) + apart for side in sides])
    most = int(PACKED * area / (np.pi / 4.0 * apart**2))
    unit = f"plate.size_mm in {CENTIMETRES}" if min(sides) < apart else ""
    if min(side - 2.0 * edge for side in sides) < 0.0:
        expected = f"at most {min(sides) / 2.0 / MM:g}"
        raise InputError("design.edge_mm", edge / MM, expected, hint=unit)
    if min(spec.coils) > most:
        raise InputError(
            "design.coils",
            min(spec.coils),
            f"at most {most}, which is all that fits {apart / MM:g} mm apart on this plate",
            hint=unit or "lower coil_spacing_mm or the number",
        )


def _largest(spec: Spec, axis: int) -> float:
    """The longest side that is possible along an axis, m."""
    for variable in spec.variables:
        if variable.where in (("plate", "size_mm", axis), ("plate", "size_mm")):
            if isinstance(variable, Choice):
                values = [one[axis] if isinstance(one, list) else one for one in variable.options]
                return float(max(values)) * MM
            return variable.high * MM
    size = spec.document.get("plate", {}).get("size_mm")
    quantity_ok = isinstance(size, list) and len(size) == 2 and isinstance(size[axis], int | float)
    if not quantity_ok:
        raise InputError("plate.size_mm", size, "two lengths or ranges")
    return float(size[axis]) * MM
