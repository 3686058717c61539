"""A page's fingers on its emulated device: one alone, or several, each with a signal of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from chladni.host.emulation.played_fingers import (
    TOLD_APART_HZ,
    FingerVoice,
    played_voices,
    tones_near,
)
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.messages.requests import Place, Touch, Voice
from chladni.host.studio.playing.emulated_device import EmulatedDevice
from chladni.host.studio.playing.finger_shares import PlayedFingers, Tones
from chladni.host.studio.playing.played import Played, turned


class EmulatedFingers:
    """Fingers on the emulated device of one page.

    A finger alone plays the table's drive (emulated_device.py). For several, or one whose tone or
    level was set, a device is powered on each time with all of them on its panel. So a tone that
    was set is played at once, as if its finger had been lifted and put down again. Tones that are
    nearer to each other than the pins tell apart are moved away from each other.

    Without responses in the table the first finger plays, whatever others do.
    """

    def __init__(self, ready: ReadyBoard) -> None:
        self._ready = ready
        self._alone = EmulatedDevice(ready)
        self._down: dict[int, Place] = {}
        self._voices: dict[int, Voice] = {}
        self._tones = Tones(ready.solved)

    def apply(self, requests: Sequence[Touch | Voice]) -> Played | None:
        """Let fingers go down, move and lift, and set what they play; what then plays.

        None if no finger is left.

        Raises
        ------
        InputError
            The panel does not reach there. All fingers stay where they were.
        EmulatorError
            The firmware did something the hardware would not forgive.
        ChladniError
            The panel hears fewer fingers than there are, or the board's `max_on_s` is too short for
            anything to be measured.
        """
        if not self._ready.follows_several:
            return self._alone.apply([one for one in requests if isinstance(one, Touch)])
        down, voices = dict(self._down), dict(self._voices)
        for one in requests:
            if isinstance(one, Voice):
                voices[one.finger] = one
            elif one.place_mm is None:
                down.pop(one.finger, None)
            else:
                down[one.finger] = one.place_mm
        if len(down) > 1 or any(finger in voices for finger in down):
            played: Played | None = self._several(down, voices)
            self._alone = EmulatedDevice(self._ready)
        else:
            played = self._one(down, [one for one in requests if isinstance(one, Touch)])
        self._down, self._voices = down, voices
        return played

    def _one(self, down: dict[int, Place], touches: Sequence[Touch]) -> Played | None:
        """Go on with the finger that plays alone, or begin with the one that is left."""
        own = set(self._down) | set(down)
        if len(own) < 2 and {touch.finger for touch in touches} <= own:
            return self._alone.apply(touches)
        alone = EmulatedDevice(self._ready)
        played = alone.apply([Touch(0, finger, place) for finger, place in down.items()])
        self._alone = alone
        return played

    def _several(self, down: dict[int, Place], voices: dict[int, Voice]) -> Played:
        table, board = self._ready.table, self._ready.board
        frequency_hz = table.responses[0].frequency_hz
        numbers = sorted(down)
        wanted = []
        for number in numbers:
            own = voices.get(number, Voice(0, number, None, 1.0))
            wanted.append(FingerVoice(down[number], own.tone_hz or frequency_hz, own.level))
        found = played_voices(table, board, _told_apart(wanted, frequency_hz))
        drives = np.stack(
            [
                turned(self._ready, drive, voice.place_mm)
                for drive, voice in zip(found.drives, wanted, strict=True)
            ]
        )
        # What the window leaks of the others is no signal.
        drives[[voice.level == 0.0 for voice in wanted]] = 0.0
        fingers = PlayedFingers.of(self._tones, numbers, wanted, drives, found.of_loudest)
        # What one finger's numbers are of: the first that came down and sounds.
        sounding = [number for number in down if wanted[numbers.index(number)].level > 0.0]
        first = numbers.index((sounding or list(down))[0])
        return Played(wanted[first].place_mm, drives[first], None, found.state, fingers)


def _told_apart(voices: Sequence[FingerVoice], middle_hz: float) -> list[FingerVoice]:
    """Voices whose drives the pins tell apart; drives do not depend on the tones they play."""
    tones = [voice.frequency_hz for voice in voices]
    if all(abs(one - other) >= TOLD_APART_HZ for one, other in combinations(tones, 2)):
        return list(voices)
    return [
        replace(voice, frequency_hz=own)
        for voice, own in zip(voices, tones_near(middle_hz, len(voices)), strict=True)
    ]
