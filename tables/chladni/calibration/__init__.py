"""A board as it is: found from what its own coils read of each other."""

from chladni.calibration.fit import Found, Parameter, fit_board
from chladni.calibration.hidden import HiddenPlate, hidden_plate
from chladni.calibration.restored import Restored, Truth
from chladni.calibration.sensing import CoilReadings, read_hidden

__all__ = [
    "CoilReadings",
    "Found",
    "HiddenPlate",
    "Parameter",
    "Restored",
    "Truth",
    "fit_board",
    "hidden_plate",
    "read_hidden",
]
