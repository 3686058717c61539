"""Every error text stands on the page of messages, and the page has no others."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import list_messages
import pytest
from list_messages import OWN, PAGE, group_of, messages, page, read_sources

from chladni.host.cli.common.options import check_one_of
from chladni.sim.errors import (
    ChladniError,
    InputError,
    ResonanceError,
    ToleranceError,
    TooLargeError,
)
from conftest import ROOT, CommandLine

NEW = "tables/chladni/tables/new.py"
ERRORS = "sim/chladni/sim/errors.py"


@pytest.fixture
def few() -> dict[str, str]:
    """Where the errors are declared: all sources take two seconds."""
    return {ERRORS: (ROOT / ERRORS).read_text("utf-8")}


def listed() -> list[str]:
    return [
        line.removeprefix("- ").strip("` ")
        for line in PAGE.read_text("utf-8").splitlines()
        if line.startswith("- `")
    ]


def is_listed(message: str) -> bool:
    """Whether a message is one of the page's that says more than holes."""
    for text in listed():
        parts = re.split("‹[^›]*›", text)
        pattern = ".*".join(re.escape(part) for part in parts)
        if len("".join(parts)) > 12 and re.fullmatch(pattern, message, re.DOTALL):
            return True
    return False


def test_the_page_is_up_to_date() -> None:
    assert page(read_sources()) == PAGE.read_text("utf-8"), "run tools/docs/list_messages.py"


def test_a_message_stands_once() -> None:
    texts = listed()
    assert len(texts) > 300
    assert len(texts) == len(set(texts))


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ('raise InputError("depth_mm", 3, "at most 2; dig less")',
         "depth_mm: expected at most 2, got 3; dig less"),
        ('raise MissingError("depth_mm", f"the {pit} needs one")',
         "depth_mm is required: the ‹pit› needs one"),
        ('raise ConflictError("--deep", "--flat")', "--deep does not go with --flat"),
        ('raise ChladniError(f"{pit:g} caved in")', "‹pit› caved in"),
        ('raise OwnError("a pit")', "a pit"),
        ('return InputError("pit", pit, "a pit" if deep else "a dent")',
         "pit: expected a dent, got ‹pit›"),
    ],
)  # fmt: skip
def test_a_new_error_is_missed_on_the_page(source: str, told: str, few: dict[str, str]) -> None:
    body = f"class OwnError(ChladniError):\n    pass\n\ndef f(pit, deep):\n    {source}\n"
    assert told in messages(few | {NEW: body})["Tables"]
    assert told not in listed()
    assert f"\n- `{told}`\n" in page(few | {NEW: body})


def test_a_new_error_makes_the_check_fail(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    new = read_sources() | {NEW: 'raise InputError("depth_mm", 3, "at most 2")\n'}
    monkeypatch.setattr(list_messages, "read_sources", lambda: new)
    monkeypatch.setattr(sys, "argv", ["list_messages.py", "--check"])
    assert list_messages.main() == 1
    assert "run tools/docs/list_messages.py" in capsys.readouterr().out


def test_a_text_is_followed_to_where_it_is_given(few: dict[str, str]) -> None:
    """Through a name of one branch, a function that gives it, and the caller of a helper."""
    body = """
def word(big):
    return "a hill" if big else "a mole's"

def check_heap(where, big):
    expected = "never this"
    if big:
        expected = f"{word(big)} at most"
        raise InputError(where, big, expected)

def caller():
    check_heap("heap", True)
"""
    assert messages(few | {NEW: body})["Tables"] == [
        "heap: expected a hill at most, got ‹big›", "heap: expected a mole's at most, got ‹big›",
    ]  # fmt: skip


def test_a_source_without_a_group_is_an_error() -> None:
    with pytest.raises(SystemExit, match="no group"):
        group_of("elsewhere/x.py")


REAL: list[tuple[object, ...]] = [
    ("board", "show", "no-such"),
    ("board", "show", ROOT / "boards/specs/small.toml"),
    ("solve", "prototype", "--target", "900,0"),
    ("solve", "prototype", "--target", "there"),
    ("solve", "prototype", "--target", "0,0", "--objective", "focus", "--method", "nearest"),
    ("table", "show", ROOT / "README.md"),
    ("table", "build", "prototype", "-o", "no/such/folder/t.chl"),
    ("emulate", "t.chl", "--serial", "--flash", "new"),
    ("device", "touch", "5,5", "--emulator"),
    ("device", "config", "set", "level=7", "--emulator"),
    ("device", "info"),
    ("flash", "t.chl", "--rom", "--emulator"),
    ("design", ROOT / "boards/prototype.toml", "-o", "b.toml"),
]


@pytest.mark.parametrize("arguments", REAL, ids=lambda words: " ".join(map(str, words))[:40])
def test_what_the_program_prints_is_on_the_page(
    chladni: CommandLine, arguments: tuple[object, ...], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    done = chladni(*arguments)
    assert done.code in (1, 2)
    message = done.err.strip().removeprefix("chladni: ")
    # The name of the file that is wrong comes before a message.
    assert is_listed(message) or is_listed(message.partition(", ")[2]), message


def test_errors_that_make_their_own_text_are_on_the_page() -> None:
    made: list[ChladniError] = [
        ToleranceError(0.1, 1e-4, "a and b"), ResonanceError(160.0, 160.0, "(1, 1)"),
        TooLargeError("a field", 3e9, 2e9, "--points"),
    ]  # fmt: skip
    with pytest.raises(InputError) as several:
        check_one_of(one=True, two=True)
    for error in [*made, several.value]:
        assert is_listed(str(error)) or " does not go with " in str(error), str(error)
    assert OWN.keys() == {"ToleranceError", "ResonanceError", "TooLargeError"}
