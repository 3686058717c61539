"""Effect files that are damaged, and the commands that read whole ones."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.io import wavfile

from chladni.effects import read_effect, shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.files import READERS
from chladni.sim.errors import FaultsError, InputError
from conftest import CommandLine
from effects.test_effect_files import HAPTIC, ahap, curve, event, written
from effects.test_hjif import ALL


def small_wav() -> bytes:
    file = io.BytesIO()
    wavfile.write(file, 2000, np.arange(-50, 50, dtype=np.int16) * 300)
    return file.getvalue()


GOOD = {
    ".haptic": json.dumps(HAPTIC).encode(),
    ".ahap": json.dumps(
        ahap(
            event("HapticContinuous", 0.0, lasts=0.2, HapticIntensity=0.8),
            curve("HapticIntensityControl", 0.0, (0.0, 0.0), (0.1, 1.0)),
        )
    ).encode(),
    ".hjif": json.dumps(ALL).encode(),
    ".wav": small_wav(),
    ".toml": b"[[tone]]\nlasts_ms = 9\namplitude = [[0, 1], [5, 0.5]]\nfrequency_hz = 100\n",
}


@settings(
    max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_mangled_files_are_effects_or_are_refused(tmp_path: Path, data: st.DataObject) -> None:
    """Cut, and with bytes changed: never anything but samples within bounds, or an error."""
    ending = data.draw(st.sampled_from(sorted(READERS)))
    good = bytearray(GOOD[ending])
    for _ in range(data.draw(st.integers(0, 3))):
        good[data.draw(st.integers(0, len(good) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"mangled{ending}"
    path.write_bytes(bytes(good[: data.draw(st.integers(0, len(good)))]))
    try:
        samples = read_effect(path).effect.samples(SIGNAL_HZ)
    except InputError:
        return
    assert np.abs(samples).max() <= 1.0


def test_commands_list_show_and_convert(chladni: CommandLine, tmp_path: Path) -> None:
    listed = chladni("effects", "list", "--json").json["effects"]
    assert [one["name"] for one in listed] == list(shipped_effects())
    path, figure = written(tmp_path, "a.haptic", HAPTIC), tmp_path / "a.png"
    shown = chladni("effects", "show", path, "--figure", figure, "--json").json
    assert (shown["parts"], shown["left_out"]) == (["1 tone", "1 click"], [])
    assert shown["lasts_ms"] == pytest.approx(400.0)
    assert figure.stat().st_size > 5_000
    made = chladni("effects", "convert", path, "-o", tmp_path / "b.ahap", "--json").json
    assert made["bytes"] == (tmp_path / "b.ahap").stat().st_size
    refused = chladni("effects", "convert", path, "-o", tmp_path / "b.mp3")
    assert (refused.code, "ends in .ahap or .haptic" in refused.err) == (2, True)
    assert not (tmp_path / "b.mp3").exists()
    slow = json.loads(json.dumps(HAPTIC).replace('"time": 0.4', '"time": 300'))
    asked = chladni("effects", "show", written(tmp_path, "ms.haptic", slow)).err
    assert "it lasts 300 s: .haptic and AHAP have seconds" in " ".join(asked.split())
    missing = chladni("effects", "show", "no.ahap")
    assert (missing.code, "a readable file" in missing.err) == (2, True)


def test_all_that_is_wrong_with_an_effect_in_toml_is_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    rows = ["name = 3", "loop_ms = 5", "[[click]]", "amplitude = 2.0", "[[tone]]", "lasts_s = 1"]
    rows += ["lasts_ms = 9", "[noise]", "[[tine]]"]
    path.write_text("\n".join(rows), encoding="utf-8")
    with pytest.raises(FaultsError) as caught:
        read_effect(path)
    fields = [error.field for error in caught.value.errors]
    assert fields == ["tine", "name", "loop_ms", "click[0].amplitude", "tone[0].lasts_s", "noise"]
    assert "; tone, perhaps" in str(caught.value)
    assert "; lasts_ms, perhaps" in str(caught.value)
