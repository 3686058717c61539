"""MPEG's `.hjif`: what each kind of band plays, against closed forms, and what is refused."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.effects import Clip, Effect, Tone, read_effect
from chladni.sim.errors import InputError

RATE = 48_000.0


def frame(at: int, amplitude: float | None = None, hertz: float | None = None) -> dict[str, Any]:
    own: dict[str, Any] = {"relative_position": at}
    if amplitude is not None:
        own["amplitude_modulation"] = amplitude
    if hertz is not None:
        own["frequency_modulation"] = hertz
    return own


def basis(position: int, *frames: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"effect_type": "Basis", "position": position, "keyframes": list(frames)} | more


def band(kind: str, *effects: dict[str, Any], **more: Any) -> dict[str, Any]:
    limits = {"lower_frequency_limit": 65, "upper_frequency_limit": 300}
    return {"band_type": kind, "effects": list(effects)} | limits | more


def document(*bands: dict[str, Any], gain: float = 1.0, library: Any = ()) -> dict[str, Any]:
    channel = {"id": 0, "gain": gain, "bands": list(bands)}
    perception = {
        "id": 0,
        "perception_modality": "Vibrotactile",
        "effect_library": list(library),
        "channels": [channel],
    }
    return {"version": "2023", "timescale": 1000, "perceptions": [perception]}


WAVE = band("VectorialWave", basis(100, frame(0, 0.2, 80), frame(200, 1.0), frame(400, 0.0, 240)))
ALL = document(
    WAVE,
    band("Transient", basis(50, frame(0, 0.5, 100), frame(60, 1.0, 100))),
    band("Curve", basis(0, frame(0, 0.0), frame(40, 0.4), frame(80, 0.0)), curve_type="Linear"),
)


def read(folder: Path, content: dict[str, Any]) -> tuple[Effect, list[str]]:
    path = folder / "own.hjif"
    path.write_text(json.dumps(content), encoding="utf-8")
    found = read_effect(path)
    return found.effect, found.left_out


def test_a_wave_follows_its_keyframes(tmp_path: Path) -> None:
    """From 0.1 to 0.5 s, straight from 80 to 240 Hz: its phase goes with the square of time."""
    effect, left_out = read(tmp_path, document(WAVE, gain=0.5))
    assert left_out == []
    times = np.arange(int(0.6 * RATE)) / RATE
    own = times - 0.1
    turns = 80.0 * own + 0.5 * (160.0 / 0.4) * own**2
    size = np.interp(own, [0.0, 0.2, 0.4], [0.1, 0.5, 0.0])
    wanted = np.where((own >= 0.0) & (own < 0.4), size * np.sin(2.0 * np.pi * turns), 0.0)
    np.testing.assert_allclose(effect.wave(RATE, 0.6)[: len(times)], wanted, atol=2e-3)


def test_a_transient_is_two_waves_in_22_ms(tmp_path: Path) -> None:
    """Within a sample's turn, 0.012 of its amplitude: where it begins is rounded either way."""
    effect, _ = read(tmp_path, document(band("Transient", basis(50, frame(10, -0.5)))))
    times = np.arange(int(0.1 * RATE)) / RATE
    own = times - 0.06
    wanted = np.where((own >= 0.0) & (own < 0.022), 0.5 * np.sin(4.0 * np.pi * own / 0.022), 0.0)
    found = effect.wave(RATE, 0.1)[: len(times)]
    np.testing.assert_allclose(found, wanted, atol=0.0065)


@pytest.mark.parametrize(("kind", "quarter"), [("Linear", 0.25), ("Cubic", 0.15625)])
def test_a_curve_is_the_signal_itself(tmp_path: Path, kind: str, quarter: float) -> None:
    """A quarter of the way up, a line has a quarter, and 3 x² - 2 x³ has 5/32."""
    frames = (frame(0, 0.0), frame(40, 0.8), frame(80, 0.0))
    effect, _ = read(tmp_path, document(band("Curve", basis(20, *frames), curve_type=kind)))
    (clip,) = effect.parts
    assert isinstance(clip, Clip)
    assert (clip.begins_s, clip.ends_s) == pytest.approx((0.02, 0.1), abs=1e-3)
    at = np.array([0.010, 0.040, 0.070])
    found = np.interp(at, np.arange(len(clip.samples)) / clip.rate_hz, clip.samples)
    np.testing.assert_allclose(found, [0.8 * quarter, 0.8, 0.8 * quarter], atol=1e-6)


def test_an_effect_of_the_library_plays_where_it_is_named(tmp_path: Path) -> None:
    library = [basis(0, frame(0, 1.0, 150), frame(100, 1.0), id=7)]
    named = {"effect_type": "Reference", "id": 7, "position": 300}
    effect, left_out = read(tmp_path, document(band("VectorialWave", named), library=library))
    (tone,) = effect.parts
    assert isinstance(tone, Tone)
    assert (tone.begins_s, tone.ends_s) == pytest.approx((0.3, 0.4))
    assert left_out == []


def test_what_has_no_place_here_is_named(tmp_path: Path) -> None:
    content = document(
        band("WaveletWave"),
        band("VectorialWave", basis(0, frame(0, 1.0), frame(50, 1.0), base_signal="Square")),
        band("VectorialWave", {"effect_type": "Composite", "position": 0}),
    )
    second = copy.deepcopy(content["perceptions"][0]["channels"][0])
    content["perceptions"][0]["channels"].append(second)
    content["perceptions"].insert(0, {"perception_modality": "Temperature"})
    effect, left_out = read(tmp_path, content)
    assert len(effect.parts) == 1
    assert left_out == [
        "perceptions[0]: Temperature",
        "perceptions[1].channels[1]: another channel",
        "perceptions[1].channels[0].bands[0]: WaveletWave",
        "perceptions[1].channels[0].bands[1].effects[0]: Square, played as a sine",
        "perceptions[1].channels[0].bands[2].effects[0]: Composite",
    ]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"timescale": 0, "perceptions": []}, "timescale: expected a number from 1 to 1e+06"),
        ({"perceptions": []}, "perceptions: expected a perception that is vibrotactile"),
        ({}, "perceptions is required"),
        (
            document(band("VectorialWave", basis(0, frame(9, 1.0), frame(3, 0.0)))),
            "keyframes[1].relative_position: expected a number from 9",
        ),
        (
            document(band("VectorialWave", basis(0, frame(0, 1.5)))),
            "keyframes[0].amplitude_modulation: expected a number from -1 to 1",
        ),
        (
            document(band("VectorialWave", {"effect_type": "Reference", "id": 3, "position": 0})),
            "effects[0].id: expected the id of an effect in the perception's effect_library",
        ),
        (
            document(band("VectorialWave", basis(0, frame(0, 1.0)), upper_frequency_limit=3)),
            "bands[0].upper_frequency_limit: expected a number from 65",
        ),
    ],
)
def test_a_file_that_breaks_a_rule_is_refused_by_place(
    tmp_path: Path, content: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError) as raised:
        read(tmp_path, content)
    assert said in str(raised.value)
