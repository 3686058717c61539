"""The end of a search: how long it takes, and what is left out where time is short."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from chladni.design.evaluate import Evaluation, completed_board, document_of, judged
from chladni.design.front import Design, Entry
from chladni.design.last_boards import boards_in, boards_more, compared, draws_in, expected_s
from chladni.design.search import design
from chladni.design.spec import spec_of
from chladni.drives.methods import SEED
from chladni.drives.workers import Workers
from chladni.host.cli.designing.answers import extent, parts_told
from chladni.host.cli.designing.design import written_on_board
from chladni.sim.fields.board_plate import first_natural_hz
from made_specs import small


def test_time_to_compare_the_last_boards_is_kept_back() -> None:
    """Eight times the draws take eight times as long, and two processes half of it."""
    spec = spec_of(small(design={"samples": 4}))
    assert boards_more(spec, 32) == 32
    assert expected_s(spec, 32, 4, [2.0, 3.0, 30.0], 2) == pytest.approx(3.0 * 8.0 * 2.0)
    # With no more draws than in the search a board of the end takes two of them.
    assert expected_s(spec, 1, 3, [2.0], 1) == pytest.approx(12.0)
    # Of several fingers the end has fewer sets for each draw.
    several = spec_of(small(design={"samples": 4, "weights": {"fingers_2_db": 1.0}}))
    assert expected_s(several, 32, 2, [2.0], 2) == pytest.approx(2.0 * 4.0)
    assert draws_in(2.0 * 4.0, several, 40, 2, [2.0], 2) == 32


def test_short_of_time_the_last_boards_get_fewer_draws() -> None:
    """Four boards with four draws each take 24 s here: 30 s are enough for eight."""
    spec = spec_of(small(design={"samples": 4}))
    for left_s, draws in ((30.0, 8), (1000.0, 32), (0.0, 4), (-5.0, 4)):
        assert draws_in(left_s, spec, 32, 4, [3.0], 1) == draws
    assert draws_in(0.0, spec, 1, 4, [3.0], 1) == 1


def test_time_ends_the_comparison_of_the_last_boards() -> None:
    """The best one is scored in full, however late it is."""
    spec, steps = spec_of(small(design={"coils": 1})), []
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, 0.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2]},
    }
    entries = [Entry(document, Evaluation(own, own, None, {})) for own in (2.0, 1.0)]
    with Workers(1) as workers:
        late = compared(spec, SEED, 1, workers, entries, 8, 0.0, lambda *own: steps.append(own))
    ((best, full),) = late
    assert best.document is document
    assert full is not None
    assert full.second_finger_20mm_db is not None
    assert steps == [(8 + boards_more(spec, 1),) * 2]
    found = Design(best, full, 8, (best,), 1.0, SEED, 1, left_out=1)
    told = extent(found, spec, 1, None, Path("kept"))
    assert told == "Time was up before 1 of the last few was compared."


def test_a_search_looks_at_what_its_time_has_room_for() -> None:
    """Of a round that does not fit, too, it looks at as many boards as do."""
    assert boards_in(10.0, [3.0, 3.0, 4.0], 2) == 6
    assert boards_in(-1.0, [3.0], 2) == 0
    assert boards_in(float("inf"), [3.0], 2) is None


@pytest.mark.parametrize("is_range", [False, True])
def test_time_ends_the_first_boards_of_given_places_and_the_pace_is_told(
    monkeypatch: pytest.MonkeyPatch, is_range: bool
) -> None:
    """Each board takes 60 s of a clock that jumps when it is read: four minutes have room for two.

    Of lists alone, which are all looked at, and of a range, of which the first few begin a search.
    """
    values = {"from": 0.01, "to": 0.06} if is_range else {"any": [0.01, 0.02, 0.03, 0.04]}
    document = small(
        foundation={"stiffness_n_per_mm3": values},
        actuators=[{"name": "a", "at_mm": [0.0, -9.0]}, {"name": "b", "at_mm": [0.0, 9.0]}],
        design={"coils": None, "evaluations": 60},
        electronics={"pwm_pins": []},
    )
    now, told, steps = [0.0], list[tuple[int, float]](), list[tuple[int, int]]()

    def one_minute_more(*own: Any) -> dict[str, Any]:
        now[0] += 60.0
        return judged(*own) | {"seconds": 60.0}

    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    monkeypatch.setattr("chladni.design.search.judged", one_minute_more)
    spec = spec_of(document)
    found = design(
        spec,
        jobs=1,
        samples=1,
        minutes=4.0,
        progress=lambda *step: steps.append(step),
        on_pace=lambda *own: told.append(own),
    )
    assert found.evaluations == 2  # two fifths of the time are the end's
    assert told == [(2, 60.0)]
    assert steps[0] == (1, 2 + 1)  # and the end is as long as one more
    most = 60 if is_range else 4
    said = extent(found, spec, 1, 4.0, Path("kept"))
    assert f"after 2 of {most} boards" in said
    if is_range:
        assert "never tried" not in said
        return
    key = "foundation.stiffness_n_per_mm3"
    (left,) = (found.never_tried[key],)
    assert len(left) == 2
    assert said.endswith(f"It never tried {key} {left[0]:g}, {left[1]:g}.")
    assert found.board.foundation is not None
    assert found.board.foundation.total_stiffness * 1e-9 not in left


def test_an_answer_stays_until_the_next_one_is_complete(tmp_path: Path) -> None:
    """A search that was begun again and stopped left its first boards in place of the answer."""
    spec, output = spec_of(small(design={"coils": 1})), tmp_path / "own.toml"
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, 0.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2]},
    }
    entry = Entry(document, Evaluation(**judged(spec, SEED, ("one", document))["evaluation"]))
    written_on_board(output, 4, 8)(entry, True)
    assert output.read_text("utf-8").startswith("# The best board so far")
    answer = "# Answers own-spec.toml: the best of 8 boards, seed 1.\n"
    output.write_text(answer, encoding="utf-8")
    written_on_board(output, 4, 8)(entry, True)
    assert output.read_text("utf-8") == answer


def test_boards_of_a_front_tell_what_they_are_made_of() -> None:
    """Two of a front read alike, and stood on other feet; and a mode decides what clicks keep."""
    feet = [{"at_mm": [x, y], "part": "rubber-foot-6x6"} for x in (-3, 3) for y in (-13, 13)]
    spec = small(springs=feet, design={"weights": {"fingers_2_db": 1.0}})
    del spec["foundation"]
    board = completed_board(
        document_of(spec_of(spec), [], [(0.0, -5.0), (0.0, 5.0)]),
    )
    told = parts_told(board)
    assert told["feet"] == "4 × rubber-foot-6x6"
    assert told["sheet"].startswith("FR4, 12 × 32 × 0.2 mm")
    assert told["first_natural_hz"] == pytest.approx(first_natural_hz(board), abs=0.1)
    assert "foam" not in told
