"""What a measured board's file says of itself is checked, and shown."""

from __future__ import annotations

from pathlib import Path

import pytest

from calibration.small_board import small_board
from chladni.sim.board.writing import board_file
from conftest import CommandLine

MEASURED = """
[measured]
by = "coils"
date = "2026-11-26"

[[measured.values]]
name = "sheet thickness"
ratio = 1.02
low = 1.01
high = 1.03
by = "callipers"
date = "2026-11-20"

[[measured.values]]
name = "foam"
ratio = 2.5
low = 2.0
high = 3.0
"""


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_bytes(board_file(small_board()))
    return path


def test_each_value_has_its_origin(chladni: CommandLine, drawn: Path) -> None:
    """Its own one, or that of all."""
    drawn.write_text(drawn.read_text(encoding="utf-8") + MEASURED, encoding="utf-8")
    shown = chladni("board", "show", drawn, "--json").json["measured"]
    sheet, foam = shown["sheet thickness"], shown["foam"]
    assert (sheet["by"], sheet["date"]) == ("callipers", "2026-11-20")
    assert foam == {"ratio": 2.5, "low": 2.0, "high": 3.0, "by": "coils", "date": "2026-11-26"}
    said = " ".join(chladni("board", "show", drawn).out.replace("│", " ").split())
    assert "2.5 (2 to 3) by coils" in said


@pytest.mark.parametrize(
    ("block", "said"),
    [
        ('by = ""\ndate = "2026-11-26"', "measured.by"),
        ('by = "coils"\ndate = "26.11.2026"', "measured.date"),
        (
            'by = "coils"\ndate = "2026-11-26"\n[[measured.values]]\nname = "foam"\n'
            "ratio = 3.0\nlow = 1.0\nhigh = 2.0",
            "measured.values[0].ratio",
        ),
        (
            'by = "coils"\ndate = "2026-11-26"\n[[measured.values]]\nname = "sheet thickness"\n'
            'ratio = 1.0\nlow = 0.9\nhigh = 1.1\nby = "callipers"\ndate = "today"',
            "measured.values[0].date",
        ),
    ],
)
def test_what_was_measured_is_checked(
    chladni: CommandLine, drawn: Path, block: str, said: str
) -> None:
    drawn.write_text(
        drawn.read_text(encoding="utf-8") + f"\n[measured]\n{block}\n", encoding="utf-8"
    )
    refused = chladni("board", "show", drawn)
    assert refused.code == 2
    assert said in refused.err


@pytest.mark.parametrize(
    ("patches", "said"),
    [
        ("[[foundation.patches]]\nat_mm = [99, 0]\nratio = 2.0", "foundation.patches[0].at_mm"),
        ("[[foundation.patches]]\nat_mm = [0, 0]\nratio = 0.0", "foundation.patches[0].ratio"),
        ("[[foundation.patches]]\nat_mm = [1, 0]\nratio = 2.0\n"
         "[[foundation.patches]]\nat_mm = [1, 0]\nratio = 1.0", "a place of its own"),
    ],
)  # fmt: skip
def test_patches_are_checked(chladni: CommandLine, drawn: Path, patches: str, said: str) -> None:
    drawn.write_text(drawn.read_text(encoding="utf-8") + f"\n{patches}\n", encoding="utf-8")
    refused = chladni("board", "show", drawn)
    assert refused.code == 2
    assert said in refused.err
