"""Settings as people write and read them."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chladni.host.protocol.config import OWN, SETTINGS, DeviceConfig
from chladni.host.protocol.settings import SHOWN, changes, described, find, parse_setting
from chladni.sim.errors import InputError
from conftest import CommandLine

WRITABLE = [setting for setting in SETTINGS if setting.field.name not in OWN]


@given(st.data())
def test_what_is_shown_can_be_written_and_comes_out_the_same(data: st.DataObject) -> None:
    """By either name."""
    setting = data.draw(st.sampled_from(WRITABLE))
    shown = SHOWN[setting.field.name]
    one = st.integers(setting.low, setting.high)
    count = setting.field.count
    value: Any = data.draw(one if count == 1 else st.tuples(*[one] * count))
    (read,) = parse_setting(f"{shown.name}={shown.text(value)}").values()
    assert read == value
    exact = ",".join(map(str, (value,) if count == 1 else value))
    if not shown.words:
        assert parse_setting(f"{shown.raw_name}={exact}") == {shown.raw_name: value}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("ramp_ms=4", {"attack_ms": 4, "release_ms": 4}),
        ("level=0.8", {"level_q15": 26214}),
        ("max_duty=1", {"max_duty_q15": 32768}),
        ("panel=gt911", {"panel": 3}),
        ("driver=bridge", {"driver": 1}),
        ("interrupt_pin=none", {"interrupt_pin": 255}),
        ("heating_s=30", {"heating_ds": 300}),
        ("limit_rise_k=60", {"limit_rise_dk": 600}),
        ("panel_width_mm=66.5", {"panel_width_um": 66_500}),
        ("coil_gain=1,-1", {"coil_gain_q15": (32767, -32767, *(32767,) * 14)}),
        ("pwm_pins=25,26", {"pwm_pins": (25, 26, *(255,) * 14)}),
    ],
)
def test_settings_take_units_and_words(text: str, expected: dict[str, object]) -> None:
    assert parse_setting(text) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("level=2", "0 to 1"),
        ("ramp_ms=1001", "0 to 1000"),
        ("panel=ili2130", "one of: none, find, ft6x36, gt911"),
        ("driver=half-bridge", "one of: switch, bridge"),
        ("loudness=1", "one of: channels"),
        ("level", "a setting and its value"),
        ("board_id=1", "this one is not"),
        ("wire_supply_ma=20000", "this one is not"),
        ("pwm_pins=" + ",".join(["2"] * 17), "16 values"),
        ("level=nan", "0 to 1"),
        ("level=", "0 to 1"),
    ],
)
def test_wrong_settings_say_what_would_do(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        parse_setting(text)


def test_every_setting_that_can_be_written_is_explained(chladni: CommandLine) -> None:
    rows = described()
    assert [row["record"] for row in rows] == [setting.field.name for setting in WRITABLE]
    assert all(row["meaning"].endswith(".") and row["expected"] for row in rows)
    done = chladni("device", "config", "describe", "--json")
    assert done.json["settings"] == rows
    one = chladni("device", "config", "describe", "level")
    assert "Loudness while touched" in " ".join(one.out.split())
    assert chladni("device", "config", "describe", "loudness").code == 2
    assert find("level_q15") is find("level")


@pytest.mark.parametrize(("board", "driver"), [("prototype", "switch"), ("strip5", "bridge")])
def test_a_driver_is_read_by_its_name_and_written_by_the_same(
    chladni: CommandLine, board: str, driver: str
) -> None:
    at = ("--emulator", "--board", board)
    assert chladni("device", "config", "get", *at, "--json").json["driver"] == driver
    assert driver in chladni("device", "config", "get", "driver", *at).out
    assert parse_setting(f"driver={driver}") == parse_setting(f"driver={int(driver == 'bridge')}")
    done = chladni("device", "config", "set", f"driver={driver}", "level=0.5", *at, "--json")
    assert (done.json["driver"], done.json["level_q15"]) == (driver, 16384)


def test_a_change_is_shown_as_people_write_it() -> None:
    before = DeviceConfig(pwm_pins=(4, 5, 12, 13, 14, *(255,) * 11))
    after = before.with_values(level_q15=16384, pwm_pins=(25, *before["pwm_pins"][1:]))
    assert changes(before, after) == [
        {"name": "pwm_pins", "from": "4, 5, 12, 13, 14", "to": "25, 5, 12, 13, 14"},
        {"name": "level", "from": "0.8", "to": "0.5"},
    ]
    assert changes(before, before) == []


def test_more_channels_than_a_chip_has_are_named_as_such() -> None:
    config = DeviceConfig(channels=16)
    with pytest.raises(InputError, match="channels: expected at most 8 on an esp32s3, got 16"):
        config.check_pins("esp32s3")
