"""Fingers on an effect bank beside what hosts do: no release goes on, and no finger is lost."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.effects import Area, Bank, Click, Curve, Effect, Polygon, Tone
from chladni.effects import shipped_effects as shipped
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation._emulator import effect_samples
from chladni.host.emulation.emulator import Emulator, Recording
from chladni.tables.table import Table
from effects.banks import BYTES
from firmware.bank_boards import LIMITS, board, lay, loudest
from plate_of_bumps import responses_table

KEY, REST, SLIDE = (-15.0, 30.0), (-15.0, -20.0), (12.0, -20.0)
LONG = Effect("long", (Tone(0.0, 1.5, Curve.constant(1.0), Curve.constant(150.0)),))
LONG_RELEASE = pack_bank(
    Bank(
        "l",
        {"long": LONG, "click": shipped()["click"]},
        (
            Area("left", Polygon.rectangle(-30.0, -50.0, 0.0, 50.0), release="long"),
            Area("right", press="long"),
        ),
    )
)


@pytest.fixture(scope="module")
def table() -> Table:
    return responses_table(limits=LIMITS)


def shares(recording: Recording) -> list[float]:
    most = np.abs(recording.duty).max(axis=0)
    return [float(one) for one in most / most.max()]


def told(emulator: Emulator) -> list[tuple[str, int, str | None]]:
    events = Device(EmulatorWire(emulator)).effects.events()
    return [(one.what, one.finger, one.area) for one in events]


def test_a_finger_with_a_hosts_tone_leaves_no_release_behind(table: Table) -> None:
    """Its key has a release, which a tone does not play."""
    emulator = board(table)
    Device(EmulatorWire(emulator)).fingers.set_voice(0, 120.0, 0.5)
    lay(emulator, KEY)
    emulator.run(100.0)
    lay(emulator, None)
    emulator.run(100.0)
    assert emulator.core.state == "idle"
    assert not emulator.run(50.0).duty_steps.any()


def test_after_a_hosts_effect_a_finger_plays_the_bank_again(table: Table) -> None:
    emulator = board(table)
    with Device(EmulatorWire(emulator)) as device:
        device.play("thud", KEY)
        device.link.wait(0.3)
    assert emulator.core.state == "idle"
    told(emulator)
    lay(emulator, KEY)
    assert loudest(emulator.run(60.0)) > 0.5
    assert told(emulator)[-1] == ("pressed", 0, "key")


def test_a_stream_whose_maker_fails_lifts_its_finger(table: Table) -> None:
    emulator = board(table)

    def rows() -> Any:
        yield np.zeros(4000)
        raise OSError("no microphone")

    with Device(EmulatorWire(emulator)) as device:
        with pytest.raises(OSError, match="no microphone"):
            device.stream_signal(rows(), KEY, rate_hz=8000.0)
        device.link.wait(0.1)
        assert device.info()["state"] == "idle"
        assert device.stream_signal(iter(()), KEY, rate_hz=8000.0).samples == 0


def test_flash_is_written_while_a_finger_rests(table: Table) -> None:
    """Long after the last update: outputs go off, and the finger plays the new bank."""
    emulator = board(table)
    emulator.run(12_000.0)
    lay(emulator, REST)
    emulator.run(100.0)
    device = Device(EmulatorWire(emulator))
    assert device.effects.flash(LONG_RELEASE).verified
    assert device.flash(replace(table, board_name="other"), force=True).verified
    emulator.run(6_000.0)
    assert device.effects.flash(BYTES).verified
    emulator.run(6_000.0)
    assert device.previous() in (0, 1)
    emulator.run(6_000.0)
    assert device.effects.flash(LONG_RELEASE).verified


def test_a_hosts_drive_ends_effects(table: Table) -> None:
    """A finger that lingers under a long release is gone, and the next press is one."""
    emulator = board(table, LONG_RELEASE)
    device = Device(EmulatorWire(emulator))
    lay(emulator, KEY)
    lay(emulator, SLIDE, 1)
    emulator.run(100.0)
    lay(emulator, None)
    emulator.run(60.0)
    device.live([0.0] * 5, 160.0)
    emulator.core.run_us(30_000)
    assert emulator.core.state == "streaming"
    emulator.core.take_duties()
    emulator.core.run_us(20_000)
    assert not np.abs(emulator.core.take_duties()).max() > 8
    with pytest.raises(LinkError, match="effect: not in this state"):
        device.effects.play("click", 1)
    lay(emulator, None, 1)
    emulator.run(100.0)
    device.stop()
    emulator.run(50.0)
    told(emulator)
    lay(emulator, SLIDE)
    assert loudest(emulator.run(60.0)) > 0.5
    assert told(emulator)[-1] == ("pressed", 0, "right")


def test_another_finger_in_the_slot_of_one_that_left_is_a_finger_of_its_own(table: Table) -> None:
    """`on_move` 1 keeps a finger's drive where it came down: the new one gets its own place's."""
    fresh = board(table, LONG_RELEASE, on_move=1)
    lay(fresh, (-20.0, -40.0), 1)  # rests, so that drives are found for two
    fresh.run(80.0)
    lay(fresh, SLIDE)
    fresh.run(60.0)
    wanted = shares(fresh.run(30.0))
    emulator = board(table, LONG_RELEASE, on_move=1)
    lay(emulator, (-20.0, -40.0), 1)
    emulator.run(80.0)
    lay(emulator, KEY)
    emulator.run(60.0)
    lay(emulator, None)
    emulator.run(60.0)  # its release plays on
    lay(emulator, SLIDE)
    emulator.run(60.0)
    np.testing.assert_allclose(shares(emulator.run(30.0)), wanted, atol=0.05)


def test_a_finger_in_place_of_a_hosts_presses(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    device.fingers.touch(0, *REST)
    emulator.run(80.0)
    lay(emulator, KEY)
    assert loudest(emulator.run(60.0)) > 0.5
    assert told(emulator)[-1] == ("pressed", 0, "key")


def test_a_finger_that_left_is_in_no_area(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    lay(emulator, KEY)
    lay(emulator, SLIDE, 1)
    emulator.run(80.0)
    lay(emulator, None, 1)
    emulator.run(120.0)
    assert device.effects.area_of(1) is None
    assert device.effects.area_of(0) is not None


def test_a_host_sends_nothing_to_a_finger_that_plays_the_bank(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    lay(emulator, KEY)
    emulator.run(120.0)
    device.fingers.set_signal(0)
    with pytest.raises(LinkError, match="signal_data: not in this state"):
        device.fingers.send(0, np.ones(60))
    assert loudest(emulator.run(60.0)) <= 0.0


def test_effects_have_shapes_of_their_own(table: Table) -> None:
    """The configured attack, decay and rest level are of a touch's tone."""
    shaped: dict[str, Any] = {"attack_ms": 300, "decay_ms": 50, "sustain_q15": 0}
    peaks = []
    for settings in (dict[str, Any](), shaped):
        emulator = board(table, **settings)
        lay(emulator, KEY)
        peaks.append(loudest(emulator.run(60.0)))
        emulator.run(500.0)
        lay(emulator, None)
        peaks.append(loudest(emulator.run(60.0)))
    np.testing.assert_allclose(peaks[2:], peaks[:2], atol=0.02)


def test_parts_before_a_tone_leave_its_phase_alone() -> None:
    """A click in the middle of a tone, whichever stands first."""
    click, tone = Click(0.1, 0.5, 160.0), Tone(0.0, 0.3, Curve.constant(0.5), Curve.constant(100.0))
    made = []
    for parts in ((click, tone), (tone, click)):
        data = pack_bank(Bank("b", {"both": Effect("both", parts)}, ()))
        made.append(effect_samples(data, 0, round(0.3 * SIGNAL_HZ)))
    np.testing.assert_allclose(made[0], made[1], atol=1e-5)


def test_an_older_bank_plays_with_a_warning(table: Table) -> None:
    emulator = board(table)
    device = Device(EmulatorWire(emulator))
    assert device.effects.flash(LONG_RELEASE).slot == 1
    emulator.core.program(64 * 1024 + 100, b"\x00\x00", "effects")
    emulator.core.boot()
    assert Device(EmulatorWire(emulator)).effects.info()["name"] == "all"
    assert "older effect bank" in {cause for cause, *_ in emulator.core.faults}
    lay(emulator, KEY)
    assert loudest(emulator.run(60.0)) > 0.5
