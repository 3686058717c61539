"""Run the firmware core on an emulated Xtensa lx106 and RISC-V rv32imc, and count instructions.

    python tools/instruction_counts.py TABLE.chl   take it, look 4000 places up, play 4 s

Both programs are compiled from the core as it is and run under QEMU. They must give the drives that
the Python reference gives, and the duties that the same program gives on this machine. What is
counted are instructions, not cycles: no cache, no pipeline.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from chladni.sim.errors import ChladniError
from chladni.tables.format import read_table
from chladni.tables.table import Table

FIRMWARE = Path(__file__).resolve().parents[1] / "firmware" / "esp32"
HERE = FIRMWARE / "qemu"
CORE = tuple(sorted((FIRMWARE / "core").rglob("*.cpp")))
FLAGS = (
    "-std=c++17", "-O2", "-fno-schedule-insns", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra",
    "-Wconversion", "-Werror",
)  # fmt: skip
PLACES = 4000
IDF_HEADERS = (
    "sdkconfig.h", "esp_attr.h", "esp_err.h", "driver/gpio.h", "driver/ledc.h",
    "esp_adc/adc_continuous.h",
    "freertos/FreeRTOS.h", "soc/gpio_reg.h", "soc/gpio_sig_map.h", "soc/ledc_reg.h",
    "soc/ledc_struct.h", "soc/soc.h",
)  # fmt: skip


@dataclass(frozen=True)
class Processor:
    """A compiler, a machine, and how far its counter moves per instruction."""

    name: str
    compiler: str
    flags: tuple[str, ...]
    machine: tuple[str, ...]
    per_instruction: float
    prefix: str

    @property
    def emulator(self) -> list[str]:
        """What runs a program, whose path comes last."""
        return [*self.machine, "-nographic", "-monitor", "none", "-serial", "none", "-kernel"]


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


SAMPLES = (
    "sine_steady", "sine_ramping", "others_steady", "others_ramping", "with_news", "turn",
    "sine_turning", "others_turning",
)  # fmt: skip
SAMPLES_OF_VOICES = ("1", "2", "3", "4", "5", "signal", "ramping", "with_news")


@dataclass(frozen=True)
class Counts:
    """Instructions on one processor.

    Those of a sample are of five channels, the largest seen; None for a table of other channels.
    """

    processor: str
    ram: dict[str, int]
    """Bytes of the core's variables, by what they are for."""
    load: int
    lookup_most: int
    lookup_mean: float
    sine_steady: int | None
    sine_ramping: int | None
    others_steady: int | None
    others_ramping: int | None
    with_news: int | None
    turn: int | None
    """Of the main loop, a millisecond: meter, heat and supply with it."""
    bridges: dict[str, int]
    """Those of `SAMPLES` with bridges; empty for a table of other channels."""
    sine_mean: tuple[float, float] | None
    """Of a sine that does not ramp, with switches and with bridges: coils that turn are in it."""
    voices: dict[str, int]
    """Of a sample by the number of voices, on the table's channels; the rest of five."""


def missing() -> list[str]:
    """Programs that are needed and not installed."""
    needed = [p.compiler for p in PROCESSORS] + [p.machine[0] for p in PROCESSORS]
    return [name for name in needed if shutil.which(name) is None]


def compile_core(processor: Processor, folder: Path) -> list[Path]:
    """The core's objects in a folder, to be linked around any number of tables.

    Beside each lies who calls whom there (.ci).
    """
    command = [processor.compiler, *processor.flags, "-ffreestanding", "-nostdlib"]
    command.append("-fcallgraph-info=su")
    return _objects([*command, *FLAGS, "-isystem", str(HERE / "include")], folder)


def compile_core_here(folder: Path) -> list[Path]:
    """The same for this machine; what it plays does not depend on how it is optimised."""
    plain = ["-O0" if flag == "-O2" else flag for flag in FLAGS]
    return _objects(["g++", *plain], folder)


def _linked(processor: Processor, own: Sequence[Path]) -> list[str | Path]:
    """Sources or objects, and what they are linked with to run on an emulated processor."""
    return [
        *own,
        f"-isystem{HERE / 'include'}",
        f"-T{HERE / processor.prefix}.ld",
        "-Wl,--no-warn-rwx-segments",
        # Nothing here finds drives of fingers, and the lx106's library has no floats.
        "-Wl,--gc-sections",
        HERE / f"{processor.prefix}_start.S",
        library(processor),
    ]


def _objects(command: list[str], folder: Path) -> list[Path]:
    arguments = ["-I", str(FIRMWARE), "-c", *map(str, CORE)]
    subprocess.run([*command, *arguments], check=True, cwd=folder)
    return sorted(folder.glob("*.o"))


def count(
    processor: Processor,
    path: Path,
    *,
    core: Sequence[Path] = CORE,
    core_here: Sequence[Path] = CORE,
    only: Literal["lookups", "voices"] | None = None,
) -> Counts:
    """Compile, run, compare with the reference, and count.

    Parameters
    ----------
    core, core_here
        Sources, or what `compile_core` and `compile_core_here` made of them.
    only
        What is played besides the lookups: nothing, or the scenario of voices; else all.

    Raises
    ------
    ChladniError
        The processor reads other drives than the reference, or plays other duties than here.
    """
    table = read_table(path)
    command = [processor.compiler, *processor.flags, "-ffreestanding", "-nostdlib"]
    plays = [] if only is None else [f"-D{only.upper()}_ONLY"]
    said = run(
        path,
        [*command, *FLAGS, *plays],
        _linked(processor, core),
        processor.emulator,
    )
    if said["status"] != 0:
        raise ChladniError(f"{processor.name}: table status {said['status']}")
    expected = reference_crc(table)
    if said["drives_crc"] != expected:
        raise ChladniError(f"{processor.name}: drives {said['drives_crc']:#x}, not {expected:#x}")
    if only != "lookups":
        own = ["g++", "-DON_THIS_MACHINE", *FLAGS, *plays]
        here = run(path, own, [*core_here, HERE / "this_machine.cpp"], [])
        for name in ("duties_crc", "bridge_duties_crc", "voices_duties_crc"):
            if said.get(name) != here.get(name):
                raise ChladniError(f"{processor.name}: other {name} than on this machine")

    def mean(begins: str) -> float:
        return said[f"{begins}sine_sum"] / said[f"{begins}sine_samples"] / processor.per_instruction

    def of_sample(name: str) -> int | None:
        return round(said[name] / processor.per_instruction) if name in said else None

    return Counts(
        processor.name,
        {name.removeprefix("ram_"): size for name, size in said.items() if name.startswith("ram_")},
        round(said["load"] / processor.per_instruction),
        round(said["lookup_most"] / processor.per_instruction),
        said["lookup_sum"] / processor.per_instruction / said["lookups"],
        sine_steady=of_sample("sine_steady"),
        sine_ramping=of_sample("sine_ramping"),
        others_steady=of_sample("others_steady"),
        others_ramping=of_sample("others_ramping"),
        with_news=of_sample("with_news"),
        turn=of_sample("turn"),
        bridges={
            name: found for name in SAMPLES if (found := of_sample(f"bridge_{name}")) is not None
        },
        sine_mean=(mean(""), mean("bridge_")) if "sine_sum" in said else None,
        voices={
            name: found
            for name in SAMPLES_OF_VOICES
            if (found := of_sample(f"voices_{name}")) is not None
        },
    )


def count_writes(processor: Processor) -> dict[str, int]:
    """What writing five duties takes, and what the registers then hold (qemu/duty_writes.cpp).

    The chip's registers are plain memory here: what a bus makes them wait is not counted.
    """
    chip = FIRMWARE / "chip"
    with tempfile.TemporaryDirectory() as folder:
        for name in IDF_HEADERS:
            path = Path(folder) / name
            path.parent.mkdir(exist_ok=True)
            path.write_text('#pragma once\n#include "qemu/idf/registers.hpp"\n', encoding="utf-8")
        program = Path(folder) / "program.elf"
        include: list[str | Path] = ["-isystem", HERE / "include"]
        for place in (Path(folder), FIRMWARE, chip, chip / "esp32"):
            include += ["-I", place]
        subprocess.run(
            [
                processor.compiler,
                *processor.flags,
                "-ffreestanding",
                "-nostdlib",
                *FLAGS,
                "-ffunction-sections",
                *include,
                "-o",
                program,
                *_linked(processor, [HERE / "duty_writes.cpp", chip / "outputs" / "pwm.cpp"]),
            ],
            check=True,
        )
        said = emulate(processor.emulator, program)
    for name in ("writes", "bridge_writes"):
        said[name] = round(said[name] / processor.per_instruction)
    return said


def library(processor: Processor) -> str:
    """The compiler's own; of RISC-V that with atomics, which it does not find with zicsr."""
    flags = [flag.replace("imc", "imac").removesuffix("_zicsr") for flag in processor.flags]
    asked = [processor.compiler, *flags, "-print-libgcc-file-name"]
    return subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()


def run(
    path: Path, compiler: list[str], extra: list[str | Path], machine: Sequence[str]
) -> dict[str, int]:
    """Compile the program around a table, run it, and return what it says."""
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(path, Path(folder) / "table.chl")
        program = Path(folder) / "program.elf"
        subprocess.run(
            [
                *compiler,
                f"-DCHANNELS={read_table(path).actuators}U",
                "-I",
                FIRMWARE,
                f"-Wa,-I{folder}",
                "-o",
                program,
                HERE / "main.cpp",
                HERE / "table_data.S",
                *extra,
            ],
            check=True,
        )
        return emulate(machine, program)


def emulate(machine: Sequence[str], program: Path) -> dict[str, int]:
    """Run a program, and return what it says."""
    answer = subprocess.run(
        [*machine, program],
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=120,
    )
    return {name: int(value, 16) for name, value in map(str.split, answer.stdout.splitlines())}


def reference_crc(table: Table) -> int:
    """CRC-32 of the reference's drives at the places the programs look up."""
    seed, places = 1, []
    for bits in (16, 17) * PLACES:
        seed = (seed * 1664525 + 1013904223) % 2**32
        places.append((seed >> (32 - bits)) - (1 << (bits - 1)))
    at = np.array(places).reshape(-1, 2)
    drives = table.lookup(table.section(), at[:, 0], at[:, 1])
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
            f"{found.lookup_mean:.0f} on average; a sample {found.sine_steady} steady, "
            f"{found.sine_ramping} while ramping; {found.others_steady} and {found.others_ramping} "
            f"of other waves; {found.with_news} "
            "with news from the main loop"
        )
        print(f"    with bridges: {', '.join(f'{n} {own}' for n, own in found.bridges.items())}")
        if found.sine_mean is not None:
            switches, bridges = found.sine_mean
            print(f"    a sine on average {switches:.1f}, with bridges {bridges:.1f}")
        print(f"    voices: {', '.join(f'{n} {own}' for n, own in found.voices.items())}")
        writes = count_writes(processor)
        print(f"    writing the duties {writes['writes']}, with bridges {writes['bridge_writes']}")
        parts = ", ".join(f"{name.replace('_', ' ')} {size}" for name, size in found.ram.items())
        print(f"    RAM: {sum(found.ram.values())} bytes: {parts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
