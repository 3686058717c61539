"""`chladni flash` and `chladni device`, on the emulated device and over a pseudo-terminal."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from chladni.sim.board.file import load_board
from chladni.sim.board.writing import board_file
from conftest import CommandLine
from made_up import SCRIPT
from wired_boards import SWITCHED


def test_flash_into_the_emulator(chladni: CommandLine, table_file: Path) -> None:
    done = chladni("flash", table_file, "--emulator", "--json")
    assert done.code == 0
    assert {"bytes", "seconds", "slot", "verified"} <= done.json.keys()
    assert done.json["verified"]
    assert done.json["bytes"] == table_file.stat().st_size


@pytest.mark.parametrize(
    "arguments",
    [
        ("info",),
        ("touch", "10,25", "--seconds", "0.2"),
        ("self-test",),
        ("config",),
        ("stream", "1@0,0.5@90,0,0,0", "--seconds", "0.3"),
        ("config", "set", "level_q15=1000"),
    ],
)
def test_every_device_command_answers(
    chladni: CommandLine, table_file: Path, arguments: tuple[str, ...]
) -> None:
    extra = ("--table", table_file) if arguments[0] in ("info", "touch") else ()
    done = chladni("device", *arguments, "--emulator", *extra, "--json")
    assert done.code == 0, done.err
    if arguments[0] == "self-test":
        # Half amplitude: a quarter of 333 mA, and ten steps of 1024: eight of the shortest pulse.
        assert [row["supply_ma"] for row in done.json["channels"]] == pytest.approx([33] * 5, abs=4)
        assert [row["expected_ma"] for row in done.json["channels"]] == [33] * 5
        assert all(row["ok"] for row in done.json["channels"])
        assert done.json["supply_limit_ma"] > 0
    if arguments[-1] == "level_q15=1000":
        assert done.json["level_q15"] == 1000


def test_a_table_that_stays_of_another_board_is_said(
    chladni: CommandLine, port: str, tmp_path: Path
) -> None:
    """Configured for another board, a device plays its old table on."""
    moved = dataclasses.replace(load_board("prototype"), name="other")
    at = (moved.actuators[0].at[0] + 1e-3, moved.actuators[0].at[1])
    first = dataclasses.replace(moved.actuators[0], at=at)
    path = tmp_path / "other.toml"
    board = dataclasses.replace(moved, actuators=(first, *moved.actuators[1:]))
    path.write_bytes(board_file(board, []))
    done = chladni("device", "config", "set", "--from", path, "--yes", "--port", port)
    assert done.code == 0, done.err
    assert "the table in flash is of prototype and plays" in done.err


def test_coils_with_a_lowest_duty_pass_the_self_test(chladni: CommandLine) -> None:
    """An amplitude of a quarter and 90 steps of 1024 as the rest: (0.338² + 0.031) · 385 mA."""
    file = SWITCHED / "strip5.toml"
    done = chladni("device", "self-test", "--emulator", "--board", file, "--json")
    assert done.code == 0, done.err
    assert [row["expected_ma"] for row in done.json["channels"]] == [56] * 5
    assert [row["supply_ma"] for row in done.json["channels"]] == pytest.approx([56] * 5, abs=4)


@pytest.mark.parametrize("board", ["strip5", "quiet5"])
def test_bridges_draw_in_the_self_test_what_is_expected_of_them(
    chladni: CommandLine, board: str
) -> None:
    """Half amplitude is a duty's sine of 0.5 without a bias: an eighth of the full current.

    Reckoned as a switch's it would be 0.094 of it, 35 mA on `strip5`.
    """
    full_ma = 1e3 * load_board(board).electronics.full_current_a
    done = chladni("device", "self-test", "--emulator", "--board", board, "--json")
    assert done.code == 0, done.err
    rows = done.json["channels"]
    assert [row["expected_ma"] for row in rows] == pytest.approx([full_ma / 8.0] * 5, abs=1)
    assert [row["supply_ma"] for row in rows] == pytest.approx([full_ma / 8.0] * 5, abs=2)


def test_raw_duties_come_from_a_file(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "duties.csv"
    t = np.arange(3_000)[:, None] / (78_125 / 8)
    np.savetxt(path, 0.2 + 0.1 * np.sin(2.0 * np.pi * 160.0 * t + np.zeros(5)), delimiter=",")
    there = ("--emulator", "--baud", "921600")
    done = chladni("device", "stream", "--csv", path, *there, "--json")
    assert done.code == 0, done.err
    assert (done.json["frames"], done.json["faults"]) == (3_000, [])
    # At 115,200 baud five channels cannot keep up, and that is said beforehand.
    slow = chladni("device", "stream", "--csv", path, "--emulator")
    assert slow.code == 1
    assert "need a wire of" in slow.err


@pytest.mark.parametrize(("board", "code"), [("prototype", 2), ("strip5", 0)])
def test_duties_below_zero_are_for_bridges(
    chladni: CommandLine, tmp_path: Path, board: str, code: int
) -> None:
    path = tmp_path / "d.csv"
    path.write_text("0.2,-0.2,0,0.1,-0.1\n" * 400)
    there = ("--emulator", "--board", board, "--baud", "921600")
    done = chladni("device", "stream", "--csv", path, *there)
    assert done.code == code
    if code:
        assert f"{path}, --csv: expected duties from 0 to 1, as the device has" in done.err
        assert "got '-0.2'" in done.err


def test_a_script_is_streamed_for_as_long_as_asked(chladni: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "wave.py"
    path.write_text(SCRIPT.format(channels=5, more=""))
    done = chladni(
        "device",
        "stream",
        "--script",
        path,
        "--seconds",
        "0.25",
        "--emulator",
        "--baud",
        "921600",
        "--json",
    )
    assert done.code == 0, done.err
    assert done.json["frames"] == round(0.25 * 78_125 / 8)


@pytest.mark.parametrize(
    ("channels", "more", "words"),
    [(4, "", "5 channels"), (5, "+ 2.0", "duties from 0 to 1"), (5, "/ nothing", "NameError"),
     (5, "\nraise SystemExit", "SystemExit"), (5, "+ exit(0)", "SystemExit"),
     (5, ", 1", "duties(t)"), (5, ")[:3] + (0.0", "channels)")],
)  # fmt: skip
def test_a_script_that_gives_no_duties_is_named(
    chladni: CommandLine, tmp_path: Path, channels: int, more: str, words: str
) -> None:
    path = tmp_path / "wave.py"
    text = SCRIPT.format(channels=channels, more=more)
    path.write_text(text.replace("return", "return (") + ")" if "(" in more else text)
    done = chladni("device", "stream", "--script", path, "--emulator")
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err


def test_a_frequency_that_a_table_does_not_have_is_refused_with_what_to_do(
    chladni: CommandLine, table_file: Path
) -> None:
    done = chladni("device", "frequency", "200", "--emulator", "--table", table_file)
    assert done.code == 1
    assert "no drives for that frequency; `chladni table show`" in done.err


def test_one_name_for_both_ramps_says_which_they_are(chladni: CommandLine) -> None:
    done = chladni("device", "config", "set", "ramp_ms=6", "--emulator")
    assert done.code == 0
    assert "ramp_ms sets attack_ms and release_ms" in done.err
    for action in ("get", "describe"):
        shown = chladni("device", "config", action, "ramp_ms", "--emulator")
        assert shown.code == 0, shown.err
        assert "attack ms" in shown.out.replace("_", " ")
        assert "release ms" in shown.out.replace("_", " ")


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("flash",), 2, "TABLE, --previous"),
        (("flash", "--previous", "--rom", "--port", "/dev/nothing"), 2, "needs a running device"),
        (("flash", "--firmware", "nothing.bin", "--port", "/dev/nothing"), 2, "readable file"),
        (("flash", "--firmware", "README.md", "--port", "/dev/nothing"), 2, "application image"),
        (("flash", "--firmware", "README.md"), 2, "--port"),
        (("flash", "nothing.chl", "--emulator"), 2, "nothing.chl"),
        (("device", "info"), 2, "one of --port, --udp and --emulator is required"),
        (("device", "info", "--port", "/dev/nothing"), 1, "no such port"),
        (("device", "info", "--port", "none", "--board", "phone5"), 2, "--board does not go with"),
        (("device", "touch", "10", "--emulator"), 2, "X,Y"),
        (("device", "touch", "1,1", "--emulator"), 1, "no table; give it one by --table"),
        (("device", "stream", "1@0", "--emulator"), 2, "5 channels"),
        (("device", "stream", "2@0", "--emulator"), 2, "gain from 0 to 1"),
        (("device", "config", "set", "colour=3", "--emulator"), 2, "colour"),
        (("device", "config", "set", "--emulator"), 2, "NAME=VALUE"),
        (("device", "config", "set", "sign_pins=18,19", "--emulator"), 2, "none: this device"),
        (("device", "stream", "--emulator"), 2, "one of DRIVE, --csv and --script is required"),
        (("device", "stream", "--script", "nothing.py", "--emulator"), 2, "nothing.py"),
        (("device", "stream", "--script", "README.md", "--emulator"), 2, "SyntaxError in line"),
        (("device", "stream", "--script", "tests/made_up.py", "--emulator"), 2, "duties(t)"),
        (("device", "info", "--udp", "127.0.0.1"), 2, "--key"),
        (("device", "info", "--udp", ":5", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "info", "--udp", "h:0", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "info", "--udp", "127.0.0.1", "--key", "README.md"), 2, "hexadecimal"),
        (
            ("device", "info", "--udp", "127.0.0.1", "--emulator"),
            2,
            "--udp does not go with --emulator",
        ),
        (("device", "info", "--udp", "127.0.0.1:²", "--key", "README.md"), 2, "HOST or HOST:PORT"),
        (("device", "touch", "1e9,0", "--emulator"), 2, "board's centre"),
        (("device", "touch", "0,0", "--seconds", "nan", "--emulator"), 2, "--seconds"),
        (("device", "log", "--seconds", "nan", "--emulator"), 2, "--seconds"),
        (("device", "stream", "1@nan,0,0,0,0", "--emulator"), 2, "DRIVE"),
        (
            (
                "device",
                "network",
                "set",
                "--ssid",
                "\udcff",
                "--key",
                "k",
                "--passphrase-file",
                "README.md",
                "--emulator",
            ),
            2,
            "ssid",
        ),
        (("device", "config", "get", "colour", "--emulator"), 2, "NAME: expected one of"),
        (("emulate", "nothing.chl"), 2, "nothing.chl"),
        (("device", "log", "--udp", "127.0.0.1"), 2, "--udp does not go with"),
        (("device", "network", "set", "--emulator"), 2, "--ssid"),
        (("device", "network", "set", "--ssid", "x", "--emulator"), 2, "--key"),
        (("device", "network", "out", "--emulator"), 2, "one of the three"),
        (("device", "network", "off", "--udp", "127.0.0.1"), 2, "--udp does not go with"),
        (("device", "stream", "--csv", "README.md", "--emulator"), 2, "rows of numbers"),
        (("device", "config", "set", "level_q15=99999", "--emulator"), 2, "level_q15"),
        (("flash", "--previous", "--emulator"), 1, "no other table"),
    ],
)
def test_what_is_wrong_is_said(
    chladni: CommandLine, arguments: tuple[str, ...], code: int, words: str
) -> None:
    done = chladni(*arguments)
    assert done.code == code
    assert words in done.err
    assert "Traceback" not in done.err
