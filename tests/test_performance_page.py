"""docs/performance.md is what bench/page.md asks for, of what the benches have printed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from conftest import ROOT

PAGE = "docs/performance.md"


def written(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, folder / "bench" / "page.py"], capture_output=True, text=True, check=False
    )


def copied(folder: Path) -> Path:
    for name in (
        "bench/page.py",
        "bench/page.md",
        *(f"docs/performance/{file.name}" for file in (ROOT / "docs/performance").glob("*.md")),
    ):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes((ROOT / name).read_bytes())
    return folder


def test_the_page_has_the_rows_that_its_benches_printed(tmp_path: Path) -> None:
    assert written(copied(tmp_path)).returncode == 0
    assert (tmp_path / PAGE).read_text("utf-8") == (ROOT / PAGE).read_text("utf-8")


def test_a_row_that_no_bench_prints_any_more_is_an_error(tmp_path: Path) -> None:
    data = copied(tmp_path) / "docs/performance/solve.md"
    text = re.sub(r"^\|.*\n", "", data.read_text("utf-8"), flags=re.MULTILINE)
    data.write_text(text + "\n| method |\n|---|\n| a |\n" * 2, encoding="utf-8")
    asked = tmp_path / "bench/page.md"
    asked.write_text(asked.read_text("utf-8").replace("solve, 2, .", "solve, 2, phasor"), "utf-8")
    answer = written(tmp_path)
    assert "no row of solve" in answer.stderr, answer.stderr
    assert answer.returncode == 1
    assert not (tmp_path / PAGE).exists()
