"""The touch panel's layer: what is glued to the plate bends and moves with it."""

from __future__ import annotations

from typing import Any

from chladni.sim.board.electronics import PANEL_PLACES, PANEL_SIDES, Panel
from chladni.sim.board.parts import BoardParts, Plate
from chladni.sim.board.plate_materials import SHEETS
from chladni.sim.board.quantity import MM
from chladni.sim.board.section import Layer, Section, section_of
from chladni.sim.errors import InputError, MissingError

GLUE_DENSITY = 1000.0
"""kg/m³, of acrylic glues."""
NUMBERS = ("youngs_modulus", "poissons_ratio", "density", "loss_factor")
KEYS = ("youngs_modulus_gpa", "poissons_ratio", "density_kg_m3", "loss_factor")


def plate_section(board: BoardParts) -> Section:
    """A board's plate with its panel's layer, as one plate."""
    plate, panel = board.plate, board.panel
    if panel is None or not panel.layer_thickness:
        return Section(
            plate.bending_stiffness, plate.poissons_ratio, plate.areal_mass, plate.loss_factor
        )
    layers = [_sheet(plate), Layer(panel.glue, 0.0, 0.0, GLUE_DENSITY, 0.0), layer_of(panel)]
    # A section is the same seen from either side.
    return section_of([layer for layer in layers if layer.thickness > 0.0])


def _sheet(plate: Plate) -> Layer:
    return Layer(
        plate.thickness,
        plate.youngs_modulus,
        plate.poissons_ratio,
        plate.density,
        plate.loss_factor,
    )


def layer_of(panel: Panel) -> Layer:
    """The layer's own numbers, those of its material where it has none.

    Raises
    ------
    InputError
        There is no such material, and a number of it is left out.
    """
    name = panel.material or ("glass" if panel.glass else "pet")
    known: dict[str, Any] = SHEETS.get(name, {})
    own = [getattr(panel, number) for number in NUMBERS]
    lacking = [key for key, value in zip(KEYS, own, strict=True) if value is None]
    if lacking and not known:
        materials = ", ".join(map(repr, SHEETS))
        expected = f"one of: {materials}, or with {', '.join(lacking)}"
        raise InputError("panel.material", name, expected)
    scales = (1e9, 1.0, 1.0, 1.0)
    modulus, ratio, density, loss = (
        known[key] * scale if value is None else value
        for key, value, scale in zip(KEYS, own, scales, strict=True)
    )
    return Layer(panel.layer_thickness, modulus, ratio, density, loss)


def check_layer(board: BoardParts) -> None:
    """Refuse a layer that is none, or two, or that carries the plate in place of the reverse."""
    panel, plate = board.panel, board.plate
    if panel is None:
        return
    if panel.place not in PANEL_PLACES:
        expected = "one of: " + ", ".join(map(repr, PANEL_PLACES[1:]))
        raise InputError("panel.place", panel.place, expected)
    if panel.side not in PANEL_SIDES:
        hint = "a panel is on one side: give a plate of several layers its own modulus"
        raise InputError("panel.side", panel.side, "'top' or 'under'", hint=hint)
    if panel.film and panel.glass:
        hint = "a panel is one layer: add up films, or model the glass as [plate]"
        raise InputError("panel.glass_mm", panel.glass / MM, "nothing beside film_mm", hint=hint)
    if panel.place in ("in", "beside") and panel.layer_thickness:
        raise InputError("panel.place", panel.place, "'on' where a layer is glued to the plate")
    if panel.place == "on" and not panel.layer_thickness:
        raise MissingError("panel.film_mm", "or glass_mm: how thick what is glued on the plate is")
    if panel.glass > plate.thickness:
        raise InputError(
            "panel.glass_mm",
            panel.glass / MM,
            f"at most the plate's thickness, {plate.thickness / MM:g}",
            hint="such a glass is the plate, and the sheet its film: make it [plate]",
        )
    if panel.layer_thickness:
        layer_of(panel)
