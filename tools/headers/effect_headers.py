"""C++ headers of effects: the bank's bytes and the signals' low-pass."""

from __future__ import annotations

from headers import cpp_text

from chladni.effects import low_pass
from chladni.effects.bank import layout as bank


def bank_header() -> str:
    """`bank_format.hpp`: where the fields of an effect bank stand, and its limits."""
    magic = int.from_bytes(bank.MAGIC, "little")
    values: dict[str, int | str] = {
        "kMagic": f"0x{magic:08X}U",
        "kVersionMajor": bank.VERSION_MAJOR,
        "kVersionMinor": bank.VERSION_MINOR,
        "kHeaderBytes": bank.HEADER.size,
        "kAreaBytes": bank.AREA.size,
        "kEffectBytes": bank.EFFECT.size,
        "kPartBytes": bank.PART.size,
        "kPointBytes": bank.POINT.size,
        "kCornerBytes": bank.CORNER.size,
        "kCrcBytes": bank.CRC_BYTES,
        "kNameBytes": bank.NAME_BYTES,
        "kSmallestFile": bank.SMALLEST_FILE,
        "kLargestFile": bank.LARGEST_FILE,
        "kMaxEffects": bank.MAX_EFFECTS,
        "kMaxAreas": bank.MAX_AREAS,
        "kMaxTones": bank.MAX_TONES,
        "kMaxCorners": bank.MAX_CORNERS,
        "kNoEffect": bank.NO_EFFECT,
        "kFullScale": bank.FULL_SCALE,
        "kMaxFrequency": bank.MAX_FREQUENCY,
        "kClipSteps": bank.CLIP_STEPS,
        "kMaxClipStep": bank.MAX_CLIP_STEP,
        "kMaxPlaceUm": bank.MAX_PLACE_UM,
        "kMaxEveryUm": bank.MAX_EVERY_UM,
        "kMaxHysteresisUm": bank.MAX_HYSTERESIS_UM,
        **{f"kShape{name.capitalize()}": k for k, name in enumerate(bank.SHAPES)},
        **{f"kAlong{name.capitalize()}": k for k, name in enumerate(bank.ALONG)},
        **{f"kPart{name.capitalize()}": k for k, name in enumerate(bank.PARTS)},
    }
    fields = {
        "At": bank.HEADER_FIELDS,
        "AreaAt": bank.AREA_FIELDS,
        "EffectAt": bank.EFFECT_FIELDS,
        "PartAt": bank.PART_FIELDS,
        "PointAt": bank.POINT_FIELDS,
        "CornerAt": bank.CORNER_FIELDS,
    }
    body = cpp_text.constants(values)
    for prefix, row in fields.items():
        body += ["", *cpp_text.field_offsets(f"k{prefix}", row)]
    about = "Bytes of an effect bank (docs/effect-format.md), little-endian."
    return cpp_text.header(about, "chladni::bank_format", body)


def low_pass_header() -> str:
    """`low_pass_sections.hpp`: the signals' low-pass, b0, b1, b2, a1, a2 of each section."""
    rows = [
        "    {{" + ", ".join(f"{value:.8e}F" for value in (*row[:3], *row[4:])) + "}},"
        for row in low_pass.sections(bank.SIGNAL_HZ)
    ]
    return cpp_text.header(
        "The low-pass of signals, in second-order sections: b0, b1, b2, a1, a2, with a0 = 1.",
        "chladni",
        [
            f"constexpr uint32_t kLowPassSections = {len(rows)}U;",
            f"constexpr uint32_t kLowPassTail = {round(low_pass.TAIL_S * bank.SIGNAL_HZ)}U;"
            "  // samples until it has died away",
            "constexpr std::array<std::array<float, 5>, kLowPassSections> kLowPass = {{",
            *rows,
            "}};",
        ],
        includes=("array", "cstdint"),
    )
