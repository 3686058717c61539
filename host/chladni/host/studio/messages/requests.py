"""What a page may ask of the server, parsed within bounds."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from chladni.drives.fingers.silence import MOST_FINGERS
from chladni.drives.methods import METHODS
from chladni.drives.objectives import OBJECTIVES
from chladni.sim.board.file import MOST_BYTES as MOST_BOARD_BYTES
from chladni.sim.errors import InputError, MissingError

Place = tuple[float, float]
"""Millimetres from the board's centre."""
MOST_BYTES = 2048
"""Of a request, unless it brings a board file or a SPEC."""
LONGEST = MOST_BYTES + 2 * MOST_BOARD_BYTES
"""Of one that does, or an effect: in JSON a quote or the end of a line takes two bytes."""
LOWEST_TONE_HZ, HIGHEST_TONE_HZ = 20.0, 250.0
"""Of a finger's own signal: what lies below is seen and not felt as a vibration, and plates as ours
have waves above."""
PARTS = ("actuators", "screws")
FILES = ("board", "table")
ORDERS = ("about", "flash", "self-test", "set", "configure")
LEVELS, TONES = "0 to 1", f"{LOWEST_TONE_HZ:g} to {HIGHEST_TONE_HZ:g} Hz, or null"
LARGEST_NUMBER = 2**53
"""The page counts its requests in JavaScript's whole numbers."""
LARGEST_MM, LARGEST_HZ = 1e6, 1e6
"""Boards have closer limits of their own."""


@dataclass(frozen=True)
class Touch:
    """A finger (0 to 4) that is put down or moves, or that lifts: its place is None then."""

    number: int
    finger: int
    place_mm: Place | None


@dataclass(frozen=True)
class Voice:
    """What a finger plays from its next touch on: its tone, None for the table's, and its level."""

    number: int
    finger: int
    tone_hz: float | None
    level: float


@dataclass(frozen=True)
class PlayEffect:
    """An effect under a finger: a shipped one by name, or a file by its bytes.

    Another finger may rest at `other_mm`; `level` is of the loudest for the place.
    """

    number: int
    name: str
    data: bytes | None
    at_mm: Place
    other_mm: Place | None
    level: float


@dataclass(frozen=True)
class Move:
    """A coil or a screw that is put elsewhere."""

    number: int
    part: str
    index: int
    place_mm: Place


@dataclass(frozen=True)
class Choose:
    """A board by name, or the one that is shown, and how its drives are found.

    Without an objective, the board's own.
    """

    board: str | None
    objective: str | None
    method: str
    frequency_hz: float | None


@dataclass(frozen=True)
class Open:
    """A board file by its text."""

    name: str
    text: str


@dataclass(frozen=True)
class Begin:
    """A design: a SPEC by its text, or a shipped one by name."""

    name: str
    text: str | None


@dataclass(frozen=True)
class Stop:
    """An end of the page's design."""


@dataclass(frozen=True)
class Take:
    """A board that the page's design has found, to be shown."""

    index: int


@dataclass(frozen=True)
class Save:
    """The board or its table, to be sent as a file."""

    what: str


@dataclass(frozen=True)
class Attach:
    """A real device at a port; None lets go of the one there is."""

    port: str | None


@dataclass(frozen=True)
class Order:
    """Something for the real device to do; `text` is a setting, NAME=VALUE, for "set"."""

    what: str
    text: str


Request = (
    Touch | Voice | PlayEffect | Move | Choose | Open | Begin | Stop | Take | Save | Attach | Order
)


def parse(text: str) -> Request:
    """A request of a page.

    Raises
    ------
    InputError
        It says something else; names the field.
    """
    size = len(text.encode("utf-8", "replace"))
    try:
        message = json.loads(text, parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise InputError("message", text[:40], "a JSON object") from None
    if not isinstance(message, dict):
        raise InputError("message", message, "a JSON object")
    kind = message.pop("type", None)
    if not isinstance(kind, str) or kind not in _KINDS:
        raise InputError("type", kind, "one of: " + ", ".join(_KINDS))
    if kind not in ("open", "design", "effect") and size > MOST_BYTES:
        raise InputError("message", f"{size} bytes", f"at most {MOST_BYTES}")
    known, make = _KINDS[kind]
    for key, value in message.items():
        if key not in known:
            raise InputError(key, value, "one of: " + ", ".join(known))
    for key in known:
        if key not in message:
            raise MissingError(key)
    return make(message)


def number_of(text: str) -> int | None:
    """The number of a request, also of one that is refused, so that its page waits no longer."""
    try:
        number = json.loads(text)["number"]
    except (ValueError, RecursionError, KeyError, TypeError):
        return None
    is_whole = isinstance(number, int) and not isinstance(number, bool)
    return number if is_whole and 0 <= number < LARGEST_NUMBER else None


def _no_constant(name: str) -> float:
    raise ValueError(name)


def _press(message: dict[str, Any]) -> Touch:
    return Touch(_whole(message, "number"), _finger(message), _place(message))


def _lift(message: dict[str, Any]) -> Touch:
    return Touch(_whole(message, "number"), _finger(message), None)


def _voice(message: dict[str, Any]) -> Voice:
    tone_hz, level = message["tone_hz"], _level(message)
    if tone_hz is not None:
        tone_hz = _number(message, "tone_hz", TONES, HIGHEST_TONE_HZ)
        if tone_hz < LOWEST_TONE_HZ:
            raise InputError("tone_hz", tone_hz, TONES)
    return Voice(_whole(message, "number"), _finger(message), tone_hz, level)


def _effect(message: dict[str, Any]) -> PlayEffect:
    other, data = message["other_mm"], message["data"]
    if data is not None:
        try:
            data = base64.b64decode(_text(message, "data"), validate=True)
        except ValueError:
            raise InputError("data", data[:40], "a file in base64, or null") from None
    return PlayEffect(
        _whole(message, "number"),
        _text(message, "name"),
        data,
        _pair(message, "at_mm"),
        None if other is None else _pair(message, "other_mm"),
        _level(message),
    )


def _move(message: dict[str, Any]) -> Move:
    part = _one_of(message, "part", PARTS)
    return Move(_whole(message, "number"), part, _whole(message, "index"), _place(message))


def _choose(message: dict[str, Any]) -> Choose:
    board = _text(message, "board") if message["board"] is not None else None
    frequency = message["frequency_hz"]
    if frequency is not None:
        frequency = _number(message, "frequency_hz", "a frequency in Hz, or null", LARGEST_HZ)
    own = message["objective"] is None
    objective = None if own else _one_of(message, "objective", tuple(OBJECTIVES))
    return Choose(board, objective, _one_of(message, "method", tuple(METHODS)), frequency)


def _open(message: dict[str, Any]) -> Open:
    return Open(_text(message, "name"), _text(message, "text"))


def _begin(message: dict[str, Any]) -> Begin:
    text = _text(message, "text") if message["text"] is not None else None
    return Begin(_text(message, "name"), text)


def _stop(_: dict[str, Any]) -> Stop:
    return Stop()


def _take(message: dict[str, Any]) -> Take:
    return Take(_whole(message, "index"))


def _save(message: dict[str, Any]) -> Save:
    return Save(_one_of(message, "what", FILES))


def _attach(message: dict[str, Any]) -> Attach:
    return Attach(_text(message, "port") if message["port"] is not None else None)


def _order(message: dict[str, Any]) -> Order:
    return Order(_one_of(message, "what", ORDERS), _text(message, "text"))


_KINDS: dict[str, tuple[tuple[str, ...], Callable[[dict[str, Any]], Request]]] = {
    "press": (("number", "finger", "x_mm", "y_mm"), _press),
    "lift": (("number", "finger"), _lift),
    "voice": (("number", "finger", "tone_hz", "level"), _voice),
    "effect": (("number", "name", "data", "at_mm", "other_mm", "level"), _effect),
    "move": (("number", "part", "index", "x_mm", "y_mm"), _move),
    "choose": (("board", "objective", "method", "frequency_hz"), _choose),
    "open": (("name", "text"), _open),
    "design": (("name", "text"), _begin),
    "stop": ((), _stop),
    "take": (("index",), _take),
    "save": (("what",), _save),
    "attach": (("port",), _attach),
    "order": (("what", "text"), _order),
}
"""Keys of every kind of request, all of them required, and what it is made into."""


def _place(message: dict[str, Any]) -> Place:
    expected = "a number of millimetres"
    return (
        _number(message, "x_mm", expected, LARGEST_MM),
        _number(message, "y_mm", expected, LARGEST_MM),
    )


def _pair(message: dict[str, Any], key: str) -> Place:
    value = message[key]
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(key, value, "two numbers of millimetres")
    own = dict(zip(("x_mm", "y_mm"), value, strict=True))
    return _place(own)


def _level(message: dict[str, Any]) -> float:
    level = _number(message, "level", LEVELS, 1.0)
    if level < 0.0:
        raise InputError("level", level, LEVELS)
    return level


def _number(message: dict[str, Any], key: str, expected: str, largest: float) -> float:
    value = message[key]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= largest:
        raise InputError(key, value, expected)
    return float(value)


def _whole(message: dict[str, Any], key: str) -> int:
    value = message[key]
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < LARGEST_NUMBER:
        raise InputError(key, value, "a whole number of at least 0")
    return value


def _finger(message: dict[str, Any]) -> int:
    value = _whole(message, "finger")
    if value >= MOST_FINGERS:
        raise InputError("finger", value, f"0 to {MOST_FINGERS - 1}")
    return value


def _text(message: dict[str, Any], key: str) -> str:
    value = message[key]
    if not isinstance(value, str):
        raise InputError(key, value, "a text")
    return value


def _one_of(message: dict[str, Any], key: str, known: tuple[str, ...]) -> str:
    value = message[key]
    if not isinstance(value, str) or value not in known:
        raise InputError(key, value, "one of: " + ", ".join(known))
    return value
