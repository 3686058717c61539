"""Count the instructions of an effect's samples.

    python tools/effect_instructions.py

On a RISC-V with a floating-point unit, as `finger_instructions.py` has it. Both processors must
make the samples that this machine makes.
"""

from __future__ import annotations

import sys

from finger_instructions import WITH_UNIT, said_here, said_there
from instruction_counts import FIRMWARE, HERE, missing

from chladni.sim.errors import ChladniError

CORE = FIRMWARE / "core"
SOURCES = (
    HERE / "effects.cpp",
    CORE / "effects/effect_player.cpp",
    CORE / "effects/bank.cpp",
    CORE / "base/crc32.cpp",
)
MOST_DIFFERENCE = 2
"""Of samples in 1/32768, where one fuses what another rounds twice."""


def count_effects() -> dict[str, int]:
    """Instructions a sample, its low-pass with it, by the kind of part.

    Raises
    ------
    ChladniError
        The processor makes other samples than this machine.
    """
    said, here = said_there(WITH_UNIT, SOURCES), said_here(SOURCES)
    made, expected = ([value for name, value in one if name == "sample"] for one in (said, here))
    if any(abs(a - b) > MOST_DIFFERENCE for a, b in zip(made, expected, strict=True)):
        raise ChladniError(f"{WITH_UNIT.name}: other samples than on this machine")
    return {
        name: round(value / WITH_UNIT.per_instruction) for name, value in said if name != "sample"
    }


def main() -> int:
    """Print a row per kind."""
    if missing():
        print(f"not installed: {', '.join(missing())}", file=sys.stderr)
        return 1
    for name, count in count_effects().items():
        print(f"{WITH_UNIT.name}, {name}: {count} instructions a sample")
    return 0


if __name__ == "__main__":
    sys.exit(main())
