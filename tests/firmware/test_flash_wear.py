"""Flash is erased once a minute at most, whatever is asked, and its erases are not forgotten."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Callable

import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import EmulatedPort, UdpWire
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.link import Status
from chladni.host.protocol.slot_store import SECTOR_BYTES, SECTOR_ERASES
from chladni.tables.layout import HEADER_BYTES
from made_up import device_of
from networked import KEY, LAB, NEW, OLD, networked

AT_POWER_ON = 5
MINUTE_MS = 60_100.0
AREAS = ("tables", "config", "network")


def by_wire(emulator: Emulator) -> Device:
    return Device(EmulatorWire(emulator))


def begin(device: Device, k: int) -> None:
    """Erase the slot for a table of which nothing comes."""
    device.link.request("table_begin", NEW[:HEADER_BYTES], total=len(NEW), crc=k)


WAYS: dict[str, Callable[[Device, int], object]] = {
    "configuration": lambda device, k: device.set_config(
        device.config().with_values(level_q15=1_000 + k)
    ),
    "network": lambda device, k: device.set_network(LAB),
    "table of which nothing comes": begin,
    "table that is stored": lambda device, k: device.flash((OLD, NEW)[k % 2]),
    "previous": lambda device, k: device.previous(),
}


def prepared(way: str) -> Emulator:
    """A device that has all its credit, and two tables if the way is between them."""
    emulator = networked()
    if way in ("table that is stored", "previous"):
        by_wire(emulator).flash(NEW)
        emulator.run(MINUTE_MS)
    return emulator


def is_refused(emulator: Emulator, way: str, k: int) -> bool:
    """Whether the device refuses it for want of credit, and leaves flash as it was."""
    before = [emulator.core.flash_bytes(area) for area in AREAS]
    try:
        WAYS[way](by_wire(emulator), k)
    except LinkError as error:
        found = error
    else:
        return False
    assert found.status == Status.TOO_OFTEN
    assert [emulator.core.flash_bytes(area) for area in AREAS] == before
    return True


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_an_erase_is_refused_after_five(way: str) -> None:
    """And taken once more after a minute, whatever lies in between: a restart does not help."""
    emulator = prepared(way)
    before = by_wire(emulator).info()["updates"]
    for k in range(AT_POWER_ON):
        assert not is_refused(emulator, way, k)
    assert is_refused(emulator, way, AT_POWER_ON)
    by_wire(emulator).restart()
    emulator.run(400.0)
    for other in WAYS:
        assert is_refused(emulator, other, AT_POWER_ON)
    assert by_wire(emulator).info()["updates"] == before + AT_POWER_ON
    emulator.run(MINUTE_MS)
    assert not is_refused(emulator, way, AT_POWER_ON)
    assert is_refused(emulator, way, AT_POWER_ON + 1)


def test_a_host_on_the_network_has_the_same_credit_as_the_wire() -> None:
    emulator = prepared("previous")
    device = Device(UdpWire(EmulatedPort(emulator), KEY))
    for _ in range(AT_POWER_ON):
        device.previous()
    with pytest.raises(LinkError, match="5 times since power came on"):
        device.previous()
    assert is_refused(emulator, "configuration", 0)


def test_a_table_costs_one_update_and_what_is_in_use_none() -> None:
    emulator = networked()
    device = by_wire(emulator)
    device.flash(OLD)
    assert device.info()["updates"] == 0
    device.flash(NEW)
    assert device.info()["updates"] == 1
    device.set_config(device.config())
    assert device.info()["updates"] == 1


def test_an_update_that_broke_off_goes_on_without_another_credit() -> None:
    emulator = networked()
    device = by_wire(emulator)
    crc = int.from_bytes(NEW[-4:], "little")
    for k in range(AT_POWER_ON - 1):
        begin(device, k)
    fields = {"total": len(NEW), "crc": crc}
    device.link.request("table_begin", NEW[:HEADER_BYTES], **fields)
    emulator.run(6_000.0)  # dropped for its silence
    assert device.flash(NEW).verified
    assert device.info()["updates"] == AT_POWER_ON


def test_power_that_comes_and_goes_gives_no_update_back() -> None:
    """A line that toggles DTR takes the power of the chip, and all that RAM knows."""
    emulator = networked()
    done = 0
    for k in range(40):
        emulator.core.restart("power on")
        done += not is_refused(emulator, "configuration", k)
    assert done == AT_POWER_ON
    assert by_wire(emulator).info()["updates"] == AT_POWER_ON


def test_minutes_before_the_power_went_count() -> None:
    emulator = networked()
    for k in range(AT_POWER_ON):
        assert not is_refused(emulator, "configuration", k)
    emulator.run(3 * MINUTE_MS)
    emulator.core.restart("power on")
    assert [is_refused(emulator, "configuration", 10 + k) for k in range(4)] == [False] * 3 + [True]


def test_an_update_that_the_power_cut_short_has_been_counted() -> None:
    emulator = networked()
    emulator.core.cut_power_after(SECTOR_BYTES // 2)
    begin(by_wire(emulator), 0)
    emulator.core.restore_power()
    emulator.core.restart("power on")
    assert by_wire(emulator).info()["updates"] == 1


@pytest.mark.parametrize("room", [0, 2, 3])
def test_updates_are_counted_through_a_full_sector(room: int) -> None:
    """At a start and between two; those that are owed are owed afterwards."""
    emulator = networked()
    marks = b"\xf0" * 3 + b"\x0f\x00" * SECTOR_BYTES
    emulator.core.erase_sector(0, "boots")
    emulator.core.program(0, marks[: SECTOR_BYTES - room], "boots")
    emulator.core.restart("power on")
    for k in range(2):
        assert not is_refused(emulator, "configuration", k)
    emulator.core.restart("power on")
    head = emulator.core.flash_bytes("boots")[:12]
    assert head[:4] == b"CLHW"
    assert zlib.crc32(head[:8]).to_bytes(4, "little") == head[8:]
    info = by_wire(emulator).info()
    assert (info["updates"], info["flash_life_used"]) == (5, 5 / SECTOR_ERASES)
    assert is_refused(emulator, "configuration", 5)


@pytest.mark.parametrize("torn", [0xF7, 0xFE, 0xF1])
def test_a_torn_mark_of_an_update_counts(torn: int) -> None:
    emulator = networked()
    emulator.core.erase_sector(0, "boots")
    emulator.core.program(0, bytes([torn, 0xF0, 0x0F]), "boots")
    emulator.core.restart("power on")
    assert by_wire(emulator).info()["updates"] == 2
    assert by_wire(emulator).info()["standing"] == []


def test_starts_of_an_older_firmware_are_no_updates() -> None:
    emulator = networked()
    emulator.core.erase_sector(0, "boots")
    emulator.core.program(0, bytes([0x00, 0x0F, 0x7F, 0x00] * 20), "boots")
    emulator.core.restart("power on")
    assert by_wire(emulator).info()["updates"] == 0
    assert not is_refused(emulator, "configuration", 0)


@pytest.mark.soak
def test_credit_ends_at_sixty() -> None:
    """After more than an hour, at the slowest carrier: a quarter of the samples."""
    device = device_of(None, channels=5).with_values(pwm_bits=12)
    emulator = Emulator(device, OLD, network=LAB)
    emulator.run(62 * MINUTE_MS)
    done = itertools.takewhile(lambda k: not is_refused(emulator, "configuration", k), range(99))
    assert len(list(done)) == 60
