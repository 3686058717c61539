"""Raw duties to a device, at this machine's clock: piece by piece, each just in time."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from chladni.host.device.wires.link import Link, LinkError
from chladni.host.protocol.link import (
    LEAST_TARGET,
    MAX_PAYLOAD,
    MOST_TARGET,
    VERSION_MAJOR,
    VERSION_MINOR,
)
from chladni.sim.errors import ArgumentError

WAIT_S = 0.03
"""For the answer to a piece: its frames are wanted in 10 ms."""
BUFFER_S = 0.007
"""Of frames that the device keeps in its ring on the average: then 99 of 100 reach the pins within
10 ms. A host that is late for longer than this less a piece makes an underrun."""
RING_FRAMES = 512
"""Frames that it holds; so many may come on any wire."""
ROUND_TRIPS = 9
"""Requests of which the middle one says how long an answer takes."""
SENDING_SHARE = 0.8
"""Of the time that a piece takes to play, for sending it and hearing of it."""
SETTLED_PIECES = 8
"""Pieces after which the device plays for certain."""
MEAN_SHARE, CORRECTED_SHARE = 0.1, 0.02
"""A piece's share in the mean of what the ring holds, and what it makes up for of its error:
half of it is gone after 35 pieces, and single late ones do not matter."""
SMALLEST_PIECE = 16
"""Frames at once, 1.6 ms: smaller pieces cost more requests, and are late as often."""


@dataclass(frozen=True)
class StreamStep:
    """Frames that one request of a stream took, how many the ring then held, and its time."""

    taken: int
    filled: int
    seconds: float


def stream_steps(
    link: Link,
    duties: NDArray[np.float64],
    *,
    rate_hz: float,
    buffer_s: float,
    has_bridges: bool = False,
) -> Iterator[StreamStep]:
    """Send duties, shares of a carrier period of shape (frames, channels), piece by piece.

    Raises
    ------
    InputError
        Duties that such drivers cannot give (`check_duties`); nothing was sent.
    LinkError
        The wire is too slow for so many channels, or the device ended the stream.
    """
    check_duties(np.asarray(duties), has_bridges)
    now_s = link.wire.now_s
    words = stream_words(np.asarray(duties), has_bridges)
    piece = _piece_of(link, len(words), words.shape[1], rate_hz)
    # On a slow wire pieces are long, and the ring has to hold one while the next travels.
    target = int(np.clip(round(buffer_s * rate_hz), max(LEAST_TARGET, piece), MOST_TARGET))
    link.request("stream_begin", target=target, is_signed=int(has_bridges))
    # Each piece goes out so early that the ring holds its target on the average. How long the
    # device takes to begin shows in what it holds then, and is made up for; later on what the
    # ring holds on the average is, a little with each piece.
    lead, sent, begun = target + piece // 2, 0, now_s()
    held = float(lead)
    for number in itertools.count():
        if sent == len(words):
            return
        part = words[sent : sent + piece]
        due = begun + (sent + len(part) - lead) / rate_hz
        if due > now_s():
            link.wait(due - now_s())
        asked = now_s()
        answer = link.request("stream_data", pack_frames(part), first_wait_s=WAIT_S).fields
        sent += answer["taken"]
        yield StreamStep(answer["taken"], answer["filled"], now_s() - asked)
        # As if it had gone out in time: a late one must not make the others earlier.
        in_time = answer["filled"] + max(asked - due, 0.0) * rate_hz
        if number == SETTLED_PIECES:
            begun += (in_time - lead) / rate_hz
        elif number > SETTLED_PIECES:
            held += MEAN_SHARE * (in_time - held)
            begun += CORRECTED_SHARE * (held - lead) / rate_hz
        if answer["taken"] < len(part):
            # The ring was full: this machine was late, and caught up too fast.
            link.wait(piece / rate_hz)


def check_duties(
    duties: NDArray[np.float64], has_bridges: bool, name: str = "duties", file: str | None = None
) -> None:
    """Raise `InputError` unless all are from 0 to 1, or of bridges from -1 to 1."""
    least, kind = (-1.0, "bridges") if has_bridges else (0.0, "switches")
    wrong = duties[~((duties >= least) & (duties <= 1.0))]
    if wrong.size:
        expected = f"duties from {least:g} to 1, as the device has {kind}"
        raise ArgumentError(name, f"{wrong.flat[0]:g}", expected, file=file)


def stream_words(duties: NDArray[np.float64], has_bridges: bool) -> NDArray[np.uint16]:
    """Ten bits of each duty; of a bridge's in two's complement."""
    if not has_bridges:
        return np.clip(np.rint(duties * 1024.0), 0, 1023).astype(np.uint16)
    signed = np.clip(np.rint(duties * 512.0), -511, 511).astype(np.int16)
    return (signed & 1023).astype(np.uint16)


def pack_frames(words: NDArray[np.uint16]) -> bytes:
    """Ten bits a duty, one after another from the lowest bit, shape (frames, channels)."""
    bits = (words.reshape(-1, 1) >> np.arange(10, dtype=np.uint16)) & 1
    return np.packbits(bits.astype(np.uint8).reshape(-1), bitorder="little").tobytes()


def _piece_of(link: Link, frames: int, channels: int, rate_hz: float) -> int:
    """Frames per request: as few as the wire can carry in time, whole bytes of them."""
    # Whole frames that fill whole bytes: four of any number of channels do.
    most = MAX_PAYLOAD * 8 // (10 * channels) // 4 * 4
    least = min(SMALLEST_PIECE, most)
    spare_s = SENDING_SHARE / rate_hz - link.wire_time(1) * 10 * channels / 8.0
    if spare_s > 0.0:
        return int(np.clip(_round_trip_s(link) / spare_s // 4 * 4 + 4, least, most))
    if frames > RING_FRAMES:
        needed = 1.25 * 10 * channels * rate_hz / SENDING_SHARE
        raise LinkError(
            f"{channels} channels need a wire of {needed:,.0f} baud, and this has "
            f"{link.wire.baud:,.0f}",
            hint="set link_baud, or use the network",
        )
    return least


def _round_trip_s(link: Link) -> float:
    """From a small request to its answer: the way there and back, and the device's main loop.

    Over a radio that is some milliseconds, on one machine a part of one.
    """
    seconds = []
    for _ in range(ROUND_TRIPS):
        asked = link.wire.now_s()
        link.request("hello", major=VERSION_MAJOR, minor=VERSION_MINOR)
        seconds.append(link.wire.now_s() - asked)
    return median(seconds)
