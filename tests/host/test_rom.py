"""Through the ROM's loader: esptool's own code against a chip that speaks its protocol."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation import _emulator
from chladni.host.emulation.emulator import Emulator
from chladni.host.flashing.rom_loader import TABLE_OFFSET
from chladni.host.protocol.board_config import config_of
from chladni.host.protocol.config import DeviceConfig, pack_config, unpack_config
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.host.protocol.slot_store import PARTITION_BYTES, SECTOR_BYTES
from chladni.sim.board.electronics import ChipName
from chladni.sim.board.file import load_board
from chladni.sim.board.gpio import CHIPS
from chladni.tables.format import pack
from conftest import CommandLine
from host.rom_chip import FLASH_BYTES, RomChip
from made_up import device_of, make_table, some_pins

pytestmark = pytest.mark.slow

APP_AT, TABLES_AT, CONFIG_AT, NETWORK_AT = 0x20000, 0x1B0000, 0x1A0000, 0x1A8000
"""Not where partitions.csv puts them: the device's own table is to be believed."""
OLD, NEW = (pack(make_table(np.array([[gain, 1.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0))


def row(name: str, kind: int, subtype: int, offset: int, size: int) -> bytes:
    """A row of a partition table."""
    return struct.pack("<2sBBII16sI", b"\xaa\x50", kind, subtype, offset, size, name.encode(), 0)


def chip_with_chladni(kind: ChipName = "esp32") -> RomChip:
    """A chip whose flash holds a partition table, and rubbish in the application."""
    chip = RomChip(chip=kind)
    table = (
        row("factory", 0, 0, APP_AT, 0x100000)
        + row("tables", 0x40, 0, TABLES_AT, PARTITION_BYTES)
        + row("config", 0x40, 1, CONFIG_AT, 2 * SECTOR_BYTES)
        + row("network", 0x40, 2, NETWORK_AT, SECTOR_BYTES)
    )
    chip.flash[TABLE_OFFSET : TABLE_OFFSET + len(table)] = table
    chip.flash[APP_AT : APP_AT + 64] = bytes(range(64))
    return chip


def sectors_of(at: int, size: int) -> set[int]:
    """Numbers of the sectors of a partition."""
    return set(range(at // SECTOR_BYTES, (at + size) // SECTOR_BYTES))


def table_in(chip: RomChip) -> str:
    """What the firmware plays that finds this partition."""
    emulator = Emulator(device_of(), None, must_play=False)
    image = bytes(chip.flash[TABLES_AT : TABLES_AT + PARTITION_BYTES])
    for at in range(0, len(image), SECTOR_BYTES):
        emulator.core.erase_sector(at)
        emulator.core.program(at, image[at : at + SECTOR_BYTES])
    emulator.core.boot()
    assert emulator.core.table_status == "ok"
    crc = int(Device(EmulatorWire(emulator)).info()["table_crc"], 16).to_bytes(4, "little")
    return {OLD[-4:]: "old", NEW[-4:]: "new"}[crc]


@pytest.mark.parametrize("kind", CHIPS)
def test_a_table_goes_to_the_slot_not_in_use_and_nowhere_else(
    chladni: CommandLine, tmp_path: Path, kind: ChipName
) -> None:
    """Twice: the firmware plays the first, then the second, and the first is still there."""
    path = tmp_path / "t.chl"
    with chip_with_chladni(kind).running() as chip:
        before = bytes(chip.flash)
        slots = []
        for data, name in ((OLD, "old"), (NEW, "new")):
            path.write_bytes(data)
            done = chladni("flash", path, "--rom", "--port", chip.port, "--json")
            assert done.code == 0, done.err
            assert (done.json["bytes"], done.json["verified"]) == (len(data), True)
            slots.append(done.json["slot"])
            assert table_in(chip) == name
        assert sorted(slots) == [0, 1]
        assert chip.flash.count(OLD) == chip.flash.count(NEW) == 1
        assert chip.written <= sectors_of(TABLES_AT, PARTITION_BYTES)
        end = TABLES_AT + PARTITION_BYTES
        assert chip.flash[:TABLES_AT] == before[:TABLES_AT]
        assert chip.flash[end:] == before[end:]


def image_for(chip_id: int) -> bytes:
    """An application image: a header as ESP-IDF's esp_app_format.h has it, and anything."""
    return b"\xe9" + bytes(11) + struct.pack("<H", chip_id) + np.random.default_rng(3).bytes(20_000)


@pytest.mark.parametrize(
    ("kind", "chip_id", "name"),
    [("esp32", 9, "ESP32-S3"), ("esp32s3", 0, "ESP32"), ("esp32", 5, "another chip")],
)
def test_firmware_of_another_chip_is_refused_and_nothing_written(
    chladni: CommandLine, tmp_path: Path, kind: ChipName, chip_id: int, name: str
) -> None:
    path = tmp_path / "firmware.bin"
    path.write_bytes(image_for(chip_id))
    with chip_with_chladni(kind).running() as chip:
        done = chladni("flash", "--firmware", path, "--port", chip.port)
        assert chip.written == set()
    assert done.code == 2
    assert "firmware does not go with the ESP32" in done.err
    assert f"is for {name}" in done.err


@pytest.mark.parametrize(("kind", "chip_id"), [("esp32", 0), ("esp32s3", 9)])
def test_firmware_goes_into_the_applications_partition(
    chladni: CommandLine, tmp_path: Path, kind: ChipName, chip_id: int
) -> None:
    path, image = tmp_path / "firmware.bin", image_for(chip_id)
    path.write_bytes(image)
    with chip_with_chladni(kind).running() as chip:
        done = chladni("flash", "--firmware", path, "--port", chip.port, "--json")
        assert done.code == 0, done.err
        assert (done.json["offset"], done.json["verified"]) == (APP_AT, True)
        assert chip.flash[APP_AT : APP_AT + len(image)] == image
        assert chip.written <= sectors_of(APP_AT, 0x100000)


def test_flash_that_lies_is_found_out(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(NEW)
    with chip_with_chladni().running() as chip:
        chip.lies = True
        done = chladni("flash", path, "--rom", "--port", chip.port)
    assert done.code == 1
    assert "Traceback" not in done.err


@pytest.mark.parametrize(
    ("rows", "code", "words"),
    [
        (b"", 2, "named 'tables'"),
        (row("tables", 0x40, 0, TABLES_AT, 0x1000), 2, "bytes at least"),
        (row("tables", 1, 0, TABLES_AT, PARTITION_BYTES), 2, "named 'tables'"),
        (b"\x12" * 64, 2, "aa50"),
    ],
)
def test_another_partition_table_is_refused_and_nothing_written(
    chladni: CommandLine, tmp_path: Path, rows: bytes, code: int, words: str
) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(NEW)
    with RomChip().running() as chip:
        chip.flash[TABLE_OFFSET : TABLE_OFFSET + len(rows)] = rows
        done = chladni("flash", path, "--rom", "--port", chip.port)
        assert chip.written == set()
    assert done.code == code
    assert words in done.err


def test_another_chip_is_refused(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(NEW)
    with RomChip(magic=0xFFF0C101).running() as chip:  # an ESP8266
        done = chladni("flash", path, "--rom", "--port", chip.port)
        assert chip.written == set()
    assert done.code == 1
    assert "there is firmware for: ESP32, ESP32-S3" in done.err
    assert len(chip.flash) == FLASH_BYTES


def config_in(chip: RomChip) -> tuple[DeviceConfig, str]:
    """What the firmware makes of the configuration's partition."""
    core = _emulator.Emulator(_emulator.Hardware())
    for sector in (0, 1):
        at = CONFIG_AT + sector * SECTOR_BYTES
        core.program(sector * SECTOR_BYTES, bytes(chip.flash[at : at + SECTOR_BYTES]), "config")
    core.boot()
    data = bytes(chip.flash[CONFIG_AT : CONFIG_AT + 2 * SECTOR_BYTES])
    found = [unpack_config(data[at:]) for at in (0, SECTOR_BYTES) if data[at : at + 4] == b"CHLC"]
    return max(found, key=lambda pair: pair[1])[0], core.config_status


def test_a_configuration_that_stopped_a_device_is_changed_without_it(
    chladni: CommandLine,
) -> None:
    """Nine channels and no pins for them, put right through the loader; then once more."""
    with chip_with_chladni().running() as chip:
        stuck = pack_config(DeviceConfig(channels=9, pwm_pins=some_pins()), 7)
        chip.flash[CONFIG_AT : CONFIG_AT + len(stuck)] = stuck
        for channels, sequence in ((5, 8), (4, 9)):
            done = chladni(
                "device",
                "config",
                "set",
                f"channels={channels}",
                "--rom",
                "--port",
                chip.port,
                "--json",
            )
            assert done.code == 0, done.err
            assert done.json == {"channels": channels}
            config, status = config_in(chip)
            assert (config["channels"], status) == (channels, "ok")
            sector = CONFIG_AT + (sequence % 2 == 0) * SECTOR_BYTES
            assert unpack_config(bytes(chip.flash[sector:]))[1] == sequence
        assert chip.written <= sectors_of(CONFIG_AT, 2 * SECTOR_BYTES)
        refused = chladni("device", "config", "set", "channels=6", "--rom", "--port", chip.port)
        assert refused.code == 2
        assert "no pin is given" in refused.err
        assert config_in(chip)[0]["channels"] == 4
    conflict = chladni("device", "config", "get", "--rom", "--port", "nowhere")
    assert conflict.code == 2


@pytest.mark.parametrize(("stored", "asked"), [("prototype", "strip5"), ("strip5", "prototype")])
def test_the_loader_changes_a_driver_only_by_a_word_of_its_own(
    chladni: CommandLine, stored: str, asked: str
) -> None:
    with chip_with_chladni().running() as chip:
        record = pack_config(config_of(load_board(stored)), 7)
        chip.flash[CONFIG_AT : CONFIG_AT + len(record)] = record
        there = ("--rom", "--port", chip.port, "--json")
        refused = chladni("device", "config", "set", "--from", asked, *there)
        assert refused.code == 2
        assert "electronics.drive: expected" in refused.err
        assert "--change-driver" in refused.err
        assert chip.written == set()
        # What leaves the driver as it is needs no such word.
        same = chladni("device", "config", "set", "--from", stored, *there)
        assert same.code == 0, same.err
        done = chladni("device", "config", "set", "--from", asked, "--change-driver", *there)
        assert done.code == 0, done.err
        drive = load_board(asked).electronics.drive
        assert done.json["driver"] == drive
        config, status = config_in(chip)
        assert (config.has_bridges, status) == (drive == "bridge", "ok")


@pytest.mark.parametrize("is_blank", [True, False])
def test_a_driver_that_no_record_says_is_written_without_a_word(
    chladni: CommandLine, is_blank: bool
) -> None:
    with chip_with_chladni().running() as chip:
        if not is_blank:
            record = bytearray(pack_config(config_of(load_board("prototype")), 7))
            record[40] ^= 1  # damaged: its CRC is wrong
            chip.flash[CONFIG_AT : CONFIG_AT + len(record)] = record
        done = chladni("device", "config", "set", "--from", "strip5", "--rom", "--port", chip.port)
        assert done.code == 0, done.err
        assert config_in(chip)[0].has_bridges


def test_a_network_whose_radio_stops_a_device_is_taken_away_without_it(
    chladni: CommandLine,
) -> None:
    with chip_with_chladni().running() as chip:
        record = pack_network(NetworkSettings("net", "12345678", bytes(range(32)), 5555))
        chip.flash[NETWORK_AT : NETWORK_AT + len(record)] = record
        done = chladni("device", "network", "off", "--rom", "--port", chip.port, "--json")
        assert done.code == 0, done.err
        assert done.json == {"state": "off"}
        assert set(chip.flash[NETWORK_AT : NETWORK_AT + SECTOR_BYTES]) == {0xFF}
        assert chip.written == sectors_of(NETWORK_AT, SECTOR_BYTES)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show", "--rom", "--port", "nowhere"), "--rom does not go with show"),
        (("off", "--rom", "--emulator"), "the loader is at a --port"),
        (("off", "--rom"), "--port is required"),
    ],
)
def test_a_network_is_only_taken_away_through_a_port(
    chladni: CommandLine, arguments: tuple[str, ...], message: str
) -> None:
    done = chladni("device", "network", *arguments)
    assert done.code == 2
    assert message in done.err
