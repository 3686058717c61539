"""The headers of pins: what each chip has, and the gates that the bootloader holds low."""

from __future__ import annotations

from collections.abc import Sequence

from headers import cpp_text

from chladni.sim.board import gpio
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.board.file import load_board

BOOTLOADER_BOARD = "prototype"
"""What the bootloader knows of a device: the board whose gates are low before it is configured."""


def gpio_header() -> str:
    """`gpio.hpp`: what each chip's pins can be, as masks of 64 bits."""

    def mask(pins: Sequence[int]) -> str:
        return f"0x{sum(1 << pin for pin in pins):010X}ULL"

    def row(name: str, own: gpio.Chip) -> str:
        masks = ", ".join(
            mask(pins)
            for pins in (
                own.gates,
                own.signs,
                own.bus,
                own.outputs,
                own.inputs,
                own.converters,
            )
        )
        return f"    {{{own.channels}U, {masks}}},  // {name}"

    pins = 1 + max(max(chip.inputs) for chip in gpio.CHIPS.values())
    names = ", ".join(f"k{name.capitalize()}" for name in gpio.CHIPS)
    return cpp_text.header(
        "What each chip has for a board (chladni.sim.board.gpio).",
        "chladni::gpio",
        [
            f"enum class Chip : uint8_t {{ {names} }};",
            "",
            "// PWM channels, and a bit per GPIO.",
            "struct Abilities {",
            "  uint32_t channels;",
            "  uint64_t gates, signs, bus, outputs, inputs, converters;",
            "};",
            "// By chip.",
            f"constexpr std::array<Abilities, {len(gpio.CHIPS)}> kAbilities{{{{",
            *(row(name, own) for name, own in gpio.CHIPS.items()),
            "}};",
            f"constexpr uint32_t kMostBridges = {gpio.MOST_BRIDGES}U;  // of either",
            f"constexpr uint32_t kPins = {pins}U;  // of the chip that has most",
            f"constexpr uint32_t kNotWired = {NOT_WIRED}U;",
        ],
        includes=("array", "cstdint"),
    )


def bootloader_header() -> str:
    """`gates.h` of the bootloader: the gates that it holds low, in C."""
    board = load_board(BOOTLOADER_BOARD)
    pins = board.electronics.pwm_pins
    bits = " | ".join(f"BIT({pin})" for pin in pins)
    return "\n".join(
        [
            cpp_text.BANNER,
            f"// The gates of boards/{BOOTLOADER_BOARD}.toml.",
            "#pragma once",
            "",
            '#include "sdkconfig.h"',
            '#include "soc/io_mux_reg.h"',
            '#include "soc/soc.h"',
            "",
            "#if !CONFIG_IDF_TARGET_ESP32",
            f'#error "The pins of {BOOTLOADER_BOARD} are an ESP32\'s."',
            "#endif",
            "",
            f"#define GATES ({bits})",
            "",
            "// A pin's register has its name from the pin, so that no loop reaches it.",
            "static inline void select_gpio_for_gates(void) {",
            *(f"  PIN_FUNC_SELECT(IO_MUX_GPIO{pin}_REG, PIN_FUNC_GPIO);" for pin in pins),
            "}",
            "",
        ]
    )
