"""A switch or a bridge per coil: what a board file says of each, and every fault by its key."""

from __future__ import annotations

import dataclasses
import tomllib
from typing import Any

import pytest

from chladni.sim.board.board import Board, to_document
from chladni.sim.board.electronics import ChipName, Electronics
from chladni.sim.board.file import board_from_document, parse_board
from chladni.sim.board.gpio import CHIPS, pin_fault
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from wired_boards import SWITCHED

SIGNS = [12, 13, 14, 18, 19]


def document(**electronics: Any) -> dict[str, Any]:
    """Of `strip5` with bridges; None takes a key away."""
    made = tomllib.loads((SWITCHED / "strip5.toml").read_text(encoding="utf-8"))
    own = made["electronics"]
    for key in ("least_duty", "diode_v", "min_on_ns"):
        own.pop(key, None)
    own |= {"drive": "bridge", "sign_pins": SIGNS} | electronics
    made["electronics"] = {key: value for key, value in own.items() if value is not None}
    return made


def bridged(**electronics: Any) -> Board:
    return board_from_document(document(**electronics))


def test_a_board_has_switches_unless_it_says_otherwise(prototype: Board) -> None:
    assert prototype.electronics.drive == "switch"
    assert not prototype.electronics.is_bridge
    assert bridged().electronics.is_bridge


def test_all_keys_of_the_other_kind_of_driver_are_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        bridged(drive="switch", bridge_ohm=0.5)
    told = str(caught.value)
    assert "electronics.sign_pins" in told
    assert "electronics.bridge_ohm" in told


def test_no_pulse_of_a_bridge_is_too_short() -> None:
    own = bridged().electronics
    assert own.shortest_on_ns == 0.0
    switch = dataclasses.replace(own, drive="switch", sign_pins=())
    assert switch.shortest_on_ns == 100.0


def test_a_bridge_board_survives_the_way_through_its_document_and_its_file() -> None:
    board = bridged(lost_ns=55.0, bridge_ohm=0.5)
    assert board.electronics.lost_ns == 55.0
    assert board.electronics.bridge_ohm == 0.5
    assert board.electronics.sign_pins == tuple(SIGNS)
    assert board_from_document(to_document(board)) == board
    assert parse_board(board_file(board).decode(), file="b.toml") == board


def test_a_bridge_board_that_is_only_computed_has_no_pins() -> None:
    board = bridged(pwm_pins=[], sign_pins=None)
    assert parse_board(board_file(board).decode(), file="b.toml") == board
    with pytest.raises(InputError, match=r"sign_pins: expected 0 different pins"):
        bridged(pwm_pins=[])


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"drive": "half-bridge"}, r"electronics.drive: expected one of: 'switch', 'bridge', got"),
        ({"sign_pins": None}, r"electronics.sign_pins is required: 5 GPIOs, one per bridge; a "),
        ({"sign_pins": []}, r"electronics.sign_pins is required: 5 GPIOs"),
        ({"sign_pins": SIGNS[:4]}, r"electronics.sign_pins: expected 5 different pins, one for"),
        ({"sign_pins": [*SIGNS, 23]}, r"electronics.sign_pins: expected 5 different pins"),
        ({"sign_pins": [12, 13, 14, 18, 12]}, r"electronics.sign_pins: expected 5 different"),
        ({"sign_pins": [12, 13, 14, 18, 17]}, r"sign_pins: .* got 17; the gate of channel 4 has "),
        ({"sign_pins": [12, 13, 14, 18, 34]}, r"sign_pins: .* got 34; it is an input only, free"),
        ({"sign_pins": [12, 13, 14, 18, 20]}, r"sign_pins: .* got 20; this chip has no such pin"),
        ({"sign_pins": [12, 13, 14, 18, 9]}, r"sign_pins: .* got 9; it is the flash chip's, free"),
        ({"sign_pins": [12, 13, 14, 18, 3]}, r"sign_pins: .* got 3; it is UART0's"),
        ({"sign_pins": [12, 13, 14, 18, 0]}, r"sign_pins: .* got 0; it must be high at reset"),
        ({"sign_pins": [12, 13, 14, 18, 22]}, r"sign_pins: .* got 22; it is left for the panel's"),
        ({"sign_pins": [12, 13, 14, 18, 32]}, r"sign_pins: .* got 32; all signs are set by one "),
        ({"sign_pins": "12"}, r"electronics.sign_pins: expected a list of whole numbers"),
        ({"lost_ns": 501}, r"electronics.lost_ns: expected a number from 0 to 500, got 501"),
        ({"lost_ns": -1}, r"electronics.lost_ns: expected a number from 0 to 500"),
        ({"bridge_ohm": -0.1}, r"electronics.bridge_ohm: expected a number from 0 to 20"),
        ({"least_duty": 0.085}, r"least_duty does not go with .*\"bridge\"; .* leave it out, or"),
        ({"diode_v": 0.3}, r"electronics.diode_v does not go with electronics.drive = \"bridge\""),
        ({"diode_v": 0.0}, r"electronics.diode_v does not go with electronics.drive = \"bridge\""),
        ({"diode_v": 0.25}, r"electronics.diode_v does not go with"),  # its default, said
        ({"min_on_ns": 80.0}, r"min_on_ns does not go with .*\"bridge\"; .* lost_ns: leave it out"),
        ({"min_on_ns": 0.0}, r"electronics.min_on_ns does not go with"),
        ({"min_on_ns": 100.0}, r"electronics.min_on_ns does not go with"),
    ],
)
def test_a_fault_of_a_bridge_is_named(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        bridged(**changes)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"sign_pins": SIGNS}, r"electronics.sign_pins does not go with .*\"switch\"; .* one way"),
        ({"lost_ns": 40.0}, r"electronics.lost_ns does not go with .*\"switch\"; .* min_on_ns"),
        ({"lost_ns": 0}, r"electronics.lost_ns does not go with"),
        ({"bridge_ohm": 0.3}, r"electronics.bridge_ohm does not go with"),
    ],
)
def test_what_only_a_bridge_has_is_refused_of_switches(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        bridged(**({"drive": "switch", "sign_pins": None} | changes))


def test_what_means_nothing_may_be_said_to_be_none() -> None:
    assert bridged(least_duty=0.0) == bridged()
    assert bridged(drive="switch", sign_pins=[]).electronics.sign_pins == ()


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_nine_bridges_are_refused_and_eight_fit_beside_a_panel(chip: ChipName) -> None:
    own = CHIPS[chip]
    # Gates that cannot be signs first, as one who has few pins would take them.
    gates = sorted(own.gates, key=lambda pin: pin in own.signs)

    def with_bridges(count: int) -> Board:
        made = document(
            chip=chip,
            pwm_pins=gates[:count],
            sign_pins=[pin for pin in own.signs if pin not in gates[:count]][:count],
        )
        made["actuators"] = [
            {"name": f"c{k}", "at_mm": [0.0, 10.0 * (k - 4)]} for k in range(count)
        ]
        made["plate"]["size_mm"] = [14.0, 90.0]
        made["panel"] = {
            "pixels": [320, 480],
            "size_mm": [14.0, 90.0],
            "interrupt_pin": own.panel[2],
        }
        return board_from_document(made)

    assert len(with_bridges(8).electronics.sign_pins) == 8
    with pytest.raises(InputError, match=r"at most 8 bridges, got '9 bridges'.*: take 8 coils, or"):
        with_bridges(9)


@pytest.mark.parametrize("chip", CHIPS)
def test_a_sign_is_reached_by_one_write_and_is_no_line_of_anything_else(chip: ChipName) -> None:
    own = CHIPS[chip]
    assert set(own.signs) <= set(own.outputs) - set(own.panel)
    assert {pin for pin in own.gates if pin < 32} <= set(own.signs)
    gate = own.gates[-1]
    for pin in set(range(49)) - {gate}:
        fault = pin_fault([gate], signs=[pin], chip=chip)
        assert (fault is None) == (pin in own.signs)
        assert fault is None or (fault.role == "sign of channel 0" and set(fault.others))


def test_signs_keep_off_the_lines_of_a_panel() -> None:
    panel = {"sda": 21, "scl": 22, "interrupt": 13, "reset": 14}
    fault = pin_fault([2], signs=[13], **panel)  # type: ignore[arg-type]
    assert fault is not None
    assert (fault.role, fault.pin) == ("panel's interrupt line", 13)
    assert pin_fault([2], signs=[12], **panel) is None  # type: ignore[arg-type]


def test_nine_bridges_are_refused_before_they_have_pins() -> None:
    board = bridged(pwm_pins=[], sign_pins=None)
    own = board.actuators[0]
    more = [dataclasses.replace(own, name=f"c{k}", at=(0.0, 1e-3 * k)) for k in range(4)]
    with pytest.raises(InputError, match="at most 8 bridges, got '9 bridges'"):
        dataclasses.replace(board, actuators=(*board.actuators, *more))


def test_more_signs_than_bridges_of_a_chip_are_a_fault() -> None:
    gates, signs = CHIPS["esp32"].gates[:9], CHIPS["esp32"].signs[:9]
    fault = pin_fault(gates, signs=signs)
    assert fault is not None
    assert fault.why == "esp32 has pins for 8 bridges"


def test_defaults_of_a_bridge_are_in_their_units() -> None:
    assert (Electronics.lost_ns, Electronics.bridge_ohm) == (40.0, 0.28)
