"""What another finger has of an effect that the device does not know of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.methods import SEED
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.kept_focus import click_20mm_db, click_um
from chladni.drives.scoring.several_fingers.finger_sets import (
    finger_discs,
    finger_sets,
    pressed_fields,
)
from chladni.effects import Curve, Effect, Tone, shipped_effects
from chladni.host.emulation import felt_over_time
from chladni.host.emulation.felt_over_time import RATE_HZ, FingerPlate, rms
from chladni.host.emulation.over_frequency import Plates
from chladni.host.emulation.played_effect import check_can_play, play_effect
from chladni.host.emulation.table_score import played_drives
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.quantity import MM
from chladni.sim.errors import InputError
from chladni.sim.image.finger import pressing_stiffness
from chladni.tables.build import build_table
from chladni.tables.format import pack, read_table
from chladni.tables.several_fingers.build import responses_table
from conftest import CommandLine
from wired_boards import SWITCHED

HERE, BESIDE = (0.0, 15.0), np.array([(3.0, -9.0), (-4.0, 27.5)])
PRESSED = 5.0


@pytest.fixture(scope="module")
def board() -> Board:
    return load_board("strip5")


@pytest.fixture(scope="module")
def plates(board: Board) -> Plates:
    return Plates.of(board)


@pytest.fixture(scope="module")
def path(board: Board, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("tables") / "t.chl"
    path.write_bytes(pack(responses_table(board, pitch=7e-3, bits=12)[0]))
    return path


def test_an_unpressed_disc_moves_as_the_plate_under_the_finger_says(
    board: Board, plates: Plates
) -> None:
    """Against the exact solution between two known frequencies, over each disc."""
    plate = FingerPlate.of(plates.known, np.array([HERE]) * MM, PRESSED, BESIDE * MM)
    assert len(plate.free) == 3
    hz = 150.0
    own = solved_board(board).at_frequency(hz)
    fields = pressed_fields(own, np.array([HERE]) * MM, pressing_stiffness(PRESSED, hz))
    t = np.arange(round(1.5 * RATE_HZ)) / RATE_HZ
    window = np.clip(t / 0.2, 0.0, 1.0) * np.clip((1.5 - t) / 0.2, 0.0, 1.0)
    forces = np.zeros((len(t), len(board.actuators)))
    forces[:, 3] = window * np.cos(2.0 * np.pi * hz * t)
    middle = (t > 0.6) & (t < 0.9)
    for disc, moved in zip(
        finger_discs(board, BESIDE * MM), plate.each_moved(forces, 1), strict=True
    ):
        found = np.sqrt(2.0 * np.mean(rms(moved[:, middle]) ** 2))
        wanted = np.sqrt(np.mean(np.abs(fields[3][disc]) ** 2))
        assert 20.0 * np.log10(found / wanted) == pytest.approx(0.0, abs=0.01)
        free = np.sqrt(np.mean(np.abs(own.fields.values[3][disc]) ** 2))
        assert abs(20.0 * np.log10(free / wanted)) > 0.02  # what the finger holds still counts


def test_the_loudest_other_finger_is_found_wherever_it_lies(
    board: Board, plates: Plates, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The dB are the peak's over it, and a device that knows of a finger there keeps it still."""
    table = responses_table(board, pitch=7e-3, bits=12)[0]
    tone = Effect("tone", (Tone(0.0, 0.25, Curve.constant(1.0), Curve.constant(150.0)),))
    found = play_effect(table, board, tone, HERE, unknown=True, plates=plates)
    assert found.second_finger_20mm_um is not None
    assert found.second_finger_20mm_db is not None
    own = found.own_um[(found.t_s > 0.1) & (found.t_s < 0.2)]
    steady_db = 20.0 * np.log10(np.abs(own).max() / found.second_finger_20mm_um)
    assert found.second_finger_20mm_db == pytest.approx(steady_db, abs=1.0)
    assert found.far_um is not None
    assert found.far_um.max() == found.second_finger_20mm_um
    assert found.second_finger_20mm_at_mm is not None
    far_mm = np.subtract(found.second_finger_20mm_at_mm, HERE)
    assert np.hypot(*far_mm) >= 20.0
    beside = play_effect(
        *(table, board, tone, HERE), other_mm=found.second_finger_20mm_at_mm, plates=plates
    )
    # The device knows of that one, and keeps it still.
    assert beside.other_peak_um is not None
    assert beside.other_peak_um < 0.5 * found.second_finger_20mm_um
    plain = play_effect(table, board, tone, HERE, plates=plates)
    assert plain.second_finger_20mm_db is None
    np.testing.assert_allclose(plain.own_um, found.own_um, atol=1e-9)
    # A board that is no larger than a finger has no place for another.
    monkeypatch.setattr(felt_over_time, "FAR_FINGER", 60e-3)
    alone = play_effect(table, board, tone, HERE, unknown=True, plates=plates)
    assert alone.second_finger_20mm_um is None


def test_a_click_beside_one_finger_is_reckoned_within_3_db_of_the_pins(
    board: Board, plates: Plates
) -> None:
    """A score reckons it from one frequency, under the same press."""
    table = build_table(board, objective="focus", jobs=1)[0]
    places = [(0.0, y * MM) for y in (-20.0, -4.0, 10.0)]
    drives = played_drives(table, board, places)
    score = click_20mm_db(solved_board(board), places, drives)
    click = shipped_effects()["click"]
    played = [
        play_effect(table, board, click, (x / MM, y / MM), unknown=True, plates=plates)
        for x, y in places
    ]
    levels = [own.second_finger_20mm_db for own in played if own.second_finger_20mm_db is not None]
    assert score is not None
    assert len(levels) == 3
    assert score.median == pytest.approx(np.median(levels), abs=3.0)
    assert np.median(levels) > 8.0
    um = click_um(solved_board(board), places, drives)
    assert um is not None
    assert um.median == pytest.approx(np.median([own.peak_um for own in played]), rel=0.12)


def test_places_have_what_each_of_them_has_alone(chladni: CommandLine, path: Path) -> None:
    words = ("play", "click", "--emulator", "--board", "strip5", "--table", path, "--json")
    found = chladni(*words, "--places", "2")
    assert found.code == 0, found.err
    drawn = finger_sets(load_board("strip5"), 1, 2, 16e-3, np.random.default_rng(SEED)) / MM
    alone = [chladni(*words, "--at", f"{x!r},{y!r}").json for x, y in drawn[:, 0].tolist()]
    for key in ("second_finger_20mm_db", "peak_um"):
        middle = np.mean([own[key] for own in alone])
        assert found.json[key]["median"] == pytest.approx(middle, abs=1e-6)
    assert found.json["verdict"].startswith("Over 2 places another finger 20 mm away or farther")
    assert "of which the device knows nothing, up to" in alone[0]["verdict"]


def test_another_finger_of_drives_alone_is_refused_with_what_tells_of_one(
    board: Board, path: Path
) -> None:
    table = read_table(path)
    drives = replace(table, responses=())
    with pytest.raises(InputError, match="expected a section of responses, got 'only drives'") as e:
        check_can_play(drives, board, (0.0, -12.0))
    assert "without another finger it is told" in str(e.value)
    check_can_play(drives, board, None)
    check_can_play(table, board, (0.0, -12.0))


def test_a_bias_that_comes_up_with_the_touch_is_told_of(
    chladni: CommandLine, tmp_path: Path
) -> None:
    """On `pad16` it moves places 20 mm away more than the click itself."""
    file, path = SWITCHED / "strip5.toml", tmp_path / "t.chl"
    board = load_board(file)
    path.write_bytes(pack(responses_table(board, pitch=7e-3, bits=12)[0]))
    words = ("play", "click", "--at", "0,15", "--emulator", "--board", file, "--table", path)
    touched, rested = chladni(*words, "--json"), chladni(*words, "--rested", "--json")
    assert "the bias of switches comes up with the touch" in touched.err
    assert "the bias of switches" not in rested.err


def test_a_board_for_several_knows_all_fingers(chladni: CommandLine) -> None:
    found = chladni("play", "click", "--at", "0,30", "--emulator", "--board", "phone5", "--json")
    assert found.json["second_finger_20mm_db"] is None
    assert "knows nothing" not in found.json["verdict"]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("click", "--emulator", "--at", "0,0"), "--at does not go with --places"),
        (("click", "--emulator", "--pairs", "3"), "--places does not go with --pairs"),
        (("click", "--port", "nowhere"), "--places does not go with --port or --udp"),
        (("click",), "--emulator is required: the device that --places plays on"),
        (("click", "--emulator", "--places", "0"), "--places: expected 1 to 1000, got 0"),
        (("click", "--emulator", "--other-effect", "tick"), "only --pairs has another finger"),
    ],
)
def test_what_is_of_one_place_is_refused(
    chladni: CommandLine, words: tuple[str, ...], named: str
) -> None:
    answer = chladni("play", "--places", "3", *words)
    assert (answer.code, answer.out) == (2, "")
    assert named in answer.err


@pytest.mark.parametrize(("y_mm", "is_told"), [(25.9, False), (26.1, True)])
def test_a_press_where_no_board_is_scored_is_remarked_on(
    chladni: CommandLine, path: Path, y_mm: float, is_told: bool
) -> None:
    """`strip5` has a margin of 4 mm on 60. Another board's file is refused after that."""
    where = ("--board", "strip5", "--table", path, "--emulator", "--hidden", "two")
    answer = chladni("play", "click", "--at", f"0,{y_mm}", *where)
    told = "--at lies beyond the active area, x -3 to 3 and y -26 to 26 mm"
    assert (told in answer.err) == is_told
