"""Rules of the house (ARCHITECTURE.md) that neither import-linter nor a compiler checks."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

CORE = ROOT / "firmware" / "esp32" / "core"
CORE_SOURCES = sorted([*CORE.rglob("*.cpp"), *CORE.rglob("*.hpp")])
ROOMS = ("generated", "hal.hpp", "base", "synthesis", "table", "storage", "touch", "device", "link")
# What is there without an operating system.
FREESTANDING = {"array", "atomic", "cstdint", "cstddef", "limits", "type_traits"}


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_a_room_of_the_core_uses_only_those_before_it(path: Path) -> None:
    own = ROOMS.index(path.relative_to(CORE).parts[0])
    for room in re.findall(r'#include "core/([\w.]+)', path.read_text(encoding="utf-8")):
        assert ROOMS.index(room) <= own, f"{path.relative_to(CORE)} includes something of {room}"


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_core_includes_nothing_but_itself_and_freestanding_headers(path: Path) -> None:
    for header in re.findall(r'#include\s+[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8")):
        own = header.startswith("core/") and (ROOT / "firmware" / "esp32" / header).is_file()
        assert own or header in FREESTANDING, f"{path.name} includes {header}"


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_core_neither_allocates_nor_throws_nor_uses_floating_point(path: Path) -> None:
    text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
    text = re.sub(r'"[^"\n]*"', '""', text)
    for word in ("new", "delete", "malloc", "free", "throw", "try", "float", "double",
                 "dynamic_cast", "typeid"):  # fmt: skip
        assert not re.search(rf"\b{word}\b", text), f"{path.name} says {word}"


def test_generated_headers_are_up_to_date() -> None:
    script = ROOT / "tools" / "generate_headers.py"
    subprocess.run([sys.executable, str(script), "--check"], check=True)


def test_no_constant_is_generated_that_nothing_uses() -> None:
    """Named by its innermost namespace, by the alias `f` of that, or within its own header."""
    rooms = [ROOT / name for name in ("firmware", "tables/native", "bootloader_components")]
    sources = [path for room in rooms for path in room.rglob("*.[ch]*") if path.is_file()]
    text = "\n".join(
        path.read_text(encoding="utf-8") for path in sources if "generated" not in path.parts
    )
    counted = 0
    for header in sorted((CORE / "generated").glob("*.hpp")):
        lines = header.read_text(encoding="utf-8").splitlines()
        spaces: list[str] = []
        for line in lines:
            if opened := re.match(r"namespace ([\w:]+) \{", line):
                spaces.append(opened[1].rpartition("::")[2])
            elif line.startswith("}  // namespace"):
                spaces.pop()
            elif found := re.match(r"constexpr uint\d+_t (k\w+) =", line):
                counted += 1
                qualified = rf"\b(?:{spaces[-1]}|f)::{found[1]}\b"
                bare = rf"(?:\bchladni::|(?<!:)\b){found[1]}\b"
                is_used = re.search(bare if spaces[-1] == "chladni" else qualified, text)
                in_header = len(re.findall(bare, "\n".join(lines))) > 1
                assert is_used or in_header, f"{header.name}: {found[1]}"
    assert counted > 100


def test_emulator_and_platformio_build_the_same_core() -> None:
    """Both take every .cpp of core/ by pattern; the chip's list is checked by running it."""
    cmake = (ROOT / "firmware/esp32/emulator/CMakeLists.txt").read_text(encoding="utf-8")
    ini = (ROOT / "platformio.ini").read_text(encoding="utf-8")
    assert 'file(GLOB_RECURSE CORE CONFIGURE_DEPENDS "${FIRMWARE}/core/*.cpp")' in cmake
    assert "+<../core/>" in ini


def test_every_board_number_lives_in_board_files() -> None:
    """No number of the paper's board is in code."""
    for path in [*(ROOT / "sim").rglob("*.py"), *(ROOT / "tables").rglob("*.py"), *CORE_SOURCES]:
        text = path.read_text(encoding="utf-8")
        for number in ("71.5", "146.7", "24.25", "43.35", "25.75", "63.35"):
            for match in re.finditer(rf"(?<![\d.]){re.escape(number)}(?![\d.])", text):
                line = text[text.rfind("\n", 0, match.start()) + 1 : text.find("\n", match.end())]
                assert line.lstrip().startswith(("#", "//", '"""')), f"{path}: {line}"


@pytest.mark.parametrize("page", ["security.md", "reliability.md"])
def test_what_is_promised_names_tests_that_there_are(page: str) -> None:
    """Whole files of tests, or single ones."""
    promised = set(re.findall(r"`(test_\w+)`", (ROOT / "docs" / page).read_text()))
    files = list((ROOT / "tests").rglob("test_*.py"))
    known = {file.stem for file in files}
    known |= {
        name for file in files for name in re.findall(r"^def (test_\w+)", file.read_text(), re.M)
    }
    assert len(promised) > 5
    assert promised <= known, promised - known
