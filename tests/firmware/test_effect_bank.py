"""A device that plays an effect bank from its flash, without a host."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.drives.fingers.silence import disc_weights, loaded_points
from chladni.effects import Area, Bank, Circle, Curve, Effect, Polygon, Tone
from chladni.effects import shipped_effects as shipped
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import unpack_bank
from chladni.host.device.device import Device
from chladni.host.device.device_effects import AreaEvent
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.sim.errors import ArgumentError
from chladni.tables.responses import TableResponses
from chladni.tables.table import Table
from effects.banks import ALL, BYTES
from firmware.bank_boards import LIMITS, board, lay, loudest
from made_up import make_section, make_table
from plate_of_bumps import FINGER, responses_table

FloatArray = NDArray[np.float64]

KEY, SLIDE, REST = (-15.0, 30.0), (10.0, -38.0), (-15.0, -20.0)


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def events(emulator: Emulator) -> list[AreaEvent]:
    return Device(EmulatorWire(emulator)).effects.events()


def told(emulator: Emulator) -> list[tuple[str, int, str | None]]:
    return [(one.what, one.finger, one.area) for one in events(emulator)]


def test_a_press_plays_what_a_host_would_have_sent(table: Table) -> None:
    """The click of the key, on the pins, within what a bridge loses and noise shaping."""
    alone = board(table)
    lay(alone, KEY)
    recorded = [alone.run(60.0)]
    sent = board(table, b"")
    sent.core.set_signal_voice(0, 32767)
    samples = unpack_bank(BYTES).effects["click"].samples(SIGNAL_HZ)
    sent.core.push_signal(0, [round(32767.0 * float(one)) for one in samples])
    lay(sent, KEY)
    recorded.append(sent.run(60.0))
    # Samples are the interrupt's own; the touch is the same, and so is the turn.
    one, other = (
        np.convolve(np.abs(r.duty).sum(axis=1), np.ones(64) / 64.0, "same") for r in recorded
    )
    lag = int(np.argmax(np.correlate(one, other, "full"))) - (len(other) - 1)
    assert abs(lag) <= 4 * 4
    assert loudest(recorded[0]) > 0.5
    np.testing.assert_allclose(np.roll(other, lag), one, atol=0.03)


def test_press_and_release_play_what_their_area_has(table: Table) -> None:
    emulator = board(table)
    lay(emulator, KEY)
    assert loudest(emulator.run(60.0)) > 0.5
    assert loudest(emulator.run(60.0)) <= 0.0  # over, and the finger rests
    assert emulator.core.state == "playing"
    lay(emulator, None)
    assert loudest(emulator.run(60.0)) > 0.5
    emulator.run(60.0)
    assert emulator.core.state == "idle"
    assert not emulator.run(20.0).duty_steps.any()
    assert told(emulator) == [("pressed", 0, "key"), ("released", 0, "key")]
    assert emulator.core.faults == []


def test_what_is_held_goes_on_until_the_finger_leaves(table: Table) -> None:
    """`hum` loops from 0.1 to 0.2 s, and has no release."""
    emulator = board(table)
    lay(emulator, REST)
    emulator.run(300.0)
    for _ in range(5):
        assert loudest(emulator.run(100.0)) > 0.1
    lay(emulator, None)
    emulator.run(40.0)
    assert emulator.core.state == "idle"
    assert not emulator.run(100.0).duty_steps.any()


def test_a_level_is_that_of_the_area(table: Table) -> None:
    """The same click in two areas, one 12 dB down."""
    areas = (
        Area("loud", Circle(KEY, 5.0), press="click"),
        Area("soft", Polygon.rectangle(-30.0, -50.0, 30.0, 50.0), press="click", level_db=-12.0),
    )
    bank = pack_bank(Bank("b", {"click": shipped()["click"]}, areas))
    peaks = []
    for hysteresis in (KEY, (KEY[0], KEY[1] - 5.6)):
        emulator = board(table, bank)
        lay(emulator, hysteresis)
        peaks.append(float(np.abs(emulator.run(60.0).duty).max()))
    # The second place is 0.6 mm outside: its drive is nearly the same.
    assert 20.0 * np.log10(peaks[1] / peaks[0]) == pytest.approx(-12.0, abs=1.5)


def test_a_slider_steps_at_its_places_and_not_where_a_finger_trembles(table: Table) -> None:
    """Each 5 mm from its edge at y = -40; to and fro across one by less than an eighth of that."""
    emulator = board(table)
    lay(emulator, SLIDE)
    emulator.run(40.0)
    events(emulator)
    begun = emulator.core.now_us / 1e3
    for k in range(70):
        emulator.touch(TouchEvent(begun + 5.0 * (k + 1), (10.0, -38.0 + 0.5 * k)))
    emulator.run(400.0)
    device = Device(EmulatorWire(emulator))
    stepped = [one for one in device.effects.events() if one.what == "stepped"]
    places = np.array([one.place_mm[1] for one in stepped])
    np.testing.assert_allclose(places, np.arange(-35.0, 0.0, 5.0) + 0.6, atol=1.2)
    assert [one.along for one in stepped] == sorted(one.along for one in stepped if one.along)
    begun = emulator.core.now_us / 1e3
    for k in range(40):
        emulator.touch(TouchEvent(begun + 10.0 * (k + 1), (10.0, -5.0 + 0.4 * (-1) ** k)))
    emulator.run(420.0)
    assert sum(one.what == "stepped" for one in device.effects.events()) <= 1


def test_grains_come_by_the_way_that_a_finger_went(table: Table) -> None:
    """In a circle of 9 mm, a tick each 4 mm of path, whatever its direction."""
    emulator = board(table)
    turns = np.linspace(0.0, 2.0 * np.pi, 60)
    lay(emulator, (15.0, 30.0))
    emulator.run(40.0)
    begun = emulator.core.now_us / 1e3
    for k, turn in enumerate(turns):
        place = (10.0 + 5.0 * np.cos(turn), 30.0 + 5.0 * np.sin(turn))
        emulator.touch(TouchEvent(begun + 10.0 * (k + 1), (float(place[0]), float(place[1]))))
    emulator.run(650.0)
    stepped = [one for one in events(emulator) if one.what == "stepped"]
    assert {one.area for one in stepped} == {"knob"}
    assert len(stepped) in (7, 8)  # of 31.4 mm


def test_a_finger_that_goes_elsewhere_hears_what_is_there(table: Table) -> None:
    emulator = board(table)
    lay(emulator, KEY)
    emulator.run(60.0)
    lay(emulator, REST)
    emulator.run(25.0)
    assert loudest(emulator.run(60.0)) > 0.1  # entering, then the hum
    lay(emulator, KEY)
    emulator.run(300.0)  # what played once goes on to its end
    assert loudest(emulator.run(80.0)) <= 0.0  # a key has nothing for who comes from elsewhere
    assert told(emulator) == [
        ("pressed", 0, "key"),
        ("entered", 0, "rest"),
        ("entered", 0, "key"),
    ]


def test_each_finger_has_its_own(table: Table) -> None:
    """One rests on a key, another presses and leaves: the first one's area and slot stay."""
    emulator = board(table)
    lay(emulator, KEY)
    emulator.run(60.0)
    lay(emulator, (12.0, -20.0), 1)
    emulator.run(60.0)
    assert [t["is_down"] for t in _touches(emulator)] == [True, True]
    device = Device(EmulatorWire(emulator))
    assert [device.effects.area_of(k).name for k in (0, 1)] == ["key", "slide"]  # type: ignore[union-attr]
    lay(emulator, None, 1)
    emulator.run(60.0)
    lay(emulator, REST, 1)
    emulator.run(20.0)
    assert loudest(emulator.run(60.0)) > 0.05
    lay(emulator, None, 0)
    emulator.run(150.0)
    assert emulator.core.state == "playing"
    assert told(emulator) == [
        ("pressed", 0, "key"),
        ("pressed", 1, "slide"),
        ("released", 1, "slide"),
        ("pressed", 1, "rest"),
        ("released", 0, "key"),
    ]


def _touches(emulator: Emulator) -> list[dict[str, Any]]:
    return [{"is_down": bool(one[0])} for one in emulator.core.touches()][:2]


def test_a_new_touch_ends_a_release_that_plays(table: Table) -> None:
    emulator = board(table)
    lay(emulator, KEY)
    emulator.run(60.0)
    lay(emulator, None)
    emulator.run(12.0)
    assert emulator.core.state == "lifted"
    lay(emulator, REST)
    emulator.run(60.0)
    assert emulator.core.state == "playing"
    assert told(emulator)[-1] == ("pressed", 0, "rest")


def test_a_release_that_no_one_plays_ends_all_the_same(table: Table) -> None:
    """Its samples are not taken where no interrupt asks for them."""
    emulator = board(table)
    lay(emulator, KEY)
    emulator.run(60.0)
    lay(emulator, None)
    emulator.run(8.0)
    emulator.core.kill_interrupt(True)
    emulator.run(1500.0)
    assert emulator.core.state in ("idle", "fault")


def test_a_table_without_responses_has_effects_too() -> None:
    """One finger, whose drive is its region's."""
    plain = replace(make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]])), limits=LIMITS)
    emulator = board(plain)
    lay(emulator, (-15.0, 30.0))
    assert loudest(emulator.run(60.0)) > 0.5
    assert told(emulator) == [("pressed", 0, "key")]


def test_without_a_bank_fingers_play_the_tables_tone(table: Table) -> None:
    emulator = board(table, b"")
    lay(emulator, KEY)
    emulator.run(60.0)
    assert loudest(emulator.run(60.0)) > 0.3
    info = Device(EmulatorWire(emulator)).effects.info()
    assert (info["bank_status"], info["effects"], info["areas"]) == ("no effect bank", [], [])
    assert told(emulator) == []


def test_a_host_plays_an_effect_of_the_bank_by_its_name(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    assert device.effects.info()["effects"] == list(ALL.effects)
    with pytest.raises(LinkError, match="effect: not in this state"):
        device.effects.play("thud")
    lay(emulator, KEY)
    emulator.run(120.0)
    device.effects.play("thud", level_db=-6.0)
    assert 0.2 < loudest(emulator.run(60.0)) < 0.7
    with pytest.raises(ArgumentError, match="effect: expected one of click, tick"):
        device.effects.play("clack")
    with pytest.raises(ArgumentError, match="level_db: expected 0 or less"):
        device.effects.play("thud", level_db=3.0)
    # A slot that a host gave a tone has that, and the bank's again once it takes it back.
    device.fingers.set_voice(0, 120.0, 0.5)
    lay(emulator, None)
    emulator.run(100.0)
    lay(emulator, KEY)
    emulator.run(60.0)
    assert loudest(emulator.run(60.0)) > 0.2
    with pytest.raises(LinkError, match="effect: not in this state"):
        device.effects.play("thud")
    device.fingers.set_voice(0)
    lay(emulator, None)
    emulator.run(100.0)
    lay(emulator, KEY)
    emulator.run(100.0)
    assert loudest(emulator.run(60.0)) <= 0.0


def hum(level_um: float | None) -> bytes:
    """160 Hz as long as a finger stays, everywhere."""
    tone = Tone(0.0, 0.4, Curve.constant(1.0), Curve.constant(160.0))
    area = Area("all", hold="hum", level_um=level_um)
    return pack_bank(Bank("b", {"hum": Effect("hum", (tone,), loop_s=(0.1, 0.2))}, (area,)))


def moved_um(emulator: Emulator, table: Table, slot: int) -> float:
    """What its steady pins move a finger by, in the table's own responses."""
    recording = emulator.run(400.0)
    count = len(recording.duty_steps)
    newtons = FINGER.full_force_un * 1e-6 * phasors(recording, Play(count // 2, count), 160.0)
    down = [(x, y) for is_down, x, y, *_ in emulator.core.touches() if is_down]
    places = [(x * 1e-6, y * 1e-6) for x, y in down]
    points = loaded_points(TableResponses.of(table), np.array(places), FINGER.stiffness)
    return float(1e6 * np.abs(disc_weights() @ points[slot] @ newtons))


@pytest.mark.parametrize("has_drives", [False, True])
@pytest.mark.parametrize("others", [(), (REST,)])
def test_micrometres_are_those_of_the_area_wherever_the_place_allows_them(
    table: Table, others: tuple[tuple[float, float], ...], has_drives: bool
) -> None:
    """One finger by the table's drives or by its responses; and beside another that rests."""
    if has_drives:
        columns, rows = table.grid.columns, table.grid.rows
        drives = np.tile([2.0, -4.0, 10.0, 3.0, 6.0], (columns * rows, 1))
        table = replace(table, sections=(make_section(drives),))
    loud = {}
    for level_um in (None, 1.0, 0.25, 500.0):
        emulator = board(table, hum(level_um), full_force_mn=300)
        for slot in range(1, len(others) + 1):
            emulator.core.set_voice(slot, 0, 0)
        for slot, place in enumerate((KEY, *others)):
            lay(emulator, place, slot)
        emulator.run(300.0)
        loud[level_um] = moved_um(emulator, table, 0)
    assert loud[None] > 1.3
    # A ramp's rounding, and the pins' harmonics.
    assert loud[1.0] == pytest.approx(1.0, rel=0.03)
    assert loud[0.25] == pytest.approx(0.25, rel=0.05)
    assert loud[500.0] == pytest.approx(loud[None], rel=1e-3)
