"""Commands that write an effect bank to a device, and that hear what fingers do on it."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest

from chladni.effects.bank.bank_file import bank_bytes
from chladni.effects.bank.unpack import read_bank_file, unpack_bank
from chladni.effects.effect import Tone
from chladni.host.cli.effects.bank import ERASED_BY
from chladni.host.cli.effects.remarks import say_out_of_reach
from chladni.host.device.async_device import AsyncDevice
from chladni.host.device.device import Device
from chladni.host.device.device_effects import AreaEvent, DeviceArea
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.emulation.recorded_effect import effect_of_bank
from chladni.host.protocol.config import DeviceConfig
from chladni.sim.errors import InputError
from chladni.tables.format import pack
from chladni.tables.table import Limits
from conftest import ROOT, CommandLine
from effects.banks import BYTES
from made_up import device_of
from plate_of_bumps import responses_table

KEY, REST = (-15.0, 30.0), (-15.0, -20.0)


@pytest.fixture
def emulator() -> Emulator:
    table = responses_table(limits=Limits(4000, 100_000, 20_000_000))
    return Emulator(device_of(table), table, bank=BYTES)


def test_a_bank_goes_onto_an_emulated_device(chladni: CommandLine, tmp_path: Path) -> None:
    done = chladni("effects", "flash", "calculator", "--emulator", "--json")
    assert done.code == 0, done.err
    assert done.json["bytes"] == len(bank_bytes("calculator"))
    assert done.json["verified"]
    assert done.err == ""
    narrow = chladni("effects", "flash", "calculator", "--emulator", "--board", "strip5", "--json")
    assert (narrow.code, narrow.json["verified"]) == (0, True)
    assert "and 17 more: these areas reach beyond the device's panel, which has x -7" in narrow.err
    people = chladni("effects", "flash", "calculator", "--emulator")
    assert "erase-region 0x214000 0x20000" in " ".join(people.out.replace("│", " ").split())
    path = tmp_path / "cut.che"
    path.write_bytes(bank_bytes("slider")[:-3])
    refused = chladni("effects", "flash", path, "--emulator")
    assert refused.code == 2
    assert "cut.che, total_bytes: expected" in refused.err
    assert chladni("effects", "flash", "calculators", "--emulator").code == 2
    nowhere = chladni("effects", "flash", "calculator")
    assert nowhere.code == 2
    assert "--port, --udp and --emulator" in nowhere.err


def test_what_erases_a_bank_is_its_partition_and_no_other() -> None:
    rows = [
        [part.strip() for part in line.split(",")]
        for line in (ROOT / "firmware/esp32/chip/partitions.csv").read_text("utf-8").splitlines()
        if line.strip() and not line.startswith("#")
    ]
    end = int(rows[0][3], 0)
    for name, _, _, _, size in rows:
        begin, end = end, end + int(size, 0)
        if name == "effects":
            assert f"erase-region {begin:#x} {end - begin:#x}" in ERASED_BY
            return
    pytest.fail("no partition for effects")


def test_a_bank_of_another_ending_is_told_what_each_command_takes(chladni: CommandLine) -> None:
    for words, endings in (
        (("flash", "my.chl", "--emulator"), ".toml or .che"),
        (("build", "my.chl", "-o", "my.che"), ".toml"),
    ):
        refused = chladni("effects", *words)
        assert (refused.code, f"a file that ends in {endings}, got" in refused.err) == (2, True)


def test_areas_beyond_the_board_of_a_table_are_told(
    emulator: Emulator, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where a device has no panel, by what it says of its table."""
    without = DeviceConfig()
    assert without["panel"] == 0
    with Device(EmulatorWire(emulator)) as device:
        board_mm = device.reach_mm()
    say_out_of_reach(unpack_bank(bank_bytes("texture")), without, board_mm)
    said = capsys.readouterr().err
    assert "reach beyond the board of the device's table, which has x -30 to 30 and y -50" in said
    say_out_of_reach(unpack_bank(bank_bytes("texture")), without, (-35.0, -70.0, 35.0, 70.0))
    say_out_of_reach(unpack_bank(bank_bytes("texture")), without, None)
    assert capsys.readouterr().err == ""


def test_a_touch_of_an_emulated_device_with_a_bank(chladni: CommandLine, tmp_path: Path) -> None:
    """`--bank` beside `--table`; a host that holds a finger is one that presses."""
    path = tmp_path / "t.chl"
    path.write_bytes(pack(responses_table()))
    there = ("--board", "phone5", "--table", path, "--bank", "calculator", "--emulator", "--json")
    touched = chladni("device", "touch", "-24,20", "--seconds", "0.1", *there)
    assert touched.code == 0, touched.err
    shown = chladni("device", "touches", "--watch", "0.05", *there)
    assert shown.json == {"fingers": [], "events": []}
    refused = chladni("device", "touches", *there[:-3], "none", *there[-2:])
    assert refused.code == 2
    assert "--bank: expected calculator, fader, four-keys, slider, texture, or" in refused.err


def test_a_device_tells_of_its_bank(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(responses_table()))
    there = ("--board", "phone5", "--table", path, "--emulator")
    plain = chladni("device", "info", *there)
    assert "effect bank" in plain.out
    known = chladni("device", "info", "--bank", "slider", *there, "--json").json["bank"]
    assert known == {"status": "ok", "name": "slider", "effects": 3, "areas": 3}
    touched = chladni("device", "touch", "0,0", "--seconds", "0.1", "--bank", "slider", *there)
    assert "slider" in touched.out


def test_two_fingers_decibels_say_that_effects_have_real_gains(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """With a table alone the same pair has more: tones have phases."""
    path = tmp_path / "t.chl"
    path.write_bytes(pack(responses_table()))
    pair = ("device", "touch", "-18,30", "17,-25", "--seconds", "0.1", "--emulator")
    there = (*pair, "--board", "phone5", "--table", path)
    effects, tones = (chladni(*there, *bank) for bank in (("--bank", "slider"), ()))
    assert (effects.code, tones.code) == (0, 0)
    assert "real gains" in effects.out
    assert "real gains" not in tones.out


def test_an_area_that_no_finger_can_be_in_is_told(chladni: CommandLine, tmp_path: Path) -> None:
    areas = tmp_path / "a.toml"
    areas.write_text(
        '[[area]]\nname = "all"\nrectangle_mm = [-20, -20, 20, 20]\npress = "click"\n'
        '[[area]]\nname = "inner"\ncircle_mm = [0, 0, 8]\npress = "thud"\n',
        encoding="utf-8",
    )
    built = chladni("effects", "build", areas, "-o", tmp_path / "a.che")
    assert built.code == 0
    assert "area inner: areas before it have all its places" in built.err
    assert "area all" not in built.err
    shown = chladni("effects", "show", areas)
    assert "press: thud" in shown.out
    listed = chladni("effects", "list").out
    assert "20 areas on 65 × 115 mm" in listed
    twice = ("--other", "0,-12", "--other", "0,20")
    refused = chladni("play", "click", "--at", "0,0", *twice, "--emulator")
    assert refused.code == 2
    assert "--other: expected one other finger" in refused.err


def test_a_finger_off_the_board_is_told_by_its_option(
    chladni: CommandLine, table_file: Path
) -> None:
    where = ("--board", "prototype", "--table", table_file, "--emulator")
    for at, other, named in (("0,200", "0,0", "--at"), ("0,0", "0,200", "--other")):
        refused = chladni("play", "click", "--at", at, "--other", other, *where)
        assert refused.code == 2
        assert f"chladni: {named}: expected a place on the board in mm" in refused.err


def test_what_a_low_pass_takes_of_an_effect_is_said(chladni: CommandLine, tmp_path: Path) -> None:
    """Four poles at 250 Hz: (900/250)⁸ is 44.5 dB."""
    path = tmp_path / "hard.toml"
    path.write_text('name = "hard"\n[[click]]\nfrequency_hz = 900.0\n', "utf-8")
    shown = chladni("effects", "show", path)
    assert shown.code == 0, shown.err
    assert "leaves -45 dB of 900 Hz" in shown.err
    assert "low-pass" not in chladni("effects", "show", "click").err


def test_what_there_is_to_play_is_one_thing(chladni: CommandLine) -> None:
    both = chladni("play", "click", "--bank", "slider", "--at", "0,0", "--emulator")
    assert both.code == 2
    assert "EFFECT" in both.err
    none = chladni("play", "--at", "0,0", "--emulator")
    assert none.code == 2
    assert "what to play" in none.err
    real = chladni("play", "--bank", "slider", "--at", "0,0", "--port", "nowhere")
    assert real.code == 2
    assert "`chladni effects flash` gives a device its bank" in real.err


def test_a_press_plays_what_its_area_has_for_it() -> None:
    assert effect_of_bank(BYTES, KEY)[0] == "key"
    area, effect, level = effect_of_bank(BYTES, REST)
    assert (area, effect.loop_s is None) == ("rest", False)
    assert level == pytest.approx(10.0 ** (-3.0 / 20.0), abs=1e-3)
    with pytest.raises(InputError, match="as slide has not"):
        effect_of_bank(BYTES, (10.0, -20.0))
    with pytest.raises(InputError, match="in one of the areas of slider"):
        effect_of_bank(bank_bytes("slider"), (33.0, 0.0))


def test_areas_tell_how_far_along_a_finger_is() -> None:
    area = DeviceArea("a", (-10.0, 0.0), (10.0, 40.0))
    assert area.along((-10.0, 10.0)) == (0.0, 0.25)
    assert area.along((99.0, -5.0)) == (1.0, 0.0)
    assert DeviceArea("everywhere", (0.0, 0.0), (0.0, 0.0)).along((1.0, 2.0)) is None


def test_a_callback_hears_what_fingers_do(emulator: Emulator) -> None:
    device = Device(EmulatorWire(emulator))
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 20.0, KEY))
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 150.0, None))
    heard: list[AreaEvent] = []
    device.effects.on_event(heard.append, seconds=0.3)
    assert [(one.what, one.area) for one in heard] == [("pressed", "key"), ("released", "key")]
    assert heard[0].along == pytest.approx((0.5, 0.5), abs=0.01)
    assert heard[1].at_s - heard[0].at_s == pytest.approx(0.13, abs=0.03)


def test_events_are_told_once_to_each_host_and_the_oldest_are_dropped(emulator: Emulator) -> None:
    for _ in range(20):
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, KEY))
        emulator.run(40.0)
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
        emulator.run(120.0)
    first, second = Device(EmulatorWire(emulator)), Device(EmulatorWire(emulator))
    assert len(first.effects.events()) == 32
    assert first.effects.events() == []
    assert len(second.effects.events()) == 32


def test_an_event_loop_hears_the_same(emulator: Emulator) -> None:
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 5.0, KEY))
    emulator.run(60.0)

    async def first() -> AreaEvent:
        async with AsyncDevice(lambda: EmulatorWire(emulator)) as device:
            async for event in device.area_events():
                return event
        raise AssertionError("no event")

    event = asyncio.run(first())
    assert (event.what, event.area) == ("pressed", "key")


def test_areas_beyond_a_boards_panel_are_told_before_there_is_a_device(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """Off the board they are refused; a panel may be smaller than its plate."""
    board, bank = tmp_path / "b.toml", tmp_path / "slider.che"
    text = (ROOT / "boards" / "phone5.toml").read_text("utf-8")
    whole, small = "size_mm = [71.5, 146.7]          # active", "size_mm = [60.0, 90.0] # active"
    assert whole in text
    board.write_text(text.replace(whole, small), "utf-8")
    build = ("effects", "build", "slider", "-o", bank, "--board")
    told = chladni(*build, board)
    assert told.code == 0
    assert "reach beyond the panel of phone5, which has x -30 to 30 and y -45 to 45" in told.err
    assert "reach beyond" not in chladni(*build, "phone5").err


def test_a_boards_own_level_is_taken_out_where_it_is_asked_for(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """`strip5` gives 1.9 dB more at 199 Hz than at 94, where the sweep is at these times."""
    areas, kept = tmp_path / "s.toml", {}
    areas.write_text('[[area]]\nname = "all"\npress = "sweep"\n', encoding="utf-8")
    for more in ((), ("--flatten", "--board", "strip5")):
        path = tmp_path / f"{len(more)}.che"
        built = chladni("effects", "build", areas, "-o", path, "--json", *more)
        assert built.code == 0, built.err
        (tone,) = read_bank_file(path, "").effects["sweep"].parts
        assert isinstance(tone, Tone)
        kept[len(more)] = tone.amplitude.at(np.array([0.1, 0.85]))
    plain, flat = kept[0], kept[3]
    assert plain[1] / plain[0] == pytest.approx(1.0, abs=0.01)
    assert flat[1] / flat[0] == pytest.approx(10.0 ** (-1.9 / 20.0), abs=0.02)
    refused = chladni("effects", "build", areas, "-o", tmp_path / "x.che", "--flatten")
    assert refused.code == 2
    assert "--board is required" in refused.err


def test_a_press_on_a_key_is_scored_under_the_finger(chladni: CommandLine, tmp_path: Path) -> None:
    """The whole chain, from the bank's bytes to micrometres; no host sends anything."""
    table = tmp_path / "t.chl"
    built = chladni("table", "build", "phone5", "--for", "fingers", "-o", table)
    assert built.code == 0, built.err
    there = ("--board", "phone5", "--table", table, "--emulator", "--json")
    places = ("--at", "-24,20", "--other", "20,-40")
    figure = tmp_path / "key.png"
    kept = json.loads(
        chladni("play", "--bank", "calculator", *places, *there, "--figure", figure).out
    )
    sent = json.loads(chladni("play", "click", *places, *there).out)
    assert (kept["area"], kept["effect"]) == ("7", "click")
    assert figure.stat().st_size > 10_000
    # The place's own level is taken out of what is sent alone, and it is 1 dB there.
    assert kept["peak_um"] == pytest.approx(sent["peak_um"], rel=0.15)
    assert kept["peak_um"] > 5.0
    assert kept["isolation_db"] == pytest.approx(sent["isolation_db"], abs=2.0)
    assert kept["isolation_db"] > 35.0
    assert kept["envelope_error_db"] < 1.0
    assert kept["first_ms"] < 2.5


def test_noise_of_a_bank_is_compared_with_no_other(chladni: CommandLine, tmp_path: Path) -> None:
    """A device draws its own: beside the host's its envelope was told 8 dB off."""
    areas = tmp_path / "n.toml"
    areas.write_text('[[area]]\nname = "all"\npress = "texture"\n', encoding="utf-8")
    there = ("--at", "0,0", "--board", "strip5", "--emulator", "--json")
    assert chladni("play", "--bank", areas, *there).json["envelope_error_db"] is None
    assert chladni("play", "texture", *there).json["envelope_error_db"] < 1.0
    both = ("--other", "0,20", "--other-effect", "tick")
    refused = chladni("play", "--bank", areas, *both, *there)
    assert "with --bank the finger at --other rests" in refused.err


def test_a_bank_of_another_board_is_remarked_on(chladni: CommandLine) -> None:
    strip = ("--at", "0,0", "--board", "strip5", "--emulator")
    told = " ".join(chladni("play", "--bank", "calculator", *strip).err.split())
    assert "these areas reach beyond the board strip5, which has x -7 to 7" in told
