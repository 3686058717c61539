"""What listens to coils, in the parts list (tests/spice has it too)."""

from __future__ import annotations

from chladni.host.manufacture.wiring.part import Part
from chladni.sim.board.board import Board


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
