"""The sample interrupt runs while flash cannot be read: everything it reaches lies in RAM."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest
from instruction_counts import PROCESSORS, Processor

from conftest import ROOT
from firmware.compiled import compiled_core

pytestmark = pytest.mark.usefixtures("cross_compilers")

FRAGMENT = ROOT / "firmware" / "esp32" / "components" / "chladni_core" / "linker.lf"
ENTRY = "chladni::SamplePlayer::sample("
"""What the interrupt's own function calls; `Device::sample` and the clock are inlined into it."""


def mapped() -> set[str]:
    """Objects that the linker fragment takes out of flash, code and constants."""
    return set(re.findall(r"^\s+(\w+) \(noflash\)$", FRAGMENT.read_text("utf-8"), re.MULTILINE))


def symbols(processor: Processor, path: Path) -> list[tuple[str, str]]:
    """(kind, name) of every symbol of an object."""
    nm = processor.compiler.replace("g++", "nm")
    run = subprocess.run([nm, "-C", str(path)], capture_output=True, text=True, check=True)
    return [(line[9], line[11:]) for line in run.stdout.splitlines() if len(line) > 11]


@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda processor: str(processor.name))
def test_what_the_interrupt_reaches_is_closed_and_lies_in_ram(
    processor: Processor, tmp_path_factory: pytest.TempPathFactory
) -> None:
    objects = {
        path.stem: symbols(processor, path) for path in compiled_core(processor, tmp_path_factory)
    }
    ours = mapped()
    assert ours == {"duty_ring", "sample_player"}
    defined = {
        name: obj
        for obj, found in objects.items()
        for kind, name in found
        if kind in "TtWwVvRrDdBb"
    }
    assert any(name.startswith(ENTRY) and defined[name] in ours for name in defined)
    # Whatever an object of ours needs, one of ours has: the compiler's helpers are not among them.
    needed = {name for obj in ours for kind, name in objects[obj] if kind == "U"}
    assert {name: defined.get(name) for name in needed if defined.get(name) not in ours} == {}
    # Of a weak symbol the linker takes any copy, also one from flash.
    weak = {name for obj in ours for kind, name in objects[obj] if kind in "WwVv"}
    shared = {
        name
        for obj, found in objects.items()
        if obj not in ours
        for _, name in found
        if name in weak
    }
    assert shared == set()
    # The sine's table is a constant of its own, which goes to DRAM with the object.
    assert any("kSineQuarter" in name for kind, name in objects["sample_player"] if kind == "r")
