"""Duties of a chip on a fake of ESP-IDF: two groups of channels, and where writes stand."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.board.gpio import CHIPS
from chladni.tables.format import pack
from firmware.chip_process import RESET_PIN, Chip
from firmware.chip_started import on_each_chip, playing, started
from made_up import make_table

SIXTEEN = pack(make_table(np.array([[10.0 - 0.5 * k for k in range(16)]])))
ALL_CHANNELS = DeviceConfig(
    channels=16,
    pwm_pins=CHIPS["esp32"].gates[:16],
    full_current_ma=(50,) * 16,
    full_rise_dk=(100,) * 16,
)


def sixteen(chip_program: Path, *options: str) -> AbstractContextManager[Chip]:
    return started(chip_program, config=ALL_CHANNELS, options=options, tables=SIXTEEN)


def test_sixteen_channels_play_on_both_groups(chip_program: Path) -> None:
    with sixteen(chip_program) as chip:
        device = Device(chip)
        assert device.info()["state"] == "idle", device.faults()
        device.touch(0.0, 0.0)
        chip.run(40)
        assert chip.on | {RESET_PIN} == set(CHIPS["esp32"].gates[:16])
        assert chip.down("panic") == set()


def test_bridges_turn_by_their_signs(chip_program: Path) -> None:
    """Signs follow the wave, a duty that is not taken keeps its own, and a panic brakes all."""
    gates, signs = (4, 5, 12, 6, 14), (15, 16, 17, 1, 2)
    if chip_program.name == "esp32":
        gates, signs = (2, 4, 5, 26, 14), (15, 18, 19, 23, 25)
    bridges = DeviceConfig(
        channels=5,
        pwm_pins=(*gates, *(255,) * 11),
        driver=1,
        lost_ns=40,
        sign_pins=(*signs, *(255,) * 11),
        full_current_ma=(50,) * 5 + (0,) * 11,
        full_rise_dk=(100,) * 5 + (0,) * 11,
    )
    table = pack(make_table(np.array([[10.0, -9.0, 8.0, -7.0, 0.0]])))
    with started(chip_program, config=bridges, tables=table) as chip:
        device = Device(chip)
        assert device.info()["state"] == "idle", device.faults()
        device.touch(0.0, 0.0)
        seen = []
        for _ in range(60):
            chip.run(1)
            seen.append(frozenset(chip.on))
        assert {pin for on in seen for pin in on} >= {*gates[:4], *signs[:4]}
        assert all(any(sign not in on for on in seen) for sign in signs)
        assert not any(gates[4] in on for on in seen)
        for cycles in range(2_000, 16_288, 64):  # some so late that the next finds duties waiting
            chip.tell(f"late {cycles}")
            chip.run(3)
            assert chip.ended == ""
        assert not chip.down("panic") & set(gates)


@pytest.mark.parametrize("read_cycles", [8, 60, 150])
@pytest.mark.parametrize("apart", [0, -7, 9])
def test_the_lag_that_is_printed_is_that_of_the_groups(
    chip_program: Path, read_cycles: int, apart: int
) -> None:
    """Started some 3,000 steps apart, they are brought together; however long a read takes."""
    with sixteen(chip_program, f"read={read_cycles}", f"apart={apart}") as chip:
        device = Device(chip)
        device.info()
        (said,) = [line for line in device.log.splitlines() if "channels 8 and up" in line]
        lag = float(chip.ask("lag"))
        # A step is lost where a count is cut off, and half of one in the mean.
        assert abs(int(said.split("lag by ")[1].split()[0]) - lag) <= 1.5
        assert abs(lag + apart) < 3.0


@pytest.mark.parametrize("read_cycles", [8, 36])
def test_sixteen_duties_are_written_in_one_carrier_period(
    chip_program: Path, read_cycles: int
) -> None:
    """Also where the bus is slow: 36 cycles a read and 12 a write are three eighths of a period."""
    with sixteen(chip_program, f"read={read_cycles}", "write=12") as chip:
        device = Device(chip)
        device.touch(0.0, 0.0)
        for shift in range(20, 1024, 40):
            chip.tell(f"shift {shift}")
            chip.run(20)
            assert chip.ask("position").split()[1] == "-"
        assert "near the carrier" not in device.log


@pytest.mark.parametrize("apart", [-200, 200])
def test_groups_that_do_not_start_together_are_not_played(chip_program: Path, apart: int) -> None:
    with sixteen(chip_program, f"apart={apart}") as chip:
        device = Device(chip)
        chip.run(20)
        device.info()
        assert "synthesis did not start" in device.log
        assert "interrupt stopped" in [fault["cause"] for fault in device.faults()]
        assert not chip.on


@on_each_chip
def test_a_carrier_that_will_not_stand_still_is_said_once(chip_program: Path) -> None:
    with started(chip_program) as chip:
        device = Device(chip)
        for _ in range(40):
            chip.tell("shift 512")
            chip.run(1)
        device.info()
        assert device.log.count("near the carrier") == 1


@on_each_chip
def test_writes_are_moved_away_from_the_carrier_s_end(chip_program: Path) -> None:
    """Wherever the carrier stands beside the alarm: found at the writes, put right in turns."""
    with started(chip_program) as chip:
        device = Device(chip)
        playing(chip, device)
        for shift in range(60, 1024, 120):
            chip.tell(f"shift {shift}")
            chip.run(20)
            at = int(chip.ask("position").split()[0])
            assert 1024 * 3 // 8 <= at <= 1024 * 7 // 8
            assert not chip.ended
        assert "near the carrier" not in device.log


@on_each_chip
def test_a_timer_that_cannot_be_moved_is_said_once(chip_program: Path) -> None:
    for call in ("gptimer_set_raw_count:3", "gptimer_get_raw_count:1"):
        with started(chip_program, fail=call) as chip:
            device = Device(chip)
            for shift in (300, 300, 300):
                chip.tell(f"shift {shift}")
                chip.run(3)
            chip.run(20)
            device.info()
            assert device.log.count("near the carrier") == 1
