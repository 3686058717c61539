"""Headers of a drive table: the one declaration from which reader, writer and C++ header come.

`docs/table-format.md` describes the same bytes in words; `tools/generate_headers.py` writes the
C++ header. Everything is little-endian, and every field lies on a multiple of its size.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from chladni.sim.errors import InputError
from chladni.tables.coding import MAX_SHIFT
from chladni.tables.folding import stored_cells
from chladni.tables.objectives import OBJECTIVES

Refuse = Callable[[str, object, str], InputError]

MAGIC = b"CHLD"
VERSION_MAJOR, VERSION_MINOR = 1, 0
MAX_ACTUATORS = 16
"""LEDC channels of an ESP32; the firmware drives the eight high-speed ones."""
MAX_SECTIONS = 16
MAX_LABELS = 255
MAX_REGIONS = 40_960
MAX_NODES = 10_240
MAX_SPAN_UM = 500_000
"""So that (2 · place + span) and cells · span fit 32 bits on the device."""
MAX_CELLS_PER_SIDE = 2048
MIN_FREQUENCY_MHZ, MAX_FREQUENCY_MHZ = 1_000, 1_000_000
"""1 to 1000 Hz: beyond, a wave has too few samples for the synthesis."""
MIN_RAMP_US, MAX_RAMP_US = 500, 1_000_000
MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US = 30_000, 5_000_000
"""Three reports of a panel at the least, or a held finger would flicker."""
MIN_ON_US, MAX_ON_US = 100_000, 60_000_000
MAX_GAINS = 16_384
"""Gain pairs in 64 KiB of the device's RAM: a quarter of a board at 1 mm, five channels."""
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
        if self.kind.startswith("char"):
            return self.kind.removeprefix("char") + "s"
        base, _, count = self.kind.partition("x")
        return count + {"u8": "B", "u16": "H", "u32": "I", "i32": "i", "u64": "Q"}[base]

    @property
    def count(self) -> int:
        """Values in it: 1, unless it is an array as in "u16x16"."""
        return int(self.kind.partition("x")[2] or 1)

    @property
    def size(self) -> int:
        """Bytes."""
        return struct.calcsize("<" + self.code)


HEADER_FIELDS = (
    Field("magic", "char4", 'The letters "CHLD".'),
    Field("version_major", "u8", "1. A reader refuses another."),
    Field("version_minor", "u8", "0. A reader takes any: 1.x may lengthen headers, no more."),
    Field("header_bytes", "u16", "80, or more in 1.x: where the section headers begin."),
    Field("total_bytes", "u32", "Whole file, its CRC included."),
    Field("sections", "u8", "Sections, 1 to 16: one per frequency or objective."),
    Field("section_bytes", "u8", "20, or more in 1.x: size of a section header."),
    Field("actuators", "u8", "Channels of every drive, 1 to 16."),
    Field("mirrors", "u8", "Bit 0: only the half at small x is stored; bit 1: at small y."),
    Field("board_fingerprint", "u64", "64 bits of the SHA-256 of the board's physical numbers."),
    Field("board_name", "char16", "ASCII, filled up with zeros, at least one of them."),
    Field("columns", "u16", "Cells along x."),
    Field("rows", "u16", "Cells along y."),
    Field("width_um", "u32", "Board along x, micrometres."),
    Field("length_um", "u32", "Board along y, micrometres."),
    Field("ramp_us", "u32", "A drive fades in, out and over in this time."),
    Field("touch_timeout_us", "u32", "Silence from the panel that counts as lift-up."),
    Field("max_on_us", "u32", "A touch plays no longer than this."),
    Field("mirror_x", "u64", "Nibble k: the actuator that is k's image in x → −x; else 0."),
    Field("mirror_y", "u64", "The same for y → −y."),
)
SECTION_FIELDS = (
    Field("offset", "u32", "Where the section's stream begins, from the start of the file."),
    Field("bytes", "u32", "Size of the stream."),
    Field("frequency_mhz", "u32", "Drive frequency in millihertz."),
    Field("full_scale_gain_milli", "u32", "Gain the integer 32767 stands for, in thousandths."),
    Field("objective", "u8", "0 unknown, 1 ssim, 2 contrast, 3 peak, 4 balanced."),
    Field("labels", "u8", "Labels in the map, 1 to 255."),
    Field("start_shift", "u8", "Shift before the first drive, 0 to 14."),
    Field("reserved", "u8", "0; a reader of 1.0 does not look at it."),
)


def _struct(fields: tuple[Field, ...]) -> struct.Struct:
    return struct.Struct("<" + "".join(field.code for field in fields))


HEADER_STRUCT, SECTION_STRUCT = _struct(HEADER_FIELDS), _struct(SECTION_FIELDS)
HEADER_BYTES, SECTION_BYTES = HEADER_STRUCT.size, SECTION_STRUCT.size
OBJECTIVE_NAMES = ("unknown", *OBJECTIVES)
CROSSING_BITS = 2


def offsets(fields: tuple[Field, ...]) -> dict[str, int]:
    """Byte offset of every field of a header."""
    places, position = {}, 0
    for field in fields:
        places[field.name] = position
        position += field.size
    return places


HEADER_RANGES = (
    ("sections", 1, MAX_SECTIONS),
    ("actuators", 1, MAX_ACTUATORS),
    ("mirrors", 0, 3),
    ("columns", 1, MAX_CELLS_PER_SIDE),
    ("rows", 1, MAX_CELLS_PER_SIDE),
    ("width_um", 1, MAX_SPAN_UM),
    ("length_um", 1, MAX_SPAN_UM),
    ("ramp_us", MIN_RAMP_US, MAX_RAMP_US),
    ("touch_timeout_us", MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US),
    ("max_on_us", MIN_ON_US, MAX_ON_US),
)
SECTION_RANGES = (
    ("frequency_mhz", MIN_FREQUENCY_MHZ, MAX_FREQUENCY_MHZ),
    ("full_scale_gain_milli", 1, 0xFFFFFFFF),
    ("objective", 0, len(OBJECTIVE_NAMES) - 1),
    ("labels", 1, MAX_LABELS),
    ("start_shift", 0, MAX_SHIFT),
)


def check_header(head: dict[str, Any], refuse: Refuse) -> None:
    """Ranges that a right CRC does not vouch for."""
    _check_ranges(head, HEADER_RANGES, refuse)
    if head["columns"] * head["rows"] > MAX_REGIONS:
        raise refuse("regions", head["columns"] * head["rows"], f"at most {MAX_REGIONS}")
    # In memory stand a column and a row more than are stored.
    columns, rows = (
        stored_cells(head[name], bool(head["mirrors"] >> bit & 1)) + 1
        for bit, name in enumerate(("columns", "rows"))
    )
    most = min(MAX_NODES, MAX_GAINS // head["actuators"])
    if columns * rows > most:
        expected = f"at most {most}, what the device's RAM holds: a larger regions.pitch_mm"
        raise refuse("stored regions", columns * rows, expected)
    name = head["board_name"]
    if not (name.isascii() and name.rstrip(b"\0").decode("ascii", "replace").isprintable()):
        raise refuse("board_name", name, "printable ASCII letters")
    if len(name) == BOARD_NAME_BYTES and not name.endswith(b"\0"):
        raise refuse("board_name", name, "an ending zero")


def check_section(values: dict[str, Any], refuse: Refuse) -> None:
    """The same of a section header."""
    _check_ranges(values, SECTION_RANGES, refuse)


def _check_ranges(
    values: dict[str, Any], ranges: tuple[tuple[str, int, int], ...], refuse: Refuse
) -> None:
    for name, low, high in ranges:
        if not low <= values[name] <= high:
            raise refuse(name, values[name], f"{low} to {high}")
