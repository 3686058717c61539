"""The effect bank of a device: what it has, what fingers did on its areas, and a new one for it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from chladni.effects.bank.areas import Bank, level_within
from chladni.host.device.finger_requests import check_finger, level_q15_of
from chladni.host.device.touch_keeper import TouchKeeper
from chladni.host.device.upload import BANKS, Flashed, Progress, upload
from chladni.host.device.wires.link import Link
from chladni.host.protocol.codes import AREA_EVENT, BANK_STATUS
from chladni.host.protocol.link import BY_NAME, MOST_EVENTS
from chladni.sim.errors import ArgumentError

TURN_S = 0.02
"""Between two questions for events."""
NO_AREA = 255
Point = tuple[float, float]


@dataclass(frozen=True)
class DeviceArea:
    """An area of a device's bank, and the box about its shape, mm; all 0 of one without shape."""

    name: str
    least_mm: Point
    most_mm: Point

    def along(self, place_mm: Point) -> Point | None:
        """How far along the box a place is, 0 to 1 in x and y; None without a shape."""
        if self.least_mm == self.most_mm:
            return None
        x, y = (
            min(max((at - low) / (high - low), 0.0), 1.0) if high > low else 0.0
            for at, low, high in zip(place_mm, self.least_mm, self.most_mm, strict=True)
        )
        return x, y


@dataclass(frozen=True)
class AreaEvent:
    """What a finger did.

    Attributes
    ----------
    what
        pressed, entered, stepped or released.
    finger
        0 to 4.
    area
        Its name; None outside of all.
    place_mm
        Where, from the board's centre.
    along
        How far along its area, 0 to 1 in x and y; None without a shape.
    at_s
        Since the device's start.
    """

    what: str
    finger: int
    area: str | None
    place_mm: Point
    along: Point | None
    at_s: float


class DeviceEffects:
    """Of a `Device`: its attribute `effects`."""

    def __init__(self, link: Link, keeper: TouchKeeper) -> None:
        self._link, self._keeper = link, keeper
        self._next = 0
        self._areas: dict[int, DeviceArea] = {}
        self._effects: list[str] = []
        self._crc: int | None = None

    def flash(self, bank: Bank | bytes, progress: Progress | None = None) -> Flashed:
        """Replace the bank; the old one stays until the new one is whole.

        Raises
        ------
        InputError
            The bytes are no bank.
        LinkError
            The device refused or fell silent; the old bank stays.
        """
        # They load SciPy, which takes longer than a device takes to answer.
        from chladni.effects.bank.pack import pack_bank  # noqa: PLC0415
        from chladni.effects.bank.unpack import unpack_bank  # noqa: PLC0415

        data = pack_bank(bank) if isinstance(bank, Bank) else bank
        unpack_bank(data)
        self._keeper.end()  # its answers would come in between

        def in_use() -> tuple[int, int]:
            found = self._link.request("bank").fields
            return found["crc"], found["bytes"]

        return upload(self._link, BANKS, data, in_use, progress)

    def summary(self) -> dict[str, Any]:
        """Its name, how many effects and areas it has, and what became of it."""
        found = self._link.request("bank").fields
        return {
            "status": BANK_STATUS.text(found["bank_status"]),
            "name": _text(found["name"]),
            "effects": found["effects"],
            "areas": found["areas"],
        }

    def has_bank(self) -> bool:
        """Whether one is in force, which then makes the fingers' signals."""
        return bool(self._link.request("bank").fields["bank_status"] == 0)

    def info(self) -> dict[str, Any]:
        """Its name, effects and areas, and what became of it."""
        found = self._link.request("bank").fields
        self._forget_names_unless(found["crc"])
        return found | {
            "bank_status": BANK_STATUS.text(found["bank_status"]),
            "name": _text(found["name"]),
            "effects": self._effect_names(found["effects"]),
            "areas": [self._area(k).name for k in range(found["areas"])],
            "crc": f"{found['crc']:#010x}",
        }

    def play(self, effect: str, finger: int = 0, level_db: float = 0.0) -> None:
        """Play an effect of the bank once, under a finger that is down.

        Raises
        ------
        ArgumentError
            The bank has no effect of that name.
        LinkError
            No finger is down there, or a host gave it something else to play.
        """
        check_finger(finger)
        level = level_within(level_db)
        found = self._link.request("bank").fields
        self._forget_names_unless(found["crc"])
        names = self._effect_names(found["effects"])
        if effect not in names:
            expected = f"one of {', '.join(names) or 'none: the device has no bank'}"
            raise ArgumentError("effect", effect, expected)
        self._link.request(
            "effect",
            finger=finger,
            effect=names.index(effect),
            level_q15=level_q15_of(level),
        )

    def area_of(self, finger: int) -> DeviceArea | None:
        """The area that a finger is in."""
        check_finger(finger)
        number = self._link.request("finger_area", finger=finger).fields["area"]
        self._forget_names_unless(self._link.request("bank").fields["crc"])
        return None if number == NO_AREA else self._area(number)

    def events(self) -> list[AreaEvent]:
        """What fingers did since the last call, at first all that the device keeps: the last 32."""
        found: list[AreaEvent] = []
        while True:
            answer = self._link.request("area_events", after=self._next)
            self._next = answer.fields["next"]
            rows = [*BY_NAME["area_events"].entry.iter_unpack(answer.tail)]
            if rows:
                self._forget_names_unless(self._link.request("bank").fields["crc"])
            found += [self._event(*row) for row in rows]
            if len(rows) < MOST_EVENTS:
                return found

    def watch(self, seconds: float | None = None) -> Iterator[AreaEvent]:
        """Events as they come, for so long or until the program goes on to something else.

        What was before is not told: `events` has that.
        """
        self.events()
        begun = self._link.wire.now_s()
        while seconds is None or self._link.wire.now_s() - begun < seconds:
            yield from self.events()
            self._link.wait(TURN_S)

    def on_event(self, call: Callable[[AreaEvent], object], seconds: float | None = None) -> None:
        """Call a function with each event, for so long."""
        for event in self.watch(seconds):
            call(event)

    def _event(self, at_ms: int, what: int, finger: int, area: int, x: int, y: int) -> AreaEvent:
        place = (x / 1e3, y / 1e3)
        own = None if area == NO_AREA else self._area(area)
        return AreaEvent(
            AREA_EVENT.text(what),
            finger,
            None if own is None else own.name,
            place,
            None if own is None else own.along(place),
            at_ms / 1e3,
        )

    def _forget_names_unless(self, crc: int) -> None:
        """Forget names of another bank."""
        if crc != self._crc:
            self._crc, self._areas, self._effects = crc, {}, []

    def _area(self, number: int) -> DeviceArea:
        if number not in self._areas:
            own = self._link.request("bank_area", area=number).fields
            self._areas[number] = DeviceArea(
                _text(own["name"]),
                (own["left_um"] / 1e3, own["bottom_um"] / 1e3),
                (own["right_um"] / 1e3, own["top_um"] / 1e3),
            )
        return self._areas[number]

    def _effect_names(self, count: int) -> list[str]:
        if not self._effects:
            self._effects = [
                _text(self._link.request("bank_effect", effect=k).fields["name"])
                for k in range(count)
            ]
        return self._effects


def _text(name: bytes) -> str:
    return name.rstrip(b"\0").decode("ascii", "replace")
