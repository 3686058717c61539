"""Random boards, each a pure function of its seed: what the benches try the plate on."""

from __future__ import annotations

from typing import Any

import numpy as np

KINDS = ("free", "held edges", "held edges and features", "near features")
POINTS = (25, 41)
NEAR_MM = (0.01, 0.6)
"""Gaps between features that are drawn close to each other."""


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
            document["magnet"] = {
                "radius_mm": 5.0,
                "height_mm": 3.0,
                "density_kg_m3": 7500.0,
                "stiffness_ratio": ratio,
            }
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


def full_board(seed: int, edges: str, gap_mm: float) -> dict[str, Any]:
    """A board file of phone size without a mirror: sixteen coils with magnets, twelve others.

    Six screws, two holes, two springs and two masses; no two nearer than the gap.
    """
    draw = Draw(seed)
    draw.size, draw.taken = np.array([71.5, 146.7]), []

    def places(count: int, radius: float) -> list[list[float]]:
        found: list[list[float]] = []
        while len(found) < count:
            at = draw.rng.uniform(-0.5, 0.5, 2) * (draw.size - 2.0 * (radius + gap_mm))
            if all(np.hypot(at[0] - u, at[1] - v) > radius + r + gap_mm for u, v, r in draw.taken):
                draw.taken.append((float(at[0]), float(at[1]), radius))
                found.append([float(at[0]), float(at[1])])
        return found

    return {
        "name": "full",
        "plate": {
            "size_mm": draw.size.tolist(), "thickness_mm": 1.0, "youngs_modulus_gpa": 22.0,
            "poissons_ratio": 0.15, "density_kg_m3": 1900.0, "loss_factor": 0.02, "edges": edges,
        },
        "magnet": {"radius_mm": 5.0, "height_mm": 4.0, "density_kg_m3": 7500.0,
                   "stiffness_ratio": 1000.0},
        "actuators": [{"name": f"a{k}", "at_mm": at} for k, at in enumerate(places(16, 5.0))],
        "screws": [{"at_mm": at, "radius_mm": 1.5} for at in places(6, 1.5)],
        "holes": [{"at_mm": at, "radius_mm": 2.0} for at in places(2, 2.0)],
        "springs": [{"at_mm": at, "stiffness_n_per_mm": 10.0} for at in places(2, 0.1)],
        "masses": [{"at_mm": at, "mass_g": 1.0} for at in places(2, 0.1)],
        "drive": {"frequency_hz": 160.0, "max_gain": 10.0},
        "image": {"points": [179, 367]}, "regions": {"pitch_mm": 5.0},
        "electronics": {"pwm_pins": [], "pwm_bits": 10, "ramp_ms": 4.0,
                        "touch_timeout_ms": 100.0, "max_on_s": 10.0},
    }  # fmt: skip
