"""How a command connects to a device: the options that all commands share, and their wire."""

from __future__ import annotations

import inspect
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

from chladni.host.cli.common.options import check_one_of, required
from chladni.host.cli.common.output import say
from chladni.host.cli.common.ranges import within
from chladni.host.device.device import Device
from chladni.host.device.wires.udp import UdpPort, UdpWire
from chladni.host.device.wires.wire import BAUD, EmulatorWire, SerialWire, Wire, WireError
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.network import read_key
from chladni.sim.board.file import load_board
from chladni.sim.errors import ConflictError
from chladni.tables.format import pack, read_table
from chladni.tables.inspection.owner import known_board

BAUDS = 300, 12_000_000
"""From the slowest modem to the fastest USB bridge."""
STARTS_S, TURN_S = 60.0, 0.05
"""`chladni emulate --serial` takes 1 to 3 s to start, with --hidden on a busy machine more than 15;
how often its link is looked for."""

EMULATED_BOARD = "prototype"

UdpOption = Annotated[
    str | None, typer.Option(metavar="HOST[:PORT]", help="Its address on the network.")
]
KeyOption = Annotated[
    Path | None, typer.Option(envvar="CHLADNI_KEY", help="File with its key. Required with --udp.")
]


@dataclass(frozen=True)
class Connection:
    """The options; exactly one of `port`, `udp` and `emulator` is to be given."""

    port: Annotated[
        str | None,
        typer.Option(
            help="Serial port of the device. One of --port, --udp and --emulator is required."
        ),
    ] = None
    udp: UdpOption = None
    key: KeyOption = None
    emulator: Annotated[bool, typer.Option("--emulator", help="An emulated device instead.")] = (
        False
    )
    baud: Annotated[
        int, typer.Option(callback=within(*BAUDS), help="Bits per second, but for --udp.")
    ] = BAUD
    board: Annotated[
        str | None,
        typer.Option(
            help=f"The emulated device's board, by default --table's, or {EMULATED_BOARD}."
        ),
    ] = None
    emulated_table: Annotated[
        Path | None, typer.Option("--table", help="What the emulated device has in flash.")
    ] = None
    emulated_bank: Annotated[
        str | None, typer.Option("--bank", metavar="BANK", help="Its effect bank: .che or .toml.")
    ] = None

    @cached_property
    def emulated_board(self) -> str:
        """What names the emulated device's board: --board, or what lies beside its table."""
        if self.board is not None or self.emulated_table is None:
            return self.board or EMULATED_BOARD
        file = self.emulated_table
        return str(known_board(read_table(file), str(file)) or EMULATED_BOARD)

    def wire(self) -> Wire:
        """The wire that the options name.

        Raises
        ------
        InputError
            None or several of --port, --udp and --emulator, no key, or an emulated device's board,
            table or bank for a device at a port.
        WireError
            It cannot be opened, or no device answers.
        """
        check_one_of(
            "the way to the device",
            port=self.port is not None,
            udp=self.udp is not None,
            emulator=self.emulator,
        )
        if not self.emulator:
            self._check_real()
        if self.port is not None:
            _await_link(Path(self.port))
            return SerialWire(self.port, baud=self.baud)
        if self.udp is not None:
            key = required("--key", self.key, "the file with the device's key, for --udp")
            return UdpWire(UdpPort(self.udp), read_key(key))
        data = pack(read_table(self.emulated_table)) if self.emulated_table else None
        board = load_board(self.emulated_board)
        bank = b""
        if self.emulated_bank is not None:
            # It loads SciPy, which takes longer than all else.
            from chladni.effects.bank.bank_file import bank_bytes  # noqa: PLC0415

            bank = bank_bytes(self.emulated_bank, "--bank")
        return EmulatorWire(Emulator(board, data, must_play=False, bank=bank, link_baud=self.baud))

    def _check_real(self) -> None:
        """Refuse what only an emulated device is given: a real one has its own."""
        given = {
            "--board": self.board is not None,
            "--table": self.emulated_table is not None,
            "--bank": self.emulated_bank is not None,
        }
        for option in filter(given.get, given):
            own = "--udp" if self.port is None else "--port"
            raise ConflictError(option, own, hint="a real device has its own")

    def loader_port(self) -> str:
        """The serial port with the ROM's loader, which no device need run for.

        Raises
        ------
        InputError
            --udp or --emulator, or no port.
        """
        if self.udp is not None or self.emulator:
            raise ConflictError("--rom", "--udp and --emulator", hint="the loader is at a --port")
        return required("--port", self.port, "where the chip's loader is")

    def device(self) -> Device:
        """The device behind that wire."""
        return Device(self.wire())


def _await_link(port: Path) -> None:
    """Wait for the --port-link of an emulated device that is still starting, and say so.

    Ports in /dev are there or not.

    Raises
    ------
    WireError
        It did not come.
    """
    if os.name != "posix" or port.is_relative_to("/dev") or port.exists():
        return
    say(f"{port} is not there: waiting up to {STARTS_S:g} s for an emulated device to make it")
    end = time.monotonic() + STARTS_S
    while not port.exists():
        if time.monotonic() > end:
            hint = (
                "an emulated device may still be starting, or has ended: "
                f"`chladni emulate --serial --port-link {port}` makes it; `chladni device list` "
                "shows the ports there are"
            )
            raise WireError(f"{port}: no such port", hint=hint)
        time.sleep(TURN_S)


def connecting(command: Callable[..., None]) -> Callable[..., None]:
    """A command whose first parameter is a `Connection`, with the options of one in its place."""
    hints = get_type_hints(command, include_extras=True)
    shared = get_type_hints(Connection, include_extras=True)
    own = list(inspect.signature(command).parameters.values())[1:]
    names = [field.name for field in fields(Connection)]

    def run(**values: Any) -> None:
        connection = Connection(**{name: values.pop(name) for name in names})
        command(connection, **values)

    options = [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=field.default,
            annotation=shared[field.name],
        )
        for field in fields(Connection)
    ]
    kept = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[p.name]) for p in own]
    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = inspect.Signature([*kept, *options])  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in (*kept, *options)}
    return run
