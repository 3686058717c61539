"""Coils that follow from their winding: what board files may leave out, and what must agree."""

from __future__ import annotations

import copy
import dataclasses
import tomllib
from typing import Any

import pytest

from chladni.sim.board.board import to_document
from chladni.sim.board.file import board_from_document, load_board
from chladni.sim.errors import InputError, MissingError
from chladni.sim.magnetics.windings import force_per_ampere
from conftest import ROOT

SHIPPED = ("strip5", "quiet5", "pad16", "quiet16", "phone15")


def strip5(**changes: Any) -> dict[str, Any]:
    """Its document, blocks changed key by key; `None` takes a key away."""
    text = (ROOT / "boards" / "strip5.toml").read_text(encoding="utf-8")
    document = copy.deepcopy(tomllib.loads(text))
    for block, values in changes.items():
        if values is None:
            del document[block]
            continue
        document.setdefault(block, {}).update(values)
        document[block] = {k: v for k, v in document[block].items() if v is not None}
    return document


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_coil_is_what_its_winding_makes(name: str) -> None:
    """To the four digits that are kept of it; the file itself says none of the three."""
    board = load_board(name)
    text = (ROOT / "boards" / f"{name}.toml").read_text(encoding="utf-8")
    assert set(tomllib.loads(text)["coil"]).isdisjoint(
        {"resistance_ohm", "inductance_mh", "force_factor_n_per_a"}
    )
    coil, winding, magnet = board.coil, board.winding, board.magnet
    assert coil is not None
    assert winding is not None
    assert magnet is not None
    wire = 4.0 * 1.68e-8 * winding.turns * (winding.inner + winding.outer) / 2.0 / winding.wire**2
    assert coil.resistance == pytest.approx(wire, rel=5e-4)
    assert board.electronics.coil_ohm == coil.resistance
    force = force_per_ampere(
        winding.round,
        remanence=magnet.remanence,
        radius=magnet.radius,
        height=magnet.height,
        gap=winding.gap,
    )
    assert coil.force_factor == pytest.approx(force, rel=5e-4)


def test_a_board_with_a_winding_survives_the_way_through_its_document() -> None:
    board = load_board("strip5")
    assert board_from_document(to_document(board)) == board


def test_what_is_measured_comes_before_what_is_computed() -> None:
    """As long as it is the same winding: a quarter off at most."""
    measured = {"force_factor_n_per_a": 0.6, "resistance_ohm": 14.0, "inductance_mh": 0.5}
    board = board_from_document(strip5(coil=measured))
    assert board.coil is not None
    assert (board.coil.force_factor, board.coil.resistance) == (0.6, 14.0)
    # Without a remanence only the force has to be given.
    assert board_from_document(
        strip5(coil={"force_factor_n_per_a": 0.3}, magnet={"remanence_t": None})
    ).coil


DISAGREEING = [
    ({"coil": {"force_factor_n_per_a": 1.0}}, "coil.force_factor_n_per_a"),
    ({"coil": {"inductance_mh": 0.1}}, "coil.inductance_mh"),
    ({"coil": {"resistance_ohm": 25.0}}, "electronics.coil_ohm"),
    ({"coil": {"resistance_ohm": 25.0}, "electronics": {"coil_ohm": 25.0}}, "electronics.coil_ohm"),
    ({"electronics": {"coil_ohm": 7.0}}, "electronics.coil_ohm"),
    ({"winding": {"inner_mm": 10.0}}, "winding.inner_mm"),
    ({"winding": {"turns": 3000}}, "winding.turns"),
    ({"winding": {"turns": 1.5}}, "winding.turns"),
    ({"winding": {"gap_mm": -1.0}}, "winding.gap_mm"),
    ({"winding": {"gap_mm": -10.0, "inner_mm": 7.0, "turns": 100}}, "winding.gap_mm"),
    ({"winding": {"gap_mm": 0.001}}, "winding.gap_mm"),  # metres
    ({"winding": {"wire_mm": None}}, "winding.wire_mm"),
    ({"winding": {"wires_mm": 0.1}}, "winding.wires_mm"),
    ({"magnet": {"remanence_t": None}}, "magnet.remanence_t"),
    ({"magnet": {"remanence_t": 3.0}}, "magnet.remanence_t"),
    ({"magnet": {"height_mm": 0.0}}, "magnet.height_mm"),
    ({"plate": {"material": "FR4\n"}}, "plate.material"),
]


@pytest.mark.parametrize(("changes", "field"), DISAGREEING)
def test_what_cannot_be_one_winding_is_named(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as caught:
        board_from_document(strip5(**changes))
    assert caught.value.field == field


def test_the_message_says_what_follows_and_what_to_do() -> None:
    with pytest.raises(InputError, match=r"about 0\.6717, as \[winding\] .* leave it out"):
        board_from_document(strip5(coil={"force_factor_n_per_a": 1.0}))
    with pytest.raises(MissingError, match=r"coil\.force_factor_n_per_a"):
        board_from_document(strip5(magnet=None))
    board = load_board("strip5")
    assert board.coil is not None
    with pytest.raises(InputError, match="winding"):
        dataclasses.replace(board, coil=dataclasses.replace(board.coil, force_factor=1.0))


def test_drives_depend_on_what_a_winding_makes_and_not_on_how() -> None:
    """The same numbers, given; and names for parts lists."""
    board = load_board("strip5")
    given = dataclasses.replace(board, winding=None)
    # Without it no one knows what coils do to the magnets beside theirs.
    assert given.fingerprint() != board.fingerprint()
    assert board.magnet is not None
    weaker = dataclasses.replace(board.magnet, remanence=1.0)
    unnamed = dataclasses.replace(board.plate, material="")
    assert dataclasses.replace(given, magnet=weaker, plate=unnamed).fingerprint() == (
        given.fingerprint()
    )
    # One of unknown remanence is the paper's disc, which does not tilt.
    paper = dataclasses.replace(board.magnet, remanence=0.0)
    assert dataclasses.replace(given, magnet=paper).fingerprint() != given.fingerprint()
    thin = board_from_document(strip5(winding={"wire_mm": 0.09}))
    assert thin.fingerprint() != board.fingerprint()


def test_foam_in_si_units_is_asked_about() -> None:
    stiff = strip5(foundation={"stiffness_n_per_mm3": 6e7, "material": None})
    with pytest.raises(InputError, match="N/m³\\? this is in N/mm³"):
        board_from_document(stiff)
