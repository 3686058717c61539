"""The configuration that a board's file asks for, and whether a device's chip can have it."""

from __future__ import annotations

from typing import Any

import numpy as np

from chladni.host.protocol.config import PANELS, DeviceConfig, each
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import DRIVER_KINDS, NOT_WIRED, ChipName
from chladni.sim.coil.full_drive import coil_shares, newtons_of, strengths
from chladni.sim.errors import InputError
from chladni.tables.layout import BOARD_NAME_BYTES, MAX_ACTUATORS


def coil_gains(board: Board) -> tuple[float, ...]:
    """What the device multiplies each drive with, so that coils do what they are drawn with.

    Polarity and trim, all of them lowered until none is above 1: no coil can do more than all.
    """
    return tuple((np.sign(strengths(board)) * coil_shares(board)).tolist())


def full_force_n(board: Board) -> float:
    """Peak force of a coil by a sine of the loudest drive there is, N; 0 without `[coil]`.

    A bridge swings by the whole supply, a switch by half of it. Heat may end such a touch early.
    """
    if board.coil is None:
        return 0.0
    own = board.electronics
    duty = own.max_duty * (1.0 if own.is_bridge else 0.5)
    return newtons_of(board, duty, board.drive.frequency_hz)


def board_id(fingerprint: int, name: str) -> tuple[int, ...]:
    """Who a board is, as a table's header has it."""
    return tuple(fingerprint.to_bytes(8, "little") + name.encode().ljust(BOARD_NAME_BYTES, b"\0"))


def config_of(board: Board, **changes: Any) -> DeviceConfig:
    """What a board's file says of its device; `changes` by a setting's name."""
    return DeviceConfig(**{**board_settings(board), **changes})


def board_settings(board: Board) -> dict[str, Any]:
    """The settings that a board's file knows."""
    electronics = board.electronics
    count = len(board.actuators)
    full_a = electronics.full_current_a
    rise_k = electronics.full_heat_w * electronics.coil_k_per_w
    pins = electronics.pwm_pins or (NOT_WIRED,) * count
    values: dict[str, Any] = {
        "channels": count,
        "pwm_bits": electronics.pwm_bits,
        "pwm_pins": (*pins, *(NOT_WIRED,) * (MAX_ACTUATORS - count)),
        "max_duty_q15": round(electronics.max_duty * 32768.0),
        "min_on_ns": round(electronics.shortest_on_ns),
        "supply_ma": round(electronics.supply_limit_ma),
        "full_current_ma": each(round(full_a * 1e3), count),
        "full_rise_dk": each(min(round(rise_k * 10.0), 65535), count),
        "limit_rise_dk": round(electronics.coil_limit_k * 10.0),
        "heating_ds": round(electronics.coil_heating_s * 10.0),
        "full_force_mn": min(round(1e3 * full_force_n(board)), 65535),
        "board_id": board_id(board.fingerprint(), board.name),
        "coil_gain_q15": (
            *(round(gain * 32767.0) for gain in coil_gains(board)),
            *(32767,) * (MAX_ACTUATORS - count),
        ),
    }
    signs = electronics.sign_pins if electronics.is_bridge else ()
    values |= {
        "driver": DRIVER_KINDS.index(electronics.drive),
        "lost_ns": round(electronics.lost_ns) if electronics.is_bridge else 0,
        "sign_pins": (*signs, *(NOT_WIRED,) * (MAX_ACTUATORS - len(signs))),
    }
    if board.sensing is not None:
        values["sense_pin"] = board.sensing.pin
    panel = board.panel
    if panel is not None:
        values |= {
            "panel": PANELS.index(panel.controller),
            "panel_turns": panel.rotation_deg // 90,
            "panel_mirrored": int(panel.mirrored),
            "sda_pin": panel.sda_pin,
            "scl_pin": panel.scl_pin,
            "interrupt_pin": panel.interrupt_pin,
            "reset_pin": panel.reset_pin,
            "report_ms": panel.report_ms,
            "panel_columns": panel.pixels[0],
            "panel_rows": panel.pixels[1],
            "panel_width_um": round(panel.size[0] * 1e6),
            "panel_length_um": round(panel.size[1] * 1e6),
            "panel_x_um": round(panel.offset[0] * 1e6),
            "panel_y_um": round(panel.offset[1] * 1e6),
        }
    return values


def check_chip(own: ChipName, board: Board | None) -> None:
    """Raise `InputError` where a board's file is of another chip than a device's own."""
    if board is not None and board.electronics.chip != own:
        name, expected = board.electronics.chip, f"{own!r}, which the device is"
        hint = "its pins are other ones: use a board file of that chip"
        raise InputError("electronics.chip", name, expected, hint=hint)


def check_driver(before: DeviceConfig, after: DeviceConfig) -> None:
    """Raise `InputError` where a device would drive switches as bridges, or the other way round.

    No limit sees it: switches that get a bridge's duties pull at both halves of a wave.
    """
    own, other = DRIVER_KINDS[before["driver"]], DRIVER_KINDS[after["driver"]]
    if own == other:
        return
    expected = f"{own!r}, which the device is set to drive"
    hint = (
        "with the wrong one coils pull at both halves of a wave, or one way only; once the board "
        "has been rewired, chladni device config set --from BOARD --change-driver"
    )
    raise InputError("electronics.drive", other, expected, hint=hint)
