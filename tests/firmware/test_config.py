"""The configuration in flash: what is written is read, and a cut never costs the one before."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import EmulatedPort, UdpWire
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.board_config import config_of
from chladni.host.protocol.config import (
    CEILINGS,
    FIELDS,
    HARMLESS,
    RECORD_BYTES,
    SETTINGS,
    DeviceConfig,
    Setting,
    pack_config,
    unpack_config,
)
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.board.file import load_board
from chladni.sim.board.gpio import CHIPS
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from chladni.tables.layout import offsets
from firmware.judged_device import BRIDGES, JudgedDevice, hot_board
from made_up import make_table, powered, some_pins
from networked import KEY, networked

VERSION_BYTE = offsets(FIELDS)["version_major"]


def booted(*records: tuple[int, bytes]) -> _emulator.Emulator:
    core = _emulator.Emulator(_emulator.Hardware())
    for sector, record in records:
        core.program(sector * _emulator.SECTOR_BYTES, record, "config")
    core.boot()
    return core


def held(core: _emulator.Emulator) -> DeviceConfig:
    """The newest whole record in flash, by Python's reader."""
    flash = core.flash_bytes("config")
    found = []
    for sector in (0, 1):
        try:
            found.append(unpack_config(flash[sector * _emulator.SECTOR_BYTES :][:RECORD_BYTES]))
        except InputError:
            continue
    return max(found, key=lambda pair: pair[1])[0]


def wired(**values: Any) -> DeviceConfig:
    return DeviceConfig(pwm_pins=some_pins(), **values)


def values_of(setting: Setting) -> st.SearchStrategy[object]:
    one = st.integers(setting.low, setting.high)
    count = setting.field.count
    return one if count == 1 else st.tuples(*[one] * count)


any_configs = st.fixed_dictionaries({s.field.name: values_of(s) for s in SETTINGS}).map(
    lambda values: DeviceConfig(**values)
)
"""Every setting within its own range; pins are seldom what the chip can use so."""


@st.composite
def startable(draw: st.DrawFn) -> DeviceConfig:
    """The same with pins of which each can be what it is for."""
    pins = draw(st.permutations(CHIPS["esp32"].gates))
    return draw(any_configs).with_values(
        pwm_pins=tuple(pins[:16]), sda_pin=21, scl_pin=22, interrupt_pin=34, reset_pin=255
    )


configs = startable()


@given(configs, st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_what_is_packed_is_read_by_both_sides(config: DeviceConfig, sequence: int) -> None:
    record = pack_config(config, sequence)
    assert unpack_config(record) == (config, sequence)
    core = booted()
    # The firmware reads the record, and writes what it has read.
    assert core.save_config(record) == "ok"
    assert held(core) == config


def test_a_device_that_was_never_configured_has_the_defaults_and_no_pins() -> None:
    """The authors' board but for pins and panel, the same on both sides."""
    emulator = Emulator(DeviceConfig(), None, must_play=False, flash={})
    assert emulator.core.config_status == "never configured"
    with Device(EmulatorWire(emulator)) as device:
        default = device.config()
        assert default == DeviceConfig()
        assert set(default["pwm_pins"]) == {NOT_WIRED}
        with pytest.raises(LinkError, match="pins"):
            device.set_config(default)
    board = config_of(load_board("prototype"))
    for name in (
        "channels",
        "pwm_bits",
        "sda_pin",
        "scl_pin",
        "full_current_ma",
        "full_rise_dk",
        "limit_rise_dk",
        "supply_ma",
        "min_on_ns",
    ):
        assert board[name] == default[name], name


def test_damaged_records_are_refused_and_the_defaults_hold() -> None:
    good = pack_config(wired(level_q15=1000))
    assert booted((0, good)).config_status == "ok"
    for position in range(len(good) * 8):
        bad = bytearray(good)
        bad[position // 8] ^= 1 << (position % 8)
        with pytest.raises(InputError):
            unpack_config(bytes(bad))
        if position % 7 == 0:
            another = position // 8 == VERSION_BYTE
            expected = "configuration of another version: set it again"
            core = booted((0, bytes(bad)))
            assert core.config_status == (expected if another else "configuration damaged")
            assert core.state == "fault"
    for length in range(0, len(good), 5):
        with pytest.raises(InputError):
            unpack_config(good[:length])


@pytest.mark.parametrize("newer", [1, 2**31, 2**32 - 1])
def test_the_newer_of_two_records_counts_across_the_wrap(newer: int) -> None:
    older, newest = wired(level_q15=1), wired(level_q15=2)
    for order in (0, 1):
        core = booted(
            (order, pack_config(older, newer - 1)), (1 - order, pack_config(newest, newer))
        )
        # What is saved next goes over the older one and leaves the newest.
        core.save_config(pack_config(wired(level_q15=3)))
        flash = core.flash_bytes("config")[(1 - order) * _emulator.SECTOR_BYTES :][:RECORD_BYTES]
        assert unpack_config(flash)[0] == newest


@pytest.mark.slow
def test_a_cut_at_any_byte_leaves_the_old_or_the_new_record() -> None:
    """Torn in the erase and at every byte of the programme, from one record and from two."""
    old, new = wired(level_q15=111), wired(level_q15=222)
    starts: list[list[tuple[int, bytes]]] = [
        [(0, pack_config(old, 5))],
        [(0, pack_config(old, 5)), (1, pack_config(wired(), 4))],
        [(1, pack_config(old, 5)), (0, pack_config(wired(), 4))],
    ]
    cuts = [*range(0, 4096, 512), *range(4096, 4096 + RECORD_BYTES + 1)]
    for start in starts:
        for cut in cuts:
            core = booted(*start)
            core.cut_power_after(cut, "config")
            said = core.save_config(pack_config(new))
            core.restore_power()
            core.boot("brown-out")
            assert core.config_status == "ok"
            assert held(core) == (new if said == "ok" else old)
    print(f"{len(starts) * len(cuts)} cuts")


def test_flash_that_lies_is_found_by_reading_back() -> None:
    old = wired(level_q15=111)
    core = booted((0, pack_config(old)))
    core.let_flash_lie(True, "config")
    assert core.save_config(pack_config(wired(level_q15=5))) == "flash write failed"
    core.let_flash_lie(False, "config")
    core.boot()
    assert held(core) == old


@pytest.mark.parametrize(
    ("name", "value"),
    [("level", 1), ("channels", 17), ("pwm_pins", (1, 2)), ("level_q15", 0.5), ("waveform", True)],
)
def test_wrong_settings_are_named(name: str, value: object) -> None:
    with pytest.raises(InputError, match=name):
        DeviceConfig(**{name: value})


def rotten(core: _emulator.Emulator, sector: int, at: int) -> _emulator.Emulator:
    """The same flash with one bit of a sector flipped to 0, after a start."""
    flash = bytearray(core.flash_bytes("config"))
    place = sector * _emulator.SECTOR_BYTES + at
    assert flash[place]
    flash[place] &= flash[place] - 1
    found = _emulator.Emulator(_emulator.Hardware())
    found.program(0, bytes(flash), "config")
    found.boot()
    return found


def standing(core: _emulator.Emulator) -> list[str]:
    return [cause for cause, _, _ in core.faults]


def test_a_device_that_was_never_configured_plays_nothing_and_says_so() -> None:
    core = booted()
    assert (core.config_status, core.state) == ("never configured", "fault")
    assert "never configured" in standing(core)
    assert not core.stream_begin()
    assert not core.play_live([(1000, 0)] * 5, 160_000, 0)


def test_a_flipped_bit_never_brings_an_older_configuration_back_to_play() -> None:
    """`max_duty` 3000 for 2000: whichever bit it is, the outputs stay off and the cause is said."""
    core = booted((0, pack_config(wired(max_duty_q15=3000))))
    assert core.save_config(pack_config(wired(max_duty_q15=2000))) == "ok"
    core.boot()
    assert core.config_status == "ok"
    newest = core.flash_bytes("config")[_emulator.SECTOR_BYTES :][:RECORD_BYTES]
    for at in [k for k, byte in enumerate(newest) if byte][::3]:
        found = rotten(core, 1, at)
        assert found.config_status.startswith(("an older", "configuration of another")), at
        assert found.state == "fault"
        assert "configuration refused" in standing(found)
        # It is mended by writing it again.
        assert found.save_config(pack_config(wired(max_duty_q15=2000))) == "ok"
        found.boot()
        assert found.config_status == "ok"
    # A bit of the mark that tells is not the mark.
    assert rotten(core, 1, _emulator.SECTOR_BYTES - 1).config_status == "ok"


def test_a_cut_before_the_older_record_is_marked_is_made_up_for_at_the_next_start() -> None:
    core = booted((0, pack_config(wired(), 4)), (1, pack_config(wired(), 5)))
    assert core.flash_bytes("config")[_emulator.SECTOR_BYTES - 4 :][:4] == bytes(4)
    assert rotten(core, 1, 0).config_status.startswith("an older")


def test_a_configuration_that_rots_while_it_runs_is_found_within_a_minute() -> None:
    emulator = powered(pack(make_table(np.ones((1, 5)))))
    core = emulator.core
    core.program(40, bytes([core.flash_bytes("config")[40] & 0]), "config")
    emulator.run(61_000.0)
    assert (core.state, core.config_status) == ("fault", "configuration damaged")


def test_what_is_written_already_is_not_written_again() -> None:
    core = booted((0, pack_config(wired(level_q15=9))))
    before = core.flash_changes
    assert core.save_config(pack_config(wired(level_q15=9))) == "ok"
    assert core.flash_changes == before


@pytest.fixture
def both_ways() -> tuple[Device, Device]:
    """A device by wire and over a network."""
    emulator = networked()
    return Device(EmulatorWire(emulator)), Device(UdpWire(EmulatedPort(emulator), KEY))


def test_a_host_on_a_network_cannot_touch_what_protects_parts(
    both_ways: tuple[Device, Device],
) -> None:
    """Every setting, to either end of its range: refused, or one of how a touch feels, or less."""
    _, network = both_ways
    config = network.config()
    taken = 0
    for setting in SETTINGS:
        name, default = setting.field.name, setting.default
        for value in {setting.low, setting.high}:
            wanted: object = value
            if not isinstance(default, int):
                wanted = (value, *config[name][1:])
            if wanted == config[name]:
                continue
            changed = config.with_values(**{name: wanted})
            less = name in CEILINGS and value < config[name]
            if name in HARMLESS or less:
                network.set_config(changed)
                taken += 1
                if taken % 5 == 0:  # flash is not written more often in a row
                    network = Device(UdpWire(EmulatedPort(networked()), KEY))
                continue
            with pytest.raises(LinkError, match="refuses"):
                network.set_config(changed)


def test_a_host_on_a_network_can_ask_for_less_and_never_for_more_than_the_wire(
    both_ways: tuple[Device, Device],
) -> None:
    wire, network = both_ways
    config = wire.config()
    wire.set_config(config.with_values(max_duty_q15=16_000))
    restarted(wire)
    lower = wire.config().with_values(max_duty_q15=8_000)
    network.set_config(lower)
    restarted(wire)
    assert wire.config()["max_duty_q15"] == 8_000
    network.set_config(lower.with_values(max_duty_q15=16_000))
    restarted(wire)
    for more in (16_001, 32_768):
        with pytest.raises(LinkError, match="by wire only"):
            network.set_config(lower.with_values(max_duty_q15=more))
        # Nor does it help to say that the wire had asked for more.
        with pytest.raises(LinkError, match="by wire only"):
            network.set_config(lower.with_values(max_duty_q15=more, wire_max_duty_q15=more))
    assert wire.config()["max_duty_q15"] == 16_000


def restarted(device: Device) -> None:
    device.restart()
    device.link.wait(0.5)


def test_a_damaged_record_does_not_spare_the_word_for_other_drivers() -> None:
    """The older record says what drives the coils, though outputs stay off with it."""
    bench = JudgedDevice(hot_board(**BRIDGES))
    bench.host(True).set_config(hot_board(level_q15=9, **BRIDGES))
    places = (0, _emulator.SECTOR_BYTES)
    newest = max(places, key=lambda at: sequence_at(bench, at))
    bench.core.program(newest + 40, b"\0", "config")
    bench.core.restart("power on")
    assert bench.core.config_status.startswith("an older")
    with pytest.raises(LinkError, match="drivers of another kind"):
        bench.host(True).set_config(hot_board())
    bench.host(True).set_config(hot_board(level_q15=9, **BRIDGES))


def sequence_at(bench: JudgedDevice, at: int) -> int:
    return unpack_config(bench.core.flash_bytes("config")[at:])[1]
