"""Synthesis: how pure a sine is, against what a sample costs.

    .venv/bin/python bench/synthesis.py      prints tables, writes docs/images/synthesis.png

First every way of making a sine's duties (table points, interpolation, carrier bits, order of the
shaping) from one small program, `bench/common/synthesis_variant.cpp`: its duties here, its
instructions on an emulated Xtensa and RISC-V. Then the firmware as it is. Purity is measured as
docs/metrics.md says, over 20–1000 Hz, at 160 Hz.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chladni.host.emulation.demodulate import (
    PURITY_PERIODS,
    Play,
    edge_sfdr_db,
    phasors,
    sfdr_db,
    sndr_db,
)
from chladni.host.emulation.emulator import Emulator, Recording, TouchEvent
from chladni.host.figures.fields import COLOURS, save
from chladni.sim.board.file import load_board
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.table import Limits

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tools"))
from instruction_counts import (  # noqa: E402
    FIRMWARE,
    FLAGS,
    HERE,
    PROCESSORS,
    count,
    count_writes,
    missing,
)

FREQUENCY_HZ = 160.0
SETTLE = 4_000
"""Samples before purity is measured."""


@dataclass(frozen=True)
class Variant:
    """A way of making a sine: quarter-wave points, interpolated or not, carrier bits, order."""

    points: int
    is_interpolated: bool
    bits: int
    order: int

    def defines(self, level: float) -> list[str]:
        """Macros of `synthesis_variant.cpp`."""
        rate = 80e6 / (1 << self.bits) / 4
        gain = round(level * ((1 << (self.bits - 1)) - 3) * 2.0 ** (15 - self.bits))
        values = {
            "POINTS_BITS": self.points.bit_length() - 1,
            "INTERPOLATE": int(self.is_interpolated),
            "PWM_BITS": self.bits,
            "ORDER": self.order,
            "GAIN": gain,
            "STEP": f"{round(FREQUENCY_HZ / rate * 2**32)}U",
            "SAMPLES": PURITY_PERIODS // 4 + SETTLE,
        }
        return [f"-D{name}={value}" for name, value in values.items()]


def program(
    folder: Path, variant: Variant, level: float, compiler: list[str], extra: list[str | Path]
) -> Path:
    """Compile a variant."""
    angle = np.arange(variant.points + 1) / variant.points * (np.pi / 2.0)
    values = ", ".join(str(v) for v in np.rint(32767.0 * np.sin(angle)).astype(int))
    (folder / "variant_table.hpp").write_text(
        f"#include <cstdint>\nconstexpr int16_t kQuarter[] = {{{values}}};\n", encoding="utf-8"
    )
    out = folder / "program.elf"
    subprocess.run(
        [
            *compiler,
            *FLAGS,
            *variant.defines(level),
            "-I",
            folder,
            "-I",
            FIRMWARE,
            "-o",
            out,
            ROOT / "bench" / "common" / "synthesis_variant.cpp",
            *extra,
        ],
        check=True,
    )
    return out


def duties(variant: Variant, level: float) -> NDArray[np.uint16]:
    """What it puts on a pin, one value per sample."""
    with tempfile.TemporaryDirectory() as folder:
        here: list[str | Path] = [HERE / "this_machine.cpp"]
        built = program(Path(folder), variant, level, ["g++", "-DON_THIS_MACHINE"], here)
        answer = subprocess.run([built], check=True, stdout=subprocess.PIPE).stdout
    return np.frombuffer(answer, dtype="<u2")[SETTLE:]


def instructions(variant: Variant) -> list[float]:
    """Most per five-channel sample, on each processor."""
    found = []
    for processor in PROCESSORS:
        with tempfile.TemporaryDirectory() as folder:
            extra: list[str | Path] = [
                "-isystem",
                HERE / "include",
                "-T",
                HERE / f"{processor.prefix}.ld",
                "-Wl,--no-warn-rwx-segments",
                "-nostdlib",
                HERE / f"{processor.prefix}_start.S",
                "-lgcc",
            ]
            compiler = [processor.compiler, *processor.flags, "-ffreestanding"]
            built = program(Path(folder), variant, 1.0, compiler, extra)
            answer = subprocess.run(
                [
                    *processor.machine,
                    "-nographic",
                    "-monitor",
                    "none",
                    "-serial",
                    "none",
                    "-kernel",
                    built,
                ],
                check=True,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=60,
            )
        found.append(int(answer.stdout.split()[1], 16) / processor.per_instruction)
    return found


@dataclass(frozen=True)
class Purity:
    """Of one duty stream, dB."""

    sfdr: float
    edge_sfdr: float
    sndr: float
    thd: float


def purity(recording: Recording, frequency_hz: float = FREQUENCY_HZ) -> Purity:
    """All four measures of the first channel."""
    play = Play(0, recording.duty_steps.shape[0])
    sfdr, edge, sndr = (
        measure(recording, play, frequency_hz)[0] for measure in (sfdr_db, edge_sfdr_db, sndr_db)
    )
    assert sfdr is not None
    assert edge is not None
    assert sndr is not None
    harmonics = [
        abs(phasors(recording, play, frequency_hz * k)[0])
        for k in range(1, int(1000.0 / frequency_hz) + 1)
    ]
    thd = 10.0 * np.log10(sum(h**2 for h in harmonics[1:]) / harmonics[0] ** 2)
    return Purity(sfdr, edge, sndr, float(thd))


def measured(variant: Variant, level: float) -> Purity:
    """Purity of a variant at a level of full amplitude."""
    held = np.repeat(duties(variant, level), 4)[:, None]
    return purity(Recording(held, 80e6 / (1 << variant.bits), variant.bits))


VARIANTS = [
    *(Variant(points, True, 10, 2) for points in (16, 32, 64, 128, 256, 512)),
    *(Variant(points, False, 10, 2) for points in (64, 256, 1024)),
    *(Variant(256, True, 10, order) for order in (0, 1)),
    *(Variant(256, True, bits, 2) for bits in (11, 12)),
]
LEVELS = {"0 dB": 1.0, "-24 dB": 10.0 ** (-24.0 / 20.0)}


def bench_variants() -> None:
    """A row per variant, and the figure."""
    print("## Synthesis: purity against instructions\n")
    print(
        "Sine of 160 Hz, duties [measured](../metrics.md#of-the-pins). Instructions (not cycles) "
        "are the most of a five-channel sample from phase to duties, under QEMU. Bold: the "
        "firmware.\n"
    )
    print(
        "| points | interpolated | bits | order | SFDR, 0 dB | SFDR, −24 dB | SNDR, 0 dB | "
        "SNDR, −24 dB | THD, 0 dB | Xtensa | RISC-V |"
    )
    print("|" + "---|" * 11)
    rows = []
    for variant in VARIANTS:
        full, quiet = (measured(variant, level) for level in LEVELS.values())
        costs = instructions(variant)
        rows.append((variant, full, quiet, costs))
        mark = "**" if variant == Variant(256, True, 10, 2) else ""
        cells = [
            f"{mark}{variant.points}{mark}",
            "yes" if variant.is_interpolated else "no",
            variant.bits,
            variant.order,
            f"{full.sfdr:.1f}",
            f"{quiet.sfdr:.1f}",
            f"{full.sndr:.1f}",
            f"{quiet.sndr:.1f}",
            f"{full.thd:.1f}",
            f"{costs[0]:.0f}",
            f"{costs[1]:.0f}",
        ]
        print("| " + " | ".join(map(str, cells)) + " |")
    draw(rows)
    print("\n![Purity against cost](../images/synthesis.png)\n")


def draw(rows: list[tuple[Variant, Purity, Purity, list[float]]]) -> None:
    """SFDR of every variant at both levels, its cost beside it."""
    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.subplots()
    names = []
    for place, (variant, full, quiet, costs) in enumerate(rows):
        is_ours = variant == Variant(256, True, 10, 2)
        axes.plot([full.sfdr, quiet.sfdr], [place] * 2, color="0.8", zorder=1)
        size = 70 if is_ours else 28
        axes.scatter(full.sfdr, place, size, COLOURS[0], zorder=2)
        axes.scatter(quiet.sfdr, place, size, COLOURS[1], marker="s", zorder=2)
        axes.annotate(
            f"{costs[1]:.0f}",
            (124.0, place),
            va="center",
            ha="right",
            fontsize=8,
            weight="bold" if is_ours else "normal",
        )
        way = "interpolated" if variant.is_interpolated else "plain"
        names.append(f"{variant.points} {way}, {variant.bits} bits, order {variant.order}")
    axes.set_yticks(range(len(names)), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlim(55.0, 125.0)
    axes.set_xlabel(
        "SFDR of the duty, 20–1000 Hz, dB; at the right instructions per sample (RISC-V)"
    )
    axes.scatter([], [], 28, COLOURS[0], label="full amplitude")
    axes.scatter([], [], 28, COLOURS[1], marker="s", label="24 dB below")
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    save(figure, ROOT / "docs" / "images" / "synthesis.png")


ROWS = {
    "five sines": "sine_steady",
    "five sines whose currents turn": "sine_turning",
    "while a drive changes": "sine_ramping",
    "other waves": "others_steady",
    "other waves whose currents turn": "others_turning",
    "other waves, changing": "others_ramping",
    "with a command to take": "with_news",
}
"""By their names on the page; a switch's currents never turn."""


def bench_firmware() -> None:
    """The shipped core: purity over the band by level, and all its counts."""
    print("## The firmware's own samples\n")
    board = load_board("prototype")
    table, _ = build_table(board)
    table = replace(table, limits=Limits(4000, 100_000, 60_000_000))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "t.chl"
        path.write_bytes(pack(table))
        counts = [count(processor, path) for processor in PROCESSORS]
    writes = [count_writes(processor) for processor in PROCESSORS]
    print(
        "| instructions per five-channel sample, most | Xtensa | RISC-V | bridges, Xtensa "
        "| bridges, RISC-V |"
    )
    print("|---|---|---|---|---|")
    for name, key in ROWS.items():
        cells = [str(getattr(c, key, "–")) for c in counts] + [str(c.bridges[key]) for c in counts]
        print(f"| {name} | " + " | ".join(cells) + " |")
    means = [f"{c.sine_mean[k]:.0f}" for k in (0, 1) for c in counts if c.sine_mean is not None]
    print("| five small sines, on average | " + " | ".join(means) + " |")
    cells = [str(found[key]) for key in ("writes", "bridge_writes") for found in writes]
    print("| writing the duties | " + " | ".join(cells) + " |")
    print(
        "\nBudget: 12,288 cycles of 240 MHz per sample. Two seconds of touches give the same "
        "duties on both processors and here.\n"
    )
    print("| level | SFDR | edge SFDR | SNDR | THD |")
    print("|---|---|---|---|---|")
    for name, level in (("full", 1.0), ("80 %", 0.8), ("−12 dB", 0.251), ("−24 dB", 0.063)):
        emulator = Emulator(board, table, level=level, supply_ma=20_000)
        emulator.touch(TouchEvent(0.0, (0.0, 0.0)))
        emulator.run(100.0)
        recording = emulator.run(PURITY_PERIODS / 78_125.0 * 1e3 + 1.0)
        loudest = int(np.argmax(np.ptp(recording.duty_steps, axis=0)))
        one = replace(recording, duty_steps=recording.duty_steps[:PURITY_PERIODS, [loudest]])
        found = purity(one)
        print(
            f"| {name} | {found.sfdr:.1f} | {found.edge_sfdr:.1f} | {found.sndr:.1f} | "
            f"{found.thd:.1f} |"
        )
    print()


if __name__ == "__main__":
    if missing():
        sys.exit(f"not installed: {', '.join(missing())}")
    bench_variants()
    bench_firmware()
