"""Effects over time: as they are asked for, and as fingers have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.effect import Effect
from chladni.effects.low_pass import EDGE_HZ
from chladni.host.emulation.played_effect import PlayedEffect
from chladni.host.figures.fields import INK

QUIET, RINGS, MARGIN = 0.03, 0.2, 1.1
"""Shares of their peaks below which what is asked for and the finger are over, and another finger;
how much later the axis ends."""
ASKED_FOR = f"asked for,\nup to {EDGE_HZ:g} Hz"
"""What is above that no device plays."""
SEEN = 0.05
"""Share of the finger's own row from which what another gets can be seen at the same scale."""
FROM = {
    False: "ms from the touch, which the panel reports up to 12 ms later (simulated)",
    True: "ms from the effect's beginning, under a finger that rested (simulated)",
}
ASKED, OWN, OTHER = "#767676", "#d55e00", "#0072b2"


def effect_figure(effect: Effect) -> Figure:
    """What a device plays of an effect."""
    figure = Figure(figsize=(8.0, 2.8), layout="constrained")
    axes = figure.subplots()
    samples = effect.samples(SIGNAL_HZ)
    axes.plot(1e3 * np.arange(len(samples)) / SIGNAL_HZ, samples, color=OWN, linewidth=1.2)
    axes.set_ylim(-1.05, 1.05)
    axes.set_ylabel("share of the loudest")
    axes.set_title(f"{effect.name}, as it is played: low-passed at 250 Hz", color=INK, fontsize=11)
    _time_axis(axes)
    return figure


def played_effects_figure(
    played: Sequence[PlayedEffect],
    titles: Sequence[str],
    heading: str | None = None,
    others: Sequence[str] = (),
) -> Figure:
    """A column for each effect: what was asked for, what its finger gets, and what another gets.

    Of one finger alone the other one is the loudest of which the device knows nothing.
    Each has its own time axis, which ends with its effect; `heading` stands above all of them, and
    each of `others` above what another finger gets.
    """
    has_other, count = _beside(played[0]) is not None, len(played)
    figure = Figure(figsize=(4.0 + 4.0 * count, 6.0 if has_other else 4.4), layout="constrained")
    rows = figure.subplots(3 if has_other else 2, count, sharex="col", sharey="row", squeeze=False)
    for column, own, title in zip(rows.T, played, titles, strict=True):
        _draw_played(column, own)
        column[0].set_title(title, color=INK, fontsize=11)
    other = "under the other:\nRMS over fingertip\n(no sign) / µm"
    if played[0].second_finger_20mm_at_mm is not None:
        where = "{:.3g}, {:.3g} mm".format(*played[0].second_finger_20mm_at_mm)
        other = other.replace("the other", f"another at\n{where}")
    if has_other:
        other += _scale_other(rows[1:], played)
    for axes, title in zip(rows[-1], others, strict=False):
        axes.set_title(title, color=INK, fontsize=10)
    for axes, label in zip(rows[:, 0], (ASKED_FOR, "under the finger / µm", other), strict=False):
        axes.set_ylabel(label)
    if heading is not None:
        figure.suptitle(heading, color=INK, fontsize=12)
    return figure


def _beside(played: PlayedEffect) -> NDArray[np.float64] | None:
    """What another finger has of it."""
    return played.far_um if played.other_um is None else played.other_um


def _draw_played(column: Sequence[Axes], played: PlayedEffect) -> None:
    times = 1e3 * played.t_s
    column[0].plot(times, played.asked, color=ASKED, linewidth=1.2)
    column[1].plot(times, played.own_um, color=OWN, linewidth=1.2)
    if (beside := _beside(played)) is not None:
        column[2].plot(times, beside, color=OTHER, linewidth=1.2)
    for axes in column[:-1]:
        axes.grid(alpha=0.3)
    column[0].set_xlim(0.0, _ends_ms(played))
    _time_axis(column[-1], FROM[played.rested])


def _scale_other(rows: NDArray[np.object_], played: Sequence[PlayedEffect]) -> str:
    """Give the other finger's row the own row's scale, where it can be seen; else a remark."""
    own, other = rows[0][0], rows[1][0]
    low, high = own.get_ylim()
    most = max(float(one.max()) for own in played if (one := _beside(own)) is not None)
    if most >= SEEN * max(-low, high):
        other.set_ylim(low, high)
        return ""
    other.set_ylim(0.0, 1.15 * most)
    return "\n(scale of its own)"


def _ends_ms(played: PlayedEffect) -> float:
    """When all that is drawn is over."""
    lasts = [(played.asked, QUIET), (played.own_um, QUIET)]
    beside = _beside(played)
    lasts += [] if beside is None else [(beside, RINGS)]
    last = max(
        int(np.flatnonzero(np.abs(own) >= share * np.abs(own).max())[-1])
        for own, share in lasts
        if np.any(own)
    )
    return float(1e3 * MARGIN * played.t_s[last])


def _time_axis(axes: Axes, label: str = "ms") -> None:
    axes.set_xlabel(label)
    axes.grid(alpha=0.3)
