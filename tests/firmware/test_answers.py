"""An answer is written field by field as the link declares it; anything else does not compile."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from conftest import ROOT

REQUESTS = ROOT / "firmware" / "esp32" / "core" / "link" / "requests.cpp"
SLOT = "A::Slot{static_cast<uint8_t>(device_.slot())},"
UPTIME = "A::UptimeMs{device_.now_ms()},"
ERASES = "A::Erases{device_.erases()},"
NOTED = "A::Faults{device_.faults().count()},"


def compiles(text: str, folder: Path) -> bool:
    source = folder / "requests.cpp"
    source.write_text(text, encoding="utf-8")
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-fsyntax-only"]
    run = subprocess.run(
        ["g++", *flags, "-I", ROOT / "firmware" / "esp32", source], capture_output=True, check=False
    )
    return run.returncode == 0


@pytest.mark.parametrize(
    ("what", "instead"),
    [
        (SLOT, ""),  # left out, in the middle and at the end
        (ERASES, ""),
        (SLOT, SLOT + SLOT),  # twice
        (ERASES, ERASES + ERASES),
        (UPTIME, NOTED),  # one for another of the same width
        ("device_.now_ms()}", "uint64_t{device_.now_ms()}}"),  # wider than declared
    ],
)
def test_an_answer_with_other_fields_than_declared_does_not_compile(
    what: str, instead: str, tmp_path: Path
) -> None:
    text = REQUESTS.read_text(encoding="utf-8")
    assert text.count(what) == 1
    assert compiles(text, tmp_path)
    assert not compiles(text.replace(what, instead), tmp_path)


def test_two_fields_of_one_width_cannot_be_swapped(tmp_path: Path) -> None:
    text = REQUESTS.read_text(encoding="utf-8")
    assert UPTIME in text
    assert NOTED in text
    swapped = text.replace(UPTIME, "@").replace(NOTED, UPTIME).replace("@", NOTED)
    assert not compiles(swapped, tmp_path)
