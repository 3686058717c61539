"""Figure 3B: amplitude over drive, through the emulated firmware's pins.

The plate's model is linear by construction, so what can bend the line here is the firmware: gains
of 16 bits, duties of 10, a shortest pulse, and the end of the duty's range.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.drives.problem.problem import solved_board
from chladni.host.emulation._emulator import half_span_steps
from chladni.host.emulation.demodulate import PURITY_PERIODS, edge_sfdr_db, sfdr_db
from chladni.host.figures.fields import COLOURS, INK, save
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from paper import boards
from paper.numbers import Numbers, fixed
from paper.pins import Played, play

FloatArray = NDArray[np.float64]

FULL_Q15 = 32_767
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 16, 33, 66, 98, 164, 328, 655, 983, 1638, 3277, 6553, 9830,
          16384, 26214, 32767)  # fmt: skip
"""Gains that are asked for, in the steps of the device's own 16 bits."""
PLACES_MM = ((10.0, 0.0), (0.0, 20.0), (15.0, 25.0), (-20.0, -40.0))
"""Where the vibration is looked at: at several distances and directions from the middle coil."""
SHOWN = (1.0, 0.1, 0.01)
HEARD = 0.1
"""Share of the gain asked for below which a channel counts as silent."""
STRAIGHT_DB = 0.1


@cache
def _played(count: int) -> Played:
    gains = np.zeros(len(boards.computed().actuators), dtype=np.complex128)
    gains[boards.MIDDLE] = count / FULL_Q15
    return play(boards.computed(), gains)


def _curve() -> tuple[FloatArray, FloatArray]:
    """Gains asked for, and those that the pins make."""
    made = [abs(_played(count).gains[boards.MIDDLE]) for count in COUNTS]
    return np.array(COUNTS) / FULL_Q15, np.array(made)


def numbers() -> Numbers:
    """Where the line is straight, what is lost at its ends, and the harmonics of the pins."""
    board = boards.computed()
    asked, made = _curve()
    error_db = 20.0 * np.log10(np.maximum(made, 1e-9) / asked)
    straight = asked[np.abs(error_db) <= STRAIGHT_DB]
    inner = (made > HEARD * asked) & (asked < 0.9)
    one = np.zeros(len(board.actuators), dtype=np.complex128)
    one[boards.MIDDLE] = 1.0
    limit = full_drive(board, one, board.drive.frequency_hz)
    assert limit is not None
    span = half_span_steps(board.electronics.pwm_bits) / 2**board.electronics.pwm_bits
    found = {
        "straight_from": fixed(straight.min(), 3),
        "straight_db": fixed(STRAIGHT_DB, 1),
        "lost_steps": fixed(((asked - made) * FULL_Q15)[inner].max(), 0),
        "silent_steps": str(max(n for n, a, m in zip(COUNTS, asked, made, strict=True)
                                if m < HEARD * a)),
        "top_gain": fixed(made[-1], 3),
        "top_promised": fixed(limit.duties.max() / span, 3),
        "least_duty": str(_played(328).recording.duty_steps[:, boards.MIDDLE].min()),
    }  # fmt: skip
    for gain in (1.0, 0.1):
        pure = play(board, gain * one, 1e3 * PURITY_PERIODS / _played(1).recording.carrier_hz)
        name = f"{gain:g}".replace(".", "_")
        frequency = board.drive.frequency_hz
        for kind, measure in (("sfdr", sfdr_db), ("edges", edge_sfdr_db)):
            level = measure(pure.recording, pure.whole, frequency)[boards.MIDDLE]
            assert level is not None
            found[f"{kind}_{name}"] = fixed(level, 0)
    return found


def draw(folder: Path) -> None:
    """Micrometres at four places, what differs from a straight line, and three waves of duties."""
    asked, made = _curve()
    figure = Figure(figsize=(12.0, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    _draw_places(left, asked, made)
    heard = made > HEARD * asked
    middle.semilogx(
        asked[heard],
        20.0 * np.log10(made[heard] / asked[heard]),
        "o-",
        color=COLOURS[1],
        markersize=4,
    )
    middle.axhline(0.0, color=INK, linewidth=0.8, linestyle="--")
    middle.axvspan(asked[0], asked[~heard][-1], color="#eeeeee", zorder=0)
    middle.text(
        np.sqrt(asked[0] * asked[~heard][-1]),
        -2.6,
        "silent",
        fontsize=8,
        rotation=90,
        ha="center",
        color=INK,
    )
    middle.set_xlabel("gain asked for")
    middle.set_ylabel("gain at the pin / dB of that asked for")
    middle.set_title("What is missing of a straight line", fontsize=10, color=INK)
    _draw_waves(right)
    save(figure, folder / "paper-3b.png")


def _draw_places(axes: Axes, asked: FloatArray, made: FloatArray) -> None:
    board = boards.computed()
    field = np.abs(solved_board(board).fields.values[boards.MIDDLE])
    for (x, y), colour in zip(PLACES_MM, COLOURS, strict=False):
        i, j = (int(np.abs(own - at * MM).argmin()) for own, at in ((board.x, x), (board.y, y)))
        um = 1e6 * boards.newtons_per_gain(board) * field[i, j]
        axes.loglog(asked, um * asked, color=colour, linewidth=0.8)
        axes.loglog(
            asked,
            um * np.where(made > HEARD * asked, made, np.nan),
            "o",
            color=colour,
            markersize=4,
            label=f"{fixed(x)}, {fixed(y)} mm",
        )
    axes.set_xlabel("gain asked for")
    axes.set_ylabel("displacement, peak / µm")
    axes.legend(frameon=False, fontsize=8, title="place", title_fontsize=8)
    axes.set_title("Amplitude at four places, middle coil alone", fontsize=10, color=INK)


def _draw_waves(axes: Axes) -> None:
    board = boards.computed()
    for gain, colour in zip(SHOWN, COLOURS, strict=False):
        recording = _played(round(gain * FULL_Q15)).recording
        wave = round(2.0 * recording.carrier_hz / board.drive.frequency_hz)
        steps = recording.duty_steps[:wave, boards.MIDDLE]
        axes.plot(1e3 * recording.t_s[:wave], steps, color=colour, linewidth=0.8)
        highest = int(steps.argmax())
        axes.annotate(
            f"gain {gain:g}",
            (1e3 * recording.t_s[highest], 0.65 * steps[highest]),
            ha="center",
            va="top",
            fontsize=8,
            color=colour,
        )
    axes.set_yscale("log")
    axes.set_yticks([10, 30, 100, 300, 1000], ["10", "30", "100", "300", "1000"], minor=False)
    axes.minorticks_off()
    axes.set_xlabel("t / ms")
    axes.set_ylabel("duty / steps of 1024")
    axes.set_title("The pin: never shorter than a pulse can be", fontsize=10, color=INK)
