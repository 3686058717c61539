"""Effects through the emulated pins, back through the plate: what each finger has of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from chladni.calibration.hidden import HiddenPlate, given_plate
from chladni.drives.problem.problem import solved_board
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet
from chladni.effects import Area, Bank, Curve, Effect, Tone, shipped_effects
from chladni.effects.bank.pack import pack_bank
from chladni.host.emulation import over_frequency as solving
from chladni.host.emulation.closed_loop import run_alone
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.emulation.felt_over_time import RATE_HZ, FingerPlate, envelope_error_db, rms
from chladni.host.emulation.over_frequency import GRID_HZ, Plates, over_frequency
from chladni.host.emulation.played_effect import PlayedEffect, play_effect
from chladni.host.figures.effects import played_effects_figure
from chladni.host.protocol.config import BIAS_RAMP_MS
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.coil.full_drive import full_drive
from chladni.sim.errors import MissingError
from chladni.sim.image.finger import pressing_stiffness
from chladni.tables.format import pack
from chladni.tables.several_fingers.build_for import build_for
from chladni.tables.table import Table
from conftest import ROOT, CommandLine, made_once
from wired_boards import SWITCHED

HERE, THERE = (0.0, 15.0), (0.0, -12.0)


@pytest.fixture(scope="module")
def board() -> Board:
    return load_board("strip5")


@pytest.fixture(scope="module")
def table(board: Board, tmp_path_factory: pytest.TempPathFactory) -> Table:
    return made_once(tmp_path_factory, "strip5-responses", lambda: build_for(board, "fingers")[0])


@pytest.fixture(scope="module")
def plates(board: Board) -> Plates:
    return Plates.of(board)


def played(table: Table, board: Board, plates: Plates, name: str) -> PlayedEffect:
    return play_effect(table, board, shipped_effects()[name], HERE, other_mm=THERE, plates=plates)


def test_a_click_reaches_its_finger_in_time_and_leaves_the_other_still(
    table: Table, board: Board, plates: Plates
) -> None:
    found = played(table, board, plates, "click")
    assert found.other_um is not None
    assert found.isolation_db is not None
    assert found.isolation_db > 30.0
    assert found.peak_um > 15.0
    # A turn of the main loop, drives of two fingers, and the low-pass's slow beginning.
    assert 0.0 < found.first_ms < 2.0
    # Its own 4.7 ms, what the low-pass takes, 2.1 ms at 160 Hz, and a millisecond.
    assert found.rise_ms < 4.7 + 2.1 + 1.0
    # The finger follows what was asked for, by the coils' and the plate's own delay.
    late = [found.t_s[int(own.argmin())] for own in (found.own_um, found.asked)]
    assert 0.0 < late[0] - late[1] < 1e-3
    shown = played_effects_figure([found], ["click"]).axes[-1].get_xlim()
    assert shown[0] == 0.0
    assert late[0] < 1e-3 * shown[1] < 0.06
    at_rest = found.t_s > 0.1
    assert np.abs(found.own_um[at_rest]).max() < 0.02 * found.peak_um
    assert found.other_um.max() == pytest.approx(
        np.abs(found.own_um).max() / 10.0 ** (found.isolation_db / 20.0), rel=0.2
    )


def test_a_switchs_bias_stands_before_an_effect_and_is_told_apart(
    table: Table, board: Board, plates: Plates
) -> None:
    """Half of full scale and what rounding needs; bridges have none."""
    bridged = played(table, board, plates, "click")
    assert bridged.bias_duty is None
    own = load_board(SWITCHED / "strip5.toml").electronics
    found = played(table, replace(board, electronics=own), plates, "click")
    assert found.bias_duty is not None
    assert found.bias_um is not None
    assert found.isolation_db is not None
    assert 0.4 < found.bias_duty < 0.55
    assert BIAS_RAMP_MS < found.rise_ms < BIAS_RAMP_MS + 4.7 + 2.1 + 1.0
    assert found.isolation_db > 25.0
    assert found.bias_um < 0.5 * found.peak_um
    # Its end, which a finger feels with the click, is over once the finger has rested.
    rested = play_effect(
        table,
        replace(board, electronics=own),
        shipped_effects()["click"],
        HERE,
        other_mm=THERE,
        rested=True,
        plates=plates,
    )
    assert rested.isolation_db is not None
    assert rested.isolation_db > found.isolation_db + 1.0
    # A switch has half of a bridge's swing.
    assert rested.peak_um == pytest.approx(bridged.peak_um / 2.0, rel=0.05)
    assert rested.bias_um is not None
    assert rested.bias_um < 0.03 * rested.peak_um
    # To a hundredth of a click, which begins slowly.
    assert 0.0 < rested.first_ms < 3.5
    assert 0.0 < rested.rise_ms < 4.7 + 2.1 + 1.0


@pytest.mark.parametrize("name", ["pulse", "sweep", "thud"])
def test_an_envelope_is_met_within_a_decibel(
    table: Table, board: Board, plates: Plates, name: str
) -> None:
    found = played(table, board, plates, name)
    assert found.envelope_error_db is not None
    assert found.envelope_error_db < 1.0
    assert found.isolation_db is not None
    assert found.isolation_db > 30.0


def test_a_steady_tone_moves_a_finger_as_the_plate_at_its_frequency_says(
    board: Board, plates: Plates
) -> None:
    """Against the exact solution between two of the frequencies that are known."""
    places = np.array([HERE, THERE]) * 1e-3
    plate = FingerPlate.of(plates.known, places, 1.0)
    for hz in (71.0, 150.0, 233.0):
        exact = FingerSet.of(
            solved_board(board).at_frequency(hz), places, pressing_stiffness(1.0, hz)
        )
        t = np.arange(round(2.0 * RATE_HZ)) / RATE_HZ
        window = np.clip(t / 0.2, 0.0, 1.0) * np.clip((2.0 - t) / 0.2, 0.0, 1.0)
        forces = np.zeros((len(t), len(board.actuators)))
        forces[:, 1] = window * np.cos(2.0 * np.pi * hz * t)
        middle = (t > 0.8) & (t < 1.2)
        for finger, disc in enumerate(exact.discs):
            moved = 1e6 * plate.moved(forces, finger).mean(axis=0)[middle]
            turn = np.exp(-2j * np.pi * hz * t[middle])
            found = 2.0 * np.mean(moved * turn)
            wanted = disc[:, 1].mean() * 1e6
            assert abs(found - wanted) < 0.02 * abs(wanted)


@pytest.mark.soak
def test_more_frequencies_change_little(
    board: Board, plates: Plates, monkeypatch: pytest.MonkeyPatch
) -> None:
    places = np.array([HERE, THERE]) * 1e-3
    t = np.arange(round(0.2 * RATE_HZ)) / RATE_HZ
    click = np.where(t < 1.5 / 160.0, np.sin(np.pi * t * 160.0 / 1.5) ** 2, 0.0)
    forces = np.zeros((len(t), len(board.actuators)))
    forces[:, 0] = click * np.sin(2.0 * np.pi * 160.0 * t)
    coarse = rms(FingerPlate.of(plates.known, places, 1.0).felt_um(forces, 0))
    more = sorted({*GRID_HZ, *(0.5 * (a + b) for a, b in pairwise(GRID_HZ))})
    monkeypatch.setattr(solving, "GRID_HZ", tuple(more))
    fine = rms(FingerPlate.of(over_frequency(board), places, 1.0).felt_um(forces, 0))
    assert np.abs(coarse - fine).max() < 0.03 * fine.max()


def test_an_envelope_that_is_off_is_measured() -> None:
    t = np.arange(4000) / RATE_HZ
    tone = np.sin(2.0 * np.pi * 150.0 * t)
    asked = np.sin(np.pi * t / t[-1]) ** 2 * tone
    assert envelope_error_db(asked, 3.0 * asked) < 0.01
    late = round(1.5e-3 * RATE_HZ)
    assert envelope_error_db(asked, np.roll(asked, late)) < 0.3
    bent = asked * 10.0 ** (np.clip(t / t[-1] - 0.5, 0.0, 1.0) * 8.0 / 20.0)
    assert envelope_error_db(asked, bent) > 2.0


def test_the_command_plays_and_draws(chladni: CommandLine, table: Table, tmp_path: Path) -> None:
    path, figure = tmp_path / "t.chl", tmp_path / "play.png"
    path.write_bytes(pack(table))
    where = ("--board", "strip5", "--table", path, "--emulator")
    found = chladni(
        "play", "click", "--at", "0,15", "--other", "0,-12", *where, "--figure", figure, "--json"
    ).json
    assert {"rise_ms", "envelope_error_db", "isolation_db", "peak_um", "left_out"} <= set(found)
    assert found["isolation_db"] > 30.0
    # A peak of the mean over one disc, and of the RMS over the other.
    assert found["other_peak_um"] < 0.1 * found["peak_um"]
    assert 0.2 < found["just_felt_um"] < 0.5
    assert figure.stat().st_size > 20_000
    for words, said in (
        (("nothing", "--at", "0,15"), "EFFECT: expected click"),
        (("click", "--at", "0"), "--at: expected two numbers"),
        (("click", "--at", "0,15", "--other", "0,16"), "--other: expected 5 mm or more"),
        (("click", "--at", "0,300"), "expected"),
        (("click", "--at", "0,15", "--level-um", "0"), "--level-um: expected 0.01 to 655.35 µm"),
        (("click", "--at", "0,15", "--level-um", "3", "--level-db", "-3"), "does not go with"),
    ):
        refused = chladni("play", *words, *where)
        assert (refused.code, said in refused.err) == (2, True), refused.err


def test_a_tone_of_less_level_is_as_much_weaker(table: Table, board: Board, plates: Plates) -> None:
    tone = Effect("tone", (Tone(0.0, 0.2, Curve.constant(1.0), Curve.constant(160.0)),))
    loud, soft = (
        play_effect(table, board, tone, HERE, level=level, plates=plates).peak_um
        for level in (1.0, 0.25)
    )
    assert soft == pytest.approx(0.25 * loud, rel=0.03)


@pytest.mark.parametrize("other", [None, THERE])
def test_an_area_or_a_host_in_micrometres_moves_a_finger_by_as_much(
    table: Table, board: Board, plates: Plates, other: tuple[float, float] | None
) -> None:
    """By the plate that is solved with the fingers on it; the device knows it from its table."""
    tone = Effect("tone", (Tone(0.0, 0.2, Curve.constant(1.0), Curve.constant(160.0)),))
    for um in (2.0, 6.0):
        bank = pack_bank(Bank("b", {"tone": tone}, (Area("all", press="tone", level_um=um),)))
        kept = play_effect(table, board, tone, HERE, other_mm=other, bank=bank, plates=plates)
        sent = play_effect(table, board, tone, HERE, other_mm=other, level_um=um, plates=plates)
        for found in (kept, sent):
            # Where a tone begins and ends it swings over.
            steady = np.abs(found.own_um[(found.t_s > 0.08) & (found.t_s < 0.16)]).max()
            assert 20.0 * np.log10(steady / um) == pytest.approx(0.0, abs=1.0)


FT6X36 = """
[panel]
controller = "ft6x36"
place = "beside"
pixels = [140, 600]
size_mm = [14.0, 60.0]
sda_pin = 21
scl_pin = 22
interrupt_pin = 34
"""


def test_a_finger_alone_is_emulated_by_responses_too(
    chladni: CommandLine, table: Table, board: Board, tmp_path: Path
) -> None:
    """The loudest drive for its place, by what the plate's own fields say."""
    touch = TouchEvent(10.0, HERE)
    recording, report = run_alone(table, board, [touch], 150.0)
    assert recording.duty_steps.any()
    assert 0.0 < report.latency_ms - report.reported_ms < 3.0
    at = solved_board(board).problem(HERE).at_target
    loudest = at.conj() / np.linalg.norm(at)
    assert abs(np.vdot(loudest, report.drive)) / np.linalg.norm(report.drive) > 0.97
    path, out = tmp_path / "t.chl", tmp_path / "e.npz"
    path.write_bytes(pack(table))
    at_place = f"{HERE[0]:g},{HERE[1]:g}@10"
    with_panel = tmp_path / "strip5.toml"
    text = (ROOT / "boards" / "strip5.toml").read_text(encoding="utf-8")
    with_panel.write_text(text + FT6X36, encoding="utf-8")
    where = ("emulate", path, "--board", with_panel, "--ms", "150", "-o", out)
    answer = chladni(*where, "--touch", at_place, "--json")
    found = answer.json
    # It looks every 40 ms until the firmware wakes it.
    assert found["reported_ms"] == pytest.approx(30.0, abs=0.5)
    assert "just powered on and reported the first touch after 30.0 ms" in answer.err
    assert found["finger_um"] == pytest.approx(report.card.felt.finger_um, rel=2e-3)  # type: ignore[union-attr]
    assert found["objective"] == "only responses"
    first = (
        "The board is for several fingers, and this is the drive that its device plays under one"
    )
    assert found["verdict"].startswith(first)
    assert "`chladni fingers` says how far apart it keeps several. The finger" in found["verdict"]
    short = chladni(*where, "--touch", f"{HERE[0]:g},{HERE[1]:g}@145")
    assert (short.code, "a last touch that then plays" in short.err) == (2, True)


def test_a_board_without_a_coil_is_refused(table: Table, board: Board) -> None:
    with pytest.raises(MissingError, match="coil"):
        play_effect(
            table, replace(board, coil=None, winding=None), shipped_effects()["click"], HERE
        )


def test_fingers_are_on_a_plate_that_the_device_does_not_know(
    table: Table, board: Board, plates: Plates
) -> None:
    """On the board itself with coils wired the wrong way round and half as strong."""
    count = len(board.actuators)
    wrong = HiddenPlate(board, np.full(count, -0.5), np.ones(count), 0, "wrong")
    effect = shipped_effects()["click"]
    on_wrong = replace(plates, hidden=wrong, below=plates.known)
    known, hidden = (
        play_effect(table, board, effect, HERE, plates=own) for own in (plates, on_wrong)
    )
    assert hidden.own_um == pytest.approx(-0.5 * known.own_um, abs=1e-6 * known.peak_um)


def test_a_weak_coil_that_its_device_makes_up_for_takes_level_and_nothing_else(
    table: Table, board: Board, plates: Plates
) -> None:
    """A coil of half its force, written into the file, on the plate that has it: as one is drawn,
    at half the level, and as the model says."""
    first, *others = board.actuators
    weak = replace(board, actuators=(replace(first, trim_db=20.0 * np.log10(2.0)), *others))
    effect = shipped_effects()["pulse"]
    full, half = (
        play_effect(
            table,
            own,
            effect,
            HERE,
            other_mm=THERE,
            plates=plates if plate is None else Plates.of(own, plate),
        )
        for own, plate in ((board, None), (weak, given_plate(board, weak)))
    )
    assert half.peak_um == pytest.approx(0.5 * full.peak_um, rel=0.02)
    assert half.isolation_db == pytest.approx(full.isolation_db, abs=1.0)
    drive = np.ones(len(board.actuators), dtype=np.complex128)
    newtons = [full_drive(own, drive, 160.0) for own in (board, weak)]
    assert newtons[0] is not None
    assert newtons[1] is not None
    # Of the supply's limit it leaves more than others take, of any other one nothing.
    assert 0.5 <= newtons[1].newtons / newtons[0].newtons < 0.75
    said = play_effect(table, weak, effect, HERE, other_mm=THERE, plates=plates)
    assert said.peak_um == pytest.approx(half.peak_um, rel=1e-6)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["--at", "0,15", "--hidden", "two"], "SEED, BOARD@SEED or FILE.toml"),
        (["--pairs", "2", "--hidden", "two"], "SEED, BOARD@SEED or FILE.toml"),
        (["--at", "0,15", "--hidden", "phone5@2"], "a board of the size and coils of strip5"),
    ],
)
def test_a_plate_that_is_not_the_boards_is_refused(
    chladni: CommandLine, table: Table, tmp_path: Path, given: list[str], expected: str
) -> None:
    path = tmp_path / "fingers.chl"
    path.write_bytes(pack(table))
    answer = chladni("play", "click", "--board", "strip5", "--emulator", "--table", path, *given)
    assert (answer.code, expected in " ".join(answer.err.split())) == (2, True), answer.err
