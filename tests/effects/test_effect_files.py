"""Effects from files: what formats say, what is left out, and what is refused by name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from chladni.effects import Click, Clip, Effect, Tone, read_effect, shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.files import WRITERS
from chladni.effects.normalised import from_hz, to_hz
from chladni.sim.errors import InputError

HAPTIC: dict[str, Any] = {
    "version": {"major": 1, "minor": 0, "patch": 0},
    "metadata": {"author": "someone"},
    "signals": {
        "continuous": {
            "envelopes": {
                "amplitude": [
                    {"time": 0.0, "amplitude": 0.2},
                    {
                        "time": 0.1,
                        "amplitude": 0.8,
                        "emphasis": {"amplitude": 1.0, "frequency": 0.5},
                    },
                    {"time": 0.4, "amplitude": 0.0},
                ],
                "frequency": [{"time": 0.0, "frequency": 0.0}, {"time": 0.4, "frequency": 1.0}],
            }
        }
    },
}


def ahap(*entries: dict[str, Any]) -> dict[str, Any]:
    return {"Version": 1.0, "Pattern": list(entries)}


def event(kind: str, at: float, *, lasts: float | None = None, **parameters: float) -> Any:
    rows = [{"ParameterID": k, "ParameterValue": v} for k, v in parameters.items()]
    made = {"EventType": kind, "Time": at, "EventParameters": rows}
    return {"Event": made if lasts is None else made | {"EventDuration": lasts}}


def curve(kind: str, at: float, *points: tuple[float, float]) -> Any:
    rows = [{"Time": t, "ParameterValue": v} for t, v in points]
    return {
        "ParameterCurve": {"ParameterID": kind, "Time": at, "ParameterCurveControlPoints": rows}
    }


def written(folder: Path, name: str, document: object) -> Path:
    path = folder / name
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_a_haptic_file_is_a_tone_and_a_click_at_each_emphasis(tmp_path: Path) -> None:
    read = read_effect(written(tmp_path, "a.haptic", HAPTIC))
    tone, click = read.effect.parts
    assert isinstance(tone, Tone)
    assert (tone.begins_s, tone.ends_s) == (0.0, 0.4)
    at = np.array([0.05, 0.0899, 0.0901, 0.1, 0.1195, 0.1198, 0.25])
    # 10 ms before the click of 1.5 / 155 s and behind it the tone leaves room.
    found = [0.5, 0.739, 0.0, 0.0, 0.0, 0.7472, 0.4]
    assert tone.amplitude.at(at) == pytest.approx(found, abs=1e-3)
    assert tone.frequency_hz.at(np.array([0.0, 0.2, 0.4])) == pytest.approx([80.0, 155.0, 230.0])
    assert click == Click(0.1, 1.0, 155.0)
    assert read.left_out == []


def test_an_emphasis_is_felt_beside_a_loud_signal_and_room_is_made_once(tmp_path: Path) -> None:
    """Of a signal as loud as the emphasis: nothing of it is left within 10 ms of the click."""
    document = json.loads(json.dumps(HAPTIC))
    for point in document["signals"]["continuous"]["envelopes"]["amplitude"]:
        point["amplitude"] = 1.0
    effect = read_effect(written(tmp_path, "a.haptic", document)).effect
    times = np.arange(0.0, 0.4, 1e-4)

    def loud(own: Effect, begins: float, ends: float) -> float:
        wave = np.sum([part.wave(times) for part in own.parts], axis=0)
        return float(np.abs(wave[(times > begins) & (times < ends)]).max())

    assert loud(effect, 0.0902, 0.0999) == loud(effect, 0.1098, 0.1196) == 0.0
    assert loud(effect, 0.1, 0.11) > 0.9
    assert loud(effect, 0.08, 0.09) > 0.9
    assert loud(effect, 0.12, 0.13) > 0.9
    again, _ = WRITERS[".haptic"](effect)
    kept = read_effect(written(tmp_path, "b.haptic", again.decode())).effect
    assert np.abs(kept.samples(SIGNAL_HZ) - effect.samples(SIGNAL_HZ)).max() < 1e-3


def test_times_that_go_back_are_told_in_seconds(tmp_path: Path) -> None:
    document = json.loads(json.dumps(HAPTIC))
    document["signals"]["continuous"]["envelopes"]["amplitude"][1]["time"] = 100.0
    with pytest.raises(InputError, match="expected a number from 100 to 600 s"):
        read_effect(written(tmp_path, "a.haptic", document))


def test_a_haptic_file_without_frequencies_plays_the_middle(tmp_path: Path) -> None:
    document = json.loads(json.dumps(HAPTIC))
    del document["signals"]["continuous"]["envelopes"]["frequency"]
    tone = read_effect(written(tmp_path, "a.haptic", document)).effect.parts[0]
    assert isinstance(tone, Tone)
    assert tone.frequency_hz.at(np.array([0.2])) == pytest.approx([155.0])


def test_curves_of_an_ahap_count_their_times_from_their_own(tmp_path: Path) -> None:
    document = ahap(
        event("HapticContinuous", 0.5, lasts=1.0, HapticIntensity=0.8, HapticSharpness=0.2),
        curve("HapticIntensityControl", 0.5, (0.0, 0.0), (0.5, 1.0)),
        curve("HapticSharpnessControl", 1.0, (0.0, 0.0), (0.5, 0.6)),
    )
    (tone,) = read_effect(written(tmp_path, "a.ahap", document)).effect.parts
    assert isinstance(tone, Tone)
    assert (tone.begins_s, tone.ends_s) == (0.5, 1.5)
    times = np.array([0.5, 0.75, 1.0, 1.4])
    assert tone.amplitude.at(times) == pytest.approx([0.0, 0.4, 0.8, 0.8], abs=1e-9)
    wanted = [to_hz(0.2), to_hz(0.2), to_hz(0.2), to_hz(0.2 + 0.48)]
    assert tone.frequency_hz.at(times) == pytest.approx(wanted)


def test_an_event_s_own_envelope_and_a_parameter(tmp_path: Path) -> None:
    document = ahap(
        event("HapticContinuous", 0.0, lasts=1.0, AttackTime=0.2, ReleaseTime=0.5),
        event("HapticContinuous", 2.0, lasts=1.0, DecayTime=0.4, Sustained=0.0),
        event("HapticTransient", 4.0, HapticIntensity=0.6, HapticSharpness=1.0),
        {
            "Parameter": {
                "ParameterID": "HapticIntensityControl",
                "Time": 3.5,
                "ParameterValue": 0.5,
            }
        },
    )
    first, second, click = read_effect(written(tmp_path, "a.ahap", document)).effect.parts
    assert isinstance(first, Tone)
    assert isinstance(second, Tone)
    assert first.amplitude.at(np.array([0.1, 0.6, 1.25])) == pytest.approx(
        [0.5, 1.0, 0.5], abs=0.01
    )
    assert second.amplitude.at(np.array([2.0, 2.2, 2.5])) == pytest.approx(
        [1.0, 0.5, 0.0], abs=0.01
    )
    assert click == Click(4.0, 0.3, 230.0)


def test_what_a_device_cannot_do_is_named(tmp_path: Path) -> None:
    document = ahap(
        event("HapticTransient", 0.0, HapticSharpnes=0.5, AttackTime=0.0),
        event("AudioCustom", 0.0, AudioVolume=0.5),
        curve("AudioVolumeControl", 0.0, (0.0, 1.0)),
    )
    read = read_effect(written(tmp_path, "a.ahap", document))
    assert read.left_out == [
        "Pattern[2].ParameterCurve: AudioVolumeControl",
        "Pattern[0].Event.EventParameters[0]: HapticSharpnes",
        "Pattern[1].Event: AudioCustom",
    ]


@pytest.mark.parametrize("kind", [np.int16, np.uint8, np.float32, np.int32])
def test_a_recording_has_the_same_shape_whatever_its_numbers(tmp_path: Path, kind: type) -> None:
    wave = 0.9 * np.sin(2.0 * np.pi * 100.0 * np.arange(8000) / 8000.0)
    full = 1.0 if kind is np.float32 else float(np.iinfo(kind).max)
    own = wave * 127.0 + 128.0 if kind is np.uint8 else wave * full
    wavfile.write(tmp_path / "a.wav", 8000, own.astype(kind))
    (clip,) = read_effect(tmp_path / "a.wav").effect.parts
    assert isinstance(clip, Clip)
    t = np.arange(len(clip.samples)) / clip.rate_hz
    inside = (t > 0.05) & (t < 0.95)
    assert clip.samples[inside] == pytest.approx(
        0.9 * np.sin(2.0 * np.pi * 100.0 * t[inside]), abs=0.02
    )


def test_two_channels_become_one_and_that_is_said(tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 2000, np.tile(np.array([[8000, 16000]], np.int16), (100, 1)))
    read = read_effect(tmp_path / "a.wav")
    (clip,) = read.effect.parts
    assert isinstance(clip, Clip)
    assert clip.samples == pytest.approx(12000.0 / 32767.0)
    assert read.left_out == ["differences between 2 channels"]


def test_a_toml_file_says_all_that_an_effect_can(tmp_path: Path) -> None:
    text = """
    name = "two"
    [[tone]]
    at_ms = 10
    lasts_ms = 100
    amplitude = [[0, 0.0], [50, 1.0]]
    frequency_hz = 120
    [[click]]
    at_ms = 200
    [[noise]]
    lasts_ms = 50
    amplitude = 0.3
    """
    effect = read_effect(written(tmp_path, "a.toml", text)).effect
    tone, click, noise = effect.parts
    assert isinstance(tone, Tone)
    assert tone.amplitude.at(np.array([0.01, 0.035, 0.1])) == pytest.approx([0.0, 0.5, 1.0])
    assert click == Click(0.2, 1.0, 160.0)
    assert (effect.name, noise.ends_s) == ("two", 0.05)


@pytest.mark.parametrize("ending", sorted(WRITERS))
@pytest.mark.parametrize("name", ["click", "double-click", "pulse", "sweep"])
def test_what_is_written_is_read_as_the_same_effect(tmp_path: Path, ending: str, name: str) -> None:
    effect = shipped_effects()[name]
    """A sound has samples of its own, which are read at 4 kHz."""
    data, left_out = WRITERS[ending](effect)
    path = tmp_path / f"a{ending}"
    path.write_bytes(data)
    again = read_effect(path).effect
    own, read = (one.samples(SIGNAL_HZ) for one in (effect, again))
    assert left_out == []
    within = 0.02 if ending == ".wav" else 1e-6
    assert read[: len(own)] == pytest.approx(own[: len(read)], abs=within)


def test_what_a_format_cannot_say_is_named(tmp_path: Path) -> None:
    low = Effect("low", (Click(0.0, 1.0, 40.0), *shipped_effects()["texture"].parts))
    for ending in (".ahap", ".haptic"):
        left_out = WRITERS[ending](low)[1]
        assert left_out == ["40 to 40 Hz, beyond 80 to 230", "noise at 0 s"]
    assert from_hz(40.0) == 0.0


def change(document: dict[str, Any], work: Callable[[Any], object]) -> dict[str, Any]:
    copy: dict[str, Any] = json.loads(json.dumps(document))
    work(copy["signals"]["continuous"]["envelopes"])
    return copy


@pytest.mark.parametrize(
    ("document", "said"),
    [
        ("{", "line 1: expected JSON"),
        ([1], "expected a table of keys"),
        ({}, "version is required"),
        (HAPTIC | {"version": {"major": 2}}, "version.major: expected 1"),
        (
            change(HAPTIC, lambda own: own["amplitude"][2].update(time=0.05)),
            r"amplitude\[2\].time: expected a number from 0.1",
        ),
        (
            change(HAPTIC, lambda own: own["amplitude"][0].update(amplitude=1.5)),
            r"amplitude\[0\].amplitude: expected a number from 0 to 1, got 1.5",
        ),
        (
            change(HAPTIC, lambda own: own["amplitude"][1]["emphasis"].pop("frequency")),
            r"emphasis.frequency is required",
        ),
        (change(HAPTIC, lambda own: own["amplitude"].clear()), "one breakpoint or more"),
        (
            change(
                HAPTIC, lambda own: own["amplitude"].extend([{"time": 9, "amplitude": 0}] * 10_000)
            ),
            "10,000 breakpoints at most",
        ),
    ],
)
def test_a_haptic_file_that_breaks_a_rule_is_refused_by_place(
    tmp_path: Path, document: object, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read_effect(written(tmp_path, "a.haptic", document))


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (ahap(event("HapticContinuous", 0.0)), "EventDuration is required"),
        (
            ahap(event("HapticTransient", -1.0)),
            r"Pattern\[0\].Event.Time: expected a number from 0",
        ),
        (ahap(event("HapticTransient", 0.0, HapticIntensity=7.0)), "ParameterValue: expected"),
        (
            ahap(curve("HapticIntensityControl", 0.0, (1.0, 0.0), (0.5, 0.0))),
            r"ParameterCurveControlPoints\[1\].Time: expected",
        ),
        (ahap(curve("HapticIntensityControl", 0.0)), "one point or more"),
        ({"Version": 1.0}, "Pattern is required"),
    ],
)
def test_an_ahap_that_breaks_a_rule_is_refused_by_place(
    tmp_path: Path, document: object, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read_effect(written(tmp_path, "a.ahap", document))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = ", "a.toml, effect: expected TOML"),
        ("[[tune]]", "tune: expected one of name, loop_ms, tone"),
        ("[[click]]\npitch = 1", r"click\[0\].pitch: expected one of amplitude"),
        ("[[click]]\nfrequency_hz = 0", "frequency_hz: expected a number from 1 to 1000, got 0"),
        ("[[click]]\nfrequency_hz = 20000", "got 20000"),
        ("[[tone]]\namplitude = 1", r"tone\[0\].lasts_ms is required"),
        ("[[tone]]\nlasts_ms = 9\namplitude = [[5, 1], [1, 1]]", r"amplitude\[1\]\[0\]: expected"),
        ("[[tone]]\nlasts_ms = 9\namplitude = []", "one point or more"),
        ("[[tone]]\nlasts_ms = 9\namplitude = [[1]]", r"\[milliseconds, value\]"),
    ],
)
def test_a_toml_file_that_breaks_a_rule_is_refused_by_place(
    tmp_path: Path, text: str, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        read_effect(written(tmp_path, "a.toml", text))


def test_an_effect_that_is_none_and_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"effect: expected click, .* or a file that ends in"):
        read_effect("nothing")
    with pytest.raises(InputError, match="a readable file"):
        read_effect(tmp_path / "no.haptic")
    # Two gigabytes of silence are not read.
    large = tmp_path / "large.wav"
    with large.open("wb") as file:
        file.truncate(2 << 30)
    with pytest.raises(InputError, match="at most 67,108,864 bytes"):
        read_effect(large)


def test_a_sound_without_samples_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "empty.wav"
    wavfile.write(path, 8000, np.zeros(0, dtype=np.int16))
    with pytest.raises(InputError, match="expected a sound, got 'no samples'"):
        read_effect(path)
