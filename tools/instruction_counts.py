"""Run the firmware core on an emulated Xtensa lx106 and RISC-V rv32imc, and count instructions.

    python tools/instruction_counts.py TABLE.chl   decode it, look 4000 places up, print the counts

Both programs are compiled from the core as it is, run under QEMU, and must give the drives that the
Python reference gives. What is counted are instructions, not cycles: no cache, no pipeline.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chladni.sim.errors import ChladniError
from chladni.tables.format import read_table
from chladni.tables.lookup import lookup
from chladni.tables.table import Table

FIRMWARE = Path(__file__).resolve().parents[1] / "firmware" / "esp32"
CORE = ("crc32", "stream_reader", "section_decoder", "table")
FLAGS = (
    "-std=c++17", "-O2", "-ffreestanding", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra",
    "-Wconversion", "-Werror",
)  # fmt: skip
PLACES = 4000


@dataclass(frozen=True)
class Processor:
    """A compiler, a machine, and how far its counter moves per instruction."""

    name: str
    compiler: str
    flags: tuple[str, ...]
    machine: tuple[str, ...]
    per_instruction: float
    prefix: str


PROCESSORS = (
    Processor(
        "Xtensa lx106", "xtensa-lx106-elf-g++", ("-mlongcalls",),
        ("qemu-system-xtensa", "-M", "sim", "-cpu", "lx106", "-icount", "shift=7", "-semihosting"),
        5.12, "xtensa",
    ),
    Processor(
        "RISC-V rv32imc", "riscv64-unknown-elf-g++", ("-march=rv32imc_zicsr", "-mabi=ilp32"),
        ("qemu-system-riscv32", "-M", "virt", "-bios", "none", "-icount", "shift=0",
         "-semihosting-config", "enable=on,target=native"),
        1.0, "riscv",
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Counts:
    """Instructions on one processor."""

    processor: str
    load: int
    lookup_most: int
    lookup_mean: float


def missing() -> list[str]:
    """Programs that are needed and not installed."""
    needed = [p.compiler for p in PROCESSORS] + [p.machine[0] for p in PROCESSORS]
    return [name for name in needed if shutil.which(name) is None]


def count(processor: Processor, path: Path) -> Counts:
    """Compile, run, compare with the reference, and count.

    Raises
    ------
    ChladniError
        The processor decodes other drives than the reference.
    """
    table = read_table(path)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(path, Path(folder) / "table.chl")
        program = Path(folder) / "program.elf"
        here = FIRMWARE / "qemu"
        sources = [
            here / "main.cpp", here / "table_data.S", here / f"{processor.prefix}_start.S",
            *(FIRMWARE / "core" / f"{name}.cpp" for name in CORE),
        ]  # fmt: skip
        subprocess.run(
            [processor.compiler, *processor.flags, *FLAGS, f"-DCHANNELS={table.actuators}U",
             "-isystem", here / "include", "-I", FIRMWARE, f"-Wa,-I{folder}", "-nostdlib",
             "-Wl,--no-warn-rwx-segments",
             "-T", here / f"{processor.prefix}.ld", "-o", program, *sources, "-lgcc"],
            check=True,
        )  # fmt: skip
        answer = subprocess.run(
            [*processor.machine, "-nographic", "-monitor", "none", "-serial", "none", "-kernel",
             program],
            check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=120,
        )  # fmt: skip
    said = {name: int(value, 16) for name, value in map(str.split, answer.stdout.splitlines())}
    if said["status"] != 0:
        raise ChladniError(f"{processor.name}: table status {said['status']}")
    expected = reference_crc(table)
    if said["drives_crc"] != expected:
        raise ChladniError(f"{processor.name}: drives {said['drives_crc']:#x}, not {expected:#x}")
    scale = processor.per_instruction
    return Counts(
        processor.name,
        round(said["load"] / scale),
        round(said["lookup_most"] / scale),
        said["lookup_sum"] / scale / said["lookups"],
    )


def reference_crc(table: Table) -> int:
    """CRC-32 of the reference's drives at the places the programs look up."""
    seed, places = 1, []
    for bits in (16, 17) * PLACES:
        seed = (seed * 1664525 + 1013904223) % 2**32
        places.append((seed >> (32 - bits)) - (1 << (bits - 1)))
    at = np.array(places).reshape(-1, 2)
    drives = lookup(table, table.section(), at[:, 0], at[:, 1])
    return zlib.crc32(drives.astype("<i2").tobytes())


def main() -> int:
    """Print a row per processor."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("table", type=Path)
    path = parser.parse_args().table
    if missing():
        print(f"not installed: {', '.join(missing())}", file=sys.stderr)
        return 1
    for processor in PROCESSORS:
        found = count(processor, path)
        print(
            f"{found.processor}: load {found.load}, lookup {found.lookup_most} at most, "
            f"{found.lookup_mean:.0f} on average"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
