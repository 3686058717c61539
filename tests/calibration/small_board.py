"""A board that is solved in a tenth of a second, for tests of calibration."""

from __future__ import annotations

from chladni.sim.board.board import Board
from chladni.sim.board.file import parse_board

PLACES = ((-18.0, -20.0), (15.0, -17.0), (1.0, 2.0), (-16.0, 19.0), (19.0, 16.0), (20.0, -1.0))
TEXT = """
name = "small"
[plate]
size_mm = [60.0, 64.0]
thickness_mm = 0.4
material = "FR4"
edges = "free"
[foundation]
stiffness_n_per_mm3 = 0.01
loss_factor = 0.2
[winding]
turns = 250
wire_mm = 0.1
inner_mm = 3.0
outer_mm = 9.0
height_mm = 1.5
gap_mm = 1.0
[coil]
force_factor_n_per_a = 0.55
[image]
points = [61, 65]
"""


def small_board() -> Board:
    """Six coils without magnets' mass on foam."""
    coils = "".join(f"[[actuators]]\nat_mm = [{x}, {y}]\n" for x, y in PLACES)
    return parse_board(TEXT + coils, file="small.toml")
