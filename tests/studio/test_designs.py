"""Designs begun from a page: what it is told, against the same search made by Python itself."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from time import sleep
from typing import Any

import pytest
import tomlkit
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page
from websockets.sync.client import ClientConnection

from chladni.design.search import design
from chladni.design.spec import spec_of
from chladni.host.studio.boards.searches import SAMPLES
from chladni.sim.board.quantity import MM
from made_specs import small
from studio.conftest import Studio
from studio.pages import RULES
from studio.wire import PRESS, opened, told_of

SPEC = small(design={"evaluations": 6}, image={"points": [25, 65]})


def begin(own: ClientConnection, spec: dict[str, Any], name: str = "own.toml") -> None:
    own.send(json.dumps({"type": "design", "name": name, "text": tomlkit.dumps(spec)}))


def news(own: ClientConnection) -> Iterator[dict[str, Any]]:
    """What is told of a search, to its end."""
    while True:
        message = told_of(own, "search")
        yield message
        if message["state"] != "running":
            return


def test_a_search_tells_its_boards_and_finds_what_python_finds(studio: Studio) -> None:
    wanted = design(spec_of(SPEC), samples=SAMPLES)
    with opened(studio) as own:
        begin(own, SPEC)
        all_news = list(news(own))
        counts = [len(one["boards"]) for one in all_news]
        last = all_news[-1]
        assert (last["state"], last["done"]) == ("done", 6)
        assert counts == sorted(counts)
        assert len(last["front"]) == len(wanted.front)
        rows = [dict(zip(last["columns"], row, strict=True)) for row in last["boards"]]
        best = rows[last["front"][0]]
        assert best["robust_score"] == pytest.approx(wanted.best.evaluation.robust_score, abs=1e-6)
        own.send(json.dumps({"type": "take", "index": last["front"][0]}))
        board = told_of(own, "board")
        places = [pytest.approx([along / MM for along in one.at]) for one in wanted.board.actuators]
        assert [one["at_mm"] for one in board["actuators"]] == places
        own.recv()
        own.send(json.dumps(PRESS | {"x_mm": 0.0, "y_mm": 2.0}))
        assert told_of(own, "played")["state"] == "playing"


LONG = 100_000
"""Evaluations, more than a test waits for."""


def test_one_search_runs_at_a_time_and_is_stopped_by_its_page(studio: Studio) -> None:
    long = SPEC | {"design": SPEC["design"] | {"evaluations": LONG}}
    with opened(studio) as own, opened(studio) as other:
        begin(own, long)
        assert told_of(own, "search")["state"] == "running"
        begin(other, SPEC)
        refused = told_of(other, "refused")
        assert (refused["field"], "one at a time" in refused["text"]) == ("design", True)
        own.send(json.dumps({"type": "stop"}))
        last = list(news(own))[-1]
        assert last["state"] == "stopped"
        assert last["done"] < LONG
    with opened(studio) as own:
        begin(own, long)
        assert told_of(own, "search")["state"] == "running"
    # The page has gone, and with it its search: another one may have the cores.
    with opened(studio) as other:
        for _ in range(100):
            begin(other, SPEC)
            message = json.loads(other.recv(60.0))
            if message["type"] == "search":
                break
            sleep(1.0)  # as often as a page may ask for a board
        assert message["type"] == "search"
        assert list(news(other))[-1]["state"] == "done"


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        (
            {"actuators": [{"name": "a", "at_mm": [0.0, 0.0]}], "design": {"coils": None}},
            "own.toml, spec",
        ),
        ({"design": {"coils": 40}}, "own.toml, design.coils"),
        ({"plate": {"thickness_mm": {"from": 3.0, "to": 1.0}}}, "own.toml, plate.thickness_mm"),
    ],
)
def test_a_wrong_spec_is_named_by_file_and_field(
    studio: Studio, spec: dict[str, Any], said: str
) -> None:
    with opened(studio) as own:
        begin(own, small(**spec))
        assert said in told_of(own, "refused")["text"]


def test_only_what_was_found_can_be_shown(studio: Studio) -> None:
    with opened(studio) as own:
        own.send(json.dumps({"type": "take", "index": 0}))
        assert told_of(own, "refused")["field"] == "index"
        own.send(json.dumps({"type": "design", "name": "../prototype", "text": None}))
        assert told_of(own, "refused")["field"] == "spec"


def search(page: Page, path: Path, spec: dict[str, Any]) -> None:
    """Give the page a SPEC of one's own, and wait for the end of its search."""
    path.write_text(tomlkit.dumps(spec), encoding="utf-8")
    page.get_by_text("Design a board").click()
    page.get_by_label("Or a file of your own").set_input_files(path)
    page.get_by_text(f"{path.name}: done").wait_for(timeout=120_000)


def test_the_page_draws_a_front_and_shows_a_board_of_it(page: Page, tmp_path: Path) -> None:
    search(page, tmp_path / "own.toml", SPEC)
    page.get_by_role("img", name="boards found").wait_for()
    dots = page.locator('[data-part="front"] circle')
    heights = dots.evaluate_all(
        "all => all.map(d => [Number(d.dataset.db), Number(d.getAttribute('cy'))])"
    )
    assert len(heights) >= 6
    # What is better stands higher.
    ranked = [cy for _, cy in sorted(heights)]
    assert ranked == sorted(ranked, reverse=True)
    rows = page.locator('[data-part="found"] tbody tr')
    assert rows.count() == page.locator('[data-part="front"] circle.kept').count()
    found = Axe().run(page, options=RULES)
    assert found.response["violations"] == [], found.generate_report()
    rows.first.get_by_role("button").click()
    page.locator("section[data-board='small']").wait_for()
    page.get_by_text("2 coils at 160 Hz").wait_for()


@pytest.mark.parametrize(
    ("weight", "header"),
    [("fingers_2_db", "2 fingers apart"), ("fingers_click_db", "a click, 2 fingers apart")],
)
def test_a_search_for_several_fingers_is_shown_by_several(
    page: Page, tmp_path: Path, weight: str, header: str
) -> None:
    """By what the SPEC weighs, that is, and not by how one finger alone would focus."""
    own = small(
        design={"evaluations": 2, "weights": {weight: 1.0}},
        magnet={"radius_mm": 3.0, "height_mm": 4.0, "remanence_t": 1.28},
        winding={"turns": 300, "wire_mm": 0.1, "inner_mm": 3.0, "outer_mm": 8.0}
        | {"height_mm": 1.5, "gap_mm": 1.0},
        image={"points": [25, 65]},
    )
    search(page, tmp_path / "two.toml", own)
    page.get_by_role("columnheader", name=header, exact=True).wait_for()
    wanted = design(spec_of(own), samples=SAMPLES).best.summary
    cells = page.locator('[data-part="found"] tbody tr').first.get_by_role("cell")
    told = cells.all_inner_texts()
    assert told[1] == f"{wanted[weight]:.1f} dB"
    assert told[2].endswith("µm")
    assert float(told[2].split()[0]) == pytest.approx(wanted["fingers_um"], rel=0.1)
