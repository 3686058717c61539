"""A board of one's own: say what is given and what is open, and have the rest found.

python examples/design.py [OUT_DIR]
"""

import sys
from pathlib import Path

from chladni.design import design, spec_of
from chladni.host.figures import front_figure, save
from chladni.sim import board_file

SPEC = {
    "name": "mine",
    "actuators": "free",
    "design": {"coils": {"from": 2, "to": 3}, "evaluations": 8, "samples": 1, "finger_um": 1.0},
    "plate": {"size_mm": [12.0, 36.0], "thickness_mm": {"any": [0.2, 0.3]}, "material": "FR4"},
    "foundation": {"stiffness_n_per_mm3": 0.03, "loss_factor": 0.2},
    "drive": {"frequency_hz": 160.0, "max_gain": 10.0},
    "regions": {"pitch_mm": 4.0},
    "electronics": {
        "pwm_bits": 10, "ramp_ms": 4.0, "touch_timeout_ms": 100.0, "max_on_s": 10.0,
    },
}  # fmt: skip
"""As in boards/specs: eight evaluations to try it, some hundreds to mean it."""


def main(out: Path) -> None:
    """Search, write the best board as a file, draw what was found."""
    found = design(spec_of(SPEC), jobs=1, samples=1)
    (out / "mine.toml").write_bytes(board_file(found.board, ["Found by examples/design.py."]))
    coils = ", ".join(f"{1e3 * one.at[1]:+.1f}" for one in found.board.actuators)
    print(f"{found.evaluations} boards; the best has coils at y = {coils} mm")
    save(front_figure(found), out / "example-design.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
