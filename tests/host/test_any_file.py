"""Any bytes as a board, a table or duties: a result or a message, in bounded memory and work."""

from __future__ import annotations

import contextlib
import tomllib
import tracemalloc
from collections.abc import Callable, Iterator
from datetime import date, time
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chladni.host.device.stream_sources import read_duties
from chladni.sim.board.file import MOST_BYTES, board_from_document, load_board, shipped_boards
from chladni.sim.errors import MOST_FAULTS, InputError
from chladni.tables.format import pack, read_table
from made_up import make_table, with_crc
from soaking import tries

MOST_MEMORY = 30_000_000
"""Of one case; each file here has 64 KB at most."""
LONGEST_MESSAGE = 1500
"""A place, a value cut to 200 characters, what was expected, and a list of keys."""
ANY = settings(
    max_examples=tries(60, 1000),
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


def answers(read: Callable[[Path], object], path: Path, data: bytes) -> bool:
    """Whether there is a result; asserts that there is a short message otherwise."""
    path.write_bytes(data)
    message = ""
    tracemalloc.start()  # not before: what draws the cases would take ten times as long
    try:
        read(path)
    except InputError as error:
        message = str(error)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < MOST_MEMORY
    assert not message or path.name in message
    lines = message.splitlines()
    assert len(lines) <= MOST_FAULTS + 1
    assert all(len(line) < LONGEST_MESSAGE for line in lines)
    return not message


KEYS = st.sampled_from(
    [
        "name", "plate", "size_mm", "edges", "left", "drive", "frequency_hz", "image", "points",
        "regions", "pitch_mm", "electronics", "pwm_pins", "actuators", "at_mm", "screws",
        "radius_mm", "magnet", "coil", "panel", "controller", "foundation", "strips", "cut_outs",
        "finger", "motion_acts_back", "polarity", "support",
    ]
) | st.text("aé. \"\\", max_size=3)  # fmt: skip
VALUES = st.recursive(
    st.integers(-(2**70), 2**70)
    | st.floats()
    | st.booleans()
    | st.text(max_size=8)
    | st.sampled_from(["free", "clamped", "prototype", "gt911"])
    | st.dates(min_value=date(1, 1, 1))
    | st.times()
    | st.just(10**400),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


def toml(value: Any) -> str:
    """A value as TOML writes it inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{quoted(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (date, time)):
        return value.isoformat()
    return quoted(value) if isinstance(value, str) else str(value)


def quoted(text: str) -> str:
    return '"' + "".join(f"\\U{ord(c):08x}" for c in text) + '"'


SHIPPED = [path.read_text(encoding="utf-8") for path in shipped_boards().values()]
DOCUMENTS = [tomllib.loads(text) for text in SHIPPED]


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every (container, key) of a document."""
    keys = value.keys() if isinstance(value, dict) else range(len(value))
    for key in list(keys):
        yield value, key
        if isinstance(value[key], (dict, list)):
            yield from places(value[key])


@ANY
@given(document=st.dictionaries(KEYS, VALUES, max_size=8))
def test_any_document_is_a_board_or_is_refused(tmp_path: Path, document: dict[str, Any]) -> None:
    text = "\n".join(f"{quoted(key)} = {toml(value)}" for key, value in document.items())
    # A surrogate is no text; TOML refuses it.
    answers(load_board, tmp_path / "b.toml", text.encode())


@ANY
@given(
    document=st.sampled_from(range(len(DOCUMENTS))),
    changes=st.lists(st.tuples(st.integers(0, 10**6), VALUES), min_size=1, max_size=3),
)
def test_a_shipped_board_with_any_values_is_a_board_or_is_refused(
    tmp_path: Path, document: int, changes: list[tuple[int, Any]]
) -> None:
    board = tomllib.loads(SHIPPED[document])
    for where, value in changes:
        all_places = list(places(board))
        container, key = all_places[where % len(all_places)]
        container[key] = value
    with contextlib.suppress(InputError):
        board_from_document(board)
    text = "\n".join(f"{quoted(key)} = {toml(value)}" for key, value in board.items())
    answers(load_board, tmp_path / "b.toml", text.encode())


JUNK = [b"[[", b"{", b"'''", b'"""', b"=", b".a", b"1e9"]


@ANY
@given(
    text=st.sampled_from(SHIPPED),
    begin=st.integers(0, 3000),
    cut=st.integers(0, 40),
    put=st.binary(max_size=20) | st.sampled_from(JUNK),
    times=st.sampled_from([1, 2, 300, 30_000]),
)
def test_a_shipped_board_with_any_bytes_is_a_board_or_is_refused(
    tmp_path: Path, text: str, begin: int, cut: int, put: bytes, times: int
) -> None:
    data = text.encode()
    changed = data[:begin] + put * times + data[begin + cut :]
    answers(load_board, tmp_path / "b.toml", changed[: 2 * MOST_BYTES])


def test_boards_that_are_right_are_no_message(tmp_path: Path) -> None:
    """What is asserted above of messages would be true if all were refused."""
    for text in SHIPPED:
        assert answers(load_board, tmp_path / "b.toml", text.encode())
        written = "\n".join(f"{quoted(k)} = {toml(v)}" for k, v in tomllib.loads(text).items())
        assert answers(load_board, tmp_path / "b.toml", written.encode())


TABLE = pack(make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]])))


@ANY
@given(
    changes=st.lists(st.tuples(st.integers(0, len(TABLE)), st.binary(max_size=4)), max_size=4),
    cut=st.integers(0, 8),
    is_believed=st.booleans(),
)
def test_any_change_of_a_tables_bytes_is_a_table_or_is_refused(
    tmp_path: Path, changes: list[tuple[int, bytes]], cut: int, is_believed: bool
) -> None:
    data = bytearray(TABLE)
    for at, put in changes:
        data[at : at + len(put)] = put
    del data[len(data) - cut :]
    changed = with_crc(data) if is_believed and len(data) > 4 else bytes(data)
    path = tmp_path / "t.chl"
    if answers(read_table, path, changed):
        # What is read is what the file says, to the bit.
        assert pack(read_table(path)) == changed


CELLS = (
    st.floats().map(repr) | st.integers().map(str) | st.text("0123456789.,e+-#nai \t", max_size=9)
)


@ANY
@given(
    rows=st.lists(st.lists(CELLS, max_size=5).map(",".join), max_size=6),
    end=st.binary(max_size=9),
    mark=st.sampled_from([b"", b"\xef\xbb\xbf"]),
)
def test_any_rows_are_duties_or_are_refused(
    tmp_path: Path, rows: list[str], end: bytes, mark: bytes
) -> None:
    path = tmp_path / "d.csv"
    if answers(read_duties, path, mark + "\n".join(rows).encode() + end):
        duties = read_duties(path)
        assert duties.dtype == np.float64
        assert duties.ndim == 2
        assert duties.size > 0
