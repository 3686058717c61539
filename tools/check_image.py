"""Look into a linked image: where the sample interrupt lies, and how much room is taken.

    python tools/check_image.py build/chladni.elf
    python tools/check_image.py .pio/build/esp32s3/firmware.elf --chip esp32s3

Everything that the interrupt and the last resort reach by calls and literals must lie in IRAM with
its literals, none of them may be an address in flash, the tables that it reads must lie in DRAM,
and none of it may use the floating-point unit, whose registers an interrupt does not save. What is
called by a pointer in memory is not followed: such functions are named here.
Needs the vendor's nm, objdump and size on the PATH (--tools for another prefix).
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

Again = Callable[[int, int], str]


@dataclass(frozen=True)
class Memory:
    """Where a chip has internal memory, and what the application may take of it, bytes."""

    iram: range
    dram: range
    flash: tuple[range, ...]
    iram_bytes: int
    dram_bytes: int
    tools: str


# ESP-IDF 5.5.3's linker scripts (components/esp_system/ld); the budgets leave Wi-Fi what it takes.
MEMORIES = {
    "esp32": Memory(
        range(0x40080000, 0x400A0000),
        range(0x3FFAE000, 0x40000000),
        (range(0x3F400000, 0x3F800000), range(0x400C2000, 0x40C00000)),
        128 * 1024,
        180_736,
        "xtensa-esp32-elf-",
    ),
    "esp32s3": Memory(
        range(0x40370000, 0x403E0000),
        range(0x3FC88000, 0x3FD00000),
        (range(0x3C000000, 0x3E000000), range(0x42000000, 0x44000000)),
        352 * 1024,
        341_760,
        "xtensa-esp32s3-elf-",
    ),
}
ROOTS = (
    "on_alarm",
    "set_duties",
    "chladni::chip::pwm_set_duties",
    "chladni::chip::cut_outputs",
    "start_together",
    "__wrap_esp_panic_handler",
)
"""Where the interrupt, the last resort and the start of both timers begin."""
BEYOND = ("esp_panic_handler", "__real_esp_panic_handler")
"""ESP-IDF's own, after outputs were cut."""
TABLES = ("kSineQuarter",)
"""Constants that the interrupt reads."""
HEAD = re.compile(r"^([0-9a-f]+) <(.+)>:$", re.MULTILINE)
LINE = re.compile(r"^([0-9a-f]+):\t([0-9a-f]+) .*$", re.MULTILINE)
GOAL = re.compile(r"\s(?:j|b\w+(?:\.n)?|loop\w*)\s(?:\w+, )*([0-9a-f]+) <")
WORDS = re.compile(r"^ ([0-9a-f]+) ((?:[0-9a-f]{2,8} ){1,4})", re.MULTILINE)
CALL = re.compile(r"\s(?:call0|call4|call8|call12|j)\s+[0-9a-f]+ <(.+?)(?:\+0x[0-9a-f]+)?>")
LITERAL = re.compile(r"\sl32r\s+\w+, ([0-9a-f]+)")
FLOATING = re.compile(r"\s(\w+\.s|lsi|ssi|lsx|ssx|wfr|rfr|lsiu|ssiu)\s")


@dataclass(frozen=True)
class Function:
    """A function of the image as it is disassembled."""

    address: int
    calls: tuple[str, ...]
    literals: tuple[int, ...]
    floating: tuple[str, ...]


def bare(name: str) -> str:
    """A name without its arguments and its unnamed namespace."""
    return name.replace("(anonymous namespace)::", "").partition("(")[0]


def functions(disassembly: str, again: Again | None = None) -> dict[str, Function]:
    """Every function by its bare name.

    Parameters
    ----------
    again
        Disassembles from an address to another. A sweep takes padding behind a jump for the
        beginning of an instruction, and what follows is lost. So it starts again from where a jump
        of the function itself goes to.
    """
    heads = [(m.start(), int(m.group(1), 16), bare(m.group(2))) for m in HEAD.finditer(disassembly)]
    found: dict[str, Function] = {}
    ends = [(at, address) for at, address, _ in heads[1:]] + [(len(disassembly), 1 << 32)]
    for (at, address, name), (to, end) in zip(heads, ends, strict=True):
        lines = instructions(disassembly[at:to])
        while again is not None and (lost := out_of_step(lines, address, end)) is not None:
            before = {k: v for k, v in lines.items() if k + v[0] <= lost}
            lines = before | instructions(again(lost, end))
        text = "\n".join(line for _, line in lines.values())
        found[name] = Function(
            address,
            tuple(bare(own) for own in CALL.findall(text)),
            tuple(int(own, 16) for own in LITERAL.findall(text)),
            tuple(FLOATING.findall(text)),
        )
    return found


def instructions(text: str) -> dict[int, tuple[int, str]]:
    """Length and line of every instruction by its address."""
    return {int(m.group(1), 16): (len(m.group(2)) // 2, m.group(0)) for m in LINE.finditer(text)}


def out_of_step(lines: dict[int, tuple[int, str]], start: int, end: int) -> int | None:
    """The first address that the function jumps to and that no line begins at."""
    goals = {int(own, 16) for _, line in lines.values() for own in GOAL.findall(line)}
    lost = [goal for goal in goals if start <= goal < end and goal not in lines]
    return min(lost, default=None)


def is_root(name: str, root: str) -> bool:
    """Whether a function is a root, in whatever namespace."""
    return name == root or name.endswith(f"::{root}")


def reached(found: dict[str, Function], contents: Mapping[int, int]) -> list[str]:
    """What the roots call, and those in turn, themselves included.

    A call too far for its instruction goes through a literal with the function's address.
    """
    by_address = {own.address: name for name, own in found.items()}
    waiting = [name for name in found if any(is_root(name, root) for root in ROOTS)]
    seen: list[str] = []
    while waiting:
        name = waiting.pop()
        if name in seen or name in BEYOND or name not in found:
            continue
        seen.append(name)
        far = (by_address.get(contents.get(at, 0)) for at in found[name].literals)
        waiting += [*found[name].calls, *(own for own in far if own is not None)]
    return seen


def words(contents: str) -> dict[int, int]:
    """Every aligned word of an image by its address, from `objdump -s`."""
    found: dict[int, int] = {}
    for row in WORDS.finditer(contents):
        at, data = int(row.group(1), 16), bytes.fromhex(row.group(2).replace(" ", ""))
        skipped = -at % 4
        found |= {
            at + k: int.from_bytes(data[k : k + 4], "little")
            for k in range(skipped, len(data) - 3, 4)
        }
    return found


def complaints(
    found: dict[str, Function],
    tables: Sequence[range],
    memory: Memory,
    contents: Mapping[int, int],
) -> list[str]:
    """What lies or does what it must not.

    Parameters
    ----------
    tables
        Where copies of TABLES lie. A copy that the path has no address of is another's.
    contents
        Words by their address, for the values of literals.
    """
    path = reached(found, contents)
    wrong = [
        f"{root}: not in the image"
        for root in ROOTS
        if not any(is_root(name, root) for name in path)
    ]
    for name in path:
        own = found[name]
        if own.address not in memory.iram:
            wrong.append(f"{name}: at {own.address:#x}, which is not IRAM")
        wrong += [
            f"{name}: a literal at {at:#x}, which is not IRAM"
            for at in own.literals
            if at not in memory.iram
        ]
        values = [contents.get(at, 0) for at in own.literals]
        wrong += [
            f"{name}: the address {value:#x}, which is flash"
            for value in values
            if any(value in part for part in memory.flash)
        ]
        wrong += [f"{name}: {what}, of the floating-point unit" for what in own.floating]
    read = {contents.get(at, 0) for name in path for at in found[name].literals}
    used = [own for own in tables if any(at in own for at in read)]
    wrong += [
        f"a table at {own.start:#x}, which is not DRAM"
        for own in used
        if own.start not in memory.dram
    ]
    if not used:
        wrong.append(f"{', '.join(TABLES)}: the interrupt has no address of it")
    return wrong


def sizes(text: str, memory: Memory) -> tuple[int, int]:
    """Bytes of IRAM and of DRAM in `size -A`."""
    taken = [0, 0]
    for line in text.splitlines():
        words = line.split()
        if len(words) == 3 and words[1].isdigit() and words[2].isdigit():
            at = int(words[2])
            taken[0] += int(words[1]) if at in memory.iram else 0
            taken[1] += int(words[1]) if at in memory.dram else 0
    return taken[0], taken[1]


def check(image: Path, memory: Memory, prefix: str) -> list[str]:
    """What is wrong with an image, budgets among it; prints what it takes."""

    def said(tool: str, *arguments: str) -> str:
        command = [prefix + tool, *arguments, str(image)]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    iram, dram = sizes(said("size", "-A"), memory)
    print(f"IRAM {iram:,} of {memory.iram_bytes:,} bytes, DRAM {dram:,} of {memory.dram_bytes:,}")
    rows = [line.split(maxsplit=3) for line in said("nm", "-SC").splitlines()]
    tables = [
        range(int(row[0], 16), int(row[0], 16) + int(row[1], 16))
        for row in rows
        if len(row) == 4 and any(own in row[3] for own in TABLES)
    ]

    def again(start: int, end: int) -> str:
        return said("objdump", "-dC", f"--start-address={start:#x}", f"--stop-address={end:#x}")

    found = functions(said("objdump", "-dC"), again)
    contents = words(said("objdump", "-s"))
    path = reached(found, contents)
    print(f"{len(path)} functions on the interrupt's path and the last resort's")
    wrong = complaints(found, tables, memory, contents)
    budgets = (("IRAM", iram, memory.iram_bytes), ("DRAM", dram, memory.dram_bytes))
    return wrong + [
        f"{name}: {own:,} bytes of {most:,}" for name, own, most in budgets if own > most
    ]


def main() -> int:
    """Print what is wrong; 1 if anything is, 2 if the image cannot be looked into."""
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("image", type=Path)
    parser.add_argument("--chip", choices=sorted(MEMORIES), default="esp32")
    parser.add_argument("--tools", help="prefix of nm, objdump and size")
    asked = parser.parse_args()
    memory = MEMORIES[asked.chip]
    prefix = memory.tools if asked.tools is None else asked.tools
    if shutil.which(prefix + "objdump") is None:
        print(f"check_image: {prefix}objdump: not on the PATH", file=sys.stderr)
        return 2
    try:
        wrong = check(asked.image, memory, prefix)
    except subprocess.CalledProcessError as error:
        print(f"check_image: {asked.image}: {error.stderr.strip()}", file=sys.stderr)
        return 2
    print("\n".join(wrong) or "nothing wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
