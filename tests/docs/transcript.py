"""A `console` block: commands behind `$ `, and what of their output matters.

Expected lines are the output's lines, from the first on and without gaps, except that

- a line `...` stands for any lines, and `...` within a line for anything;
- a number may be off by 2 %, or by one of the last digit that is shown;
- any time does for a time ("3.1 s", "seconds 0.08"), any path for a path that begins with /;
- frames of tables, and how wide blanks are, do not count;
- a command without expected lines may print anything.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

RELATIVE = 0.02
"""Numbers may differ by so much: libraries and processors round differently, and a search may
end at a neighbour."""

NUMBER = re.compile(r"(?<![\w.])[-−+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\d)")
TIME = re.compile(r"\b(seconds)\s+[\d.]+|(?<![\w.])[\d.]+ (m?s)\b")
PATH = re.compile(r"(?<!\S)/[^\s:]+")
FRAME = re.compile("[│┃┌┐└┘├┤┬┴┼─━┏┓┗┛]")


@dataclass(frozen=True)
class Step:
    """One command of a block."""

    line: int
    """Of the block, from 0."""
    command: str
    expected: tuple[str, ...]


def steps(text: str) -> list[Step]:
    """The commands of a block.

    Raises
    ------
    ValueError
        Text stands before the first command, or there is none.
    """
    found: list[Step] = []
    lines = text.splitlines()
    for number, line in enumerate(lines):
        if line.startswith("$ "):
            found.append(Step(number, line[2:].strip(), ()))
        elif found:
            last = found[-1]
            found[-1] = Step(last.line, last.command, (*last.expected, line))
        elif line.strip():
            raise ValueError(f"expected '$ ' and a command, got {line!r}")
    if not found:
        raise ValueError("expected '$ ' and a command, got nothing")
    return found


def lines_of(output: str) -> list[str]:
    """Lines with something in them, frames of tables taken off and blanks made one."""
    plain = (" ".join(FRAME.sub(" ", line).split()) for line in output.splitlines())
    return [line for line in plain if line]


def is_number_like(expected: str, got: str) -> bool:
    """Whether two numbers differ by no more than `RELATIVE`, or one of the last digit shown."""
    want, have = (float(text.replace(",", "").replace("−", "-")) for text in (expected, got))
    mantissa, _, exponent = expected.partition("e")
    decimals = len(mantissa.partition(".")[2])
    last = 10.0 ** (int(exponent or 0) - decimals)
    return abs(want - have) <= max(RELATIVE * abs(want), last * (1.0 + 1e-9))


def is_line_like(expected: str, got: str) -> bool:
    """Whether a line of output says what was expected."""
    expected, got = (_without_times(line) for line in (expected, got))
    numbers = NUMBER.findall(expected)
    pattern = NUMBER.sub("\x00", expected)
    pattern = re.escape(pattern).replace(re.escape("..."), ".*")
    pattern = pattern.replace(re.escape("\x00"), f"({NUMBER.pattern})")
    found = re.fullmatch(pattern, got)
    return found is not None and all(
        is_number_like(want, have) for want, have in zip(numbers, found.groups(), strict=True)
    )


def _without_times(line: str) -> str:
    return PATH.sub("‹path›", TIME.sub(lambda m: f"‹time› {m[1] or m[2]}", line))


def difference(expected: tuple[str, ...], output: str) -> str:
    """The first expected line that is not there, beside what is; empty if all are."""
    want, have = lines_of("\n".join(expected)), lines_of(output)
    if not want:
        return ""
    at, may_skip = 0, False
    for line in want:
        if line == "...":
            may_skip = True
            continue
        ends = len(have) if may_skip else min(at + 1, len(have))
        place = next((k for k in range(at, ends) if is_line_like(line, have[k])), None)
        if place is None:
            rest = "\n".join(f"    {one}" for one in have[at : at + 60]) or "    nothing"
            return f"expected\n    {line}\ngot\n{rest}"
        at, may_skip = place + 1, False
    if at < len(have) and not may_skip:
        return f"expected no more lines (write ...), got\n    {have[at]}"
    return ""
