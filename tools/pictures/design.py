"""Draw what decides a focus, from boards that differ in one thing: docs/images/design.png.

    python tools/pictures/design.py

All are strips of five coils on foam like `strip5`, scored as `chladni design` does: the second
finger 20 mm away, 10th percentile over places and random boards.
"""

from __future__ import annotations

import copy
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chladni.design.evaluate import Evaluation, completed_board, evaluate
from chladni.design.spec import Spec, read_spec
from chladni.design.variables import Document
from chladni.drives.scoring.board_score import foam_length_mm
from chladni.drives.workers import Workers
from chladni.host.figures.fields import COLOURS, INK, save

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "images" / "design.png"
SPACINGS_MM = (9.0, 12.0, 15.0)
STIFFNESSES = (0.002, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16)
COUNTS = (3, 4, 5, 6, 7)
FLOORS_UM = (5.0, 20.0, 25.0, 30.0, 40.0, 50.0)


def strip(spec: Spec, places_mm: list[float], **blocks: dict[str, Any]) -> Document:
    """The strip with coils at these places along its middle line."""
    document = copy.deepcopy(spec.document)
    document["actuators"] = [
        {"name": f"coil-{k}", "at_mm": [0.0, y]} for k, y in enumerate(places_mm, 1)
    ]
    document["electronics"]["pwm_pins"] = document["electronics"]["pwm_pins"][: len(places_mm)]
    for name, entries in blocks.items():
        document[name] = document[name] | entries
    return document


def spaced(count: int, spacing_mm: float) -> list[float]:
    """Places in the middle of a strip."""
    return [float(k - (count - 1) / 2.0) * spacing_mm for k in range(count)]


def judge(spec: Spec, document: Document) -> Evaluation:
    """Score a board, whatever the limits say."""
    return evaluate(spec, document, 1)


def boards(spec: Spec) -> dict[str, list[Document]]:
    """By panel and curve."""
    plain = {"material": None, "thickness_mm": None}
    found = {}
    for spacing in SPACINGS_MM:
        length = 4.0 * spacing + 12.0
        found[f"{spacing:g} mm apart"] = [
            _without_none(
                strip(
                    spec,
                    spaced(5, spacing),
                    plate={"size_mm": [14.0, length]},
                    foundation=plain | {"stiffness_n_per_mm3": one},
                )
            )
            for one in STIFFNESSES
        ]
    found["counts"] = [strip(spec, spaced(n, 48.0 / max(n - 1, 1))) for n in COUNTS]
    found["floors"] = [strip(spec, spaced(5, 12.0), focus={"floor_um": one}) for one in FLOORS_UM]
    return found


def _without_none(document: Document) -> Document:
    own = document["foundation"]
    document["foundation"] = {key: value for key, value in own.items() if value is not None}
    return document


def draw_counts(axes: Axes, levels: list[float]) -> None:
    """Second finger over the coils' spacing, with the number of coils beside each point."""
    axes.plot(
        [48.0 / (n - 1) for n in COUNTS],
        levels,
        "o-",
        color=COLOURS[0],
    )
    for n, level in zip(COUNTS, levels, strict=True):
        axes.annotate(
            f"{n}",
            (48.0 / (n - 1), level),
            xytext=(4, 4),
            textcoords="offset points",
            fontsize=8,
        )
    axes.margins(x=0.08, y=0.12)
    axes.axvspan(0.0, 12.0, color="#eef2f6", zorder=0)
    axes.set_xlabel("coil spacing on 60 mm of strip, mm")
    axes.set_title("Coils a fingertip apart (number beside)", fontsize=10, color=INK)


def main() -> None:
    """Score all boards and draw."""
    spec = read_spec(ROOT / "boards" / "specs" / "strip.toml")
    # Closer than its coils can be wound, too: only fields are looked at.
    spec = replace(spec, settings=replace(spec.settings, coil_spacing=7e-3))
    asked = boards(spec)
    flat = [document for own in asked.values() for document in own]
    with Workers() as workers:
        scores = list(workers.map(partial(judge, spec), flat))
    terms = dict(zip(map(id, flat), (one.terms for one in scores), strict=True))

    def level(document: Document, name: str = "second_finger_20mm_db") -> float:
        return terms[id(document)].get(name, np.nan)

    figure = Figure(figsize=(11.0, 3.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    for colour, spacing in zip(COLOURS, SPACINGS_MM, strict=False):
        own = asked[f"{spacing:g} mm apart"]
        across = [(foam_length_mm(completed_board(one)) or np.nan) / spacing for one in own]
        left.plot(across, [level(one) for one in own], "o-", color=colour, label=f"{spacing:g} mm")
    left.set_xscale("log")
    left.set_xticks([0.2, 0.3, 0.5, 0.7, 1.0], ["0.2", "0.3", "0.5", "0.7", "1"], minor=False)
    left.minorticks_off()
    left.set_xlabel("foam length over coil spacing")
    left.legend(title="coils apart", fontsize=8)
    left.set_title("Foam length about half the spacing", fontsize=10, color=INK)
    draw_counts(middle, [level(one) for one in asked["counts"]])
    right.plot(
        [10.0 ** (level(one, "finger_db") / 20.0) for one in asked["floors"]],
        [level(one) for one in asked["floors"]],
        "o-",
        color=COLOURS[0],
    )
    right.set_xlabel("under the finger, µm")
    right.set_title("More vibration takes silence", fontsize=10, color=INK)
    for axes in (left, middle, right):
        axes.set_ylabel("second finger 20 mm away, dB below", fontsize=9)
        axes.grid(color="#dddddd", linewidth=0.6)
    save(figure, PICTURE)
    for name, own in asked.items():
        print(name, [f"{level(one):.1f}" for one in own])


if __name__ == "__main__":
    main()
