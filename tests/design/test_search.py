"""A search: what it finds, that it goes on after a stop, and that workers change nothing."""

from __future__ import annotations

import json
import re
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
import tomlkit

from chladni.design.evaluate import (
    COARSE,
    FINGER_SETS,
    Evaluation,
    completed_board,
    evaluate,
    evaluate_in_full,
)
from chladni.design.front import Design, Entry, front_of
from chladni.design.last_boards import boards_more
from chladni.design.layouts.layouts import Layout
from chladni.design.search import design
from chladni.design.spec import spec_of
from chladni.design.variables import filled
from chladni.design.weights import FINGER_LEVEL, OF_FINGERS
from chladni.drives.methods import SEED
from chladni.drives.scoring.board_score import score_board
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.host.cli.designing.answers import extent
from chladni.host.cli.designing.design import written_on_board
from chladni.sim.board.file import load_board
from chladni.sim.fields.board_plate import first_natural_hz
from conftest import CommandLine, made_once
from made_specs import small


def test_of_listed_boards_the_best_is_found() -> None:
    """Where all is lists, every board is looked at: each alone gives the same score."""
    document = small(
        actuators=[
            {"name": "a", "at_mm": [0.0, {"any": [-4.0, -9.0]}]},
            {"name": "b", "at_mm": [0.0, 9.0]},
        ],
        design={"coils": None},
        electronics={"pwm_pins": []},
    )
    spec = spec_of(document)
    found = design(spec, jobs=1, samples=1)
    assert found.evaluations == 2
    alone = [
        evaluate(spec, filled(spec.document, spec.variables, [k]), SEED).robust_score
        for k in (0.0, 1.0)
    ]
    assert found.board.actuators[0].at == ((0.0, -4e-3), (0.0, -9e-3))[alone[1] > alone[0]]


def test_a_coil_at_the_very_limit_begins_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its share is 1 but for the last bit, and the library refused what is above its bound."""
    monkeypatch.setattr(
        Layout, "shares", lambda own, *_: [float(np.nextafter(1.0, 2.0))] * own.unknowns
    )
    found = design(spec_of(small(design={"evaluations": 6})), jobs=1, samples=1)
    assert found.evaluations >= 6


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Design, list[float]]:
    """A search in this process, and the scores of boards that were better than all before."""

    def make() -> tuple[Design, list[float]]:
        better: list[float] = []
        found = design(
            spec_of(small()),
            jobs=1,
            samples=1,
            on_board=lambda own, is_best: (
                better.append(own.evaluation.robust_score) if is_best else None
            ),
        )
        return found, better

    return made_once(tmp_path_factory, "design", make)


def test_a_search_beats_its_starts(whole: tuple[Design, list[float]], tmp_path: Path) -> None:
    found, better = whole
    assert len(better) > 1
    assert better == sorted(better)
    # What it says of its board is what `board score` says, whose fields are a little finer.
    score = score_board(found.board, samples=1, pitch=6e-3)
    assert score.perturbed is not None
    wanted = score.perturbed.second_finger_20mm_db
    assert wanted is not None
    assert found.best.evaluation.robust_score == pytest.approx(wanted.p10, abs=0.05)
    # Time may leave the last few less than was asked for.
    written_on_board(tmp_path / "so-far.toml", 1, 32)(found.best, True)
    assert "the last few get up to 32 random boards." in (tmp_path / "so-far.toml").read_text(
        encoding="utf-8"
    )


def test_two_processes_find_the_same(whole: tuple[Design, list[float]]) -> None:
    found = design(spec_of(small()), jobs=2, samples=1)
    assert found.best == whole[0].best
    assert found.evaluations == whole[0].evaluations


def test_a_search_that_was_stopped_goes_on(
    whole: tuple[Design, list[float]], tmp_path: Path
) -> None:
    spec, kept = spec_of(small()), tmp_path / "kept"

    class StopError(Exception):
        pass

    def stop(done: int, of_all: int) -> None:
        assert of_all == 8 + boards_more(spec, 1)
        if done >= 6:
            raise StopError

    with pytest.raises(StopError):
        design(spec, jobs=1, samples=1, partial_file=kept, progress=stop)
    boards = kept.read_text(encoding="utf-8").count('"board ')
    assert 0 < boards < whole[0].evaluations
    again = design(spec, jobs=1, samples=1, partial_file=kept)
    assert again.best == whole[0].best
    assert again.evaluations == whole[0].evaluations


def test_more_boards_go_on_from_fewer_and_time_ends_a_search(
    whole: tuple[Design, list[float]], tmp_path: Path
) -> None:
    """No time is left for more than the layouts that a search begins with; then for all."""
    kept = tmp_path / "kept"
    few = spec_of(small(design={"evaluations": 7}))
    steps: list[tuple[int, int]] = []
    last: list[tuple[int, int, float]] = []
    found = design(
        few,
        jobs=1,
        samples=1,
        minutes=0.0,
        partial_file=kept,
        progress=lambda *step: steps.append(step),
        on_last=lambda *told: last.append(told),
    )
    assert found.evaluations < 7
    # The last few boards, which are scored again, are told too, before they begin and after each.
    assert steps[-1][0] == steps[-1][1] == found.evaluations + boards_more(few, 1)
    ((count, draws, seconds),) = last
    assert count >= len(found.front)
    assert draws == found.draws == 1
    said = extent(found, few, 32, 0.0, kept)
    assert said.startswith(f"Time was up after {found.evaluations} of 7 boards")
    assert f"The same command goes on from {kept}" in said
    assert "1 random boards each in place of 32" in said
    assert not extent(found, few, 1, None, kept)
    assert 0.0 < seconds < found.seconds
    boards = kept.read_text(encoding="utf-8").count('"board ')
    more = design(spec_of(small()), jobs=1, samples=1, partial_file=kept)
    assert more.best == whole[0].best
    assert kept.read_text(encoding="utf-8").count('"board ') == more.evaluations > boards
    # What is kept costs no time.
    ended = design(spec_of(small()), jobs=1, samples=1, minutes=0.0, partial_file=kept)
    assert (ended.evaluations, ended.best) == (more.evaluations, more.best)


def test_what_finger_um_took_off_a_score_is_told(tmp_path: Path, chladni: CommandLine) -> None:
    spec, out = tmp_path / "s.toml", tmp_path / "own.toml"
    coil = {
        "actuators": [{"name": "a", "at_mm": [0.0, {"any": [0.0]}]}],
        "design": {"coils": None, "finger_um": 500.0},
        "magnet": {"radius_mm": 3.0, "height_mm": 4.0, "remanence_t": 1.28},
        "winding": {"turns": 300, "wire_mm": 0.1, "inner_mm": 3.0, "outer_mm": 8.0}
        | {"height_mm": 1.5, "gap_mm": 1.0},
        "electronics": {"pwm_pins": []},
        "fingers": {},
        "foundation": {"stiffness_n_per_mm3": 0.0005},
    }
    spec.write_text(tomlkit.dumps(small(**coil)), encoding="utf-8")
    done = chladni("design", spec, "-o", out, "--samples", "1", "--jobs", "1", "--json")
    assert done.code == 0
    assert "takes as long as some 8 more" in done.err
    assert "to compare the last board, with 1" in done.err
    um = done.json["front"][0]["finger_um"]
    lost = 60.0 * np.log10(500.0 / um)
    assert f"took {lost:.1f} dB off the score" in done.json["verdict"]
    assert f"took {lost:.1f} dB off" in out.read_text(encoding="utf-8")
    assert "The median for one finger is" in done.json["verdict"]
    first = f"This plate's first natural frequency is {first_natural_hz(load_board(out)):.3g} Hz: "
    assert first in done.json["verdict"]
    assert "`[design] first_natural_hz = 250` asks for that" in done.json["verdict"]
    assert done.json["foam"] == "0.0005 N/mm³"
    assert done.json["front"][0]["foam"] == "0.0005 N/mm³"
    assert "first_natural_hz" not in done.json["front"][0]  # it is for one finger


def test_a_score_as_drawn_has_no_tolerances_in_it() -> None:
    spec = spec_of(small(design={"weights": {"fingers_2_db": 1.0}}, finger="none"))
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, -9.0]}, {"name": "b", "at_mm": [0.0, 9.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2, 4]},
    }
    found = evaluate(spec, document, SEED)
    board = completed_board(document, COARSE)
    (two,) = score_fingers(board, [2], sets=FINGER_SETS, samples=1, seed=SEED).counts
    assert found.score == pytest.approx(two.isolation_db.p10, abs=1e-9)
    assert found.robust_score == found.terms["fingers_2_db"] != found.score


def test_a_finished_design_tells_what_fingers_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many sets, whatever the number of random boards."""
    monkeypatch.setattr("chladni.design.evaluate.SETS", 20)
    spec = spec_of(small(design={"weights": {"fingers_2_db": 1.0}}, finger="none"))
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, -9.0]}, {"name": "b", "at_mm": [0.0, 9.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2, 4]},
    }
    found, _ = evaluate_in_full(spec, SEED, 1, document)
    board = completed_board(document)
    (two,) = score_fingers(board, [2], sets=20, samples=1, seed=SEED).counts
    assert two.perturbed is not None
    assert found.robust_score == pytest.approx(two.perturbed.isolation_db.p10, abs=1e-9)


def test_a_search_of_few_choices_goes_on(tmp_path: Path) -> None:
    """Four draws of two thicknesses: a checkpoint that had one of them twice could not be read."""
    plate = {"thickness_mm": {"any": [0.2, 0.4]}}
    spec, kept = spec_of(small(design={"evaluations": 40}, plate=plate)), tmp_path / "kept"

    class StopError(Exception):
        pass

    def stop(done: int, _: int) -> None:
        if done > 1:
            raise StopError

    for _ in range(2):
        with pytest.raises(StopError):
            design(spec, jobs=1, samples=1, partial_file=kept, progress=stop)
        assert kept.read_text(encoding="utf-8").count('"layouts ') == 2


def test_time_ends_layouts_and_the_search_goes_on_from_those_it_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two plates' layouts time has room for the first one, whose board is scored at once."""
    plate = {"thickness_mm": {"any": [0.2, 0.3, 0.4, 0.5]}}
    spec, kept = spec_of(small(design={"evaluations": 20}, plate=plate)), tmp_path / "kept"
    monkeypatch.setattr("chladni.design.search.AT_THE_START", 0.0)
    first = design(spec, jobs=1, samples=1, minutes=1.0, partial_file=kept)
    begun = re.findall(r'"name": "(\w+)', kept.read_text(encoding="utf-8"))
    assert begun[:3] == ["layouts", "board", "starts"]
    assert begun.count("layouts") == 1
    monkeypatch.undo()
    # It goes on from those layouts: with more of them it would begin elsewhere.
    again = design(spec, jobs=1, samples=1, minutes=1.0, partial_file=kept)
    assert (again.evaluations, again.best) == (first.evaluations, first.best)
    assert kept.read_text(encoding="utf-8").count('"layouts ') == 1


def entry(second: float, um_db: float, coils: int) -> Entry:
    terms = {
        "second_finger_20mm_db": second,
        "finger_db": um_db,
        "coils": -float(coils),
        "area_cm2": -8.0,
        "mass_g": -3.0,
    }
    return Entry({"second": second}, Evaluation(second, second, None, terms))


def test_the_front_has_what_nothing_else_matches() -> None:
    best, louder, fewer = entry(15.0, 20.0, 5), entry(12.0, 26.0, 5), entry(11.0, 20.0, 4)
    matched, hardly = entry(11.0, 19.0, 5), entry(15.1, 20.1, 5)
    assert front_of([matched, best, fewer, louder]) == (best, louder, fewer)
    # A tenth of a decibel is no reason to build two boards.
    assert front_of([best, hardly]) == (hardly,)


def test_where_several_fingers_are_weighed_one_alone_is_no_goal() -> None:
    def of_several(own: Entry, apart: float, um_db: float) -> Entry:
        terms = {**own.evaluation.terms} | dict.fromkeys(OF_FINGERS, -300.0)
        terms |= {"fingers_2_db": apart, FINGER_LEVEL: um_db}
        return Entry(own.document, Evaluation(apart, apart, None, terms))

    apart, louder = (
        of_several(entry(3.0, 1.0, 5), 28.8, 3.5),
        of_several(entry(3.0, 1.0, 5), 26, 11),
    )
    worse = of_several(entry(15.0, 26.0, 5), 26.0, 3.0)  # which only one finger alone would miss
    assert front_of([worse, louder, apart]) == (apart, louder)


def test_the_command_writes_a_board_that_scores_as_said(
    tmp_path: Path, chladni: CommandLine
) -> None:
    spec, out, front = tmp_path / "s.toml", tmp_path / "own.toml", tmp_path / "front"
    coils = {"coils": {"from": 1, "to": 2}, "evaluations": 4}
    spec.write_text(tomlkit.dumps(small(design=coils)), encoding="utf-8")
    done = chladni(
        "design",
        spec,
        "-o",
        out,
        "--samples",
        "1",
        "--jobs",
        "1",
        "--front",
        front,
        "--figure",
        tmp_path / "f.png",
        "--json",
    )
    assert done.code == 0
    assert done.json.keys() >= {"score", "robust_score", "evaluations", "seconds", "front", "sheet"}
    board = load_board(out)
    assert [list(one["at_mm"]) for one in done.json["actuators"]] == [
        pytest.approx([1e3 * along for along in actuator.at]) for actuator in board.actuators
    ]
    for one in done.json["front"]:
        assert len(load_board(one["path"]).actuators) == one["coils"]
    assert (tmp_path / "f.png").stat().st_size > 10_000
    assert not list(tmp_path.glob("*.partial"))
    assert tomllib.loads(out.read_text(encoding="utf-8"))["name"] == "small"
    assert json.loads(done.out)["seed"] == SEED


def test_a_search_with_lists_says_nothing_of_the_boards_it_left_out() -> None:
    """The library warns of draws that are never told, and shows every number of them."""
    document = small(
        plate={"thickness_mm": {"any": [0.2, 0.25, 0.3]}},
        actuators=[
            {"name": "a", "at_mm": [0.0, -9.0]},
            {"name": "b", "at_mm": [0.0, {"from": 5.0, "to": 9.0}]},
        ],
        design={"coils": None},
        electronics={"pwm_pins": []},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = design(spec_of(document), jobs=1, samples=1)
    assert found.evaluations > 1
