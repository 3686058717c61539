"""What commands print for people: words and units, and nothing that only Python says."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from chladni.design.evaluate import Evaluation
from chladni.design.front import Entry
from chladni.design.spec import spec_of
from chladni.drives.scoring.kept_focus import KeptFocus
from chladni.drives.scoring.spread import Spread
from chladni.host.cli.common.output import answer, by_name
from chladni.host.cli.common.verdicts import of_board, of_built, of_places
from chladni.host.cli.designing.answers import _unfelt, about_entry, median, of_design
from chladni.host.cli.designing.remarks import say_next
from chladni.host.device.checks.info_rows import finger_rows
from chladni.sim.board.file import load_board
from conftest import CommandLine
from made_specs import small

PYTHON = re.compile(r"None|True|False|[{}]|\(-?\d[\d.]*, |'[a-z_]+'|\w+_\w+|nan|np\.")
"""What has no business in a table: Python's own words, dicts, tuples, keys."""


@pytest.mark.parametrize(
    "command",
    [
        ("board", "show", "strip5"),
        ("board", "parts", "strip5"),
        ("board", "score", "strip5", "--samples", "1", "--pitch", "20"),
        ("solve", "prototype", "--target", "20,30"),
        ("solve", "strip5", "--target", "0,6", "--objective", "focus"),
        ("modes", "strip5", "--count", "3"),
        ("sweep", "prototype"),
        ("table", "show", "TABLE", "--at", "10,25"),
        ("table", "diff", "TABLE", "TABLE"),
        ("table", "verify", "TABLE"),
        ("emulate", "TABLE", "--touch", "0,6@20", "--touch", "0,7@30", "--ms", "100", "-o", "OUT"),
        ("device", "info", "--emulator"),
        ("device", "self-test", "--emulator"),
        ("--version",),
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_tables_speak_no_python(
    chladni: CommandLine, table_file: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    names = {"TABLE": str(table_file), "OUT": str(tmp_path / "r.npz")}
    done = chladni(*(names.get(word, word) for word in command))
    assert done.code == 0, done.err
    text = done.out.replace(str(table_file), "").replace(str(tmp_path / "r.npz"), "")
    # Titles and paths are names that were given.
    rows = [row for row in text.splitlines() if row.startswith("│") and "path" not in row]
    assert rows
    found = [PYTHON.findall(row) for row in rows]
    assert not any(found), [one for one in found if one]


def shown(capsys: pytest.CaptureFixture[str], **result: object) -> list[str]:
    answer(dict(result), as_json=False)
    lines = capsys.readouterr().out.splitlines()
    return [" ".join(row.strip("│ ").split()) for row in lines if row.startswith("│")]


def test_values_have_units_and_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, focal_error_mm=27.3) == ["distance from finger to maximum │ 27.3 mm"]
    assert shown(capsys, tolerance_met=True) == ["fields within the tolerance │ yes"]
    assert shown(capsys, size_mm=[14.0, 60.0]) == ["size │ 14, 60 mm"]
    assert shown(capsys, drive=[{"actuator": "a", "gain": 1.0, "phase_deg": 3.25}]) == [
        "drive · a │ gain 1, phase 3.25°"
    ]
    assert shown(capsys, ramp_ms={"median": 1.0, "p10": 0.5, "p90": 2.0}) == [
        "ramp │ 1 ms, from 0.5 to 2 in the middle 80 %"
    ]
    assert shown(capsys, level_db={"median": -1.933e-5, "p10": -0.0002, "p90": 12.3456}) == [
        "level │ 0 dB, from 0 to 12.35 in the middle 80 %"
    ]
    assert shown(capsys, header={"mirror_x": [[0, 1], [1, 0]]}) == [
        "header · mirror x │ 0, 1; 1, 0"
    ]
    assert shown(capsys, faults=[], remark=None, details={"a": 1.0}) == ["faults │ none"]


def test_names_of_settings_stay_what_is_typed(capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, report_ms="10") == ["report ms │ 10"]


def test_a_dumb_terminal_gets_no_frames(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    framed = chladni("board", "show", "strip5").out
    assert "│" in framed
    monkeypatch.setenv("TERM", "dumb")
    plain = chladni("board", "show", "strip5").out
    assert not any("\u2500" <= letter <= "\u257f" for letter in plain)
    assert "strip5" in plain
    compared = chladni("compare", "paper", "--pitch", "60", "--methods", "nearest").out
    assert not any("\u2500" <= letter <= "\u257f" for letter in compared)


@pytest.mark.parametrize(
    ("place", "is_asked"), [("0.02,0.03", True), ("0,0", False), ("0.3,12", False), ("5,5", False)]
)
def test_a_place_in_metres_is_asked_about(chladni: CommandLine, place: str, is_asked: bool) -> None:
    told = chladni("solve", "paper", "--target", place, "--method", "nearest")
    assert told.code == 0
    assert ("metres? these are millimetres" in told.err) == is_asked


@pytest.mark.parametrize(
    ("db", "words"),
    [(8.94, "at least 8.9 dB below the finger"), (-4.54, "up to 4.5 dB above the finger")],
)
def test_a_design_says_which_finger_gets_more(db: float, words: str) -> None:
    terms = {
        "coils": -5.0,
        "area_cm2": -8.4,
        "mass_g": -3.0,
        "finger_db": 20.0,
        "second_finger_20mm_db": db,
    }
    about = about_entry(Entry({}, Evaluation(1.0, 1.0, None, terms)))
    assert words in " ".join(about)


def test_a_design_for_several_fingers_says_how_clicks_are_told(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found: Any = SimpleNamespace(draws=4, seed=1, front=(), board=load_board("phone5"))
    places = {"coils": 5, "weights": {"fingers_2_db": 1.0}}
    say_next(found, spec_of(small(design=places)), Path("own.toml"))
    said = " ".join(capsys.readouterr().err.split())
    assert "`chladni play click --pairs 20 --emulator --board own.toml` tells what clicks" in said
    assert "These are tones: " in said
    places = {"coils": 5, "weights": {"fingers_click_db": 1.0}}
    say_next(found, spec_of(small(design=places)), Path("own.toml"))
    assert "tones, and clicks as they are reckoned: " in " ".join(capsys.readouterr().err.split())
    found = SimpleNamespace(draws=4, seed=1, front=(), board=load_board("pad16"))
    say_next(found, spec_of(small()), Path("own.toml"))
    said = " ".join(capsys.readouterr().err.split())
    click = "`chladni play click --places 20 --emulator --board own.toml --table T.chl` tells what"
    assert f"These are tones, and a click as it is reckoned: {click} it leaves" in said
    assert "the bias of switches adds to that, by some 6 dB less with ramp_ms = 25" in said
    soft = load_board("pad16")
    soft = replace(soft, electronics=replace(soft.electronics, ramp_ms=25.0))
    found = SimpleNamespace(draws=4, seed=1, front=(1, 2), board=soft)
    say_next(found, spec_of(small()), Path("own.toml"))
    said = " ".join(capsys.readouterr().err.split())
    assert "the bias of switches adds to that." in said
    assert "the 2 boards of the front are written with --front FOLDER" in said


def test_a_design_s_median_has_no_minus_zero() -> None:
    kept = SimpleNamespace(second_finger_20mm_db=SimpleNamespace(median=-0.3), finger_um=None)
    found: Any = SimpleNamespace(full=SimpleNamespace(perturbed=kept, click_20mm_db=None))
    assert median(found) == "The median for one finger is 0 dB 20 mm away."
    found.full.click_20mm_db = SimpleNamespace(median=14.2, p10=-0.2)
    assert median(found).endswith(
        "away; of a click pressed with 1 N it is 14, the worst tenth 0, as drawn."
    )


def test_a_verdict_tells_of_a_click_beside_what_a_tone_leaves() -> None:
    good, bad = Spread(8.4, 6.1, 12.0), Spread(0.3, -3.7, 6.0)
    for tone, click, begins, words in (
        (
            7.0,
            good,
            "It focuses: ",
            "at nine of ten places (of a click pressed with 1 N 6.1 dB less);",
        ),
        (7.0, bad, "It focuses while no finger presses: ", "pressed with 1 N 3.7 dB more);"),
        (1.0, good, "It focuses at some", "at the worst tenth (of a click pressed with 1 N 6.1 dB"),
    ):
        own = Spread(9.0, tone, 12.0)
        score: Any = SimpleNamespace(second_finger_20mm_db=own, finger_um=None)
        score.second_finger_16mm_db = score.second_finger_db = own
        told = of_places(score, frequency_hz=160.0, click=click)
        assert told.startswith(begins)
        assert words in told


@pytest.mark.parametrize(
    ("apart", "words"),
    [
        (72.2, "over 30 dB less"),
        (30.4, "over 30 dB less"),
        (29.6, "30 dB less"),
        (-3.0, "3 dB more"),
    ],
)
def test_a_device_promises_no_more_than_its_table_can_keep(apart: float, words: str) -> None:
    finger = {"finger": 0, "place_mm": (0.0, 20.0), "isolation_db": apart, "level_db": -1.0}
    told = finger_rows([finger], has_bank=False)["finger 0"]
    assert told == f"0, 20 mm, 1 dB below the loudest, the others have {words} of it by the table"


def test_what_stiffer_foam_leaves_of_one_finger_is_told_with_what_it_leaves_of_two() -> None:
    away = ("second_finger_20mm_db", "second_finger_16mm_db", "second_finger_db")
    none = dict.fromkeys((*away, "click_20mm_db", "perturbed", "finger_um", "coil_spacing_mm"))
    kept = KeptFocus(Spread(13.6, 9.9, 19.0), Spread(4.81, 3.0, 6.0))
    score: Any = SimpleNamespace(**none, foam_twice=kept)
    told = of_board(score, None, frequency_hz=160.0)
    assert "says: that leaves 20 mm from one finger 14 and 10 dB and 4.8 µm, until" in told
    score.foam_twice = None
    assert "Foam" not in of_board(score, None, frequency_hz=160.0)


def test_what_is_left_as_built_is_in_the_verdict() -> None:
    """It said that a board focuses which as built gives another finger 2.3 dB more."""
    told = of_built(KeptFocus(Spread(1.0, -2.253, 4.0), Spread(3.0, 1.94, 5.0)))
    assert "all at once" in told
    assert told.endswith("gets 2.3 dB more at the worst tenth, and the finger moves by 1.9 µm.")
    assert of_built(KeptFocus(None, None)) == ""


def test_a_name_that_is_a_key_of_ours_stands_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    rows = [{"name": name, "presses": 3} for name in ("left", "seed")]
    answer(by_name("areas", rows, as_json=False), as_json=False)
    told = capsys.readouterr().out
    assert re.search(r"left · presses +\W 3", told)
    assert re.search(r"seed · presses +\W 3", told)


def test_settings_have_their_own_names(chladni: CommandLine) -> None:
    """The self-test's `supply_ma` is what a channel draws, and the setting is a limit."""
    out = chladni("device", "config", "get", "--emulator").out
    assert re.search(r"supply ma +\W +1000", out)
    assert re.search(r"full current ma +\W +333", out)
    assert "draws" not in out


def test_a_device_s_rows_say_what_they_are(chladni: CommandLine) -> None:
    out = chladni("device", "info", "--emulator").out
    assert "coils draw now" in out
    assert "link protocol" in out
    assert "draws 4" in " ".join(
        chladni("device", "self-test", "--emulator", "--board", "strip5").out.split()
    )


@pytest.mark.parametrize(("um", "is_told"), [(0.3, True), (0.4, False), (None, False)])
def test_a_design_that_no_finger_feels_says_so(um: float | None, is_told: bool) -> None:
    """A resting one feels 0.36 µm at 160 Hz."""
    best = SimpleNamespace(summary={} if um is None else {"fingers_um": um})
    told = _unfelt(SimpleNamespace(best=best, board=load_board("phone5")))  # type: ignore[arg-type]
    assert ("`[design] finger_um = 0.7` asks for more" in told) == is_told
    assert bool(told) == is_told


def test_a_search_says_what_its_board_does_for_several_fingers_and_for_one() -> None:
    found = {"finger_um": None, "second_finger_20mm_db": 17.0}
    assert of_design(found, for_fingers={}).startswith("It focuses: within tolerances another")
    found |= {"second_finger_20mm_db": -1.36, "finger_um": 3.04}
    told = of_design(found, for_fingers={})
    assert told.startswith(
        "It does not focus at its worst places: within tolerances another finger 20 mm"
    )
    assert "1.4 dB more at the worst tenth; fingers notice 2.3 dB. The finger itself m" in told
    told = of_design(found | {"fingers_um": 1.62}, for_fingers={2: 41.2})
    assert "2 fingers 41 dB apart at nine of ten places, at 1.6 µm or more each." in told
    assert "2 fingers 0 dB apart" in of_design(found | {"fingers_um": 1.6}, for_fingers={2: -0.2})
    told = of_design({"second_finger_20mm_db": 0.65}, for_fingers={2: 41.2})
    assert "Of one finger alone another one 20 mm away gets 0.7 dB less there, which is no" in told
    told = of_design({"second_finger_20mm_db": 9.0}, for_fingers={2: 41.2})
    assert told.endswith("another one 20 mm away gets 9.0 dB less there.")
    assert "alone" not in of_design({}, for_fingers={2: 41.2})
