"""What is said of effects that a board cannot play as they are meant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chladni.effects.bank.areas import Bank, Shape, reach_mm
from chladni.effects.effect import Effect
from chladni.effects.low_pass import EDGE_HZ, POLES
from chladni.host.cli.common.finger_remarks import SOFT_RAMP_MS
from chladni.host.cli.common.output import say
from chladni.host.cli.effects.verdicts import OFF_DB
from chladni.host.protocol.config import PANELS, DeviceConfig
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.image.metrics import decibel

if TYPE_CHECKING:
    from chladni.host.emulation.played_effect import PlayedEffect

ALLOWED = 0.9
"""Share of the micrometres asked for, from which a finger counts as getting them."""


def say_out_of_reach(
    bank: Bank, config: DeviceConfig, board_mm: tuple[float, float, float, float] | None
) -> None:
    """Remark on areas beyond a device's panel, where none of its fingers comes.

    Without a panel it is the board of its table, if there is one: left, bottom, right, top.
    """
    if config["panel"] == PANELS.index("none"):
        if board_mm is not None:
            left, bottom, right, top = (round(end, 2) for end in board_mm)
            _say_beyond(bank, [(left, right), (bottom, top)], "the board of the device's table")
        return
    size = (config["panel_width_um"], config["panel_length_um"])
    size = size[::-1] if config["panel_turns"] % 2 else size
    sides = [
        (1e-3 * (middle - extent / 2.0), 1e-3 * (middle + extent / 2.0))
        for middle, extent in zip((config["panel_x_um"], config["panel_y_um"]), size, strict=True)
    ]
    _say_beyond(bank, sides, "the device's panel")


def say_off_board(bank: Bank, board: Board) -> None:
    """Remark on areas beyond a board: the bank was built for another one."""
    halves = [side / 2.0 / MM for side in board.plate.size]
    _say_beyond(bank, [(-half, half) for half in halves], f"the board {board.name}")


def say_beyond_panel(bank: Bank, board: Board) -> None:
    """Remark on areas beyond a board's panel, as `say_out_of_reach` does of a device's."""
    if board.panel is not None:
        sides = [(round(low / MM, 3), round(high / MM, 3)) for low, high in board.panel.area]
        _say_beyond(bank, sides, f"the panel of {board.name}")


def _say_beyond(bank: Bank, sides: Sequence[tuple[float, float]], what: str) -> None:
    beyond = [area.name for area in bank.areas if not _is_within(area.shape, sides)]
    if not beyond:
        return
    x, y = ("{:g} to {:g}".format(*side) for side in sides)
    more = f" and {len(beyond) - 3} more" if len(beyond) > 3 else ""
    say(
        f"{', '.join(beyond[:3])}{more}: these areas reach beyond {what}, which has x {x} and "
        f"y {y} mm"
    )


def _is_within(shape: Shape, sides: Sequence[tuple[float, float]]) -> bool:
    return all(
        low <= at <= high
        for corner in reach_mm(shape)
        for at, (low, high) in zip(corner, sides, strict=True)
    )


def say_filtered(effect: Effect) -> None:
    """Remark on what the low-pass takes of an effect's highest frequency."""
    highest = max(effect.frequencies_hz, default=0.0)
    if highest <= EDGE_HZ:
        return
    left_db = decibel(1.0 / (1.0 + (highest / EDGE_HZ) ** (2 * POLES)))
    say(
        f"{effect.name}: above {EDGE_HZ:g} Hz boards do not focus, and a low-pass leaves "
        f"{left_db:.0f} dB of {highest:.0f} Hz"
    )


def say_not_measured(level_um: float | None) -> None:
    """Remark on what a real device cannot say of an effect."""
    if level_um is not None:
        say(
            f"the device reckons what gives {level_um:g} µm for an amplitude of 1, by its table "
            "and a coil's force in its configuration, and plays less where the place allows less"
        )
    say(
        "a device does not measure its plate, and its dB are by its table, for signals below the "
        "plate's first natural frequency: --emulator with the same --board and --table says what "
        "fingers get in µm and dB, as modelled"
    )


def say_less_than_asked(
    found: Sequence[PlayedEffect], levels_um: Sequence[float | None], by: str = "--level-um"
) -> None:
    """Remark on places that do not allow as many micrometres as were asked for, of one or two."""
    for name, one, level_um in zip("AB", found, levels_um, strict=False):
        if _is_short(one, level_um):
            who = "the finger" if len(found) == 1 else name
            say(
                f"{who} gets {one.peak_um:.2g} µm of the {_asked_um(one, level_um):.3g} that {by} "
                "asks for by the effect's own amplitude: its place allows no more"
            )


def say_short_places(found: Sequence[PlayedEffect], level_um: float | None) -> None:
    """The same of many places."""
    short = sum(_is_short(one, level_um) for one in found)
    if short:
        say(
            f"{short} of {len(found)} places allow less than the "
            f"{_asked_um(found[0], level_um):.3g} µm that --level-um asks for by the effect's own "
            "amplitude"
        )


def _is_short(played: PlayedEffect, level_um: float | None) -> bool:
    return played.peak_um < ALLOWED * _asked_um(played, level_um)


def _asked_um(played: PlayedEffect, level_um: float | None) -> float:
    return 0.0 if level_um is None else level_um * float(np.abs(played.asked).max())


def say_bias(found: Sequence[PlayedEffect], board: Board) -> None:
    """Remark on a bias that moves what is far away, too."""
    one, own = found[0], board.electronics.ramp_ms
    if one.bias_um is not None and not one.rested:
        far = one.second_finger_20mm_db is not None
        softer = (
            f": electronics.ramp_ms = {SOFT_RAMP_MS:g} in place of {own:g} (docs/effects.md) makes "
            "it softer"
        )
        say(
            "the bias of switches comes up with the touch: it makes the halves of the first wave "
            f"unequal, and moves {'places 20 mm away' if far else 'other fingers'}, too"
            f"{softer if far and own < SOFT_RAMP_MS else ''}; bridges have none, and EFFECT with "
            "--rested, without --bank, begins once it stands"
        )


def say_unflattened(found: Sequence[PlayedEffect]) -> None:
    """Remark on a bank's effects that a board changes, where that may be taken out of them."""
    if any((one.envelope_error_db or 0.0) > OFF_DB for one in found):
        say(
            "a device plays a bank's effects as they are: `chladni effects build --flatten --board "
            "B` takes out of them what the board gives more of at one frequency than at another"
        )
