"""Updates of a table over the link: what the device refuses, and what it writes."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.device.upload import TABLES, Upload
from chladni.host.device.wires.link import LinkError
from chladni.host.protocol.link import Status
from chladni.host.protocol.slot_store import TRAILER_OFFSET
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from chladni.tables.layout import HEADER_BYTES
from firmware.table_partitions import (
    FULL,
    FULL_TRAILERS,
    NEW,
    OLD,
    OLDER,
    connected,
    crc_of,
    image,
    table_crc,
    with_flash,
)
from made_up import forge, make_table, powered, random_table


def test_a_table_that_the_device_cannot_play_is_refused_and_the_old_one_plays_on() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    three = pack(make_table(np.ones((1, 3))))
    with pytest.raises(InputError, match="expected 5, the channels"):
        device.flash(three)
    # A host that does not look at what it sends gets the device's own answer.
    with pytest.raises(LinkError, match="another number of actuators") as caught:
        Upload(device.link, TABLES, three).run()
    assert caught.value.status == Status.REFUSED
    assert table_crc(device) == crc_of(OLD)
    assert emulator.core.state == "idle"
    assert device.flash(forge(make_table(np.ones((1, 5))), ramp_us=1_000)).verified


def test_a_refused_table_never_costs_the_one_to_go_back_to() -> None:
    """Two tables, back, one for four actuators, back again: flash is as it was all along."""
    emulator = powered(OLD)
    device = connected(emulator)
    assert device.flash(NEW).verified
    device.previous()
    before = emulator.core.flash_bytes()
    four = pack(make_table(np.ones((1, 4))))
    damaged = NEW[:HEADER_BYTES].replace(b"CHLD", b"CHLE") + NEW[HEADER_BYTES:]
    version = bytes([*NEW[:4], 9, *NEW[5:]])
    for data in (four, damaged, version, forge(make_table(np.ones((1, 5))), ramp_us=1)):
        with pytest.raises(LinkError, match="the device refuses it: "):
            Upload(device.link, TABLES, data).run()
        assert emulator.core.flash_bytes() == before
        assert emulator.core.state == "idle"
    device.previous()
    assert table_crc(device) == crc_of(NEW)


def test_what_is_there_already_is_not_written_again() -> None:
    """In the slot that plays nothing is; in the other one only the entry that makes it count."""
    emulator = powered(OLD)
    device = connected(emulator)
    assert device.flash(NEW).verified
    erased, slot = device.info()["erases"], device.info()["slot"]
    before = emulator.core.flash_bytes()
    assert device.flash(NEW).slot == slot
    assert emulator.core.flash_bytes() == before
    assert device.flash(OLD).slot == 1 - slot
    assert table_crc(device) == crc_of(OLD)
    assert device.info()["erases"] == erased


def test_an_update_that_falls_silent_is_dropped() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.link.request("table_begin", NEW[:HEADER_BYTES], total=len(NEW), crc=1)
    assert emulator.core.state == "updating"
    emulator.run(6_000.0)
    assert emulator.core.state == "idle"
    for name, tail, fields in (("table_commit", b"", {}), ("table_data", b"x", {"offset": 0})):
        with pytest.raises(LinkError, match="nothing has begun"):
            device.link.request(name, tail, **fields)
    assert table_crc(device) == crc_of(OLD)


def test_trailers_that_are_full_begin_again() -> None:
    """340 entries a slot; the newest always plays, and there is always a way back."""
    emulator = with_flash(image({0: OLD, 1: OLDER}, FULL_TRAILERS[: 2 * (FULL - 2)]))
    device = connected(emulator)
    for k in range(8):
        table = (NEW, OLD)[k % 2]
        assert device.flash(table).verified
        emulator.core.erase_sector(0, "boots")  # as if there had been no update before
        emulator.core.boot()
        device = connected(emulator)
        assert table_crc(device) == crc_of(table)
    for table in (NEW, OLD, NEW):
        device.previous()
        emulator.core.boot()
        device = connected(emulator)
        assert table_crc(device) == crc_of(table)


def test_a_table_as_large_as_a_slot_arrives_and_a_larger_one_is_refused() -> None:
    """Its last bytes touch the trailer, which stays as it is."""
    columns = (TRAILER_OFFSET - 97) // 21
    emulator = powered(OLD)
    device = connected(emulator)
    large = pack(random_table(columns // 12, 12, 5, 3))
    assert TRAILER_OFFSET - 12 * 21 < len(large) <= TRAILER_OFFSET
    assert device.flash(large).verified
    emulator.core.boot()
    assert table_crc(connected(emulator)) == crc_of(large)
    with pytest.raises(LinkError) as caught:
        device.link.request("table_begin", NEW[:HEADER_BYTES], total=TRAILER_OFFSET + 1, crc=1)
    assert caught.value.status == Status.TOO_LARGE


def test_outputs_are_off_before_anything_is_erased() -> None:
    emulator = powered(OLD)
    device = connected(emulator)
    device.touch(0.0, 0.0)
    emulator.run(50.0)
    emulator.core.take_duties()
    device.link.request("table_begin", NEW[:HEADER_BYTES], total=len(NEW), crc=1)
    assert not emulator.core.take_duties()[-3000:].any()
