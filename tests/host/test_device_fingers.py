"""Fingers that a host holds, hears and asks about: over the link, and by command."""

from __future__ import annotations

import json
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.effects import shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.device.checks.info_rows import finger_rows
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.sim.errors import ArgumentError, InputError
from chladni.tables.format import pack
from chladni.tables.table import Limits, Table
from conftest import CommandLine
from firmware.judged_device import BRIDGES
from made_up import device_of, make_table
from plate_of_bumps import responses_table

LIMITS = Limits(4000, 100_000, 10_000_000)


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def test_a_host_holds_several_fingers_and_hears_of_them(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    with Device(EmulatorWire(emulator)) as device:
        assert device.fingers.all() == []
        assert device.fingers.touch(0, -18.0, 30.0) == (-18.0, 30.0)
        device.link.wait(0.05)
        (alone,) = device.fingers.all()
        assert (alone["finger"], alone["place_mm"]) == (0, [-18.0, 30.0])
        assert alone["isolation_db"] is None
        # Coils work in proportion to what they do: below all of them at full.
        assert -6.0 < alone["level_db"] < 0.0
        # Off the board it is the nearest place on it.
        assert device.fingers.touch(3, 17.0, -70.0) == (17.0, -50.0)
        device.link.wait(0.05)
        both = device.fingers.all()
        assert [one["finger"] for one in both] == [0, 3]
        assert all(one["isolation_db"] > 30.0 for one in both)
        assert all(one["level_db"] < 0.0 for one in both)
        device.fingers.lift(0)
        device.link.wait(0.05)
        assert [one["finger"] for one in device.fingers.all()] == [3]
        assert device.info()["state"] == "playing"
        device.fingers.lift(3)
        device.link.wait(0.1)
        assert device.info()["state"] == "idle"
        assert device.fingers.all() == []


def test_fingers_of_a_host_that_falls_silent_are_lifted(table: Table) -> None:
    emulator = Emulator(device_of(table), table)
    device = Device(EmulatorWire(emulator))
    device.fingers.touch(1, 0.0, 10.0)
    device.fingers.touch(2, 0.0, -20.0)
    emulator.run(1500.0)
    assert not emulator.run(20.0).duty_steps.any()
    assert emulator.core.faults[-1][0] == "host silent"


def test_a_table_without_responses_has_one_finger() -> None:
    table = replace(make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]])), limits=LIMITS)
    emulator = Emulator(device_of(table), table)
    with Device(EmulatorWire(emulator)) as device:
        device.fingers.touch(0, 1.0, 2.0)
        with pytest.raises(LinkError, match="finger_touch"):
            device.fingers.touch(1, 5.0, 5.0)
        device.link.wait(1.5)  # longer than a silent host's finger stays
        assert device.info()["state"] == "playing"


@pytest.mark.parametrize("finger", [-1, 5])
def test_there_are_five_fingers(table: Table, finger: int) -> None:
    with Device(EmulatorWire(Emulator(device_of(table), table))) as device:
        for ask in (
            lambda: device.fingers.touch(finger, 0.0, 0.0),
            lambda: device.fingers.lift(finger),
            lambda: device.fingers.set_voice(finger),
        ):
            with pytest.raises(ArgumentError, match="0 to 4"):
                ask()
        with pytest.raises(ArgumentError, match="level"):
            device.fingers.set_voice(0, level=1.5)
        # And what a library does not check, the device refuses.
        wrong: list[tuple[str, dict[str, int]]] = [
            ("finger_touch", {"finger": 5, "x_um": 0, "y_um": 0}),
            ("finger_lift", {"finger": 5}),
            ("voice", {"finger": 5, "millihertz": 0, "level_q15": 0}),
            ("voice", {"finger": 0, "millihertz": 999, "level_q15": 0}),
            ("voice", {"finger": 0, "millihertz": 0, "level_q15": 32768}),
        ]
        for request, fields in wrong:
            with pytest.raises(LinkError):
                device.link.request(request, b"", **fields)


def test_commands_touch_several_places(chladni: CommandLine, table: Table, tmp_path: Path) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(table))
    known = ("--emulator", "--table", path)
    found = chladni("device", "touch", "-18,30", "17,-25", *known, "--seconds", "0.2", "--json")
    assert found.code == 0, found.err
    answer = json.loads(found.out)
    assert answer["place_mm"] == [-18.0, 30.0]
    assert [one["place_mm"] for one in answer["fingers"]] == [[-18.0, 30.0], [17.0, -25.0]]
    people = chladni("device", "touch", "-18,30", "17,-25", *known, "--seconds", "0.2")
    assert "finger 1" in people.out
    listed = chladni("device", "touches", *known, "--json")
    assert json.loads(listed.out) == {"fingers": [], "events": []}
    assert chladni("device", "info", *known, "--json").json["fingers"] == []
    for words, named in (
        (["0,0"] * 6, "X,Y: expected at most 5 fingers"),
        (["0,0", "1;2"], "X,Y"),
        (["0,0", "9,9", "1,1"], "X,Y: expected fingers that lie 5 mm apart or more, got '1,1'"),
        (["0,0", "5000,0"], "within 1000 mm"),
    ):
        refused = chladni("device", "touch", *words, *known, "--json")
        assert (refused.code, refused.out) == (2, "")
        assert named in refused.err


def test_fingers_that_are_down_are_rows_of_what_a_device_says_of_itself(table: Table) -> None:
    with Device(EmulatorWire(Emulator(device_of(table), table))) as device:
        device.fingers.touch(0, -18.0, 30.0)
        device.fingers.touch(1, 17.0, -25.0)
        device.link.wait(0.1)
        rows = finger_rows(device.fingers.all(), has_bank=False)
    assert list(rows) == ["finger 0", "finger 1", "these dB"]
    assert "-18, 30 mm" in rows["finger 0"]
    assert "dB less of it by the table" in rows["finger 0"]


def test_a_signal_is_played_under_a_finger_over_the_link(table: Table) -> None:
    """Longer than the device's ring: all of it goes out, with no gap, and the finger lifts."""
    with_bridges: dict[str, Any] = {**BRIDGES}
    emulator = Emulator(device_of(table, **with_bridges), table, level=1.0)
    tone = 0.8 * np.sin(2.0 * np.pi * 120.0 * np.arange(1200) / SIGNAL_HZ)
    with Device(EmulatorWire(emulator)) as device:
        device.fingers.set_voice(1, level=0.0)
        device.fingers.touch(1, 17.0, -25.0)
        emulator.core.take_duties()
        played = device.fingers.play(tone, (-18.0, 30.0))
        steps = emulator.core.take_duties().astype(float)
        assert (played.place_mm, played.samples) == ((-18.0, 30.0), 1200)
        assert played.fewest_waiting > 30
        assert played.isolation_db is not None
        assert played.isolation_db > 30.0
        assert [one["finger"] for one in device.fingers.all()] == [1]
    loudest = steps[:, np.ptp(steps, axis=0).argmax()]
    carrier = emulator.carrier_hz
    on = np.flatnonzero(np.abs(loudest) > 20.0)
    assert (on[-1] - on[0]) / carrier == pytest.approx(1200 / SIGNAL_HZ, abs=0.02)
    middle = loudest[on[0] + len(on) // 4 : on[-1] - len(on) // 4]
    spectrum = np.abs(np.fft.rfft((middle - middle.mean()) * np.hanning(len(middle))))
    assert np.fft.rfftfreq(len(middle), 1.0 / carrier)[spectrum.argmax()] == pytest.approx(
        120.0, abs=5.0
    )


def test_a_device_on_a_port_says_what_it_reckons_and_where_micrometres_are(
    table: Table, chladni: CommandLine
) -> None:
    known = device_of(table, full_force_mn=400)
    port, ends = VirtualPort(Emulator(known, table)), threading.Event()
    served = threading.Thread(target=port.serve, args=(ends.is_set,))
    served.start()
    try:
        places = ("--at", "-18,30", "--other", "17,-25")
        there = ("--port", port.port, "--json")
        done = chladni("play", "click", *places, "--level-um", "2", *there)
        both = chladni("play", "click", *places, "--other-effect", "thud", *there)
        after = chladni("device", "touch", "-18,30", "17,-25", *there)
        off = chladni("play", "click", "--at", "-18,30", "--other", "80,-10", *there)
    finally:
        ends.set()
        served.join()
        port.close()
    assert done.json["isolation_db"] > 30.0
    assert not [key for key in done.json if key.endswith("_um")]
    for part in ("what gives 2 µm", "--emulator with the same --board and --table"):
        assert part in " ".join(done.err.split())
    assert done.json["fewest_waiting"] <= done.json["samples"]
    named = [(one["name"], one["effect"]) for one in both.json["fingers"]]
    assert named == [("A", "click"), ("B", "thud")]
    assert [one["place_mm"] for one in both.json["fingers"]] == [[-18.0, 30.0], [17.0, -25.0]]
    for one in both.json["fingers"]:
        assert one["samples"] == len(shipped_effects()[one["effect"]].samples(SIGNAL_HZ))
        assert one["isolation_db"] > 30.0
    # The finger that was spared has its own signal again.
    assert after.json["fingers"][1]["isolation_db"] > 20.0
    assert (off.code, "--other: expected a place on the board" in off.err) == (2, True)


def test_two_effects_go_out_at_once_without_a_gap(table: Table) -> None:
    """Longer than the device's rings, at 115,200 baud: each finger's own tone at the same time."""
    tones = [np.sin(2.0 * np.pi * hertz * np.arange(1500) / SIGNAL_HZ) for hertz in (100.0, 180.0)]
    settings: dict[str, Any] = {**BRIDGES}
    emulator = Emulator(device_of(table, **settings), table, level=1.0)
    with Device(EmulatorWire(emulator)) as device:
        emulator.core.take_duties()
        played = device.fingers.play_together(tones, [(-18.0, 30.0), (17.0, -25.0)])
        duty = emulator.core.take_duties() / 1024.0
    assert [one.samples for one in played] == [1500, 1500]
    assert min(one.fewest_waiting for one in played) > 5
    lasts = round(0.5 * emulator.carrier_hz)
    own = duty[len(duty) // 2 - lasts // 2 :][:lasts]
    loud = [parts_in(own - own.mean(axis=0), emulator.carrier_hz, hz) for hz in (100.0, 180.0)]
    assert min(loud) > 0.1
    assert parts_in(own - own.mean(axis=0), emulator.carrier_hz, 140.0) < 0.03 * min(loud)


@pytest.mark.parametrize("count", [1, 2])
def test_a_device_that_ends_effects_is_told(table: Table, count: int) -> None:
    """A finger that was lifted takes no samples: no one waits for it for ever."""
    tone, places = np.ones(1500), [(-18.0, 30.0), (17.0, -25.0)]
    short = replace(table, limits=replace(table.limits, max_on_us=300_000))

    with (
        Device(EmulatorWire(Emulator(device_of(short), short))) as device,
        pytest.raises(LinkError, match="ended a touch"),
    ):
        _ = (
            device.fingers.play(tone, places[0])
            if count == 1
            else device.fingers.play_together([tone] * count, places)
        )


def test_samples_beyond_full_scale_and_levels_beyond_all_are_refused(table: Table) -> None:
    with Device(EmulatorWire(Emulator(device_of(table), table))) as device:
        with pytest.raises(ArgumentError, match="samples: expected -1 to 1"):
            device.fingers.send(0, [0.0, 1.2])
        with pytest.raises(ArgumentError, match="level: expected 0 to 1"):
            device.fingers.set_signal(0, 1.5)
        with pytest.raises(ArgumentError, match="finger: expected 0 to 4"):
            device.fingers.set_signal(5)


def parts_in(recorded: NDArray[np.float64], rate_hz: float, hertz: float) -> float:
    """Amplitude of a tone in the loudest channel's duty."""
    times = np.arange(len(recorded)) / rate_hz
    turned = recorded.T @ np.exp(-2j * np.pi * hertz * times)
    return float(2.0 * np.abs(turned).max() / len(recorded))


def test_a_live_signal_comes_row_by_row(table: Table) -> None:
    """A tone of 150 Hz at 8 kHz, in rows of 5 ms: no gap, and nothing else on the pins."""
    emulator = Emulator(device_of(table), table, level=1.0)
    device = Device(EmulatorWire(emulator))
    times = np.arange(int(0.6 * 8000)) / 8000.0
    tone = 0.5 * np.sin(2.0 * np.pi * 150.0 * times)
    rows = (tone[k : k + 40] for k in range(0, len(tone), 40))
    emulator.core.take_duties()
    played = device.stream_signal(rows, (-18.0, 30.0), rate_hz=8000.0, level_db=-6.0)
    assert played.fewest_waiting > 0
    assert played.samples == pytest.approx(0.6 * SIGNAL_HZ, abs=2)
    duty = emulator.core.take_duties() / 1024.0
    own = duty[len(duty) // 4 : -len(duty) // 4]
    loud = parts_in(own - own.mean(axis=0), emulator.carrier_hz, 150.0)
    assert loud > 0.05
    for hertz in (75.0, 225.0, 300.0, 450.0):
        assert parts_in(own - own.mean(axis=0), emulator.carrier_hz, hertz) < 0.02 * loud


def test_an_effect_is_played_by_its_name(table: Table) -> None:
    device = Device(EmulatorWire(Emulator(device_of(table), table)))
    played = device.play("click", (-18.0, 30.0), level_db=-3.0)
    assert played.place_mm == (-18.0, 30.0)
    assert played.samples == len(shipped_effects()["click"].samples(SIGNAL_HZ))
    with pytest.raises(InputError, match="effect: expected click"):
        device.play("clack", (0.0, 0.0))
    for level_db in (3.0, 1e5, float("nan")):
        with pytest.raises(ArgumentError, match="level_db: expected 0 or less"):
            device.play("click", (0.0, 0.0), level_db=level_db)
    with pytest.raises(ArgumentError, match="rate_hz: expected more than 500"):
        device.stream_signal(np.zeros(9), (0.0, 0.0), rate_hz=400.0)
    with pytest.raises(ArgumentError, match="signal: expected a row of numbers"):
        device.stream_signal(np.zeros((2, 2)), (0.0, 0.0), rate_hz=4000.0)


def test_a_host_says_how_far_its_signal_moves_a_finger(table: Table) -> None:
    """As it knows from responses and a coil's force; duties go with it."""
    emulator = Emulator(device_of(table, full_force_mn=300), table)
    device, most = Device(EmulatorWire(emulator)), {}
    for level_um in (0.5, 1.0, 600.0, None):
        emulator.core.take_duties()
        device.fingers.play_effect("pulse", (-18.0, 30.0), level_um=level_um)
        most[level_um] = np.ptp(emulator.core.take_duties(), axis=0).max()
    assert most[0.5] == pytest.approx(0.5 * most[1.0], rel=0.1)
    assert most[1.0] < 0.9 * most[None]
    assert most[600.0] == most[None]
    for level_um in (0.0, -1.0, 656.0, float("nan")):
        with pytest.raises(ArgumentError, match=r"level_um: expected 0\.01 to 655\.35"):
            device.play("click", (0.0, 0.0), level_um=level_um)
    assert device.fingers.all() == []


@pytest.mark.parametrize("has_responses", [True, False])
def test_a_device_that_knows_no_micrometres_says_so(table: Table, has_responses: bool) -> None:
    own = table if has_responses else make_table(np.ones((1, 5)))
    settings = {} if has_responses else {"full_force_mn": 300}
    device = Device(EmulatorWire(Emulator(device_of(own, **settings), own)))
    with pytest.raises(
        LinkError, match=r"no micrometres.*responses in its table and a coil's force"
    ):
        device.play("click", (0.0, 0.0), level_um=1.0)
    assert device.fingers.all() == []
    assert device.info()["state"] == "idle"


@pytest.mark.parametrize(
    "places",
    [("0,0", "0,90"), ("50,0", "20,0"), ("-36,0", "0,0"), ("0,0", "0,-73.36"), ("50,0",)],
)
def test_a_finger_off_the_board_plays_nothing(
    chladni: CommandLine, table_file: Path, places: tuple[str, ...]
) -> None:
    there = ("--emulator", "--table", table_file)
    refused = chladni("device", "touch", *places, *there, "--json")
    assert (refused.code, refused.out) == (2, "")
    assert "X,Y: expected a place on the board, -35.75 to 35.75 and" in refused.err


def test_an_older_device_is_not_asked_where_its_board_is(
    table: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    device = Device(EmulatorWire(Emulator(device_of(table), table)))
    assert device.reach_mm() == (-30.0, -50.0, 29.999, 49.999)
    monkeypatch.setitem(device.version.fields, "minor", 6)
    assert device.reach_mm() is None
    # Nor given responses, which its firmware cannot read.
    monkeypatch.setitem(device.version.fields, "minor", 3)
    with pytest.raises(InputError, match=r"responses: .* firmware of link 2.4 or newer, .* 2.3"):
        device.flash(table)
