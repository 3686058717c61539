"""Pins are what the chip can do: both sides judge alike, and a wrong one never costs the link."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator, Hardware
from chladni.host.protocol.config import PANELS, SETTINGS, DeviceConfig, pack_config
from chladni.sim.board.electronics import NOT_WIRED, ChipName
from chladni.sim.board.gpio import CHIPS, pin_fault
from chladni.sim.errors import InputError
from conftest import ROOT, CommandLine
from soaking import seed


def wired(**changes: object) -> DeviceConfig:
    return DeviceConfig(**(gates(*CHIPS["esp32"].gates[:5]) | changes))


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
    wired(**gates(*CHIPS["esp32"].gates[:16])),
    wired(**PANEL, interrupt_pin=34),
    wired(**PANEL, interrupt_pin=39, reset_pin=33),
    # Without a panel its pins are not looked at.
    wired(sda_pin=2, scl_pin=2),
]


def talks(emulator: Emulator) -> bool:
    """Over the link itself, at the speed that the configuration asks for."""
    with Device(EmulatorWire(emulator)) as device:
        return bool(device.info()["channels"] >= 1)


S3_PANEL = PANEL | {"sda_pin": 8, "scl_pin": 9}
S3_REFUSED = [
    wired(**gates(2, 4, 23)),
    wired(**gates(*CHIPS["esp32s3"].gates[:9])),  # nine of eight channels
    wired(**gates(19)),
    wired(**gates(27)),
    wired(**gates(36)),
    wired(**gates(43)),
    wired(**gates(45)),
    wired(**gates(22)),
    wired(**gates(4, 4)),
    wired(**gates(4, 5), **PANEL),
    wired(**gates(4, 5), **S3_PANEL, interrupt_pin=46),
]
S3_TAKEN = [
    wired(**gates(*CHIPS["esp32s3"].gates[:8])),
    wired(**gates(4, 5, 6, 7, 15), **S3_PANEL, interrupt_pin=3, reset_pin=21),
]


def for_chips(own: list[DeviceConfig], other: list[DeviceConfig]) -> list[tuple[str, DeviceConfig]]:
    return [("esp32", config) for config in own] + [("esp32s3", config) for config in other]


def on_chip(config: DeviceConfig, chip: ChipName) -> Emulator:
    return Emulator(config, None, hardware=Hardware(chip=chip), must_play=False)


@pytest.mark.parametrize(("chip", "config"), for_chips(REFUSED, S3_REFUSED))
def test_a_configuration_that_cannot_start_leaves_outputs_off_and_the_link(
    chip: ChipName, config: DeviceConfig
) -> None:
    assert config.pin_fault(chip) is not None
    with pytest.raises(InputError, match=r"free are|at most 8 on an esp32s3"):
        config.check_pins(chip)
    emulator = on_chip(config, chip)
    assert emulator.core.state == "fault"
    assert "configuration refused" in [cause for cause, _, _ in emulator.core.faults]
    assert not emulator.run(50.0).duty_steps.any()
    assert talks(emulator)


@pytest.mark.parametrize(("chip", "config"), for_chips(TAKEN, S3_TAKEN))
def test_a_configuration_that_can_start_does(chip: ChipName, config: DeviceConfig) -> None:
    assert config.pin_fault(chip) is None
    emulator = on_chip(config, chip)
    assert "configuration refused" not in [cause for cause, _, _ in emulator.core.faults]
    assert talks(emulator)


def drawn(rng: np.random.Generator, chip: ChipName) -> DeviceConfig:
    """Every setting anywhere in its range, pins more often among those that a chip has."""
    values: dict[str, object] = {}
    own = CHIPS[chip]
    for setting in SETTINGS:
        count = setting.field.count
        numbers = rng.integers(setting.low, setting.high + 1, count)
        if setting.field.name.endswith(("pin", "pins")) and rng.random() < 0.8:
            numbers = rng.permutation(own.inputs)[:count]
        if setting.field.name == "sense_pin" and rng.random() < 0.8:
            numbers = rng.permutation((0, NOT_WIRED, *own.converters))[:1]
        if setting.field.name == "channels":
            numbers = rng.integers(1, own.channels + 2, 1).clip(max=setting.high)
        values[setting.field.name] = (
            int(numbers[0]) if count == 1 else tuple(int(n) for n in numbers)
        )
    return DeviceConfig(**values)


@pytest.mark.parametrize("chip", CHIPS)
def test_both_sides_judge_five_thousand_configurations_alike(chip: ChipName) -> None:
    rng = np.random.default_rng(seed(5))
    hardware = _emulator.Hardware()
    hardware.chip = tuple(CHIPS).index(chip)
    core = _emulator.Emulator(hardware)
    core.boot()
    refused = 0
    for _ in range(5_000):
        config = drawn(rng, chip)
        record = pack_config(config)
        if config.pin_fault(chip) is None:
            assert core.parse_config(record) == "ok", dict(config.values)
        else:
            refused += 1
            assert core.parse_config(record) == "pins that the chip cannot use so"
    # Both kinds came often enough to mean something.
    assert 500 < refused < 4950


@pytest.mark.parametrize("chip", CHIPS)
def test_random_configurations_never_cost_the_link(chip: ChipName) -> None:
    rng = np.random.default_rng(seed(6))
    for _ in range(1_500):
        config = drawn(rng, chip)
        emulator = on_chip(config, chip)
        assert not emulator.run(5.0).duty_steps.any()
        assert talks(emulator), dict(config.values)


IMPOSSIBLE = {
    "esp32": {0, 1, 3, *range(6, 12), 20, 24, *range(28, 32)},
    "esp32s3": {0, 19, 20, *range(22, 38), *range(43, 49)},
}
"""Straps that must be otherwise, the link, flash, PSRAM, and pins that are not there."""
ABSENT = {"esp32": {20, 24, *range(28, 32), *range(40, 49)}, "esp32s3": set(range(22, 26))}


@pytest.mark.parametrize("chip", CHIPS)
def test_tables_of_abilities_are_those_of_the_data_sheet(chip: ChipName) -> None:
    """No gate on what is taken, is an input, or is not there; nested as they should."""
    own = CHIPS[chip]
    assert len(own.gates) > own.channels
    assert set(own.gates) < set(own.outputs) < set(own.inputs)
    assert set(own.bus) <= set(own.outputs)
    assert not IMPOSSIBLE[chip] & set(own.inputs)
    for pin in set(range(49)) - set(own.gates):
        fault = pin_fault([pin], chip=chip)
        assert fault is not None
        assert (fault.why == "this chip has no such pin") == (pin in ABSENT[chip])
        assert set(fault.others) <= set(own.gates)
    assert not set(range(34, 40)) & set(CHIPS["esp32"].outputs)


@pytest.mark.parametrize(
    ("chip", "coils", "told"),
    [
        ("esp32c3", 5, "one of: 'esp32', 'esp32s3'"),
        ("esp32s3", 16, "expected a chip with 16 PWM channels"),
    ],
)
def test_a_board_for_a_chip_that_cannot_is_refused_by_name(
    chladni: CommandLine, tmp_path: Path, chip: str, coils: int, told: str
) -> None:
    name = "prototype" if coils == 5 else "pad16"
    text = (ROOT / "boards" / f"{name}.toml").read_text(encoding="utf-8")
    board = tmp_path / "b.toml"
    changed = text.replace("[electronics]", f'[electronics]\nchip = "{chip}"', 1)
    board.write_text(changed, encoding="utf-8")
    answer = chladni("board", "show", board)
    assert answer.code == 2
    assert "electronics.chip" in answer.err
    assert told in answer.err


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
