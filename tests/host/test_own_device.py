"""From a board file to a device that plays, on an emulated one whose flash is a file."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import monotonic

import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.wire import SerialWire
from chladni.host.emulation.flash_file import AREAS, FlashFile
from chladni.sim.board.file import load_board
from chladni.sim.board.writing import board_file
from chladni.sim.errors import InputError
from chladni.tables.build import build_table
from chladni.tables.format import pack
from chladni.tables.table import Table
from conftest import ROOT, CommandLine

OWN = Path(__file__).parent / "own.toml"


class Desk:
    """A device at a port with a name, that can be switched off and on."""

    def __init__(self, folder: Path, board: str | Path) -> None:
        self.flash, self.port = folder / "own.flash", folder / "own.port"
        self._board = board
        self._process: subprocess.Popen[str] | None = None

    def on(self) -> None:
        """Plug it in."""
        self._process = subprocess.Popen(
            [
                sys.executable,
                "-m",
                "chladni.host.cli.app",
                "emulate",
                "--serial",
                "--flash",
                str(self.flash),
                "--board",
                str(self._board),
                "--port-link",
                str(self.port),
            ],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline().strip() == str(self.port)

    def off(self) -> None:
        """Pull the plug, without a word before."""
        if self._process is not None:
            self._process.send_signal(signal.SIGKILL)
            self._process.wait()


def wait_for_coils(port: Path) -> None:
    """Until the device is sure that they have cooled: four seconds with a time constant of 30."""
    with Device(SerialWire(str(port))) as device:
        for _ in range(600):  # more than it takes, for a machine that is busy
            if "coil hot" not in device.info()["standing"]:
                return
            device.link.wait(0.1)
    pytest.fail("coils stay hot")


@pytest.fixture(scope="module")
def own_table() -> Table:
    """The board's, as `table build` makes it: docs/own-board.md builds one, and is run."""
    return build_table(load_board(OWN))[0]


@pytest.fixture
def own_file(own_table: Table, tmp_path: Path) -> Path:
    path = tmp_path / "own.chl"
    path.write_bytes(pack(own_table))
    return path


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    own = Desk(tmp_path, OWN)
    yield own
    own.off()


@pytest.mark.slow
def test_a_board_of_ones_own_plays(
    chladni: CommandLine, desk: Desk, own_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk.on()
    at = ("--port", desk.port)
    silent = chladni("device", "touch", "5,5", *at)
    assert silent.code == 1
    assert "never configured" in silent.err
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n" * 20))
    for command in (("stream", "1@0,0,0,0,0"), ("self-test",), ("self-test", "--first-boot")):
        refused = chladni("device", *command, *at)
        assert refused.code == 1
        assert "never configured; chladni device config set --from BOARD" in refused.err
        assert "played" not in refused.err
    asked = chladni("device", "config", "set", "--from", OWN, *at)
    assert asked.code == 2
    assert "pwm_pins: none, none, none, none, none -> 25, 26, 27, 32" in asked.err
    assert "--yes is required" in asked.err
    done = chladni("device", "config", "set", "--from", OWN, "--yes", *at, "--json")
    assert done.code == 0, done.err
    assert done.json["board"] == "own"
    # A device that has just got its power cannot know that its coils are cold.
    assert set(done.json["standing"]) <= {"no table", "coil hot"}
    changed = {row["name"]: row["to"] for row in done.json["changed"]}
    assert changed["coil_gain"] == "0.8414, -0.8414, 1, 0.8414"
    assert changed["panel"] == "ft6x36"
    again = chladni("device", "config", "set", "--from", OWN, "--yes", *at, "--json")
    assert again.json == {"written": False, "changed": []}
    assert chladni("flash", own_file, *at, "--json").json["verified"]
    wait_for_coils(desk.port)
    begun = monotonic()
    touched = chladni("device", "touch", "30,10", "--seconds", "0.3", *at, "--json")
    assert touched.json["state"] == "playing"
    assert touched.json["place_mm"] == pytest.approx([30.0, 10.0], abs=0.002)
    assert 0.25 < touched.json["played_s"] < monotonic() - begun
    shown = chladni("device", "info", *at)
    assert "for own" in shown.out
    assert "panel fine" in shown.out


def test_a_table_that_cannot_play_yet_is_written(
    chladni: CommandLine, desk: Desk, table_file: Path
) -> None:
    """On blank flash: the title claims no more, and what stands in the way is said."""
    desk.on()
    done = chladni("flash", table_file, "--port", desk.port)
    assert done.code == 0
    assert f"{table_file.name}iswritten" in "".join(done.out.split())
    assert "never configured; chladni device config set --from BOARD" in done.err


@pytest.mark.parametrize("controller", ["ft6x36", "gt911", "find"])
def test_the_emulated_board_has_the_panel_that_its_file_names(
    chladni: CommandLine, controller: str, tmp_path: Path, own_file: Path
) -> None:
    """With another one it would look for the panel in vain, and never play."""
    board = tmp_path / "own.toml"
    board.write_text(OWN.read_text().replace('"ft6x36"', f'"{controller}"'))
    done = chladni(
        "emulate",
        own_file,
        "--board",
        board,
        "--touch",
        "5,5@20",
        "--ms",
        "100",
        "-o",
        tmp_path / "pins.npz",
        "--json",
    )
    assert done.code == 0, done.err
    assert 0.0 < done.json["latency_ms"] < 50.0


@pytest.mark.slow
def test_what_was_written_outlasts_a_pulled_plug(
    chladni: CommandLine, desk: Desk, own_file: Path
) -> None:
    """Configuration and table are there after it; a second device on the same flash is refused."""
    at = ("--port", desk.port)
    desk.on()
    assert chladni("device", "config", "set", "--from", OWN, "--yes", *at).code == 0
    assert chladni("flash", own_file, *at).code == 0
    with pytest.raises(InputError, match="no other device"):
        FlashFile(desk.flash)
    desk.off()
    desk.on()
    wait_for_coils(desk.port)
    shown = chladni("device", "info", *at, "--json").json
    assert (shown["board"], shown["config_status"], shown["state"]) == ("own", "ok", "idle")
    assert chladni("device", "touch", "5,5", "--seconds", "0.3", *at).code == 0


@pytest.mark.slow
def test_a_table_for_another_board_is_refused_before_anything_is_sent(
    chladni: CommandLine, desk: Desk, tmp_path: Path, table_file: Path, own_table: Table
) -> None:
    board = load_board(OWN)
    own, moved = own_table, tmp_path / "moved.chl"
    first, *rest = board.actuators
    other = replace(board, name="other", actuators=(replace(first, at=(0.0, 0.0)), *rest))
    moved.write_bytes(pack(replace(own, board_fingerprint=other.fingerprint(), board_name="other")))
    edited = tmp_path / "edited.chl"
    edited.write_bytes(pack(replace(own, board_fingerprint=other.fingerprint())))
    short = tmp_path / "short.chl"
    short.write_bytes(pack(replace(own, board_fingerprint=other.fingerprint() % 2**32)))
    desk.on()
    at = ("--port", desk.port)
    assert chladni("device", "config", "set", "--from", OWN, "--yes", *at).code == 0
    before = desk.flash.read_bytes()
    for file, words in (
        (table_file, "actuators: expected 4, the channels of the device, got 5"),
        (moved, "expected a table for own"),
        (edited, f"for the device's version of own (0x{board.fingerprint():016x})"),
        (edited, "for another version of its file (0x"),
        (short, f"for the device's version of own (…{board.fingerprint() % 2**32:08x})"),
        (short, "for another version of its file (…"),
    ):
        refused = chladni("flash", file, *at)
        assert refused.code == 2
        assert words in " ".join(refused.err.split())
        assert str(file) in refused.err
    # Not even --force makes five coils of four.
    assert chladni("flash", table_file, "--force", *at).code == 2
    assert desk.flash.read_bytes() == before
    assert chladni("flash", moved, "--force", *at).code == 0


def test_a_file_that_is_no_flash_is_refused_and_stays(chladni: CommandLine, tmp_path: Path) -> None:
    text, link = tmp_path / "notes", tmp_path / "link"
    text.write_text("not flash")
    link.symlink_to(text)
    for file in (text, link, tmp_path):
        done = chladni("emulate", "--serial", "--flash", file, "--ms", "10")
        assert done.code == 2
        assert "--flash" in done.err
    assert text.read_text() == "not flash"
    both = chladni("emulate", "t.chl", "--serial", "--flash", tmp_path / "new", "--ms", "10")
    assert (both.code, "does not go with --flash" in both.err) == (2, True)


def test_a_hidden_plate_is_of_a_board_that_is_served(chladni: CommandLine, tmp_path: Path) -> None:
    served = ("emulate", "--serial", "--flash", tmp_path / "new", "--ms", "10")
    for words, said in (
        (("emulate", "--hidden", "7"), "--serial"),
        ((*served, "--hidden", "7"), "--board"),
        ((*served, "--hidden", "x", "--board", "strip5"), "SEED, BOARD@SEED or FILE.toml"),
        ((*served, "--hidden", "phone5@7", "--board", "strip5"), "coils of strip5"),
        ((*served, "--hidden", "no.toml", "--board", "strip5"), "got 'no file no.toml'"),
    ):
        done = chladni(*words)
        assert (done.code, said in done.err) == (2, True), done.err
    assert chladni(*served, "--hidden", "7", "--board", "strip5").code == 0
    own = tmp_path / "bar.toml"
    own.write_bytes(board_file(replace(load_board("strip5"), name="bar"), []))
    other = ("emulate", "--serial", "--flash", tmp_path / "other", "--ms", "10")
    assert chladni(*other, "--hidden", "bar@7", "--board", own).code == 0


def test_a_new_flash_file_is_blank(tmp_path: Path) -> None:
    path = tmp_path / "new"
    held = FlashFile(path)
    assert path.read_bytes() == b"\xff" * sum(AREAS.values())
    assert {area: len(data) for area, data in held.contents.items()} == AREAS
    held.close()
    FlashFile(path).close()


def test_a_board_without_pins_or_with_others_than_the_chip_has_is_refused(
    chladni: CommandLine, tmp_path: Path
) -> None:
    no_pins, wrong = tmp_path / "no-pins.toml", tmp_path / "wrong.toml"
    text = OWN.read_text()
    no_pins.write_text(text.replace("pwm_pins = [25, 26, 27, 32]\n", ""))
    wrong.write_text(text.replace("25, 26, 27, 32", "25, 26, 27, 34"))
    for file, words in ((no_pins, "pwm_pins is required"), (wrong, "got 34")):
        done = chladni("device", "config", "set", "--from", file, "--yes", "--emulator")
        assert done.code == 2
        assert words in " ".join(done.err.split()), done.err


def test_a_device_that_becomes_another_boards_is_remarked_on(chladni: CommandLine) -> None:
    at = ("--board", "phone5", "--emulator", "--yes")
    done = chladni("device", "config", "set", "--from", "strip5", *at)
    assert done.code == 0
    assert "the device was set for phone5, and this sets it for strip5: wrong pins" in done.err
    assert "was set for" not in chladni("device", "config", "set", "--from", "phone5", *at).err
    none = chladni("device", "config", "set", "--from", "nosuch", *at)
    assert (none.code, "--from: expected a board file" in none.err) == (2, True)


def test_a_pulse_that_is_longer_than_the_file_says_is_told_why(chladni: CommandLine) -> None:
    """A switch's current stops below `least_duty`; a bridge's does not."""
    template = ROOT / "boards" / "template.toml"
    told = chladni("device", "config", "set", "--from", template, "--yes", "--emulator")
    assert told.code == 0
    assert "min_on_ns is 1088, not 100: least_duty, 0.085, needs pulses as long" in told.err
    bridges = chladni("device", "config", "set", "--from", "strip5", "--yes", "--emulator")
    assert "least_duty" not in bridges.err


def test_a_bridge_is_given_no_shortest_pulse(chladni: CommandLine) -> None:
    at = ("--board", "strip5", "--emulator", "--yes")
    refused = chladni("device", "config", "set", "min_on_ns=200", *at)
    assert refused.code == 2
    assert "min_on_ns: expected 0: this device has bridges, got 200; of a bridge" in refused.err
