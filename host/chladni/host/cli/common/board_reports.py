"""What `board show` reports of a board's parts, and what it warns of."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from chladni.drives.scoring.as_built import AsBuilt
from chladni.host.cli.common.output import say
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import CLOCK_HZ
from chladni.sim.board.quantity import MM
from chladni.sim.coil.circuit import circuit_of, current_wave
from chladni.sim.coil.full_drive import least_duty
from chladni.sim.fields.neighbours import MATTERS, Neighbours
from chladni.sim.image import metrics
from chladni.sim.magnetics.windings import force_per_ampere

STROKE = 1e-4
"""m, either way: far more than a board vibrates, less than a finger presses."""

ROOM_C, MAGNET_C = 25.0, 80.0
"""°C: of a room, and what sintered NdFeB of plain grade keeps its remanence up to."""
STIFF_LAYER = 2.0
"""From where on a layer is warned of: a point's answer on foam is 1/√D, so 3 dB of level."""


def current_report(board: Board) -> dict[str, Any]:
    """What becomes of a soft sine as a coil's current, and why: a diode's drop, a bridge's loss.

    A tenth is of the largest amplitude that the duty allows, with a switch's bias as the firmware
    adds it.
    """
    circuit = circuit_of(board)
    assert circuit is not None
    if board.electronics.is_bridge:
        wave = current_wave(circuit, 0.1, 0.0)
        return {
            "lost_duty": board.electronics.lost_ns
            * 1e-9
            * CLOCK_HZ
            / 2**board.electronics.pwm_bits,
            "level_db_at_tenth": metrics.decibel(wave.gain**2),
            "third_harmonic_at_tenth": wave.third,
        }
    edge, rest = circuit.continuous_from(), least_duty(board)
    wave = current_wave(circuit, 0.05, 0.05 + rest)
    return {
        "continuous_from_duty": edge,
        "least_duty": rest,
        "level_db_at_tenth": metrics.decibel(wave.gain**2),
        "second_harmonic_at_tenth": wave.second,
    }


def say_current(board: Board) -> None:
    """Where a flyback diode bends soft waves."""
    if board.electronics.is_bridge:
        return
    found = current_report(board)
    if found["least_duty"] < found["continuous_from_duty"]:
        say(
            f"below {found['continuous_from_duty']:.3f} of duty a flyback diode stops the coils' "
            f"current and bends their sine: set electronics.least_duty to "
            f"{np.ceil(100.0 * found['continuous_from_duty']) / 100.0:g}"
        )


def panel_report(board: Board) -> dict[str, Any]:
    """What a touch panel makes of the plate that carries it."""
    panel, section = board.panel, board.section
    assert panel is not None
    return {
        "place": panel.place or ("on" if panel.layer_thickness else "not said"),
        "layer_mm": panel.layer_thickness / MM,
        "stiffness_ratio": section.bending_stiffness / board.plate.bending_stiffness,
        "mass_ratio": section.areal_mass / board.plate.areal_mass,
    }


def say_panel(board: Board) -> None:
    """Where a panel takes the focus, or its place is not given."""
    found = panel_report(board)
    if found["stiffness_ratio"] >= STIFF_LAYER:
        say(
            f"the panel's layer makes the plate {found['stiffness_ratio']:.1f} times as stiff: a "
            "focus needs a soft sheet; use a thinner film, or electrodes in the sheet or beside it"
        )
    elif found["place"] == "not said":
        say('the panel bends with the plate unless panel.place is "in" or "beside": say film_mm')


def foundation_report(board: Board) -> dict[str, Any]:
    """What a board lies on: stiffness, and what that does to a plate without edges.

    `decay_mm` is λ = (D/k)^¼ of the Kelvin function that a point force makes, `cut_off_hz` is
    √(k/ρh)/2π, below which no wave travels.
    """
    foundation, section = board.foundation, board.section
    assert foundation is not None
    stiffness = foundation.total_stiffness
    return {
        "stiffness_n_per_mm3": stiffness * MM**3,
        "loss_factor": foundation.total_loss_factor,
        "decay_mm": (section.bending_stiffness / stiffness) ** 0.25 / MM,
        "cut_off_hz": float(np.sqrt(stiffness / section.areal_mass) / (2.0 * np.pi)),
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
        forces = [
            force_per_ampere(
                own,
                remanence=magnet.remanence,
                radius=magnet.radius,
                height=magnet.height,
                gap=winding.gap + off,
            )
            for off in (-STROKE, 0.0, STROKE)
        ]
        result |= {
            "force_factor_n_per_a": forces[1],
            "nearer_by_0_1_mm": forces[0] / forces[1] - 1.0,
            "farther_by_0_1_mm": forces[2] / forces[1] - 1.0,
        }
    return result


def say_neighbours(pushes: Neighbours) -> None:
    """Warn where magnets take away much of what holds them."""
    if pushes.softened is not None and pushes.softened > MATTERS:
        say(
            f"the magnets push each other out of their plane and take {pushes.softened:.0%} of "
            "what holds them: put them farther apart, or turn every other one over"
        )


def say_warm_magnets(built: AsBuilt) -> None:
    """Warn of drives that a magnet does not bear without end."""
    if built.magnet_k is not None and ROOM_C + built.magnet_k.p90 > MAGNET_C:
        say(
            f"drives without end warm a magnet to {ROOM_C + built.magnet_k.p90:.0f} °C at the "
            f"worst tenth of places, and N42 bears {MAGNET_C:g} °C: end touches after seconds "
            "(max_on_s), or set electronics.coil_limit_k lower"
        )


def say_vent(board: Board) -> None:
    """Warn of shut-in air that is stiffer than what the plate lies on."""
    foundation = board.foundation
    if foundation and foundation.air_stiffness > foundation.sheet_stiffness:
        sys.stderr.write(
            f"chladni: shut-in air ({foundation.air_stiffness * MM**3:.3g} N/mm³) is stiffer than "
            f"the sheet ({foundation.sheet_stiffness * MM**3:.3g}): vent it\n"
        )
