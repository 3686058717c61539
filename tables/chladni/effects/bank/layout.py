"""Bytes of an effect bank: the one declaration from which reader, writer and C++ header come.

`docs/effect-format.md` describes the same bytes in words. Everything is little-endian. A file is a
header, the areas, the effects, what these point to, and the CRC-32 of all before.
"""

from __future__ import annotations

import struct

from chladni.tables.layout import Field

MAGIC = b"CHLE"
VERSION_MAJOR, VERSION_MINOR = 1, 1
SIGNAL_HZ = 80e6 / 2**15
"""Samples of a finger's signal, per second of the device's clock: a bank counts time in them."""
MAX_EFFECTS, MAX_AREAS = 64, 64
MAX_PARTS, MAX_TONES = 255, 16
"""Of an effect. A device keeps the phase of each tone."""
MAX_CORNERS = 32
MAX_SAMPLES = 0xFFFF
"""That an effect lasts: 26.8 s."""
NAME_BYTES = 16
NO_EFFECT = 0xFF
FULL_SCALE = 32767
FREQUENCY_STEPS = 2**16 / SIGNAL_HZ
"""Per hertz: a frequency is what it turns in a sample, 1/65536 of a turn (0.04 Hz)."""
CLIP_STEPS = 4096
"""A clip's own samples per sample of the signal, in these steps."""
MAX_CLIP_STEP = 4 * CLIP_STEPS
MAX_PLACE_UM = 500_000
MAX_EVERY_UM = 500_000
MAX_HYSTERESIS_UM = 20_000
UM_STEPS = 100
"""Of `most_10nm` in a micrometre."""
CRC_BYTES = 4
LARGEST_FILE = 15 * 4096
"""A device's slot of 64 KiB, less the sector of its trailer."""

SHAPES = ("everywhere", "circle", "polygon")
ALONG = ("path", "x", "y")
PARTS = ("tone", "click", "noise", "clip")
OCCASIONS = ("press", "enter", "hold", "release")

HEADER_FIELDS = (
    Field("magic", "char4", 'The letters "CHLE".'),
    Field("version_major", "u8", "1. A reader takes no other."),
    Field("version_minor", "u8", "1. A device of 1.0 refuses areas that say micrometres."),
    Field("effects", "u8", f"0 to {MAX_EFFECTS}."),
    Field("areas", "u8", f"0 to {MAX_AREAS}."),
    Field("total_bytes", "u32", "Whole file, its CRC included."),
    Field("hysteresis_um", "u16", "A finger leaves its area so far outside of it."),
    Field("reserved", "u16", "0."),
    Field("name", "char16", "ASCII, filled up with zeros, at least one of them."),
)
AREA_FIELDS = (
    Field("name", "char16", "As the bank's."),
    Field("shape", "u8", "0 everywhere, 1 circle, 2 polygon."),
    Field("corners", "u8", "Points: 2 of a circle, 3 to 32 of a polygon, none of everywhere."),
    Field("along", "u8", "What a movement is measured along: 0 its path, 1 x, 2 y."),
    Field("reserved", "u8", "0."),
    Field("press", "u8", "Effect when a finger comes down here; 255 none."),
    Field("enter", "u8", "Effect when it comes from elsewhere; 255 none."),
    Field("hold", "u8", "Effect while it stays; 255 none."),
    Field("release", "u8", "Effect when it leaves the board from here; 255 none."),
    Field("every_um", "u32", "`hold` plays once after so much movement; 0: again and again."),
    Field("level_q15", "u16", "Of all its effects, 32767 as they are."),
    Field(
        "most_10nm",
        "u16",
        "What an amplitude of 1 may move a finger by, 0.01 µm, since 1.1; "
        "0: whatever the place allows.",
    ),
    Field("offset", "u32", "Of its points in the file."),
)
EFFECT_FIELDS = (
    Field("name", "char16", "As the bank's."),
    Field("offset", "u32", "Of its first part in the file; the others follow."),
    Field("parts", "u8", "1 to 255."),
    Field("reserved", "u8", "0."),
    Field("lasts", "u16", "Samples until its last part is over."),
    Field("loop_from", "u16", "While it is held it goes from `loop_to` …"),
    Field("loop_to", "u16", "… back to here, which is later by a sample or more."),
)
PART_FIELDS = (
    Field("kind", "u8", "0 tone, 1 click, 2 noise, 3 clip."),
    Field("reserved", "u8", "0."),
    Field("begins", "u16", "Samples from the effect's begin."),
    Field("lasts", "u16", "Samples, 1 or more."),
    Field("amplitudes", "u16", "Breakpoints of a tone or noise; a clip's samples; 0 of a click."),
    Field("frequencies", "u16", "Breakpoints of a tone; else 0."),
    Field("level_q15", "u16", "A click's amplitude, what a clip's 127 stands for; else 0."),
    Field("rate", "u16", "A click's frequency; a clip's samples per sample, 1/4096; else 0."),
)
POINT_FIELDS = (
    Field("at", "u16", "Samples from the part's begin, none before the one before it."),
    Field("value", "u16", "Amplitude, 32767 for 1, or frequency, 65536 for the signal's rate."),
)
CORNER_FIELDS = (
    Field("x_um", "i32", "From the board's centre; of a circle's second point its radius."),
    Field("y_um", "i32", "The same; of a circle's second point 0."),
)


def _struct(fields: tuple[Field, ...]) -> struct.Struct:
    return struct.Struct("<" + "".join(field.code for field in fields))


HEADER, AREA, EFFECT = _struct(HEADER_FIELDS), _struct(AREA_FIELDS), _struct(EFFECT_FIELDS)
PART, POINT, CORNER = _struct(PART_FIELDS), _struct(POINT_FIELDS), _struct(CORNER_FIELDS)
SMALLEST_FILE = HEADER.size + CRC_BYTES
MAX_FREQUENCY = round(1000 * FREQUENCY_STEPS)
