"""What both readers of tables say of bytes: Python's and the firmware's."""

from __future__ import annotations

from chladni.host.protocol.codes import TABLE_STATUS
from chladni.tables._firmware import FirmwareTable
from chladni.tables.format import TableRefusedError, unpack

OK = "kOk"


def readings(data: bytes) -> tuple[str, str]:
    """What Python's reader and the firmware's say of bytes, by the names of `TableStatus`."""
    channels = max(data[7], 1) if len(data) > 7 else 5
    try:
        unpack(data)
        python = OK
    except TableRefusedError as error:
        python = error.verdict
    firmware = FirmwareTable(data, channels).status
    (name,) = (code.name for code in TABLE_STATUS.members if code.text == firmware)
    return python, name


def assert_both_refuse(data: bytes) -> None:
    python, firmware = readings(data)
    assert python == firmware != OK
