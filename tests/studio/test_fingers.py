"""Several fingers over the wire: each has a signal of its own, and what the others get of it."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection

from chladni.drives.scoring.several_fingers.finger_sets import FingerSet
from chladni.host.emulation import played_fingers
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import Emulator, Recording
from chladni.host.studio.boards.board_message import board_message
from chladni.host.studio.boards.prepared import BoardChoice, ReadyBoard, page_objective
from chladni.host.studio.export import file_data
from chladni.host.studio.messages.requests import Touch, Voice
from chladni.host.studio.playing.emulated_device import EmulatedDevice
from chladni.host.studio.playing.emulated_fingers import EmulatedFingers
from chladni.host.studio.playing.played import Played, played_message
from chladni.sim.board.electronics import Panel
from chladni.sim.board.fingers import SeveralFingers
from chladni.sim.board.parts import Image
from chladni.sim.errors import ChladniError
from chladni.sim.image.finger import pressing_stiffness, threshold_um
from studio.conftest import Studio
from studio.pages import Place
from studio.wire import opened, told_of

PLACES: tuple[Place, ...] = ((0.0, 30.0), (1.0, -12.0))


def ask(own: ClientConnection, number: int, kind: str, finger: int, **values: Any) -> None:
    own.send(json.dumps({"type": kind, "number": number, "finger": finger} | values))


def press(own: ClientConnection, number: int, finger: int, place: Place) -> dict[str, Any]:
    ask(own, number, "press", finger, x_mm=place[0], y_mm=place[1])
    return told_of(own, "played")


def voice(
    own: ClientConnection, number: int, finger: int, tone_hz: float | None, level: float
) -> dict[str, Any]:
    ask(own, number, "voice", finger, tone_hz=tone_hz, level=level)
    return told_of(own, "played")


def off_diagonal(message: dict[str, Any]) -> list[float]:
    rows = message["matrix_db"]
    return [value for i, row in enumerate(rows) for j, value in enumerate(row) if i != j]


def test_two_fingers_hardly_feel_each_others_signals(strip_studio: Studio) -> None:
    """As `chladni fingers` scores the board: 36 dB at the median, 27 at the worst tenth."""
    with opened(strip_studio) as own:
        assert "fingers" not in press(own, 1, 0, PLACES[0])
        both = press(own, 2, 1, PLACES[1])
    assert [one["finger"] for one in both["fingers"]] == [0, 1]
    assert [one["place_mm"] for one in both["fingers"]] == [list(place) for place in PLACES]
    assert [both["matrix_db"][k][k] for k in range(2)] == [0.0, 0.0]
    assert max(off_diagonal(both)) < -20.0
    assert all(one["tone_hz"] == 160.0 for one in both["fingers"])
    assert all(-20.0 < one["level_db"] <= 0.0 for one in both["fingers"])
    # What today's message has is the first finger's.
    assert both["place_mm"] == list(PLACES[0])
    assert both["drive"] == both["fingers"][0]["drive"]


def test_the_matrix_is_that_of_the_plate_with_both_fingers_pressing(strip: ReadyBoard) -> None:
    """And micrometres of a finger follow from the drive and what its unit is worth."""
    message = played_message(strip, 1, both_down(strip))
    drives = np.array([[complex(*gain) for gain in one["drive"]] for one in message["fingers"]])
    places = np.array(PLACES) * 1e-3
    fingers = FingerSet.of(strip.solved, places, pressing_stiffness(1.0, 160.0))
    shares = fingers.shares(drives)
    for signal in range(2):
        for finger in range(2):
            wanted = 20.0 * np.log10(shares[signal, finger] / shares[signal, signal])
            assert message["matrix_db"][finger][signal] == pytest.approx(wanted, abs=1e-6)
    moved = shares * message["newtons_per_gain"] * 1e6
    limit = threshold_um(160.0)
    assert limit is not None
    for k, one in enumerate(message["fingers"]):
        assert one["finger_um"] == pytest.approx(moved[k, k])
        assert one["is_spared"] == (moved[1 - k, k] < limit)
    # All coils at once keep within what one coil may be given.
    alone = played_message(strip, 1, alone_down(strip))
    loudest = np.abs(drives).sum(axis=0).max() * message["newtons_per_gain"]
    alone_n = max(abs(complex(*gain)) for gain in alone["drive"]) * alone["newtons_per_gain"]
    assert loudest == pytest.approx(alone_n, rel=0.2)


def alone_down(ready: ReadyBoard) -> Played:
    played = EmulatedDevice(ready).apply([Touch(1, 0, PLACES[0])])
    assert played is not None
    return played


def both_down(strip: ReadyBoard, *voices: Voice) -> Any:
    device = EmulatedFingers(strip)
    played = device.apply([Touch(k, k, place) for k, place in enumerate(PLACES)] + list(voices))
    assert played is not None
    return played


def test_one_finger_is_answered_as_by_a_table_of_drives(
    strip: ReadyBoard, strip_studio: Studio
) -> None:
    """Before another one comes, and after it has left."""
    drives_alone = replace(strip, table=replace(strip.table, responses=()))
    wanted = played_message(drives_alone, 1, alone_down(drives_alone))
    with opened(strip_studio) as own:
        first = press(own, 1, 0, PLACES[0])
        press(own, 2, 1, PLACES[1])
        ask(own, 3, "lift", 1)
        again = told_of(own, "played")
        ask(own, 4, "lift", 0)
        told_of(own, "lifted")
        last = press(own, 5, 3, PLACES[0])
    for number, found in ((1, first), (3, again), (5, last)):
        assert found.keys() == wanted.keys()
        assert found == wanted | {"number": number, "drive": found["drive"]}
        drives = [np.array([complex(*gain) for gain in one["drive"]]) for one in (found, wanted)]
        # Rounding of duties is noise of its own in each.
        assert np.abs(drives[0] - drives[1]).max() < 2e-3 * np.abs(drives[1]).max()


def tones_of(recording: Recording, asked: Sequence[float]) -> list[float]:
    """Amplitude of the loudest pin's duty at each tone."""
    play = Play(0, len(recording.duty_steps))
    return [float(np.abs(phasors(recording, play, own)).max()) for own in asked]


def test_tones_and_levels_reach_the_pins(
    strip: ReadyBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seen on the emulated pins themselves: a tone that no one has asked for is not there."""
    recordings: list[Recording] = []

    class Watched(Emulator):
        def run(self, milliseconds: float) -> Recording:
            recordings.append(super().run(milliseconds))
            return recordings[-1]

    monkeypatch.setattr(played_fingers, "Emulator", Watched)
    both_down(strip, Voice(2, 0, 60.0, 1.0), Voice(3, 1, 220.0, 0.25))
    low, table, high = tones_of(recordings[-1], (60.0, 160.0, 220.0))
    assert low > 0.1
    assert 0.1 * low < high < 0.6 * low  # of drives whose loudest coils are alike
    assert table < 0.01 * low


def test_a_level_is_a_share_of_the_fingers_own(strip_studio: Studio) -> None:
    with opened(strip_studio) as own:
        press(own, 1, 0, PLACES[0])
        full = press(own, 2, 1, PLACES[1])["fingers"]
        half = voice(own, 3, 1, None, 0.5)["fingers"]
        silent = voice(own, 4, 0, None, 0.0)
        ask(own, 5, "voice", 1, tone_hz=None, level=0.0)
        none = told_of(own, "played")
    assert half[1]["finger_um"] == pytest.approx(0.5 * full[1]["finger_um"], rel=0.02)
    assert half[0]["finger_um"] == pytest.approx(full[0]["finger_um"], rel=0.02)
    # The silent one feels the other still, and the other has nothing to be spared.
    assert silent["fingers"][0]["finger_um"] == 0.0
    assert silent["matrix_db"][0][1] < -20.0
    assert [row[0] for row in silent["matrix_db"]] == [None, None]
    assert silent["fingers"][1]["is_spared"] is True
    assert silent["place_mm"] == list(PLACES[1])  # the first one that sounds
    assert none["newtons_per_gain"] is None


def test_a_signal_is_judged_at_its_own_tone(strip: ReadyBoard) -> None:
    """Where no threshold is known none is claimed, and the plate is solved at that tone."""
    played = both_down(strip, Voice(2, 1, 30.0, 1.0))
    low = played_message(strip, 1, played)
    assert low["fingers"][0]["is_spared"] is None
    assert low["fingers"][1]["is_spared"] is not None
    assert low["fingers"][1]["tone_hz"] == 30.0
    at_tone = strip.solved.at_frequency(30.0)
    fingers = FingerSet.of(at_tone, np.array(PLACES) * 1e-3, pressing_stiffness(1.0, 30.0))
    shares = fingers.shares(played.fingers.drives)[1]
    wanted = 20.0 * np.log10(shares[0] / shares[1])
    assert low["matrix_db"][0][1] == pytest.approx(wanted, abs=1e-6)


def test_equal_tones_are_told_apart(strip: ReadyBoard) -> None:
    """Drives are the same whatever tones they play."""
    near, far = (
        both_down(strip, Voice(2, 0, 150.0, 1.0), Voice(3, 1, other, 1.0)).fingers.drives
        for other in (150.0, 190.0)
    )
    assert np.abs(near - far).max() < 0.01 * np.abs(far).max()


def test_a_finger_alone_plays_the_tone_that_was_set(strip_studio: Studio) -> None:
    with opened(strip_studio) as own:
        press(own, 1, 2, PLACES[1])
        message = voice(own, 2, 2, 90.0, 0.5)
    assert [(one["finger"], one["tone_hz"]) for one in message["fingers"]] == [(2, 90.0)]
    assert message["matrix_db"] == [[0.0]]
    assert message["fingers"][0]["is_spared"] is True


def test_fingers_that_cannot_be_are_refused_and_the_others_stay(strip_studio: Studio) -> None:
    with opened(strip_studio) as own:
        press(own, 1, 0, PLACES[0])
        press(own, 2, 1, PLACES[1])
        for number, finger, place, named in (
            (3, 2, (0.0, 90.0), "touch"),
            (4, 5, (0.0, 0.0), "finger"),
            (5, 7, (0.0, 0.0), "finger"),
        ):
            ask(own, number, "press", finger, x_mm=place[0], y_mm=place[1])
            assert told_of(own, "refused")["field"] == named
        assert [one["finger"] for one in press(own, 6, 1, (1.0, -13.0))["fingers"]] == [0, 1]


def test_a_panel_of_two_fingers_refuses_a_third_in_words(strip: ReadyBoard) -> None:
    panel = Panel((140, 600), strip.board.plate.size, "ft6x36", interrupt_pin=27)
    board = replace(strip.board, panel=panel)
    two = replace(strip, choice=replace(strip.choice, board=board))
    assert board_message(two, "")["most_fingers"] == 2
    device = EmulatedFingers(two)
    places = [*PLACES, (0.0, 10.0)]
    with pytest.raises(ChladniError, match="lost a finger"):
        device.apply([Touch(k, k, place) for k, place in enumerate(places)])
    played = device.apply([Touch(k, k, place) for k, place in enumerate(PLACES)])
    assert played is not None
    assert played.fingers is not None
    assert played.fingers.numbers == (0, 1)


def test_one_finger_of_a_board_for_several_plays_the_loudest_drive(strip: ReadyBoard) -> None:
    """On the pins and in the page of a file: the conjugate of what the coils do at its place."""
    coarse = replace(strip.board, image=Image((15, 61)))
    board = replace(coarse, focus=None, fingers=SeveralFingers(pitch=6e-3))
    ready = ReadyBoard.of(BoardChoice(board, page_objective(board)), jobs=1)
    assert ready.table.sections == ()
    place = PLACES[1]
    wanted = ready.solved.problem(place).at_target.conj()
    data = file_data(ready)
    axes = [np.array(data["places"][axis]) for axis in ("x_mm", "y_mm")]
    column, row = (int(np.abs(axes[k] - place[k]).argmin()) for k in range(2))
    integers = np.frombuffer(base64.b64decode(data["drives"]), "<i2").astype(float)
    pairs = integers.reshape(-1, len(wanted), 2)[row * len(axes[0]) + column]
    played = EmulatedDevice(ready).apply([Touch(1, 0, place)])
    assert played is not None
    for drive in (played.drive, pairs[:, 0] + 1j * pairs[:, 1]):
        alike = abs(np.vdot(drive, wanted)) / np.linalg.norm(drive) / np.linalg.norm(wanted)
        assert alike > 0.995  # of responses that were rounded; the focus drive has 0.9


def test_a_board_without_room_for_two_fingers_plays_the_first(strip: ReadyBoard) -> None:
    board = strip.board
    small = replace(
        board,
        name="small",
        plate=replace(board.plate, size=(14e-3, 16e-3)),
        actuators=tuple(one for one in board.actuators if one.at[1] == 0.0),
        electronics=replace(board.electronics, pwm_pins=(2,)),
        image=Image((15, 17)),
    )
    ready = ReadyBoard.of(BoardChoice(small, "ssim"), jobs=1)
    assert not ready.follows_several
    assert board_message(ready, "")["most_fingers"] == 1
    played = EmulatedFingers(ready).apply([Touch(1, 0, (0.0, 2.0)), Touch(2, 1, (0.0, -5.0))])
    assert played is not None
    assert (played.place_mm, played.fingers) == ((0.0, 2.0), None)
