"""Files of a laboratory: CSV, NPZ and UFF 58."""

from __future__ import annotations

import contextlib
import csv
import io
import re
from pathlib import Path
from typing import Any, cast

import numpy as np

from chladni.calibration.laboratory.measured_fields import (
    PERS,
    RESPONSES,
    MeasuredFields,
    Per,
    Response,
    checked,
)
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.sim.files import read_arrays, read_text, read_whole

COLUMNS = ("coil", "x_mm", "y_mm", "hz", "real", "imag")
MOST_BYTES = 200_000_000
MOST_APART = 3e-3
"""m, from a coil's drawn place to the node of an UFF file that is driven."""
SI, OF_USER = 1, 9
"""Units' code of dataset 164."""
NUMERATORS: dict[int, Response] = {8: "displacement", 11: "velocity", 12: "acceleration"}
DENOMINATOR_FORCES = (9, 13)
"""Reaction and excitation force, by the datasets' specific data types."""
MARK = re.compile(rb"    -1(?=[\r\n]|\Z| {74})")
"""Begins and ends a set of an UFF file, as pyuff has it; blanks may follow to 80 columns."""
ENDINGS = (".csv", ".npz", ".uff", ".unv")


def read_measured(
    path: Path, board: Board, response: str | None = None, per: str | None = None
) -> MeasuredFields:
    """What a file says that a board's coils do.

    Parameters
    ----------
    response, per
        What the file's numbers are, where it does not say so itself; displacement over force.

    Raises
    ------
    InputError
        Another ending, no such file, or nothing in it that tells a coil's field; says why.
    """
    for option, own, known in (("response", response, RESPONSES), ("per", per, PERS)):
        if own is not None and own not in known:
            raise InputError(option, own, f"one of: {', '.join(known)}")
    readers = {".csv": _read_csv, ".npz": _read_npz, ".uff": _read_uff, ".unv": _read_uff}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputError("measured", str(path), f"a file that ends in {', '.join(ENDINGS)}")
    asked = cast("Response | None", response), cast("Per | None", per)
    return checked(reader(path, board, *asked), board, str(path))


def fields_csv(fields: MeasuredFields) -> bytes:
    """A file that `read_measured` reads as these fields."""
    rows = zip(
        (fields.coils + 1).tolist(),
        *(1e3 * fields.places).T.tolist(),
        fields.hz.tolist(),
        fields.values.real.tolist(),
        fields.values.imag.tolist(),
        strict=True,
    )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(rows)
    return text.getvalue().encode()


def _read_csv(
    path: Path, board: Board, response: Response | None, per: Per | None
) -> MeasuredFields:
    del board
    rows = csv.reader(io.StringIO(read_text(path, "measured", MOST_BYTES)))
    header = [name.strip() for name in next(rows, [])]
    if header != list(COLUMNS):
        expected = f"a first line {','.join(COLUMNS)}"
        raise InputError("columns", ",".join(header), expected, file=str(path))
    numbers = []
    for line, row in enumerate(rows, 2):
        if not row:
            continue
        try:
            numbers.append([float(value) for value in row])
        except ValueError:
            raise InputError(f"line {line}", ",".join(row), "numbers", file=str(path)) from None
        if len(row) != len(COLUMNS):
            expected = f"{len(COLUMNS)} numbers"
            raise InputError(f"line {line}", f"{len(row)} of them", expected, file=str(path))
    return _of_columns(np.array(numbers).reshape(-1, len(COLUMNS)), response, per)


def _read_npz(
    path: Path, board: Board, response: Response | None, per: Per | None
) -> MeasuredFields:
    del board
    try:
        arrays = read_arrays(path, "measured", MOST_BYTES)
        columns = [np.asarray(arrays[name], np.float64).ravel() for name in COLUMNS]
    except KeyError as error:
        given = ", ".join(sorted(arrays))
        raise InputError("arrays", given, f"{error.args[0]} too", file=str(path)) from None
    except (ValueError, TypeError) as error:
        raise InputError("measured", f"{error}", "arrays of numbers", file=str(path)) from None
    if len({own.size for own in columns}) != 1:
        sizes = ", ".join(str(own.size) for own in columns)
        raise InputError("arrays", sizes, "as many values of each", file=str(path))
    return _of_columns(np.stack(columns, axis=1), response, per)


def _of_columns(columns: Any, response: Response | None, per: Per | None) -> MeasuredFields:
    coil, x, y, hz, real, imag = columns.T
    whole = np.where(np.isfinite(coil), coil, 0.0).astype(np.int64)
    return MeasuredFields(
        whole - 1,
        1e-3 * np.stack((x, y), axis=1),
        hz,
        real + 1j * imag,
        response or "displacement",
        per or "force",
    )


def _read_uff(
    path: Path, board: Board, response: Response | None, per: Per | None
) -> MeasuredFields:
    """Frequency responses of dataset 58 at nodes of 15 or 2411, z alone.

    Raises
    ------
    InputError
        No pyuff, or what is missing in the file.
    """
    try:
        import pyuff  # noqa: PLC0415
    except ImportError:
        hint = "pip install chladni[laboratory]"
        raise InputError("measured", path.suffix, "a file that needs pyuff", hint=hint) from None
    whole = read_whole(path, "measured", MOST_BYTES)
    try:
        # Some sets are printed as they are read.
        with contextlib.redirect_stdout(io.StringIO()):
            found = pyuff.UFF(str(path)).read_sets()
    except Exception as error:
        given = f"{type(error).__name__}: {error}"
        raise InputError("datasets", given, "what pyuff reads", file=str(path)) from None
    sets = found if isinstance(found, list) else [found]
    marks = len(MARK.findall(whole))
    if sets and marks % 2:
        expected = "an end (-1) of each set: the last one is cut short"
        raise InputError("datasets", f"{marks} lines of -1", expected, file=str(path))
    _check_units(sets, path)
    nodes = _nodes(sets)
    responses = [own for own in sets if own.get("type") == 58 and own.get("func_type") == 4]
    kinds = ", ".join(sorted({_kind(own) for own in sets}))
    if not responses:
        expected = "frequency responses (58 of function 4)"
        hint = "shapes (55) lack the force that made them" if "55" in kinds else ""
        raise InputError("datasets", kinds or "none", expected, hint=hint, file=str(path))
    if not nodes:
        raise InputError("datasets", kinds, "nodes too (15 or 2411)", file=str(path))
    parts = [part for own in responses if (part := _row(own, nodes, board)) is not None]
    if not parts:
        expected = "some across the board (±z), driven at the place of a coil"
        raise InputError("responses", f"{len(responses)} others", expected, file=str(path))
    kinds_found = {part[0] for part in parts}
    if len(kinds_found) > 1:
        expected = "one kind of response in a file"
        raise InputError("responses", f"{len(kinds_found)} kinds", expected, file=str(path))
    said_response, said_per = next(iter(kinds_found))
    rows = [np.concatenate(own) for own in zip(*(part[1] for part in parts), strict=True)]
    coils, x, y, hz, values = rows
    return MeasuredFields(
        coils.real.astype(np.int64),
        np.stack((x.real, y.real), axis=1),
        hz.real,
        values,
        said_response or response or "displacement",
        said_per or per or "force",
    )


def _kind(own: dict[str, Any]) -> str:
    number = own.get("type")
    return f"{number} of function {own.get('func_type')}" if number == 58 else str(number)


def _check_units(sets: list[dict[str, Any]], path: Path) -> None:
    for own in sets:
        # Units of a user's own have factors over SI, which are 1 where a program had none to ask.
        is_si = own.get("units_code") == SI or (
            own.get("units_code") == OF_USER and own.get("length") == own.get("force") == 1.0
        )
        if own.get("type") == 164 and not is_si:
            given = f"{own.get('units_code')} ({str(own.get('units_description', '')).strip()})"
            raise InputError("units", given, f"{SI}, SI: metres", file=str(path))


def _nodes(sets: list[dict[str, Any]]) -> dict[int, tuple[float, float]]:
    """Places by a node's number; a set without them has none."""
    nodes: dict[int, tuple[float, float]] = {}
    for own in sets:
        grid = own.get("grid_global")
        if own.get("type") == 2411 and grid is not None:
            numbers, x, y = (np.asarray(grid)[:, k] for k in range(3))
        elif own.get("type") in (15, 2411) and "node_nums" in own:
            numbers, x, y = own["node_nums"], own["x"], own["y"]
        else:
            continue
        rows = zip(numbers, x, y, strict=True)
        nodes |= {int(number): (float(at_x), float(at_y)) for number, at_x, at_y in rows}
    return nodes


def _row(
    own: dict[str, Any], nodes: dict[int, tuple[float, float]], board: Board
) -> tuple[tuple[Response | None, Per | None], list[Any]] | None:
    """Coil, place, frequencies and values of one response; None of one that is not across."""
    across = {3: 1.0, -3: -1.0}
    at, driven = nodes.get(own.get("rsp_node", 0)), nodes.get(own.get("ref_node", 0))
    sign = across.get(own.get("rsp_dir", 0), 0.0) * across.get(own.get("ref_dir", 0), 0.0)
    if at is None or driven is None or not sign:
        return None
    apart = [
        float(np.hypot(driven[0] - one.at[0], driven[1] - one.at[1])) for one in board.actuators
    ]
    coil = int(np.argmin(apart))
    if apart[coil] > MOST_APART:
        return None
    hz, values = np.asarray(own["x"], np.float64), sign * np.asarray(own["data"], np.complex128)
    keep = hz > 0.0
    hz, values = hz[keep], values[keep]
    ones = np.ones(hz.size)
    response = NUMERATORS.get(int(own.get("ordinate_spec_data_type", 0)))
    is_force = int(own.get("orddenom_spec_data_type", 0)) in DENOMINATOR_FORCES
    return (response, "force" if is_force else None), [
        coil * ones,
        at[0] * ones,
        at[1] * ones,
        hz,
        values,
    ]
