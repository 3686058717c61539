"""The core compiled for another processor, once in a run."""

from __future__ import annotations

from pathlib import Path

import pytest
from instruction_counts import Processor, compile_core, compile_core_here

from conftest import built_once


def compiled_core(processor: Processor, factory: pytest.TempPathFactory) -> list[Path]:
    """The core's objects for a processor."""
    folder = built_once(
        factory, f"core-{processor.prefix}", lambda folder: compile_core(processor, folder)
    )
    return sorted(folder.glob("*.o"))


def compiled_core_here(factory: pytest.TempPathFactory) -> list[Path]:
    """The core's objects for this machine, as the other processors' programs have it."""
    folder = built_once(factory, "core-here", compile_core_here)
    return sorted(folder.glob("*.o"))
