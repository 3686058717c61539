"""A device's coils measure each other: what is asked for, and what comes back."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from chladni.calibration.device_readings import (
    REFERENCE,
    Heard,
    flux_multiple,
    readings_of,
    without_reference,
)
from chladni.calibration.sensing import (
    FEW_COILS,
    LEVEL,
    MOST_SECONDS,
    MULTIPLES,
    CoilReadings,
)
from chladni.calibration.wiring import unlike
from chladni.host.device.device import Device
from chladni.host.device.wires.link import Answer
from chladni.host.measuring.begun import Begun
from chladni.host.protocol.codes import SENSE_STATE
from chladni.host.protocol.link import BY_NAME, MOST_READ, SENSE_PAIRS
from chladni.sim.board.board import Board
from chladni.sim.errors import ChladniError, InputError

Report = Callable[[int, int], None]

SENSE_MINOR = 8
"""Of the link: older devices know no such requests."""
READING_S = 2 * SENSE_PAIRS * 1024 / 80e6
SETTLE_S, OVERHEAD_S = 0.003, 0.045
"""From coil to coil, and from one that plays to the next, its ring-up included."""
TOO_LOUD_S = 1.6
"""For finding how loud coils may play."""
RING_UP_MS, FLUX_RING_UP_MS = 25, 5
FLUX_READINGS = 1
DISTURBED = 0.1
"""Share of a pair's two readings by which they may differ before they are read once more."""
CLEAR_REFERENCE = 20.0
"""Deviations that a reference is above 0 at least: all else is told in its volts."""
ASK_AGAIN_S = 0.005
HALVINGS, SESSIONS = 6, 3
COSINE = 32767.0 / 1024.0
"""What a cosine of 1 is in the device's sums."""


class ReadingError(ChladniError):
    """Coils were not read to the end."""


def read_coils(
    device: Device,
    board: Board,
    progress: Report | None = None,
    begun: Begun | None = None,
    keep: Callable[[Begun], None] | None = None,
) -> CoilReadings:
    """Have a device read its coils, one playing after another.

    Parameters
    ----------
    begun
        What was read already: those coils are not read again, but for the first one, whose
        reference each session needs.
    keep
        Called after each coil with all that was read.

    Raises
    ------
    ReadingError
        A finger came down, or a part does not answer.
    InputError
        The device is of another board, or has no sensing pin.
    """
    check_device(device, board, SENSE_MINOR)
    reader = _read_all(device, board, begun or Begun(), progress, keep)
    readings = readings_of(board, reader.heard, reader.seconds)
    disturbed = _disturbed(readings)
    for coil, multiple in disturbed:
        reader.read(coil, multiple)
    reader.read_lacking_references()
    return readings_of(board, reader.heard, reader.seconds) if disturbed else readings


def _disturbed(readings: CoilReadings) -> list[tuple[int, int]]:
    """What to read again: coils that play, with the frequency, where a pair reads unlike.

    A blow on the desk rings for a moment. What is odd at all frequencies is no blow.
    """
    odd = unlike(readings, DISTURBED)
    odd &= ~odd.all(axis=0)
    return [(coil, MULTIPLES[k]) for k, coil in np.argwhere(odd.any(axis=1)).tolist()]


def _read_all(
    device: Device,
    board: Board,
    begun: Begun,
    progress: Report | None,
    keep: Callable[[Begun], None] | None,
) -> _Reader:
    count, high = len(board.actuators), flux_multiple(board)
    reader = _Reader(device, readings_each(count), high, begun)
    for coil in range(count):
        for multiple in (*MULTIPLES, high):
            if not reader.has(coil, multiple):
                reader.read(coil, multiple)
        if keep:
            keep(reader.begun)
        if progress:
            progress(coil + 1, count)
    reader.read_again_at_one_level(high)
    reader.read_lacking_references()
    reader.read_unclear_references_again()
    return reader


def readings_each(count: int) -> int:
    """Of 12.5 ms, of each pair of coils, within the time that a board may take."""
    requests = count * (len(MULTIPLES) + 1)
    most = MOST_SECONDS[count > FEW_COILS] - requests * OVERHEAD_S - TOO_LOUD_S
    pairs = count * (count - 1) + 1  # the reference with them
    flux_s = pairs * (SETTLE_S + FLUX_READINGS * READING_S)
    each = (most - flux_s) / (len(MULTIPLES) * pairs) - SETTLE_S
    return min(max(int(each / READING_S), 2), MOST_READ)


def check_device(device: Device, board: Board, least: int) -> None:
    """Refuse a device whose link is older than 2.`least`, or that is another board's.

    Raises
    ------
    InputError
        It is.
    """
    minor = device.version.fields["minor"]
    if minor < least:
        raise InputError("device", f"link 2.{minor}", f"2.{least} at least: update firmware")
    config = device.config()
    if config["channels"] != len(board.actuators):
        expected = f"{len(board.actuators)}, as {board.name} has"
        raise InputError("device", f"{config['channels']} coils", expected)
    own = config.board
    if own is not None and own[0] != board.fingerprint():
        hint = "chladni device config set --from BOARD"
        raise InputError("device", f"configured for {own[1]}", board.name, hint=hint)


class _Reader:
    """Has coils read, each as loud as the converter takes."""

    def __init__(self, device: Device, readings: int, high: int, begun: Begun) -> None:
        self.device, self.readings, self.high = device, readings, high
        self.heard: list[Heard] = list(begun.heard)
        self.seconds = begun.seconds
        self._read_at = dict(begun.levels)
        self._levels = {
            own: min([LEVEL, *(level for (_, one), level in self._read_at.items() if one == own)])
            for own in (*MULTIPLES, high)
        }

    @property
    def begun(self) -> Begun:
        """All that was read until now."""
        return Begun(tuple(self.heard), dict(self._read_at), self.seconds)

    def has(self, coil: int, multiple: int) -> bool:
        """Whether that was read."""
        return (coil, multiple) in self._read_at

    def read(self, coil: int, multiple: int, readings: int = 0) -> None:
        """Listen to all others; what was too loud once is played at half from then on.

        What was read of it before is forgotten.

        Raises
        ------
        ReadingError
            It was not read to the end.
        """
        is_flux = multiple == self.high
        usual = FLUX_READINGS if is_flux else self.readings
        begun = self.device.wire.now_s()
        for halving in range(HALVINGS + 1):
            found = sense(
                self.device,
                playing=coil,
                multiple=multiple,
                level_q15=round(self._levels[multiple] * 32767.0),
                settle_ms=FLUX_RING_UP_MS if is_flux else RING_UP_MS,
                readings=readings or usual,
            )
            if found is not None:
                break
            if halving == HALVINGS:
                raise ReadingError(f"coil {coil + 1} is too loud for the converter", hint=_TOO_LOUD)
            self._levels[multiple] /= 2.0
        assert found is not None
        self.seconds += self.device.wire.now_s() - begun
        # What others read in an earlier session needs its reference.
        self.heard = [
            own
            for own in self.heard
            if (own.playing, own.multiple) != (coil, multiple)
            or (own.listening == REFERENCE and own.session != found[0].session)
        ]
        self.heard += found
        self._read_at[coil, multiple] = self._levels[multiple]

    def read_again_at_one_level(self, multiple: int) -> None:
        """Those coils that were louder than the last one.

        At 7.6 kHz a wave has five samples, and four fifths of full duty play half of what a
        twentieth would make one expect: coils compare only at one level.
        """
        for (coil, own), level in list(self._read_at.items()):
            if own == multiple and level != self._levels[multiple]:
                self.read(coil, multiple)

    def read_lacking_references(self) -> None:
        """The first coil once more for each session without it: phases hold for one alone.

        A session ends where a host is kept from asking for a moment. What was read in one that
        ended without a reference is read again.

        Raises
        ------
        ReadingError
            One session after another ends.
        """
        for _ in range(SESSIONS):
            lacking = without_reference(self.heard)
            if not lacking:
                return
            for multiple in dict.fromkeys(own for _, own in lacking):
                self.read(0, multiple)
            for coil, multiple in without_reference(self.heard):
                self.read(coil, multiple)
        raise ReadingError("the device was busy with something else", hint="calibrate again")

    def read_unclear_references_again(self) -> None:
        """Those of coils that had to play so quietly that noise counts, for longer."""
        last = self.heard[-1].session
        references = [own for own in self.heard if own.listening == REFERENCE]
        for one in [own for own in references if own.session == last]:
            clear = abs(one.steps) / one.spread
            if clear < CLEAR_REFERENCE:
                longer = one.values / SENSE_PAIRS * (CLEAR_REFERENCE / max(clear, 1.0)) ** 2
                self.read(one.playing, one.multiple, min(int(np.ceil(longer)), MOST_READ))


def sense(device: Device, **asked: int) -> list[Heard] | None:
    """What coils read while one plays (docs/link-protocol.md), or None if one was too loud.

    Raises
    ------
    ReadingError
        It was not read to the end; says why.
    LinkError
        The device refuses it: it has no sensing pin, or something else plays.
    """
    device.link.request("sense", b"", **asked)
    answer = finished(device, lambda: device.link.request("sensed"), asked)
    if answer is None:
        return None
    entry = BY_NAME["sensed"].entry
    rows = [entry.unpack_from(answer.tail, k * entry.size) for k in range(answer.fields["count"])]
    duty = answer.fields["amplitude_q16"] / 65536.0
    values = asked["readings"] * SENSE_PAIRS
    heard = []
    for listening, in_phase, quadrature, total, squares in rows:
        steps = complex(in_phase, quadrature) / (COSINE * values)
        variance = 64.0 * squares / values - (total / values / 2.0) ** 2 - abs(steps) ** 2 / 2.0
        # No less than what whole numbers leave of two.
        noise = max(variance, 1.0 / 24.0) ** 0.5
        session = answer.fields["session"]
        heard.append(
            Heard(
                asked["playing"], listening, asked["multiple"], duty, steps, noise, values, session
            )
        )
    return heard


def finished(device: Device, ask: Callable[[], Answer], asked: Mapping[str, int]) -> Answer | None:
    """What a device says once it has read what was asked for; None if that was too loud.

    Raises
    ------
    ReadingError
        It was not read to the end; says why.
    """
    while True:
        answer = ask()
        state = SENSE_STATE.text(answer.fields["state"])
        if state != "running":
            break
        device.link.wait(ASK_AGAIN_S)
    if state == "too loud":
        return None
    if state != "done":
        what = f"coil {asked['playing'] + 1} was not read: {state}"
        raise ReadingError(what, hint=_HINTS[state])
    if any(answer.fields[key] != asked[key] for key in ("playing", "multiple")):
        raise ReadingError("another program reads coils too", hint="end it, and calibrate again")
    return answer


_TOO_LOUD = "is the sensing pin on the amplifier's output?"
_HINTS = {
    "none": "the device was started again meanwhile",
    "touched": "keep off the board, and calibrate again",
    "expander missing": "look at its lines and its address, 0x20",
    "converter fails": "look at the sensing pin in the configuration",
    "samples lost": "calibrate again",
    "accelerometer missing": "look at its lines: 0x18 or 0x19, or 0x1D or 0x53, on the panel's bus",
    "stopped": "`chladni device info` has its faults",
}
