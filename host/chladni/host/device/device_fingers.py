"""Fingers on a device that a host holds, hears and asks about.

A device ends a touch whose host says nothing for `TOUCH_SILENCE_MS`, as a killed one does: a thread
says something meanwhile. More than one finger needs a table with responses.
"""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.link import KEEP_ALIVE_S, Link, LinkError
from chladni.host.device.udp import UdpPort, UdpWire
from chladni.host.device.wire import SerialWire, Wire
from chladni.host.protocol.link import BY_NAME, MAX_PAYLOAD, SIGNAL_HZ, SIGNAL_SAMPLES
from chladni.sim.errors import ArgumentError, ChladniError

FloatArray = NDArray[np.float64]

MOST_FINGERS = 5
"""As of `drives.fingers.silence`, which takes as long to load as all of this."""

TURN_S = 0.01
"""Between two sendings of a signal: a fifth of what a device keeps."""
AFTER_S = 0.05
"""For which a finger stays behind its signal, so that the last of it rings on."""


@dataclass(frozen=True)
class PlayedSignal:
    """How a signal went.

    Attributes
    ----------
    place_mm
        Where it played: the nearest place on the board.
    samples
        That were sent.
    fewest_waiting
        The fewest that waited on the device before the last were sent; at 0 there was a gap.
    """

    place_mm: tuple[float, float]
    samples: int
    fewest_waiting: int


class TouchKeeper:
    """Keeps a link's touch alive from `begin` to `end`.

    Where time passes in the wire's own calls, as an emulated device's does, `Link.wait` does that.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._ended = threading.Event()
        self._ended.set()

    @property
    def is_holding(self) -> bool:
        """Whether a touch is held."""
        return self._link.holds_touch

    def begin(self) -> None:
        """Keep a touch alive, the same one if there is one."""
        self._link.holds_touch = True
        if self._ended.is_set() and _passes_by_itself(self._link.wire):
            self._ended = threading.Event()
            # It ends with the program, and the touch does soon after.
            threading.Thread(target=self._run, args=(self._ended,), daemon=True).start()

    @contextlib.contextmanager
    def beginning(self) -> Iterator[None]:
        """Keep a touch alive that is asked for within; not if it is refused, and none was held.

        Before it is asked for: what interrupts that finds a touch to be lifted.
        """
        was_holding = self.is_holding
        self.begin()
        try:
            yield
        except LinkError:
            if not was_holding:
                self.end()
            raise

    def end(self) -> None:
        """Let it go."""
        self._link.holds_touch = False
        self._ended.set()

    def _run(self, ended: threading.Event) -> None:
        try:
            while not ended.wait(KEEP_ALIVE_S / 2.0):
                self._link.keep_alive()
        except ChladniError:
            pass  # the wire is gone; whoever asks next hears of it


def _passes_by_itself(wire: Wire) -> bool:
    """Whether time passes on a wire while nothing is done with it."""
    if isinstance(wire, UdpWire):
        return isinstance(wire.port, UdpPort)
    return isinstance(wire, SerialWire)


class DeviceFingers:
    """Of a `Device`: its attribute `fingers`."""

    def __init__(self, link: Link, keeper: TouchKeeper) -> None:
        self._link, self._keeper = link, keeper

    def touch(self, finger: int, x_mm: float, y_mm: float) -> tuple[float, float]:
        """As `Device.touch`, for one of five fingers; without responses there is only the first.

        Raises
        ------
        ArgumentError
            There is no such finger.
        LinkError
            The device's table has no responses, or none of it is there.
        """
        _check(finger)
        with self._keeper.beginning():
            answer = self._link.request(
                "finger_touch", finger=finger, x_um=round(x_mm * 1e3), y_um=round(y_mm * 1e3)
            )
        return answer.fields["x_um"] / 1e3, answer.fields["y_um"] / 1e3

    def lift(self, finger: int) -> None:
        """Let go of one; `Device.lift` lets go of all."""
        _check(finger)
        self._link.request("finger_lift", finger=finger)

    def set_voice(self, finger: int, frequency_hz: float | None = None, level: float = 1.0) -> None:
        """What a finger plays from its next touch on.

        Parameters
        ----------
        finger
            0 to 4: real fingers get the lowest number that is free when they come down.
        frequency_hz
            The table's if left out.
        level
            Of the configured level, 0 to 1; at 0 a finger is spared the others' signals and has
            none of its own.
        """
        _check(finger)
        level_q15 = _level_q15(level)
        millihertz = 0 if frequency_hz is None else round(frequency_hz * 1e3)
        self._link.request("voice", finger=finger, millihertz=millihertz, level_q15=level_q15)

    def set_signal(self, finger: int, level: float = 1.0) -> None:
        """Let a finger play what `send` sends, from its next touch on, in place of a tone.

        Parameters
        ----------
        level
            Of the configured level, 0 to 1.
        """
        _check(finger)
        self._link.request("signal_voice", finger=finger, level_q15=_level_q15(level))

    def send(self, finger: int, samples: Sequence[float] | FloatArray) -> tuple[int, int]:
        """Send a finger's next samples, -1 to 1, `SIGNAL_HZ` of which are played in a second.

        Returns
        -------
        How many there was room for, and how many wait now.
        """
        _check(finger)
        own = np.asarray(samples, dtype=np.float64)
        if not np.all(np.abs(own) <= 1.0):
            raise ArgumentError("samples", "some beyond 1", "-1 to 1")
        whole = np.round(own[: MAX_PAYLOAD // 2] * 32767.0).astype("<i2")
        answer = self._link.request("signal_data", whole.tobytes(), finger=finger).fields
        return answer["taken"], answer["filled"]

    def play(
        self,
        samples: FloatArray,
        at_mm: tuple[float, float],
        *,
        finger: int = 0,
        level: float = 1.0,
    ) -> PlayedSignal:
        """Put a finger down, play a signal under it, and lift it once that is over.

        Parameters
        ----------
        samples
            -1 to 1, `SIGNAL_HZ` of them a second.
        at_mm
            Where, mm from the board's centre.
        finger
            0 to 4. Others that are held stay, and are left still where the table has responses.
        level
            Of the configured level, 0 to 1.

        Raises
        ------
        LinkError
            The device has no table, or ended the touch.
        """
        self.set_signal(finger, level)
        sent, filled = self.send(finger, samples[:SIGNAL_SAMPLES])
        place = self.touch(finger, *at_mm)
        now_s, fewest = self._link.wire.now_s, SIGNAL_SAMPLES
        while sent < len(samples):
            begun = now_s()
            self._link.wait(TURN_S)
            # A wire is slow: no more than there may be room for.
            room = SIGNAL_SAMPLES - filled + int((now_s() - begun) * SIGNAL_HZ)
            taken, filled = self.send(finger, samples[sent : sent + room])
            fewest = min(fewest, filled - taken)
            sent += taken
        _, left = self.send(finger, [])
        self._link.wait(left / SIGNAL_HZ + AFTER_S)
        if not any(one["finger"] == finger for one in self.all()):
            raise LinkError(
                "the device ended the touch",
                hint="`chladni device info` shows its state and faults",
            )
        self.lift(finger)
        return PlayedSignal(place, sent, fewest)

    def all(self) -> list[dict[str, Any]]:
        """Those that are down, with places and what their drives come to.

        `isolation_db` is the own signal over the most that another finger has of it, as the device
        reckons; None alone, silent, or with a table's own drive. `level_db` is against the loudest.
        """
        tail = self._link.request("touches").tail
        return [
            {
                "finger": finger,
                "place_mm": [x_um / 1e3, y_um / 1e3],
                "isolation_db": 20.0 * math.log10(isolation) if isolation else None,
                "level_db": 20.0 * math.log10(of_loudest / 1e3) if of_loudest else None,
            }
            for finger, x_um, y_um, isolation, of_loudest in BY_NAME["touches"].entry.iter_unpack(
                tail
            )
        ]


def _check(finger: int) -> None:
    if not 0 <= finger < MOST_FINGERS:
        raise ArgumentError("finger", finger, f"0 to {MOST_FINGERS - 1}")


def _level_q15(level: float) -> int:
    if not 0.0 <= level <= 1.0:
        raise ArgumentError("level", level, "0 to 1")
    return round(level * 32767.0)
