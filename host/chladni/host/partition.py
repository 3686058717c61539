"""The tables partition as an image: which table counts, and what an update writes where.

The same rules as the firmware's `core/table_store.cpp`, for a device that does not run: the ROM's
loader reads and writes its flash (`rom.py`).
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from chladni.host.flash_layout import (
    ENTRY_BYTES,
    JOURNAL_OFFSET,
    JOURNAL_SECTORS,
    PARTITION_BYTES,
    SECTOR_BYTES,
    SLOT_BYTES,
    SLOTS,
)
from chladni.sim.errors import InputError
from chladni.tables import layout

_ENTRY = struct.Struct("<III")
_AT = layout.offsets(layout.HEADER_FIELDS)


@dataclass(frozen=True)
class Entry:
    """A journal entry and the sector it stands in."""

    sequence: int
    slot: int
    table_crc: int
    sector: int


def entry_bytes(sequence: int, slot: int, table_crc: int) -> bytes:
    """A journal entry as it lies in flash."""
    body = _ENTRY.pack(sequence % 2**32, slot, table_crc)
    return body + struct.pack("<I", zlib.crc32(body))


def entries(image: bytes) -> list[Entry]:
    """The journal's whole entries, newest first (sequence numbers may wrap around)."""
    found = []
    for sector in range(JOURNAL_SECTORS):
        begin = JOURNAL_OFFSET + sector * SECTOR_BYTES
        for at in range(begin, begin + SECTOR_BYTES, ENTRY_BYTES):
            sequence, slot, crc = _ENTRY.unpack_from(image, at)
            if entry_bytes(sequence, slot, crc) == image[at : at + ENTRY_BYTES] and slot < SLOTS:
                found.append(Entry(sequence, slot, crc, sector))
    if not found:
        return []
    anchor = found[0].sequence
    return sorted(found, key=lambda e: (e.sequence - anchor + 2**31) % 2**32, reverse=True)


def whole_table(image: bytes, slot: int) -> bytes | None:
    """The table in a slot, if its CRC is right."""
    data = image[slot * SLOT_BYTES : (slot + 1) * SLOT_BYTES]
    total = int.from_bytes(data[_AT["total_bytes"] :][:4], "little")
    smallest = layout.HEADER_BYTES + layout.CRC_BYTES
    if data[: len(layout.MAGIC)] != layout.MAGIC or not smallest <= total <= SLOT_BYTES:
        return None
    table = data[:total]
    crc = zlib.crc32(table[: -layout.CRC_BYTES])
    return table if table[-layout.CRC_BYTES :] == struct.pack("<I", crc) else None


def slot_in_use(image: bytes) -> int:
    """The slot that a start would play."""
    _check(image)
    tables = [whole_table(image, slot) for slot in range(SLOTS)]
    for entry in entries(image):
        table = tables[entry.slot]
        if table is not None and int.from_bytes(table[-4:], "little") == entry.table_crc:
            return entry.slot
    return 1 if tables[0] is None and tables[1] is not None else 0


def update(image: bytes, table: bytes) -> list[tuple[int, bytes]]:
    """Writes that put a table into the other slot and make it count, in order.

    Each is of whole sectors, at an offset in the partition. The last one goes to the journal sector
    that does not hold the newest entry, so that a cut in it costs nothing.

    Raises
    ------
    InputError
        The image is no tables partition, or the table is larger than a slot.
    """
    _check(image)
    if len(table) > SLOT_BYTES:
        raise InputError("table", f"{len(table)} bytes", f"at most {SLOT_BYTES}")
    slot = 1 - slot_in_use(image)
    known = entries(image)
    sequence = known[0].sequence + 1 if known else 1
    sector = 1 - known[0].sector if known else 0
    journal, old = b"", whole_table(image, 1 - slot)
    if not known and old is not None:
        # A table that played without an entry gets one, so that there is a way back to it.
        journal = entry_bytes(sequence, 1 - slot, int.from_bytes(old[-4:], "little"))
        sequence += 1
    journal += entry_bytes(sequence, slot, int.from_bytes(table[-4:], "little"))
    return [
        (slot * SLOT_BYTES, _whole_sectors(table)),
        (JOURNAL_OFFSET + sector * SECTOR_BYTES, _whole_sectors(journal)),
    ]


def _whole_sectors(data: bytes) -> bytes:
    return data + b"\xff" * (-len(data) % SECTOR_BYTES)


def _check(image: bytes) -> None:
    if len(image) != PARTITION_BYTES:
        raise InputError("tables partition", f"{len(image)} bytes", f"{PARTITION_BYTES}")
