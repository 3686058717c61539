"""A board as it is: found from what its own coils read of each other, or from its sound."""

from chladni.calibration.fit import BoardFit, Parameter, fit_board
from chladni.calibration.hearing import Heard, fit_sound
from chladni.calibration.hidden import HiddenPlate, hidden_plate
from chladni.calibration.restored import Restored, Truth
from chladni.calibration.sensing import CoilReadings
from chladni.calibration.sweep import heard_coils, sweep_duties

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
