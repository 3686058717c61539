"""Whether a table is for a device: its channels, its board, what its firmware can read."""

from __future__ import annotations

from typing import Any

from chladni.host.protocol.config import DeviceConfig
from chladni.sim.board.board import fingerprint_text, is_of
from chladni.sim.errors import InputError
from chladni.tables.table import Table

RESPONSES_MINOR = 4
"""Link of the first firmware that reads responses."""


def check_table(
    table: Table, config: DeviceConfig, info: dict[str, Any], link_minor: int, *, force: bool
) -> None:
    """Raise `InputError` if a table is not for a device; parameters as `Device` knows them.

    The device's board is that of the file which it was configured from, or else that of the table
    which it plays; `force` lets another board's pass.
    """
    if table.responses and link_minor < RESPONSES_MINOR:
        raise InputError(
            "responses",
            f"a device of link 2.{link_minor}",
            f"firmware of link 2.{RESPONSES_MINOR} or newer, which reads them",
            hint="write new firmware first, or build the table by --for finger",
        )
    if table.actuators != config["channels"]:
        raise InputError(
            "actuators",
            table.actuators,
            f"{config['channels']}, the channels of the device",
            hint="configure it for the board by `device config set --from BOARD`, or name an "
            "emulated one's by --board",
        )
    known = config.board
    if known is None and info["board"]:
        known = int(info["fingerprint"], 16), info["board"]
    if force or known is None or is_of(table.board_fingerprint, known[0]):
        return
    own, wanted = table.board_fingerprint, known[0]
    if not own >> 32 or not wanted >> 32:
        # One has no more than the end: both are told in one form.
        own, wanted = own % 2**32, wanted % 2**32
    hint = "set the device's board by `device config set --from`, or give --force"
    expected = f"a table for {known[1]} ({fingerprint_text(wanted)}), the device's board"
    got = f"{table.board_name} ({fingerprint_text(own)})"
    if known[1] == table.board_name:
        expected = f"a table for the device's version of {known[1]} ({fingerprint_text(wanted)})"
        got = f"one for another version of its file ({fingerprint_text(own)})"
        hint = f"build the table again, or {hint}"
    raise InputError("board", got, expected, hint=hint)
