"""An effect through the computer's own speaker: what is played, and what stands in its way."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from chladni.effects.effect import Effect
from chladni.effects.files import read_effect
from conftest import CommandLine


class PortAudioError(Exception):
    """As of sounddevice."""


@pytest.fixture
def played(monkeypatch: pytest.MonkeyPatch) -> list[tuple[np.ndarray, float, bool]]:
    """What a sound card would have got: no machine of a test has one."""
    calls: list[tuple[np.ndarray, float, bool]] = []

    def play(samples: np.ndarray, rate: float, *, blocking: bool) -> None:
        calls.append((samples, rate, blocking))

    card = SimpleNamespace(play=play, PortAudioError=PortAudioError)
    monkeypatch.setitem(sys.modules, "sounddevice", card)
    return calls


def test_an_effect_is_played_to_its_end(
    chladni: CommandLine, played: list[tuple[np.ndarray, float, bool]]
) -> None:
    done = chladni("effects", "show", "click", "--listen")
    assert done.code == 0, done.err
    ((samples, rate, blocking),) = played
    effect: Effect = read_effect("click", field="EFFECT").effect
    assert blocking
    assert len(samples) / rate >= effect.lasts_s
    assert samples == pytest.approx(effect.samples(rate), abs=1e-6)
    assert 0.2 < np.abs(samples).max() <= 1.0
    assert len(played) == 1
    assert chladni("effects", "show", "click").code == 0
    assert len(played) == 1


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ImportError("no module"), "sound needs sounddevice; pip install 'chladni[sound]'"),
        (OSError("PortAudio library not found"), "finds no PortAudio: PortAudio library not found"),
        (PortAudioError("no default output"), "no speaker takes the sound: no default output"),
    ],
)
def test_what_stands_in_the_way_is_named(
    chladni: CommandLine,
    played: list[tuple[np.ndarray, float, bool]],
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    words: str,
) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise error

    if isinstance(error, PortAudioError):
        monkeypatch.setattr(sys.modules["sounddevice"], "play", fails)
    else:
        monkeypatch.setattr("chladni.host.cli.effects.listening.import_module", fails)
    done = chladni("effects", "show", "click", "--listen")
    assert done.code == 1
    assert words in done.err
    assert played == []


def test_a_bank_is_not_listened_to(chladni: CommandLine, tmp_path: Path) -> None:
    done = chladni("effects", "show", "calculator", "--listen")
    assert done.code == 2
    assert "--listen does not go with a bank; listen to one of its effects" in done.err
