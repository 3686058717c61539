"""A device at the other end of a wire: what it is, what it plays, and a new table for it."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.device_effects import DeviceEffects
from chladni.host.device.device_fingers import DeviceFingers
from chladni.host.device.stream_sources import PlayedSignal
from chladni.host.device.streaming import BUFFER_S, StreamStep, stream_steps
from chladni.host.device.table_check import check_table
from chladni.host.device.touch_keeper import TouchKeeper
from chladni.host.device.upload import TABLES, Flashed, Progress, upload
from chladni.host.device.wires.link import (
    BRIEF_TRIES,
    BRIEF_WAIT_S,
    GREETING_TRIES,
    TRY_AGAIN,
    Link,
    LinkError,
)
from chladni.host.device.wires.wire import Wire
from chladni.host.protocol.codes import (
    CONFIG_STATUS,
    DEVICE_STATE,
    FAULT_CAUSE,
    PANEL_HEALTH,
    TABLE_STATUS,
)
from chladni.host.protocol.config import DeviceConfig, pack_config, unpack_config
from chladni.host.protocol.link import (
    BY_NAME,
    VERSION_MAJOR,
    VERSION_MINOR,
)
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.host.protocol.slot_store import SECTOR_ERASES
from chladni.sim.board.gpio import CHIPS
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import ChladniError
from chladni.tables.format import pack, unpack
from chladni.tables.table import Table

if TYPE_CHECKING:
    from chladni.effects.effect import Effect

FloatArray = NDArray[np.float64]

NETWORK_STATES = ("off", "not on the network", "on")
REACH_MINOR = DRIVER_CHANGE_MINOR = 7
"""Of the link: older devices know no such requests."""
RESTART_TRIES, RESTART_S = 3, 1.0


class Device:
    """Asks a device and tells it what to do; a context manager that lets go of the wire.

    Raises
    ------
    LinkError
        No device answers, or it speaks another version of the link.
    """

    def __init__(self, wire: Wire) -> None:
        self.wire = wire
        self.link = Link(wire)
        self._keeper = TouchKeeper(self.link)
        self.fingers = DeviceFingers(self.link, self._keeper)
        self.effects = DeviceEffects(self.link, self._keeper)
        try:
            self.version = self.link.request(
                "hello", tries=GREETING_TRIES, major=VERSION_MAJOR, minor=VERSION_MINOR
            )
        except LinkError as error:
            wire.close()
            if error.status is not None:
                raise
            raise LinkError(
                "no device answers there", hint="is it a Chladni device, at this baud rate?"
            ) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Lift a finger that is held, within 0.3 s or not at all, and let go of the wire."""
        if self._keeper.is_holding:
            self._keeper.end()
            with contextlib.suppress(ChladniError):
                self.link.request("lift", tries=BRIEF_TRIES, first_wait_s=BRIEF_WAIT_S)
        with self.link.lock:
            self.wire.close()

    def info(self) -> dict[str, Any]:
        """State, table, heat: the answer's fields, with words for codes."""
        found = self.link.request("info").fields
        channels = found.pop("channels")
        rises = found.pop("rise_dk")[:channels]
        return found | {
            "state": DEVICE_STATE.text(found["state"]),
            "table_status": TABLE_STATUS.text(found["table_status"]),
            "panel_health": PANEL_HEALTH.text(found["panel_health"]),
            "config_status": CONFIG_STATUS.text(found["config_status"]),
            "chip": tuple(CHIPS)[found["chip"]],
            "channels": channels,
            "board": found["board"].rstrip(b"\0").decode("ascii", "replace"),
            "fingerprint": f"{found['fingerprint']:#018x}",
            "table_crc": f"{found['table_crc']:#010x}",
            "flash_life_used": found["updates"] / SECTOR_ERASES,
            "coil_rise_k": [rise / 10.0 for rise in rises],
            # The old name, which reads as megahertz: until 0.3.0.
            "frequency_mhz": found["frequency_millihertz"],
            "standing": [
                code.text
                for k, code in enumerate(FAULT_CAUSE.members)
                if found["standing"] >> k & 1
            ],
        }

    def faults(self) -> list[dict[str, Any]]:
        """The last faults, oldest first."""
        tail = self.link.request("faults").tail
        return [
            {"cause": FAULT_CAUSE.text(cause), "detail": detail, "at_ms": at_ms}
            for cause, detail, at_ms in BY_NAME["faults"].entry.iter_unpack(tail)
        ]

    def reach_mm(self) -> tuple[float, float, float, float] | None:
        """Left, bottom, right and top of the table's board; None of a device that does not say."""
        if self.version.fields["minor"] < REACH_MINOR:
            return None
        found = self.link.request("reach").fields
        left, bottom, right, top = (own / 1e3 for own in found.values())
        return None if left == right else (left, bottom, right, top)

    def touch(self, x_mm: float, y_mm: float) -> tuple[float, float]:
        """Hold a finger there until `lift`; the place that plays, mm: the nearest on the board.

        While this program runs, it tells the device so: a device ends a touch whose host says
        nothing for 0.8 s. No touch is longer than the board's `max_on_s`.
        """
        with self._keeper.beginning():
            answer = self.link.request("touch", x_um=round(x_mm * 1e3), y_um=round(y_mm * 1e3))
        found = answer.fields
        return found["x_um"] / 1e3, found["y_um"] / 1e3

    def play(
        self, effect: Effect | str | Path, at: tuple[float, float], **level: Any
    ) -> PlayedSignal:
        """An effect under a finger, as `DeviceFingers.play_effect`: `level_db` or `level_um`."""
        return self.fingers.play_effect(effect, at, **level)

    def stream_signal(
        self,
        signal: FloatArray | Iterable[FloatArray],
        at: tuple[float, float],
        *,
        rate_hz: float,
        **level: Any,
    ) -> PlayedSignal:
        """A live signal under a finger, as `DeviceFingers.stream_signal`."""
        return self.fingers.stream_signal(signal, at, rate_hz=rate_hz, **level)

    def lift(self) -> float:
        """Let go; how long it played, s."""
        played_ms = self.link.request("lift").fields["played_ms"]
        self._keeper.end()
        return float(played_ms) / 1e3

    def select_frequency(self, frequency_hz: float) -> None:
        """Play the table's drives of another frequency from the next touch on."""
        self.link.request("frequency", millihertz=round(frequency_hz * 1e3))

    def set_waveform(self, waveform: str) -> None:
        """Of touches from now on: sine, triangle, square or ramp."""
        self.link.request("waveform", waveform=WAVEFORMS.index(waveform))

    def config(self) -> DeviceConfig:
        """The configuration in force."""
        return unpack_config(self.link.request("config_get").tail)[0]

    def set_config(self, config: DeviceConfig, *, change_driver: bool = False) -> None:
        """Keep a configuration; it is in force from the next start.

        From switches to bridges, or back, the device takes it only with `change_driver`: its coils
        must have been rewired.
        """
        # Older devices take any driver.
        knows = self.version.fields["minor"] >= DRIVER_CHANGE_MINOR
        if change_driver and knows and config["driver"] != self.config()["driver"]:
            self.link.request("driver_change", driver=config["driver"])
        self.link.request("config_set", pack_config(config))

    def network(self) -> dict[str, Any]:
        """Whether it can be reached over a network, and how."""
        found = self.link.request("network_get").fields
        return found | {
            "state": NETWORK_STATES[found["state"]],
            "ssid": found["ssid"].rstrip(b"\0").decode("utf-8", "replace"),
            "address": ".".join(map(str, found["address"].to_bytes(4, "little"))),
        }

    def set_network(self, settings: NetworkSettings | None) -> None:
        """Let it onto a network, or none, from the next start; over a wire only."""
        self.link.request("network_set", b"" if settings is None else pack_network(settings))

    def restart(self) -> None:
        """Restart the device.

        A lost answer is not asked for again, since that would restart it twice: its clock tells.
        """
        before = self.link.request("info").fields["uptime_ms"]
        for _ in range(RESTART_TRIES):
            try:
                self.link.request("restart", tries=1)
            except LinkError as error:
                if error.status is not None:
                    raise
                self.link.wait(RESTART_S)
                if self.link.request("info").fields["uptime_ms"] < before:
                    return
            else:
                return
        raise LinkError("restart: the device runs on", hint=TRY_AGAIN)

    def live(self, gains: Sequence[complex], frequency_hz: float, waveform: str = "sine") -> None:
        """Play a drive, 1 for full amplitude, until it is no longer repeated."""
        tail = b"".join(
            BY_NAME["live"].entry.pack(round(gain.real * 32767.0), round(gain.imag * 32767.0))
            for gain in map(complex, gains)
        )
        self.link.request(
            "live", tail, millihertz=round(frequency_hz * 1e3), waveform=WAVEFORMS.index(waveform)
        )

    def stream(
        self,
        duties: NDArray[np.float64],
        *,
        buffer_s: float = BUFFER_S,
        is_signed: bool | None = None,
    ) -> int:
        """Play raw duties at carrier/8 frames a second of this machine's clock.

        Parameters
        ----------
        duties
            Shares of a carrier period, 0 to 1, of bridges -1 to 1, shape (frames, channels). The
            device rounds to 10 bits and follows this clock within 1000 ppm.
        buffer_s
            Of frames that the device holds: what comes late by less is not heard, and all is heard
            that much later.
        is_signed
            Whether the duties are for bridges; a device with other drivers refuses them. By
            default they are taken for the device's own.

        Returns
        -------
        int
            Frames that the device has taken: all of them.

        Raises
        ------
        InputError
            Duties that its drivers cannot give.
        LinkError
            The wire is too slow for so many channels, its drivers are others, or it ended the
            stream.
        """
        steps = self.stream_steps(duties, buffer_s=buffer_s, is_signed=is_signed)
        return sum(step.taken for step in steps)

    def stream_steps(
        self,
        duties: NDArray[np.float64],
        *,
        buffer_s: float = BUFFER_S,
        is_signed: bool | None = None,
    ) -> Iterator[StreamStep]:
        """The same, piece by piece: what a request came to."""
        self._keeper.end()  # its answers would come in between
        config = self.config()
        return stream_steps(
            self.link,
            duties,
            rate_hz=config.frame_rate_hz,
            buffer_s=buffer_s,
            has_bridges=config.has_bridges if is_signed is None else is_signed,
        )

    def stop(self) -> None:
        """End a live drive or a stream."""
        self.link.request("stream_end")

    @property
    def log(self) -> str:
        """Text that came between frames: the boot loader's, a panic's, the console's."""
        return self.link.splitter.text.decode("utf-8", "replace")

    def check_table(self, table: Table, *, force: bool = False) -> None:
        """Raise `InputError` if a table is not for this device (table_check.py)."""
        minor = self.version.fields["minor"]
        check_table(table, self.config(), self.info(), minor, force=force)

    def flash(
        self, table: Table | bytes, progress: Progress | None = None, *, force: bool = False
    ) -> Flashed:
        """Write a table to the slot that is not in use; it plays once it is whole.

        Nothing is sent of a table that is not for the device (`check_table`), and nothing is
        written of one that is there already.

        Raises
        ------
        InputError
            The bytes are no table, or not one for this device.
        LinkError
            The device refused or fell silent; the old table plays on.
        """
        self._keeper.end()  # its answers would come in between
        data = pack(table) if isinstance(table, Table) else table
        self.check_table(unpack(data), force=force)

        def in_use() -> tuple[int, int]:
            found = self.link.request("info").fields
            return found["table_crc"], found["table_bytes"]

        return upload(self.link, TABLES, data, in_use, progress)

    def previous(self) -> int:
        """Go back to the other slot's table; returns the slot."""
        return int(self.link.request("table_previous").fields["slot"])
