"""Coils that are wound the other way, or came out weaker: the device makes up for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.protocol.board_config import coil_gains
from chladni.sim.board.board import Board
from chladni.sim.errors import InputError
from chladni.tables.report import TableReport
from chladni.tables.table import Table

BUILT = ((1, 0.0), (-1, 0.0), (1, 1.5), (-1, -3.0), (1, 0.0))
"""Polarity and trim of each coil."""


def as_built(board: Board) -> Board:
    actuators = [
        replace(actuator, polarity=polarity, trim_db=trim)
        for actuator, (polarity, trim) in zip(board.actuators, BUILT, strict=True)
    ]
    return replace(board, actuators=tuple(actuators))


def test_gains_undo_what_coils_do_and_none_is_above_one(coarse_board: Board) -> None:
    built = as_built(coarse_board)
    gains = np.array(coil_gains(built))
    done = gains * [actuator.strength for actuator in built.actuators]
    assert np.ptp(done) == pytest.approx(0.0, abs=1e-12)
    assert np.abs(gains).max() == 1.0
    assert done[0] == pytest.approx(10.0 ** (-1.5 / 20.0))
    assert coil_gains(coarse_board) == (1.0,) * 5


def test_a_table_does_not_depend_on_how_coils_came_out(coarse_board: Board) -> None:
    assert as_built(coarse_board).fingerprint() == coarse_board.fingerprint()


def test_the_pins_turn_and_trim_and_the_field_stays(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    table, _ = coarse_table
    touch = [TouchEvent(23.0, (10.0, 25.0))]
    drawn_recording, drawn = run_loop(table, coarse_board, touch, 250.0)
    recording, report = run_loop(table, as_built(coarse_board), touch, 250.0)
    assert report.ssim == pytest.approx(drawn.ssim, abs=1e-3)
    for channel in report.channels:
        assert channel.gain_error_db is not None
        assert channel.phase_error_deg is not None
        assert abs(channel.gain_error_db) < 0.1
        assert abs(channel.phase_error_deg) < 0.5
    # On the pins the second coil's wave is turned, and the fourth is turned and weaker.
    gains = np.abs(coil_gains(as_built(coarse_board)))
    waves = [own.duty[-4000:] for own in (recording, drawn_recording)]
    swing = [np.ptp(wave, axis=0) for wave in waves]
    # Error feedback rounds a crest or a trough a step of the carrier up or down.
    assert swing[0] == pytest.approx(gains * swing[1], abs=2.0 / 1024.0)
    waves = [wave - wave.mean(axis=0) for wave in waves]
    sign = np.sign(np.sum(waves[0] * waves[1], axis=0))
    assert sign.tolist() == [1.0, -1.0, 1.0, -1.0, 1.0]


@pytest.mark.parametrize("polarity", [0, 2, 0.5])
def test_a_polarity_is_one_way_or_the_other(coarse_board: Board, polarity: int) -> None:
    first, *rest = coarse_board.actuators
    with pytest.raises(InputError, match="polarity"):
        replace(coarse_board, actuators=(replace(first, polarity=polarity), *rest))
