"""From a board file to five PWM channels and back through the plate."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from chladni.host.emulation.closed_loop import run_loop
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.protocol import link as link_protocol
from chladni.sim.board.board import Board
from chladni.tables import layout
from chladni.tables.format import pack
from chladni.tables.report import TableReport
from chladni.tables.table import Table
from conftest import ROOT, CommandLine

COARSE = Path(__file__).parent / "coarse.toml"


@pytest.mark.parametrize("place", [(10.0, 25.0), (-30.0, -60.0), (0.0, 0.0), (35.75, 73.35)])
def test_the_pins_make_the_field_the_table_promised(
    coarse_board: Board, coarse_table: tuple[Table, TableReport], place: tuple[float, float]
) -> None:
    table, _ = coarse_table
    recording, report = run_loop(table, coarse_board, [TouchEvent(23.0, place)], 250.0)
    assert report.ssim == pytest.approx(report.ssim_table, abs=0.002)
    for channel in report.channels:
        assert channel.gain_error_db is not None
        assert channel.phase_error_deg is not None
        assert abs(channel.gain_error_db) < 0.1
        assert abs(channel.phase_error_deg) < 0.5
    # The panel reports every 10 ms; its bus, the main loop and the interrupt take the rest.
    assert 7.0 <= report.latency_ms < 8.0
    assert 0.0 < report.latency_ms - report.reported_ms < 1.0
    assert recording.duty.shape[1] == 5


def test_a_moving_finger_ends_where_it_ends(
    coarse_board: Board, coarse_table: tuple[Table, TableReport]
) -> None:
    table, _ = coarse_table
    events = [TouchEvent(20.0, (10.0, 25.0)), TouchEvent(80.0, (-30.0, -60.0))]
    _, report = run_loop(table, coarse_board, events, 300.0)
    assert report.region == table.grid.region_at(-30000, -60000)
    assert report.ssim == pytest.approx(report.ssim_table, abs=0.002)


@pytest.mark.slow
def test_the_commands_run_the_chain(chladni: CommandLine, tmp_path: Path) -> None:
    """Every command of the chain, by its documented keys."""
    shown = chladni("board", "show", COARSE, "--json")
    assert shown.code == 0
    assert {"name", "size_mm", "actuators", "modes_hz"} <= shown.json.keys()
    assert len(shown.json["modes_hz"]) == 10

    table, recording = tmp_path / "t.chl", tmp_path / "r.npz"
    built = chladni("table", "build", COARSE, "-o", table, "--json")
    assert built.code == 0
    assert {
        "regions", "bytes", "seconds", "ssim_mean", "ssim_min", "ssim_loss_p99", "ssim_loss_max",
        "field_error_db_max",
    } <= built.json.keys()  # fmt: skip
    assert table.stat().st_size == built.json["bytes"]

    header = chladni("table", "show", table, "--at", "10,25", "--json").json
    assert header["board_name"] == "coarse"
    assert len(header["drive"]) == 5

    played = chladni(
        "emulate",
        table,
        "--board",
        COARSE,
        "--touch",
        "10,25@20",
        "--ms",
        "250",
        "-o",
        recording,
        "--json",
    )
    assert played.code == 0
    assert {"latency_ms", "channels", "ssim"} <= played.json.keys()
    assert {"gain_error_db", "phase_error_deg", "sfdr_db"} <= played.json["channels"][0].keys()
    with np.load(recording) as file:
        assert file["duty"].shape == (file["t_s"].size, 5)
        assert file["duty"].min() == 0.0
        assert file["duty"].max() < 1.0
        assert file["carrier_hz"] == 78125.0


def test_field_writes_what_solve_found(chladni: CommandLine, tmp_path: Path) -> None:
    solved = chladni("solve", "prototype", "--target", "10,25", "--json")
    assert solved.code == 0
    assert {
        "target_mm", "method", "drive", "ssim", "focal_error_mm", "centroid_error_mm",
        "contrast_db", "contrast_limit_db", "second_finger_db", "spot_mm2", "seconds",
        "evaluations", "baselines",
    } <= solved.json.keys()  # fmt: skip
    assert set(solved.json["baselines"]) == {"silent", "nearest_actuator", "misplaced"}
    drive, field = tmp_path / "d.json", tmp_path / "f.npz"
    drive.write_text(solved.out, encoding="utf-8")
    made = chladni("field", "prototype", "--drive", drive, "-o", field, "--json")
    assert made.code == 0
    assert {"path", "modes_used", "error_estimate", "seconds"} <= made.json.keys()
    with np.load(field) as file:
        shape = (file["x_mm"].size, file["y_mm"].size)
        assert shape == (179, 367)
        assert file["displacement"].shape == file["energy"].shape == shape
        assert file["energy"] == pytest.approx(np.abs(file["displacement"]) / np.sqrt(2.0))
        i, j = np.unravel_index(file["energy"].argmax(), shape)
        peak = np.hypot(file["x_mm"][i] - 10.0, file["y_mm"][j] - 25.0)
    assert peak == pytest.approx(solved.json["focal_error_mm"], abs=1e-6)


def test_field_of_an_actuator_and_of_a_target(chladni: CommandLine, tmp_path: Path) -> None:
    for number, option in enumerate((["--actuator", "top-left"], ["--target=-24.25,43.35"])):
        made = chladni("field", "paper", *option, "-o", tmp_path / f"{number}.npz", "--json")
        assert made.code == 0
        assert made.json["error_estimate"] <= 5e-3
    with np.load(tmp_path / "0.npz") as first, np.load(tmp_path / "1.npz") as second:
        assert np.array_equal(first["displacement"], second["displacement"])


def test_the_table_of_a_file_is_the_one_in_memory(
    coarse_table: tuple[Table, TableReport], chladni: CommandLine, tmp_path: Path
) -> None:
    path = tmp_path / "t.chl"
    path.write_bytes(pack(coarse_table[0]))
    header = chladni("table", "show", path, "--json").json
    assert header["regions"] == coarse_table[1].regions
    assert "drive" not in header


@pytest.mark.slow
def test_plate_commands_answer_and_draw(chladni: CommandLine, tmp_path: Path) -> None:
    """`modes`, `sweep` and the figures: keys, files, and pictures that are not blank."""
    modes = chladni(
        "modes",
        "prototype",
        "--count",
        "4",
        "-o",
        tmp_path / "m.npz",
        "--figure",
        tmp_path / "m.png",
        "--json",
    )
    assert modes.code == 0
    shown = chladni("board", "show", "prototype", "--json").json["modes_hz"][:4]
    assert modes.json["modes_hz"] == pytest.approx(shown, rel=1e-4)
    assert len(modes.json["modal_masses_g"]) == 4
    with np.load(tmp_path / "m.npz") as file:
        assert file["shapes"].shape == (4, 179, 367)
    swept = chladni("sweep", "paper", "--figure", tmp_path / "s.png", "--json")
    assert swept.code == 0
    assert {wave["waveform"] for wave in swept.json["waves"]} == {
        "sine",
        "triangle",
        "square",
        "ramp",
    }
    drawn = chladni(
        "field",
        "paper",
        "--target",
        "10,25",
        "-o",
        tmp_path / "f.npz",
        "--figure",
        tmp_path / "f.png",
        "--json",
    )
    assert drawn.code == 0
    for name in ("m", "s", "f"):
        picture = plt.imread(tmp_path / f"{name}.png")
        assert np.ptp(picture[..., :3]) > 0.9
        assert len(np.unique(picture[::7, ::7, 0])) > 20


def test_plate_commands_refuse_what_is_wrong(chladni: CommandLine, tmp_path: Path) -> None:
    for arguments, named in (
        (["modes", "paper", "--count", "0"], "--count"),
        (["modes", "paper", "--figure", tmp_path / "m.txt"], "--figure"),
        (["sweep", "paper", "--from", "400", "--to", "100"], "--from"),
        (["sweep", ROOT / "tests" / "chain" / "no-coil.toml"], "coil"),
        (["field", "paper", "--target", "0,0", "--tolerance", "2", "-o", "f.npz"], "--tolerance"),
    ):
        answer = chladni(*arguments)
        assert answer.code == 2
        assert named in answer.err
    assert list(tmp_path.iterdir()) == []


def test_versions_are_those_of_the_declarations(chladni: CommandLine) -> None:
    assert chladni("--version", "--json").json == {
        "chladni": version("chladni"),
        "table_format": f"{layout.VERSION_MAJOR}.{layout.VERSION_MINOR}",
        "link": f"{link_protocol.VERSION_MAJOR}.{link_protocol.VERSION_MINOR}",
    }
    assert chladni("-h").out == chladni("--help").out
