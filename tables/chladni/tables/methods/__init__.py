"""Ways to find a drive for a target, one per file, each with its source."""

from chladni.tables.methods.anneal import anneal
from chladni.tables.methods.base import SEED, Found, Method, Options, Progress
from chladni.tables.methods.contrast import contrast
from chladni.tables.methods.dual_annealing import dual_annealing
from chladni.tables.methods.gerchberg_saxton import gerchberg_saxton
from chladni.tables.methods.inverse_filter import inverse_filter
from chladni.tables.methods.least_squares import least_squares
from chladni.tables.methods.nearest import nearest
from chladni.tables.methods.phasor import phasor
from chladni.tables.methods.phasor_anneal import phasor_anneal
from chladni.tables.methods.time_reversal import time_reversal

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
