"""Draw two fingers on `phone5`, each of which plays while the other rests.

    python tools/pictures/two_fingers.py     writes docs/images/two-fingers.png

The chain is the whole one: table of responses, emulated firmware, duties, plate with both fingers.
"""

from __future__ import annotations

from pathlib import Path

from chladni.host.cli.whole_chain import play_two_fingers
from chladni.host.figures.fields import save
from chladni.host.figures.two_fingers import two_fingers_figure

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "two-fingers.png"

if __name__ == "__main__":
    save(two_fingers_figure([play_two_fingers("phone5")]), PICTURE)
