"""A section of responses from those of a solved board."""

from __future__ import annotations

import numpy as np

from chladni.drives.fingers.responses import Responses
from chladni.sim.board.board import Board
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_newtons
from chladni.sim.image.finger import PRESS, pressing_stiffness, threshold_um
from chladni.tables.responses import METRE_PM
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import ReckonedFinger, ResponsesSection, quantise


def section_of(
    known: Responses, finger: ReckonedFinger, regions: StoredRegions, bits: int
) -> ResponsesSection:
    """The responses of a board at the centres of its stored regions, as integers of so many bits.

    Raises
    ------
    InputError
        When the table is packed, if a response is beyond 4.29 mm/N.
    """
    numbers = regions.numbers.tolist()
    places = np.array([regions.grid.centre_mm(region) for region in numbers]) * MM
    coils, own = known.at(places), known.own_at(places)[:, None]
    scales = [int(np.ceil(float(np.abs(part).max()) * METRE_PM)) or 1 for part in (coils, own)]
    parts = [
        quantise(part, scale / METRE_PM, bits)
        for part, scale in zip((coils, own), scales, strict=True)
    ]
    return ResponsesSection(
        frequency_hz=known.frequency_hz,
        full_scale_pm=scales[0],
        own_full_scale_pm=scales[1],
        coupling=known.coupling.astype(np.complex64).astype(np.complex128),
        iq=np.concatenate(parts, axis=1),
        finger=finger,
    )


def reckoned_finger(board: Board, frequency_hz: float) -> ReckonedFinger:
    """What presses a board, and what its coils can push while all of them work alike."""
    full = full_newtons(board, frequency_hz)
    threshold = threshold_um(frequency_hz)
    return ReckonedFinger(
        full_force_un=round(1e6 * (full or 0.0)),
        threshold_pm=0 if threshold is None else round(threshold * 1e6),
        stiffness=complex(np.complex64(pressing_stiffness(PRESS, frequency_hz))),
    )
