"""The sentences above a score's numbers: they follow from the numbers, and come first."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from chladni.drives.scoring.board_score import score_board, usual_pitch
from chladni.drives.scoring.remedies import Remedy, tried_remedies
from chladni.drives.scoring.several_fingers.fingers_as_built import on_stiffer_foam
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.drives.scoring.spread import Spread
from chladni.drives.scoring.survey import FocusStatistics
from chladni.drives.scoring.tolerances import with_foam
from chladni.host.cli.common.board_reports import score_rows
from chladni.host.cli.common.output import answer
from chladni.host.cli.common.table_verdicts import of_responses, of_table
from chladni.host.cli.common.verdicts import (
    of_board,
    of_methods,
    of_place,
    of_places,
)
from chladni.host.cli.effects.verdicts import of_effect, of_two_effects
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import SeveralFingers
from chladni.sim.board.writing import board_file
from chladni.tables.several_fingers.build import FrequencyIsolation
from conftest import CommandLine


@pytest.fixture(scope="module")
def strip() -> Board:
    return load_board("strip5")


def spread(median: float, p10: float) -> Spread:
    return Spread(median, p10, 2.0 * median - p10)


def statistics(median: float, p10: float, um: float | None = 36.0) -> FocusStatistics:
    level = spread(median, p10)
    felt = None if um is None else spread(um, um / 2.0)
    return FocusStatistics(1.0, spread(1.0, 0.5), level, level, level, level, felt)


@pytest.mark.parametrize(
    ("median", "p10", "words"),
    [
        (17.4, 14.6, "It focuses: another finger 20 mm away gets at least 14.6 dB less at nine"),
        (2.4, 2.3, "It focuses: another finger 20 mm away gets at least 2.3 dB less at nine"),
        (8.0, -1.5, "It focuses at some places: another finger 20 mm away gets 8.0 dB less at the "
                    "median, and 1.5 dB more at the worst tenth"),
        (0.3, -2.0, "It does not focus: another finger 20 mm away gets 0.3 dB less at the median"),
        (-5.6, -9.0, "It does not focus: another finger 20 mm away gets 5.6 dB more"),
    ],
)  # fmt: skip
def test_a_verdict_is_what_the_second_finger_gets(median: float, p10: float, words: str) -> None:
    told = of_places(statistics(median, p10), frequency_hz=160.0)
    assert told.startswith(words)
    assert "fingers notice 2.3 dB" in told
    off = of_places(statistics(median, p10), frequency_hz=160.0, built=statistics(3.0, 1.5))
    assert off.startswith("It focuses as drawn alone: ") == (p10 >= 2.3)
    assert ("at nine of ten places, and 1.5 dB less within tolerances" in off) == (p10 >= 2.3)
    # 36 µm are a hundred times what is just felt at 160 Hz.
    assert told.endswith("The finger itself moves by 36 µm, 40 dB above what is just felt.")


def test_what_no_finger_feels_is_said() -> None:
    assert "0.2 µm, which is not felt." in of_places(statistics(9.0, 9.0, 0.2), frequency_hz=160.0)
    assert of_places(statistics(9.0, 9.0, None), frequency_hz=160.0).endswith("notice 2.3 dB.")
    assert of_places(statistics(9.0, 9.0), frequency_hz=1000.0).endswith("moves by 36 µm.")


def test_a_small_board_is_judged_by_the_farthest_finger_that_fits() -> None:
    own = replace(statistics(9.0, 8.0), second_finger_20mm_db=None)
    assert "another finger 16 mm away" in of_places(own, frequency_hz=160.0)
    none = replace(own, second_finger_16mm_db=None, second_finger_db=None)
    assert "no room for a second finger" in of_places(none, frequency_hz=160.0)


@pytest.mark.parametrize(
    ("spacing", "tried", "words"),
    [
        (48.0, None, "Instead of coils 48 mm apart take coils about 12 mm apart"),
        (None, None, "Instead of one coil"),
        (90.0, None, "Coils about 12 mm apart would be 89 on this board, and a chip drives 16"),
        (12.0, None, ""),
        (48.0, 5.25, "Tried on it: softer foam leaves another finger 5.2 dB less there."),
        (12.0, 1.5, "Tried on it: softer foam helps most, 1.5 dB less, which does not do."),
        (48.0, -3.0, "No other sheet or foam helps, as tried. Instead of coils 48"),
    ],
)
def test_what_would_help_was_tried(spacing: float | None, tried: float | None, words: str) -> None:
    def told(level: float, *, for_fingers: bool = False, clicks: Spread | None = None) -> str:
        score: Any = SimpleNamespace(
            **vars(statistics(level, level)),
            coil_spacing_mm=spacing,
            room_for=89 if spacing == 90.0 else 12,
            **dict.fromkeys(("click_20mm_db", "foam_twice", "perturbed")),
        )
        two: Any = SimpleNamespace(
            isolation_db=spread(31.0, 12.0),
            click_db=clicks,
            finger_um=spread(5.0, 0.3),
            **dict.fromkeys(("click_um", "perturbed")),
        )
        remedies = [] if tried is None else [Remedy("softer foam", tried), Remedy("none", -9.0)]
        return of_board(score, two, frequency_hz=160.0, for_fingers=for_fingers, tried=remedies)

    assert words in told(0.0)
    assert ("Instead" in told(0.0)) == (spacing not in (12.0, 90.0) and tried != 5.25)
    assert "two pressing fingers 31 dB apart at the median, 12 at the worst tenth" in told(0.0)
    # A board that focuses needs no help, and one for several fingers begins with them.
    assert told(9.0).endswith("12 at the worst tenth, as drawn.")
    assert told(0.0, for_fingers=True) == (
        "It keeps two pressing fingers 31 dB apart at the median, 12 at the worst tenth, as drawn. "
        "Each gets 5 µm of its own, 0.3 at the worst tenth, which a resting finger does not feel."
    )
    assert not words or words not in told(0.0, for_fingers=True)
    assert "12 at the worst tenth (a click, as reckoned, 26 and 4), as" in told(
        0.0, clicks=spread(26.0, 4.0)
    )


@pytest.mark.parametrize(("spacing", "room"), [(28.0, 11), (12.0, 11), (90.0, 89)])
def test_a_board_that_focuses_at_some_places_is_told_of_what_lies_between_coils(
    spacing: float, room: int
) -> None:
    score: Any = SimpleNamespace(
        **vars(statistics(8.0, 0.5)),
        coil_spacing_mm=spacing,
        room_for=room,
        **dict.fromkeys(("click_20mm_db", "foam_twice", "perturbed")),
    )
    told = of_board(score, None, frequency_hz=160.0)
    between = "Coils 28 mm apart leave places between them: about 12 mm apart they would be 11 on"
    assert (between in told) == (spacing == 28.0)
    assert ("between them" in told) == (spacing == 28.0)


def test_what_stiffer_foam_leaves_is_told_with_what_fingers_get(strip: Board) -> None:
    """By the drives of the board as drawn; a board on no foam has none of it."""
    (two,) = score_fingers(strip, (2,), sets=4, samples=2).counts
    foam = on_stiffer_foam(strip, two)
    assert foam is not None
    known, stiff = iter(two.drives), with_foam(strip, 2.0)
    (same,) = score_fingers(stiff, (2,), sets=4, samples=0, solve=lambda _: next(known)).counts
    assert foam.isolation_db.median == pytest.approx(same.isolation_db.median, abs=0.1)
    none = dict.fromkeys(("click_20mm_db", "foam_twice", "perturbed"))
    score: Any = SimpleNamespace(**vars(statistics(9.0, 9.0)), coil_spacing_mm=None, **none)
    told = of_board(score, two, frequency_hz=160.0, foam_twice=foam)
    assert two.perturbed is not None
    off = two.perturbed.isolation_db
    assert f", as drawn, {off.median:.0f} / {off.p10:.0f} dB within tolerances. Foam is" in told
    kept, each = foam.isolation_db, foam.finger_um
    assert each is not None
    assert f"two fingers {kept.median:.0f} and {kept.p10:.0f} dB, and {each.median:.2g} µm" in told
    assert on_stiffer_foam(replace(strip, foundation=None), two) is None


@pytest.mark.parametrize(
    ("lost_db", "with_drives", "bits"),
    [(0.5, False, 12), (1.5, False, 12), (1.5, True, 12), (1.5, True, 8)],
)
def test_a_table_that_loses_a_decibel_names_its_pitch_or_bits(
    lost_db: float, with_drives: bool, bits: int
) -> None:
    exact, kept = spread(31.0, 12.0), spread(31.0, 12.0 - lost_db)
    own: Any = SimpleNamespace(
        frequencies=[FrequencyIsolation(160.0, kept, exact, spread(4.2, 1.3))],
        pitch_mm=(6.0, 6.0),
        bits=bits,
    )
    told = of_responses(own, with_drives=with_drives)
    assert "Each gets 4.2 µm of its own, 1.3 at the worst tenth." in told
    block = "regions" if with_drives else "fingers"
    fine = bits == 12
    assert (f"A smaller [{block}] pitch_mm than 6 loses less" in told) == (lost_db > 1.0 and fine)
    assert ("`--bits 12` loses less" in told) == (not fine)


def test_a_board_is_tried_on_other_sheets_and_foams(strip: Board) -> None:
    """Each as if its file had said so; a board on no foam has no foam to try."""
    steps: list[tuple[int, int]] = []
    found = tried_remedies(strip, progress=lambda *step: steps.append(step))
    assert [len(found), steps[-1]] == [4, (4, 4)]
    assert found == sorted(found, key=lambda one: -one.second_finger_20mm_db)
    known = {one.change: one.second_finger_20mm_db for one in found}
    thin = replace(strip, plate=replace(strip.plate, thickness=0.5 * strip.plate.thickness))
    score = score_board(thin, pitch=2.0 * usual_pitch(thin), samples=0)
    assert score.second_finger_20mm_db is not None
    assert known["a sheet half as thick"] == score.second_finger_20mm_db.median


def test_methods_effects_designs_and_tables_are_summed_up() -> None:
    best = {"method": "phasor", "objective": "focus", "second_finger_db": -1.0}
    assert of_methods([best, best], best) == (
        "Of 2 methods phasor at focus is the one for this board: it does not focus, another finger "
        "12 mm away gets 1.0 dB more at the median; fingers notice 2.3 dB."
    )
    own: Any = SimpleNamespace(
        peak_um=21.0,
        other_peak_um=0.3,
        just_felt_um=0.36,
        isolation_db=36.9,
        second_finger_20mm_db=None,
        envelope_error_db=2.5,
        bias_um=3.0,
    )
    assert of_effect(own) == (
        "The finger gets 21 µm at most, the other 37 dB less, which a resting finger does not feel."
    )
    own.other_peak_um, own.isolation_db = 30.0, -3.0
    assert "3 dB more, which a resting finger feels" in of_effect(own)
    own.other_peak_um = None
    assert of_effect(own) == "The finger gets 21 µm at most."
    own.second_finger_20mm_db = -1.2
    away = ", another 20 mm away or farther, of which the device knows nothing, up to 1 dB more."
    assert of_effect(own).endswith(away)
    own.second_finger_20mm_db, own.envelope_error_db = None, 9.6
    assert of_effect(own).endswith("at most. Its loud and soft parts are off by up to 10 dB.")
    own.bias_um = 11.3
    assert of_effect(own).endswith("bias moves the finger by 11 µm before and after.")
    assert "Its drives are those that focus best" in of_table("focus", 0, 9)
    of_both = of_table("focus", 0, 9, second_finger_db=-0.4, for_fingers=True)
    does_not = "They do not focus: another finger 20 mm away gets 0.4 dB more at the median of 9 "
    assert does_not in of_both
    assert "They are quieter for trying" in of_both
    assert "focus:" not in of_table("focus", 0, 9, second_finger_db=9.0, for_fingers=True)
    alone = of_table("focus", 0, 9, second_finger_db=-0.4)
    assert does_not in alone
    assert "`chladni board score` says what would help; `--for fingers` makes a table" in alone
    assert "focus:" not in of_table("focus", 0, 9, second_finger_db=9.0)
    assert "At 3 of 9 places its maximum" in of_table("ssim", 3, 9)
    assert "best at contrast" in of_table("contrast", 0, 9)


def test_a_finger_that_feels_the_others_effect_more_than_its_own_is_told_of() -> None:
    def told(peaks: tuple[float, float], of_other: tuple[float, float]) -> str:
        played: Any = [
            SimpleNamespace(peak_um=own, other_peak_um=other, just_felt_um=0.36, bias_um=None)
            for own, other in zip(peaks, of_other, strict=True)
        ]
        return of_two_effects(["click", "thud"], played)

    assert told((4.3, 0.52), (2.7, 0.043)) == (
        "A gets 4.3 µm of its click, 40 dB more than it gets of B's thud, which a resting finger "
        "does not feel. B gets 0.52 µm of its thud, and 14 dB more, 2.7 µm, of A's click, which a "
        "resting finger feels: `--level-um 0.52` makes both effects alike."
    )
    # Where both have as much of their own, less helps neither.
    assert "--level-um" not in told((4.3, 4.0), (3.9, 0.04))
    both = told((4.3, 4.0), (3.9, 0.04))
    assert "B gets 4 µm of its thud, 0 dB more than it gets of A's click, which" in both
    assert "finger feels: `--level-um 1`" in told((4.3, 1.0), (0.6, 0.04))


def test_a_place_is_judged_by_its_maximum_too() -> None:
    def told(off: float, db: float, um: float = 36.0, far_db: Any = None, **of: bool) -> str:
        card: Any = SimpleNamespace(
            movable=True,
            focal_error_mm=off,
            second_finger_db=db,
            second_finger_20mm_db=far_db,
            felt=SimpleNamespace(finger_um=um),
        )
        return of_place(card, frequency_hz=160.0, **of)

    assert told(1.5, 3.8).startswith(
        "It focuses: another finger 12 mm away gets 3.8 dB less; the maximum lies 1.5 mm from the "
        "finger; fingers"
    )
    both = told(1, 1.2, 36, 16.0)
    assert both.startswith("It focuses: another finger 20 mm away gets 16.0 dB less, one 12 mm aw")
    assert "away 1.2 dB less; the maximum" in both
    assert "12 mm" not in told(35.0, -3.0, 36.0, -3.0)
    assert told(5.2, 0.2).startswith("It hardly focuses")
    assert told(35.0, 0.3).startswith("It does not focus: another finger 12 mm away gets 0.3 dB l")
    assert "It need not focus: another" in told(35.0, 3.0, for_fingers=True)
    assert told(3.0, -2.0).startswith("It does not focus")
    still: Any = SimpleNamespace(movable=False)
    assert of_place(still, frequency_hz=160.0) == "No drive of these coils moves this place."


def test_people_read_it_first_and_programs_by_its_key(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    asked = ("solve", "strip5", "--target", "0,6")
    first = chladni(*asked).out.splitlines()[0].rstrip()
    assert first.startswith("It focuses: another finger 20 mm away gets")
    assert "the maximum lies 1.5 mm from the finger" in first
    assert chladni(*asked, "--json").json["verdict"] == first
    scored = chladni("board", "score", "strip5", "--pitch", "20", "--no-perturbed")
    assert scored.out.startswith("It focuses: another finger 20 mm away gets at least")
    assert "Foam is often twice as stiff as its data sheet says" in " ".join(scored.out.split())


def test_what_a_board_is_made_for_comes_first(strip: Board) -> None:
    alone = score_board(strip, samples=0, pitch=40e-3)
    one, two = score_fingers(strip, (1, 2), sets=4, samples=0).counts
    assert next(iter(score_rows(strip, alone, one, two))) == "above_second_finger"
    several = replace(strip, focus=None, fingers=SeveralFingers())
    rows = score_rows(several, alone, one, two)
    assert list(rows)[:2] == ["two_fingers", "one_finger"]
    assert rows["one_finger"] == {"finger_um": asdict(one)["finger_um"]}


def test_a_board_for_several_shows_no_focus_unless_it_is_asked_for(
    chladni: CommandLine, strip: Board, tmp_path: Path
) -> None:
    path = tmp_path / "several.toml"
    path.write_bytes(board_file(replace(strip, focus=None, fingers=SeveralFingers())))
    coarse = ("board", "score", path, "--pitch", "40", "--no-perturbed")
    plain, asked = (chladni(*coarse, *more) for more in ((), ("--objective", "focus")))
    assert "--objective focus shows" in plain.err
    for done, is_shown in ((plain, False), (asked, True)):
        assert "two pressing fingers" in done.out
        assert "one pressing finger alone" in done.out
        assert "foam twice as stiff · own signal" in " ".join(done.out.split())
        assert ("fingers 20 mm away" in " ".join(done.out.split())) == is_shown


def test_a_board_for_several_is_scored_by_two_fingers_within_tolerances(
    chladni: CommandLine, strip: Board, tmp_path: Path
) -> None:
    """As `chladni fingers` scores them; one finger's boards are drawn for programs alone."""
    path = tmp_path / "several.toml"
    path.write_bytes(board_file(replace(strip, focus=None, fingers=SeveralFingers())))
    coarse = ("board", "score", path, "--pitch", "40", "--samples", "1")
    told = chladni(*coarse, "--json").json
    wanted = chladni("fingers", path, "--fingers", "2", "--samples", "1", "--json").json
    two = told["two_fingers"]["perturbed"]
    assert two == wanted["counts"][0]["perturbed"]
    assert told["perturbed"]["samples"] == 1
    kept = two["isolation_db"]
    words = f"as drawn, {kept['median']:.0f} / {kept['p10']:.0f} dB (a click, as reckoned, "
    assert words in told["verdict"]


def test_what_rounding_leaves_of_nothing_is_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    answer({"centroid_error_mm": 1.227e-15, "least_mm": 1.2e-9}, as_json=False)
    rows = [" ".join(row.split()) for row in capsys.readouterr().out.splitlines() if "mm" in row]
    assert [row.split(" │ ")[1].strip("│ ") for row in rows] == ["0 mm", "1.2e-09 mm"]
