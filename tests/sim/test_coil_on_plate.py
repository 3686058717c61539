"""A coil's sweep through its plate: against the fields, and against natural frequencies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.errors import MissingError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.coil_on_plate import acceleration_on_plate
from chladni.sim.fields.driven import at_coils, driven_fields
from conftest import ROOT


@pytest.fixture(scope="module")
def template() -> Board:
    return load_board(ROOT / "boards" / "template.toml")


def test_a_sweep_is_loudest_at_the_plates_first_mode(template: Board) -> None:
    """Its coils push where that mode moves, so no latch may put the peak at another frequency."""
    model = plate_model(template)
    first = float(model.natural_frequencies(1)[0])
    frequencies = first * np.array([0.75, 0.9, 1.0, 1.1, 1.25])
    found = np.abs(acceleration_on_plate(template, 0, frequencies, model=model))
    assert int(found.argmax()) == 2
    # A loss factor of 0.02 makes 50 times the stiff answer; coil and neighbours leave over half.
    assert found[2] > 5.0 * found[[0, 4]].max()


@pytest.mark.parametrize("acts_back", [True, False])
def test_a_sweep_agrees_with_the_field_at_the_coil(acts_back: bool) -> None:
    """Of a board with that coil alone, whose fields are found in another way (driven.py)."""
    strip = load_board("strip5")
    assert strip.coil is not None
    # Ten times its force per ampere, so that the brake is felt.
    strong = 10.0 * strip.coil.force_factor
    coil = replace(strip.coil, motion_acts_back=acts_back, force_factor=strong)
    own = strip.actuators[:1]
    pins = replace(strip.electronics, pwm_pins=strip.electronics.pwm_pins[:1], sign_pins=())
    pins = replace(pins, drive="switch", lost_ns=40.0, bridge_ohm=0.28)
    board = replace(strip, actuators=own, coil=coil, winding=None, electronics=pins)
    frequency = board.drive.frequency_hz
    omega = 2.0 * np.pi * frequency
    newtons = coil.force_factor / (coil.resistance + 1j * omega * coil.inductance)
    expected = -(omega**2) * newtons * at_coils(board, driven_fields(board).values[0])[0]
    (found,) = acceleration_on_plate(board, 0, np.array([frequency]))
    # Both fields are to 5e-3, and one is interpolated between image points.
    assert found == pytest.approx(expected, rel=1e-2)


def test_a_sweep_takes_a_coil(template: Board) -> None:
    with pytest.raises(MissingError, match=r"\[coil\] is required"):
        acceleration_on_plate(replace(template, coil=None), 0, np.array([160.0]))
