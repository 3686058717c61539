"""What lets coils measure a board: in its file, its parts list, on its wiring drawing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from chladni.host.manufacture.wiring.figure import wiring_figure
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.host.protocol.board_config import config_of
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import Sensing
from chladni.sim.board.file import parse_board
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from conftest import shipped_board


def sensing(name: str, pin: int = 36) -> Board:
    return replace(shipped_board(name), sensing=Sensing(pin))


def test_a_board_file_says_where_coils_are_listened_to() -> None:
    board = sensing("phone5")
    again = parse_board(board_file(board).decode(), file="phone5.toml")
    assert again.sensing == Sensing(36)
    assert config_of(again)["sense_pin"] == 36
    assert config_of(shipped_board("phone5"))["sense_pin"] == 255
    # Tables know nothing of it.
    assert again.fingerprint() == shipped_board("phone5").fingerprint()


@pytest.mark.parametrize(
    ("pin", "why"),
    [
        (34, "the panel's interrupt line has it, free are 32, 33"),
        (26, "converter 1 does not reach it"),
        (6, "it is the flash chip's"),
        (48, "this chip has no such pin"),
    ],
)
def test_its_pin_is_one_of_the_converter_that_nothing_else_has(pin: int, why: str) -> None:
    with pytest.raises(InputError, match=rf"sensing\.pin.*got {pin}; {why}"):
        board_file(sensing("phone5", pin))


def test_it_needs_the_panel_s_bus() -> None:
    with pytest.raises(InputError, match=r"sensing: expected a board with \[panel\]"):
        board_file(replace(sensing("phone5"), panel=None))


@pytest.mark.parametrize(
    ("name", "pin", "multiplexers", "resistors", "sleeping"),
    [("phone5", 36, 2, 12, 5), ("quiet16", 36, 1, 18, 0)],
)
def test_its_parts_are_listed_and_drawn(
    name: str, pin: int, multiplexers: int, resistors: int, sleeping: int
) -> None:
    board = sensing(name, pin)
    without = {part.part for part in parts_list(shipped_board(name))}
    added = {part.part: part for part in parts_list(board) if part.part not in without}
    assert sum(own.count for key, own in added.items() if "multiplexer" in key) == multiplexers
    assert added["sensing resistor"].count == resistors
    assert ("nSLEEP pull-up" in added) == (sleeping > 0)
    assert added["reference resistor"].count == (2 if sleeping else 3)
    # One bridge of a DRV8835 cannot be put to sleep by itself.
    assert not any("DRV8835" in part.value for part in parts_list(board))
    said = [text.get_text() for text in wiring_figure(board).axes[0].texts]
    assert "coils that measure each other" in said
    assert f"GPIO {pin}" in said
    assert any("expander" in line for line in said)
