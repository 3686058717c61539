"""Run benches, and write docs/performance.md with the rows of each that matter.

    .venv/bin/python bench/page.py NAME …     runs bench/NAME.py into docs/performance/NAME.md;
                                              "NAME OPTION …" with options
    .venv/bin/python bench/page.py            writes the page alone, from what was printed before

bench/page.md is the page with lines `@ NAME, TABLE, PATTERN` in it. Such a line becomes the rows of
NAME's table of that number, from 1, in which the pattern is found; one that finds none is an error.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
DOCS = HERE.parent / "docs"
DATA = DOCS / "performance"
ASKED = re.compile(r"^@ (?P<name>\w+), (?P<table>\d+), (?P<pattern>.+)$")
ROWS = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)


def run(command: str) -> None:
    """Run one bench, `NAME OPTION …`, and keep what it prints."""
    name, *options = command.split()
    bench = [sys.executable, HERE / f"{name}.py", *options]
    done = subprocess.run(bench, stdout=subprocess.PIPE, text=True, check=True)
    title = re.search(r"^## (.*?)(?::.*)?$", done.stdout, re.MULTILINE)
    head = (
        f"# {title[1] if title else name}: all rows\n\n"
        f"Written by `bench/{name}.py` for [performance](../performance.md).\n\n"
    )
    (DATA / f"{name}.md").write_text(head + done.stdout.strip() + "\n", encoding="utf-8")


def selected(name: str, table: int, pattern: str) -> str:
    """Head and rows of a table that a bench has printed."""
    tables = ROWS.findall((DATA / f"{name}.md").read_text(encoding="utf-8"))
    head, rule, *rows = tables[table - 1].splitlines()
    found = [row for row in rows if re.search(pattern, row)]
    if not found:
        sys.exit(f"bench/page.md: no row of {name}'s table {table} has {pattern!r}")
    return "\n".join((head, rule, *found))


def page() -> str:
    """docs/performance.md."""
    lines = []
    for line in (HERE / "page.md").read_text(encoding="utf-8").splitlines():
        asked = ASKED.match(line)
        lines.append(
            selected(asked["name"], int(asked["table"]), asked["pattern"]) if asked else line
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    for bench in sys.argv[1:]:
        run(bench)
    (DOCS / "performance.md").write_text(page(), encoding="utf-8")
