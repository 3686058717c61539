"""Tables with made-up drives and short limits, and tables whose bytes were tampered with."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.region_grid import RegionGrid
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import (
    Emulator,
    Recording,
    TouchEvent,
    covering_panel,
)
from chladni.host.emulation.emulator import emulate as emulate_board
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.board.gpio import CHIPS
from chladni.tables import layout
from chladni.tables.format import pack
from chladni.tables.mirror_symmetry import NO_MIRRORS, MirrorSymmetry
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import Limits, ReckonedFinger, ResponsesSection, Section, Table, quantise


def emulate(
    table: Table, touches: list[TouchEvent], milliseconds: float, **options: Any
) -> Recording:
    return emulate_board(device_of(table), table, touches, milliseconds, **options)


def periods(recording: Recording, milliseconds: float) -> int:
    return int(milliseconds * 1e-3 * recording.carrier_hz)


SCRIPT = """
import numpy as np
def duties(t):
    return 0.2 + 0.1 * np.sin(2.0 * np.pi * 160.0 * t[:, None] + np.zeros({channels})) {more}
"""

RAMP_MS, TIMEOUT_MS, MAX_ON_MS = 4.0, 60.0, 400.0
LIMITS = Limits(int(RAMP_MS * 1e3), int(TIMEOUT_MS * 1e3), int(MAX_ON_MS * 1e3))
FULL_GAIN = 10.0


def make_section(
    drives: NDArray[Any],
    *,
    labels: NDArray[np.uint8] | None = None,
    crossings: Sequence[tuple[int, int]] = ((0, 0),),
    frequency_hz: float = 160.0,
) -> Section:
    """Drives (stored regions, actuators) of gains up to 10, which is full scale."""
    # A gain of full scale rounded up in both its parts would be beyond.
    iq = quantise(np.asarray(drives, dtype=np.complex128) * 0.9999, FULL_GAIN)
    marks = np.zeros(len(iq), dtype=np.uint8) if labels is None else labels
    kinds = np.array(crossings, dtype=np.uint8)
    return Section(frequency_hz, "ssim", FULL_GAIN, marks, kinds, iq)


def make_table(
    drives: NDArray[Any],
    columns: int = 1,
    rows: int = 1,
    symmetry: MirrorSymmetry = NO_MIRRORS,
    **section: Any,
) -> Table:
    """A table of one section on a board of 71.5 mm by 146.7 mm."""
    grid = RegionGrid(columns, rows, 71500, 146700)
    return Table("t", 1, grid, LIMITS, (make_section(drives, **section),), symmetry)


def random_table(
    columns: int,
    rows: int,
    actuators: int,
    seed: int,
    *,
    labels: int = 1,
    coarse: int = 0,
    symmetry: MirrorSymmetry = NO_MIRRORS,
    frequencies: Sequence[float] = (160.0,),
    bits: int = 16,
    span_um: tuple[int, int] = (71500, 146700),
) -> Table:
    """Random drives with `coarse` zero bits at their ends, in patches of random labels."""
    rng = np.random.default_rng(seed)
    grid = RegionGrid(columns, rows, *span_um)
    cells = StoredRegions(grid, symmetry).count
    sections = []
    for frequency in frequencies:
        iq = rng.integers(-23000, 23001, (cells, actuators, 2))
        zeros = max(coarse, 16 - bits)
        iq = np.sign(iq) * (np.abs(iq) >> zeros << zeros)
        # Some regions are silent, and some are as their neighbours.
        iq[rng.random(cells) < 0.1] = 0
        iq[1:][rng.random(cells - 1) < 0.2] = iq[0]
        marks = (
            np.sort(rng.integers(0, labels, cells)) if seed % 2 else rng.integers(0, labels, cells)
        )
        crossings = rng.integers(0, 3, (labels, 2)).astype(np.uint8)
        sections.append(
            Section(
                frequency, "ssim", FULL_GAIN, marks.astype(np.uint8), crossings, iq.astype(np.int16)
            )
        )
    return Table("t", 1, grid, LIMITS, tuple(sections), symmetry, bits)


def with_responses(
    table: Table, seed: int, *, alone: bool = False, frequencies: Sequence[float] = (160.0,)
) -> Table:
    """A table with random responses besides its drives, or in their place."""
    rng = np.random.default_rng(seed)
    count, zeros = table.actuators, 16 - table.bits
    sections = []
    for frequency in frequencies:
        iq = rng.integers(-23000, 23001, (table.regions.count, count + 1, 2))
        iq = np.sign(iq) * (np.abs(iq) >> zeros << zeros)
        scales = rng.integers(1, 2**32, 2).tolist()
        parts = rng.normal(size=(2, count, count)) * 10.0 ** rng.uniform(-3, 9)
        upper = np.triu(parts[0] + 1j * parts[1]).astype(np.complex64).astype(np.complex128)
        coupling = upper + np.triu(upper, 1).T
        known = rng.integers(0, 2**32, 2).tolist()
        stiffness = complex(*rng.normal(0.0, 1e3, 2).astype(np.float32))
        sections.append(
            ResponsesSection(
                frequency,
                scales[0],
                scales[1],
                coupling,
                iq.astype(np.int16),
                ReckonedFinger(known[0], known[1], stiffness),
            )
        )
    drives = () if alone else table.sections
    return replace(table, sections=drives, responses=tuple(sections))


def reversal(count: int) -> tuple[int, ...]:
    """An order that undoes itself."""
    return tuple(range(count))[::-1]


def with_crc(data: bytes | bytearray) -> bytes:
    """The bytes with their last four made right again."""
    return bytes(data[:-4]) + struct.pack("<I", zlib.crc32(data[:-4]))


def forge(table: Table, **fields: Any) -> bytes:
    """A table with header or first section's fields changed and the CRC made right again."""
    data = bytearray(pack(table))
    for begin, known in ((0, layout.HEADER_FIELDS), (layout.HEADER_BYTES, layout.SECTION_FIELDS)):
        places = layout.offsets(known)
        for field in known:
            if field.name in fields:
                at = begin + places[field.name]
                struct.pack_into("<" + field.code, data, at, fields[field.name])
    return with_crc(data)


def some_pins(count: int = 5) -> tuple[int, ...]:
    """Gates for so many channels, and none for the rest: any will do."""
    return (*CHIPS["esp32"].gates[:count], *(NOT_WIRED,) * (layout.MAX_ACTUATORS - count))


def device_of(table: Table | None = None, *, channels: int = 5, **settings: Any) -> DeviceConfig:
    """A device for a table, with a fine panel over its board and nothing that limits it."""
    grid = RegionGrid(1, 1, 71500, 146700) if table is None else table.grid
    count = channels if table is None else table.actuators
    known: dict[str, Any] = covering_panel(grid.width_um / 1e3, grid.length_um / 1e3)
    known |= {
        "channels": count,
        "pwm_pins": some_pins(count),
        "min_on_ns": 0,
        "supply_ma": 20_000,
        "full_rise_dk": (1,) * count + (0,) * (16 - count),
    }
    return DeviceConfig(**(known | settings))


def entry_bytes(sequence: int, table_crc: int) -> bytes:
    """An entry of a slot's trailer, as docs/flash.md has it."""
    body = struct.pack("<II", sequence % 2**32, table_crc)
    return body + struct.pack("<I", zlib.crc32(body))


def starts_of(recording: Recording) -> NDArray[np.int64]:
    """Carrier periods in which outputs come on after 5 ms of silence, or for the first time."""
    playing = np.flatnonzero(recording.duty_steps.any(axis=1))
    gap = int(5e-3 * recording.carrier_hz)
    return np.asarray(playing[np.diff(playing, prepend=-gap - 1) > gap])


def powered(table: Table | bytes, *, channels: int = 5, **options: Any) -> Emulator:
    """An emulated device with a table, powered on."""
    known = table if isinstance(table, Table) else None
    return Emulator(device_of(known, channels=channels), table, **options)


def assert_one_of_them_plays(emulator: Emulator, old: bytes, new: bytes, *, said: bool) -> None:
    """After an update over something bad and a start: the old table or the new, as was `said`."""
    emulator.run(6_000.0)
    emulator.core.boot()
    crc = int(Device(EmulatorWire(emulator)).info()["table_crc"], 16)
    crcs = [int.from_bytes(data[-4:], "little") for data in (old, new)]
    assert crc in crcs
    if said:
        assert crc == crcs[1]


class PacketWire:
    """A wire on which every frame is a packet, as a radio or a USB bridge would have it.

    What becomes of a packet is up to `out` (towards the device) and `back`.
    """

    def __init__(
        self, inner: EmulatorWire, out: Callable[[bytes], bytes], back: Callable[[bytes], bytes]
    ) -> None:
        self.inner = inner
        self._out, self._back = out, back
        self._held = b""

    @property
    def baud(self) -> float:
        """Bits per second."""
        return self.inner.baud

    def write(self, data: bytes) -> None:
        """Towards the device."""
        self.inner.write(self._out(data))

    def read(self, timeout_s: float) -> bytes:
        """From the device."""
        self._held += self.inner.read(timeout_s)
        end = self._held.rfind(b"\0") + 1
        packets, self._held = self._held[:end].split(b"\0\0"), self._held[end:]
        return b"".join(self._back(b"\0" + packet + b"\0") for packet in packets if packet)

    def now_s(self) -> float:
        """Virtual seconds."""
        return self.inner.now_s()

    def close(self) -> None:
        """Nothing to let go of."""
