"""The core on an emulated Xtensa and RISC-V: the same drives and duties, in few instructions."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from effect_instructions import count_effects
from instruction_counts import PROCESSORS, Processor, count, count_writes
from stack_depth import PROCESSOR as RISC_V
from stack_depth import depths

from chladni.tables.format import pack
from chladni.tables.layout import BITS
from chladni.tables.mirror_symmetry import MirrorSymmetry
from firmware.compiled import compiled_core, compiled_core_here
from made_up import random_table, reversal

pytestmark = pytest.mark.usefixtures("cross_compilers")

MOST_PER_LOOKUP, MOST_PER_CHANNEL = 600, 85
"""Of five channels, and of each further one."""
MOST_RAM = 64 * 1024
"""Half of it is what drives are found in for ten fingers, five of which play."""
MOST_PER_SAMPLE = {
    "sine_steady": 240,
    "sine_ramping": 305,
    "others_steady": 420,
    "others_ramping": 420,
    "with_news": 1000,
}
"""Of five channels, with switches or bridges. A sample has 12,288 cycles."""
MOST_PER_TURN = 9_000
"""Of the main loop, meter, heat and supply with it, where division is an instruction (RISC-V)."""
MORE_PER_BRIDGE, MORE_OF_OTHERS = 4, 6
"""Instructions for each channel whose current does not turn, writes included: of sines, and of
other waves."""
MORE_ON_AVERAGE = 7
"""Of a small sine, with those that turn."""
MORE_OF_TURNING = 50
"""For each channel whose current turns in a sample: twice in a wave."""
MOST_OF_VOICES = {
    5: {"1": 240, "2": 420, "ramping": 960, "with_news": 2510},
    16: {"1": 560, "2": 900, "ramping": 2350, "with_news": 6260},
}
"""By channels; ramps and news of five voices, all of which begin or end at once."""
MOST_PER_VOICE = {5: 103, 16: 230}
"""Of the third voice and each further one."""
MOST_PER_EFFECT = {"tone": 165, "click": 190, "noise": 105, "clip": 115}
"""Of a sample of the signal, which stands for eight of the interrupt's at 10 bits: 24 of those."""
MOST_PER_WRITES, MOST_PER_BRIDGE_WRITES = 105, 112
"""Of five duties, by the chip layer."""


@pytest.fixture(scope="module", params=PROCESSORS, ids=lambda processor: str(processor.name))
def built(
    request: pytest.FixtureRequest, cross_compilers: None, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Processor, list[Path]]:
    """A processor, and the core compiled for it."""
    return request.param, compiled_core(request.param, tmp_path_factory)


@pytest.fixture(scope="module")
def built_here(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The core compiled for this machine."""
    return compiled_core_here(tmp_path_factory)


def test_a_built_table_is_read_and_looked_up_alike_and_in_time(
    built: tuple[Processor, list[Path]], built_here: list[Path], table_file: Path
) -> None:
    processor, core = built
    found = count(processor, table_file, core=core, core_here=built_here)
    assert found.lookup_most <= MOST_PER_LOOKUP
    assert sum(found.ram.values()) <= MOST_RAM
    if processor.prefix == "riscv":
        assert found.turn is not None
        assert 0 < found.turn <= MOST_PER_TURN
    for name, most in MOST_PER_SAMPLE.items():
        assert 0 < getattr(found, name) <= most, name
        more = MORE_OF_TURNING if name == "with_news" else MORE_PER_BRIDGE
        assert 0 < found.bridges[name] <= most + 5 * more, name
    writes = count_writes(processor)
    more_writes = writes["bridge_writes"] - writes["writes"]
    for name in ("sine_steady", "sine_ramping", "others_steady", "others_ramping"):
        more = MORE_PER_BRIDGE if name.startswith("sine") else MORE_OF_OTHERS
        assert found.bridges[name] - getattr(found, name) + more_writes <= 5 * more, name
    for name in ("sine", "others"):
        most = found.bridges[f"{name}_ramping"] + 5 * MORE_OF_TURNING
        assert 0 < found.bridges[f"{name}_turning"] <= most, name
    assert found.sine_mean is not None
    switches, bridges = found.sine_mean
    assert bridges - switches + more_writes <= 5 * MORE_ON_AVERAGE


@pytest.mark.parametrize("channels", [5, 16])
def test_one_more_voice_costs_what_the_documentation_says(
    built: tuple[Processor, list[Path]], built_here: list[Path], tmp_path: Path, channels: int
) -> None:
    processor, core = built
    path = tmp_path / "t.chl"
    path.write_bytes(pack(random_table(2, 2, channels, 0)))
    found = count(processor, path, core=core, core_here=built_here, only="voices").voices
    for name, most in MOST_OF_VOICES[channels].items():
        assert 0 < found[name] <= most, name
    for number in (3, 4, 5):
        more = found[str(number)] - found[str(number - 1)]
        assert 0 < more <= MOST_PER_VOICE[channels]
    # In place of the fifth tone; a few in the sample that takes up the next one pushed.
    assert found["4"] < found["signal"] <= found["5"] + 3


@pytest.mark.parametrize("processor", PROCESSORS, ids=lambda processor: str(processor.name))
def test_the_chip_layer_writes_duties_and_signs_in_few_instructions(processor: Processor) -> None:
    found = count_writes(processor)
    assert 0 < found["writes"] <= MOST_PER_WRITES
    assert 0 < found["bridge_writes"] <= MOST_PER_BRIDGE_WRITES
    # The last of 0 to 400 steps, in sixteenths, and with bridges all signs high.
    for begins, high in (("", 0), ("bridge_", sum(1 << pin for pin in (18, 19, 23, 25, 26)))):
        assert found[f"{begins}last_duty"] == 400 << 4
        assert (found[f"{begins}high"], found[f"{begins}low"]) == (high, 0)


def test_a_sample_of_an_effect_is_made_alike_and_in_few_instructions() -> None:
    """In the main loop, the low-pass with it."""
    found = count_effects()
    assert list(found) == list(MOST_PER_EFFECT)
    for name, most in MOST_PER_EFFECT.items():
        assert 0 < found[name] <= most, name


def test_stacks_stay_as_small_as_the_documentation_says(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    """docs/hardware.md; the compiler's own frames, the deepest chain of calls."""
    folder = compiled_core(RISC_V, tmp_path_factory)[0].parent
    found = {what: size for what, (size, _) in depths(folder).items()}
    assert found["sample interrupt"] <= 256
    assert max(found.values()) <= 1872


def test_cuts_and_mirrors_everywhere_cost_a_lookup_no_more(
    built: tuple[Processor, list[Path]], tmp_path: Path
) -> None:
    """The worst there is: labels at random, so that nearly every place lies at a cut."""
    processor, core = built
    path = tmp_path / "t.chl"
    for bits, channels in product(BITS, (5, 16)):
        order = reversal(channels)
        table = random_table(
            14, 29, channels, 0, labels=4, bits=bits, symmetry=MirrorSymmetry(order, order)
        )
        path.write_bytes(pack(table))
        most = MOST_PER_LOOKUP + (channels - 5) * MOST_PER_CHANNEL
        assert count(processor, path, core=core, only="lookups").lookup_most <= most
