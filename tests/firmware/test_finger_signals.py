"""Fingers that play signals of their own, which a host sends: what comes out at the pins."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.drives.fingers.choice import chosen_drives
from chladni.drives.fingers.silence import real_part
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import Emulator, Recording, TouchEvent
from chladni.host.protocol.link import SIGNAL_SAMPLES
from chladni.tables.responses import TableResponses
from chladni.tables.table import Limits, Table
from firmware.judged_device import BRIDGES
from made_up import device_of, make_table
from plate_of_bumps import FINGER, SQUARE, responses_table

FloatArray = NDArray[np.float64]
Place = tuple[float, float]

LIMITS = Limits(4000, 100_000, 20_000_000)
HERE, THERE = (-18.0, 30.0), (17.0, -25.0)


def click(hz: float) -> FloatArray:
    """Three cycles under a Hann window."""
    count = round(3.0 * SIGNAL_HZ / hz)
    wave = np.sin(2.0 * np.pi * hz * np.arange(count) / SIGNAL_HZ)
    return np.asarray(np.hanning(count) * wave)


LOW, HIGH = click(110.0), click(230.0)


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def board(table: Table, **settings: Any) -> Emulator:
    with_bridges: dict[str, Any] = {**BRIDGES, **settings}
    return Emulator(device_of(table, **with_bridges), table, level=1.0)


def lay(emulator: Emulator, at_ms: float, *fingers: Place | None) -> None:
    for finger, place in enumerate(fingers):
        emulator.touch(TouchEvent(at_ms, place, finger))


def send(emulator: Emulator, finger: int, samples: FloatArray) -> int:
    return emulator.core.push_signal(finger, [round(32767.0 * float(one)) for one in samples])


def parts_of(recording: Recording, *signals: FloatArray) -> FloatArray:
    """Each signal's part in each channel's duty, shape (signals, channels).

    By least squares over the samples from where they began, which all did in one: where it was is
    looked for. Nothing else may have been played.
    """
    per_sample = round(recording.carrier_hz / SIGNAL_HZ)  # carrier periods
    longest = max(map(len, signals)) + 2
    times = np.arange(longest * per_sample) / per_sample
    shapes = [
        np.interp(times, np.arange(longest), [0.0, *own, *[0.0] * (longest - 1 - len(own))])
        for own in signals
    ]
    held = np.array([np.repeat(shape[::4], 4) for shape in shapes]).T  # a duty stands four periods
    begins = range(0, len(recording.duty) - len(held), 4)

    def fitted(begin: int) -> tuple[float, FloatArray]:
        duty = recording.duty[begin : begin + len(held)]
        found, *_ = np.linalg.lstsq(held, duty, rcond=None)
        return float(np.abs(duty - held @ found).max()), found

    # By the loudest channel first, which is quick.
    loudest = int(np.abs(recording.duty).max(axis=0).argmax())
    matches = [
        float(np.abs(recording.duty[b : b + len(held), loudest] @ held).sum()) for b in begins
    ]
    near = begins[int(np.argmax(matches))]
    tried = range(max(near - 16 * per_sample, 0), near + 16 * per_sample)
    rest, found = min((fitted(begin) for begin in tried), key=lambda one: one[0])
    # Lost time and steps of duty.
    assert rest < 0.02
    return np.asarray(found)


def reported(emulator: Emulator) -> list[Place]:
    return [(x * 1e-6, y * 1e-6) for is_down, x, y, *_ in emulator.core.touches() if is_down]


def off(found: FloatArray, wanted: FloatArray) -> float:
    """Of a drive whose scale is left open, over its largest."""
    scale = float(found @ wanted / (found @ found))
    assert scale > 0.0, "what pushes up pushes up"
    return float(np.abs(scale * found - wanted).max() / np.abs(wanted).max())


@pytest.mark.parametrize("bits", [10, 11, 12])
def test_a_click_comes_out_in_its_own_time_at_every_carrier(table: Table, bits: int) -> None:
    emulator = board(table, pwm_bits=bits)
    emulator.core.set_signal_voice(0, 32767)
    assert send(emulator, 0, HIGH) == len(HIGH)
    lay(emulator, 1.0, HERE)
    recording = emulator.run(60.0)
    assert 0.9 < np.abs(parts_of(recording, HIGH)).max() <= 1.0
    assert np.abs(recording.duty[-round(0.02 * recording.carrier_hz) :]).max() < 0.01


def test_each_finger_has_its_own_in_real_gains_that_leave_the_other_still(table: Table) -> None:
    """Against the reference in Python."""
    emulator = board(table)
    for finger, signal in enumerate((LOW, HIGH)):
        emulator.core.set_signal_voice(finger, 32767)
        assert send(emulator, finger, signal) == len(signal)
    lay(emulator, 1.0, HERE, THERE)
    found = parts_of(emulator.run(80.0), LOW, HIGH)
    wanted = chosen_drives(
        TableResponses.of(table),
        reported(emulator),
        thresholds=[FINGER.threshold_pm * 1e-12 / 4.0] * 2,
        levels=[FINGER.full_force_un * 1e-6] * 2,
        stiffness=FINGER.stiffness,
        real=True,
    ).found.drives
    assert np.all(wanted.imag == 0.0)
    for own, drive in zip(found, wanted.real, strict=True):
        assert off(own, drive) < 0.012


def test_a_tone_and_a_signal_play_side_by_side(table: Table) -> None:
    emulator = board(table)
    emulator.core.set_voice(0, 160_000, 32767)
    emulator.core.set_signal_voice(1, 32767)
    lay(emulator, 1.0, HERE, THERE)
    emulator.run(60.0)
    before = emulator.run(200.0)
    send(emulator, 1, HIGH)
    during = emulator.run(30.0)
    after = emulator.run(200.0)

    def tone(recording: Recording) -> float:
        play = Play(0, len(recording.duty_steps))
        return float(np.abs(phasors(recording, play, 160.0)).max())

    assert tone(after) == pytest.approx(tone(before), rel=1e-3)
    more = np.abs(during.duty).max(axis=0) - np.abs(before.duty).max(axis=0)
    assert more.max() > 0.1


def test_a_table_of_drives_alone_plays_a_signal_too() -> None:
    drives = np.exp(0.7j) * np.array([[10.0, -4.0, 2.0 + 0.3j]])
    emulator = board(make_table(drives))
    emulator.core.set_signal_voice(0, 32767)
    send(emulator, 0, HIGH)
    lay(emulator, 1.0, (0.0, 0.0))
    found = parts_of(emulator.run(60.0), HIGH)[0]
    assert off(found, real_part(drives[0])) < 0.02


def test_what_runs_dry_dies_away_and_goes_on_with_what_comes(table: Table) -> None:
    emulator = board(table)
    emulator.core.set_signal_voice(0, 32767)
    lay(emulator, 1.0, HERE)
    emulator.run(20.0)
    send(emulator, 0, np.ones(8))
    recording = emulator.run(30.0)
    channel = int(np.abs(recording.duty).max(axis=0).argmax())
    level = np.abs(recording.duty[:, channel])
    full = float(level.max())
    fell = np.flatnonzero(level > 0.98 * full)[-1]
    late = level[fell:]
    # By an eighth with each of its samples: to a tenth in 18 of them, 7.4 ms.
    below = np.flatnonzero(late < 0.1 * full)[0] / recording.carrier_hz
    assert below == pytest.approx(np.log(0.1) / np.log(7 / 8) / SIGNAL_HZ, rel=0.1)
    assert np.abs(np.diff(level)).max() < 0.2 * full, "no step"
    assert late[-1] < 0.01
    send(emulator, 0, HIGH)
    assert np.abs(parts_of(emulator.run(60.0), HIGH)).max() > 0.9


def test_more_than_there_is_room_for_is_left_to_the_host(table: Table) -> None:
    emulator = board(table)
    emulator.core.set_signal_voice(0, 32767)
    assert send(emulator, 0, np.zeros(SIGNAL_SAMPLES + 40)) == SIGNAL_SAMPLES
    assert send(emulator, 0, np.ones(1)) == 0
    emulator.core.set_signal_voice(0, 32767)  # what waited is dropped
    assert send(emulator, 0, HIGH) == len(HIGH)
    lay(emulator, 1.0, HERE)
    assert np.abs(parts_of(emulator.run(60.0), HIGH)).max() > 0.9


def test_a_finger_that_leaves_ends_its_signal_with_the_release(table: Table) -> None:
    emulator = board(table)
    emulator.core.set_signal_voice(0, 32767)
    lay(emulator, 1.0, HERE)
    emulator.run(20.0)
    send(emulator, 0, np.ones(SIGNAL_SAMPLES))
    lay(emulator, 30.0, None)
    recording = emulator.run(60.0)
    assert np.abs(recording.duty).max() > 0.5
    assert np.abs(recording.duty[-round(0.02 * recording.carrier_hz) :]).max() == 0.0
    assert emulator.core.state == "idle"


def pressed_beside_one_that_rests(table: Table, **asked: int) -> Emulator:
    """A device with switches where finger 1 comes down with a signal 61 ms after start."""
    emulator = board(table, driver=0, **asked)
    emulator.core.set_voice(0, 0, 0)
    emulator.core.set_signal_voice(1, 32767)
    send(emulator, 1, HIGH)
    lay(emulator, 1.0, HERE)
    emulator.run(60.0)
    emulator.touch(TouchEvent(61.0, THERE, 1))
    return emulator


@pytest.mark.parametrize(
    ("asked", "lasts_ms"),
    # Older records have a 0.
    [({}, 40), ({"bias_ramp_ms": 0}, 40), ({"bias_ramp_ms": 50}, 50)],
)
def test_a_switchs_bias_comes_up_slowly_beside_a_finger_that_rests(
    table: Table, asked: dict[str, int], lasts_ms: int
) -> None:
    """Slowly at either end, and the signal waits for it; a finger alone has the table's 4 ms."""
    emulator = pressed_beside_one_that_rests(table, **asked)
    recording = emulator.run(160.0)
    duty = recording.duty[:, int(recording.duty[-1].argmax())]
    times_ms = 1e3 * np.arange(len(duty)) / recording.carrier_hz
    standing = float(duty[-1])

    def reached_ms(part: float) -> float:
        return float(times_ms[duty >= part**2 * (3.0 - 2.0 * part) * standing].min())

    middle = reached_ms(0.5)
    for part in (0.1, 0.25, 0.75, 0.9):
        assert reached_ms(part) - middle == pytest.approx((part - 0.5) * lasts_ms, abs=0.7)
    # The click's first swing comes after.
    loud = times_ms[duty > 1.05 * standing].min() - middle
    assert loud > 0.5 * lasts_ms


@pytest.mark.parametrize("leaves_ms", [75.0, 85.0])
def test_a_finger_that_leaves_while_its_bias_comes_up_ends_it_from_where_it_is(
    table: Table, leaves_ms: float
) -> None:
    """A quarter on its way it has 0.16 of the bias: from 0.25 it would jump by 0.09 of it."""
    emulator = pressed_beside_one_that_rests(table)
    emulator.touch(TouchEvent(leaves_ms, None, 1))
    recording = emulator.run(160.0)
    assert recording.duty.max() > 0.05
    assert np.abs(np.diff(recording.duty, axis=0)).max() < 0.01
    assert np.all(recording.duty[-1] == 0.0)


def test_little_isolation_is_told_in_parts_of_a_ratio() -> None:
    """Fingertips side by side on two coils: a ratio of 1.9, which whole numbers hide."""
    table = responses_table(SQUARE[:2], limits=LIMITS)
    emulator = board(table)
    with Device(EmulatorWire(emulator)) as device:
        for finger, x in enumerate((-2.5, 2.5)):
            device.fingers.set_signal(finger)
            device.fingers.touch(finger, x, 0.0)
        device.link.wait(0.1)
        told = [one["isolation_db"] for one in device.fingers.all()]
        places = reported(emulator)
    wanted = chosen_drives(
        TableResponses.of(table),
        places,
        thresholds=[FINGER.threshold_pm * 1e-12 / 4.0] * 2,
        levels=[FINGER.full_force_un * 1e-6] * 2,
        stiffness=FINGER.stiffness,
        real=True,
    ).found.isolation_db
    assert told == pytest.approx(wanted, abs=0.3)
    assert 5.0 < min(told) < 5.9
