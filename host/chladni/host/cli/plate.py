"""Commands about the plate and the actuator: `field`, `modes` and `sweep`."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray

from chladni.drives.problem.search_cost import field_cost
from chladni.host.cli.common.options import (
    BoardArgument,
    FigureOption,
    JsonOption,
    LargeOption,
    check_figure,
    check_one_of,
)
from chladni.host.cli.common.output import (
    ARRAYS,
    Place,
    answer,
    check_output,
    parse_place,
    progress_bar,
    say,
    say_unmet,
    write_figure,
)
from chladni.host.cli.common.ranges import FREQUENCIES, within
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.actuator import WaveResponse, wave_response
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.cost import begin
from chladni.sim.errors import InputError, MissingError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.coil_on_plate import PlateCurve, acceleration_on_plate
from chladni.sim.fields.driven import driven_fields
from chladni.sim.fields.transfer import TOLERANCE, TransferFields, actuator_loads, target_field
from chladni.sim.files import read_text, write_arrays
from chladni.sim.image.energy import compose, energy_image
from chladni.sim.plate.response import PlateModel, Response

LARGEST_GAIN = 1e9
"""Beyond any drive; keeps fields finite."""
MOST_MODES = 500
PLATE_STEP = 5
"""Every so many of a sweep's frequencies the plate is asked for."""
DRIVE_BYTES = 1_000_000
"""The output of `chladni solve --json` has some thousands."""


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(field)
    app.command()(modes)
    app.command()(sweep)


def field(
    board: BoardArgument,
    output: Annotated[Path, typer.Option("-o", "--output", help="File to write (.npz).")],
    target: Annotated[str | None, typer.Option(help="Unit load at X,Y (mm).")] = None,
    actuator: Annotated[str | None, typer.Option(help="Unit drive of one actuator.")] = None,
    drive: Annotated[Path | None, typer.Option(help="Drive from `chladni solve --json`.")] = None,
    tolerance: Annotated[
        float, typer.Option(callback=within(1e-9, 0.1), help="Relative error asked for.")
    ] = TOLERANCE,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute a displacement field and its energy image."""
    check_one_of(target=target is not None, actuator=actuator is not None, drive=drive is not None)
    _check_outputs(output, figure)
    loaded = load_board(board)
    place = parse_place(target, "--target") if target is not None else None
    index = _index_of(loaded, actuator) if actuator is not None else None
    amplitudes, marked = _read_drive(drive, loaded) if drive is not None else (None, None)
    started = time.perf_counter()
    begin(field_cost(loaded))
    found: Response | TransferFields
    if place is not None:
        found = target_field(loaded, place, tolerance=tolerance, allow_unmet=True)
    else:
        found = driven_fields(loaded, tolerance=tolerance, allow_unmet=True)
    values = found.values[index or 0]
    if amplitudes is not None:
        values = compose(found.values, amplitudes)
    seconds = time.perf_counter() - started
    say_unmet(found.error_estimate, tolerance)
    write_arrays(
        output,
        x_mm=loaded.x / MM,
        y_mm=loaded.y / MM,
        displacement=values,
        energy=energy_image(values),
    )
    if figure:
        from chladni.host.figures.fields import field_figure  # noqa: PLC0415

        drawn = field_figure(
            loaded, values, target_mm=place or marked, per_newton=amplitudes is None
        )
        write_figure(drawn, figure)
    result = {
        "path": str(output),
        "modes_used": found.modes_used,
        "error_estimate": found.error_estimate,
        "tolerance_met": found.tolerance_met,
        "seconds": seconds,
    }
    answer(result, as_json=as_json, title=f"Field on {loaded.name}")


def modes(
    board: BoardArgument,
    count: Annotated[
        int, typer.Option(callback=within(1, MOST_MODES), help="How many modes.")
    ] = 10,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Shapes (.npz).")] = None,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """List natural frequencies and modal masses; draw nodal lines (Chladni figures)."""
    _check_outputs(output, figure)
    loaded = load_board(board)
    started = time.perf_counter()
    shapes = plate_model(loaded).modes(count, actuator_loads(loaded), loaded.x, loaded.y)
    seconds = time.perf_counter() - started
    if output:
        write_arrays(
            output,
            x_mm=loaded.x / MM,
            y_mm=loaded.y / MM,
            frequencies_hz=shapes.frequencies_hz,
            shapes=shapes.shapes,
            modal_masses_g=shapes.modal_masses * 1e3,
        )
    if figure:
        from chladni.host.figures.fields import modes_figure  # noqa: PLC0415

        write_figure(modes_figure(loaded, shapes), figure)
    result = {
        "name": loaded.name,
        "modes_hz": shapes.frequencies_hz.tolist(),
        "modal_masses_g": (shapes.modal_masses * 1e3).tolist(),
        "seconds": seconds,
    }
    answer(result, as_json=as_json, title=f"Modes of {loaded.name}")


def sweep(
    board: BoardArgument,
    start_hz: Annotated[
        float | None,
        typer.Option(
            "--from",
            callback=FREQUENCIES,
            help="First frequency, Hz; 100 by default, or below the plate's first mode.",
        ),
    ] = None,
    stop_hz: Annotated[
        float, typer.Option("--to", callback=FREQUENCIES, help="Last frequency, Hz.")
    ] = 400.0,
    actuator: Annotated[
        str | None, typer.Option(help="Whose coil is driven; the board's first by default.")
    ] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Curves (.npz).")] = None,
    figure: FigureOption = None,
    large: LargeOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compute the plate's acceleration under one coil over frequency, and that coil's on its latch.

    A latch, where the board file gives one, answers to the paper's four waves.
    """
    _check_outputs(output, figure)
    loaded = load_board(board)
    if loaded.coil is None:
        raise MissingError("[coil]", "the block of the actuator's figures", file=board)
    index = _index_of(loaded, actuator) if actuator is not None else 0
    model = plate_model(loaded)
    start_hz = _first_hz(model) if start_hz is None else start_hz
    if not start_hz < stop_hz:
        raise InputError("--from, --to", f"{start_hz:g}, {stop_hz:g}", "ascending")
    frequencies = np.linspace(start_hz, stop_hz, 601)
    # The plate takes some milliseconds a frequency, and its curve bends less than a latch's.
    coarse = frequencies[::PLATE_STEP]
    with progress_bar("frequencies") as progress:
        found = acceleration_on_plate(loaded, index, coarse, model=model, progress=progress)
    per_volt = np.abs(found)
    on_plate = PlateCurve(coarse, np.sqrt(2.0) * loaded.coil.rms_voltage * per_volt)
    curves = {
        wave: wave_response(loaded.coil, wave, frequencies)
        for wave in (WAVEFORMS if loaded.coil.latch else ())
    }
    if output:
        arrays = {
            f"{wave}_{name}": getattr(curve, name)
            for wave, curve in curves.items()
            for name in ("fundamental", "rms", "distortion", "correlation")
        }
        arrays |= {"plate_frequencies_hz": coarse, "plate_m_s2": on_plate.acceleration}
        write_arrays(output, frequencies_hz=frequencies, **arrays)
    if figure:
        from chladni.host.figures.sweeps import sweep_figure  # noqa: PLC0415

        title = f"{loaded.name}, coil {loaded.actuators[index].name}"
        drawn = sweep_figure(loaded.coil, frequencies, curves, on_plate, title=title)
        write_figure(drawn, figure)
    loudest, own_modes = int(on_plate.acceleration.argmax()), model.natural_frequencies(10).tolist()
    among = [one for one in own_modes if start_hz <= one <= stop_hz]
    result = {
        "name": loaded.name,
        "plate": {
            "actuator": loaded.actuators[index].name,
            "loudest_hz": float(coarse[loudest]),
            "loudest_m_s2": float(on_plate.acceleration[loudest]),
            "modes_hz": among,
        },
        "waves": [_wave(wave, frequencies, curve) for wave, curve in curves.items()],
    }
    if not among:
        _say_none(own_modes, stop_hz)
    _say_end(coarse, loudest)
    answer(result, as_json=as_json, title=f"Sweep of {loaded.name}")


def _first_hz(model: PlateModel) -> float:
    """Where a sweep begins: 100 Hz, or a fifth below a first mode that lies there or lower."""
    # A free plate's first modes are its motions as a whole, at 0 Hz.
    lowest = min((one for one in model.natural_frequencies(10) if one >= 1.0), default=np.inf)
    return 100.0 if lowest > 110.0 else float(max(1.0, np.floor(0.8 * lowest)))


def _say_none(modes_hz: list[float], stop_hz: float) -> None:
    first = next((one for one in modes_hz if one > stop_hz), None)
    beyond = "" if first is None else f"; the next one is {first:.4g} Hz"
    say(f"none of the plate's natural frequencies is among these{beyond}")


def _say_end(frequencies: NDArray[np.float64], loudest: int) -> None:
    if loudest in (0, len(frequencies) - 1):
        end = f"{frequencies[loudest]:g} Hz"
        say(f"{end} is an end of what was looked at: the plate may be louder beyond")


def _wave(wave: str, frequencies_hz: NDArray[np.float64], curve: WaveResponse) -> dict[str, Any]:
    """What one wave makes of a coil on its latch."""
    peak = int(curve.fundamental.argmax())
    return {
        "waveform": wave,
        "peak_hz": float(frequencies_hz[peak]),
        "peak_m_s2": float(curve.fundamental[peak]),
        "distortion_at_peak": float(curve.distortion[peak]),
        "correlation_at_end": float(curve.correlation[-1]),
    }


def _check_outputs(output: Path | None, figure: Path | None) -> None:
    if output:
        check_output(output, "-o", ARRAYS)
    check_figure(figure)


def _index_of(board: Board, actuator: str) -> int:
    names = [item.name for item in board.actuators]
    if actuator not in names:
        raise InputError("--actuator", actuator, "one of: " + ", ".join(names))
    return names.index(actuator)


def _read_drive(path: Path, board: Board) -> tuple[NDArray[np.complex128], Place | None]:
    """A drive as `chladni solve --json` writes it, and its target if the board has that place."""
    file = str(path)
    try:
        document = json.loads(read_text(path, "--drive", DRIVE_BYTES))
    except (ValueError, RecursionError) as error:
        raise InputError("--drive", str(error), "JSON", file=file) from None
    entries = document.get("drive") if isinstance(document, dict) else None
    if not isinstance(entries, list) or len(entries) != len(board.actuators):
        expected = f"a list of {len(board.actuators)} drives, one per actuator"
        raise InputError("drive", entries, expected, file=file)
    values = np.zeros(len(entries), dtype=np.complex128)
    seen: set[int] = set()
    for k, entry in enumerate(entries):
        try:
            index = _index_of(board, entry["actuator"])
            gain, phase = float(entry["gain"]), float(entry["phase_deg"])
        except (KeyError, TypeError, ValueError, OverflowError, InputError):
            expected = "actuator (of the board), gain and phase_deg"
            raise InputError(f"drive[{k}]", entry, expected, file=file) from None
        if not (abs(gain) <= LARGEST_GAIN and np.isfinite(phase)):
            raise InputError(f"drive[{k}]", entry, f"gains up to {LARGEST_GAIN:g}", file=file)
        if index in seen:
            raise InputError(f"drive[{k}]", entry, "each actuator once", file=file)
        seen.add(index)
        values[index] = gain * np.exp(1j * np.radians(phase))
    return values, _target_of(document, board)


def _target_of(document: dict[str, Any], board: Board) -> Place | None:
    """The place that a drive is for, mm, where it is one on the board."""
    try:
        x, y = (float(along) for along in document["target_mm"])
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    return (x, y) if board.contains(x * MM, y * MM) else None
