"""The device's own partitions: where tables, effect banks and what is said of them lie.

The `tables` partition is two slots, and so is `effects`. A file is written to the slot that is not
in use, read back, and only then entered into the slot's trailer, its last sector, under a number
one higher than any before. The whole file with the highest number counts.
`tools/generate_headers.py` writes the C++ header.
"""

from __future__ import annotations

from chladni.tables.layout import LARGEST_FILE, Field

SECTOR_BYTES = 4096
"""What flash erases at once."""
SECTOR_ERASES = 100_000
"""That a sector stands at least, by the data sheets of serial NOR flash as modules have it (Winbond
W25Q32JV: 100,000 program-erase cycles per sector)."""
SLOTS = 2
SLOT_BYTES = 256 * 1024
TRAILER_OFFSET = SLOT_BYTES - SECTOR_BYTES
"""In a slot. Going back to a table appends an entry to its trailer."""
PARTITION_BYTES = SLOTS * SLOT_BYTES
"""Of `tables` (firmware/esp32/chip/partitions.csv)."""
BANK_SLOT_BYTES = 64 * 1024
BANK_PARTITION_BYTES = SLOTS * BANK_SLOT_BYTES
"""Of `effects`; a device that was partitioned before there were effects does without."""
ENTRY_FIELDS = (
    Field("sequence", "u32", "One more than the highest before; the highest counts."),
    Field("file_crc", "u32", "The file's last four bytes."),
    Field("entry_crc", "u32", "CRC-32 of the eight bytes before."),
)
ENTRY_BYTES = sum(field.size for field in ENTRY_FIELDS)
assert LARGEST_FILE == TRAILER_OFFSET
