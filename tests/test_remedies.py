"""Every error that a user can meet names a remedy."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from chladni.sim.errors import ChladniError, ConflictError, InputError, MissingError
from conftest import ROOT

SOURCES = [path for room in ("sim", "tables", "host") for path in (ROOT / room).rglob("*.py")]
BASE = "ChladniError"
# Its message says what would have been right, what is missing, or what to leave out.
WANTED = "InputError"
# It makes no text of its own but hands text and hint on.
HAND_ON = {"LinkError"}
# Ctrl-C: whoever pressed it knows why.
NEEDS_NONE = {"StoppedError"}


class Errors(ast.NodeVisitor):
    """What each error derives from, which make their own text, and where each is made."""

    def __init__(self, source: str) -> None:
        self.parents: dict[str, str] = {}
        self.own_text: set[str] = set()
        self.made: list[tuple[str, ast.Call]] = []
        self._owner = ""
        self.visit(ast.parse(source))

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.parents[node.name] = ast.unparse(node.bases[0]) if node.bases else ""
        outer, self._owner = self._owner, node.name
        self.generic_visit(node)
        self._owner = outer

    def visit_Call(self, node: ast.Call) -> None:
        name = ast.unparse(node.func)
        if name == "super().__init__" and self._owner:
            self.own_text.add(self._owner)
            name = self.parents.get(self._owner, "")
        self.made.append((name, node))
        self.generic_visit(node)


def without_remedy(files: dict[str, Errors]) -> list[str]:
    """Places where an error is made without a hint and without saying what is wanted."""
    parents = {own: base for errors in files.values() for own, base in errors.parents.items()}

    def is_a(name: str, base: str) -> bool:
        return name == base or (name in parents and is_a(parents[name], base))

    own_text = {name for errors in files.values() for name in errors.own_text} - {BASE} - HAND_ON
    return [
        f"{file}, line {call.lineno}: {ast.unparse(call)[:80]}"
        for file, errors in files.items()
        for name, call in errors.made
        if is_a(name, BASE)
        and not is_a(name, WANTED)
        and name not in NEEDS_NONE
        and name not in own_text
        and not any(word.arg == "hint" for word in call.keywords)
    ]


@pytest.fixture(scope="module")
def files() -> dict[str, Errors]:
    return {str(path.relative_to(ROOT)): Errors(path.read_text("utf-8")) for path in SOURCES}


def test_every_error_names_a_remedy(files: dict[str, Errors]) -> None:
    missing = without_remedy(files)
    assert not missing, "give each a hint=:\n" + "\n".join(missing)


@pytest.mark.parametrize(
    ("source", "is_found"),
    [
        ('raise LinkError("gone")', True),
        ('raise LinkError("gone", hint="plug it in")', False),
        ('raise InputError("depth_mm", 3, "at most 2")', False),
        ("raise ResonanceError(160.0, 160.0, '1')", False),
        ('class OwnError(ChladniError):\n    def __init__(self):\n        super().__init__("a")',
         True),
    ],
)  # fmt: skip
def test_an_error_without_a_remedy_is_found(
    source: str, is_found: bool, files: dict[str, Errors]
) -> None:
    assert bool(without_remedy(files | {"new.py": Errors(source)})) is is_found


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("depth_mm", 3, "at most 2"), "depth_mm: expected at most 2, got 3"),
        (InputError("depth_mm", 3, "at most 2", file="pit.toml", hint="dig less"),
         "pit.toml, depth_mm: expected at most 2, got 3; dig less"),
        (MissingError("depth_mm", "the pit needs one", hint="2 will do"),
         "depth_mm is required: the pit needs one; 2 will do"),
        (ConflictError("--deep", "--flat", hint="dig"), "--deep does not go with --flat; dig"),
        (ChladniError("the pit caved in", hint="dig again"), "the pit caved in; dig again"),
    ],
)  # fmt: skip
def test_a_hint_ends_the_message(error: ChladniError, message: str) -> None:
    assert str(error) == message


def test_a_hint_stays_where_a_message_changes() -> None:
    error = InputError("depth_mm", 3, "at most 2", hint="dig less").in_file(str(Path("pit.toml")))
    assert str(error) == "pit.toml, depth_mm: expected at most 2, got 3; dig less"
