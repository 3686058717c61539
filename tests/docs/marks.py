"""Comments above blocks: what does not run, why, and what is tried in its place.

    <!-- not run: needs a chip; tests/device and `make dist` stand in -->
    <!-- not run (chladni studio, chladni design): one serves a page; tests/studio stands in -->
    <!-- an emulated device stands in for /dev/ttyUSB0 -->
    <!-- an emulated strip5 stands in for /dev/ttyUSB0 -->
    <!-- first: chladni table build strip5 -o board.chl -->
    <!-- each line alone, in [plate] -->
    <!-- goes into my.toml -->

What stands in is one or more of: a path of the repository, a `make` target, `pio`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

from make_targets import targets

NOT_RUN = re.compile(r"not run(?: \((?P<only>[^)]+)\))?: (?P<why>[^;]+); (?P<what>.+) stands? in")
PORT = re.compile(r"an emulated (?P<board>\w+) stands in for (?P<port>\S+)")
FIRST = re.compile(r"first: (?P<commands>.+)")
GOES = re.compile(r"goes into (?P<file>\S+)")
EACH = re.compile(r"each line alone, in \[(?P<table>\w+)\]")


@dataclass(frozen=True)
class Mark:
    """What a comment asks of the block below it."""

    only: tuple[str, ...] = ()
    """Beginnings of commands that do not run; with `why` and without these, none does."""
    why: str = ""
    stands_in: tuple[str, ...] = ()
    port: str = ""
    board: str = ""
    """That the device at the port is for; empty for any."""
    first: tuple[str, ...] = ()
    table: str = ""
    file: str = ""
    unread: str = ""
    """A comment that begins as one that leaves commands out, and does not go on like one."""

    def leaves_out(self, command: str) -> bool:
        """Whether a command does not run."""
        return bool(self.why) and (not self.only or command.startswith(self.only))


def read_marks(comments: tuple[str, ...]) -> Mark:
    """What comments ask for; nothing, if they are any others."""
    mark = Mark()
    for comment in comments:
        if found := NOT_RUN.fullmatch(comment):
            only = tuple(part.strip() for part in (found["only"] or "").split(",") if part.strip())
            stands_in = tuple(re.split(r", | and ", found["what"].replace("`", "")))
            mark = replace(mark, only=only, why=found["why"], stands_in=stands_in)
        elif found := PORT.fullmatch(comment):
            board = "" if found["board"] == "device" else found["board"]
            mark = replace(mark, port=found["port"], board=board)
        elif found := FIRST.fullmatch(comment):
            mark = replace(mark, first=tuple(one.strip() for one in found["commands"].split("&&")))
        elif found := EACH.fullmatch(comment):
            mark = replace(mark, table=found["table"])
        elif found := GOES.fullmatch(comment):
            mark = replace(mark, file=found["file"])
        elif comment.startswith("not run"):
            mark = replace(mark, unread=comment)
    return mark


def problem(mark: Mark, root: Path) -> str:
    """What is wrong with a mark: something that stands in and is not there."""
    if mark.unread:
        return f"{mark.unread!r}: expected 'not run (COMMANDS): WHY; WHAT stands in'"
    known = {f"make {name}" for name in targets((root / "Makefile").read_text("utf-8"))}
    for name in mark.stands_in:
        is_target = name in known
        if not (is_target or name == "pio" or (root / name).exists()):
            return f"{name} is said to stand in, and is not there"
    return ""
