"""A new effect bank for a device: over the link, through cuts of power, and damaged in flash."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.effects import Area, Bank
from chladni.effects import shipped_effects as shipped
from chladni.effects.bank.pack import pack_bank
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, Hardware, TouchEvent
from chladni.host.protocol.slot_store import BANK_SLOT_BYTES, ENTRY_BYTES, SECTOR_BYTES
from chladni.tables.table import Limits, Table
from effects.banks import BYTES, with_crc
from made_up import device_of
from plate_of_bumps import responses_table

FloatArray = NDArray[np.float64]

LIMITS = Limits(4000, 100_000, 20_000_000)
KEY, REST = (-15.0, 30.0), (-15.0, -20.0)
OTHER = pack_bank(Bank("other", {"thud": shipped()["thud"]}, (Area("rest", hold="thud"),)))


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def board(table: Table, bank: bytes = BYTES) -> Emulator:
    return Emulator(device_of(table), table, level=1.0, bank=bank)


def test_a_new_bank_takes_over_and_survives_a_start(table: Table) -> None:
    emulator = board(table, b"")
    device = Device(EmulatorWire(emulator))
    done = device.effects.flash(BYTES)
    assert (done.verified, done.bytes) == (True, len(BYTES))
    assert device.effects.info()["name"] == "all"
    assert device.info()["table_status"] == "ok"
    for place in (KEY, None):
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, place))
        emulator.run(100.0)
    assert len(Device(EmulatorWire(emulator)).effects.events()) == 2
    second = device.effects.flash(OTHER)
    # What fingers did on areas that are gone is not told any more.
    assert device.effects.events() == []
    assert second.slot == 1 - done.slot
    emulator.core.boot()
    device = Device(EmulatorWire(emulator))
    assert device.effects.info()["name"] == "other"
    assert device.effects.info()["areas"] == ["rest"]
    # The same once more is not written again.
    erased = device.info()["erases"]
    assert device.effects.flash(OTHER).verified
    assert device.info()["erases"] == erased


def test_a_bank_that_the_firmware_refuses_costs_nothing(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    link = device.link
    with pytest.raises(LinkError, match="effect bank of another format"):
        link.request("bank_begin", BYTES[:4] + b"\x02" + BYTES[5:32], total=len(BYTES), crc=1)
    with pytest.raises(LinkError, match="more than a slot holds"):
        link.request("bank_begin", BYTES[:32], total=BANK_SLOT_BYTES, crc=1)
    # A whole one with an effect that is none: found when it is read back.
    bad = with_crc(BYTES[: len(BYTES) - 14] + b"\x09" + BYTES[len(BYTES) - 13 :])
    link.request("bank_begin", bad[:32], total=len(bad), crc=int.from_bytes(bad[-4:], "little"))
    link.request("bank_data", bad, offset=0)
    with pytest.raises(LinkError, match="bank_commit"):
        link.request("bank_commit")
    assert device.effects.info()["name"] == "all"
    # Neither does an update of one kind take the other's pieces.
    link.request("bank_begin", OTHER[:32], total=len(OTHER), crc=1)
    with pytest.raises(LinkError, match="nothing has begun"):
        link.request("table_data", b"x", offset=0)


def test_a_device_partitioned_before_there_were_banks_does_without(table: Table) -> None:
    hardware = Hardware(bank_sectors=0)
    emulator = Emulator(device_of(table), table, hardware=hardware)
    device = Device(EmulatorWire(emulator))
    with pytest.raises(LinkError, match="partitioned before there were effect banks"):
        device.effects.flash(BYTES)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, KEY))
    emulator.run(100.0)
    assert emulator.core.state == "playing"


def test_bits_that_flip_in_the_bank_turn_outputs_off_within_a_minute(table: Table) -> None:
    emulator = board(table)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, REST))
    emulator.run(100.0)
    at = next(k for k in range(200, len(BYTES)) if BYTES[k])
    emulator.core.program(at, bytes([BYTES[at] & (BYTES[at] - 1)]), "effects")
    emulator.run(61_000.0)
    assert emulator.core.state == "fault"
    assert any(cause == "effect bank refused" for cause, *_ in emulator.core.faults)
    assert not emulator.run(50.0).duty_steps.any()
    # A start finds the same, and a whole bank mends it.
    emulator.core.boot()
    assert emulator.core.state == "fault"
    device = Device(EmulatorWire(emulator))
    assert device.effects.info()["bank_status"] == "effect bank is damaged"
    assert device.effects.flash(OTHER).verified
    emulator.run(20.0)
    assert emulator.core.state == "playing"


@pytest.mark.slow
def test_a_cut_at_many_bytes_leaves_the_old_bank_or_the_new(table: Table) -> None:
    """Every thirteenth of those below; the old one lies in the first slot, entered or not."""
    assert cut_power_at_every(table, 13) > 60


@pytest.mark.soak
@pytest.mark.slow
def test_a_cut_at_any_byte_leaves_the_old_bank_or_the_new(table: Table) -> None:
    assert cut_power_at_every(table, 1) > 600


def cut_power_at_every(table: Table, step: int) -> int:
    """Cut the power in an update's erase, programmes and entries; how often."""
    total = SECTOR_BYTES + len(BYTES) + 2 * ENTRY_BYTES
    cuts = [*range(0, SECTOR_BYTES, 97), *range(SECTOR_BYTES, total + 1)]
    for cut in cuts[::step]:
        emulator = board(table, OTHER)
        emulator.core.cut_power_after(cut, "effects")
        try:
            said = Device(EmulatorWire(emulator)).effects.flash(BYTES).verified
        except LinkError:
            said = False
        assert said == (cut >= total)
        emulator.core.restore_power()
        emulator.core.boot("brown-out")
        device = Device(EmulatorWire(emulator))
        info = device.effects.info()
        assert info["bank_status"] == "ok"
        assert info["name"] in (("all",) if said else ("all", "other"))
        assert device.effects.flash(BYTES).verified
    return len(cuts[::step])
