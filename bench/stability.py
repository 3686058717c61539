"""Estimate against error for random boards of every kind: no wrong field may be called right.

    .venv/bin/python bench/stability.py --boards 200 --jobs 2

A board is a pure function of its seed, which is printed. Its fields at the default tolerance are
compared with those of the largest basis there is. Prints a table by kind and every seed whose
estimate is below its error or far above it, and draws docs/images/stability.png.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from chladni.host.figures import save
from chladni.sim import Board, ChladniError, board_from_document
from chladni.sim.fields.transfer import TOLERANCE, actuator_loads, plate_geometry
from chladni.sim.plate.loads import Load
from chladni.sim.ritz.plate import RitzPlate
from chladni.sim.ritz.resolution import LEVELS, resolution_for, wave_number

ROOT = Path(__file__).resolve().parents[1]
FINEST = LEVELS - 3
"""Of the basis that stands for the truth."""
MOST_BYTES = 3 << 30
"""Of memory that a board may take; one that takes more is counted as refused."""
KINDS = ("free", "held edges", "held edges and features", "near features")
POINTS = (25, 41)
NEAR_MM = (0.01, 0.6)
"""Gaps between features that are drawn close to each other."""
MUCH_ABOVE, NEGLIGIBLE = 100.0, 0.1
"""An estimate may be so many times the error, or below this share of the tolerance."""


@dataclass(frozen=True)
class Case:
    """One board: how it came out."""

    seed: int
    kind: str
    error: float
    estimate: float
    seconds: float
    refused: str = ""


class Draw:
    """A board in the making: places that are clear of each other."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng([2026, seed])
        self.kind = KINDS[seed % len(KINDS)]
        width = self.rng.uniform(40.0, 100.0)
        ratio = 10.0 if self.rng.random() < 0.05 else self.rng.uniform(1.0, 2.5)
        self.size = np.array([width, width * ratio])
        self.taken: list[tuple[float, float, float]] = []

    def place(self, radius: float) -> list[float] | None:
        """A place for a disc, mm; near another one where the kind is near features."""
        for _ in range(20):
            if self.taken and self.kind == "near features" and self.rng.random() < 0.5:
                x, y, r = self.taken[self.rng.integers(len(self.taken))]
                gap = np.exp(self.rng.uniform(*np.log(NEAR_MM)))
                angle = self.rng.uniform(0.0, 2.0 * np.pi)
                at = np.array([x, y]) + (r + radius + gap) * np.array(
                    [np.cos(angle), np.sin(angle)]
                )
            else:
                at = self.rng.uniform(-0.5, 0.5, 2) * (self.size - 2.0 * radius - 1.0)
            inside = np.all(np.abs(at) + radius < self.size / 2.0 - 0.01)
            clear = all(
                np.hypot(at[0] - u, at[1] - v) > radius + r + 0.009 for u, v, r in self.taken
            )
            if inside and clear:
                self.taken.append((float(at[0]), float(at[1]), radius))
                return [float(at[0]), float(at[1])]
        return None

    def places(self, most: int, radius: float) -> list[list[float]]:
        """Up to so many."""
        found = [self.place(radius) for _ in range(int(self.rng.integers(0, most + 1)))]
        return [at for at in found if at is not None]

    def edges(self) -> Any:
        """One word for all, or one for each."""
        if self.kind == "free":
            return "free"
        kinds = ("free", "simply supported", "clamped")
        names = ("left", "right", "bottom", "top")
        drawn = {name: str(self.rng.choice(kinds)) for name in names}
        return drawn if set(drawn.values()) != {"free"} else "clamped"

    def document(self) -> dict[str, Any]:
        """The board file."""
        rng, size = self.rng, self.size
        plate = {
            "size_mm": size.tolist(), "thickness_mm": float(rng.uniform(0.4, 2.0)),
            "youngs_modulus_gpa": float(rng.uniform(3.0, 70.0)), "poissons_ratio": 0.3,
            "density_kg_m3": 1900.0, "loss_factor": float(rng.choice([0.0, 1e-3, 0.02, 0.1])),
            "edges": self.edges(),
        }  # fmt: skip
        few = self.kind == "held edges"
        magnets = bool(rng.random() < 0.6) and not few
        radius = 5.0 if magnets else 0.1
        self.taken.append((0.0, 0.0, radius))
        coils = [[0.0, 0.0], *self.places(15, radius)]
        document: dict[str, Any] = {
            "name": "random", "plate": plate,
            "actuators": [{"name": f"a{k}", "at_mm": at} for k, at in enumerate(coils)],
            "drive": {"frequency_hz": float(rng.uniform(50.0, 1000.0)), "max_gain": 10.0},
            "image": {"points": list(POINTS)}, "regions": {"pitch_mm": 5.0},
            "electronics": {"pwm_pins": [], "pwm_bits": 10, "ramp_ms": 4.0,
                            "touch_timeout_ms": 100.0, "max_on_s": 10.0},
        }  # fmt: skip
        if magnets:
            ratio = float(rng.choice([1.0, 30.0, 1000.0]))
            document["magnet"] = {"radius_mm": 5.0, "height_mm": 3.0, "density_kg_m3": 7500.0,
                                  "stiffness_ratio": ratio}  # fmt: skip
        if not few:
            supports = ("clamped", "pinned")
            document["screws"] = [
                {"at_mm": at, "radius_mm": 1.5, "support": str(rng.choice(supports))}
                for at in self.places(8, 1.5)
            ]
            document["holes"] = [{"at_mm": at, "radius_mm": 2.0} for at in self.places(2, 2.0)]
            document["springs"] = [
                {"at_mm": at, "stiffness_n_per_mm": float(10.0 ** rng.uniform(0.0, 2.0))}
                for at in self.places(2, 0.1)
            ]
            document["masses"] = [
                {"at_mm": at, "mass_g": float(rng.uniform(0.1, 3.0))} for at in self.places(2, 0.1)
            ]
        return document


def board_of(seed: int) -> Board:
    """The board of a seed."""
    return board_from_document(Draw(seed).document())


def tried(seed: int) -> Case:
    """One board: its estimate, and its error against the largest basis."""
    kind = KINDS[seed % len(KINDS)]
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    begun = time.perf_counter()
    try:
        board = board_of(seed)
        geometry, loss = plate_geometry(board), board.plate.loss_factor
        loads = [*actuator_loads(board)[:4], Load(*(board.plate.size[k] * 0.21 for k in (0, 1)))]
        asked = {"frequency_hz": board.drive.frequency_hz, "x": board.x, "y": board.y}
        found = RitzPlate(geometry, loss).respond(loads, **asked, tolerance=TOLERANCE)
        seconds = time.perf_counter() - begun
        waves = wave_number(geometry, 2.0 * np.pi * board.drive.frequency_hz)
        finest = RitzPlate(geometry, loss, resolution_for(geometry, waves, FINEST))
        exact = finest.respond(loads, **asked, tolerance=1e-12).values
        norms = np.linalg.norm(exact, axis=(1, 2))
        error = float(np.max(np.linalg.norm(found.values - exact, axis=(1, 2)) / norms))
        return Case(seed, kind, error, found.error_estimate, seconds)
    except ChladniError as refusal:
        return Case(seed, kind, 0.0, 0.0, time.perf_counter() - begun, str(refusal))
    except MemoryError:
        why = f"more than {MOST_BYTES >> 30} GB"
        return Case(seed, kind, 0.0, 0.0, time.perf_counter() - begun, why)


def is_low(case: Case) -> bool:
    """Whether the estimate is below the error."""
    return case.estimate < case.error


def is_high(case: Case) -> bool:
    """Whether it is far above, where that matters."""
    return case.estimate > max(MUCH_ABOVE * case.error, NEGLIGIBLE * TOLERANCE)


def figure_of(cases: list[Case]) -> Figure:
    """Estimate against error."""
    figure = Figure(figsize=(6.5, 5.5), layout="constrained")
    axes = figure.subplots()
    for kind in KINDS:
        own = [case for case in cases if case.kind == kind and not case.refused]
        axes.loglog([max(c.error, 1e-12) for c in own], [c.estimate for c in own], "o", ms=4,
                    label=kind, alpha=0.7)  # fmt: skip
    line = np.array([1e-10, 1.0])
    axes.loglog(line, line, "k-", lw=0.8)
    axes.axhline(TOLERANCE, color="k", ls=":", lw=0.8)
    axes.set_xlabel("error against the largest basis")
    axes.set_ylabel("estimate")
    axes.legend(frameon=False)
    return figure


def main() -> None:
    """Draw boards, try them, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--boards", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.boards)
    with ProcessPoolExecutor(options.jobs) as pool:
        cases = list(pool.map(tried, seeds))
    print("## Stability\n")
    print("| kind | boards | refused | estimate below error | far above | unmet | median s |")
    print("|---|---|---|---|---|---|---|")
    for kind in KINDS:
        own = [case for case in cases if case.kind == kind and not case.refused]
        refused = sum(bool(case.refused) for case in cases if case.kind == kind)
        print(f"| {kind} | {len(own)} | {refused} | {sum(map(is_low, own))} "
              f"| {sum(map(is_high, own))} | {sum(c.estimate > TOLERANCE for c in own)} "
              f"| {np.median([c.seconds for c in own] or [np.nan]):.1f} |")  # fmt: skip
    print()
    for case in cases:
        if case.refused or is_low(case) or is_high(case) or case.estimate > TOLERANCE:
            why = case.refused or f"error {case.error:.2g}, estimate {case.estimate:.2g}"
            print(f"- seed {case.seed} ({case.kind}): {why}, {case.seconds:.1f} s")
    save(figure_of(cases), ROOT / "docs" / "images" / "stability.png")


if __name__ == "__main__":
    main()
