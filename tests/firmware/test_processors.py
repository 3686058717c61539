"""The core on an emulated Xtensa and RISC-V: the same drives and duties, in few instructions."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from instruction_counts import PROCESSORS, Processor, count, missing
from stack_depth import depths

from chladni.tables.build import TableReport
from chladni.tables.coding import Predictor, visits
from chladni.tables.folding import UNFOLDED, Folding
from chladni.tables.format import pack
from chladni.tables.table import Table
from made_up import random_table

MOST_PER_LOOKUP = 350
WAVES, STEP = 5.3, 1024.0
MOST_TO_LOAD = 480_000
"""2 ms at 240 MHz, an instruction per cycle."""
MOST_PER_SAMPLE = {
    "sine_steady": 210, "sine_ramping": 260, "others_steady": 420, "others_ramping": 420,
    "with_news": 1000,
}  # fmt: skip
"""Of five channels. A sample has 12,288 cycles."""


@pytest.fixture(autouse=True)
def cross_compilers() -> None:
    """`.ci/run` installs them and insists; elsewhere these tests are left out without."""
    if not missing():
        return
    if os.environ.get("CHLADNI_REQUIRE_CROSS") == "1":
        pytest.fail(f"not installed: {', '.join(missing())}")
    pytest.skip(f"not installed: {', '.join(missing())}")


@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda processor: str(processor.name))
def test_a_built_table_is_decoded_and_looked_up_alike_and_in_time(
    processor: Processor, coarse_table: tuple[Table, TableReport], tmp_path: Path
) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(coarse_table[0]))
    found = count(processor, path)
    assert found.load <= MOST_TO_LOAD
    assert found.lookup_most <= MOST_PER_LOOKUP
    for name, most in MOST_PER_SAMPLE.items():
        assert 0 < getattr(found, name) <= most, name


@pytest.fixture
def fine_table(tmp_path: Path) -> Path:
    """As large as a default table of `prototype` at 2 mm: 666 stored regions, 1.5 KB.

    Drives as smooth as those and in as coarse steps, so that six of ten regions are coded.
    """
    folding = Folding((0, 2, 1, 4, 3), (0, 3, 4, 1, 2))
    x, y = np.meshgrid(np.arange(18) / 18.0, np.arange(37) / 37.0)
    rng = np.random.default_rng(8)
    waves = rng.uniform(-WAVES, WAVES, (10, 2)), rng.uniform(0.0, 6.0, 10)
    smooth = np.array([
        np.cos(along @ (x.ravel(), y.ravel()) + phase) for along, phase in zip(*waves, strict=True)
    ])  # fmt: skip
    labels = np.digitize(np.arange(666) // 18, [9, 18, 27]).astype(np.uint8)
    predictor = Predictor(labels, 10)
    for visit in visits(18, 37):
        expected = predictor.predict(visit)
        steps = np.rint((smooth[:, visit.at] * 22000.0 - expected) / STEP)
        predictor.put(visit, expected + (steps * STEP).astype(np.int64))
    table = random_table(36, 73, 5, 0, labels=4, folding=folding)
    section = replace(
        table.section(),
        iq=predictor.values.reshape(666, 5, 2).astype(np.int16),
        labels=labels,
        crossings=np.ones((4, 2), np.uint8),
    )
    data = pack(replace(table, sections=(section,)))
    assert 1300 <= len(data) <= 1700
    path = tmp_path / "t.chl"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda processor: str(processor.name))
def test_a_table_of_2_mm_is_loaded_in_time(processor: Processor, fine_table: Path) -> None:
    """Checked, decoded and ready, six times the regions of the default pitch."""
    found = count(processor, fine_table)
    assert found.load <= MOST_TO_LOAD
    assert found.lookup_most <= MOST_PER_LOOKUP


def test_stacks_stay_as_small_as_the_documentation_says() -> None:
    """docs/hardware.md; the compiler's own frames, the deepest chain of calls."""
    found = {what: size for what, (size, _) in depths().items()}
    assert found["sample interrupt"] <= 256
    assert max(found.values()) <= 1536


@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda processor: str(processor.name))
@pytest.mark.parametrize("folding", [UNFOLDED, Folding((0, 2, 1, 4, 3), (0, 3, 4, 1, 2))])
def test_cuts_everywhere_cost_a_lookup_no_more(
    processor: Processor, folding: Folding, tmp_path: Path
) -> None:
    """The worst there is: labels at random, so that nearly every place lies at a cut."""
    table = random_table(14, 29, 5, 0, labels=4, coarse=9, folding=folding)
    path = tmp_path / "t.chl"
    path.write_bytes(pack(table))
    assert count(processor, path).lookup_most <= MOST_PER_LOOKUP
