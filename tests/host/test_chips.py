"""A board with another chip goes the whole way, and never onto a device that has not that chip."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.host.device.configure import change_settings
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent, emulate
from chladni.host.protocol.board_config import board_settings, check_chip, config_of
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from chladni.tables.build import build_table
from conftest import ROOT, CommandLine


@pytest.fixture
def s3_file(tmp_path: Path) -> Path:
    """`strip5` on an ESP32-S3."""
    text = (ROOT / "boards" / "strip5.toml").read_text("utf-8")
    path = tmp_path / "strip5s3.toml"
    changed = text.replace("[electronics]", '[electronics]\nchip = "esp32s3"', 1)
    # GPIO 19 to 26 are USB's or not there.
    changed = changed.replace("[18, 19, 23, 25, 26]", "[5, 6, 7, 18, 21]")
    path.write_text(changed.replace('name = "strip5"', 'name = "strip5s3"'), "utf-8")
    return path


def test_the_same_pins_move_alike_on_either_chip(s3_file: Path) -> None:
    """The chip decides pins and channels only: tables, panels and waves are the same."""
    boards = load_board("strip5"), load_board(str(s3_file))
    assert boards[0].fingerprint() == boards[1].fingerprint()
    table = build_table(boards[0])[0]
    finger = [TouchEvent(10.0, (3.0, 5.0)), TouchEvent(60.0, None)]
    one, other = (emulate(board, table, finger, 100.0) for board in boards)
    assert one.duty_steps.any()
    assert (one.duty_steps == other.duty_steps).all()


def test_a_panel_has_its_lines_where_the_chip_has_them(tmp_path: Path) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text("utf-8")
    path = tmp_path / "s3.toml"
    kept = [
        line
        for line in text.splitlines()
        if not line.startswith(("sda_pin", "scl_pin", "interrupt"))
    ]
    text = "\n".join(kept)
    path.write_text(text.replace("[electronics]", '[electronics]\nchip = "esp32s3"', 1), "utf-8")
    panels = [load_board(name).panel for name in ("prototype", str(path))]
    assert [(own.sda_pin, own.scl_pin) for own in panels if own is not None] == [(21, 22), (8, 9)]


def test_a_device_says_its_chip_and_takes_a_board_of_it_only(
    chladni: CommandLine, s3_file: Path
) -> None:
    own = load_board(str(s3_file))
    with Device(EmulatorWire(Emulator(own, None, must_play=False))) as device:
        assert device.info()["chip"] == "esp32s3"
        device.set_config(config_of(own, attack_ms=7))
        with pytest.raises(InputError, match=r"electronics\.chip"):
            check_chip(device.info()["chip"], load_board("prototype"))
    emulated = ("device", "config", "set", "--from", s3_file, "--yes", "--emulator")
    refused = chladni(*emulated)
    assert refused.code == 2
    assert "electronics.chip: expected 'esp32', which the device is" in refused.err


def test_wiring_and_parts_are_those_of_the_chip(
    chladni: CommandLine, s3_file: Path, tmp_path: Path
) -> None:
    listed = chladni("board", "parts", s3_file, "--json")
    values = {part["part"]: part["value"] for part in listed.json["parts"]}
    assert values["ESP32 module"] == "ESP32-S3-WROOM-1"
    assert "USB–serial bridge" not in values
    drawing = tmp_path / "w.svg"
    assert chladni("board", "wiring", s3_file, "-o", drawing).code == 0


def test_a_device_changes_its_driver_only_by_a_word_of_its_own(chladni: CommandLine) -> None:
    asked = ("device", "config", "set", "--from", "strip5", "--yes", "--emulator")
    refused = chladni(*asked)
    assert refused.code == 2
    assert "electronics.drive: expected 'switch', which the device is set to drive" in refused.err
    assert "--change-driver" in refused.err
    done = chladni(*asked, "--change-driver", "--json")
    assert done.code == 0
    assert "driver" in {row["name"] for row in done.json["changed"]}


def test_a_page_of_the_studio_changes_no_driver() -> None:
    own, other = load_board("prototype"), load_board("strip5")
    with Device(EmulatorWire(Emulator(own, None, must_play=False))) as device:
        device.set_config(config_of(own))
        with pytest.raises(InputError, match=r"electronics\.drive: expected 'switch'.*, got 'brid"):
            change_settings(device, board_settings(other))
        assert not device.config().has_bridges
        assert change_settings(device, {"level_q15": 16384})[0]["to"] == "0.5"


def test_a_board_with_switches_ends_what_one_with_bridges_set() -> None:
    bridges, switches = board_settings(load_board("strip5")), board_settings(load_board("pad16"))
    assert DeviceConfig(**bridges).has_bridges
    assert not DeviceConfig(**(bridges | switches)).has_bridges
