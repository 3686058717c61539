"""Board simulation: from a board file to the field each actuator makes on the plate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chladni.sim.lazy_names import lazy_names

if TYPE_CHECKING:
    from chladni.sim.board.board import Board
    from chladni.sim.board.file import board_from_document, load_board, shipped_boards
    from chladni.sim.board.writing import board_file
    from chladni.sim.cost import allow_large_cost
    from chladni.sim.errors import ChladniError, InputError, ResonanceError
    from chladni.sim.fields.board_plate import plate_model
    from chladni.sim.fields.transfer import TransferFields, target_field, transfer_fields
    from chladni.sim.image.energy import compose, energy_image, normalised

_PLACES = {
    "board.board": ("Board",),
    "board.file": (
        "board_from_document",
        "load_board",
        "shipped_boards",
    ),
    "board.writing": ("board_file",),
    "cost": ("allow_large_cost",),
    "errors": (
        "ChladniError",
        "InputError",
        "ResonanceError",
    ),
    "fields.board_plate": ("plate_model",),
    "fields.transfer": (
        "TransferFields",
        "target_field",
        "transfer_fields",
    ),
    "image.energy": (
        "compose",
        "energy_image",
        "normalised",
    ),
}

__all__ = [
    "Board",
    "ChladniError",
    "InputError",
    "ResonanceError",
    "TransferFields",
    "allow_large_cost",
    "board_file",
    "board_from_document",
    "compose",
    "energy_image",
    "load_board",
    "normalised",
    "plate_model",
    "shipped_boards",
    "target_field",
    "transfer_fields",
]

__getattr__ = lazy_names(__name__, _PLACES)
