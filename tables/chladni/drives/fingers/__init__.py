"""Several fingers at once: a drive for each that the others do not feel."""

from chladni.drives.fingers.coupling import fitted_coupling
from chladni.drives.fingers.responses import Responses, responses_at
from chladni.drives.fingers.silence import FingerDrives, KnownPlate, drives_for

__all__ = [
    "FingerDrives",
    "KnownPlate",
    "Responses",
    "drives_for",
    "fitted_coupling",
    "responses_at",
]
