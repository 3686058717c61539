"""Draw the paper's figures from our own models, and write docs/paper.md.

cd tools && python -m paper           draws all, writes the page; two minutes
cd tools && python -m paper --check   exits with 1 if the page differs in what is found in seconds
"""

from __future__ import annotations

import argparse
import sys
import time

from paper import (
    cost,
    figure_2,
    figure_3a,
    figure_3b,
    figure_3c,
    figure_3d,
    figure_4_5c,
    figure_5,
)
from paper.numbers import Numbers
from paper.page import IMAGES, PAGE, differences, filled

QUICK = (figure_2, figure_3a, figure_3b, figure_3c, figure_3d, figure_5)


def quick_numbers() -> Numbers:
    """All but those of the annealings and of the machine."""
    found = cost.numbers()
    for topic in QUICK:
        found |= topic.numbers()
    return found


def main() -> int:
    """Draw and write, or check."""
    parser = argparse.ArgumentParser(prog="paper", description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare the page, draw nothing")
    if parser.parse_args().check:
        wrong = differences(PAGE.read_text(encoding="utf-8"), quick_numbers())
        for line in wrong:
            print(f"docs/paper.md: {line}; make paper", file=sys.stderr)
        return 1 if wrong else 0
    numbers = cost.measured()
    for topic in (*QUICK, figure_4_5c):
        begun = time.perf_counter()
        print(f"{topic.__name__.removeprefix('paper.')} …", end=" ", flush=True)
        topic.draw(IMAGES)
        numbers |= topic.numbers()
        print(f"{time.perf_counter() - begun:.0f} s", flush=True)
    numbers |= cost.numbers()
    PAGE.write_text(filled(numbers), encoding="utf-8")
    print(PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
