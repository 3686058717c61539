"""What a release goes by: one version everywhere, dated notes, and workflow files that fit."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from release import faults_of, notes_of

from chladni.drives.objectives import default_objective
from chladni.drives.solve import solve
from chladni.sim.board.file import load_board
from conftest import ROOT

WORKFLOWS = ROOT / ".github" / "workflows"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_version_is_the_same_everywhere_and_has_dated_notes(tmp_path: Path) -> None:
    notes = tmp_path / "notes.md"
    tool = [sys.executable, str(ROOT / "tools" / "release.py"), "--notes", str(notes), "--tag"]
    subprocess.run([*tool, f"v{PROJECT['version']}"], check=True)
    assert notes.read_text(encoding="utf-8").count("### ") >= 1
    notes.unlink()
    wrong = subprocess.run([*tool, "v9.9.9"], capture_output=True, text=True, check=False)
    assert (wrong.returncode, "pyproject.toml" in wrong.stderr) == (1, True)
    assert not notes.exists()


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("pyproject.toml", 'version = "', 'version = "1.'),
        ("CITATION.cff", 'version: "', 'version: "1.'),
        ("CHANGELOG.md", f"## {PROJECT['version']} – ", f"## {PROJECT['version']} "),
        ("CHANGELOG.md", "# Changelog\n", "# Changelog\n\n## Unreleased\n"),
    ],
)
def test_a_version_that_is_forgotten_somewhere_is_found(
    tmp_path: Path, file: str, old: str, new: str
) -> None:
    for name in ("pyproject.toml", "CITATION.cff", "CHANGELOG.md"):
        shutil.copy(ROOT / name, tmp_path / name)
    tag = f"v{PROJECT['version']}"
    assert faults_of(tag, tmp_path) == []
    text = (tmp_path / file).read_text(encoding="utf-8")
    (tmp_path / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    assert faults_of(tag, tmp_path)[0].startswith(f"{file}: expected")


def test_notes_end_where_the_version_before_begins() -> None:
    text = "# Changelog\n\n## 0.2.0 – 2026-01-02\n\nnew\n\n## 0.1.0 – 2025-01-02\n\nold\n"
    assert notes_of(text, "0.2.0") == "new\n"
    assert notes_of(text, "0.1.0") == "old\n"
    assert notes_of(text, "0.3.0") is None


def steps(workflow: str) -> list[dict[str, Any]]:
    document = yaml.safe_load((WORKFLOWS / workflow).read_text(encoding="utf-8"))
    return [step for job in document["jobs"].values() for step in job.get("steps", ())]


def test_workflows_do_what_the_repository_has() -> None:
    """They cannot run here. What they name is there, pinned alike, and at the same offsets."""
    assert any(step.get("run") == ".ci/run" for step in steps("checks.yml"))
    runs = [str(step["run"]) for step in steps("release.yml") if "run" in step]
    (pinned,) = (one for one in PROJECT["optional-dependencies"]["dev"] if "platformio" in one)
    assert any(pinned in run for run in runs)
    assert any("pio run -e esp32" in run for run in runs)
    assert "[env:esp32]" in (ROOT / "platformio.ini").read_text(encoding="utf-8")
    (merge,) = (run for run in runs if "merge-bin" in run)
    partitions = (ROOT / "firmware/esp32/chip/partitions.csv").read_text(encoding="utf-8")
    found = re.search(r"^factory,\s*app,\s*factory,\s*(0x[0-9a-f]+)", partitions, re.MULTILINE)
    assert found is not None
    assert f"{found[1]} .pio/build/esp32/firmware.bin" in merge
    # Where an ESP32's ROM looks for the boot loader, and where ESP-IDF has the partition table.
    assert "0x1000 .pio/build/esp32/bootloader.bin" in merge
    assert "0x8000 .pio/build/esp32/partitions.bin" in merge


def test_every_tool_that_a_workflow_calls_is_there() -> None:
    for workflow in WORKFLOWS.glob("*.yml"):
        for name in re.findall(r"\btools/\w+\.py", workflow.read_text(encoding="utf-8")):
            assert (ROOT / name).is_file(), name


def test_a_board_file_of_the_version_before_is_read_as_it_was() -> None:
    """The first one that was ever written; it knows nothing of coils, panels or fingers."""
    old, new = load_board(ROOT / "tests" / "prototype-0.1.0.toml"), load_board("prototype")
    assert old.plate.size == new.plate.size
    assert [one.at for one in old.actuators] == [one.at for one in new.actuators]
    assert (old.coil, old.panel, old.focus, old.foundation) == (None, None, None, None)
    assert default_objective(old) == "ssim"
    # Its corners are square, which moves the plate 20 mm from them by a hundredth.
    assert solve(old, (10.0, 25.0)).ssim == pytest.approx(solve(new, (10.0, 25.0)).ssim, abs=0.01)
