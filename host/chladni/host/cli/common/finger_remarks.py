"""What commands say of boards for several fingers: what each has, and what they may miss."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from chladni.drives.scoring.several_fingers.fingers_score import CountScore
from chladni.effects.low_pass import EDGE_HZ
from chladni.host.cli.common.output import say
from chladni.host.cli.common.verdicts import of_click
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM, SAME_PLACE
from chladni.sim.fields.board_mirrors import board_mirrors
from chladni.sim.fields.board_plate import first_natural_hz

NUMBER = {2: "Two", 3: "Three", 4: "Four", 5: "Five"}
CLEARLY_LESS_DB = 0.5
"""Of the median of pairs: less is what another sixty of them would change."""
LONGEST_PANEL = 0.18
"""m: an 8 inch tablet's, and bars of 6.9 inches that sense 163 mm."""
SOFT_RAMP_MS = 25.0
"""With which a switch's bias leaves a click what it keeps without one (docs/effects.md)."""


def say_waves(board: Board, modes_hz: Sequence[float] | None = None) -> None:
    """Remark on a plate that resonates among what effects are made of: gains do not hold there.

    Parameters
    ----------
    modes_hz
        Its lowest ones, if they are at hand.
    """
    if remark := of_waves(board, modes_hz):
        say(remark)


def of_waves(board: Board, modes_hz: Sequence[float] | None = None) -> str:
    """What `say_waves` says; nothing of a plate that does not."""
    first = first_natural_hz(board, modes_hz)
    if first >= EDGE_HZ - 0.5:  # which is written as no less
        return ""
    # On foam the whole sheet bounces: a thicker one is only heavier.
    on_foam = board.foundation is not None
    raised = (
        "a lighter sheet or stiffer foam raises it"
        if on_foam
        else "a stiffer sheet or stiffer supports raise it"
    )
    return (
        f"this plate's first natural frequency is {first:.3g} Hz: an effect of up to "
        f"{EDGE_HZ:g} Hz is kept from other fingers only below it, whatever is scored at "
        f"{board.drive.frequency_hz:g} Hz; {raised}"
    )


def say_long_panel(board: Board) -> None:
    """Remark on a panel longer than its controller is sold with."""
    panel = board.panel
    if panel is not None and panel.controller != "ft6x36" and max(panel.size) > LONGEST_PANEL:
        say(
            f"panels with a GT911 are sold up to some {LONGEST_PANEL / MM:.0f} mm long: see that "
            f"there is one of {max(panel.size) / MM:.0f} mm before you order (docs/hardware.md)"
        )


def say_mirrored(board: Board) -> None:
    """Remark on coils that all stand on a middle line of a plate that is alike on both sides."""
    mirrors = board_mirrors(board)
    for axis, order, side in ((0, mirrors.x, "left and right"), (1, mirrors.y, "above and below")):
        at = [own.at[axis] for own in board.actuators]
        if order is None or max(map(abs, at)) > SAME_PLACE:
            continue
        # No two mirrored fingers are farther apart than this.
        low, high = board.active_area[axis]
        if 2.0 * min(-low, high) > board.fingers_apart:
            say(
                f"all coils stand on a middle line, and the plate is alike on both sides: fingers "
                f"{side} of it, mirrored, feel the same whatever is played; move coils off it"
            )


def is_clearly_less(db: float, than_db: float) -> bool:
    """Whether medians of pairs differ by more than other pairs would change them."""
    return than_db - db >= CLEARLY_LESS_DB


def say_worse(board: Board) -> None:
    """Remark on a measured board whose drives kept less apart than those of the drawn one."""
    before, after = (getattr(board.measured, key, None) for key in ("before", "after"))
    if before is None or after is None:
        return
    if is_clearly_less(after.fingers_2_db, before.fingers_2_db):
        say(
            f"measured.after: this board's drives keep two fingers {after.fingers_2_db:.0f} dB "
            f"apart on its plate, and the drawn board's {before.fingers_2_db:.0f}: those are better"
        )


def _ramp(board: Board) -> str:
    """What makes a bias softer, where it is not yet."""
    own = board.electronics.ramp_ms
    if own >= SOFT_RAMP_MS:
        return ""
    return (
        f", by some 6 dB less with ramp_ms = {SOFT_RAMP_MS:g} in place of {own:g}, whose clicks "
        f"come {SOFT_RAMP_MS - own:.0f} ms later (docs/effects.md)"
    )


def say_tones(
    named: str,
    board: Board,
    table: Path | None = None,
    *,
    hidden: str | None = None,
    clicks: bool = False,
) -> None:
    """After what steady tones keep, and maybe reckoned clicks: what effects keep by the pins.

    Tones are of fingers that have rested, which matters where a switch's bias comes up.
    """
    play = f"--emulator --board {named}{f' --hidden {hidden}' if hidden else ''}"
    if not board.is_for_several:
        adds = f"; the bias of switches adds to that{_ramp(board)}"
        bias = "" if board.electronics.is_bridge else adds
        say(
            f"These are tones, and a click as it is reckoned: `chladni play click --places 20 "
            f"{play} --table {table or 'T.chl'}` tells what it leaves 20 mm away by the pins{bias}."
        )
        return
    reckoned = ", and clicks as they are reckoned" if clicks else ""
    rested, touched = "", ""
    if not board.electronics.is_bridge:
        reckoned += ", of fingers that have rested"
        rested = " --rested"
        touched = (
            " Without --rested it tells of clicks that come with the touch, which keep 2 to "
            "12 dB less: the bias of switches comes up with them."
        )
    of_table = f" --table {table}" if table else ""
    say(
        f"These are tones{reckoned}: `chladni play click --pairs 20{rested} {play}{of_table}` "
        f"tells what clicks keep by an emulated device's pins, and so of any effect.{touched}"
    )


def of_fingers(score: CountScore, apart_mm: float, just_felt_um: float | None) -> str:
    """What each of several fingers has of its own signal and of the others'.

    `just_felt_um` is what a resting finger just feels of a tone.
    """
    apart, off = score.isolation_db, score.perturbed
    begin = f"{NUMBER[score.fingers]} fingers, {apart_mm:g} mm apart or more:"
    if score.finger_um is None or score.unfelt is None:
        return f"{begin} under the others each one's signal is {apart.median:.0f} dB weaker"
    kept = f", {apart.median:z.0f} dB over the others', {apart.p10:z.0f} at the worst tenth"
    kept += of_click(score.click_db)
    within = "" if off is None else f", {_percent(off.unfelt)} within tolerances"
    weak = float(np.mean(score.rows[:, 2] < (just_felt_um or 0.0)))
    own = f", and {_percent(weak)} of all do not feel their own" if weak else ""
    return (
        f"{begin} each gets {score.finger_um.median:.2g} µm of its own"
        f"{kept if score.fingers > 1 else ''}; {_percent(score.unfelt)} of fingers, while they "
        f"rest, do not feel the others' signals{within}{own}"
    )


def _percent(share: float | None) -> str:
    return f"{100.0 * (share or 0.0):.3g} %"
