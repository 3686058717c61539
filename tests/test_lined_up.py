"""A formatter is told to leave a statement alone only where its rows are read as a table."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from conftest import ROOT

MARK = "# fmt: " + "skip"
MADE_OF_ROWS = 3
PACKED = 8
"""So many constants in a display are more than one would read one below the other."""


def marked(text: str) -> list[tuple[int, ast.AST | None]]:
    """Lines with a mark, and what ends there: a statement, or the call that decorates one."""
    nodes = list(ast.walk(ast.parse(text)))
    decorators = [one for node in nodes for one in getattr(node, "decorator_list", [])]
    simple = [n for n in nodes if isinstance(n, ast.stmt) and not hasattr(n, "body")]
    ends = {node.end_lineno: node for node in (*simple, *decorators)}
    lines = enumerate(text.splitlines(), 1)
    return [(number, ends.get(number)) for number, line in lines if line.endswith(MARK)]


def elements(node: ast.AST) -> Iterator[tuple[bool, list[ast.expr]]]:
    """Of every display and call in a node: whether it is a display, and what it holds."""
    for one in ast.walk(node):
        if isinstance(one, ast.List | ast.Tuple | ast.Set):
            yield True, one.elts
        elif isinstance(one, ast.Dict):
            yield True, one.values
        elif isinstance(one, ast.Call):
            yield False, one.args


def is_table(node: ast.AST | None) -> bool:
    """Whether it has records that begin on lines of their own, or many constants."""
    for is_display, own in elements(node) if node is not None else ():
        records = [e for e in own if isinstance(e, ast.Tuple | ast.List | ast.Dict | ast.Call)]
        if len({one.lineno for one in records}) >= MADE_OF_ROWS:
            return True
        plain = (ast.Constant, ast.Name, ast.Attribute, ast.UnaryOp)
        if is_display and len(own) >= PACKED and all(isinstance(e, plain) for e in own):
            return True
    return False


def misplaced(paths: list[Path]) -> list[str]:
    """Marks that stand at no table, as file and line."""
    texts = [(path, path.read_text(encoding="utf-8")) for path in paths]
    return [
        f"{path.name}:{line}"
        for path, text in texts
        if MARK in text
        for line, node in marked(text)
        if not is_table(node)
    ]


def test_only_tables_are_lined_up_by_hand() -> None:
    rooms = ("sim", "tables", "host", "bench", "examples", "tests", "tools")
    assert misplaced([path for room in rooms for path in (ROOT / room).rglob("*.py")]) == []


@pytest.mark.parametrize(
    ("text", "is_one"),
    [
        ("A = {\n  'a': (1, 2),\n  'b': (3, 4),\n  'c': (5, 6),\n}", True),
        ("A = (1, 2, 3, 4,\n  5, 6, 7, -8)", True),
        ("@mark([\n  (1, 2),\n  (3, 4),\n  (5, 6),\n])", True),
        ("A = f(1, 2,\n  3, 4, 5, 6, 7, 8)", False),
        ("A = {'a': (1, 2), 'b': (3, 4),\n  'c': (5, 6)}", False),
        ("assert all(\n  f(x) for x in y)", False),
        ("A = (1, 2,\n  x + 1, 4, 5, 6, 7, 8)", False),
    ],
)
def test_a_table_is_told_from_a_long_line(tmp_path: Path, text: str, is_one: bool) -> None:
    path = tmp_path / "a.py"
    decorated = "\ndef f(): pass" if text.startswith("@") else ""
    path.write_text(f"{text}  {MARK}{decorated}\n", encoding="utf-8")
    assert (misplaced([path]) == []) is is_one
