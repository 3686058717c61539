"""All parts of a board: what is cut, glued and screwed, and what it is wired with."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from chladni.host.manufacture.wiring.part import Part
from chladni.host.manufacture.wiring.parts import parts_list
from chladni.sim.board.board import Board
from chladni.sim.board.catalogue import FEET, lowest_foot
from chladni.sim.board.foundation import MATERIALS, Foundation
from chladni.sim.board.parts import Plate, Spring
from chladni.sim.board.quantity import MM

RIM = 1.5e-3
"""m of a ground plate that is left beside a coil's hole."""
GRADES = {
    "N35": 1.17, "N38": 1.22, "N40": 1.25, "N42": 1.28, "N45": 1.32, "N48": 1.38, "N50": 1.40,
    "N52": 1.43,
}  # fmt: skip
"""Least remanence of sintered NdFeB by grade, T, at 20 °C, as its makers list it."""


def board_parts(board: Board) -> tuple[Part, ...]:
    """Everything that has to be bought or made for a board; masses where the file says them.

    A panel's layer is sold with the panel.
    """
    layer = _layer(board)
    bought = [part for part in mechanical_parts(board) if part not in layer]
    for part in parts_list(board):
        own = part
        if layer and part.part == "touch panel":
            value = f"{part.value}, {layer[0].value}"
            own = replace(part, value=value, mass_g=layer[0].mass_g)
        bought.append(own)
    return tuple(bought)


def mechanical_parts(board: Board) -> tuple[Part, ...]:
    """Plate, what it lies on, what rides on it and what holds it."""
    return (
        _plate(board),
        *_layer(board),
        *_magnets(board),
        *_foam(board),
        *_riders(board),
        *_supports(board),
        *_ground(board),
    )


def moving_mass_g(board: Board) -> float:
    """Mass of the plate and of all that rides on it, g."""
    riding = ("plate", "panel's layer", "magnet", "glued disc", "mass")
    own = (part for part in mechanical_parts(board) if part.part in riding)
    return sum(part.count * (part.mass_g or 0.0) for part in own)


ANNEALED = "annealed AISI 304 or 316, for shim stock that was rolled hard is magnetic"
"""What a magnet does not hold to."""


def sheet_of(plate: Plate) -> str:
    """Of what it is cut, and how large."""
    sides = " × ".join(f"{side / MM:g}" for side in (*plate.size, plate.thickness))
    corners = f", corners R{plate.corner_radius / MM:g}" if plate.corner_radius else ""
    material = plate.material or f"E = {plate.youngs_modulus / 1e9:g} GPa"
    return f"{material}, {sides} mm{corners}"


def foam_of(foundation: Foundation) -> str:
    """What lies under the plate, and how thick it is; nothing where that is air."""
    if not foundation.sheet_stiffness:
        return ""
    what = foundation.material or f"{foundation.sheet_stiffness * MM**3:g} N/mm³"
    return what + (f", {foundation.thickness / MM:g} mm" if foundation.thickness else "")


def feet_of(springs: Sequence[Spring]) -> str:
    """Which feet a board stands on, and how many; nothing where there are none."""
    named = Counter(own.part or f"{own.stiffness * MM:g} N/mm" for own in springs)
    return ", ".join(f"{count} × {name}" for name, count in named.items())


def ground_holes_mm(board: Board) -> float:
    """How deep coils reach into what foam or feet stand on.

    0 where they have room under the plate, or no file has its height.
    """
    own = board.foundation
    room = own.thickness if own and own.thickness else lowest_foot(board.springs)
    return 0.0 if room is None else float(f"{max(0.0, board.below_plate - room) / MM:.3g}")


def _plate(board: Board) -> Part:
    plate = board.plate
    area = plate.area
    radii = [hole.radius for hole in board.holes] + [screw.radius for screw in board.screws]
    area -= math.pi * sum(radius**2 for radius in radii)
    grade = f"; {ANNEALED}" if plate.material == "stainless-steel" else ""
    return Part(
        "plate",
        1,
        sheet_of(plate),
        (f"{len(radii)} round holes" if radii else "no holes") + grade,
        mass_g=plate.areal_mass * area / 1e-3,
    )


def _layer(board: Board) -> list[Part]:
    """A panel's film or glass, glued on the plate; it moves with it."""
    panel, plate = board.panel, board.plate
    if panel is None or not panel.layer_thickness:
        return []
    sides = " × ".join(f"{side / MM:g}" for side in (*plate.size, panel.layer_thickness))
    mass = (board.section.areal_mass - plate.areal_mass) * plate.area
    what = f"{panel.layer_material}, {sides} mm"
    return [Part("panel's layer", 1, what, "glued on the plate", mass / 1e-3)]


def _magnets(board: Board) -> list[Part]:
    magnet = board.magnet
    if magnet is None:
        return []
    size = f"⌀{2.0 * magnet.radius / MM:g} × {magnet.height / MM:g} mm"
    grade = min(
        (g for g, least in GRADES.items() if least >= magnet.remanence),
        key=GRADES.__getitem__,
        default="",
    )
    what = f"disc {size}"
    if magnet.remanence:
        what = f"NdFeB {grade} disc {size}".replace("  ", " ")
    why = "glued under the plate over every coil, all the same way up"
    if magnet.remanence:
        why = f"at least {magnet.remanence:g} T; " + why
    mass = magnet.areal_mass * math.pi * magnet.radius**2
    return [Part("magnet", len(board.actuators), what, why, mass_g=mass / 1e-3)]


def _foam(board: Board) -> list[Part]:
    own = board.foundation
    if own is None or not own.sheet_stiffness:
        return []
    density = MATERIALS[own.material].density if own.material else None
    what = own.material or f"{own.sheet_stiffness * MM**3:g} N/mm³"
    # Cut-outs of strips may lie beside them, and there the mass is not said.
    holes = board.all_cut_outs
    is_whole = not board.foundation_strips
    under = _in_ground(board)
    pieces = board.foundation_strips or ((0.0, board.plate.size[0], 0.0, board.plate.size[1]),)
    parts = []
    for x0, x1, y0, y1 in pieces:
        thickness = (own.thickness,) if own.thickness else ()
        sides = " × ".join(f"{side / MM:.9g}" for side in (x1 - x0, y1 - y0, *thickness))
        mass = None
        if density and (is_whole or not holes):
            area = (x1 - x0) * (y1 - y0) - sum(math.pi * hole.radius**2 for hole in holes)
            area -= (4.0 - math.pi) * board.plate.corner_radius**2 if is_whole else 0.0
            mass = density * own.thickness * area / 1e-3
        cut = f"{len(holes)} round holes" if is_whole and holes else "holes as drawn"
        cut = cut if holes else "no holes"
        why = f"{cut}; {own.sheet_stiffness * MM**3:g} N/mm³"
        parts.append(Part("foam", 1, f"{what}, {sides} mm{under}", why, mass_g=mass))
    return parts


def _ground(board: Board) -> list[Part]:
    """What foam and feet stand on, and coils with them."""
    if not (board.foundation or board.springs):
        return []
    deep, sizes = ground_holes_mm(board), np.array(board.plate.size)
    if deep and board.winding:
        reach = np.abs([own.at for own in board.actuators]).max(axis=0) + board.winding.outer / 2.0
        sizes = np.maximum(sizes, 2.0 * (reach + RIM))
    what = f"rigid, {' × '.join(f'{np.ceil(side / MM):g}' for side in sizes)} mm or more"
    if deep and board.winding:
        wide = board.winding.outer / MM
        what += f"; {len(board.actuators)} holes wider than ⌀{wide:g}, {deep:g} mm deep"
    return [Part("ground plate", 1, what, "foam or feet, and coils stand on it")]


def _in_ground(board: Board) -> str:
    deep = ground_holes_mm(board)
    return f"; coils reach {deep:g} mm into the ground plate" if deep else ""


def _riders(board: Board) -> list[Part]:
    return [
        Part(
            "glued disc" if mass.radius else "mass",
            1,
            f"⌀{2.0 * mass.radius / MM:g} × {mass.height / MM:g} mm" if mass.radius else "a point",
            "the board file's",
            mass_g=mass.mass / 1e-3,
        )
        for mass in board.masses
    ]


def _rubber(name: str) -> str:
    """A foot's size and hardness, or what it may be."""
    own = FEET.get(name)
    if own is None:
        return name or "rubber or a spring"
    return f"{name}: ⌀{own.outer:g} × {own.height:g} mm, {own.shore_a:g} Shore A"


def _supports(board: Board) -> list[Part]:
    kinds = [
        ("screw with a grommet", own.part, f"{own.stiffness * MM:g} N/mm")
        if own.part
        else ("screw", f"⌀{2.0 * own.radius / MM:g} mm", str(own.support))
        for own in board.screws
    ]
    kinds += [
        ("foot", _rubber(own.part), f"{own.stiffness * MM:g} N/mm, at a point")
        for own in board.springs
    ]
    kinds += [("pin", "a point", "no deflection")] * len(board.pins)
    if board.below_plate:
        # No file has their height, but that of feet of the catalogue.
        room = f"; coils need {board.below_plate / MM:.3g} mm under the plate"
        known = {_rubber(name) for name in FEET}
        kinds = [
            (part, value + (_in_ground(board) if value in known else room), why)
            for part, value, why in kinds
        ]
    return [Part(part, count, value, why) for (part, value, why), count in Counter(kinds).items()]
