"""Bytes of a drive table: the one declaration from which reader, writer and C++ header come.

`docs/table-format.md` describes the same bytes in words; `tools/generate_headers.py` writes the
C++ header. Everything is little-endian.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import InputError
from chladni.tables.packing import (
    FULL_SCALE,
    MAX_BITS,
    MIN_BITS,
    PLAIN,
    UNFOLDED,
    Folding,
    Packing,
)  # fmt: skip
from chladni.tables.regions import RegionGrid

ComplexArray = NDArray[np.complex128]

MAGIC = b"CHLD"
VERSION_MAJOR, VERSION_MINOR = 0, 2
MAX_ACTUATORS = 8
"""High-speed LEDC channels of an ESP32."""
MAX_REGIONS = 4096
MAX_SPAN_UM = 500_000
"""So that (2 · place + span) and cells · span fit 32 bits on the device."""
MAX_CELLS_PER_SIDE = 2048
MIN_FREQUENCY_MHZ, MAX_FREQUENCY_MHZ = 1_000, 1_000_000
"""1 to 1000 Hz: beyond, a wave has too few samples for the synthesis."""
MIN_RAMP_US, MAX_RAMP_US = 500, 1_000_000
MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US = 30_000, 5_000_000
"""Three reports of a panel at the least, or a held finger would flicker."""
MIN_ON_US, MAX_ON_US = 100_000, 60_000_000
MAX_GAINS = 10_240
"""Gain pairs that fit into 40 KiB of the device's RAM: 2048 regions of five channels."""
CRC_BYTES = 4
BOARD_NAME_BYTES = 16
LARGEST_FILE = 1 << 20
"""Nothing larger is read: no table comes near it."""


@dataclass(frozen=True)
class Field:
    """One header field: name, C type, unit and meaning."""

    name: str
    kind: str
    doc: str

    @property
    def code(self) -> str:
        """Its code for `struct`."""
        return {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "char4": "4s", "char16": "16s"}[
            self.kind
        ]

    @property
    def size(self) -> int:
        """Bytes."""
        return struct.calcsize("<" + self.code)


HEADER_FIELDS = (
    Field("magic", "char4", 'The letters "CHLD".'),
    Field("version_major", "u8", "0. A reader refuses another."),
    Field("version_minor", "u8", "2. A reader refuses another: 0.x promises nothing."),
    Field("header_bytes", "u16", "84: where the payload begins."),
    Field("total_bytes", "u32", "Whole file, its CRC included."),
    Field("board_fingerprint", "u64", "64 bits of the SHA-256 of the board's physical numbers."),
    Field("board_name", "char16", "ASCII, filled up with zeros, at least one of them."),
    Field("frequency_mhz", "u32", "Drive frequency in millihertz."),
    Field("actuators", "u8", "Channels of every drive, 1 to 8."),
    Field("mirrors", "u8", "Bit 0: only the half at small x is stored; bit 1: at small y."),
    Field("in_phase_bits", "u8", "Width of an in-phase code, 2 to 16."),
    Field("quadrature_bits", "u8", "Width of a quadrature code, 2 to 16."),
    Field("columns", "u16", "Cells along x."),
    Field("rows", "u16", "Cells along y."),
    Field("width_um", "u32", "Board along x, micrometres."),
    Field("length_um", "u32", "Board along y, micrometres."),
    Field(
        "full_scale_gain_milli", "u32", "Gain that the integer 32767 stands for, in thousandths."
    ),
    Field("in_phase_scale", "u16", "What the largest in-phase code stands for, of 32767."),
    Field("quadrature_scale", "u16", "The same of the quadrature codes."),
    Field("mirror_x", "u32", "Nibble k: the actuator that is k's image in x → −x; else 0."),
    Field("mirror_y", "u32", "The same for y → −y."),
    Field("ramp_us", "u32", "A drive fades in, out and over in this time."),
    Field("touch_timeout_us", "u32", "Silence from the panel that counts as lift-up."),
    Field("max_on_us", "u32", "A touch plays no longer than this."),
)
HEADER_STRUCT = struct.Struct("<" + "".join(field.code for field in HEADER_FIELDS))
HEADER_BYTES = HEADER_STRUCT.size


def header_offsets() -> dict[str, int]:
    """Byte offset of every header field."""
    offsets, position = {}, 0
    for field in HEADER_FIELDS:
        offsets[field.name] = position
        position += field.size
    return offsets


@dataclass(frozen=True)
class Limits:
    """What the device keeps to, from the board file; µs."""

    ramp_us: int
    touch_timeout_us: int
    max_on_us: int


@dataclass(frozen=True)
class Table:
    """A drive table in memory.

    Attributes
    ----------
    iq
        int16, shape (regions, actuators, 2): in-phase and quadrature of every drive as the device
        decodes them, where 32767 stands for `full_scale_gain`.
    packing, folding
        How they are stored: widths of the codes, and the mirrors that stand for the rest.
    """

    board_name: str
    board_fingerprint: int
    frequency_hz: float
    grid: RegionGrid
    full_scale_gain: float
    limits: Limits
    iq: NDArray[np.int16]
    packing: Packing = PLAIN
    folding: Folding = UNFOLDED

    @property
    def actuators(self) -> int:
        """Channels of every drive."""
        return int(self.iq.shape[1])

    def drive(self, region: int) -> ComplexArray:
        """The drive of a region as the table holds it, shape (actuators,)."""
        return dequantise(self.iq[region], self.full_scale_gain)


def quantise(drives: ComplexArray, full_scale_gain: float) -> NDArray[np.int16]:
    """Drives of any shape as integers, in-phase and quadrature along a new last axis."""
    scaled = np.stack((drives.real, drives.imag), axis=-1) * (FULL_SCALE / full_scale_gain)
    return np.asarray(np.clip(np.rint(scaled), -FULL_SCALE, FULL_SCALE).astype(np.int16))


def dequantise(iq: NDArray[np.int16], full_scale_gain: float) -> ComplexArray:
    """Integers with in-phase and quadrature along the last axis as complex drives."""
    pair = iq.astype(np.float64) * (full_scale_gain / FULL_SCALE)
    return np.asarray(pair[..., 0] + 1j * pair[..., 1])


def pack(table: Table) -> bytes:
    """The bytes of a table file.

    Raises
    ------
    InputError
        More actuators, regions or millimetres than the format holds.
    """
    check_fits(table)
    head = _header_values(table)
    stored = table.folding.stored(table.grid)
    codes = table.packing.codes(table.iq[stored])
    payload = table.packing.to_bytes(codes)
    decoded = table.folding.unfold(table.grid, table.packing.values(codes))
    if not np.array_equal(decoded, table.iq):
        raise InputError("table.iq", "drives", "drives that its packing and its mirrors can hold")
    head["total_bytes"] = HEADER_BYTES + len(payload) + CRC_BYTES
    header = HEADER_STRUCT.pack(*(head[field.name] for field in HEADER_FIELDS))
    body = header + payload
    return body + struct.pack("<I", zlib.crc32(body))


def check_fits(table: Table) -> None:
    """Raise `InputError` unless the format and the device can hold a table like this.

    Only sizes and limits are looked at, so it can be asked before any drive is solved.
    """
    head = _header_values(table)
    check_header(head, lambda field, value, expected: InputError(f"table.{field}", value, expected))
    if abs(head["full_scale_gain_milli"] / 1000.0 - table.full_scale_gain) > 1e-9:
        raise InputError("drive.max_gain", table.full_scale_gain, "whole thousandths, from 0.001")


def _header_values(table: Table) -> dict[str, Any]:
    grid, limits = table.grid, table.limits
    return {
        "magic": MAGIC,
        "version_major": VERSION_MAJOR,
        "version_minor": VERSION_MINOR,
        "header_bytes": HEADER_BYTES,
        "board_fingerprint": table.board_fingerprint,
        "board_name": table.board_name.encode("ascii"),
        "frequency_mhz": round(table.frequency_hz * 1000.0),
        "actuators": table.actuators,
        "mirrors": table.folding.flags,
        "in_phase_bits": table.packing.bits[0],
        "quadrature_bits": table.packing.bits[1],
        "columns": grid.columns,
        "rows": grid.rows,
        "width_um": grid.width_um,
        "length_um": grid.length_um,
        "full_scale_gain_milli": round(table.full_scale_gain * 1000.0),
        "in_phase_scale": table.packing.scales[0],
        "quadrature_scale": table.packing.scales[1],
        "mirror_x": table.folding.nibbles(0),
        "mirror_y": table.folding.nibbles(1),
        "ramp_us": limits.ramp_us,
        "touch_timeout_us": limits.touch_timeout_us,
        "max_on_us": limits.max_on_us,
    }


def unpack(data: bytes, *, file: str | None = None) -> Table:
    """The table in the bytes of a file.

    Raises
    ------
    InputError
        Truncated, wrong magic, version or CRC, or fields that contradict each other.
    """

    def refuse(field: str, value: object, expected: str) -> InputError:
        return InputError(field, value, expected, file=file)

    if len(data) < HEADER_BYTES + CRC_BYTES:
        raise refuse(
            "size", f"{len(data)} bytes", f"at least {HEADER_BYTES + CRC_BYTES}: truncated"
        )
    head = dict(
        zip((field.name for field in HEADER_FIELDS), HEADER_STRUCT.unpack_from(data), strict=True)
    )
    if head["magic"] != MAGIC:
        raise refuse("magic", head["magic"], f"{MAGIC!r}, a Chladni table")
    version = (head["version_major"], head["version_minor"])
    if version != (VERSION_MAJOR, VERSION_MINOR):
        raise refuse("version", f"{version[0]}.{version[1]}", f"{VERSION_MAJOR}.{VERSION_MINOR}")
    if head["header_bytes"] != HEADER_BYTES:
        raise refuse("header_bytes", head["header_bytes"], f"{HEADER_BYTES}")
    if head["total_bytes"] != len(data):
        raise refuse("total_bytes", head["total_bytes"], f"{len(data)}, the size of the file")
    stored = struct.unpack_from("<I", data, len(data) - CRC_BYTES)[0]
    computed = zlib.crc32(data[:-CRC_BYTES])
    if stored != computed:
        raise refuse("crc", f"{stored:#010x}", f"{computed:#010x}: the bytes are damaged")
    check_header(head, refuse)
    grid = RegionGrid(head["columns"], head["rows"], head["width_um"], head["length_um"])
    packing = Packing(
        (head["in_phase_bits"], head["quadrature_bits"]),
        (head["in_phase_scale"], head["quadrature_scale"]),
    )
    folding = _folding(head, refuse)
    cells = folding.stored(grid).size
    expected = HEADER_BYTES + packing.size(cells * head["actuators"]) + CRC_BYTES
    if expected != len(data):
        raise refuse("total_bytes", len(data), f"{expected} for {cells} stored regions")
    try:
        codes = packing.from_bytes(data[HEADER_BYTES:-CRC_BYTES], cells * head["actuators"])
    except ValueError as error:
        raise refuse("payload", "codes", str(error)) from None
    codes = codes.reshape(cells, head["actuators"], 2)
    return Table(
        board_name=head["board_name"].rstrip(b"\0").decode("ascii"),
        board_fingerprint=head["board_fingerprint"],
        frequency_hz=head["frequency_mhz"] / 1000.0,
        grid=grid,
        full_scale_gain=head["full_scale_gain_milli"] / 1000.0,
        limits=Limits(head["ramp_us"], head["touch_timeout_us"], head["max_on_us"]),
        iq=folding.unfold(grid, packing.values(codes)),
        packing=packing,
        folding=folding,
    )


def _folding(head: dict[str, Any], refuse: Callable[[str, object, str], InputError]) -> Folding:
    """The mirrors of a header, each an order of the actuators that undoes itself."""
    count = head["actuators"]
    orders: list[tuple[int, ...] | None] = []
    for bit, name in enumerate(("mirror_x", "mirror_y")):
        nibbles = tuple((head[name] >> (4 * k)) & 15 for k in range(count))
        is_stored = bool(head["mirrors"] >> bit & 1)
        if is_stored and (
            sorted(nibbles) != list(range(count))
            or any(nibbles[nibbles[k]] != k for k in range(count))
            or head[name] >> (4 * count)
        ):
            raise refuse(name, hex(head[name]), "an order of the actuators that undoes itself")
        if not is_stored and head[name]:
            raise refuse(name, hex(head[name]), "0 without that mirror")
        orders.append(nibbles if is_stored else None)
    return Folding(orders[0], orders[1])


def check_header(head: dict[str, Any], refuse: Callable[[str, object, str], InputError]) -> None:
    """Ranges that a right CRC does not vouch for."""
    for name, low, high in (
        ("actuators", 1, MAX_ACTUATORS),
        ("mirrors", 0, 3),
        ("in_phase_bits", MIN_BITS, MAX_BITS),
        ("quadrature_bits", MIN_BITS, MAX_BITS),
        ("in_phase_scale", 1, FULL_SCALE),
        ("quadrature_scale", 1, FULL_SCALE),
        ("columns", 1, MAX_CELLS_PER_SIDE),
        ("rows", 1, MAX_CELLS_PER_SIDE),
        ("width_um", 1, MAX_SPAN_UM),
        ("length_um", 1, MAX_SPAN_UM),
        ("frequency_mhz", MIN_FREQUENCY_MHZ, MAX_FREQUENCY_MHZ),
        ("full_scale_gain_milli", 1, 0xFFFFFFFF),
        ("ramp_us", MIN_RAMP_US, MAX_RAMP_US),
        ("touch_timeout_us", MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US),
        ("max_on_us", MIN_ON_US, MAX_ON_US),
    ):
        if not low <= head[name] <= high:
            raise refuse(name, head[name], f"{low} to {high}")
    if head["columns"] * head["rows"] > MAX_REGIONS:
        raise refuse("regions", head["columns"] * head["rows"], f"at most {MAX_REGIONS}")
    columns, rows = (
        (head[name] + 1) // 2 if head["mirrors"] >> bit & 1 else head[name]
        for bit, name in enumerate(("columns", "rows"))
    )
    gains = columns * rows * head["actuators"]
    if gains > MAX_GAINS:
        expected = f"at most {MAX_GAINS} gains, what the device's RAM holds"
        raise refuse("regions", f"{gains // head['actuators']} × {head['actuators']}", expected)
    name = head["board_name"]
    if not (name.isascii() and name.rstrip(b"\0").decode("ascii", "replace").isprintable()):
        raise refuse("board_name", name, "printable ASCII letters")
    if len(name) == BOARD_NAME_BYTES and not name.endswith(b"\0"):
        raise refuse("board_name", name, "an ending zero")


def read_table(path: str | Path) -> Table:
    """Read a table file; `InputError` names file and field."""
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise InputError("TABLE", "no regular file", "a table file", file=str(path))
        with Path(path).open("rb") as file:
            data = file.read(LARGEST_FILE)
    except OSError as error:
        raise InputError("TABLE", error.strerror, "a readable file", file=str(path)) from None
    return unpack(data, file=str(path))
