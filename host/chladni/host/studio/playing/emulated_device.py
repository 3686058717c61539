"""A page's emulated device: fingers on its panel, and the drive that its pins then make."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from chladni.host.emulation.demodulate import Play, first_change, made_drive, phasors
from chladni.host.emulation.emulator import LEVEL, Emulator, Recording, TouchEvent
from chladni.host.emulation.settling import LEAST_WAVES, SETTLE_MS
from chladni.host.protocol.board_config import coil_gains
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.messages.requests import Place, Touch
from chladni.host.studio.playing.played import ComplexArray, Played, turned
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.errors import ChladniError

FIRST_TOUCH_MS = 20.0
"""After power-on: the firmware has found its panel by then."""
BESIDES_REPORT_MS = 2.0
"""From a panel's report to the new drive: a turn of the main loop and a sample."""
HEARD_MS = 1.0
"""From one event to the next."""


class EmulatedDevice:
    """Fingers on the emulated device of one page.

    The device's clock runs ahead of ours: a touch has settled and been measured after tens of its
    milliseconds, which take one of ours. So each contact, from the first finger down to the last
    one up, is on a device that was powered on for it: none is cut short by coils that a drag
    before has warmed. A contact that would outlast the board's `max_on_s` begins again.
    """

    def __init__(self, ready: ReadyBoard) -> None:
        self._ready = ready
        self._emulator: Emulator | None = None
        self._begun_ms = 0.0
        self._down: dict[int, Place] = {}
        waves_ms = LEAST_WAVES / ready.frequency_hz * 1e3
        limits = ready.table.limits
        report_ms = ready.board.panel.report_ms if ready.board.panel else 10
        self._settle_ms = report_ms + BESIDES_REPORT_MS + limits.ramp_us / 1e3 + SETTLE_MS
        self._step_ms = self._settle_ms + waves_ms
        self._longest_ms = limits.max_on_us / 1e3

    def apply(self, touches: Sequence[Touch]) -> Played | None:
        """Let touches happen one after the other; what then plays, None if no finger is left.

        Raises
        ------
        InputError
            The panel does not reach there. The fingers on it stay where they were.
        EmulatorError
            The firmware did something the hardware would not forgive.
        ChladniError
            The board's `max_on_s` is too short for anything to be measured.
        """
        latency = None
        for touch in touches:
            if touch.place_mm is None:
                self._lift(touch.finger)
            else:
                latency = self._put(touch.finger, touch.place_mm)
        return self._measure(latency) if self._down else None

    def _put(self, finger: int, place: Place) -> float | None:
        """Put a finger down or move it; the latency of a touch that begins."""
        if self._emulator is not None and self._elapsed_ms() + self._step_ms > self._longest_ms:
            self._emulator = None
        is_first = not self._down
        emulator = self._emulator or self._power_on()
        at = emulator.core.now_us / 1e3
        emulator.touch(TouchEvent(at, place, finger))
        self._emulator = emulator
        self._down[finger] = place
        if not is_first:
            emulator.run(HEARD_MS)
            return None
        return _latency_ms(emulator.run(self._settle_ms))

    def _power_on(self) -> Emulator:
        """A device at rest, on which all fingers that are down are put again."""
        if self._step_ms > self._longest_ms:
            raise ChladniError(
                f"a touch is measured over {self._step_ms:.0f} ms, and the board's max_on_s ends "
                f"it after {self._longest_ms:.0f} ms",
                hint="raise drive.max_on_s",
            )
        emulator = Emulator(self._ready.board, self._ready.table)
        emulator.run(FIRST_TOUCH_MS)
        self._begun_ms = emulator.core.now_us / 1e3
        for finger, place in self._down.items():
            emulator.touch(TouchEvent(emulator.core.now_us / 1e3, place, finger))
            emulator.run(self._settle_ms)
        return emulator

    def _lift(self, finger: int) -> None:
        if self._down.pop(finger, None) is None or self._emulator is None:
            return
        if not self._down:
            self._emulator = None
            return
        self._emulator.touch(TouchEvent(self._emulator.core.now_us / 1e3, None, finger))
        # If it was the one that played, the other one begins a touch of its own.
        self._emulator.run(self._settle_ms)

    def _elapsed_ms(self) -> float:
        assert self._emulator is not None
        return self._emulator.core.now_us / 1e3 - self._begun_ms

    def _measure(self, latency: float | None) -> Played:
        emulator = self._emulator
        assert emulator is not None
        emulator.run(self._settle_ms)
        recording = emulator.run(self._step_ms - self._settle_ms)
        play = Play(0, recording.duty_steps.shape[0])
        drive = self._drive(recording, play)
        # The firmware's rule: the first finger down plays until it lifts.
        place = next(iter(self._down.values()))
        return Played(place, turned(self._ready, drive, place), latency, emulator.core.state)

    def _drive(self, recording: Recording, play: Play) -> ComplexArray:
        """As the coils have it; without drives in the table in units of a duty of 1."""
        board, table = self._ready.board, self._ready.table
        if table.sections:
            return made_drive(recording, play, table.sections[0], board, level=LEVEL)
        found = phasors(recording, play, self._ready.frequency_hz, circuit_of(board))
        return np.asarray(found / np.array(coil_gains(board)))


def _latency_ms(recording: Recording) -> float | None:
    changed = first_change(recording, 0)
    return None if changed is None else changed / recording.carrier_hz * 1e3
