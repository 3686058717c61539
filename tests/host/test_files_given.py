"""Every file that a command is given: bounded, regular, and refused in words."""

from __future__ import annotations

import ast
import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from chladni.host.protocol.network import make_key
from conftest import ROOT, CommandLine

EMULATED = ("--emulator",)
# Every option and argument that names a file to be read; "@" is the file, "&" a good key.
READING = {
    "BOARD": ("board", "show", "@"),
    "TABLE": ("table", "show", "@"),
    "--table": ("device", "info", "--emulator", "--table", "@"),
    "--key": ("device", "info", "--udp", "127.0.0.1", "--key", "@"),
    "--passphrase-file": (
        "device", "network", "set", "--ssid", "x", "--key", "&", "--passphrase-file", "@",
        *EMULATED,
    ),
    "--csv": ("device", "stream", "--csv", "@", *EMULATED),
    "--script": ("device", "stream", "--script", "@", *EMULATED),
    "--drive": ("field", "paper", "--drive", "@", "-o", "f.npz"),
    "--firmware": ("flash", "--firmware", "@", "--port", "/dev/null"),
    "--trace": (
        "solve", "paper", "--target", "0,0", "--method", "anneal", "--steps", "2", "--trace", "@",
    ),
    "--flash": ("emulate", "--serial", "--ms", "1", "--flash", "@"),
}  # fmt: skip


def huge(path: Path) -> None:
    """Eight gigabytes that take no room on the disk."""
    with path.open("wb") as file:
        file.truncate(8_000_000_000)


MAKERS: dict[str, Callable[[Path], None]] = {
    "pipe": os.mkfifo,
    "device": lambda path: path.symlink_to("/dev/zero"),
    "folder": Path.mkdir,
    "huge": huge,
}
MOST_MEMORY = 400_000_000
"""Solving a board's plate takes 180 million; a file here has eight thousand million."""


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("option", READING)
def test_what_is_no_file_of_a_right_size_is_refused(
    chladni: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, option: str, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "key").mkdir()
    make_key(tmp_path / "key" / "good")
    MAKERS[kind](tmp_path / "given")
    words = {"@": "given", "&": "key/good"}
    tracemalloc.start()
    answer = chladni(*(words.get(part, part) for part in READING[option]))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert answer.code == 2, answer.err
    assert answer.out == ""
    assert "given" in answer.err
    assert option in answer.err
    assert answer.err.count("\n") == 1
    assert peak < MOST_MEMORY
    assert sorted(own.name for own in tmp_path.iterdir()) == ["given", "key"]


OPENS = {
    "open", "os.open", "io.open", "np.load", "np.loadtxt", "np.fromfile", "np.genfromtxt",
    "np.save", "np.savez", "np.savez_compressed", "tempfile.mkstemp", "json.load", "tomllib.load",
}  # fmt: skip
OPENING_METHODS = {"read_text", "read_bytes", "write_text", "write_bytes", "open"}
KNOWN = {
    "sim/files.py",  # where reading and writing live
    "drives/checkpoint.py",  # what files.py opened
    "host/device/stream_sources.py",  # lines that files.py read
    "host/device/wires/wire.py",  # a serial port
    "host/cli/common/ending.py",  # /dev/null
    "host/studio/export.py",  # the page, which is part of the program
}


def opens(call: ast.Call) -> bool:
    """Whether a call is one that opens a file, or may."""
    name = ast.unparse(call.func)
    is_method = isinstance(call.func, ast.Attribute) and call.func.attr in OPENING_METHODS
    return name in OPENS or is_method


def test_files_are_opened_in_one_place() -> None:
    """A new way to a file goes through sim/files.py, where the bounds are, or is argued here."""
    found = set()
    for package in ("sim", "tables", "host"):
        folder = ROOT / package / "chladni"
        for path in folder.rglob("*.py"):
            tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if any(isinstance(node, ast.Call) and opens(node) for node in tree):
                found.add(path.relative_to(folder).as_posix())
    assert found == KNOWN


HOSTILE = {
    "lists": ("x = " + "[" * 30_000, "16 deep"),
    "blocks": ("x = " + "{a = " * 10_000, "16 deep"),
    "lists that close": ("x = " + "[" * 200 + "]" * 200, "16 deep"),
    "blocks by a key": (".".join("a" * 200) + " = 1", "16 deep"),
    "a key of 20,000 parts": (".".join("a" * 20_000) + " = 1", "19999 dots"),
    "a heading of 20,000 parts": ("[" + ".".join("a" * 20_000) + "]", "19999 dots"),
    "many long keys": ("\n".join(f"k{k}." + ".".join("a" * 250) + " = 1" for k in range(120)),
                       "16 deep"),
    "400 digits": ("x = " + "9" * 400, "an integer of 64 bits"),
    "5000 digits": ("x = " + "9" * 5000, "integers of 64 bits"),
    "hexadecimal digits": ("x = 0x" + "f" * 50_000, "an integer of 64 bits"),
    "a long key": ("a" * 60_000 + " = 1", "a known key"),
    "a long value": ("name = 1\ndrive = 1\nimage = 1\nregions = 1\nelectronics = 1\n"
                     "actuators = 1\nplate = '" + "a" * 60_000 + "'", "got 'aaa"),
    "a key that moves the cursor": ('"\\u001b[2J" = 1', "a known key"),
    "no date": ("x = 1979-02-30", "TOML"),
    "too large": ("#" * 70_000, "at most 65,536 bytes"),
    "another encoding": ("name = 'ß'", "UTF-8"),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_a_board_file_that_costs_more_than_it_says_is_refused(
    chladni: CommandLine, tmp_path: Path, case: str
) -> None:
    text, named = HOSTILE[case]
    path = tmp_path / "b.toml"
    path.write_text(text, encoding="latin-1")
    answer = chladni("board", "show", path)
    assert answer.code == 2
    assert "b.toml, " in answer.err
    assert named in answer.err
    lines = answer.err.split("\n")
    assert lines.pop() == ""
    # A line for each key that is wrong.
    assert len(lines) <= 8
    assert all(line.startswith(f"chladni: {path}, ") and len(line) < 1000 for line in lines)
    assert all(line.isprintable() for line in lines)


def test_integers_out_of_range_are_refused_where_they_stand(
    chladni: CommandLine, tmp_path: Path
) -> None:
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    path = tmp_path / "b.toml"
    path.write_text(text.replace("thickness_mm = 1.0", "thickness_mm = " + "9" * 400))
    answer = chladni("board", "show", path)
    assert answer.code == 2
    assert "b.toml, plate.thickness_mm: expected an integer of 64 bits" in answer.err


@pytest.mark.parametrize(
    "text",
    [
        "",
        " \n",
        "# nothing\n",
        "0.1," * 400 + "0.1",
        "a,b",
        "0.1\n0.1,0.2",
        "nan",
        "1e400",
        "0x1",
        "2.0",
        "\x00",
        "1+0j",
        "0.1;0.2",
    ],
)
def test_rows_that_are_no_duties_are_refused(
    chladni: CommandLine, tmp_path: Path, text: str
) -> None:
    path = tmp_path / "d.csv"
    path.write_text(text)
    answer = chladni("device", "stream", "--csv", path, "--emulator")
    assert answer.code == 2
    assert "d.csv, --csv: expected " in answer.err
    assert answer.err.count("\n") == 1


def test_a_packed_csv_is_not_unpacked(chladni: CommandLine, tmp_path: Path) -> None:
    """NumPy would, by the name's ending, and a thousand times as much may come out."""
    import gzip  # noqa: PLC0415

    path = tmp_path / "d.csv.gz"
    path.write_bytes(gzip.compress(b"0.1,0.1,0.1,0.1,0.1\n"))
    answer = chladni("device", "stream", "--csv", path, "--emulator")
    assert answer.code == 2
    assert "rows of numbers" in answer.err
