"""Bytes of a drive table: the one declaration from which reader, writer and C++ header come.

`docs/table-format.md` describes the same bytes in words; `tools/generate_headers.py` writes the
C++ header. Everything is little-endian, and every header field lies on a multiple of its size.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.sim.errors import InputError
from chladni.tables.mirror_symmetry import stored_cells

MAGIC = b"CHLD"
VERSION_MAJOR, VERSION_MINOR = 2, 1
DRIVES_MINOR = 0
"""The minor version of tables without responses, which devices of 2.0 read too."""
BITS = (8, 12, 16)
"""Widths of an integer; a gain is two of them, so 2, 3 or 4 bytes."""
FULL_SCALE = 32767
"""The integer of 16 bits that stands for the largest gain. A narrower one is its upper bits."""
MAX_ACTUATORS = 16
"""LEDC channels of an ESP32: eight high-speed ones and eight low-speed ones."""
MAX_SECTIONS = 16
MAX_LABELS = 255
MAX_SPAN_UM = 500_000
"""So that (2 · place + span) and cells · span fit 32 bits on the device."""
MAX_CELLS_PER_SIDE = 2048
MIN_FREQUENCY_MILLIHERTZ, MAX_FREQUENCY_MILLIHERTZ = 1_000, 1_000_000
"""1 to 1000 Hz: beyond, a wave has too few samples for the synthesis."""
MIN_RAMP_US, MAX_RAMP_US = 500, 1_000_000
MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US = 30_000, 5_000_000
"""Three reports of a panel at the least, or a held finger would flicker."""
MIN_ON_US, MAX_ON_US = 100_000, 60_000_000
CRC_BYTES = 4
BOARD_NAME_BYTES = 16
LARGEST_FILE = 63 * 4096
"""A device's slot of 256 KiB, less the sector of its trailer (host/protocol/slot_store.py)."""

ByteArray = NDArray[np.uint8]
IntArray = NDArray[np.int64]
Refuse = Callable[[str, object, str], InputError]


_CODES = {"u8": "B", "u16": "H", "u32": "I", "i16": "h", "i32": "i", "u64": "Q", "f32": "f"}


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
        return count + _CODES[base]

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
    Field("version_major", "u8", "2. A reader takes no other."),
    Field("version_minor", "u8", "0, or 1 with responses."),
    Field("sections", "u8", "Sections, 1 to 16: one per frequency or objective."),
    Field("actuators", "u8", "Channels of every drive, 1 to 16."),
    Field("total_bytes", "u32", "Whole file, its CRC included."),
    Field("bits", "u8", "Of each integer: 8, 12 or 16."),
    Field("mirrors", "u8", "Bit 0: only the half at small x is stored; bit 1: at small y."),
    Field("reserved", "u16", "0."),
    Field("board_fingerprint", "u64", "What the build read of the board, below."),
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
    Field("frequency_millihertz", "u32", "Drive frequency in millihertz."),
    Field("full_scale", "u32", "Gain at full scale, in thousandths; of responses in pm/N."),
    Field(
        "objective",
        "u8",
        "0 unknown, 1 ssim, 2 contrast, 3 kept free, 4 balanced, 5 focus, 6 responses.",
    ),
    Field("labels", "u8", "Labels of the section, 1 to 255; 0 of responses."),
    Field("reserved", "u16", "0."),
)
RESPONSES_FIELDS = (
    Field("own_full_scale", "u32", "pm/N at full scale of a fingertip's own compliance."),
    Field(
        "full_force", "u32", "Peak that one coil can give in a touch without end, µN; 0 unknown."
    ),
    Field("threshold", "u32", "Of a resting fingertip: peak in time of its RMS, pm; 0 unknown."),
    Field("stiffness", "f32", "Of a pressing fingertip, force over displacement, N/m: real part."),
    Field("stiffness_imaginary", "f32", "The same, imaginary part."),
)
"""Between a section's header and the coupling."""
COUPLING_BYTES = 8
"""Of one number of the coupling matrix: two of float32."""


def _struct(fields: tuple[Field, ...]) -> struct.Struct:
    return struct.Struct("<" + "".join(field.code for field in fields))


HEADER_STRUCT, SECTION_STRUCT = _struct(HEADER_FIELDS), _struct(SECTION_FIELDS)
RESPONSES_STRUCT = _struct(RESPONSES_FIELDS)
HEADER_BYTES, SECTION_BYTES = HEADER_STRUCT.size, SECTION_STRUCT.size
SMALLEST_FILE = HEADER_BYTES + SECTION_BYTES + CRC_BYTES
RESPONSES = "responses"
OBJECTIVE_NAMES = ("unknown", "ssim", "contrast", "peak", "balanced", "focus", RESPONSES)
"""By number. `peak` was of an objective that there is no longer; its number stays taken."""


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
    ("reserved", 0, 0),
    ("columns", 1, MAX_CELLS_PER_SIDE),
    ("rows", 1, MAX_CELLS_PER_SIDE),
    ("width_um", 1, MAX_SPAN_UM),
    ("length_um", 1, MAX_SPAN_UM),
    ("ramp_us", MIN_RAMP_US, MAX_RAMP_US),
    ("touch_timeout_us", MIN_TOUCH_TIMEOUT_US, MAX_TOUCH_TIMEOUT_US),
    ("max_on_us", MIN_ON_US, MAX_ON_US),
)
SECTION_RANGES = (
    ("frequency_millihertz", MIN_FREQUENCY_MILLIHERTZ, MAX_FREQUENCY_MILLIHERTZ),
    ("full_scale", 1, 0xFFFFFFFF),
    ("reserved", 0, 0),
)
DRIVES_RANGES = (("objective", 0, OBJECTIVE_NAMES.index(RESPONSES) - 1), ("labels", 1, MAX_LABELS))
RESPONSES_RANGES = (("labels", 0, 0),)


def gain_bytes(bits: int) -> int:
    """Bytes of a gain: two integers of so many bits."""
    return bits // 4


def record_bytes(actuators: int, bits: int) -> int:
    """Bytes of a stored region: its label, and a gain per actuator."""
    return 1 + actuators * gain_bytes(bits)


def responses_record_bytes(actuators: int, bits: int) -> int:
    """Bytes of a stored region's responses: one per actuator, and a fingertip's own compliance."""
    return (actuators + 1) * gain_bytes(bits)


def responses_head_bytes(actuators: int) -> int:
    """Bytes between a section's header and its responses."""
    return RESPONSES_STRUCT.size + COUPLING_BYTES * (actuators * (actuators + 1) // 2)


def stored_region_count(head: dict[str, Any]) -> int:
    """Records of every section, by a header's fields."""
    columns, rows = (
        stored_cells(head[name], bool(head["mirrors"] >> bit & 1))
        for bit, name in enumerate(("columns", "rows"))
    )
    return columns * rows


def check_header(head: dict[str, Any], refuse: Refuse) -> None:
    """Ranges that a right CRC does not vouch for."""
    _check_ranges(head, HEADER_RANGES, refuse)
    if head["bits"] not in BITS:
        raise refuse("bits", head["bits"], one_of_bits())
    name = head["board_name"]
    if not (name.isascii() and name.rstrip(b"\0").decode("ascii", "replace").isprintable()):
        raise refuse("board_name", name, "printable ASCII letters")
    if len(name) == BOARD_NAME_BYTES and not name.endswith(b"\0"):
        raise refuse("board_name", name, "an ending zero")


def is_responses(values: dict[str, Any]) -> bool:
    """Whether a section header's fields are of responses."""
    return bool(values["objective"] == OBJECTIVE_NAMES.index(RESPONSES))


def check_section(values: dict[str, Any], refuse: Refuse, *, may_be_responses: bool) -> None:
    """The same of a section header; tables of 2.0 have no responses."""
    _check_ranges(values, SECTION_RANGES, refuse)
    kind = RESPONSES_RANGES if may_be_responses and is_responses(values) else DRIVES_RANGES
    _check_ranges(values, kind, refuse)


def one_of_bits() -> str:
    """The widths there are, for an error."""
    return "one of " + ", ".join(map(str, BITS))


def _check_ranges(
    values: dict[str, Any], ranges: tuple[tuple[str, int, int], ...], refuse: Refuse
) -> None:
    for name, low, high in ranges:
        if not low <= values[name] <= high:
            expected = f"{low} to {high}" if low < high else f"{low}"
            raise refuse(name, values[name], expected)


def as_bytes(pairs: IntArray, bits: int) -> ByteArray:
    """Integers (regions, actuators, 2) in offset binary, shape (regions, bytes).

    Of 12 bits the upper eight of both come first, then both rests in one byte.
    """
    codes = pairs + (1 << (bits - 1))
    parts = [codes] if bits == 8 else [codes & 0xFF, codes >> 8]
    if bits == 12:
        rests = (codes & 15)[..., :1] | (codes & 15)[..., 1:] << 4
        parts = [np.concatenate((codes >> 4, rests), axis=-1)]
    whole = np.stack(parts, axis=-1)
    return np.asarray(whole.reshape(len(pairs), -1).astype(np.uint8))


def as_integers(data: ByteArray, actuators: int, bits: int) -> IntArray:
    """The way back."""
    parts = data.reshape(len(data), actuators, -1).astype(np.int64)
    if bits == 12:
        rests = parts[..., 2:]
        codes = parts[..., :2] << 4 | np.concatenate((rests & 15, rests >> 4), axis=-1)
    elif bits == 16:
        codes = parts[..., ::2] | parts[..., 1::2] << 8
    else:
        codes = parts
    return np.asarray(codes - (1 << (bits - 1)))


def is_loud(iq: NDArray[np.integer]) -> bool:
    """Whether a pair, of 16 bits, is beyond full scale."""
    return bool(np.any((iq.astype(np.int64) ** 2).sum(axis=-1) > FULL_SCALE**2))
