"""`table` on tables of responses: built, shown, verified, compared, and refused where drives are
needed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.drives.fingers.silence import drives_for
from chladni.host.emulation.demodulate import Play, phasors
from chladni.host.emulation.emulator import TouchEvent
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import SeveralFingers
from chladni.sim.board.writing import board_file
from chladni.tables.format import pack, read_table
from chladni.tables.mirror_symmetry import MirrorSymmetry
from chladni.tables.responses import TableResponses
from chladni.tables.several_fingers import isolation
from conftest import CommandLine
from made_up import powered, random_table, with_responses


@pytest.fixture
def path(tmp_path: Path, prototype: Board) -> Path:
    """Random responses that say they are of `prototype`, at 120 and 160 Hz."""
    order_x, order_y = (0, 2, 1, 4, 3), (0, 3, 4, 1, 2)
    drives = random_table(4, 8, 5, 1, symmetry=MirrorSymmetry(order_x, order_y))
    table = with_responses(drives, 1, alone=True, frequencies=(120.0, 160.0))
    own = replace(
        table, board_name="prototype", board_fingerprint=prototype.fingerprint("responses")
    )
    file = tmp_path / "r.chl"
    file.write_bytes(pack(own))
    return file


def test_a_table_of_responses_is_built_and_asked_for_by_the_board_file(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(isolation, "SETS", 8)
    own = load_board("prototype")
    board = replace(own, image=replace(own.image, points=(31, 63)))
    plain, asking = tmp_path / "plain.toml", tmp_path / "asking.toml"
    plain.write_bytes(board_file(board))
    asking.write_bytes(board_file(replace(board, fingers=SeveralFingers())))
    one, other = tmp_path / "1.chl", tmp_path / "2.chl"
    report = chladni("table", "build", plain, "--for", "fingers", "-o", one, "--json").json
    chladni("table", "build", asking, "-o", other)
    assert one.read_bytes() == other.read_bytes()
    assert report["bytes"] == one.stat().st_size <= 2048
    assert report["is_within_limits"]
    (own_db,) = report["frequencies"]
    for key in ("isolation_db", "exact_isolation_db"):
        assert f"{own_db[key]['p10']:.1f}" in report["verdict"]
    assert chladni("table", "verify", one, "--board", plain, "--json").json["verified"]


def test_responses_are_shown_in_micrometres_per_newton(chladni: CommandLine, path: Path) -> None:
    shown = chladni("table", "show", path, "--frequency", "160", "--at", "10,25", "--json").json
    assert (shown["version"], shown["objective"]) == ("2.1", "responses")
    assert (shown["frequencies_hz"], shown["responses_hz"]) == ([], [120.0, 160.0])
    known = TableResponses.of(read_table(path), 160.0)
    at = np.array([[0.01, 0.025]])
    found = [
        one["response_um_per_n"] * np.exp(1j * np.radians(one["phase_deg"]))
        for one in shown["responses"]
    ]
    assert np.allclose(found, known.at(at)[0] * 1e6)
    assert shown["own_um_per_n"] == pytest.approx(abs(known.own_at(at)[0]) * 1e6)
    text = chladni("table", "show", path, "--at", "10,25").out
    assert "µm/N" in text
    wrong = chladni("table", "show", path, "--frequency", "140")
    assert wrong.code == 2
    assert "120, 160 Hz" in wrong.err


def test_responses_are_verified_and_compared(chladni: CommandLine, path: Path) -> None:
    answer = chladni("table", "verify", path, "--json").json
    assert answer["sections"] == 2
    assert answer["places_checked"] > 1000
    table = read_table(path)
    section = table.responses[0]
    iq = section.iq.copy()
    iq[2, 5] = (320, 0)
    other = path.with_name("o.chl")
    other.write_bytes(pack(replace(table, responses=(replace(section, iq=iq),))))
    answer = chladni("table", "diff", path, other, "--json").json
    assert answer["compared_hz"] is None
    assert answer["compared_responses_hz"] == 120.0
    # A region and its three images.
    assert answer["responses_that_differ"] == 4
    assert answer["largest_of_coupling"] == 0.0
    assert answer["header"]["responses_hz"] == [[120.0, 160.0], [120.0]]


def test_what_needs_drives_refuses_a_table_without_by_name(
    chladni: CommandLine, path: Path, tmp_path: Path
) -> None:
    for command in (("score",), ("export", "--csv", tmp_path / "x.csv")):
        answer = chladni("table", command[0], path, *command[1:])
        assert answer.code == 2
        assert "drives" in answer.err
        assert "responses" in answer.err
    answer = chladni("table", "build", "prototype", "--for", "thumbs", "-o", tmp_path / "t.chl")
    assert answer.code == 2
    assert "--for: expected one of: finger, fingers, both" in answer.err
    answer = chladni(
        "table",
        "build",
        "prototype",
        "--for",
        "fingers",
        "--objective",
        "ssim",
        "-o",
        tmp_path / "t.chl",
    )
    assert answer.code == 2
    assert "--objective does not go with --for fingers" in answer.err


def test_a_device_starts_with_responses_alone(path: Path) -> None:
    """It takes the table, and a touch plays the loudest drive of its place."""
    emulator = powered(read_table(path))
    emulator.touch(TouchEvent(5.0, (10.0, 25.0)))
    recording = emulator.run(60.0)
    assert emulator.core.state == "playing"
    assert emulator.core.faults == []
    found = phasors(recording, Play(2500, len(recording.duty_steps)), 120.0)
    ((_, x_um, y_um, *_), *_) = emulator.core.touches()
    plate = TableResponses.of(read_table(path))
    place = (x_um * 1e-6, y_um * 1e-6)
    (wanted,) = drives_for(plate, [place], stiffness=plate.finger.stiffness).drives
    scale = np.vdot(found, wanted) / np.vdot(found, found)
    assert np.abs(scale * found - wanted).max() < 0.03
