"""The fingers on a device whose table has responses: held by a host, heard, and asked about."""

from __future__ import annotations

import math
from typing import Any

from chladni.host.device.link import Link, LinkError
from chladni.host.device.touch_keeper import TouchKeeper
from chladni.host.protocol.link import BY_NAME
from chladni.sim.errors import ArgumentError

MOST_FINGERS = 5


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
        self._keeper.begin()
        try:
            answer = self._link.request(
                "finger_touch", finger=finger, x_um=round(x_mm * 1e3), y_um=round(y_mm * 1e3)
            )
        except LinkError:
            self._keeper.end()
            raise
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
        if not 0.0 <= level <= 1.0:
            raise ArgumentError("level", level, "0 to 1")
        millihertz = 0 if frequency_hz is None else round(frequency_hz * 1e3)
        self._link.request(
            "voice", finger=finger, millihertz=millihertz, level_q15=round(level * 32767.0)
        )

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
