"""The tables partition as an image: which table counts, and what an update writes where.

By the firmware's own store, for a device that does not run: the ROM's loader reads and writes its
flash (`rom_loader.py`).
"""

from __future__ import annotations

from chladni.host.protocol.slot_store import PARTITION_BYTES, SLOT_BYTES
from chladni.sim.errors import InputError
from chladni.tables._firmware import FirmwareStore


def slot_in_use(image: bytes) -> int:
    """The slot that a start would play.

    Raises
    ------
    InputError
        The image is no tables partition.
    """
    return _store(image).slot


def update(image: bytes, table: bytes) -> list[tuple[int, bytes]]:
    """Writes that put a table into the other slot and make it count, in order.

    None if it plays already. Each is of whole sectors, at an offset in the partition. The last one
    is the sector of the slot's trailer: until it is whole, the other slot's table counts.

    Raises
    ------
    InputError
        The image is no tables partition, or the firmware's store refuses the table.
    """
    store = _store(image)
    begin = store.slot * SLOT_BYTES
    if image[begin : begin + len(table)] == table:
        return []  # it plays already
    status = store.update(table)
    if status != "ok":
        raise InputError("table", f"{len(table)} bytes", f"a table for a slot: {status}")
    return store.writes()


def _store(image: bytes) -> FirmwareStore:
    if len(image) != PARTITION_BYTES:
        raise InputError("tables partition", f"{len(image)} bytes", f"{PARTITION_BYTES}")
    return FirmwareStore(image)
