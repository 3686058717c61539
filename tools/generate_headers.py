"""Write the C++ headers that come from Python declarations.

    python tools/generate_headers.py          write them
    python tools/generate_headers.py --check  exit with 1 if a committed one differs

The table format is declared in `chladni.tables.layout`, the configuration in
`chladni.host.protocol.config`, the sine here, and the bootloader's pins in `boards/prototype.toml`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from headers import cpp_text
from headers.effect_headers import bank_header, bank_page, low_pass_header
from headers.gpio_header import bootloader_header, gpio_header
from headers.link_header import link_header, link_page, messages_header, network_header

from chladni.drives.problem import region_grid as regions
from chladni.host.protocol import codes as device_codes
from chladni.host.protocol import config as device_config
from chladni.host.protocol import slot_store as flash_layout
from chladni.tables import layout

GENERATED = Path(__file__).resolve().parents[1] / "firmware" / "esp32" / "core" / "generated"
SINE_QUARTER_POINTS = 256
"""Intervals in a quarter wave. Linear interpolation between them errs by (π/512)²/8 = 4.7e-6 of
full scale, under the half step of Q15 (1.5e-5)."""


TABLE_NOTES = {
    "kMagic": '"CHLD" read as a little-endian word',
    "kSectionBytes": "of a section header",
    "kResponsesHeadBytes": "before the coupling",
    "kFullScale": "stands for the largest gain",
    "kFractionBits": "of a place between two cells",
    "kSmallestFile": "one section of no regions",
    "kLargestFile": "what a slot holds",
    "kDrivesMinor": "of tables without responses",
    "kResponses": "the objective of responses; all below are of drives",
    "kMinFrequencyMillihertz": "millihertz",
}


def table_header() -> str:
    """`table_format.hpp`: where each field of the header stands, and the format's limits."""
    magic = int.from_bytes(layout.MAGIC, "little")
    values: dict[str, int | str] = {
        "kMagic": f"0x{magic:08X}U",
        "kVersionMajor": layout.VERSION_MAJOR,
        "kVersionMinor": layout.VERSION_MINOR,
        "kDrivesMinor": layout.DRIVES_MINOR,
        "kHeaderBytes": layout.HEADER_BYTES,
        "kSectionBytes": layout.SECTION_BYTES,
        "kResponsesHeadBytes": layout.RESPONSES_STRUCT.size,
        "kCouplingBytes": layout.COUPLING_BYTES,
        "kCrcBytes": layout.CRC_BYTES,
        "kBoardNameBytes": layout.BOARD_NAME_BYTES,
        "kSmallestFile": layout.SMALLEST_FILE,
        "kLargestFile": layout.LARGEST_FILE,
        "kFullScale": layout.FULL_SCALE,
        "kFractionBits": regions.FRACTION_BITS,
        "kMaxActuators": layout.MAX_ACTUATORS,
        "kMaxSections": layout.MAX_SECTIONS,
        "kMaxLabels": layout.MAX_LABELS,
        "kResponses": layout.OBJECTIVE_NAMES.index(layout.RESPONSES),
        "kMaxCellsPerSide": layout.MAX_CELLS_PER_SIDE,
        "kMaxSpanUm": layout.MAX_SPAN_UM,
        "kMinFrequencyMillihertz": layout.MIN_FREQUENCY_MILLIHERTZ,
        "kMaxFrequencyMillihertz": layout.MAX_FREQUENCY_MILLIHERTZ,
        "kMinRampUs": layout.MIN_RAMP_US,
        "kMaxRampUs": layout.MAX_RAMP_US,
        "kMinTouchTimeoutUs": layout.MIN_TOUCH_TIMEOUT_US,
        "kMaxTouchTimeoutUs": layout.MAX_TOUCH_TIMEOUT_US,
        "kMinOnUs": layout.MIN_ON_US,
        "kMaxOnUs": layout.MAX_ON_US,
    }
    return cpp_text.header(
        "Bytes of a drive table (docs/table-format.md), little-endian.",
        "chladni::table_format",
        [
            *cpp_text.constants(values, TABLE_NOTES),
            "",
            "// Byte offsets of the header's fields.",
            *cpp_text.field_offsets("kAt", layout.HEADER_FIELDS),
            "",
            "// Byte offsets of a section header's fields.",
            *cpp_text.field_offsets("kSectionAt", layout.SECTION_FIELDS),
            "",
            "// Byte offsets of what stands before responses, from the end of that header.",
            *cpp_text.field_offsets("kResponsesAt", layout.RESPONSES_FIELDS),
        ],
    )


def sine_header() -> str:
    """`sine_table.hpp`: a quarter wave in Q15, both ends included."""
    angle = np.arange(SINE_QUARTER_POINTS + 1) / SINE_QUARTER_POINTS * (np.pi / 2.0)
    values = np.rint(32767.0 * np.sin(angle)).astype(int)
    rows = [
        "    " + ", ".join(str(value) for value in values[k : k + 12]) + ","
        for k in range(0, values.size, 12)
    ]
    return cpp_text.header(
        f"sin(k·π/{2 * SINE_QUARTER_POINTS}) in Q15, k = 0 … {SINE_QUARTER_POINTS}.",
        "chladni",
        [
            f"constexpr uint32_t kSineQuarterPoints = {SINE_QUARTER_POINTS}U;",
            "constexpr std::array<int16_t, kSineQuarterPoints + 1> kSineQuarterQ15 = {",
            *rows,
            "};",
        ],
        includes=("array", "cstdint"),
    )


def config_numbers() -> dict[str, int | str]:
    """What tells a configuration's record from any other."""
    magic = int.from_bytes(device_config.MAGIC, "little")
    return {
        "kMagic": f"0x{magic:08X}U",
        "kVersionMajor": device_config.VERSION_MAJOR,
        "kVersionMinor": device_config.VERSION_MINOR,
        "kRecordBytes": device_config.RECORD_BYTES,
        "kLeastRecordBytes": device_config.LEAST_RECORD_BYTES,
        "kCrcBytes": device_config.CRC_BYTES,
    }


def config_header() -> str:
    """`config_format.hpp`: the configuration as a struct, with its defaults, and its bytes."""
    places = layout.offsets(device_config.FIELDS)
    members, takes, puts = [], [], []
    for setting in device_config.SETTINGS:
        field, default = setting.field, setting.default
        values = (default,) if isinstance(default, int) else default
        text = ", ".join(map(str, values))
        text = text if field.count == 1 else "{" + text + "}"
        members.append(f"  {cpp_text.cpp_type(field)} {field.name} = {text};  // {field.doc}")
        at = f"record + {places[field.name]}"
        takes.append(f"         take({at}, {setting.low}, {setting.high}, config.{field.name})")
        puts.append(f"  put({at}, config.{field.name});")
    return cpp_text.header(
        "The configuration of a device, and where its bytes lie in flash (little-endian).",
        "chladni",
        [
            "struct Config {",
            *members,
            "};",
            "",
            "namespace config_format {",
            "",
            *cpp_text.constants(config_numbers()),
            *cpp_text.field_offsets("kAt", device_config.HEADER_FIELDS),
            "",
            "// Every field through `take`, which says whether it lies between two bounds.",
            "template <typename Take>",
            "bool take_fields(const uint8_t* record, Config& config, Take take) {",
            "  return " + " &&\n".join(takes).lstrip() + ";",
            "}",
            "",
            *network_rules(),
            *comparison(),
            "template <typename Put>",
            "void put_fields(uint8_t* record, const Config& config, Put put) {",
            *puts,
            "}",
            "",
            "}  // namespace config_format",
        ],
        includes=("array", "cstddef", "cstdint"),
    )


def network_rules() -> list[str]:
    """What a host on a network may set, and what of it a configuration by wire bounds."""
    ceilings = device_config.CEILINGS.items()
    return [
        "// What a host on a network may set as it likes.",
        "inline void copy_harmless(const Config& from, Config& to) {",
        *(f"  to.{name} = from.{name};" for name in device_config.HARMLESS),
        "}",
        "",
        "// What it may set up to what was last written by wire.",
        "inline void copy_up_to_ceilings(const Config& from, Config& to) {",
        *(f"  if (from.{name} <= to.{most}) to.{name} = from.{name};" for name, most in ceilings),
        "}",
        "",
        "// The ceilings of a configuration that came by wire: what it says itself.",
        "inline void take_ceilings(Config& config) {",
        *(f"  config.{most} = config.{name};" for name, most in ceilings),
        "}",
        "",
    ]


def comparison() -> list[str]:
    """Whether two configurations agree in every field."""
    names = [setting.field.name for setting in device_config.SETTINGS]
    sames = [f"         is_same(one.{name}, other.{name})" for name in names]
    return [
        "template <typename T>",
        "bool is_same(const T& one, const T& other) {",
        "  return one == other;",
        "}",
        "",
        "template <typename T, size_t kCount>",
        "bool is_same(const std::array<T, kCount>& one, const std::array<T, kCount>& other) {",
        "  for (size_t k = 0; k < kCount; ++k) {",
        "    if (one[k] != other[k]) return false;",
        "  }",
        "  return true;",
        "}",
        "",
        "inline bool are_same(const Config& one, const Config& other) {",
        "  return " + " &&\n".join(sames).lstrip() + ";",
        "}",
        "",
    ]


def store_header() -> str:
    """`store_format.hpp`: slots and trailers of tables and effect banks."""
    values: dict[str, int | str] = {
        "kSlots": flash_layout.SLOTS,
        "kTablePartitionBytes": flash_layout.PARTITION_BYTES,
        "kTableSlotBytes": flash_layout.SLOT_BYTES,
        "kBankPartitionBytes": flash_layout.BANK_PARTITION_BYTES,
        "kBankSlotBytes": flash_layout.BANK_SLOT_BYTES,
        "kEntryBytes": flash_layout.ENTRY_BYTES,
    }
    return cpp_text.header(
        "Slots for tables and effect banks, each with a trailer that says when it counted "
        "(docs/flash.md).",
        "chladni::store_format",
        [
            *cpp_text.constants(values),
            *cpp_text.field_offsets("kAt", flash_layout.ENTRY_FIELDS, with_kinds=False),
        ],
    )


def codes_header() -> str:
    """`device_codes.hpp`: enumerations that host and device share, and their words."""
    body: list[str] = []
    for codes in device_codes.ALL_CODES:
        body += [
            *([""] if body else []),
            f"// {codes.about}",
            f"enum class {codes.name} : uint8_t {{",
            *(
                f"  {code.name}," + (f"  // {code.note}" if code.note else "")
                for code in codes.members
            ),
            "};",
            *(
                [f"constexpr uint32_t k{codes.name}s = {len(codes.members)}U;"]
                if codes.is_counted
                else []
            ),
            "",
            f"constexpr const char* to_text({codes.name} value) {{",
            "  switch (value) {",
            *(
                f'    case {codes.name}::{code.name}: return "{code.text}";'
                for code in codes.members
            ),
            "  }",
            '  return "unknown";',
            "}",
        ]
    about = "What a device says in numbers, and the words for them."
    return cpp_text.header(about, "chladni", body)


HEADERS: dict[str, Callable[[], str]] = {
    "table_format.hpp": table_header,
    "bank_format.hpp": bank_header,
    "low_pass_sections.hpp": low_pass_header,
    "config_format.hpp": config_header,
    "store_format.hpp": store_header,
    "link_format.hpp": link_header,
    "link_messages.hpp": messages_header,
    "device_codes.hpp": codes_header,
    "network_format.hpp": network_header,
    "../../../../docs/link-protocol.md": link_page,
    "../../../../docs/effect-format.md": bank_page,
    "sine_table.hpp": sine_header,
    "gpio.hpp": gpio_header,
    "../../../../bootloader_components/gates/gates.h": bootloader_header,
}


def main() -> int:
    """Write or check every header."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    check = parser.parse_args().check
    stale = []
    for name, make in HEADERS.items():
        path, text = GENERATED / name, make()
        if check:
            if not path.is_file() or path.read_text(encoding="utf-8") != text:
                stale.append(name)
        else:
            path.write_text(text, encoding="utf-8")
    if stale:
        print(f"out of date: {', '.join(stale)}; run tools/generate_headers.py", file=sys.stderr)
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
