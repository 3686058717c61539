"""What the chip's layer does while flash cannot be read lies in IRAM, seen in its object files.

ESP-IDF's own functions are the fake's here, so their places are not judged; a linked map would show
them too.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from chladni.sim.board.electronics import ChipName
from chladni.sim.board.gpio import CHIPS
from conftest import built_once
from firmware.chip_process import chip_sources, includes

MARKED = re.compile(r"IRAM_ATTR (\w+)\(")
"""A function that its source puts into IRAM."""
REACHED = {
    "start_together",
    "pwm_set_duties",
    "pwm_position",
    "cut_outputs",
    "on_alarm",
    "set_duties",
}
"""What the interrupt and the last resort run, and what two timers start together by."""


@pytest.fixture(scope="module", params=CHIPS)
def objects(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """chip/ as the chip's compiler would inline it: optimised."""
    chip: ChipName = request.param

    def build(folder: Path) -> None:
        include = includes(folder, chip)
        for source in chip_sources(chip):
            made = folder / f"{source.stem}.o"
            command = ["g++", "-std=c++17", "-O2", "-c", str(source), "-o", str(made), *include]
            subprocess.run(command, check=True)

    return sorted(built_once(tmp_path_factory, f"iram-{chip}", build).glob("*.o"))


def dump(option: str, path: Path) -> str:
    run = subprocess.run(
        ["objdump", "-C", option, path], capture_output=True, text=True, check=True
    )
    return run.stdout.replace("(anonymous namespace)::", "")


def functions(path: Path) -> dict[str, str]:
    """Section of every function of an object, by its bare name."""
    rows = re.findall(r"^\S+ .{6}F (\S+)\s+\S+\s+(.+)$", dump("-t", path), re.MULTILINE)
    return {name.partition("(")[0].split("::")[-1]: section for section, name in rows}


def test_functions_marked_for_iram_are_functions_of_it(objects: list[Path]) -> None:
    """None was inlined into a caller that lies in flash, as one with a single caller would be."""
    marked = {name for path in chip_sources() for name in MARKED.findall(path.read_text("utf-8"))}
    assert marked >= REACHED
    found = {name: place for path in objects for name, place in functions(path).items()}
    assert {name: found.get(name) for name in marked} == dict.fromkeys(marked, ".iram1")


def test_what_lies_in_iram_calls_nothing_of_ours_in_flash(objects: list[Path]) -> None:
    places = [functions(path) for path in objects]
    ours_in_flash = {name for own in places for name, section in own.items() if section == ".text"}
    assert "app_main" in ours_in_flash
    for path in objects:
        if ".iram1" not in functions(path).values():
            continue
        code = dump("-drj.iram1", path)
        called = {
            name.split("::")[-1] for name in re.findall(r"R_X86_64_P\S+\s+([\w:{}() ]*\w)", code)
        }
        assert not called & ours_in_flash, path.stem
