"""What `board show` and `board score` report of a board's parts, and what they warn of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.scoring.as_built import AsBuilt
from chladni.drives.scoring.board_score import BoardScore, foam_length_mm
from chladni.drives.scoring.several_fingers.fingers_score import CountScore
from chladni.drives.scoring.small_amplitude import BridgeWave, SoftWave
from chladni.drives.scoring.warm_coils import MAGNET_C
from chladni.host.cli.common.output import say
from chladni.host.manufacture.drawing import cut_hole_mm
from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import lowest_foot, metal_of
from chladni.sim.board.electronics import MOST_LEAST_DUTY, Area
from chladni.sim.board.panel_layer import LayeredPlate
from chladni.sim.board.parts import Measured
from chladni.sim.board.quantity import MM
from chladni.sim.board.support_checks import has_foam_at_coils
from chladni.sim.fields.magnet_softening import MATTERS, MagnetSoftening
from chladni.sim.fields.static import is_held
from chladni.sim.magnetics.windings import force_over_stroke

FloatArray = NDArray[np.float64]


def say_current(wave: SoftWave | BridgeWave) -> None:
    """Where a flyback diode bends soft waves."""
    if isinstance(wave, SoftWave) and wave.is_bent:
        advice = f"set electronics.least_duty to {wave.floor:g}"
        if wave.floor > MOST_LEAST_DUTY:
            advice = (
                f"no electronics.least_duty up to {MOST_LEAST_DUTY:g} helps; is "
                "coil.inductance_mh given? Bridges have no such diode"
            )
        say(
            f"below {wave.continuous_from_duty:.3f} of duty a flyback diode stops the coils' "
            f"current and bends their sine: {advice}"
        )


def say_purpose(board: Board, asked: str | None, rated: str) -> None:
    """Remark on a board whose file does not say what it is for, unless an objective was asked."""
    if asked is not None or board.focus is not None or board.fingers is not None:
        return
    say(
        f"the board file has neither [focus] nor [fingers], so {rated} is rated, which its "
        "tables are built for too: add the block, or give --objective focus"
    )


def panel_report(plate: LayeredPlate) -> dict[str, Any]:
    """What a touch panel makes of the plate that carries it."""
    return {
        "place": plate.place,
        "layer_mm": plate.layer_thickness / MM,
        "stiffness_ratio": plate.bending_ratio,
        "mass_ratio": plate.mass_ratio,
    }


def say_panel(plate: LayeredPlate, *, for_several: bool) -> None:
    """Where a panel takes the focus, or what several fingers get, or its place is not given."""
    if plate.is_stiff:
        needs = "a finger moves less" if for_several else "a focus needs a soft sheet"
        sheet = f"{plate.sheet.thickness / MM:g} mm {plate.sheet.material}".rstrip()
        # Metal shields electrodes in and under it.
        other = "" if metal_of(plate.sheet) else ", or place 'in' or 'beside'"
        say(
            f"the panel's layer makes the plate ({sheet}) {plate.bending_ratio:.1f} times as "
            f"stiff: {needs}; use a thinner film (docs/own-board.md says usual ones){other}"
        )
    elif plate.place == "not said":
        say('the panel bends with the plate unless panel.place is "in" or "beside": say film_mm')


SMALL_COIL, K_PER_W_OF_SMALL = 12.5e-3, 100.0
"""m, and what is estimated of ⌀10 mm: it has half of the surface of ⌀15, of which 60 K/W are."""
LITTLE = 0.1
"""Of a coil's full current: no supply that is meant allows all coils less."""
LEAST_PIN = 5000.0
"""N/mm: under 1 N that is a fifth of a micrometre, which no resting finger feels."""
LONG_PIXEL = 2.0
"""Sides of a panel's pixel; those of panels that are sold are squares."""
LONG_STEP = 1.5
"""Between points of an image, along one side over along the other; rounding makes a tenth."""
LEAST_SENSED, MOST_SENSED = 0.6, 1.15
"""Of a plate: what a panel that can be bought senses at least, and how large it is at most. One for
90 × 170 mm that was left in the file of a plate of 80 × 160 is 1.2."""
TURNED = 1.2
"""Times as much, that a panel would sense of the plate if it were turned."""
NEAR_MODE = 0.1
"""Share by which a latch's resonance may be beside a mode of the plate and pass for it."""


def say_unheld(board: Board) -> None:
    """Remark on a plate that lies on nothing, and on a spring that gives no more than a pin."""
    if not is_held(board):
        say("nothing holds this plate: no foam, screw, foot or edge keeps it where it is")
    stiffest = max((own.stiffness * MM for own in board.springs), default=0.0)
    if stiffest > LEAST_PIN:
        say(
            f"a spring of {stiffest:g} N/mm hardly gives: rubber feet have 10 to 100. Are these "
            "N/m? A point that cannot move is one of [[pins]]"
        )


def _say_of_the_area(area: Area, size: tuple[float, float]) -> None:
    """Ask about a panel that leaves much of the plate out, or lies beside much of it.

    One that is a little smaller or larger is what can be bought.
    """
    sides = np.ptp(area, axis=1)
    middle = np.mean(area, axis=1)
    own, turned = (_sensed(middle, one, np.array(size)) for one in (sides, sides[::-1]))
    if own >= LEAST_SENSED and float(np.prod(sides) / np.prod(size)) <= MOST_SENSED:
        return
    spans = [[f"{end / MM:g}" for end in ends] for ends in area]
    question = "is panel.size_mm of another board? If not, all is well"
    if turned > TURNED * own:
        question = "is it to be turned, by panel.rotation_deg?"
    say(
        f"the panel senses x from {spans[0][0]} to {spans[0][1]} and y from {spans[1][0]} "
        f"to {spans[1][1]} mm of a plate of {size[0] / MM:g} x {size[1] / MM:g} mm, and "
        f"scores are of what lies on both: {question}"
    )


def _sensed(middle: FloatArray, sides: FloatArray, size: FloatArray) -> float:
    """Share of a plate of that size under a panel of such sides."""
    high = np.minimum(middle + sides / 2.0, size / 2.0)
    low = np.maximum(middle - sides / 2.0, -size / 2.0)
    return float(np.prod(np.maximum(high - low, 0.0) / size))


def say_leftovers(board: Board, modes_hz: Sequence[float] = ()) -> None:
    """Remark on what seems left from another board, and on what no model here has."""
    panel, size = board.panel, board.plate.size
    say_unheld(board)
    _say_of_points(board)
    if panel is not None and (metal := metal_of(board.plate)):
        if panel.place == "beside":
            about = f"{metal} near a capacitive panel makes it sense fingers less well"
        elif panel.place == "on" and panel.side == "top":
            about = f"so near {metal} a capacitive panel senses fingers less well"
        else:
            about = f"{metal} shields electrodes in or under it: take panel.place 'on' and film_mm"
        say(
            f"{about}, and eddy currents take force that no model here has: earth the sheet, and "
            "try panel, coil and sheet before you order more (docs/hardware.md)"
        )
    say_of_coils(board)
    if panel is not None:
        pixels = [side / count for side, count in zip(panel.size, panel.pixels, strict=True)]
        if max(pixels) > LONG_PIXEL * min(pixels):
            sides = " × ".join(f"{side / MM:.2g}" for side in pixels)
            say(
                f"a pixel of the panel is {sides} mm: are panel.pixels and panel.size_mm in the "
                "same order, the panel's own? (rotation_deg turns it)"
            )
        _say_of_the_area(panel.area, size)
    latch = board.coil.latch if board.coil else None
    if latch is None or not modes_hz:
        return
    own = latch.resonance_hz
    if not any(abs(mode / own - 1.0) <= NEAR_MODE for mode in modes_hz):
        nearest = min(modes_hz, key=lambda mode: abs(mode - own))
        say(
            f"coil.resonance_hz, {own:g} Hz, is a latch's and not this plate's, whose nearest "
            f"natural frequency is {nearest:.4g} Hz: leave it out, with moving_mass_g and "
            "mechanical_q, if the board has no latch"
        )


def _say_of_points(board: Board) -> None:
    """Remark on an image that is much finer along one side of the plate than along the other."""
    steps = [
        side / (count - 1) for side, count in zip(board.plate.size, board.image.points, strict=True)
    ]
    if max(steps) > LONG_STEP * min(steps):
        apart = " × ".join(f"{step / MM:.2g}" for step in steps)
        say(
            f"points of the image are {apart} mm apart: is image.points of another board? Left "
            "out, they are 0.5 mm apart"
        )


def say_of_coils(board: Board) -> None:
    """Remark on what makes no force, has no room in the foam, or gets hotter than is said."""
    foundation, winding, own = board.foundation, board.winding, board.electronics
    if board.plate.material == "steel":
        say(
            "steel is magnetic, and forces are computed as if it were not: measure a coil on it, "
            "or take stainless-steel"
        )
    if board.coil is not None and own.supply_limit_ma < LITTLE * 1e3 * own.full_current_a:
        say(
            f"electronics.supply_limit_ma, {own.supply_limit_ma:g} mA, is less than a tenth of one "
            f"coil's {1e3 * own.full_current_a:.3g} mA: are these amperes?"
        )
    if board.magnet is None or winding is None or not board.magnet.remanence:
        missing = "magnet.remanence_t" if board.magnet and winding else "[magnet] and [winding]"
        if board.coil is None or board.coil.force_factor == 0.0:
            say(f"no force is known, so no micrometres: give {missing}, as boards/strip5.toml does")
    magnet, cut = board.magnet, foundation.coil_cut_out if foundation else 0.0
    if magnet is not None and not cut and has_foam_at_coils(board, magnet.radius):
        say(
            "magnets hang into the foam, which has no holes: foundation.coil_cut_out_mm is their "
            f"radius, {magnet.radius / MM:g} or more"
        )
    if winding is None:
        return
    if (lowest := lowest_foot(board.springs)) and board.below_plate > lowest:
        say(
            f"magnet, gap and winding need {board.below_plate / MM:.3g} mm under the plate, and "
            f"feet of {lowest / MM:g} mm leave less: sink coils into the ground plate, or put the "
            "feet on blocks"
        )
    is_near = has_foam_at_coils(board, 0.5 * winding.outer)
    if foundation is not None and board.coils_in_foam > 0.0 and is_near:
        own_mm, cut_mm = 2.0 * foundation.coil_cut_out / MM, cut_hole_mm(board)
        wider = f"; cut ⌀{cut_mm:g}, to clear the magnets" if cut_mm > own_mm else ""
        say(
            f"coils of ⌀{winding.outer / MM:g} mm stand under the magnets and reach "
            f"{board.coils_in_foam / MM:.3g} mm into {foundation.thickness / MM:.3g} mm of foam, "
            f"whose holes are ⌀{own_mm:g} (coil_cut_out_mm is a radius{wider}): widen these "
            "from below, so deep, as `board drawing` says. The file stays as it is: above, the "
            "foam still holds the plate"
        )
    if winding.outer < SMALL_COIL and own.coil_k_per_w < K_PER_W_OF_SMALL:
        say(
            f"electronics.coil_k_per_w, {own.coil_k_per_w:g}, is of a coil of ⌀15 mm: one of "
            f"⌀{winding.outer / MM:g} gets hotter, by about {K_PER_W_OF_SMALL:g} K/W; measure it"
        )


def actuator_rows(board: Board) -> list[dict[str, Any]]:
    """Coils by name and place; of a measured board with their forces over the drawn ones."""
    rows: list[dict[str, Any]] = []
    for own in board.actuators:
        rows.append({"name": own.name, "at_mm": [round(value / MM, 9) for value in own.at]})
        if board.measured:
            rows[-1]["force_ratio"] = 0.0 if own.is_dead else own.strength
    return rows


def measured_rows(own: Measured, *, as_json: bool) -> dict[str, Any]:
    """By name, what was measured over what was drawn: its interval, how and when."""
    rows: dict[str, Any] = {}
    for one in own.values:
        by, date = one.by or own.by, one.date or own.date
        rows[one.name] = (
            {"ratio": one.ratio, "low": one.low, "high": one.high, "by": by, "date": date}
            if as_json
            else f"{one.ratio:.3g} ({one.low:.3g} to {one.high:.3g}) by {by}, {date}"
        )
    return rows


def foundation_report(board: Board) -> dict[str, Any]:
    """What a board lies on: stiffness, and what that does to a plate without edges."""
    foundation, section = board.foundation, board.section
    assert foundation is not None
    return {
        "stiffness_n_per_mm3": foundation.total_stiffness * MM**3,
        "loss_factor": foundation.total_loss_factor,
        "foam_length_mm": foam_length_mm(board),
        "cut_off_hz": foundation.cut_off_hz(section.areal_mass),
    }


def winding_report(board: Board) -> dict[str, Any]:
    """What a board's winding makes, and what a stroke changes."""
    winding, magnet = board.winding, board.magnet
    assert winding is not None
    own = winding.round
    result = {
        "resistance_ohm": own.resistance,
        "inductance_mh": own.inductance / 1e-3,
        "wire_m": own.length,
        "fill": own.fill,
    }
    if magnet and magnet.remanence:
        force = force_over_stroke(
            own,
            remanence=magnet.remanence,
            radius=magnet.radius,
            height=magnet.height,
            gap=winding.gap,
        )
        result |= {
            "force_factor_n_per_a": force.force_factor,
            "nearer_by_0_1_mm": force.nearer,
            "farther_by_0_1_mm": force.farther,
        }
    return result


OF_TWO = (
    *("isolation_db", "click_db", "click_um", "level_db", "finger_um", "unfelt", "unfelt_pressing"),
    "perturbed",
)


def score_rows(
    board: Board, score: BoardScore, one: CountScore, two: CountScore | None
) -> dict[str, Any]:
    """What a score has: first what the board is made for.

    `one` and `two` are of drives that devices find for the fingers that are there.
    """
    alone = {key: value for key, value in asdict(score).items() if key != "maps"}
    several = {"two_fingers": {key: asdict(two)[key] for key in OF_TWO} if two else None}
    several["one_finger"] = {"finger_um": asdict(one)["finger_um"]}
    return several | alone if board.is_for_several else alone | several


def say_softening(softening: MagnetSoftening) -> None:
    """Warn where magnets take away much of what holds them."""
    if softening.softened is not None and softening.softened > MATTERS:
        say(
            f"the magnets push each other out of their plane and take {softening.softened:.0%} of "
            "what holds them: put them farther apart, or turn every other one over"
        )


def say_warm_magnets(built: AsBuilt) -> None:
    """Warn of drives that a magnet does not bear without end."""
    if built.warm_magnet_c is not None and built.warm_magnet_c > MAGNET_C:
        say(
            f"drives without end warm a magnet to {built.warm_magnet_c:.0f} °C at the "
            f"worst tenth of places, and N42 bears {MAGNET_C:g} °C: end touches after seconds "
            "(max_on_s), or set electronics.coil_limit_k lower"
        )


def say_vent(board: Board) -> None:
    """Warn of shut-in air that is stiffer than what the plate lies on."""
    foundation = board.foundation
    if foundation and foundation.air_stiffness > foundation.sheet_stiffness:
        say(
            f"shut-in air ({foundation.air_stiffness * MM**3:.3g} N/mm³) is stiffer than "
            f"the sheet ({foundation.sheet_stiffness * MM**3:.3g}): vent it"
        )
