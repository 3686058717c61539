"""Count the instructions of finding the drives of several fingers.

    python tools/finger_instructions.py

On a RISC-V without a floating-point unit, whose library does each operation in some 50 to 100
instructions, and on one with a unit: that multiplies and adds in one instruction, as the ESP32's
LX6 does, for which no compiler is asked for here. (The lx106's library has no floats.) Both must
find the drives that this machine finds.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from instruction_counts import FIRMWARE, FLAGS, HERE, PROCESSORS, Processor, library, missing

from chladni.sim.errors import ChladniError

RISCV = next(each for each in PROCESSORS if each.prefix == "riscv")
# Of architectures for which the compiler's library is there.
WITHOUT_UNIT = Processor(
    "RISC-V rv32imac",
    RISCV.compiler,
    ("-march=rv32imac_zicsr", "-mabi=ilp32"),
    RISCV.machine,
    RISCV.per_instruction,
    RISCV.prefix,
)
WITH_UNIT = Processor(
    "RISC-V rv32imafc",
    RISCV.compiler,
    ("-march=rv32imafc_zicsr", "-mabi=ilp32f"),
    RISCV.machine,
    RISCV.per_instruction,
    RISCV.prefix,
)
SOURCES = (HERE / "fingers.cpp", FIRMWARE / "core" / "fingers" / "drive_solver.cpp")
SETS = ((2, 5), (2, 16), (5, 16))
MOST_DIFFERENCE = 8
"""Of gains in 1/32768, where one fuses what another rounds twice."""


@dataclass(frozen=True)
class Instructions:
    """Of one λ and with its choice: all slices, and the longest."""

    one_sum: int
    one_most: int
    chosen_sum: int
    chosen_most: int
    ram: int
    """Bytes of the solver."""


def count_fingers(processor: Processor, fingers: int, channels: int) -> Instructions:
    """Compile, run, compare with this machine, and count.

    Raises
    ------
    ChladniError
        The processor finds other drives than this machine.
    """
    sizes = [f"-DFINGERS={fingers}U", f"-DCHANNELS={channels}U"]
    said, here = said_there(processor, SOURCES, sizes), said_here(SOURCES, sizes)
    gains = [value for name, value in said if name == "gain"]
    expected = [value for name, value in here if name == "gain"]
    if any(abs(a - b) > MOST_DIFFERENCE for a, b in zip(gains, expected, strict=True)):
        raise ChladniError(f"{processor.name}: other drives than on this machine")
    known = dict(said)
    one_sum, one_most, chosen_sum, chosen_most = (
        round(known[name] / processor.per_instruction)
        for name in ("one_sum", "one_most", "chosen_sum", "chosen_most")
    )
    return Instructions(one_sum, one_most, chosen_sum, chosen_most, known["ram"])


def said_there(
    processor: Processor, sources: Sequence[Path], options: Sequence[str] = ()
) -> list[tuple[str, int]]:
    """What a program says on another processor: names and numbers, in order."""
    bare = ["-ffreestanding", "-nostdlib", "-isystem", str(HERE / "include")]
    script = ["-T", str(HERE / f"{processor.prefix}.ld"), "-Wl,--no-warn-rwx-segments"]
    return _run(
        [
            processor.compiler,
            *processor.flags,
            *FLAGS,
            *options,
            *bare,
            *script,
            str(HERE / f"{processor.prefix}_start.S"),
            *map(str, sources),
            library(processor),
        ],
        [*processor.machine, "-nographic", "-monitor", "none", "-serial", "none", "-kernel"],
    )


def said_here(sources: Sequence[Path], options: Sequence[str] = ()) -> list[tuple[str, int]]:
    """The same on this machine."""
    return _run(
        [
            "g++",
            "-DON_THIS_MACHINE",
            *FLAGS,
            *options,
            str(HERE / "this_machine.cpp"),
            *map(str, sources),
        ],
        [],
    )


def _run(compiler: list[str], machine: list[str]) -> list[tuple[str, int]]:
    """Compile, run, and return the names and numbers that it says, in order."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "fingers.elf"
        subprocess.run([*compiler, "-I", str(FIRMWARE), "-o", str(program)], check=True)
        answer = subprocess.run(
            [*machine, str(program)], check=True, capture_output=True, text=True, timeout=120
        )
    lines = (answer.stdout + answer.stderr).splitlines()
    return [(name, int(value, 16)) for name, value in map(str.split, lines)]


def main() -> int:
    """Print a row per processor and set."""
    if missing():
        print(f"not installed: {', '.join(missing())}", file=sys.stderr)
        return 1
    for processor in (WITHOUT_UNIT, WITH_UNIT):
        for fingers, channels in SETS:
            found = count_fingers(processor, fingers, channels)
            print(
                f"{processor.name}, {fingers} fingers on {channels} channels: {found.one_sum}, "
                f"{found.one_most} in the longest slice; with the choice of λ {found.chosen_sum}, "
                f"{found.chosen_most}; {found.ram} bytes"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
