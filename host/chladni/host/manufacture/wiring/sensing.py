"""What listens to coils, on the wiring drawing."""

from __future__ import annotations

from chladni.host.manufacture.wiring.layout import BLOCK_WIDTH, BLOCK_X, CHIP_X, PIN_PITCH
from chladni.host.manufacture.wiring.symbols import Sheet
from chladni.sim.board.board import Board

FILL = "#dbe9f6"
HEIGHT = 6.4
"""Of the block, its heading with it."""


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
