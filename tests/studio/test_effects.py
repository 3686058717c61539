"""Effects in the studio: a page plays what Python plays, draws it and makes it heard."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from websockets.sync.client import ClientConnection

from chladni.effects.files import read_effect, shipped_effects
from chladni.effects.wav_file import to_wav
from chladni.host.emulation.felt_over_time import RATE_HZ
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.host.studio.boards.prepared import ReadyBoard
from studio.conftest import Studio
from studio.wire import opened, told, told_of

AT = [10.0, 25.0]


@pytest.fixture(scope="module")
def plates(ready: ReadyBoard) -> Plates:
    return Plates.of(ready.board)


@pytest.fixture(scope="module")
def click(ready: ReadyBoard, plates: Plates) -> PlayedEffect:
    effect = shipped_effects()["click"]
    return play_effect(ready.table, ready.board, effect, (10.0, 25.0), level=0.5, plates=plates)


def ask(own: ClientConnection, **message: Any) -> None:
    own.send(json.dumps(message))


def effect(own: ClientConnection, number: int, **values: Any) -> dict[str, Any]:
    asked = {"name": "click", "data": None, "at_mm": AT, "other_mm": None, "level": 0.5}
    ask(own, type="effect", number=number, **(asked | values))
    while (message := told(own))["type"] not in ("felt", "refused"):
        assert message["type"] == "solving"
        assert 0 <= message["done"] <= message["all"]
    assert message["number"] == number
    return message


def test_a_page_gets_what_python_plays(studio: Studio, click: PlayedEffect) -> None:
    with opened(studio) as own:
        felt = effect(own, 1)
    assert felt["name"] == "click"
    assert felt["rate_hz"] == RATE_HZ
    np.testing.assert_allclose(felt["own_um"], click.own_um, atol=1e-4)
    np.testing.assert_allclose(felt["asked"], click.asked, atol=1e-4)
    assert felt["peak_um"] == pytest.approx(click.peak_um)
    assert felt["other_um"] is None
    assert felt["isolation_db"] is None


@pytest.mark.parametrize("ending", [".wav", ".toml"])
def test_a_file_of_the_page_plays_as_from_a_disk(
    studio: Studio, ready: ReadyBoard, plates: Plates, tmp_path: Path, ending: str
) -> None:
    toml = "[[tone]]\nat_ms = 0\nlasts_ms = 60\namplitude = [[0, 0], [60, 1]]\nfrequency_hz = 120\n"
    path = tmp_path / f"own{ending}"
    data = to_wav(shipped_effects()["click"])[0] if ending == ".wav" else toml.encode()
    path.write_bytes(data)
    with opened(studio) as own:
        felt = effect(own, 7, name=f"own{ending}", data=base64.b64encode(data).decode())
    found = play_effect(
        ready.table,
        ready.board,
        read_effect(path).effect,
        (10.0, 25.0),
        level=0.5,
        plates=plates,
    )
    np.testing.assert_allclose(felt["own_um"], found.own_um, atol=1e-4)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"name": "nothing"}, "effect: expected click"),
        ({"data": "AAAA", "name": "own.mp3"}, "name: expected a name that ends in .haptic"),
        ({"data": "AAAA", "name": "own.ahap"}, "own.ahap"),
        ({"data": "*", "name": "own.ahap"}, "data: expected a file in base64"),
        ({"level": 1.5}, "level: expected 0 to 1"),
        ({"at_mm": [1.0]}, "at_mm: expected two numbers of millimetres"),
        ({"at_mm": [500.0, 0.0]}, "500"),
        ({"other_mm": [-10.0, -40.0]}, "responses"),
    ],
)
def test_what_cannot_be_played_is_said(studio: Studio, values: dict[str, Any], said: str) -> None:
    with opened(studio) as own:
        answer = effect(own, 3, **values)
        assert answer["type"] == "refused"
        assert said in answer["text"]
        assert "/tmp" not in answer["text"]
        ask(own, type="press", number=4, finger=0, x_mm=10.0, y_mm=25.0)
        assert told_of(own, "played")["number"] == 4


def test_a_second_finger_has_hardly_any_of_a_click(strip_studio: Studio) -> None:
    with opened(strip_studio) as own:
        felt = effect(own, 1, at_mm=[0.0, 15.0], other_mm=[0.0, -12.0], level=1.0)
    assert felt["peak_um"] > 15.0
    assert felt["isolation_db"] > 30.0
    assert max(felt["other_um"]) == pytest.approx(felt["other_peak_um"], abs=1e-4)


@pytest.fixture
def panel(page: Page) -> Page:
    """The page with its effects unfolded."""
    page.locator("[data-part=effects] > summary").click()
    return page


def play(page: Page) -> str:
    """What the page says of the effect that is chosen, once it was played."""
    part = page.locator("[data-part=effects]")
    before = part.get_attribute("data-felt") or ""
    page.get_by_role("button", name="Play effect").click()
    expect(part).not_to_have_attribute("data-felt", before, timeout=60_000)
    expect(part).to_have_attribute("data-felt", re.compile(r"\d+"), timeout=60_000)
    return page.locator("[data-part=effectSaid]").inner_text()


def test_the_page_plays_an_effect_at_its_place_and_draws_it(
    panel: Page, click: PlayedEffect
) -> None:
    panel.get_by_label("x / mm", exact=True).first.fill("10")
    panel.get_by_label("y / mm", exact=True).first.fill("25")
    panel.locator("[data-part=effect]").select_option("click")
    panel.get_by_label("Level / %", exact=True).fill("50")
    said = re.fullmatch(r"click: the finger gets ([\d.]+) µm at most\.", play(panel))
    assert said is not None
    assert float(said[1]) == pytest.approx(click.peak_um, abs=1e-3)
    curves = panel.locator("[data-part=curves]")
    assert [curves.locator(f"path.{kind}").count() for kind in ("asked", "own", "other")] == [
        1,
        1,
        0,
    ]
    # The highest point drawn lies where the finger has most.
    line = curves.locator("path.own").get_attribute("d") or ""
    points = np.array([[float(v) for v in own.split()] for own in line[1:].split("L")])
    ms = float((curves.locator("text").last.text_content() or "").split()[0])
    drawn = ms * (points[np.argmax(np.abs(points[:, 1] - points[0, 1])), 0] - 6.0) / 308.0
    assert drawn == pytest.approx(1e3 * click.t_s[np.argmax(np.abs(click.own_um))], abs=1.0)


def test_an_envelope_is_drawn_written_and_played(panel: Page) -> None:
    panel.locator("[data-part=drawing]").scroll_into_view_if_needed()
    box = panel.locator("[data-part=drawing]").bounding_box()
    assert box is not None
    for k, (across, up) in enumerate([(0.01, 0.03), (0.5, 0.97), (0.99, 0.03)]):
        panel.mouse.move(box["x"] + across * box["width"], box["y"] + (1.0 - up) * box["height"])
        if k == 0:
            panel.mouse.down()
    panel.mouse.up()
    expect(panel.locator("[data-part=effect]")).to_have_value("drawn.toml")
    points = panel.get_by_label("Points", exact=True)
    rows = [[float(v) for v in own.split()] for own in points.input_value().split(",")]
    assert (rows[0][0], rows[-1][0]) == (0.0, 300.0)
    at_ms, share = max(rows, key=lambda row: row[1])
    assert at_ms == pytest.approx(150.0, abs=6.0)
    assert share == pytest.approx(1.0, abs=0.05)
    points.fill("0 1, 60 0.2, 40 0")
    points.press("Tab")
    assert points.evaluate("own => own.validationMessage").startswith("Milliseconds that rise")
    points.fill("0 1, 40 0.2, 60 0")
    points.press("Tab")
    assert panel.get_by_label("Lasts / ms").input_value() == "60"
    assert "drawn: the finger gets" in play(panel)


def test_what_the_page_cannot_play_is_said_there(panel: Page) -> None:
    panel.get_by_label("Or a file", exact=True).set_input_files(
        {"name": "own.ahap", "mimeType": "text/plain", "buffer": b"{"}
    )
    panel.get_by_role("button", name="Play effect").click()
    expect(panel.locator("[data-part=effectSaid]")).to_contain_text("own.ahap")
    expect(panel.locator("[data-part=status]")).to_be_empty()


def test_what_a_finger_gets_is_heard(panel: Page) -> None:
    """At 48,000 values a second between those that there are, as loud as may be."""
    sound = panel.evaluate(
        """async () => {
          const { listen } = await import("./effects/sound.js");
          const values = Array.from({ length: 489 }, (_, k) => 7 * Math.sin(0.2 * k));
          return Array.from(listen(values, 4890));
        }"""
    )
    asked = 0.8 * np.sin(0.2 * np.arange(489))
    assert len(sound) == 4800
    between = np.interp(np.arange(4800) / 48_000 * 4890, np.arange(489), asked)
    np.testing.assert_allclose(sound[:4780], between[:4780], atol=0.01)
