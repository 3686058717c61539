"""An effect as a sound from the computer's own speaker, before a board is built."""

from __future__ import annotations

from importlib import import_module

from chladni.effects.effect import Effect
from chladni.sim.errors import ChladniError

RATE_HZ = 48_000.0
"""That every sound card has."""


class SpeakerError(ChladniError):
    """There is no speaker, or nothing that speaks to it."""


def listen(effect: Effect) -> None:
    """Play an effect, and wait until it is over.

    Raises
    ------
    SpeakerError
        `sounddevice` is not installed, PortAudio is not, or no device takes the sound.
    """
    try:
        sound = import_module("sounddevice")
    except ImportError as error:
        raise SpeakerError(
            "sound needs sounddevice", hint="pip install 'chladni[sound]'"
        ) from error
    except OSError as error:
        raise SpeakerError(
            f"sounddevice finds no PortAudio: {error}", hint="apt install libportaudio2"
        ) from error
    try:
        sound.play(effect.samples(RATE_HZ).astype("float32"), RATE_HZ, blocking=True)
    except sound.PortAudioError as error:
        raise SpeakerError(
            f"no speaker takes the sound: {error}", hint="write it as .wav by effects convert"
        ) from error
