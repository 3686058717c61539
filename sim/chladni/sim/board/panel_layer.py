"""The touch panel's layer: what is glued to the plate bends and moves with it.

Layers are bonded without slip. That is the stiffest they can be together: a soft glue shears, and
leaves less (a film on 50 µm of optical glue at wavelengths below some centimetres).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from chladni.sim.board.catalogue import SHEETS
from chladni.sim.board.electronics import PANEL_SIDES, Panel
from chladni.sim.board.parts import BoardParts, Plate
from chladni.sim.board.quantity import MM, check_choice
from chladni.sim.errors import InputError, MissingError

GLUE_DENSITY = 1000.0
"""kg/m³, of acrylic glues."""
STIFF_LAYER = 2.0
"""From this bending ratio on a layer takes the focus: a point's answer on foam is 1/√D, so 3 dB."""
NUMBERS = ("youngs_modulus", "poissons_ratio", "density", "loss_factor")
KEYS = ("youngs_modulus_gpa", "poissons_ratio", "density_kg_m3", "loss_factor")


@dataclass(frozen=True)
class Layer:
    """One isotropic layer. SI units."""

    thickness: float
    youngs_modulus: float
    poissons_ratio: float
    density: float
    loss_factor: float


@dataclass(frozen=True)
class PlateSection:
    """What bends and moves, as one plate.

    Attributes
    ----------
    bending_stiffness
        D, N·m.
    poissons_ratio
        Of bending: the share D₁₂/D₁₁.
    areal_mass
        kg/m².
    loss_factor
        η in D(1 + iη).
    stretching_stiffness
        The sum of E h/(1 − ν²), N/m.
    """

    bending_stiffness: float
    poissons_ratio: float
    areal_mass: float
    loss_factor: float
    stretching_stiffness: float


def section_of(layers: Sequence[Layer]) -> PlateSection:
    """Layers from the bottom up, as one plate that is free to stretch.

    Classical laminate theory. For isotropic layers the stiffnesses of equal curvatures, with
    E/(1 − ν), and of opposite ones, with E/(1 + ν), do not meet: with A, B and D the sums of
    E' h, E' h z and E' (h z² + h³/12), each leaves D − B²/A. Moduli are E(1 + iη), so that the loss
    is each layer's share of the bending energy.

    References
    ----------
    R. M. Jones, Mechanics of Composite Materials, 2nd ed., chapter 4.
    """
    total = sum(layer.thickness for layer in layers)
    even = _reduced(layers, total, -1.0)
    odd = _reduced(layers, total, 1.0)
    d11, d12 = (even + odd) / 2.0, (even - odd) / 2.0
    return PlateSection(
        d11.real,
        d12.real / d11.real,
        sum(layer.density * layer.thickness for layer in layers),
        d11.imag / d11.real,
        sum(_stretching(layer) for layer in layers),
    )


def _reduced(layers: Sequence[Layer], total: float, sign: float) -> complex:
    """D − B²/A with the modulus E(1 + iη)/(1 ± ν)."""
    a = b = d = 0.0 + 0.0j
    bottom = -total / 2.0
    for layer in layers:
        h = layer.thickness
        z = bottom + h / 2.0
        own = layer.youngs_modulus * (1.0 + 1j * layer.loss_factor)
        own /= 1.0 + sign * layer.poissons_ratio
        a += own * h
        b += own * h * z
        d += own * (h * z**2 + h**3 / 12.0)
        bottom += h
    return d - b**2 / a


def plate_section(board: BoardParts) -> PlateSection:
    """A board's plate with its panel's layer, as one plate."""
    plate, panel = board.plate, board.panel
    if panel is None or not panel.layer_thickness:
        return PlateSection(
            plate.bending_stiffness,
            plate.poissons_ratio,
            plate.areal_mass,
            plate.loss_factor,
            _stretching(_sheet(plate)),
        )
    layers = [_sheet(plate), Layer(panel.glue, 0.0, 0.0, GLUE_DENSITY, 0.0), layer_of(panel)]
    # A section is the same seen from either side.
    return section_of([layer for layer in layers if layer.thickness > 0.0])


@dataclass(frozen=True)
class LayeredPlate:
    """What a touch panel makes of the plate that carries it.

    Attributes
    ----------
    sheet
        What carries it, bare.
    place
        Where the panel lies; "not said" where nothing tells.
    layer_thickness
        m; 0 without a layer on the plate.
    bending_ratio, mass_ratio
        Bending stiffness and areal mass over those of the bare plate.
    """

    sheet: Plate
    place: str
    layer_thickness: float
    bending_ratio: float
    mass_ratio: float

    @property
    def is_stiff(self) -> bool:
        """Whether the layer takes the focus."""
        return self.bending_ratio >= STIFF_LAYER


def layered_plate(board: BoardParts) -> LayeredPlate | None:
    """A board's plate with its panel; None without a panel."""
    panel, plate = board.panel, board.plate
    if panel is None:
        return None
    section = plate_section(board)
    return LayeredPlate(
        plate,
        panel.place or ("on" if panel.layer_thickness else "not said"),
        panel.layer_thickness,
        section.bending_stiffness / plate.bending_stiffness,
        section.areal_mass / plate.areal_mass,
    )


def _stretching(layer: Layer) -> float:
    return layer.youngs_modulus * layer.thickness / (1.0 - layer.poissons_ratio**2)


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
    known: dict[str, Any] = SHEETS.get(panel.layer_material, {})
    own = [getattr(panel, number) for number in NUMBERS]
    lacking = [key for key, value in zip(KEYS, own, strict=True) if value is None]
    if lacking and not known:
        materials = ", ".join(map(repr, SHEETS))
        expected = f"one of: {materials}, or with {', '.join(lacking)}"
        raise InputError("panel.material", panel.layer_material, expected)
    scales = (1e9, 1.0, 1.0, 1.0)
    modulus, ratio, density, loss = (
        known[key] * scale if value is None else value
        for key, value, scale in zip(KEYS, own, scales, strict=True)
    )
    return Layer(panel.layer_thickness, modulus, ratio, density, loss)


def check_panel(board: BoardParts) -> None:
    """Refuse a panel that there is not, or that lies as none can."""
    panel = board.panel
    if panel is None:
        return
    check_choice(Panel, "controller", panel.controller, "panel.controller")
    if panel.rotation_deg % 90 != 0:
        raise InputError("panel.rotation_deg", panel.rotation_deg, "0, 90, 180 or 270")
    if not isinstance(panel.mirrored, bool):
        raise InputError("panel.mirrored", panel.mirrored, "true or false")
    _check_layer(panel, board.plate)


def _check_layer(panel: Panel, plate: Plate) -> None:
    """Refuse a layer that is none, or two, or that carries the plate in place of the reverse."""
    check_choice(Panel, "place", panel.place, "panel.place")
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
