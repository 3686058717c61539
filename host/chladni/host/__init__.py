"""The user's side: command line, emulated device, and the loop from pins back to the plate."""

from chladni.host.emulation.emulator import Emulator, EmulatorError, Recording, TouchEvent, emulate
from chladni.host.emulation.loop import LoopReport, board_of, run_loop

__all__ = [
    "Emulator",
    "EmulatorError",
    "LoopReport",
    "Recording",
    "TouchEvent",
    "board_of",
    "emulate",
    "run_loop",
]
