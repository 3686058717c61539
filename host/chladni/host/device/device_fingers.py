"""Fingers on a device that a host holds, hears and asks about.

More than one finger needs a table with responses.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chladni.effects.bank.areas import LEAST_UM, MOST_UM, level_within
from chladni.effects.bank.layout import SIGNAL_HZ, UM_STEPS
from chladni.host.device.link import Link, LinkError
from chladni.host.device.stream_sources import PlayedSignal, SignalSource
from chladni.host.device.touch_keeper import TouchKeeper
from chladni.host.protocol.link import BY_NAME, MAX_PAYLOAD, SIGNAL_SAMPLES, Status
from chladni.sim.errors import ArgumentError, ChladniError

if TYPE_CHECKING:
    from chladni.effects.effect import Effect

FloatArray = NDArray[np.float64]

MOST_FINGERS = 5
"""As of `drives.fingers.silence`, which takes as long to load as all of this."""

TURN_S = 0.005
"""Between two sendings of a signal, which take 8 ms at 115,200 baud."""
LIVE_SAMPLES = 80
"""That a device is to keep of a live signal: 33 ms, twice what a turn takes at 115,200 baud."""
AFTER_S = 0.05
"""For which a finger stays behind its signal, so that the last of it rings on."""


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
        check_finger(finger)
        with self._keeper.beginning():
            try:
                answer = self._link.request(
                    "finger_touch", finger=finger, x_um=round(x_mm * 1e3), y_um=round(y_mm * 1e3)
                )
            except LinkError as error:
                if finger == 0 or error.status is not Status.NOT_NOW:
                    raise
                hint = "several need responses: `chladni table build BOARD --for both`"
                raise LinkError("finger_touch: it follows one", error.status, hint=hint) from error
        return answer.fields["x_um"] / 1e3, answer.fields["y_um"] / 1e3

    def lift(self, finger: int) -> None:
        """Let go of one; `Device.lift` lets go of all."""
        check_finger(finger)
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
        check_finger(finger)
        level_q15 = level_q15_of(level)
        millihertz = 0 if frequency_hz is None else round(frequency_hz * 1e3)
        self._link.request("voice", finger=finger, millihertz=millihertz, level_q15=level_q15)

    def set_signal(self, finger: int, level: float = 1.0) -> None:
        """Let a finger play what `send` sends, from its next touch on, in place of a tone.

        Parameters
        ----------
        level
            Of the configured level, 0 to 1.
        """
        check_finger(finger)
        self._link.request("signal_voice", finger=finger, level_q15=level_q15_of(level))

    def limit_signal(self, finger: int, most_um: float) -> None:
        """Let it move its finger no further, from the next touch on; after `set_signal`.

        Raises
        ------
        LinkError
            The device does not know how far it moves one.
        """
        if not LEAST_UM <= most_um <= MOST_UM:
            raise ArgumentError("level_um", most_um, f"{LEAST_UM:g} to {MOST_UM:g}")
        try:
            self._link.request("signal_limit", finger=finger, most_10nm=round(UM_STEPS * most_um))
        except LinkError as error:
            if error.status not in (Status.NOT_NOW, Status.UNKNOWN):
                raise
            hint = "it needs responses in its table and a coil's force in its configuration"
            raise LinkError("the device knows no micrometres", error.status, hint=hint) from error

    def send(self, finger: int, samples: Sequence[float] | FloatArray) -> tuple[int, int]:
        """Send a finger's next samples, -1 to 1, `SIGNAL_HZ` of which are played in a second.

        Returns
        -------
        How many there was room for, and how many wait now.
        """
        check_finger(finger)
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
        most_um: float | None = None,
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
        most_um
            An amplitude of 1 moves the finger no further, where the device knows how far it does.

        Raises
        ------
        LinkError
            The device has no table, knows no micrometres, or ended the touch.
        """
        return self.stream(
            [samples], at_mm, finger=finger, level=level, most_um=most_um, ahead=SIGNAL_SAMPLES
        )

    def stream(
        self,
        blocks: Iterable[FloatArray],
        at_mm: tuple[float, float],
        *,
        finger: int = 0,
        level: float = 1.0,
        most_um: float | None = None,
        ahead: int = LIVE_SAMPLES,
    ) -> PlayedSignal:
        """The same for a signal that comes block by block, for as long as it does.

        Parameters
        ----------
        blocks
            Samples as of `play`; whoever makes them may take their time.
        ahead
            Samples that the device is to keep: what comes late by less is not heard, and all is
            heard that much later.
        """
        self.set_signal(finger, level)
        try:
            if most_um is not None:
                self.limit_signal(finger, most_um)
            played = self._streamed(SignalSource(blocks), at_mm, finger, ahead)
        except BaseException:
            # Whatever came in between, also from who makes the blocks.
            with contextlib.suppress(ChladniError):
                self.lift(finger)
            raise
        finally:
            # Its next touch is the device's own again.
            with contextlib.suppress(ChladniError):
                self.set_voice(finger)
        return played

    def _streamed(
        self, source: SignalSource, at_mm: tuple[float, float], finger: int, ahead: int
    ) -> PlayedSignal:
        sent, filled = self.send(finger, source.next(ahead))
        source.drop(sent)
        place = self.touch(finger, *at_mm)
        now_s, fewest = self._link.wire.now_s, ahead
        begun = now_s()
        while not source.is_over:
            self._link.wait(TURN_S)
            # A wire is slow: no more than there may be room for.
            left = max(0, filled - int((now_s() - begun) * SIGNAL_HZ))
            begun = now_s()
            taken, filled = self.send(finger, source.next(max(ahead - left, 0)))
            fewest = min(fewest, filled - taken)
            sent += taken
            source.drop(taken)
        _, left = self.send(finger, [])
        self._link.wait(left / SIGNAL_HZ + AFTER_S)
        mine = [one for one in self.all() if one["finger"] == finger]
        if not mine:
            raise LinkError(
                "the device ended the touch",
                hint="`chladni device info` shows its state and faults",
            )
        self.lift(finger)
        return PlayedSignal(
            place, sent, min(fewest, sent), mine[0]["isolation_db"], mine[0]["level_db"]
        )

    def play_effect(
        self,
        effect: Effect | str | Path,
        at_mm: tuple[float, float],
        *,
        level_db: float = 0.0,
        level_um: float | None = None,
        finger: int = 0,
    ) -> PlayedSignal:
        """The same for an effect.

        Parameters
        ----------
        effect
            An effect, the name of a shipped one, or its file.
        level_db
            Against the loudest for that place, 0 or less.
        level_um
            As much, wherever the place allows it and the device knows it.

        Raises
        ------
        InputError
            There is no such effect, or a level cannot be.
        LinkError
            As of `play`.
        """
        # They load SciPy, which takes longer than a device takes to answer.
        from chladni.effects.effect import Effect  # noqa: PLC0415
        from chladni.effects.files import read_effect  # noqa: PLC0415

        own = effect if isinstance(effect, Effect) else read_effect(effect).effect
        level = level_within(level_db)
        samples = own.samples(SIGNAL_HZ)
        return self.play(samples, at_mm, finger=finger, level=level, most_um=level_um)

    def stream_signal(
        self,
        signal: FloatArray | Iterable[FloatArray],
        at_mm: tuple[float, float],
        *,
        rate_hz: float,
        level_db: float = 0.0,
        level_um: float | None = None,
        finger: int = 0,
    ) -> PlayedSignal:
        """The same for a live signal, which is low-passed at 250 Hz on its way.

        Between a sample and the duties that it makes lie the 33 ms that the device keeps, 2 ms of
        the low-pass, and what the wire takes.

        Parameters
        ----------
        signal
            -1 to 1: one row of samples, or rows that come one after the other.
        rate_hz
            Samples of it in a second: 2 to 8 kHz are usual.

        Raises
        ------
        InputError
            A rate that cannot be, or no rows of numbers.
        LinkError
            As of `play`.
        """
        from chladni.effects.live import signal_samples  # noqa: PLC0415

        rows = [signal] if isinstance(signal, np.ndarray) else signal
        samples, level = signal_samples(rows, rate_hz, SIGNAL_HZ), level_within(level_db)
        return self.stream(samples, at_mm, finger=finger, level=level, most_um=level_um)

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


def check_finger(finger: int) -> None:
    """Raise `ArgumentError` for a finger that there is not."""
    if not 0 <= finger < MOST_FINGERS:
        raise ArgumentError("finger", finger, f"0 to {MOST_FINGERS - 1}")


def level_q15_of(level: float) -> int:
    """A level from 0 to 1 as a device has it."""
    if not 0.0 <= level <= 1.0:
        raise ArgumentError("level", level, "0 to 1")
    return round(level * 32767.0)
