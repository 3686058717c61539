"""Settings as people write them: in units, by words, and what each is for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from chladni.host.protocol.config import MOVES, OWN, PANELS, SETTINGS, DeviceConfig, Setting
from chladni.sim.board.electronics import DRIVER_KINDS, NOT_WIRED
from chladni.sim.board.quantity import perhaps
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError
from chladni.tables.layout import MAX_ACTUATORS

Raw = int | tuple[int, ...]

UNITS = {"q15": ("", 32767.0), "um": ("mm", 1e3), "dk": ("k", 10.0), "ds": ("s", 10.0)}
"""What a name ends in: the unit that people write instead, and how many of the first it is."""
WHOLE_DUTY = 32768.0
"""`max_duty_q15` counts up to a duty of 1, the other shares up to 32767."""
WORDS = {
    "panel": PANELS,
    "waveform": WAVEFORMS,
    "on_move": MOVES,
    "panel_mirrored": ("no", "yes"),
    "driver": DRIVER_KINDS,
}
WORDS_IN_JSON = ("driver",)
"""Earlier settings are numbers there, which scripts know."""
BOTH_RAMPS = "ramp_ms"
"""A name for two settings: how touches begin and how they end."""
RAMPS = ("attack_ms", "release_ms")


@dataclass(frozen=True)
class Shown:
    """A setting as people meet it.

    Attributes
    ----------
    name
        Carries the unit: `panel_width_mm` for `panel_width_um`.
    scale
        The record's number is this many times the one people write.
    words
        That stand for 0, 1, …, if it is no number.
    """

    setting: Setting
    name: str
    scale: float
    words: tuple[str, ...]

    @property
    def raw_name(self) -> str:
        """As the record has it."""
        return self.setting.field.name

    @property
    def expected(self) -> str:
        """What a right value looks like."""
        if self.words:
            return f"one of: {', '.join(self.words)}"
        low, high = (self._number(value) for value in (self.setting.low, self.setting.high))
        count = self.setting.field.count
        many = "" if count == 1 else f"; {count} values with commas, or fewer for the first ones"
        return f"{low} to {high}{many}" + (", or none" if self._may_be_unwired else "")

    @property
    def _may_be_unwired(self) -> bool:
        return self.raw_name.endswith(("_pin", "_pins")) and self.setting.high >= NOT_WIRED

    def text(self, value: Raw, channels: int = MAX_ACTUATORS) -> str:
        """A value of the record in words; of a list so many as there are channels."""
        values = value[:channels] if isinstance(value, tuple) else (value,)
        return ", ".join(map(self._number, values))

    def for_json(self, value: Raw) -> str | int | list[int]:
        """A value of the record as `--json` has it."""
        if isinstance(value, tuple):
            return list(value)
        return self.words[value] if self.raw_name in WORDS_IN_JSON else value

    def _number(self, value: int) -> str:
        if self.words:
            return self.words[value]
        if self._may_be_unwired and value == NOT_WIRED:
            return "none"
        if self.scale == 1.0:
            return str(value)
        # As few digits as bring the record's number back.
        texts = (f"{value / self.scale:.{digits}f}" for digits in range(10))
        return next(text for text in texts if round(float(text) * self.scale) == value)

    def parse(self, text: str) -> Raw:
        """A value of the record, of what people write.

        Raises
        ------
        InputError
            No such word, or out of range, in the unit that it was written in.
        """
        parts = [part.strip() for part in text.split(",")]
        found = [self._one(part, text) for part in parts]
        count = self.setting.field.count
        default = self.setting.default
        if count == 1 and len(found) == 1:
            return found[0]
        if isinstance(default, int) or not 0 < len(found) <= count:
            raise InputError(self.name, text, self.expected)
        rest = (NOT_WIRED,) * count if self._may_be_unwired else default
        return (*found, *rest[len(found) :])

    def _one(self, part: str, whole: str) -> int:
        if part in self.words:
            return self.words.index(part)
        if self._may_be_unwired and part == "none":
            return NOT_WIRED
        try:
            raw = int(part, 0) if self.scale == 1.0 else float(part) * self.scale
        except ValueError:
            raise InputError(self.name, whole, self.expected) from None
        # Half a step of the record is rounding; the rest is out of range.
        if not self.setting.low - 0.5 <= raw <= self.setting.high + 0.5:
            raise InputError(self.name, whole, self.expected)
        return round(raw)


def _shown(setting: Setting) -> Shown:
    raw = setting.field.name
    stem, _, ending = raw.rpartition("_")
    if ending not in UNITS:
        return Shown(setting, raw, 1.0, WORDS.get(raw, ()))
    unit, scale = UNITS[ending]
    scale = WHOLE_DUTY if raw.endswith("max_duty_q15") else scale
    return Shown(setting, f"{stem}_{unit}" if unit else stem, scale, ())


SHOWN = {shown.raw_name: shown for shown in map(_shown, SETTINGS)}
"""By the record's name."""
_BY_NAME = SHOWN | {shown.name: shown for shown in SHOWN.values()}


def find(name: str) -> Shown:
    """A setting by either of its names.

    Raises
    ------
    InputError
        There is none.
    """
    if name not in _BY_NAME:
        known = [shown.name for shown in SHOWN.values() if shown.raw_name not in OWN]
        known.append(BOTH_RAMPS)
        raise InputError("NAME", name, f"one of: {', '.join(known)}", hint=perhaps(name, known))
    return _BY_NAME[name]


def parse_setting(text: str) -> dict[str, Raw]:
    """What NAME=VALUE changes, by the record's names.

    Raises
    ------
    InputError
        No such setting, or a value that it cannot have.
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise InputError("NAME=VALUE", text, "a setting and its value, as level=0.8")
    if name == BOTH_RAMPS:
        return {raw: SHOWN[raw].parse(value) for raw in RAMPS}
    shown = find(name)
    if shown.raw_name in OWN:
        hint = "this one is not"
        raise InputError(name, value, "a setting that is written by hand", hint=hint)
    # By the record's name the record's own numbers are meant.
    written = Shown(shown.setting, name, 1.0, shown.words) if name == shown.raw_name else shown
    return {shown.raw_name: written.parse(value)}


def for_json(values: Mapping[str, Raw]) -> dict[str, Any]:
    """Settings by the record's names, as `--json` has them."""
    return {raw: SHOWN[raw].for_json(value) for raw, value in values.items()}


def described() -> list[dict[str, Any]]:
    """Every setting that can be written: name, what it may be, default and meaning."""
    return [
        {
            "name": shown.name,
            "record": shown.raw_name,
            "expected": shown.expected,
            "default": shown.text(shown.setting.default),
            "meaning": shown.setting.field.doc,
        }
        for shown in SHOWN.values()
        if shown.raw_name not in OWN
    ]


def changes(before: DeviceConfig, after: DeviceConfig) -> list[dict[str, Any]]:
    """Settings in which two configurations differ, as people read them."""
    return [
        {
            "name": shown.name,
            "from": shown.text(before[raw], before["channels"]),
            "to": shown.text(after[raw], after["channels"]),
        }
        for raw, shown in SHOWN.items()
        if raw not in OWN and before[raw] != after[raw]
    ]
