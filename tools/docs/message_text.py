"""The text of an error as its source says it, with what is only known later as ‹holes›."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterable
from dataclasses import dataclass, field

MOST_VARIANTS = 12
"""Alternatives of one message that are told apart; beyond that a part becomes a hole."""

DEEPEST = 4
"""Names and functions that are followed, one within another."""

SEE_THROUGH = {"str", "repr", "int", "float", "list", "tuple", "sorted", "map", "round", "abs",
               "max", "min", "set", "Path", "in_mm", "join", "bool", "type"}  # fmt: skip
"""Calls that stand for what they are given."""

OF_TEXT = {"lower", "upper", "strip", "lstrip", "rstrip", "hex", "encode", "decode", "splitlines",
           "replace", "partition", "split", "get", "items", "keys", "values", "tobytes",
           "tolist"}  # fmt: skip
"""Methods that stand for what they belong to."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Given:
    """An expression that a name was given, and where."""

    value: ast.expr
    line: int
    column: int


@dataclass
class Names:
    """What names mean where a message is made.

    Attributes
    ----------
    values
        What was given to plain names.
    functions
        Functions and methods of the file, by name.
    """

    values: dict[str, list[Given]] = field(default_factory=dict)
    functions: dict[str, Function] = field(default_factory=dict)

    def within(self, scope: ast.AST) -> Names:
        """The same, and what is given in a function."""
        return Names(self.values | assigned([scope]), self.functions)

    def of(self, name: ast.Name) -> list[ast.expr]:
        """What a name may be there: the last that was given, or those of the branches before."""
        line, column = getattr(name, "lineno", 0), getattr(name, "col_offset", 0)
        found: list[ast.expr] = []
        known = self.values.get(name.id, [])
        for given in sorted(known, key=lambda one: -one.line):
            if given.line > line and given.column > 0:
                continue
            found.append(given.value)
            if 0 < given.column <= column:
                break
        return found


def assigned(scopes: Iterable[ast.AST]) -> dict[str, list[Given]]:
    """What scopes give to plain names; a loop's names are given nothing that is known."""
    found: dict[str, list[Given]] = {}
    for node in (node for scope in scopes for node in ast.walk(scope)):
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        if not isinstance(node, ast.Assign | ast.AnnAssign | ast.NamedExpr) or not node.value:
            continue
        if isinstance(target, ast.Name):
            given = Given(node.value, node.lineno, node.col_offset)
            found.setdefault(target.id, []).append(given)
    return found


def names_of(tree: ast.Module) -> Names:
    """The names of a file."""
    functions = {
        node.name: node
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    plain = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]
    return Names(assigned(plain), functions)


def variants(node: ast.expr, names: Names, depth: int = 0) -> list[str]:  # noqa: PLR0911
    """What an expression may read, each once."""
    if not is_text(node, names, depth):
        return [str(node.value or "") if isinstance(node, ast.Constant) else hole(node)]
    match node:
        case ast.Constant(value=value):
            return [str(value)]
        case ast.JoinedStr(values=parts):
            return _joined([variants(part, names, depth) for part in parts], parts)
        case ast.FormattedValue(value=value):
            return variants(value, names, depth)
        case ast.BinOp(left=left, right=right):
            both = [variants(one, names, depth) for one in (left, right)]
            return _joined(both, [left, right])
        case ast.IfExp(body=body, orelse=other):
            return _once([body, other], names, depth)
        case ast.Name():
            return _once(names.of(node), names, depth + 1)
        case ast.Call(func=func):
            function = names.functions[_name_of(func)]
            return _once(_returned(function), names.within(function), depth + 1)
    return [hole(node)]


def _once(nodes: Iterable[ast.expr], names: Names, depth: int) -> list[str]:
    found = [text for node in nodes for text in variants(node, names, depth)]
    return list(dict.fromkeys(found))[:MOST_VARIANTS]


def _joined(parts: list[list[str]], nodes: list[ast.expr]) -> list[str]:
    count = 1
    for part in parts:
        count *= len(part)
    if count > MOST_VARIANTS:
        parts = [
            part if len(part) == 1 else [hole(node)]
            for part, node in zip(parts, nodes, strict=True)
        ]
    return ["".join(one) for one in itertools.product(*parts)]


def is_text(node: ast.expr, names: Names, depth: int = 0) -> bool:  # noqa: PLR0911
    """Whether an expression is written out: text, a name for text, a function that gives text."""
    if depth > DEEPEST:
        return False
    match node:
        case ast.Constant(value=value):
            return isinstance(value, str)
        case ast.JoinedStr():
            return True
        case ast.FormattedValue(value=value):
            return is_text(value, names, depth)
        case ast.BinOp(op=ast.Add(), left=left, right=right):
            return is_text(left, names, depth) or is_text(right, names, depth)
        case ast.IfExp(body=body, orelse=other):
            return is_text(body, names, depth) and is_text(other, names, depth)
        case ast.Name():
            found = names.of(node)
            return bool(found) and all(is_text(one, names, depth + 1) for one in found)
        case ast.Call(func=func) if _name_of(func) in names.functions:
            function = names.functions[_name_of(func)]
            inside, found = names.within(function), _returned(function)
            return bool(found) and all(is_text(one, inside, depth + 1) for one in found)
    return False


def _returned(function: Function) -> list[ast.expr]:
    """What a function gives back, None aside."""
    nodes = (node.value for node in ast.walk(function) if isinstance(node, ast.Return))
    return [
        one for one in nodes
        if one is not None and not (isinstance(one, ast.Constant) and one.value is None)
    ]  # fmt: skip


def _name_of(func: ast.expr) -> str:
    if isinstance(func, ast.Attribute):
        is_own = isinstance(func.value, ast.Name) and func.value.id in ("self", "cls")
        return func.attr if is_own else ""
    return func.id if isinstance(func, ast.Name) else ""


def hole(node: ast.expr) -> str:
    """A place for what is known later, named after it."""
    return f"‹{_called(node).strip('_').replace('_', ' ').lower() or 'value'}›"


def _called(node: ast.expr) -> str:  # noqa: PLR0911
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case ast.Call(func=func, args=args):
            name = func.attr if isinstance(func, ast.Attribute) else ast.unparse(func)
            if isinstance(func, ast.Attribute) and name in OF_TEXT:
                return _called(func.value)
            if name == "len":
                return "number"
            return _called(args[-1]) if name in SEE_THROUGH and args else name
        case (
            ast.Subscript(value=value) | ast.Starred(value=value) | ast.FormattedValue(value=value)
        ):
            return _called(value)
        case ast.BinOp(left=left, right=right):
            return _called(right if isinstance(left, ast.Constant) else left)
        case ast.UnaryOp(operand=one) | ast.BoolOp(values=[one, *_]) | ast.IfExp(body=one):
            return _called(one)
        case ast.GeneratorExp(elt=one) | ast.ListComp(elt=one) | ast.SetComp(elt=one):
            return _called(one)
    return "value"
