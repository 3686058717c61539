"""What a device's firmware reads of its coils, on plates that only the emulated hardware knows."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from calibration.reading_arithmetic import but_carrier, read_hidden
from calibration.small_board import small_board
from chladni.calibration import fit_board, hidden_plate
from chladni.calibration.device_readings import REFERENCE, readings_of
from chladni.calibration.flux import CARRIER_LEFT
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.sensing import (
    BASE_SAMPLES,
    UNIT_HZ,
    CoilReadings,
)
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.emulation.sensed_plate import emulator_on, sensing_settings
from chladni.host.measuring.coil_readings import ReadingError, read_coils, sense
from chladni.host.protocol import link
from chladni.host.protocol.codes import SENSE_STATE
from chladni.host.protocol.link import BY_NAME
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import DriverKind
from chladni.sim.board.file import load_board
from chladni.sim.errors import ChladniError, InputError
from made_up import make_table

ASKED = {"playing": 0, "multiple": 4, "level_q15": 20_000, "settle_ms": 10, "readings": 4}
REVERSED = 4
"""Seed of a plate with a reversed coil."""


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


def driven_by(board: Board, drive: DriverKind, bits: int) -> Board:
    return dataclasses.replace(
        board, electronics=dataclasses.replace(board.electronics, drive=drive, pwm_bits=bits)
    )


def read(board: Board, hidden: HiddenPlate) -> CoilReadings:
    with Device(EmulatorWire(emulator_on(board, hidden))) as device:
        return read_coils(device, board)


def device_on(board: Board, seed: int = 1) -> tuple[Device, Emulator]:
    emulator = emulator_on(board, hidden_plate(board, seed))
    return Device(EmulatorWire(emulator)), emulator


@pytest.mark.parametrize(
    ("drive", "bits", "seed"), [("switch", 10, 1), ("switch", 12, REVERSED), ("bridge", 11, 8)]
)
def test_the_firmware_reads_what_the_arithmetic_says(
    board: Board, drive: DriverKind, bits: int, seed: int
) -> None:
    """The same plate by two ways: firmware, carrier and impulse responses, and sines alone.

    Left are both ways' gain (1 %), flux (1 %), resistances at another impedance (2 %), noise, and
    of the carrier no more than the amplifier passes, one number of all pairs.
    """
    own = driven_by(board, drive, bits)
    hidden = hidden_plate(own, seed)
    found, expected = read(own, hidden), read_hidden(hidden)
    assert found.frequencies_hz == pytest.approx(expected.frequencies_hz)
    apart, carrier = but_carrier(found.volts - expected.volts, hidden)
    assert np.all(carrier < CARRIER_LEFT + 0.01)
    allowed = 5.0 * np.hypot(found.noise, expected.noise) + 0.05 * np.abs(expected.volts)
    assert np.all(np.abs(apart) <= allowed)
    whole = np.linalg.norm(apart) / np.linalg.norm(expected.volts)
    assert whole < 0.03
    assert found.seconds <= 10.0
    assert np.all(np.diagonal(found.volts, axis1=1, axis2=2) == 0.0)


def test_a_board_is_found_by_its_device(board: Board) -> None:
    """With a coil that is the wrong way round and one that is dead."""
    hidden = hidden_plate(board, REVERSED)
    strengths = hidden.strengths.copy()
    strengths[2] = 0.0
    hidden = dataclasses.replace(hidden, strengths=strengths)
    readings = read(board, hidden)
    found = fit_board(board, readings)
    assert found.wiring.signs.tolist() == np.sign(strengths).tolist()
    alive = strengths != 0.0
    # Under foam of 2.7 times the drawn stiffness little moves from coil to coil.
    assert found.strengths[alive] == pytest.approx(np.abs(strengths[alive]), abs=0.12)


def test_the_reference_is_a_known_share_of_the_duty(board: Board) -> None:
    """Whatever the level, and of the first coil alone."""
    device, _ = device_on(board)
    for level in (5_000, 20_000):
        heard = sense(device, **ASKED | {"level_q15": level})
        assert heard is not None
        assert [own.listening for own in heard] == [1, 2, 3, 4, 5, REFERENCE]
        duty = level / 32767.0 * (0.5 - 3.0 / 1024.0)
        assert heard[-1].duty == pytest.approx(duty, abs=1e-4)
        volts = duty * (board.electronics.supply_v + board.electronics.diode_v) / 2001.0
        assert abs(heard[-1].steps) == pytest.approx(volts * 187.0 * 4096.0 / 3.1, rel=0.03)
    others = sense(device, **ASKED | {"playing": 3})
    assert others is not None
    assert [own.listening for own in others] == [0, 1, 2, 4, 5]


def test_what_is_too_loud_is_said_and_read_at_half(board: Board) -> None:
    assert board.coil is not None
    loud = dataclasses.replace(board, coil=dataclasses.replace(board.coil, force_factor=3.0))
    hidden = hidden_plate(loud, 1)
    device = Device(EmulatorWire(emulator_on(loud, hidden)))
    assert sense(device, **ASKED | {"multiple": 6, "level_q15": 32767}) is None
    readings = read_coils(device, loud)
    assert readings.seconds <= 11.0
    assert readings.volts == pytest.approx(read_hidden(hidden).volts, rel=0.1, abs=2e-3)


def test_a_finger_ends_a_reading_at_once(board: Board) -> None:
    device, emulator = device_on(board)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 60.0, (0.0, 0.0)))
    with pytest.raises(ReadingError, match="touched"):
        read_coils(device, board)
    emulator.run(30.0)
    assert emulator.run(20.0).duty_steps.max() == 0
    assert device.info()["state"] == "fault"  # no table


@pytest.mark.parametrize(
    ("fault", "value", "said"),
    [
        ("is_expander_absent", True, "expander missing"),
        ("is_converter_dead", True, "converter fails"),
        ("is_pin_open", True, "noise alone .* sensing pin.* multiplexer"),
    ],
)
def test_parts_that_are_missing_are_named(board: Board, fault: str, value: int, said: str) -> None:
    device, emulator = device_on(board)
    setattr(emulator.core.sensing_faults, fault, value)
    with pytest.raises(ChladniError) as caught:
        read_coils(device, board)
    assert re.search(said, f"{caught.value} {caught.value.hint}")
    emulator.run(30.0)
    assert emulator.run(5.0).duty_steps.max() == 0


def test_a_reference_that_is_silent_alone_is_no_matter_of_the_pin(board: Board) -> None:
    device, _ = device_on(board)
    heard = sense(device, **ASKED | {"multiple": 190, "settle_ms": 5, "level_q15": 2_000})
    assert heard is not None
    silent = [*heard[:-1], dataclasses.replace(heard[-1], steps=0j)]
    with pytest.raises(InputError, match="no reference at 7604 Hz") as caught:
        readings_of(board, silent, 1.0)
    assert f"{board.actuators[0].name}'s driver" in caught.value.hint


def test_an_address_line_that_is_stuck_is_noticed(board: Board) -> None:
    device, emulator = device_on(board)
    emulator.core.sensing_faults.stuck_address = 1
    with pytest.raises(ChladniError):
        fit_board(board, read_coils(device, board))


def test_bridges_are_awake_before_and_after_whatever_happens(board: Board) -> None:
    own = driven_by(board, "bridge", 10)
    device, emulator = device_on(own)
    core = emulator.core
    device.link.request("sense", b"", **ASKED)
    emulator.run(60.0)
    assert core.bridges_awake == 1  # the one that plays
    core.restart("watchdog")
    emulator.run(20.0)
    # No coil is at the amplifier, whichever plays next.
    assert (core.bridges_awake, core.listens_at) == (0xFF, REFERENCE)
    assert sense(device, **ASKED) is not None
    assert (core.bridges_awake, core.listens_at) == (0xFF, REFERENCE)
    device.link.request("sense", b"", **ASKED)
    emulator.run(60.0)
    assert core.bridges_awake == 1
    core.update_begin()
    emulator.run(10.0)
    assert core.bridges_awake == 0xFF
    assert not emulator.run(5.0).duty_steps.any()


def test_what_ends_a_reading_ends_all_of_it(board: Board) -> None:
    """Also where the same turn of the main loop hears of its end and of another host's drive."""
    fields = {"sense": ASKED, "stream_end": {}, "stream_begin": {"target": 64, "is_signed": 0}}
    gains = b"".join(BY_NAME["live"].entry.pack(0, 0) for _ in board.actuators)
    for running_us in (0, 60_000):
        device, emulator = device_on(board)
        wire = device.link
        wire.send(BY_NAME["sense"], b"", ASKED)
        emulator.core.run_us(running_us)
        for name in ("stream_end", "stream_begin"):
            wire.send(BY_NAME[name], b"", fields[name])
        emulator.run(40.0)
        assert emulator.core.state == "streaming"
        assert not emulator.run(5.0).duty_steps.any()
        assert SENSE_STATE.text(wire.request("sensed").fields["state"]) == "stopped"
        assert emulator.core.state == "streaming"
        wire.request("stream_end")
        wire.request("live", gains, millihertz=160_000, waveform=0)
        assert emulator.core.state == "streaming"


def test_the_next_touch_plays_the_tables_frequency_again(board: Board) -> None:
    table = make_table(np.ones((1, 6)))
    emulator = Emulator(board, table, **sensing_settings(board))
    device = Device(EmulatorWire(emulator))
    for ends in (False, True):
        device.link.request("sense", b"", **ASKED | {"multiple": 12})
        emulator.run(30.0 if ends else 400.0)
        if ends:
            device.link.request("stream_end")
            emulator.run(20.0)
        device.touch(0.0, 0.0)
        emulator.run(30.0)
        duty = emulator.run(100.0).duty[:, 0]
        crossings = np.count_nonzero(np.diff(np.sign(duty - duty.mean())) != 0)
        assert crossings == pytest.approx(32, abs=1)
        device.lift()
        emulator.run(20.0)


def test_values_that_were_lost_end_the_session(board: Board) -> None:
    """A main loop that hangs for 30 ms: the converter's driver keeps 26, and tells no more."""
    device, emulator = device_on(board)
    first = sense(device, **ASKED)
    assert first is not None
    device.link.request("sense", b"", **ASKED)
    emulator.run(60.0)
    emulator.core.hang_main_loop(True)
    emulator.run(30.0)
    emulator.core.hang_main_loop(False)
    emulator.run(5.0)
    assert SENSE_STATE.text(device.link.request("sensed").fields["state"]) == "samples lost"
    assert not emulator.run(10.0).duty_steps[-100:].any()
    again = sense(device, **ASKED)
    assert again is not None
    assert {own.session for own in first + again} == {1, 2}


@pytest.mark.parametrize("between", [False, True])
def test_values_that_no_one_misses_end_the_session_too(board: Board, between: bool) -> None:
    """Five milliseconds of them: phases would be wrong from then on."""
    device, emulator = device_on(board)
    assert sense(device, **ASKED) is not None
    if not between:
        device.link.request("sense", b"", **ASKED)
        emulator.run(60.0)
    emulator.core.sensing_faults.lost_values = 400
    emulator.run(20.0)
    if not between:
        state = device.link.request("sensed").fields["state"]
        assert SENSE_STATE.text(state) == "samples lost"
    again = sense(device, **ASKED)
    assert again is not None
    assert {own.session for own in again} == {2}


def test_sixteen_coils_have_one_reference() -> None:
    board = load_board("quiet16")
    device = Device(EmulatorWire(Emulator(board, None, must_play=False, **sensing_settings(board))))
    for playing, expected in ((0, [*range(1, 16), REFERENCE]), (3, [0, 1, 2, *range(4, 16)])):
        heard = sense(device, **ASKED | {"playing": playing, "readings": 1})
        assert heard is not None
        assert [own.listening for own in heard] == expected


def test_a_bus_that_is_stuck_is_noted_and_bridges_wake_when_it_is_free(board: Board) -> None:
    own = driven_by(board, "bridge", 10)
    device, emulator = device_on(own)
    core = emulator.core
    device.link.request("sense", b"", **ASKED)
    emulator.run(60.0)
    core.panel_faults.pulses_until_free = 10_000
    device.link.request("stream_end")
    emulator.run(600.0)
    assert core.bridges_awake == 1
    assert [cause for cause, _, _ in core.faults].count("expander missing") == 1
    core.panel_faults.pulses_until_free = 0
    emulator.run(600.0)
    assert core.bridges_awake == 0xFF


def test_a_device_that_cannot_is_told_so(board: Board) -> None:
    plain = Device(EmulatorWire(Emulator(board, None, must_play=False)))
    with pytest.raises(LinkError, match="no sensing pin") as caught:
        read_coils(plain, board)
    assert "[sensing]" in caught.value.hint
    fewer = dataclasses.replace(board, actuators=board.actuators[:5])
    device, _ = device_on(board)
    with pytest.raises(InputError, match="device: expected 5, as small has, got '6 coils'"):
        read_coils(device, fewer)
    for wrong in ({"playing": 6}, {"multiple": 3}, {"multiple": 202}, {"readings": 0}):
        with pytest.raises(LinkError, match="invalid fields"):
            sense(device, **ASKED | wrong)
    device.link.request("sense", b"", **ASKED)
    with pytest.raises(LinkError, match="not in this state"):
        device.link.request("stream_begin", b"", target=64, is_signed=0)


def test_boards_of_either_chip_have_a_pin_left() -> None:
    for name, pin in (("phone5", 32), ("quiet16", 35), ("phone8", 10)):
        board = load_board(name)
        settings = sensing_settings(board)
        assert settings == {"sense_pin": pin}
        emulator = Emulator(board, None, must_play=False, **settings)
        assert emulator.core.config_status == "ok"
    taken = dataclasses.replace(board.electronics, pwm_pins=(1, 2, 4, 5, 6, 7, 10, 11))
    with pytest.raises(InputError, match="no pin left to listen with"):
        sensing_settings(dataclasses.replace(board, electronics=taken))


def test_the_link_says_what_the_arithmetic_takes() -> None:
    assert link.REFERENCE == REFERENCE
    assert pytest.approx(UNIT_HZ) == link.UNIT_HZ
    assert link.SENSE_PAIRS == BASE_SAMPLES
