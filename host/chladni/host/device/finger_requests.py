"""What a host asks of a device's fingers: touch, lift, hear of them, and what they play.

More than one finger needs a table with responses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.effects.bank.areas import LEAST_UM, MOST_UM
from chladni.effects.bank.layout import UM_STEPS
from chladni.host.device.touch_keeper import TouchKeeper
from chladni.host.device.wires.link import Link, LinkError
from chladni.host.protocol.link import BY_NAME, ISOLATION_STEPS, MAX_PAYLOAD, Status
from chladni.sim.errors import ArgumentError

FloatArray = NDArray[np.float64]

MOST_FINGERS = 5
"""As of `drives.fingers.silence`, which takes as long to load as all of this."""


class FingerRequests:
    """One method for each request; `DeviceFingers` plays whole signals with them."""

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
                "isolation_db": 20.0 * math.log10(isolation / ISOLATION_STEPS)
                if isolation
                else None,
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
