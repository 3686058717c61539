"""The link: frames on a wire that loses, repeats, swaps and bends what it carries."""

from __future__ import annotations

import random
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.upload import TABLES, Upload
from chladni.host.device.wires.link import Answer, FrameSplitter, LinkError, encode
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Hardware
from chladni.host.protocol.link import BY_NAME, MAX_PAYLOAD, MESSAGES, Status
from chladni.tables.format import pack
from made_up import PacketWire, assert_one_of_them_plays, make_table, powered, random_table

OLD, NEW = (pack(make_table(np.array([[gain, 1.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0))
BIG = pack(random_table(30, 20, 5, 3))


def bad_wire(
    inner: EmulatorWire, loss: float, flips: float, repeats: float, seed: int
) -> PacketWire:
    """A wire that spoils what goes through it, both ways, with a seed."""
    rng = random.Random(seed)

    def spoil(data: bytes) -> bytes:
        if rng.random() < loss:
            return data[: rng.randrange(len(data))] if rng.random() < 0.5 else b""
        spoilt = bytearray(data)
        for k in range(len(spoilt)):
            if rng.random() < flips:
                spoilt[k] ^= 1 << rng.randrange(8)
        return bytes(spoilt) * (2 if rng.random() < repeats else 1)

    return PacketWire(inner, spoil, spoil)


@given(
    st.binary(max_size=MAX_PAYLOAD),
    st.integers(0, 127),
    st.integers(0, 255),
    st.binary(max_size=50),
)
@settings(deadline=None)
def test_a_frame_comes_through_behind_any_garbage(
    payload: bytes, kind: int, sequence: int, garbage: bytes
) -> None:
    frame = encode(kind, sequence, payload)
    assert 0 not in frame[1:-1]
    splitter = FrameSplitter()
    found = list(splitter.feed(garbage + frame + frame))
    assert bytes([kind, sequence]) + payload in found


@given(st.binary(max_size=400))
@settings(max_examples=300, deadline=None)
def test_the_device_survives_any_bytes_and_answers_the_next_request(garbage: bytes) -> None:
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    wire.write(garbage)
    assert Device(wire).info()["table_status"] == "ok"


@given(st.integers(1, 40), st.binary(max_size=80))
@settings(max_examples=200, deadline=None)
def test_the_device_survives_any_request(code: int, payload: bytes) -> None:
    """Every code with any payload, well framed: an answer with a status, and nothing else."""
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    device = Device(wire)
    wire.write(encode(code, 77, payload))
    answers = [body for _ in range(400) for body in device.link.splitter.feed(wire.read(0.001))]
    known = {message.code for message in MESSAGES}
    assert [body[:2] for body in answers] == [bytes([code | 0x80, 77])]
    if code not in known:
        assert answers[0][2] == Status.UNKNOWN
    emulator.run(400.0)
    assert device.info()["table_status"] == "ok"
    # Nothing of it got into flash.
    assert emulator.core.flash_bytes()[: len(OLD)] == OLD


@given(st.floats(0.0, 0.25), st.floats(0.0, 3e-4), st.floats(0.0, 0.3), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_a_flash_over_a_bad_wire_ends_right_or_says_that_it_failed(
    loss: float, flips: float, repeats: float, seed: int
) -> None:
    emulator = powered(OLD)
    wire = bad_wire(EmulatorWire(emulator), loss, flips, repeats, seed)
    try:
        said = Device(wire).flash(BIG).verified
    except LinkError:
        said = False
    assert_one_of_them_plays(emulator, OLD, BIG, said=said)


def test_a_table_arrives_while_a_finger_plays() -> None:
    """The device is busy until its outputs are off, and pieces sent meanwhile do no harm."""
    emulator = powered(OLD)
    device = Device(EmulatorWire(emulator))
    device.touch(0.0, 0.0)
    emulator.run(60.0)
    assert emulator.core.state == "playing"
    assert device.flash(BIG).verified
    device.lift()


class PlugPulledError(Exception):
    """In the middle of an update."""


def break_off(device: Device, data: bytes, after: int) -> None:
    """An update that ends in the middle."""

    def progress(done: int, _: int) -> None:
        if done >= after:
            raise PlugPulledError

    with pytest.raises(PlugPulledError):
        device.flash(data, progress)


@pytest.mark.parametrize("silence_ms", [100.0, 7_000.0])
def test_an_update_that_broke_off_goes_on_where_it_ended(silence_ms: float) -> None:
    """Before and after the device has dropped it; the old table plays meanwhile."""
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    whole = Device(EmulatorWire(powered(OLD))).flash(BIG).seconds
    break_off(Device(wire), BIG, len(BIG) // 2)
    emulator.run(silence_ms)
    again = Device(wire)
    if silence_ms > 5_000.0:
        assert int(again.info()["table_crc"], 16) == int.from_bytes(OLD[-4:], "little")
    done = again.flash(BIG)
    assert done.verified
    assert done.seconds < 0.7 * whole


def test_what_broke_off_is_not_mixed_with_another_table() -> None:
    """The same size, other bytes; and what broke off is no table to go back to."""
    other = pack(random_table(30, 20, 5, 4))
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    for first, second in ((BIG, other), (other, BIG)):
        break_off(Device(wire), first, len(first) // 2)
        assert Device(wire).flash(second).verified
        assert second in emulator.core.flash_bytes()
    third = pack(random_table(30, 20, 5, 5))
    break_off(Device(wire), third, len(third) // 2)
    with pytest.raises(LinkError, match="no other table"):
        Device(wire).previous()
    assert Device(wire).flash(third).verified
    assert third in emulator.core.flash_bytes()


def test_what_was_sent_and_never_committed_is_no_table_to_go_back_to() -> None:
    """Before a restart and after it; the table that came with the flash is one, afterwards."""
    emulator = powered(OLD)
    device = Device(EmulatorWire(emulator))
    Upload(device.link, TABLES, BIG).run()
    emulator.run(7_000.0)
    for _ in range(2):
        with pytest.raises(LinkError, match="no other table"):
            Device(EmulatorWire(emulator)).previous()
        emulator.core.boot()
    device = Device(EmulatorWire(emulator))
    assert device.flash(NEW).verified
    device.previous()
    assert int(device.info()["table_crc"], 16) == int.from_bytes(OLD[-4:], "little")


def test_a_slot_full_of_table_arrives_on_the_slowest_flash() -> None:
    """Six seconds of erasing in one turn of the main loop: no silence, and no reset."""
    slow = Hardware(erase_us=400_000.0, program_us=20.0)
    emulator = powered(OLD, hardware=slow)
    data = pack(random_table(60, 50, 5, 3))
    assert len(data) > 14 * 4096
    assert Device(EmulatorWire(emulator)).flash(data).verified
    assert emulator.core.faults == []


def test_a_piece_that_arrives_during_an_erase_is_whole() -> None:
    """However the first bytes of it fall between the turns of the main loop: never sent twice."""
    for wait_us in range(0, 1000, 130):
        emulator = powered(OLD, hardware=Hardware(erase_us=400_000.0))
        emulator.core.run_us(5_000 + wait_us)
        done = Device(EmulatorWire(emulator)).flash(random_table(7, 7, 5, 3))
        assert (done.verified, done.repeated) == (True, 0)


def test_moderate_loss_is_made_up_for() -> None:
    """A frame in twenty lost, both ways: every one of twenty updates arrives."""
    for seed in range(20):
        emulator = powered(OLD)
        wire = bad_wire(EmulatorWire(emulator), 0.05, 0.0, 0.02, seed)
        assert Device(wire).flash(BIG).verified


def test_a_repeated_request_is_done_once() -> None:
    """`table_previous` twice would come back to where it was."""
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    device = Device(wire)
    device.flash(NEW)
    frame = encode(7, 200, b"")
    wire.write(frame + frame)
    emulator.run(200.0)
    assert int(device.info()["table_crc"], 16) == int.from_bytes(OLD[-4:], "little")


def test_two_hosts_that_count_alike_are_answered_each_by_itself() -> None:
    """Two programs at one port, both at their third request: two places, and two times."""
    device = Device(EmulatorWire(powered(OLD)))
    touch = BY_NAME["touch"].code

    def answer(kind: int, payload: bytes = b"") -> Answer:
        device.wire.write(encode(kind, 3, payload))
        found: list[tuple[int, int, Answer]] = []
        while not found:
            found = device.link.poll(0.5)
        assert found[0][:2] == (kind, 3)
        return found[0][2]

    first, second = (answer(touch, struct.pack("<2i", x, 0)) for x in (1_000, 9_000))
    assert (first.fields["x_um"], second.fields["x_um"]) == (1_000, 9_000)
    before, after = (answer(BY_NAME["info"].code).fields["uptime_ms"] for _ in range(2))
    assert after > before


def test_another_version_is_refused_with_a_reason() -> None:
    device = Device(EmulatorWire(powered(OLD)))
    with pytest.raises(LinkError, match="another major version"):
        device.link.request("hello", major=3, minor=0)


def test_a_wrong_baud_rate_or_a_silent_port_is_said_so() -> None:
    wire = bad_wire(EmulatorWire(powered(OLD)), 1.0, 0.0, 0.0, 1)
    with pytest.raises(LinkError, match="no device answers"):
        Device(wire)


def test_text_between_frames_is_kept_as_a_log() -> None:
    emulator = powered(OLD)
    wire = EmulatorWire(emulator)
    device = Device(wire)
    wire.write(b"info\n")
    emulator.run(20.0)
    device.info()
    assert "idle\r\nok\r\n" in device.log


def test_configuration_is_set_for_the_next_start() -> None:
    emulator = powered(OLD)
    device = Device(EmulatorWire(emulator))
    wanted = device.config().with_values(level_q15=1234, lift_hold_ms=20)
    device.set_config(wanted)
    assert device.config() != wanted
    device.restart()
    emulator.run(400.0)
    assert device.config() == wanted


def test_no_configuration_is_written_while_something_plays() -> None:
    device = Device(EmulatorWire(powered(OLD)))
    device.touch(0.0, 0.0)
    device.link.wait(0.05)
    with pytest.raises(LinkError, match="not in this state"):
        device.set_config(device.config())


def test_touches_play_and_a_live_drive_draws_what_it_should() -> None:
    emulator = powered(OLD)
    device = Device(EmulatorWire(emulator))
    device.touch(0.0, 0.0)
    assert emulator.run(60.0).duty_steps[-1].any()
    device.lift()
    assert not emulator.run(60.0).duty_steps[-1].any()
    for _ in range(6):
        device.live([0.5, 0.0, 0.0, 0.0, 0.0], 160.0)
        emulator.run(40.0)
    # A bias of a quarter and the rounding's two steps. A supply delivers d² V/R.
    mean_square = (0.25 + 2.0 / 1024.0) ** 2 + 0.25**2 / 2.0
    assert device.info()["supply_ma"] == pytest.approx(333.0 * mean_square, abs=2.0)
    device.stop()


@pytest.mark.parametrize("baud", [115_200.0, 921_600.0])
def test_goodput_comes_close_to_the_wires_limit(baud: float) -> None:
    """A slot full of table: 85 % of the wire's bytes are the table's."""
    emulator = powered(OLD, hardware=Hardware(baud=baud, erase_us=0.0))
    device = Device(EmulatorWire(emulator))
    data = pack(random_table(60, 50, 5, 3))
    done = device.flash(data)
    assert done.verified
    assert done.bytes / done.seconds / (baud / 10.0) > 0.85


def test_raw_duties_go_through_the_link_at_921600_baud() -> None:
    """The paper's 10 kHz of five channels, ten bits each, without a gap: 488 of 921 kbit/s."""
    emulator = powered(OLD, link_baud=921_600)
    device = Device(EmulatorWire(emulator))
    seconds = 2.0
    t = np.arange(round(seconds * 78_125 / 8)) / (78_125 / 8)
    phases = np.arange(5) * 0.6
    duties = 0.4 + 0.3 * np.sin(2.0 * np.pi * 160.0 * t[:, None] + phases)
    emulator.core.take_duties()
    assert device.stream(duties) == len(t)
    played = emulator.core.take_duties()
    assert device.faults() == []
    tail = played[-78_125:].astype(float) / 1024.0
    tone = np.exp(-2j * np.pi * 160.0 * np.arange(len(tail)) / 78_125.0)
    gains = 2.0 * (tail - tail.mean(axis=0)).T @ (tone * np.hanning(len(tail)))
    gains /= np.hanning(len(tail)).sum()
    assert np.abs(gains) == pytest.approx(0.3, rel=0.02)
    assert np.angle(gains[1:] / gains[:-1]) == pytest.approx(0.6, abs=0.01)
    device.stop()
    emulator.run(20.0)
    assert emulator.core.state == "idle"
