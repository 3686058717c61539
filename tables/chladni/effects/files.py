"""Effects from files, by their names' endings, or by the name of one that comes with Chladni."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from chladni.effects.ahap_file import read_ahap, to_ahap
from chladni.effects.effect import Effect
from chladni.effects.haptic_file import read_haptic, to_haptic
from chladni.effects.hjif_file import read_hjif
from chladni.effects.shipped import SHIPPED
from chladni.effects.toml_file import read_toml_effect
from chladni.effects.wav_file import read_wav, to_wav
from chladni.sim.board.quantity import perhaps
from chladni.sim.errors import ArgumentError

READERS: dict[str, Callable[[Path, str], tuple[Effect, list[str]]]] = {
    ".haptic": read_haptic,
    ".ahap": read_ahap,
    ".hjif": read_hjif,
    ".wav": read_wav,
    ".toml": read_toml_effect,
}
WRITERS: dict[str, Callable[[Effect], tuple[bytes, list[str]]]] = {
    ".ahap": to_ahap,
    ".haptic": to_haptic,
    ".wav": to_wav,
}
"""A file's bytes, and what of the effect it cannot say."""


@dataclass(frozen=True)
class ReadEffect:
    """An effect, and what of its file is left out, place by place."""

    effect: Effect
    left_out: list[str]


def shipped_effects() -> dict[str, Effect]:
    """Those that come with Chladni, by name."""
    return {effect.name: effect for effect in SHIPPED}


def read_effect(name: str | Path, *, field: str = "effect") -> ReadEffect:
    """An effect by name or from a file.

    Parameters
    ----------
    name
        Of a shipped effect, or a file that ends in .haptic, .ahap, .hjif, .wav or .toml.
    field
        The argument, for errors.

    Raises
    ------
    InputError
        There is no such effect, or the file is not what its ending says; names what and where.
    """
    shipped = shipped_effects()
    if str(name) in shipped:
        return ReadEffect(shipped[str(name)], [])
    path = Path(name)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        expected = f"{', '.join(shipped)}, or a file that ends in {', '.join(READERS)}"
        raise ArgumentError(field, str(name), expected, hint=perhaps(name, shipped))
    return ReadEffect(*reader(path, field))
