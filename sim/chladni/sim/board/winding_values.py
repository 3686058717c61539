"""The values of a coil that follow from its winding and its magnet."""

from __future__ import annotations

from chladni.sim.board.electronics import Winding
from chladni.sim.board.parts import Magnet
from chladni.sim.board.quantity import METRES, MM, check_ranges
from chladni.sim.errors import InputError, MissingError
from chladni.sim.magnetics.windings import force_per_ampere

SAME_WINDING = 0.25
"""Share by which a coil's values may differ, given twice: a warm coil has a quarter more Ω than a
cold one, and a gap that is off by some tenths of a millimetre makes as much of the force."""
MOST_FILL = 0.75
"""Copper's share of a winding. Round wires side by side cover 0.91, and enamel takes a fifth."""
LEAST_GAP = 0.02e-3
"""m. No winding stands nearer to its magnet without touching it."""
DIGITS = 4
"""Of what follows from a winding: more than the model knows, and written into a file without
loss."""


def winding_makes(
    winding: Winding, magnet: Magnet | None, *, force: bool = True
) -> dict[str, float]:
    """A coil's values as they follow from its winding, by their keys of `[coil]`.

    Parameters
    ----------
    force
        Whether the force is asked for, which takes a magnet whose remanence is known.

    Raises
    ------
    InputError
        No such winding can be, or the magnet that it acts on is not known.
    """
    check_ranges(winding, "winding")
    _check_shape(winding, magnet)
    own = winding.round
    made = {"resistance_ohm": own.resistance, "inductance_mh": own.inductance / 1e-3}
    if magnet is None or not magnet.remanence:
        if force:
            what = "the force of a [winding] takes it, or coil.force_factor_n_per_a"
            raise MissingError("magnet.remanence_t", what)
    else:
        check_ranges(magnet, "magnet")
        made["force_factor_n_per_a"] = force_per_ampere(
            own,
            remanence=magnet.remanence,
            radius=magnet.radius,
            height=magnet.height,
            gap=winding.gap,
        )
        if made["force_factor_n_per_a"] <= 0.0:
            expected = "a gap with the magnet's middle above the winding's, where it is pushed"
            raise InputError("winding.gap_mm", winding.gap / MM, expected)
    return {key: float(f"{value:.{DIGITS}g}") for key, value in made.items()}


def _check_shape(winding: Winding, magnet: Magnet | None) -> None:
    if winding.inner >= winding.outer:
        expected = f"less than winding.outer_mm, {winding.outer / MM:g}"
        raise InputError("winding.inner_mm", winding.inner / MM, expected)
    if winding.round.fill > MOST_FILL:
        most = int(winding.turns * MOST_FILL / winding.round.fill)
        raise InputError("winding.turns", winding.turns, f"at most {most}, which fill it with wire")
    if magnet is not None and magnet.remanence and not magnet.height:
        hint = "a remanence takes a magnet with a height"
        raise InputError("magnet.height_mm", 0.0, "above 0", hint=hint)
    if 0.0 < abs(winding.gap) < LEAST_GAP:
        expected = f"0, or {LEAST_GAP / MM:g} and more"
        raise InputError("winding.gap_mm", winding.gap / MM, expected, hint=METRES)
    if magnet is not None and winding.gap <= 0.0 and winding.inner <= 2.0 * magnet.radius:
        raise InputError(
            "winding.gap_mm",
            winding.gap / MM,
            "above 0",
            hint=f"a magnet of {2.0 * magnet.radius / MM:g} mm does not dip into a bore of "
            f"{winding.inner / MM:g} mm",
        )
