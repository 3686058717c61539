"""What tests do on the studio's page, and read from it."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Page

from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM

Place = tuple[float, float]
RULES = {"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]}
"""What axe looks at."""


def point_of(page: Page, board: Board, place_mm: Place, view: int = 0) -> Place:
    """Where a place of the board is on the screen."""
    plate = page.locator('[data-part="plate"]').nth(view)
    plate.scroll_into_view_if_needed()
    box = plate.bounding_box()
    assert box is not None
    width, length = (side / MM for side in board.plate.size)
    return (
        box["x"] + (place_mm[0] / width + 0.5) * box["width"],
        box["y"] + (0.5 - place_mm[1] / length) * box["height"],
    )


def place_shown(page: Page) -> Place:
    """The finger's place, as its mark has it."""
    return mark(page, "finger")


def mark(page: Page, name: str, view: int = 0) -> Place:
    own = page.locator(f".place-{name}").nth(view)
    assert own.get_attribute("visibility") == "visible"
    x, y = own.get_attribute("data-x-mm"), own.get_attribute("data-y-mm")
    assert x is not None
    assert y is not None
    return float(x), float(y)


def settle(page: Page, view: int = 0) -> None:
    """Wait until every touch so far is played, and the last one scored."""
    page.locator('[data-part="numbers"][aria-busy="false"]').nth(view).wait_for()


def press(page: Page, board: Board, place_mm: Place, view: int = 0) -> None:
    """Press with the mouse, and wait for the scorecard."""
    page.mouse.move(*point_of(page, board, place_mm, view))
    page.mouse.down()
    settle(page, view)


def frames(page: Page, count: int) -> None:
    """Wait for so many of the browser's frames."""
    page.evaluate(
        "count => new Promise(done => { const next = () => count-- > 0 ? "
        "requestAnimationFrame(next) : done(); next(); })",
        count,
    )


def numbers(page: Page, view: int = 0) -> dict[str, Any]:
    """Raw values of the scorecard's rows."""
    rows = page.locator('[data-part="numbers"]').nth(view).locator("tbody tr")
    return {
        str(key): json.loads(value)
        for key, value in rows.evaluate_all("all => all.map(r => [r.dataset.key, r.dataset.value])")
    }


def drive(page: Page, view: int = 0) -> NDArray[np.complex128]:
    """What the pins made, as the page has it."""
    rows = page.locator('[data-part="coils"]').nth(view).locator("tbody tr")
    values = rows.evaluate_all("rows => rows.map(r => r.dataset.value)")
    return np.array([complex(*map(float, value.split(","))) for value in values])


PIXELS = """canvas => {
  const { width, height } = canvas;
  const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
  let text = "";
  for (const byte of data) text += String.fromCharCode(byte);
  return [width, height, btoa(text)];
}"""


def pixels(page: Page, part: str = "canvas", view: int = 0) -> NDArray[np.uint8]:
    """A canvas' pixels: (rows from the top, columns, RGBA)."""
    width, height, data = page.locator(f'[data-part="{part}"]').nth(view).evaluate(PIXELS)
    return np.frombuffer(base64.b64decode(data), np.uint8).reshape(height, width, 4)


def levels(page: Page) -> NDArray[np.float64]:
    """The picture as its own colour scale says, 0 to 1, (rows from the top, columns)."""
    scale = pixels(page, "bar")[0, :, :3].astype(float)
    assert len(np.unique(scale, axis=0)) > 200, "a scale of few colours"
    picture = pixels(page)
    assert (picture[..., 3] == 255).all(), "a picture with holes"
    colours = picture[..., :3].astype(float).reshape(-1, 3)
    away = ((colours[:, None] - scale[None]) ** 2).sum(axis=-1)
    assert away.min(axis=1).max() == 0.0, "colours that are not on the scale"
    return np.asarray(away.argmin(axis=1).reshape(picture.shape[:2]) / 255.0)
