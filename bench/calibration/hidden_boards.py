"""How many decibels calibration brings back, on hidden boards of each kind. Appends a line a board.

    python bench/calibration/hidden_boards.py BOARD SEEDS ROWS.jsonl [WAY]
    python bench/calibration/hidden_boards.py ROWS.jsonl

The first form calibrates hidden boards 1 to SEEDS through an emulated device and keeps what came
out, those that are there already left out, by `coils`, `accelerometer` or `microphone`; the second
prints a table of all that is there.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.calibration import Truth, fit_board, hidden_plate
from chladni.calibration.hearing import Heard, fit_sound
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.laboratory.fields_fit import FieldsFit, fit_fields
from chladni.calibration.laboratory.measured_fields import joined
from chladni.calibration.parameters import INTERVAL, Parameter
from chladni.calibration.recorder import record_hidden
from chladni.calibration.sweep import heard_coils
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.emulation.shaken_plate import Sensor, ShakenPlate
from chladni.host.measuring.accelerometer import read_motions
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError

SETS = 40
WAYS = ("coils", "accelerometer", "microphone")
SENSOR_KG = 1.5e-3


def calibrated(name: str, seed: int, way: str) -> dict[str, Any]:
    """What came of one hidden board."""
    board = load_board(name)
    hidden = hidden_plate(board, seed)
    row: dict[str, Any] = {"board": name, "seed": seed, "way": way}
    try:
        if way == "coils":
            return row | _by_coils(board, hidden)
        found = _shaken(board, hidden) if way == "accelerometer" else _heard(board, hidden)
        row |= {"intervals": _intervals(hidden.ratios(board), found.parameters)}
        return row | _restored(board, hidden, found.board)
    except InputError as error:
        return row | {"refused": str(error)}


def _shaken(board: Board, hidden: HiddenPlate) -> FieldsFit:
    """With a sensor on each coil."""
    emulator = emulator_on(board, hidden, listens=False)
    standing = ShakenPlate(hidden, Sensor(SENSOR_KG), [own.at for own in board.actuators])
    parts = []
    with Device(EmulatorWire(emulator)) as device:
        for number, own in enumerate(board.actuators):
            standing.stand(emulator, number)
            parts.append(read_motions(device, board, own.at, SENSOR_KG))
    return fit_fields(board, joined(parts))


def _heard(board: Board, hidden: HiddenPlate) -> Heard:
    sweeps = heard_coils(*record_hidden(hidden), len(board.actuators))
    return fit_sound(board, sweeps)


def _restored(board: Board, hidden: HiddenPlate, found: Board) -> dict[str, Any]:
    truth = Truth.of(hidden, board, SETS)
    known = {"before": board, "after": found, "perfect": truth.perfectly_known()}
    return {
        key: {name: np.round(value, 2).tolist() for name, value in vars(truth.rows(own)).items()}
        for key, own in known.items()
    }


def _by_coils(board: Board, hidden: HiddenPlate) -> dict[str, Any]:
    with Device(EmulatorWire(emulator_on(board, hidden))) as device:
        readings = read_coils(device, board)
    found = fit_board(board, readings)
    signs = np.sign(hidden.strengths)
    alive = signs != 0.0
    off = found.strengths[alive] / np.abs(hidden.strengths[alive]) - 1.0
    return _restored(board, hidden, found.board) | {
        "wiring": found.wiring.signs.tolist() == signs.tolist(),
        "faults": int((signs <= 0.0).sum()),
        "force_off": float(np.sqrt(np.mean(off**2))),
        "left": found.left,
        "steps": found.steps,
        "intervals": _intervals(hidden.ratios(board), found.parameters),
        "device_s": readings.seconds,
    }


def _intervals(ratios: dict[str, float], found: Sequence[Parameter]) -> dict[str, list[float]]:
    """The truth of each value that is told over what was found, and its 95 % interval over it."""
    return {
        own.name: [each / own.value for each in (ratios[own.name], own.low, own.high)]
        for own in found
        if own.told
    }


def _interval_rows(rows: list[dict[str, Any]]) -> str:
    """How many intervals hold, and the RMS of what values are off in deviations: 1 if all fits."""
    by_name: dict[str, list[list[float]]] = {}
    for row in rows:
        for name, own in row["intervals"].items():
            by_name.setdefault("each foot" if name.startswith("foot") else name, []).append(own)
    if not by_name:
        return "none is told"
    every = {"all": [own for parts in by_name.values() for own in parts], **by_name}
    parts = []
    for name, own in every.items():
        truth, low, high = np.array(own).T
        holds = (low <= truth) & (truth <= high)
        off = np.log(truth) / (np.log(high / low) / (2.0 * INTERVAL))
        parts.append(f"{name} {holds.sum()} of {holds.size} ({np.sqrt(np.mean(off**2)):.2f})")
    return ", ".join(parts)


def _pooled(rows: list[dict[str, Any]], key: str, what: str) -> str:
    values = np.concatenate([np.array(row[key][what]) for row in rows])
    return (
        "–"
        if not values.size
        else " / ".join(f"{own:.1f}" for own in np.percentile(values, (50.0, 10.0)))
    )


def _kind(row: dict[str, Any]) -> tuple[str, str]:
    return row["board"], row.get("way", WAYS[0])


def main() -> None:
    """Calibrate, or print."""
    given = sys.argv[1:]
    if not 1 <= len(given) <= 4 or len(given) == 2 or given[0] in WAYS:
        sys.exit(__doc__)
    way = given.pop() if given[-1] in WAYS else WAYS[0]
    *kind, path = given
    kept = Path(path)
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    if kind:
        there = {row["seed"] for row in rows if _kind(row) == (kind[0], way)}
        for seed in sorted(set(range(1, int(kind[1]) + 1)) - there):
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(calibrated(kind[0], seed, way)) + "\n")
        return
    print("| board | boards | before | after | perfect | two fingers before | after | perfect |")
    print("|---|---|---|---|---|---|---|---|")
    for name, by in dict.fromkeys(map(_kind, rows)):
        own = [row for row in rows if _kind(row) == (name, by)]
        done = [row for row in own if "after" in row]
        cells = [
            _pooled(done, key, what)
            for what in ("second_finger_20mm_db", "fingers_2_db")
            for key in ("before", "after", "perfect")
        ]
        print(f"| `{name}`, {by} | {len(own)} | {' | '.join(cells)} |")
        off = np.abs(np.concatenate([np.array(row["after"]["level_db"]) for row in done]))
        level = " / ".join(f"{own:.2f}" for own in np.percentile(off, (50.0, 90.0)))
        print(f"  refused {len(own) - len(done)}, level off {level} dB")
        print(f"  intervals that hold, and RMS off in deviations: {_interval_rows(done)}")
        if by != WAYS[0]:
            continue
        print(
            f"  wiring right {sum(row['wiring'] for row in done)}, "
            f"with faults {sum(row['faults'] > 0 for row in done)}, "
            f"forces off {100 * np.median([row['force_off'] for row in done]):.1f} %, "
            f"plates solved {np.median([row['steps'] for row in done]):.0f}"
        )


if __name__ == "__main__":
    main()
