"""An emulated device on a plate that only it knows: what its converter reads of its coils.

A duty of one coil makes another read a sum of what the plate's motion and the coils' flux induce,
through the amplifier and its filters. The emulated hardware has it as an impulse response at the
rate of samples; noise, bend and rounding of the converter are its own. Motion is solved at the
frequencies that are read. Between them it is a smooth curve, and resonances beyond the last
are left out; so is the multiplexer's settling, which the netlists of `tests/spice` have.

The converter runs in step with the carrier, so what a neighbour couples in of it is no ripple but a
part of the value, and changes with the duty. It is there with four harmonics of each pulse.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.calibration.device_readings import (
    REFERENCE_SHARE,
    coil_impedance,
    duty_volts,
    flux_multiple,
)
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.sensing import (
    AMPLIFIER,
    BASE_SAMPLES,
    CONVERTER_BEND,
    CONVERTER_NOISE,
    CONVERTER_STEPS,
    CONVERTER_V,
    FLUX_ERROR,
    GAIN_ERROR,
    MULTIPLES,
    UNIT_HZ,
    hidden_voltages,
    turned_inductances,
)
from chladni.host.emulation.emulator import Emulator, emulated_config
from chladni.sim.board.board import Board
from chladni.sim.board.gpio import CHIPS
from chladni.sim.errors import InputError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PERIODS = 4
"""Of 25 ms, that a response lasts: all frequencies that are read have whole numbers of them."""
RESONANCES_HZ, DAMPING = (110.0, 240.0, 500.0, 7000.0), 0.3
"""Of what goes through the frequencies that are read."""
LOW_PASS_HZ = (15.9e3, 15.8e3)
"""Of the amplifier: a resistor and a capacitor at its input, and two poles behind
(docs/hardware.md)."""
CONVERSION_HZ, CONVERSIONS = 80e6 / 1024.0, 4
"""And how many there are to a sample."""
LATE = 8
"""Conversions that all is late by, as they pass through the amplifier's filters."""
FASTEST_S, SLOWEST_S = 20e-6, 60e-6
"""From asking the converter to start until it does."""
HARMONICS = 4
"""Of the carrier, as many as the emulator has (firmware/esp32/emulator/sensed_coils.hpp)."""


def emulator_on(
    board: Board, hidden: HiddenPlate, seed: int = 0, *, listens: bool = True
) -> Emulator:
    """A device with the drawn board's configuration, on the hidden plate.

    A board without a sensing pin is given one, if its coils are to listen; what they would hear is
    left out, if they are not.

    Raises
    ------
    InputError
        Its chip has no pin left for one.
    MissingError
        The board has no `[coil]`.
    """
    settings = sensing_settings(board) if listens else {}
    emulator = Emulator(board, None, must_play=False, **settings)
    lay_on(emulator, hidden, seed, listens=listens)
    return emulator


def lay_on(emulator: Emulator, hidden: HiddenPlate, seed: int = 0, *, listens: bool = True) -> None:
    """Let an emulated device's coils be those of a hidden plate, or deaf ones.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    rng = np.random.default_rng((hidden.seed, seed, 45))
    responses = coil_responses(hidden, rng) if listens else _silence(hidden)
    emulator.core.set_coil_responses(
        np.ascontiguousarray(responses, np.float32),
        carrier=carrier_residues(hidden, rng.uniform()),
        late=LATE // CONVERSIONS,
        noise=CONVERTER_NOISE,
        bend=CONVERTER_BEND,
        begin_us=1e6 * rng.uniform(FASTEST_S, SLOWEST_S),
        seed=int(rng.integers(1, 2**31)),
    )


def sensing_settings(board: Board) -> dict[str, Any]:
    """A pin of the chip's converter that nothing else has."""
    own = emulated_config(board)
    chip = board.electronics.chip
    for pin in CHIPS[chip].converters:
        settings = {"sense_pin": pin}
        if own.with_values(**settings).pin_fault(chip) is None:
            return settings
    pins = ", ".join(map(str, CHIPS[chip].converters))
    raise InputError("electronics", "no pin left to listen with", f"a free one of {pins}")


def coil_responses(hidden: HiddenPlate, rng: np.random.Generator) -> FloatArray:
    """In the converter's steps for a duty of 1, the newest first.

    Shape (listening and the reference, playing, conversions, samples): each sample has four
    conversions.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    board = hidden.board
    coil = board.known_coil
    length = PERIODS * BASE_SAMPLES * CONVERSIONS
    hz = np.asarray(np.fft.rfftfreq(length, 1.0 / CONVERSION_HZ), np.float64)
    s = 2j * np.pi * hz
    share = 1.0 + GAIN_ERROR * rng.standard_normal()
    unlike = 1.0 + FLUX_ERROR * rng.uniform(-1.0, 1.0)
    # What is heard at high frequencies is not quite what is heard at low ones.
    rising = 1.0 + (unlike - 1.0) * np.minimum(hz / 7600.0, 1.0)
    flux = s * turned_inductances(hidden)[..., None] * rising
    solved = (*MULTIPLES, flux_multiple(board))
    volts = _between(hz, solved, hidden_voltages(hidden, solved)) + flux
    ohms = (hidden.ohms[:, None] - 1.0) * coil.resistance
    impedance = coil_impedance(board, hz) + ohms
    read = volts / impedance
    reference = np.zeros_like(read[:1])
    # Across the first coil, behind its driver.
    reference[0, 0] = REFERENCE_SHARE * share * (1.0 - board.electronics.driver_ohm / impedance[0])
    steps = duty_volts(board) * amplifier_gain(hz) * CONVERTER_STEPS / CONVERTER_V
    responses = np.concatenate((read, reference)) * steps
    # Late enough that what is cut off above does not ring before its time.
    late = np.exp(-s * LATE / CONVERSION_HZ)
    held = np.sinc(hz / CONVERSION_HZ)
    found = np.fft.irfft(responses * late * held, n=length, axis=-1)
    # A duty is held for as many conversions as there are to a sample.
    whole = sum(np.roll(found, k, axis=-1) for k in range(CONVERSIONS))
    return np.moveaxis(np.reshape(whole, (*found.shape[:-1], -1, CONVERSIONS)), -1, -2)


def _silence(hidden: HiddenPlate) -> FloatArray:
    """Of the shape of `coil_responses`, without a solved plate."""
    count = len(hidden.board.actuators)
    return np.zeros((count + 1, count, CONVERSIONS, PERIODS * BASE_SAMPLES))


def carrier_residues(hidden: HiddenPlate, since: float) -> ComplexArray:
    """Of harmonics of a carrier of pulses of 1, at a conversion's moment, in its steps.

    Shape (listening and the reference, playing, harmonics). Conversions begin `since` of a carrier
    period after a pulse does, which no one knows. The plate's mass holds it still there.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    board = hidden.board
    harmonics = np.arange(1, HARMONICS + 1)
    hz = np.asarray(harmonics * 80e6 / 2.0**board.electronics.pwm_bits, np.float64)
    flux = 2j * np.pi * hz * turned_inductances(hidden)[..., None]
    reference = np.zeros((1, *flux.shape[1:]), np.complex128)
    reference[0, 0] = REFERENCE_SHARE
    shares = np.concatenate((flux / coil_impedance(board, hz), reference))
    steps = duty_volts(board) * amplifier_gain(hz) * CONVERTER_STEPS / CONVERTER_V
    return np.asarray(shares * steps * np.exp(2j * np.pi * since * harmonics))


def amplifier_gain(hz: FloatArray) -> ComplexArray:
    """Volts at the converter for a volt at a coil."""
    first, second = LOW_PASS_HZ
    s = 1j * hz
    butterworth = 1.0 + np.sqrt(2.0) * s / second + (s / second) ** 2
    return np.asarray(AMPLIFIER / ((1.0 + s / first) * butterworth))


def _between(hz: FloatArray, solved: Sequence[int], read: ComplexArray) -> ComplexArray:
    """Motion's voltages at all frequencies, of those that are read, (frequencies, …)."""
    rates = (2j * np.pi * UNIT_HZ * np.array(solved)).reshape(-1, *[1] * (read.ndim - 1))
    return compliance_between(hz, solved, read / rates, RESONANCES_HZ) * 2j * np.pi * hz


def compliance_between(
    hz: FloatArray, solved: Sequence[int], compliance: ComplexArray, resonances_hz: Sequence[float]
) -> ComplexArray:
    """Motion at all frequencies, as of resonances that go through those that are solved.

    Any that fit would do, but they must be those of something that moves after it is pushed, and
    dies away: a curve drawn freely would be heard before the coil plays.

    Parameters
    ----------
    hz
        Frequencies that are asked for.
    solved, compliance
        Multiples of `UNIT_HZ`, and what is known there, (frequencies, …).
    resonances_hz
        As many as are solved.

    Returns
    -------
    Shape (…, len(hz)).
    """
    # Two real numbers for each resonance, two for each complex one that is read.
    shapes = _resonances(UNIT_HZ * np.array(solved), resonances_hz)
    system = np.concatenate((shapes.real, shapes.imag))
    wanted = np.concatenate((compliance.real, compliance.imag)).reshape(len(system), -1)
    found = np.linalg.solve(system, wanted).T @ _resonances(hz, resonances_hz).T
    return np.asarray(found.reshape(*compliance.shape[1:], hz.size))


def _resonances(hz: FloatArray, resonances_hz: Sequence[float]) -> ComplexArray:
    """Displacement and its rate of change, of each resonance, (frequencies, 2 of each)."""
    s = 1j * hz[:, None] / np.array(resonances_hz)
    moves = 1.0 / (1.0 + 2.0 * DAMPING * s + s**2)
    return np.concatenate((moves, s * moves), axis=1)
