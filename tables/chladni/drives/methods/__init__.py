"""Ways to find a drive for a target, one per file, each with its source."""

from chladni.drives.methods.anneal import anneal
from chladni.drives.methods.base import SEED, Found, Method, Options, Progress
from chladni.drives.methods.contrast import contrast
from chladni.drives.methods.dual_annealing import dual_annealing
from chladni.drives.methods.gerchberg_saxton import gerchberg_saxton
from chladni.drives.methods.inverse_filter import inverse_filter
from chladni.drives.methods.least_squares import least_squares
from chladni.drives.methods.nearest import nearest
from chladni.drives.methods.phasor import phasor
from chladni.drives.methods.phasor_anneal import phasor_anneal
from chladni.drives.methods.time_reversal import time_reversal

METHODS: dict[str, Method] = {
    "phasor": phasor,
    "anneal": anneal,
    "phasor-anneal": phasor_anneal,
    "dual-annealing": dual_annealing,
    "nearest": nearest,
    "least-squares": least_squares,
    "inverse-filter": inverse_filter,
    "time-reversal": time_reversal,
    "contrast": contrast,
    "gerchberg-saxton": gerchberg_saxton,
}
"""By the name the command line knows; the first is the default."""
SEARCHED = ("phasor", "anneal", "phasor-anneal", "dual-annealing")
"""Those that look at images many times; the others are closed forms or nearly so."""

__all__ = ["METHODS", "SEARCHED", "SEED", "Found", "Method", "Options", "Progress"]
