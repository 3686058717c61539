"""Whether what carries a plate can be so: its foundation, screws, springs and masses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chladni.sim.board.catalogue import foot_radius
from chladni.sim.board.foundation import Foundation
from chladni.sim.board.parts import SCREW_SUPPORTS, BoardParts, Plate
from chladni.sim.board.quantity import MM, SAME_PLACE, check_choice, check_ranges, in_mm
from chladni.sim.errors import ConflictError, InputError, MissingError

MOST_STIFFNESS = 1e11
"""N/m³: a millimetre of what is a hundred times as stiff as rubber."""
THINNEST = 0.1e-3
"""m of foam or rubber that is sold."""
Disc = tuple[str, tuple[float, float], float]
"""Key in the file, place and radius, m."""


def check_supports(board: BoardParts) -> None:
    """Refuse what has no answer on a thin plate: a slope held, or resisted, at a point."""
    for index, screw in enumerate(board.screws):
        where = f"screws[{index}]"
        if screw.support not in SCREW_SUPPORTS:
            expected = "one of: " + ", ".join(map(repr, SCREW_SUPPORTS))
            raise InputError(f"{where}.support", screw.support, expected)
        if screw.radius <= 0.0:
            raise InputError(
                f"{where}.radius_mm",
                0.0,
                "a radius above 0: a clamp at a point has no limit on a thin plate",
                hint="use a pin",
            )
        is_sprung = screw.stiffness > 0.0 or screw.rotational_stiffness > 0.0
        if is_sprung != (screw.support == "sprung"):
            raise InputError(
                f"{where}.support",
                screw.support,
                "'sprung' with a stiffness, or 'clamped' or 'pinned' without one",
            )
    _check_feet(board)
    radius = board.plate.corner_radius
    fits = 2.0 * radius <= min(board.plate.size) and board.plate.edges.are_all("free")
    if radius > 0.0 and not fits:
        raise InputError(
            "plate.corner_radius_mm",
            float(f"{radius / MM:.9g}"),
            "at most half the short side, and all edges free",
        )
    for index, spring in enumerate(board.springs):
        if spring.rotational_stiffness > 0.0:
            raise InputError(
                f"springs[{index}].rotational_n_mm_per_rad",
                spring.rotational_stiffness / MM,
                "nothing: a rotational spring at a point has no limit on a thin plate",
                hint="use a sprung screw, which has a rim",
            )
    for index, screw in enumerate(board.screws):
        if screw.loss_factor is not None and screw.support != "sprung":
            where, given = f"screws[{index}].loss_factor", screw.loss_factor
            expected = "nothing: what holds the plate rigidly loses nothing"
            raise InputError(where, given, expected, hint="set support to 'sprung'")
    for index, mass in enumerate(board.masses):
        if mass.radius == 0.0 and (mass.height > 0.0 or mass.stiffness_ratio != 1.0):
            raise InputError(
                f"masses[{index}].radius_mm",
                0.0,
                "a radius above 0 for a mass with a height or a stiffness: both need an area",
            )


def is_rounded_off(plate: Plate, at: tuple[float, float], radius: float) -> bool:
    """Whether a disc reaches into what the plate's round corners take away."""
    corner = plate.corner_radius
    beyond = np.maximum(np.abs(at) - (np.array(plate.size) / 2.0 - corner), 0.0)
    return bool(np.all(beyond > 0.0) and np.hypot(*beyond) + radius > corner)


def said_of_corners(plate: Plate) -> str:
    """For who placed something there."""
    return f"the plate's corners are round, by {plate.corner_radius / MM:g} mm"


def _check_feet(board: BoardParts) -> None:
    """Feet of a known size stand clear of each other, and of magnets and windings below too.

    A winding stands on the ground that a foot reaches.
    """
    feet = [(f"springs[{k}]", own.at, foot_radius(own)) for k, own in enumerate(board.springs)]
    magnet = board.magnet.radius if board.magnet else 0.0
    winding = board.winding.outer / 2.0 if board.winding else 0.0
    what, widest = ("winding", winding) if winding > magnet else ("magnet", magnet)
    coils = [(f"the {what} of {own.name!r}", own.at, widest) for own in board.actuators]
    for index, (name, at, radius) in enumerate(feet):
        if radius == 0.0:
            continue
        x, y = (side / 2.0 - radius for side in board.plate.size)
        rounded_off = is_rounded_off(board.plate, at, radius - SAME_PLACE)
        if abs(at[0]) > x + SAME_PLACE or abs(at[1]) > y + SAME_PLACE or rounded_off:
            limits = f"|x| up to {x / MM:g}, |y| up to {y / MM:g}"
            expected = f"a place where the whole foot is under the plate: {limits}"
            hint = said_of_corners(board.plate) if rounded_off else ""
            raise InputError(f"{name}.at_mm", in_mm(at), expected, hint=hint)
        for other, there, reach in (*feet[:index], *(coils if widest else ())):
            apart = float(np.hypot(*np.subtract(at, there)))
            if apart < radius + reach - SAME_PLACE:
                raise InputError(
                    f"{name}.at_mm",
                    in_mm(at),
                    f"a foot of {2.0 * radius / MM:g} mm clear of {other}",
                    hint=f"their middles are {apart / MM:.4g} mm apart and need "
                    f"{(radius + reach) / MM:.4g}",
                )


def check_foundation(board: BoardParts, discs: Sequence[Disc]) -> None:
    """Raise `InputError` at the first thing wrong with a board's foundation.

    Parameters
    ----------
    discs
        Everything on the plate that has a radius.
    """
    own = board.foundation
    if own is None:
        return
    check_ranges(own.strips, "foundation.strips")
    for index, cut in enumerate(own.cut_outs):
        check_ranges(cut, f"foundation.cut_outs[{index}]")
    _check_patches(board)
    _check_stiffness(board)
    for sides, pair in (
        (own.strips.left + own.strips.right, ("left", "right")),
        (own.strips.bottom + own.strips.top, ("bottom", "top")),
    ):
        side = board.plate.size[0 if pair[0] == "left" else 1]
        if sides > side:
            raise InputError(
                f"foundation.strips.{pair[0]}_mm and {pair[1]}_mm",
                sides / MM,
                f"{side / MM:g} mm together at most, the plate's side",
            )
    _check_cut_outs(board, discs)
    _check_holes(board)


def _check_patches(board: BoardParts) -> None:
    """Patches are of the sheet, each at a place of its own on the plate."""
    own = board.foundation
    assert own is not None
    places: list[tuple[float, float]] = []
    for index, patch in enumerate(own.patches):
        where = f"foundation.patches[{index}]"
        check_ranges(patch, where)
        if not board.contains(*patch.at):
            raise InputError(f"{where}.at_mm", in_mm(patch.at), "a place on the plate")
        if any(np.hypot(*np.subtract(patch.at, at)) < SAME_PLACE for at in places):
            raise InputError(f"{where}.at_mm", in_mm(patch.at), "a place of its own")
        places.append(patch.at)
    if own.patches and own.sealed_air:
        raise ConflictError(
            "foundation.patches", "foundation.sealed_air_mm", hint="air is as stiff everywhere"
        )


def _check_holes(board: BoardParts) -> None:
    """No edge of a strip goes through a hole of the plate."""
    for index, hole in enumerate(board.holes):
        x, y = hole.at
        for strip in board.foundation_strips:
            x0, x1, y0, y1 = strip
            inside = x0 <= x - hole.radius and x + hole.radius <= x1
            inside = inside and y0 <= y - hole.radius and y + hole.radius <= y1
            outside = _off_strip(hole.at, strip) >= hole.radius
            if not inside and not outside:
                raise InputError(
                    f"holes[{index}].at_mm",
                    in_mm(hole.at),
                    "a hole wholly on a strip of the foundation, or off it",
                )


def _check_stiffness(board: BoardParts) -> None:
    own = board.foundation
    assert own is not None
    check_choice(Foundation, "material", own.material, "foundation.material")
    if own.material and own.stiffness:
        raise ConflictError("foundation.stiffness_n_per_mm3", "foundation.material")
    if own.thickness and not own.material:
        raise MissingError("foundation.material", "thickness_mm says how much of it")
    if own.sealed_air and not own.strips.is_none:
        raise ConflictError(
            "foundation.sealed_air_mm",
            "foundation.strips",
            hint="air would fill what is between them",
        )
    if 0.0 < own.thickness < THINNEST:
        raise InputError(
            "foundation.thickness_mm",
            own.thickness / MM,
            f"{THINNEST / MM:g} or more: foam is not thinner",
            hint="metres? these are millimetres",
        )
    if own.material and not own.thickness:
        raise MissingError("foundation.thickness_mm", "a material's stiffness goes with it")
    if own.total_stiffness > MOST_STIFFNESS:
        thin = "sealed_air_mm" if own.air_stiffness > own.sheet_stiffness else "thickness_mm"
        raise InputError(
            f"foundation.{thin}",
            own.total_stiffness * MM**3,
            f"a foundation of at most {MOST_STIFFNESS * MM**3:g} N/mm³",
        )
    if not own.total_stiffness:
        raise MissingError(
            "foundation.stiffness_n_per_mm3",
            "in N/mm³, or a material with its thickness_mm, or sealed_air_mm",
        )


def _check_cut_outs(board: BoardParts, others: Sequence[Disc]) -> None:
    """Cut-outs lie on the plate, clear of each other and of all that is not in their middle."""
    assert board.foundation is not None
    half = np.array(board.plate.size) / 2.0
    magnet, hole = board.magnet, board.foundation.coil_cut_out
    if magnet is not None and 0.0 < hole < magnet.radius:
        least = f"at least {magnet.radius / MM:g}, a magnet's radius, or 0 for foam that it lies on"
        raise InputError("foundation.coil_cut_out_mm", float(f"{hole / MM:.9g}"), least)
    own = board.all_cut_outs
    explicit = len(board.foundation.cut_outs)
    names = [f"foundation.cut_outs[{k}]" for k in range(explicit)]
    names += [f"foundation.coil_cut_out_mm of actuators[{k}]" for k in range(len(own) - explicit)]
    for k, (name, cut) in enumerate(zip(names, own, strict=True)):
        if np.any(np.abs(cut.at) + cut.radius > half + 1e-9):
            raise InputError(
                f"{name}", in_mm(cut.at), "a cut-out that lies on the plate as a whole"
            )
        before = [(names[j], own[j].at, own[j].radius) for j in range(k)]
        for other, at, radius in (*before, *others):
            apart = float(np.hypot(*np.subtract(at, cut.at)))
            is_middle = apart < SAME_PLACE and other not in names
            if apart < cut.radius + radius and not is_middle:
                value = in_mm(cut.at)
                raise InputError(
                    name,
                    value if k < explicit else float(f"{cut.radius / MM:.9g}"),
                    f"a cut-out clear of {other}",
                    hint=f"they are {apart / MM:.3g} mm apart, "
                    f"{(cut.radius + radius) / MM:.3g} would do",
                )


def _off_strip(at: tuple[float, float], strip: tuple[float, float, float, float]) -> float:
    """How far a place lies from a strip of foundation, m; 0 on it."""
    x0, x1, y0, y1 = strip
    return float(np.hypot(at[0] - np.clip(at[0], x0, x1), at[1] - np.clip(at[1], y0, y1)))


def has_foam_at_coils(board: BoardParts, reach: float) -> bool:
    """Whether foam lies within so many m of a coil's middle: strips may leave all of them out."""
    return board.foundation is not None and (
        not board.foundation_strips
        or any(
            _off_strip(own.at, strip) < reach
            for own in board.actuators
            for strip in board.foundation_strips
        )
    )
