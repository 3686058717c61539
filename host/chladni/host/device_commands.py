"""`chladni flash` and `chladni device`: a device at a port, or an emulated one."""

from __future__ import annotations

import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from serial.tools import list_ports

from chladni.host.console import answer, parse_place, progress_bar
from chladni.host.device import Device
from chladni.host.device_config import SETTINGS, WAVEFORMS, DeviceConfig
from chladni.host.emulator import Emulator
from chladni.host.link import LinkError
from chladni.host.options import JsonOption
from chladni.host.wire import BAUD, EmulatorWire, SerialWire, Wire
from chladni.sim.board_file import load_board
from chladni.sim.errors import InputError
from chladni.tables.format import pack, read_table

PortOption = Annotated[str | None, typer.Option(help="Serial port of the device.")]
BaudOption = Annotated[int, typer.Option(help="Bits per second.")]
EmulatorOption = Annotated[bool, typer.Option("--emulator", help="An emulated device instead.")]
BoardOption = Annotated[str, typer.Option(help="The emulated device's board.")]
TableOption = Annotated[
    Path | None, typer.Option("--table", help="What the emulated device has in flash.")
]
REPEAT_S = 0.05
SELF_TEST_S = 0.6
SELF_TEST_GAIN = 0.5

device_app = typer.Typer(help="Ask a device and tell it what to do.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command("flash")(flash)
    app.add_typer(device_app, name="device")


def open_wire(
    port: str | None, emulator: bool, baud: int, board: str, table: Path | None = None
) -> Wire:
    """The wire that the options name.

    Raises
    ------
    InputError
        Both or neither of --port and --emulator.
    WireError
        The port cannot be opened.
    """
    if emulator == (port is not None):
        raise InputError("--port, --emulator", port or "neither", "one of the two")
    if port is not None:
        return SerialWire(port, baud=baud)
    data = pack(read_table(table)) if table else None
    return EmulatorWire(Emulator(load_board(board), data, must_play=False))


def flash(
    table: Annotated[
        Path | None, typer.Argument(metavar="TABLE", help="Table file (.chl).")
    ] = None,
    previous: Annotated[
        bool, typer.Option("--previous", help="Go back to the table before this one.")
    ] = False,
    rom: Annotated[
        bool, typer.Option("--rom", help="Through the ROM's loader: the device need not run.")
    ] = False,
    firmware: Annotated[
        Path | None, typer.Option("--firmware", help="The firmware itself, through the loader.")
    ] = None,
    port: PortOption = None,
    emulator: EmulatorOption = False,
    baud: BaudOption = BAUD,
    board: BoardOption = "prototype",
    as_json: JsonOption = False,
) -> None:
    """Write a table to a device; until it is whole the old one stays."""
    if sum((previous, table is not None, firmware is not None)) != 1:
        raise InputError("TABLE, --previous, --firmware", str(table), "one of the three")
    if rom or firmware is not None:
        _flash_by_rom(table, firmware, port, baud, as_json=as_json)
        return
    loaded = None if table is None else read_table(table)
    with Device(open_wire(port, emulator, baud, board)) as device:
        if loaded is None:
            slot = device.previous()
            result: dict[str, Any] = {"slot": slot, "board": device.info()["board"]}
            answer(result, as_json=as_json, title="The previous table plays")
            return
        with progress_bar("flash") as progress:
            done = device.flash(loaded, progress)
        if not done.verified:
            raise LinkError("the device does not say that it plays this table")
    answer(asdict(done), as_json=as_json, title=f"{table} plays")


def _flash_by_rom(
    table: Path | None, firmware: Path | None, port: str | None, baud: int, *, as_json: bool
) -> None:
    from chladni.host import rom  # noqa: PLC0415  (esptool takes a second to load)

    if port is None:
        raise InputError("--port", "nothing", "the port of the device")
    begun = time.monotonic()
    if firmware is not None:
        if not firmware.is_file():
            raise InputError("--firmware", str(firmware), "a readable file")
        result = rom.flash_firmware(port, baud, firmware)
    else:
        if table is None:
            raise InputError("--rom", "no table", "a table: going back needs a running device")
        result = rom.flash_table(port, baud, pack(read_table(table)))
    result["seconds"] = time.monotonic() - begun
    answer(result, as_json=as_json, title=f"{firmware or table} is written")


@device_app.command("info")
def info(
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype", table: TableOption = None, as_json: JsonOption = False,
) -> None:  # fmt: skip
    """State, table, heat and faults."""
    with Device(open_wire(port, emulator, baud, board, table)) as device:
        version = device.version.fields
        result = {"link": f"{version['major']}.{version['minor']}"} | device.info()
        result["faults"] = device.faults()
    answer(result, as_json=as_json, title="Device")


@device_app.command("touch", context_settings={"ignore_unknown_options": True})
def touch(
    place: Annotated[str, typer.Argument(metavar="X,Y", help="Place in mm.")],
    seconds: Annotated[float, typer.Option(help="How long the finger stays.")] = 1.0,
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype", table: TableOption = None, as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Play a place for a while, as a finger would."""
    x, y = parse_place(place, "X,Y")
    if not 0.0 < seconds <= 60.0:
        raise InputError("--seconds", seconds, "more than 0, at most 60")
    with Device(open_wire(port, emulator, baud, board, table)) as device:
        device.touch(x, y)
        _wait(device, seconds)
        state = device.info()["state"]
        device.lift()
    if state != "playing":
        raise LinkError(f"the device did not play: {state}")
    answer({"place_mm": [x, y], "seconds": seconds, "state": state}, as_json=as_json, title="Touch")


@device_app.command("stream")
def stream(
    drive: Annotated[
        str | None, typer.Argument(help="Gain@degrees per channel: 1@0,0.5@90,…")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", help="Duties instead, 0 to 1: a row per frame.")
    ] = None,
    frequency: Annotated[float, typer.Option(help="Hz.")] = 160.0,
    waveform: Annotated[str, typer.Option(help="sine, triangle, square or ramp.")] = "sine",
    seconds: Annotated[float, typer.Option(help="How long a drive is repeated.")] = 1.0,
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype", as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Play a drive from here, as the paper's host did, or raw duties at carrier/8 a second."""
    if (drive is None) == (csv is None):
        raise InputError("DRIVE, --csv", drive, "one of the two")
    if not 1.0 <= frequency <= 1000.0:
        raise InputError("--frequency", frequency, "1 to 1000 Hz")
    if waveform not in WAVEFORMS:
        raise InputError("--waveform", waveform, ", ".join(WAVEFORMS))
    if not 0.0 < seconds <= 600.0:
        raise InputError("--seconds", seconds, "more than 0, at most 600")
    gains = parse_drive(drive) if drive is not None else []
    duties = None if csv is None else read_duties(csv)
    with Device(open_wire(port, emulator, baud, board)) as device:
        channels = device.info()["channels"]
        given = len(gains) if duties is None else duties.shape[1]
        if given != channels:
            raise InputError("DRIVE" if duties is None else "--csv", given, f"{channels} channels")
        result: dict[str, Any] = {}
        if duties is None:
            _play(device, gains, frequency, waveform, seconds)
            result["seconds"] = seconds
        else:
            result["frames"] = device.stream(duties)
        result["supply_ma"] = device.info()["supply_ma"]
        device.stop()
        result["faults"] = device.faults()
    answer(result, as_json=as_json, title="Stream")


def read_duties(path: Path) -> NDArray[np.float64]:
    """Duties from 0 to 1, a row per frame and a column per channel.

    Raises
    ------
    InputError
        Not readable, not such numbers, or no rows.
    """
    try:
        duties = np.loadtxt(path, delimiter=",", ndmin=2)
    except OSError as error:
        raise InputError("--csv", error.strerror, "a readable file", file=str(path)) from None
    except ValueError as error:
        raise InputError("--csv", str(error), "rows of numbers", file=str(path)) from None
    if duties.size == 0 or not np.all((duties >= 0.0) & (duties <= 1.0)):
        raise InputError("--csv", "numbers outside", "duties from 0 to 1", file=str(path))
    return np.asarray(duties, dtype=np.float64)


@device_app.command("self-test")
def self_test(
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype", as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Play each actuator in turn at half amplitude, and report the current it should draw."""
    rows = []
    with Device(open_wire(port, emulator, baud, board)) as device:
        channels = device.info()["channels"]
        for channel in range(channels):
            gains = [SELF_TEST_GAIN if k == channel else 0.0 for k in range(channels)]
            _play(device, list(map(complex, gains)), 160.0, "sine", SELF_TEST_S)
            rows.append({"channel": channel, "supply_ma": device.info()["supply_ma"]})
            device.stop()
            _wait(device, 0.1)
        faults = device.faults()
    answer({"channels": rows, "faults": faults}, as_json=as_json, title="Self-test")


@device_app.command("log")
def log(
    seconds: Annotated[float, typer.Option(help="How long to listen.")] = 1.0,
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype",
) -> None:  # fmt: skip
    """Print what the device says between frames: boot, panics, the console."""
    with Device(open_wire(port, emulator, baud, board)) as device:
        _wait(device, seconds)
        sys.stdout.write(device.log)


@device_app.command("config")
def config(
    action: Annotated[str, typer.Argument(metavar="get|set", help="Show, or change.")] = "get",
    settings: Annotated[
        list[str] | None, typer.Argument(metavar="[NAME=VALUE]…", help="Settings to change.")
    ] = None,
    port: PortOption = None, emulator: EmulatorOption = False, baud: BaudOption = BAUD,
    board: BoardOption = "prototype", as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Show the configuration, or change settings and restart the device."""
    if action not in ("get", "set") or (action == "set") != bool(settings):
        raise InputError("get|set", action, "get, or set with at least one NAME=VALUE")
    changes = dict(map(parse_setting, settings or []))
    with Device(open_wire(port, emulator, baud, board)) as device:
        found = device.config()
        if changes:
            wanted = found.with_values(**changes)
            device.set_config(wanted)
            device.restart()
            _wait(device, 1.0)
            found = device.config()
            if found != wanted:
                raise LinkError("the device started with another configuration")
    values = {name: list(v) if isinstance(v, tuple) else v for name, v in found.values.items()}
    answer(values, as_json=as_json, title="Configuration")


@device_app.command("list")
def list_devices(as_json: JsonOption = False) -> None:
    """Serial ports and what is plugged into them."""
    ports = [
        {"port": port.device, "what": port.description, "usb": f"{port.vid:04x}:{port.pid:04x}"}
        for port in list_ports.comports()
        if port.vid is not None
    ]
    answer({"ports": ports}, as_json=as_json, title="Ports")


def parse_drive(text: str) -> list[complex]:
    """Gains of "1@0,0.5@90": shares of full amplitude at phases in degrees.

    Raises
    ------
    InputError
        Not of that form, or a gain above 1.
    """
    import cmath  # noqa: PLC0415

    gains = []
    for part in text.split(","):
        gain, _, phase = part.partition("@")
        try:
            value = cmath.rect(float(gain), cmath.pi / 180.0 * float(phase or 0.0))
        except ValueError:
            raise InputError("DRIVE", part, "GAIN@DEGREES, the gain from 0 to 1") from None
        if not 0.0 <= float(gain) <= 1.0:
            raise InputError("DRIVE", part, "a gain from 0 to 1")
        gains.append(value)
    return gains


def parse_setting(text: str) -> tuple[str, int | tuple[int, ...]]:
    """A name and its whole number, or numbers with commas.

    Raises
    ------
    InputError
        No such setting, or not of that form.
    """
    name, _, value = text.partition("=")
    known = {setting.field.name: setting for setting in SETTINGS}
    if name not in known:
        raise InputError(name, value, f"a setting: one of {', '.join(known)}")
    try:
        numbers = tuple(int(item, 0) for item in value.split(","))
    except ValueError:
        raise InputError(name, value, "whole numbers") from None
    parsed: int | tuple[int, ...] = numbers if known[name].field.count > 1 else numbers[0]
    DeviceConfig(**{name: parsed})
    return name, parsed


def _wait(device: Device, seconds: float) -> None:
    end = device.wire.now_s() + seconds
    while device.wire.now_s() < end:
        device.link.poll(min(REPEAT_S, end - device.wire.now_s()))


def _play(
    device: Device, gains: list[complex], frequency_hz: float, waveform: str, seconds: float
) -> None:
    """Repeat a live drive for a while, well within the device's timeout."""
    end = device.wire.now_s() + seconds
    while device.wire.now_s() < end:
        device.live(gains, frequency_hz, waveform)
        _wait(device, REPEAT_S)
