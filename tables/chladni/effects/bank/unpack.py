"""A bank from its bytes: whole, or refused with the verdict that the firmware would give.

The checks and their order are those of `core/effects/bank.cpp`.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from itertools import pairwise
from math import log10
from pathlib import Path
from typing import Any

import numpy as np

from chladni.effects.bank.areas import Area, Bank, Circle, Everywhere, Polygon, Shape
from chladni.effects.bank.layout import (
    ALONG,
    AREA,
    AREA_FIELDS,
    CLIP_STEPS,
    CORNER,
    CRC_BYTES,
    EFFECT,
    EFFECT_FIELDS,
    FREQUENCY_STEPS,
    FULL_SCALE,
    HEADER,
    HEADER_FIELDS,
    LARGEST_FILE,
    MAGIC,
    MAX_AREAS,
    MAX_CLIP_STEP,
    MAX_CORNERS,
    MAX_EFFECTS,
    MAX_EVERY_UM,
    MAX_FREQUENCY,
    MAX_HYSTERESIS_UM,
    MAX_PLACE_UM,
    MAX_TONES,
    NAME_BYTES,
    NO_EFFECT,
    OCCASIONS,
    PART,
    PART_FIELDS,
    PARTS,
    POINT,
    SHAPES,
    SIGNAL_HZ,
    SMALLEST_FILE,
    UM_STEPS,
    VERSION_MAJOR,
    VERSION_MINOR,
)
from chladni.effects.effect import Click, Clip, Curve, Effect, Noise, Part, Tone
from chladni.sim.errors import InputError
from chladni.sim.files import read_whole
from chladni.tables.layout import Field

Values = dict[str, Any]


class BankRefusedError(InputError):
    """Bytes that are no bank.

    Attributes
    ----------
    verdict
        The firmware's answer to the same bytes: the name of its `BankStatus`.
    """

    def __init__(self, verdict: str, field: str, value: object, expected: str) -> None:
        self.verdict = verdict
        super().__init__(field, value, expected)


def read_bank_file(path: Path, field: str) -> Bank:
    """A bank file.

    Raises
    ------
    InputError
        It cannot be read, or is no bank; names what is wrong.
    """
    data = read_whole(path, field, LARGEST_FILE, "an effect bank")
    try:
        return unpack_bank(data)
    except BankRefusedError as error:
        raise error.in_file(str(path)) from None


def unpack_bank(data: bytes) -> Bank:
    """The bank that these bytes are.

    Raises
    ------
    BankRefusedError
        They are none.
    """
    head = _head(data)
    reader = _Reader(data, head)
    areas = [*reader.areas()]
    effects = [*reader.effects()]
    names = [name for name, _ in effects]

    def named(entry: Values) -> dict[str, str]:
        return {o: names[entry[o]] for o in OCCASIONS if entry[o] != NO_EFFECT}

    try:
        return Bank(
            _text(head["name"]),
            dict(effects),
            tuple(
                Area(
                    _text(entry["name"]),
                    shape,
                    level_db=round(20.0 * log10(max(entry["level_q15"], 33) / FULL_SCALE), 3),
                    level_um=entry["most_10nm"] / UM_STEPS or None,
                    every_mm=entry["every_um"] / 1e3,
                    along=ALONG[entry["along"]],
                    **named(entry),
                )
                for entry, shape in areas
            ),
            head["hysteresis_um"] / 1e3,
        )
    except BankRefusedError:
        raise
    except InputError as error:
        # A device would play it; no host wrote it.
        raise BankRefusedError("kOk", error.field, error.value, error.expected) from None


def _head(data: bytes) -> Values:
    if len(data) < SMALLEST_FILE:
        raise BankRefusedError("kBadSize", "bytes", len(data), f"{SMALLEST_FILE} or more")
    if data[:4] != MAGIC:
        raise BankRefusedError("kBadMagic", "magic", data[:4], repr(MAGIC))
    head = _values(HEADER_FIELDS, HEADER, data, 0)
    version = head["version_major"], head["version_minor"]
    if version[0] != VERSION_MAJOR or version[1] > VERSION_MINOR:
        expected = f"{VERSION_MAJOR}.{VERSION_MINOR}: build it again"
        raise BankRefusedError("kBadVersion", "version", "{}.{}".format(*version), expected)
    total = head["total_bytes"]
    if total != len(data) or not SMALLEST_FILE <= total <= LARGEST_FILE:
        raise BankRefusedError("kBadSize", "total_bytes", total, f"{len(data)}")
    if _body_begins(head) > total - CRC_BYTES:
        raise BankRefusedError("kBadSize", "directories", head["effects"], "fewer entries")
    if zlib.crc32(data[:-CRC_BYTES]) != struct.unpack("<I", data[-CRC_BYTES:])[0]:
        raise BankRefusedError("kBadCrc", "crc", "another", "that of the file's bytes")
    is_fine = (
        head["effects"] <= MAX_EFFECTS
        and head["areas"] <= MAX_AREAS
        and head["hysteresis_um"] <= MAX_HYSTERESIS_UM
        and head["reserved"] == 0
        and _is_name(head["name"])
    )
    if not is_fine:
        raise BankRefusedError("kBadField", "header", head["name"], "fields within their ranges")
    return head


def _body_begins(head: Values) -> int:
    return int(HEADER.size + AREA.size * head["areas"] + EFFECT.size * head["effects"])


class _Reader:
    def __init__(self, data: bytes, head: Values) -> None:
        self.data, self.head = data, head
        self.begins, self.ends = _body_begins(head), len(data) - CRC_BYTES

    def _has(self, offset: int, size: int) -> bool:
        return self.begins <= offset <= self.ends and size <= self.ends - offset

    def areas(self) -> Iterator[tuple[Values, Shape]]:
        for k in range(self.head["areas"]):
            entry = _values(AREA_FIELDS, AREA, self.data, HEADER.size + AREA.size * k)
            if not self._is_area(entry, is_last=k == self.head["areas"] - 1):
                raise BankRefusedError("kBadArea", f"area {k}", entry["name"], "a whole area")
            points = self._points(entry)
            shape: Shape = Everywhere()
            if not all(abs(v) <= MAX_PLACE_UM for point in points for v in point):
                raise BankRefusedError("kBadArea", f"area {k}", points, "points on a board")
            mm = [(x / 1e3, y / 1e3) for x, y in points]
            if SHAPES[entry["shape"]] == "circle":
                if points[1][0] < 1 or points[1][1] != 0:
                    raise BankRefusedError("kBadArea", f"area {k}", points[1], "a radius")
                shape = _made(Circle, k, mm[0], mm[1][0])
            elif SHAPES[entry["shape"]] == "polygon":
                shape = _made(Polygon, k, tuple(mm))
            yield entry, shape

    def _is_area(self, entry: Values, *, is_last: bool) -> bool:
        if not (_is_name(entry["name"]) and entry["shape"] < len(SHAPES)):
            return False
        least, most = {"everywhere": (0, 0), "circle": (2, 2), "polygon": (3, MAX_CORNERS)}[
            SHAPES[entry["shape"]]
        ]
        played = [entry[occasion] for occasion in OCCASIONS]
        return (
            least <= entry["corners"] <= most
            and (least > 0 or is_last)
            and entry["along"] < len(ALONG)
            and entry["reserved"] == 0
            and all(one == NO_EFFECT or one < self.head["effects"] for one in played)
            and entry["every_um"] <= MAX_EVERY_UM
            and entry["level_q15"] <= FULL_SCALE
            and self._has(entry["offset"], entry["corners"] * CORNER.size)
        )

    def _points(self, entry: Values) -> list[tuple[int, int]]:
        end = entry["offset"] + entry["corners"] * CORNER.size
        return [*CORNER.iter_unpack(self.data[entry["offset"] : end])]

    def effects(self) -> Iterator[tuple[str, Effect]]:
        begins = HEADER.size + AREA.size * self.head["areas"]
        for k in range(self.head["effects"]):
            entry = _values(EFFECT_FIELDS, EFFECT, self.data, begins + EFFECT.size * k)
            is_fine = (
                _is_name(entry["name"])
                and entry["parts"] > 0
                and entry["reserved"] == 0
                and entry["loop_from"] < entry["loop_to"] <= entry["lasts"]
            )
            if not is_fine:
                raise BankRefusedError("kBadEffect", f"effect {k}", entry["name"], "a whole effect")
            name = _text(entry["name"])
            loop = (entry["loop_from"] / SIGNAL_HZ, entry["loop_to"] / SIGNAL_HZ)
            is_all = (entry["loop_from"], entry["loop_to"]) == (0, entry["lasts"])
            parts = tuple(self._parts(k, entry))
            if sum(isinstance(part, Tone) for part in parts) > MAX_TONES:
                raise BankRefusedError("kBadEffect", f"effect {k}", name, f"{MAX_TONES} tones")
            yield name, Effect(name, parts, None if is_all else loop)

    def _parts(self, effect: int, entry: Values) -> Iterator[Part]:
        at = entry["offset"]
        for k in range(entry["parts"]):
            place = f"effect {effect}, part {k}"
            if not self._has(at, PART.size):
                raise BankRefusedError("kBadEffect", place, at, "an offset within the file")
            own = _values(PART_FIELDS, PART, self.data, at)
            at += PART.size
            size = _data_bytes(own)
            if not (self._has(at, size) and _is_part(own, entry["lasts"])):
                raise BankRefusedError("kBadEffect", place, own["kind"], "a whole part")
            data = self.data[at : at + size]
            at += size
            points = [] if PARTS[own["kind"]] == "clip" else [*POINT.iter_unpack(data)]
            if not _are_points(own, points):
                raise BankRefusedError("kBadEffect", place, points[:4], "points in order")
            yield _part(own, points, data)


def _made(shape: type[Circle] | type[Polygon], area: int, *values: Any) -> Shape:
    try:
        return shape(*values)
    except InputError as error:
        # A device would take it; no host wrote it.
        raise BankRefusedError("kOk", f"area {area}", error.value, error.expected) from None


def _is_part(own: Values, effect_lasts: int) -> bool:
    if own["kind"] >= len(PARTS) or own["reserved"] != 0 or own["lasts"] < 1:
        return False
    if own["begins"] + own["lasts"] > effect_lasts or own["level_q15"] > FULL_SCALE:
        return False
    first, second, level, rate = (
        own[name] for name in ("amplitudes", "frequencies", "level_q15", "rate")
    )
    match PARTS[own["kind"]]:
        case "tone":
            return bool(first > 0 and second > 0 and level == 0 and rate == 0)
        case "click":
            return bool(first == second == 0 and 1 <= rate <= MAX_FREQUENCY)
        case "noise":
            return bool(first > 0 and second == 0 and level == 0 and rate == 0)
        case _:
            last = (own["lasts"] - 1) * rate // CLIP_STEPS
            return bool(second == 0 and 1 <= rate <= MAX_CLIP_STEP and last < first)


def _data_bytes(own: Values) -> int:
    is_clip = own["kind"] == PARTS.index("clip")
    each = 1 if is_clip else POINT.size
    return int(own["amplitudes"] * each + own["frequencies"] * POINT.size)


def _are_points(own: Values, points: list[tuple[int, int]]) -> bool:
    amplitudes, frequencies = points[: own["amplitudes"]], points[own["amplitudes"] :]
    for curve in (amplitudes, frequencies):
        if any(late < early for (early, _), (late, _) in pairwise(curve)):
            return False
        if curve and curve[-1][0] > own["lasts"]:
            return False
    return all(value <= FULL_SCALE for _, value in amplitudes) and all(
        1 <= value <= MAX_FREQUENCY for _, value in frequencies
    )


def _part(own: Values, points: list[tuple[int, int]], data: bytes) -> Part:
    begins_s = own["begins"] / SIGNAL_HZ
    ends_s = (own["begins"] + own["lasts"]) / SIGNAL_HZ
    first = own["amplitudes"]
    match PARTS[own["kind"]]:
        case "tone":
            amplitude = _curve(points[:first], begins_s, FULL_SCALE)
            frequency_hz = _curve(points[first:], begins_s, FREQUENCY_STEPS)
            return Tone(begins_s, ends_s, amplitude, frequency_hz)
        case "click":
            return Click(begins_s, own["level_q15"] / FULL_SCALE, own["rate"] / FREQUENCY_STEPS)
        case "noise":
            return Noise(begins_s, ends_s, _curve(points, begins_s, FULL_SCALE))
        case _:
            samples = np.frombuffer(data, np.int8) * (own["level_q15"] / FULL_SCALE / 127.0)
            return Clip(begins_s, samples, own["rate"] * SIGNAL_HZ / CLIP_STEPS)


def _curve(points: list[tuple[int, int]], begins_s: float, steps: float) -> Curve:
    return Curve(
        tuple(begins_s + at / SIGNAL_HZ for at, _ in points),
        tuple(value / steps for _, value in points),
    )


def _values(fields: tuple[Field, ...], packed: struct.Struct, data: bytes, at: int) -> Values:
    names = (field.name for field in fields)
    return dict(zip(names, packed.unpack_from(data, at), strict=True))


def _is_name(name: bytes) -> bool:
    text = name.rstrip(b"\0")
    is_text = name.isascii() and text.decode("ascii", "replace").isprintable()
    return 0 < len(text) < NAME_BYTES and is_text


def _text(name: bytes) -> str:
    return name.rstrip(b"\0").decode("ascii")
