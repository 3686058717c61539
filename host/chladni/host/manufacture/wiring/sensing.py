"""What listens to coils, on the wiring drawing and in the parts list (tests/spice has it too)."""

from __future__ import annotations

from chladni.host.manufacture.wiring.layout import BLOCK_WIDTH, BLOCK_X, CHIP_X, PIN_PITCH
from chladni.host.manufacture.wiring.part import Part
from chladni.host.manufacture.wiring.symbols import Sheet
from chladni.sim.board.board import Board

FILL = "#dbe9f6"
HEIGHT = 6.4
"""Of the block, its heading with it."""


def sensing_parts(board: Board) -> tuple[Part, ...]:
    """What has to be bought; nothing on a board without [sensing]."""
    if board.sensing is None:
        return ()
    count, is_bridge = len(board.actuators), board.electronics.is_bridge
    # And the reference's.
    ends = 2 * count + 2 if is_bridge else count + 2
    multiplexer = (
        Part("multiplexer, 8 to 1", 2, "CD74HCT4051, 5 V", "one for each end of the coils")
        if is_bridge
        else Part("multiplexer, 16 to 1", 1, "CD74HCT4067, 5 V", "the drains; 5 V is the other end")
    )
    reference = (
        Part("reference resistor", 2, "100 Ω, 100 kΩ", "1/1001 of the first coil's OUT1; 1 %")
        if is_bridge
        else Part("reference resistor", 3, "100 Ω, 2 × 100 kΩ", "1/2001 of the first coil; 1 %")
    )
    sleeping = (
        (
            Part("nSLEEP pull-up", count, "10 kΩ", "bridges are awake unless the expander says so"),
            Part(
                "coil pull-down", count, "100 kΩ", "where a sleeping bridge leaves both ends open"
            ),
        )
        if is_bridge
        else ()
    )
    return (
        Part("port expander", 1, "TCA9555, address 0x20",
             "chooses what is listened to, on the panel's bus; TI SCPS200"),
        multiplexer,
        Part("analogue switch", 1, "CD74HCT4053, 5 V", "puts the reference in a coil's place"),
        Part("instrumentation amplifier", 1, "INA826, 3.3 V",
             "20 times with 2.61 kΩ; TI SBOS562"),
        Part("operational amplifier", 1, "MCP6022, 3.3 V",
             "−10 times, two poles at 15.8 kHz; its other half makes 1.3 V"),
        Part("sensing resistor", ends, "10 kΩ", "5.5 V into a multiplexer of 5 V: 50 µA"),
        reference,
        Part("amplifier resistor", 9, "2.61 kΩ, 3 × 1 kΩ, 10 kΩ, 2 × 150 kΩ, 13 kΩ, 20 kΩ",
             "tests/spice/amplifier.cir; the last two make 1.3 V"),
        Part("amplifier capacitor", 8, "2 × 1 nF, 2 × 100 nF, 15 nF, 680 pF, 10 nF, 100 nF",
             "the same; C0G where below 100 nF"),
        *sleeping,
    )  # fmt: skip


def draw_sensing(sheet: Sheet, board: Board, top: float) -> None:
    """A block on the left with what it holds, and the wire to the converter's pin."""
    assert board.sensing is not None
    end, low = BLOCK_X + BLOCK_WIDTH, top - HEIGHT + 1.2
    sheet.text(BLOCK_X, top, "coils that measure each other", bold=True)
    sheet.box(BLOCK_X, low, BLOCK_WIDTH, top - 0.5 - low, fill=FILL)
    said = ("10 kΩ, multiplexer", "100 nF, INA826 ×20", "MCP6022 ×−10", "TCA9555 on the bus")
    sheet.lines(BLOCK_X + 0.3, top - 2.4, said)
    y = top - 0.5 - PIN_PITCH
    sheet.wire((end, y), (CHIP_X, y))
    sheet.text(end - 0.2, y, "out", left=False)
    sheet.text(CHIP_X + 0.2, y, f"GPIO {board.sensing.pin}")


def sensing_notes(board: Board) -> list[str]:
    """What the drawing has no room for."""
    if board.sensing is None:
        return []
    is_bridge = board.electronics.is_bridge
    ends = "both ends of coil k lead" if is_bridge else "drain k leads"
    which = "the two multiplexers" if is_bridge else "the multiplexer"
    sleeps = ", 1.k is nSLEEP of bridge k" if is_bridge else ""
    from_, to = ("ground", "100 kΩ to OUT1") if is_bridge else ("the supply", "200 kΩ to the drain")
    return [
        f"Sensing: {ends} by 10 kΩ to input k of {which}. The expander's 0.0 to 0.3 are the "
        f"address, 0.4 chooses the reference{sleeps}.",
        f"Reference: 100 Ω at {from_}, from there {to} of coil 1.",
    ]
