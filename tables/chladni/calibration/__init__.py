"""A board as it is: found from what its own coils read of each other, or from its sound."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chladni.sim.lazy_names import lazy_names

if TYPE_CHECKING:
    from chladni.calibration.fit import BoardFit, fit_board
    from chladni.calibration.hearing import Heard, fit_sound
    from chladni.calibration.hidden import HiddenPlate, hidden_plate
    from chladni.calibration.parameters import Parameter
    from chladni.calibration.restored import Restored, Truth
    from chladni.calibration.sensing import CoilReadings
    from chladni.calibration.sweep import heard_coils, sweep_duties

_PLACES = {
    "fit": ("BoardFit", "fit_board"),
    "hearing": ("Heard", "fit_sound"),
    "hidden": ("HiddenPlate", "hidden_plate"),
    "parameters": ("Parameter",),
    "restored": ("Restored", "Truth"),
    "sensing": ("CoilReadings",),
    "sweep": ("heard_coils", "sweep_duties"),
}

__all__ = [
    "BoardFit",
    "CoilReadings",
    "Heard",
    "HiddenPlate",
    "Parameter",
    "Restored",
    "Truth",
    "fit_board",
    "fit_sound",
    "heard_coils",
    "hidden_plate",
    "sweep_duties",
]

__getattr__ = lazy_names(__name__, _PLACES)
