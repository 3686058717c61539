"""Checkpoints: what was kept comes back, and nothing that is not a checkpoint is touched."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import zlib
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.drives.checkpoint import MAGIC, Checkpoint
from chladni.sim.errors import InputError
from conftest import CommandLine

KEY = {"seed": 1}
WHOLE_KEY = {"chladni": version("chladni"), **KEY}


class KilledError(Exception):
    pass


def kept_in(path: Path, **results: float) -> bytes:
    """The bytes of a checkpoint whose work was cut off."""
    with contextlib.suppress(KilledError), Checkpoint(path, KEY) as checkpoint:
        for name, value in results.items():
            checkpoint.put(name, {"value": value})
        raise KilledError
    return path.read_bytes()


def lines_of(*lines: str | bytes) -> bytes:
    """A file of these lines with right checksums: what someone makes who wants to be believed."""
    data, crc = MAGIC, 0
    for line in lines:
        text = line.encode() if isinstance(line, str) else line
        crc = zlib.crc32(text, crc)
        data += f"{crc:08x} ".encode() + text + b"\n"
    return data


def entry(name: object, result: object) -> str:
    return json.dumps({"name": name, "result": result})


FOREIGN = {
    "text": b"dear diary\n",
    "no end of line": b"dear diary",
    "an older one": b'{"seed": 1}\n',
    "zeros": bytes(100),
    "binary": b"\xff\xfe\x00",
    "half a mark": MAGIC[:-1] + b"x\n",
}


@pytest.mark.parametrize("case", FOREIGN)
def test_a_file_that_is_no_checkpoint_is_left_as_it_is(tmp_path: Path, case: str) -> None:
    path = tmp_path / "y.chl.partial"
    path.write_bytes(FOREIGN[case])
    with pytest.raises(InputError, match=r"y.chl.partial, checkpoint: expected .*move it away"):
        Checkpoint(path, KEY).__enter__()
    assert path.read_bytes() == FOREIGN[case]


@pytest.mark.parametrize("kind", ["file", "checkpoint", "nothing"])
@pytest.mark.parametrize("command", ["build", "compare"])
def test_a_link_at_a_checkpoints_name_is_not_followed(
    chladni: CommandLine, tmp_path: Path, kind: str, command: str
) -> None:
    ending = {"build": ".chl", "compare": ".csv"}[command]
    other, output = tmp_path / "precious", tmp_path / f"y{ending}"
    if kind == "file":
        other.write_bytes(b"dear diary\n")
    elif kind == "checkpoint":
        kept_in(other, a=1.0)
    before = other.read_bytes() if other.exists() else None
    Path(f"{output}.partial").symlink_to(other)
    words = {
        "build": ("table", "build", "prototype"),
        "compare": ("compare", "prototype", "--methods", "nearest"),
    }
    answer = chladni(*words[command], "-o", output)
    assert answer.code == 2
    assert ".partial, checkpoint: expected a regular file, not a link, got 'a link'" in answer.err
    assert (other.read_bytes() if other.exists() else None) == before
    assert not output.exists()


@pytest.mark.parametrize("make", [os.mkfifo, Path.mkdir])
def test_what_is_no_file_at_a_checkpoints_name_neither_hangs_nor_ends_in_a_traceback(
    tmp_path: Path, make: Callable[[Path], None]
) -> None:
    path = tmp_path / "y.chl.partial"
    make(path)
    with pytest.raises(InputError, match="a regular file"):
        Checkpoint(path, KEY).__enter__()


CHANGED: dict[str, Callable[[bytes], bytes]] = {
    "a bit": lambda data: data.replace(b"1.5", b"1.7"),
    "a line less": lambda data: b"".join(data.splitlines(keepends=True)[::2]),
    "lines turned round": lambda data: b"".join(
        data.splitlines(keepends=True)[:1] + data.splitlines(keepends=True)[:0:-1]
    ),
    "a line twice": lambda data: data + data.splitlines(keepends=True)[-1],
    "zeros behind": lambda data: data + bytes(50) + b"\n",
}


@pytest.mark.parametrize("case", CHANGED)
def test_a_checkpoint_that_was_changed_is_refused_by_its_checksum(
    tmp_path: Path, case: str
) -> None:
    path = tmp_path / "y.chl.partial"
    changed = CHANGED[case](kept_in(path, a=1.5, b=2.5))
    path.write_bytes(changed)
    with pytest.raises(InputError, match="CRC-32 differs"):
        Checkpoint(path, KEY).__enter__()
    assert path.read_bytes() == changed


MALFORMED = [
    entry("a", {"value": float("nan")}),
    entry("a", {"value": [[float("-inf")]]}),
    '{"name": "a", "result": {"value": 1e999}}',
    entry("a", [1]),
    entry(["a"], {}),
    entry(1, {}),
    '{"name": "a"}',
    "[]",
    "1",
    "no json",
    '"' + "\\ud800" + '"',
    "[" * 100_000,
    '{"name": "a", "result": {"value": ' + "9" * 5000 + "}}",
    b"\xff",
]


@pytest.mark.parametrize("line", MALFORMED, ids=range(len(MALFORMED)))
def test_results_that_cannot_be_are_refused_although_their_checksum_is_right(
    tmp_path: Path, line: str | bytes
) -> None:
    path = tmp_path / "y.chl.partial"
    data = lines_of(json.dumps(WHOLE_KEY), line)
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"y.chl.partial, checkpoint: expected"):
        Checkpoint(path, KEY).__enter__()
    assert path.read_bytes() == data


# Right for any work, and wrong for the one whose results they should be.
OF_A_TABLE = [
    {"drive": []}, {"drive": [[0.1, 0.2]] * 4}, {"drive": [[0.1]] * 5}, {"drive": "abcde"},
    {"drive": [[0.1, 2.0]] * 5}, {"drive": [["0.1", 0.2]] * 5}, {"drive": [[True, 0.2]] * 5},
    {"drive": [[0.1, 0.2]] * 5, "more": 1}, {},
]  # fmt: skip
OF_A_COMPARISON: list[dict[str, Any]] = [
    {},
    {"rows": 1},
    {"rows": []},
    {"rows": [1, 2, 3]},
    {
        "rows": [
            {"method": m, "objective": o, "numbers": {}}
            for m, o in (("nearest", "ssim"), ("silent", "–"), ("misplaced", "–"))
        ]
    },
]


@pytest.mark.parametrize(
    ("command", "result"),
    [("build", r) for r in OF_A_TABLE] + [("compare", r) for r in OF_A_COMPARISON],
)
def test_results_of_another_kind_are_refused(
    chladni: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: str,
    result: dict[str, Any],
) -> None:
    """The key is the work's own, taken from the file that a work cut off leaves."""
    words = {
        "build": ("table", "build", "prototype", "-o", tmp_path / "y"),
        "compare": ("compare", "prototype", "--methods", "nearest", "-o", tmp_path / "y"),
    }[command]

    def cut_off(*_: object) -> None:
        raise KilledError

    with monkeypatch.context() as patched:
        patched.setattr(Checkpoint, "_leave", lambda *_, **__: None)
        patched.setattr(Checkpoint, "get", cut_off)
        with pytest.raises(KilledError):
            chladni(*words)
    path = tmp_path / "y.partial"
    key = path.read_bytes().removeprefix(MAGIC)[9:-1]
    path.write_bytes(lines_of(key, entry("0.0,0.0", result)))
    answer = chladni(*words)
    assert answer.code == 2, answer.err
    assert "y.partial, checkpoint: expected a result of this work" in answer.err
    assert not (tmp_path / "y").exists()


def test_a_number_that_is_not_finite_is_not_kept(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "x.partial", KEY) as checkpoint:
        with pytest.raises(ValueError, match="JSON"):
            checkpoint.put("a", {"value": float("nan")})
        assert checkpoint.get("a") is None


def test_a_second_process_is_refused_while_the_first_works(tmp_path: Path) -> None:
    path = tmp_path / "x.partial"
    with Checkpoint(path, KEY) as first:
        first.put("a", {"value": 1.0})
        with pytest.raises(InputError, match="got 'in use'"):
            Checkpoint(path, KEY).__enter__()
        first.put("b", {"value": 2.0})
        assert len(path.read_bytes().splitlines()) == 3


def test_only_the_file_that_was_opened_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "x.partial"
    with Checkpoint(path, KEY):
        path.unlink()
        path.write_bytes(b"dear diary")
    assert path.read_bytes() == b"dear diary"


def test_a_line_torn_anywhere_costs_that_line_alone(tmp_path: Path) -> None:
    path = tmp_path / "x.partial"
    data = kept_in(path, a=1.5, b=2.5)
    for size in range(len(data) + 1):
        path.write_bytes(data[:size])
        whole = data[:size].count(b"\n")
        with contextlib.suppress(KilledError), Checkpoint(path, KEY) as checkpoint:
            assert (checkpoint.get("a") is not None) == (whole > 1)
            assert (checkpoint.get("b") is not None) == (whole > 2)
            checkpoint.put("c", {"value": 3.5})
            raise KilledError
        with Checkpoint(path, KEY) as checkpoint:
            assert checkpoint.get("c") == {"value": 3.5}
        path.unlink()


@pytest.mark.parametrize("results", [0, 1])
def test_a_full_disk_leaves_what_was_kept_and_no_torn_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, results: int
) -> None:
    path = tmp_path / "x.partial"
    if results:
        kept_in(path, a=1.5)
    before = path.read_bytes() if results else None
    checkpoint = Checkpoint(path, KEY)
    real = os.fdopen

    def on_a_full_disk(handle: int, mode: str, **options: Any) -> Any:
        file = real(handle, mode, **options)
        return Filling(file) if mode == "r+b" else file

    monkeypatch.setattr(os, "fdopen", on_a_full_disk)
    with pytest.raises(OSError, match="No space left") as caught, checkpoint:
        checkpoint.put("b", {"value": 2.5})
    assert caught.value.filename == str(path)
    assert (path.read_bytes() if path.exists() else None) == before


class Filling:
    """A file whose disk takes five more bytes."""

    def __init__(self, file: Any) -> None:
        self._file, self._left = file, 5

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> Filling:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def write(self, data: bytes) -> int:
        if not self._left:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = int(self._file.write(data[: self._left]))
        self._left -= count
        return count


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=10,
)
NAMES = st.sampled_from(["name", "result", "seed"])


@settings(max_examples=300, deadline=None)
@given(
    lines=st.lists(
        st.dictionaries(NAMES, VALUES).map(json.dumps)
        | VALUES.map(json.dumps)
        | st.builds(entry, st.text(max_size=3), st.dictionaries(st.text(max_size=3), VALUES)),
        max_size=4,
    ),
    begin=st.integers(0, 400),
    cut=st.integers(0, 30),
    put=st.binary(max_size=8),
    is_own=st.booleans(),
    is_mutated=st.booleans(),
)
def test_any_file_gives_results_or_words_and_is_not_lost(
    tmp_path_factory: pytest.TempPathFactory,
    lines: list[str],
    begin: int,
    cut: int,
    put: bytes,
    is_own: bool,
    is_mutated: bool,
) -> None:
    path = tmp_path_factory.mktemp("any") / "x.partial"
    data = lines_of(*([json.dumps(WHOLE_KEY)] if is_own else []), *lines)
    if is_mutated:
        data = data[:begin] + put + data[begin + cut :]
    path.write_bytes(data)
    refused = ""
    try:
        with Checkpoint(path, KEY) as checkpoint:
            assert data == b"" or data.startswith(MAGIC) or MAGIC.startswith(data)
            for name in list(checkpoint._done):
                json.dumps(checkpoint.get(name), allow_nan=False)
            checkpoint.put("another name", {"value": 1.0})
    except InputError as error:
        refused = str(error)
    assert not refused or ("x.partial" in refused and path.read_bytes() == data)
