"""The reading at 7.6 kHz, which tells what coils share besides motion."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from calibration.reading_arithmetic import read_hidden
from calibration.small_board import small_board
from chladni.calibration import fit_board, hidden_plate
from chladni.calibration.flux import CARRIER_LEFT, MotionReadings
from chladni.calibration.sensing import (
    AMPLIFIER,
    MOST_SECONDS,
    MULTIPLES,
    UNIT_HZ,
    hidden_voltages,
    turned_inductances,
)
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import amplifier_gain, emulator_on
from chladni.host.measuring.coil_readings import read_coils
from chladni.sim.board.file import load_board


def test_all_coils_read_flux_at_one_level() -> None:
    """A dead neighbour hears nothing, so that the first coil is not found too loud at first.

    Five samples a wave at four fifths of full duty play half of what a twentieth would make one
    expect, and what one coil hears of another would be twice what that one hears of it.
    """
    strip = load_board("strip5")
    with Device(EmulatorWire(emulator_on(strip, hidden_plate(strip, 13)))) as device:
        readings = read_coils(device, strip)
    high = readings.high.volts.imag
    lives = [0, 2, 3, 4]
    own = high[np.ix_(lives, lives)]
    off = ~np.eye(len(lives), dtype=bool)
    assert own[off] == pytest.approx(own.T[off], rel=0.15)
    # Coils 10 mm apart read much of the carrier: if the fit takes it for motion, this plate is 7
    # times the noise off.
    passed = abs(complex(amplifier_gain(np.array(80e6 / 1024.0)))) / AMPLIFIER
    assert pytest.approx(2.0 * passed, rel=0.05) == CARRIER_LEFT
    assert fit_board(strip, readings).left < 1.0


def test_deviations_have_a_variance_of_one() -> None:
    """Wrong flux is one inductance at all frequencies, and the carrier one number of all pairs."""
    drawn = np.random.default_rng(1)
    hz = np.array([80.0, 160.0, 240.0])
    noise = drawn.uniform(1e-3, 5e-3, (3, 2, 2))
    spread, flux = np.full((2, 2), 2e-5), np.zeros((2, 2))
    carrier = drawn.uniform(-1e-2, 1e-2, (2, 2, 3, 2, 2)) * np.array((1.0, 1j)).reshape(
        2, 1, 1, 1, 1
    )
    carrier = carrier[0] + carrier[1]
    motion = MotionReadings(hz, np.zeros((3, 2, 2), complex), noise, flux, spread, carrier)
    wrong = spread * drawn.standard_normal((20_000, 1, 2, 2))
    left = np.tensordot(drawn.standard_normal((20_000, 2)), carrier, 1)
    own = noise * drawn.standard_normal((2, 20_000, 3, 2, 2))
    off = left + own[0] + 1j * (own[1] + 2.0 * np.pi * hz[:, None, None] * wrong)
    told = motion.by_deviations(off).reshape(-1, 24)
    assert np.cov(told.T) == pytest.approx(np.eye(24), abs=0.05)


def test_a_plate_that_resonates_where_flux_is_read_is_found() -> None:
    """`paper` has no losses, and no windings that would tell its flux: plate 12 moves five times as
    much at 7.6 kHz as the drawn one."""
    board = load_board("paper")
    hidden = hidden_plate(board, 12)
    found = fit_board(board, read_hidden(hidden))
    assert found.left < 1.5
    truth, drawn = hidden.board.plate, board.plate
    # One frequency tells thickness and modulus by a plate's stiffness for its mass.
    ratios = [
        own.thickness**2 * own.youngs_modulus / (drawn.thickness**2 * drawn.youngs_modulus)
        for own in (truth, found.board.plate)
    ]
    assert ratios[1] == pytest.approx(ratios[0], rel=0.005)


def test_coils_that_play_quietly_are_read_for_longer() -> None:
    """Plate 22 of `paper` is so loud at 7.6 kHz that coils play 0.3 % of full duty, and the
    reference is 6 deviations of one reading above 0: 18 % of all readings at that frequency."""
    board = load_board("paper")
    hidden = hidden_plate(board, 22)
    with Device(EmulatorWire(emulator_on(board, hidden))) as device:
        readings = read_coils(device, board)
    assert readings.seconds <= MOST_SECONDS[False]
    found, expected = readings.high.volts, read_hidden(hidden).high.volts
    alike = np.sum(found * expected.conj()) / np.sum(np.abs(expected) ** 2)
    # Three deviations of a reference that is 20 of them, and flux that is told to 1 %.
    assert alike == pytest.approx(1.0, abs=0.16)


def test_flux_is_read_as_it_is() -> None:
    """Of coils 11 mm apart, and with it what moves there, which solving tells."""
    board = small_board()
    places = [(-11.0, -10.0), (0.0, -10.0), (11.0, -10.0), (-11.0, 8.0), (0.0, 8.0), (11.0, 8.0)]
    close = dataclasses.replace(
        board,
        actuators=tuple(
            dataclasses.replace(own, at=(1e-3 * x, 1e-3 * y))
            for own, (x, y) in zip(board.actuators, places, strict=True)
        ),
    )
    hidden = hidden_plate(close, 1)
    with Device(EmulatorWire(emulator_on(close, hidden))) as device:
        found = read_coils(device, close).high
    flux = 2j * np.pi * found.hz * turned_inductances(hidden)
    both = hidden_voltages(hidden, (190,))[0] + flux
    near = np.abs(flux) > 0.5 * np.abs(flux).max()
    off = np.linalg.norm(found.volts[near] - both[near])
    assert off < 0.04 * np.linalg.norm(both[near])
    assert found.hz == pytest.approx(190 * UNIT_HZ)
    assert MULTIPLES == (2, 4, 6)
