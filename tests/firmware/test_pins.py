"""Pins are what the chip can do: both sides judge alike, and a wrong one never costs the link."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wire import EmulatorWire
from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.config import PANELS, SETTINGS, DeviceConfig, pack_config
from chladni.sim.board.gpio import BUS, GATES, INPUTS, OUTPUTS, pin_fault
from chladni.sim.errors import InputError
from conftest import ROOT, CommandLine
from soaking import seed


def wired(**changes: object) -> DeviceConfig:
    return DeviceConfig(**(gates(*GATES[:5]) | changes))


def gates(*pins: int) -> dict[str, object]:
    return {"channels": len(pins), "pwm_pins": (*pins, *(255,) * (16 - len(pins)))}


PANEL = {"panel": PANELS.index("ft6x36")}
REFUSED = [
    DeviceConfig(),  # no pin is wired yet
    wired(channels=6),
    wired(**gates(2, 4, 6)),
    wired(**gates(11)),
    wired(**gates(1)),
    wired(**gates(3)),
    wired(**gates(34)),
    wired(**gates(39)),
    wired(**gates(2, 2, 2, 2, 2)),
    wired(**gates(0)),
    wired(**gates(20)),
    wired(**gates(29)),
    wired(**gates(48)),
    wired(**PANEL, sda_pin=2),
    wired(**PANEL, sda_pin=12),
    wired(**PANEL, sda_pin=36),
    wired(**PANEL, scl_pin=21),
    wired(**PANEL, interrupt_pin=4),
    wired(**PANEL, interrupt_pin=9),
    wired(**PANEL, reset_pin=35),
]
TAKEN = [
    wired(),
    wired(**gates(*GATES[:16])),
    wired(**PANEL, interrupt_pin=34),
    wired(**PANEL, interrupt_pin=39, reset_pin=33),
    # Without a panel its pins are not looked at.
    wired(sda_pin=2, scl_pin=2),
]


def talks(emulator: Emulator) -> bool:
    """Over the link itself, at the speed that the configuration asks for."""
    with Device(EmulatorWire(emulator)) as device:
        return bool(device.info()["channels"] >= 1)


@pytest.mark.parametrize("config", REFUSED)
def test_a_configuration_that_cannot_start_leaves_outputs_off_and_the_link(
    config: DeviceConfig,
) -> None:
    assert config.pin_fault is not None
    with pytest.raises(InputError, match="free are"):
        config.check_pins()
    emulator = Emulator(config, None, must_play=False)
    assert emulator.core.state == "fault"
    assert "configuration refused" in [cause for cause, _, _ in emulator.core.faults]
    assert not emulator.run(50.0).duty_steps.any()
    assert talks(emulator)


@pytest.mark.parametrize("config", TAKEN)
def test_a_configuration_that_can_start_does(config: DeviceConfig) -> None:
    assert config.pin_fault is None
    emulator = Emulator(config, None, must_play=False)
    assert "configuration refused" not in [cause for cause, _, _ in emulator.core.faults]
    assert talks(emulator)


def drawn(rng: np.random.Generator) -> DeviceConfig:
    """Every setting anywhere in its range, pins more often among those that a chip has."""
    values: dict[str, object] = {}
    for setting in SETTINGS:
        count = setting.field.count
        numbers = rng.integers(setting.low, setting.high + 1, count)
        if setting.field.name.endswith(("pin", "pins")) and rng.random() < 0.8:
            numbers = rng.permutation((*OUTPUTS, *INPUTS[-6:]))[:count]
        values[setting.field.name] = (
            int(numbers[0]) if count == 1 else tuple(int(n) for n in numbers)
        )
    return DeviceConfig(**values)


def test_both_sides_judge_ten_thousand_configurations_alike() -> None:
    rng = np.random.default_rng(seed(5))
    core = _emulator.Emulator(_emulator.Hardware())
    core.boot()
    refused = 0
    for _ in range(10_000):
        config = drawn(rng)
        record = pack_config(config)
        if config.pin_fault is None:
            assert core.parse_config(record) == "ok", dict(config.values)
        else:
            refused += 1
            assert core.parse_config(record) == "pins that the chip cannot use so"
    # Both kinds came often enough to mean something.
    assert 1000 < refused < 9900


def test_random_configurations_never_cost_the_link() -> None:
    rng = np.random.default_rng(seed(6))
    for _ in range(3_000):
        config = drawn(rng)
        emulator = Emulator(config, None, must_play=False)
        assert not emulator.run(5.0).duty_steps.any()
        assert talks(emulator), dict(config.values)


def test_tables_of_abilities_are_those_of_the_data_sheet() -> None:
    """No gate on the flash, UART0, an input, or a pin that is not there; nested as they should."""
    assert len(GATES) == 17
    assert set(GATES) < set(OUTPUTS) < set(INPUTS)
    assert set(BUS) < set(OUTPUTS)
    impossible = {0, 1, 3, *range(6, 12), 20, 24, *range(28, 32)}
    assert not impossible & set(INPUTS)
    assert not set(range(34, 40)) & set(OUTPUTS)
    for pin in (*impossible, *range(34, 40)):
        fault = pin_fault([pin])
        assert fault is not None
        assert fault.why != "this chip has no such pin" or pin in (20, 24, 28, 29, 30, 31)
        assert set(fault.others) <= set(GATES)


def test_a_board_file_with_an_impossible_pin_says_why_and_which_would_do(
    chladni: CommandLine, tmp_path: Path
) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    board = tmp_path / "b.toml"
    board.write_text(text.replace("[2, 4, 15, 16, 17]", "[2, 4, 15, 16, 6]"), encoding="utf-8")
    answer = chladni("board", "show", board)
    assert answer.code == 2
    assert "electronics.pwm_pins" in answer.err
    assert "flash chip's" in answer.err
    assert "free are" in answer.err
