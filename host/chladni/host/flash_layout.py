"""The device's own partitions: where tables and the journal of tables lie.

The `tables` partition holds two slots and a journal. A table is written to the slot that is not in
use, read back, and only then entered into the journal; the newest entry whose table is whole
counts. `tools/generate_headers.py` writes the C++ header.
"""

from __future__ import annotations

from chladni.tables.layout import Field

SECTOR_BYTES = 4096
"""What flash erases at once."""
PARTITION_BYTES = 128 * 1024
"""Of `tables` (firmware/esp32/chip/partitions.csv)."""
SLOTS = 2
SLOT_SECTORS = 15
SLOT_BYTES = SLOT_SECTORS * SECTOR_BYTES
JOURNAL_SECTORS = 2
JOURNAL_OFFSET = SLOTS * SLOT_BYTES
ENTRY_FIELDS = (
    Field("sequence", "u32", "One more than the entry before; the newest counts."),
    Field("slot", "u32", "0 or 1."),
    Field("table_crc", "u32", "The table's last four bytes."),
    Field("entry_crc", "u32", "CRC-32 of the twelve bytes before."),
)
ENTRY_BYTES = sum(field.size for field in ENTRY_FIELDS)
assert JOURNAL_OFFSET + JOURNAL_SECTORS * SECTOR_BYTES == PARTITION_BYTES
