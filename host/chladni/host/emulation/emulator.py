"""The shipped firmware on a virtual clock: flash a table, touch the board, record the pins."""

from __future__ import annotations

import dataclasses
import hmac
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from chladni.host.emulation._emulator import Emulator as Core
from chladni.host.emulation._emulator import Hardware as CoreHardware
from chladni.host.emulation._emulator import panel_place
from chladni.host.protocol.board_config import config_of
from chladni.host.protocol.config import PANELS, TIMER_HZ, DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.host.protocol.slot_store import BANK_PARTITION_BYTES, PARTITION_BYTES, SLOT_BYTES
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import NOT_WIRED, ChipName
from chladni.sim.board.gpio import CHIPS
from chladni.sim.errors import ChladniError, InputError
from chladni.tables.format import pack
from chladni.tables.layout import MAX_ACTUATORS
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]

LEVEL = 0.8
"""Share of full amplitude that is played: the rest is headroom."""
PIXELS_PER_MM = 16
"""Of a panel made up for a board that has none: a finger is 0.03 mm off at most."""


CONFIGURE = "`chladni board show` says which pins a board has"
VERIFY = "`chladni table verify` checks the table"
SHOW = "`chladni table show` lists its frequencies"


class EmulatorError(ChladniError):
    """The firmware refused the table, or did what the hardware would not forgive."""


@dataclass(frozen=True)
class Hardware:
    """What the emulated board is like; times in microseconds.

    Attributes
    ----------
    chip
        What the firmware takes itself to run on.
    panel
        Controller on the bus.
    interrupt_us, jitter_us
        Latency of the sample interrupt, and how much more it may be at random.
    bank_sectors
        Of flash for effect banks; a device that was partitioned before there were these has 0.
    wake_us
        From the panel's call to the main loop.
    erase_us, program_us
        Of a sector of flash, and of a byte.
    restart_us
        From a reset to the running firmware.
    watchdog_us
        A main loop that hangs for so long is reset.
    baud
        Of the console and link, bits per second of virtual time; the configuration's by default.
    is_rested
        Whether the device knows after a power-on that its coils are cold; a real one cannot.
    first_us, first_ms, first_samples
        What the firmware's clocks begin with: they wrap after 71.6 minutes, 49.7 days and 61 hours.
    seed
        Of the jitter.
    """

    chip: ChipName = "esp32"
    panel: Literal["none", "ft6x36", "gt911"] = "gt911"
    has_second_address: bool = False
    table_sectors: int = PARTITION_BYTES // 4096
    bank_sectors: int = BANK_PARTITION_BYTES // 4096
    interrupt_us: float = 2.0
    jitter_us: float = 0.0
    wake_us: float = 20.0
    erase_us: float = 45_000.0
    program_us: float = 2.5
    restart_us: float = 300_000.0
    watchdog_us: float = 5e6
    baud: float | None = None
    is_rested: bool = True
    first_us: int = 0
    first_ms: int = 0
    first_samples: int = 0
    seed: int = 1


@dataclass(frozen=True)
class TouchEvent:
    """A finger at a place (mm from the board's centre) from a time on; None lifts it."""

    at_ms: float
    place_mm: tuple[float, float] | None
    finger: int = 0


@dataclass(frozen=True)
class Recording:
    """What the pins did.

    Attributes
    ----------
    duty_steps
        Latched duties, int16, one row per carrier period, shape (periods, channels); a bridge's
        have its sign.
    carrier_hz
        Carrier frequency.
    pwm_bits
        A duty of 1 is 2^pwm_bits steps.
    panel_reports
        Carrier periods in which the panel had news of fingers.
    """

    duty_steps: NDArray[np.int16]
    carrier_hz: float
    pwm_bits: int
    panel_reports: tuple[int, ...] = ()

    @property
    def duty(self) -> FloatArray:
        """Duties from 0 to 1, a bridge's from -1, shape (periods, channels)."""
        return self.duty_steps / float(1 << self.pwm_bits)

    @property
    def t_s(self) -> FloatArray:
        """Begin of every carrier period, s."""
        return np.arange(self.duty_steps.shape[0]) / self.carrier_hz


def fitting_hardware(board: Board | None, **others: Any) -> Hardware:
    """What a board's file says of its panel, or a GT911; a board without a panel gets one too."""
    panel = board.panel.controller if board is not None and board.panel is not None else "find"
    if board is not None:
        others = {"chip": board.electronics.chip} | others
    return Hardware(panel="gt911" if panel == "find" else panel, **others)


def emulated_config(board: Board, **settings: Any) -> DeviceConfig:
    """A board's configuration, with a panel that covers it if the board has none."""
    if not board.electronics.pwm_pins:
        settings = _any_pins(board) | settings
    if board.panel is None:
        width, length = board.plate.size
        made_up = covering_panel(1e3 * width, 1e3 * length, board.electronics.chip)
        settings = made_up | settings
    return config_of(board, **settings)


def _any_pins(board: Board) -> dict[str, tuple[int, ...]]:
    """Of a study without electronics: any gates will do, and any signs beside them."""
    own, none = CHIPS[board.electronics.chip], (NOT_WIRED,) * MAX_ACTUATORS
    taken = () if board.panel is None else tuple(board.panel.pins.values())
    free = [pin for pin in own.signs if pin not in taken]
    signs = free[-len(board.actuators) :] if board.electronics.is_bridge else []
    gates = [pin for pin in own.gates if pin not in (*signs, *taken)]
    return {
        "pwm_pins": (*gates, *none)[:MAX_ACTUATORS],
        "sign_pins": (*signs, *none)[:MAX_ACTUATORS],
    }


def covering_panel(width_mm: float, length_mm: float, chip: ChipName = "esp32") -> dict[str, int]:
    """Settings of a panel with an interrupt line over a whole board."""
    sda, scl, interrupt = CHIPS[chip].panel
    return {
        "panel": PANELS.index("find"),
        "sda_pin": sda,
        "scl_pin": scl,
        "interrupt_pin": interrupt,
        "panel_columns": min(max(round(width_mm * PIXELS_PER_MM), 16), 4096),
        "panel_rows": min(max(round(length_mm * PIXELS_PER_MM), 16), 4096),
        "panel_width_um": round(width_mm * 1e3),
        "panel_length_um": round(length_mm * 1e3),
    }


class Emulator:
    """An emulated board with a table in flash, powered on.

    Parameters
    ----------
    board
        The board, or the configuration of its device.
    table
        A table, or the bytes of one (which may be damaged: the device decides), or none.
    hardware
        What the firmware runs on; by default with the panel that the board's file names.
    level
        Share of full amplitude, 0 to 1.
    frequency_hz
        Of the drives to play; those of the table's first section by default.
    must_play
        Whether a table that the device refuses is an error.
    network
        What it finds in flash to be reached over a network; nothing by default.
    flash
        All of its flash, by area, in place of configuration, table and network: a device that has
        been used before, or a new one if it is empty.
    **settings
        Of the configuration, by name, instead of the board's.

    Raises
    ------
    EmulatorError
        The device refused the table; says why.
    """

    def __init__(
        self,
        board: Board | DeviceConfig,
        table: Table | bytes | None,
        *,
        hardware: Hardware | None = None,
        level: float = LEVEL,
        frequency_hz: float | None = None,
        must_play: bool = True,
        network: NetworkSettings | None = None,
        flash: Mapping[str, bytes] | None = None,
        bank: bytes = b"",
        **settings: Any,
    ) -> None:
        settings = {"level_q15": round(level * 32767.0)} | settings
        if isinstance(board, Board):
            self.config = emulated_config(board, **settings)
        else:
            self.config = board.with_values(**settings)
        self.config = self.config.by_wire()
        data = pack(table) if isinstance(table, Table) else table or b""
        if len(data) > SLOT_BYTES:
            raise InputError("table", f"{len(data)} bytes", f"at most {SLOT_BYTES}")
        made = CoreHardware()
        if hardware is None:
            hardware = fitting_hardware(board if isinstance(board, Board) else None)
        for field in dataclasses.fields(hardware):
            value = getattr(hardware, field.name)
            if field.name == "chip":
                value = tuple(CHIPS).index(value)
            setattr(made, field.name, 0.0 if value is None else value)
        self.core = Core(made)
        self.core.set_hmac(_hmac_sha256)
        made_up = {"tables": data, "config": pack_config(self.config), "effects": bank}
        contents = made_up if flash is None else flash
        for area, held in contents.items():
            self.core.program(0, held, area)
        if network is not None:
            self.core.program(0, pack_network(network), "network")
        self.core.boot()
        status = self.core.table_status
        if status != "ok" and must_play:
            raise EmulatorError(f"the device refused the table: {status}", hint=VERIFY)
        if isinstance(board, Board) and self.core.config_status != "ok" and must_play:
            raise EmulatorError(
                f"the device plays nothing: {self.core.config_status}", hint=CONFIGURE
            )
        if frequency_hz is not None:
            self.core.command(f"frequency {round(frequency_hz * 1000.0)}")
            if self.core.printed[-1] != "ok":
                raise EmulatorError(f"{frequency_hz:g} Hz: {self.core.printed[-1]}", hint=SHOW)

    @property
    def carrier_hz(self) -> float:
        """Carrier periods per second of the virtual clock."""
        return float(TIMER_HZ / (1 << self.config["pwm_bits"]))

    def touch(self, event: TouchEvent) -> None:
        """Let a finger arrive, move or leave at a time that has not passed yet.

        Raises
        ------
        InputError
            The panel does not reach there.
        """
        at_us = round(event.at_ms * 1000.0)
        if event.place_mm is None:
            self.core.finger_up(at_us, event.finger)
            return
        x, y = event.place_mm
        if not self.core.panel_sees(x, y):
            hint = "`size_mm`, `offset_mm` and `rotation_deg` of [panel] say where that is"
            raise InputError("touch", f"{x:g}, {y:g}", "a place that the panel senses", hint=hint)
        self.core.finger_down(at_us, x, y, event.finger)

    def run(self, milliseconds: float) -> Recording:
        """Advance the clock and return what the pins did meanwhile.

        Raises
        ------
        EmulatorError
            The firmware did something the hardware would not forgive.
        """
        begun, reported = self.core.period, len(self.core.calls)
        try:
            self.core.run_us(round(milliseconds * 1000.0))
        except RuntimeError as error:
            at = f"at {self.core.now_us / 1000.0:.3f} ms"
            raise EmulatorError(f"{at}: {error}", hint="this is a fault of the firmware") from None
        reports = tuple(call - begun for call in self.core.calls[reported:])
        return Recording(self.core.take_duties(), self.carrier_hz, self.config["pwm_bits"], reports)


def _hmac_sha256(key: bytes, data: bytes) -> bytes:
    """What the chip's library does for the device."""
    return hmac.digest(key, data, "sha256")


def reported_um(config: DeviceConfig, place_mm: tuple[float, float]) -> tuple[int, int]:
    """Centre, on the board, of the panel's pixel under a place."""
    turns = np.exp(-0.5j * np.pi * config["panel_turns"])
    offset = complex(config["panel_x_um"], config["panel_y_um"]) * 1e-3
    on_panel = (complex(*place_mm) - offset) * turns
    u, v = on_panel.real, on_panel.imag
    if config["panel_mirrored"]:
        u = -u
    pixels = [
        int(np.clip(np.floor((at * 1e3 / size + 0.5) * count), 0, count - 1))
        for at, size, count in (
            (u, config["panel_width_um"], config["panel_columns"]),
            (v, config["panel_length_um"], config["panel_rows"]),
        )
    ]
    return panel_place(pack_config(config), *pixels)


def emulate(
    board: Board | DeviceConfig,
    table: Table,
    touches: Sequence[TouchEvent],
    milliseconds: float,
    **options: Any,
) -> Recording:
    """Power on with a table, play touches (any order), and record the pins.

    `options` are those of `Emulator`.
    """
    emulator = Emulator(board, table, **options)
    for event in sorted(touches, key=lambda event: event.at_ms):
        emulator.touch(event)
    return emulator.run(milliseconds)
