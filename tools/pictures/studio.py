"""Take the picture of the studio that the README shows: `prototype`, pressed, in Chromium.

python tools/pictures/studio.py     writes docs/images/studio.png
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from studio_pages import studio_pages

PICTURE = Path(__file__).resolve().parents[2] / "docs" / "images" / "studio.png"
PRESS_AT = 0.64, 0.33
"""Share of the board from its left and from its top: 10 mm right and 25 mm up of its centre."""


def main() -> None:
    """Start a studio, press, wait for the scorecard."""
    with studio_pages("prototype") as opened:
        page = opened()
        page.get_by_label("energy").check()
        box = page.locator('[data-part="plate"]').bounding_box()
        assert box is not None
        page.mouse.move(
            *(
                begin + share * side
                for begin, share, side in zip(
                    (box["x"], box["y"]), PRESS_AT, (box["width"], box["height"]), strict=True
                )
            )
        )
        page.mouse.down()
        page.wait_for_selector("section[data-scored]")
        page.screenshot(path=PICTURE)


if __name__ == "__main__":
    main()
