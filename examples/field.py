"""One field: what a newton at one place of a board does all over it.

python examples/field.py [OUT_DIR]
"""

import sys
from pathlib import Path

from chladni.host.figures import field_figure, save
from chladni.sim import load_board, target_field

PLACE_MM = (10.0, 25.0)


def main(out: Path) -> None:
    """Solve the plate, say how exact that is, draw it."""
    board = load_board("prototype")
    found = target_field(board, PLACE_MM)
    field = found.values[0]  # complex128, shape (nx, ny), m/N
    print(f"{board.name} at {found.frequency_hz:g} Hz: {abs(field).max() * 1e6:.1f} µm per newton")
    print(f"{found.modes_used} functions, estimated error {found.error_estimate:.1e}")
    save(field_figure(board, field, target_mm=PLACE_MM), out / "example-field.png")


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    folder.mkdir(parents=True, exist_ok=True)
    main(folder)
