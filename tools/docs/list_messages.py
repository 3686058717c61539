"""Write docs/troubleshooting.md: every error text there is, and what to do about it.

    python tools/docs/list_messages.py          write the page
    python tools/docs/list_messages.py --check  exit with 1 if the committed page differs

Texts are read from the sources: wherever an error of the project is made. What the device says
comes from the declarations of its codes. What to do is in `message_groups.toml`, a sentence or
three per group. A source that belongs to no group is an error.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from message_text import Given, Names, hole, is_text, names_of, variants

from chladni.host.protocol.codes import CONFIG_STATUS, FAULT_CAUSE, PANEL_HEALTH, TABLE_STATUS
from chladni.host.protocol.link import STATUS_TEXT

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "troubleshooting.md"
GROUPS = Path(__file__).with_name("message_groups.toml")
FOLDERS = ("sim", "tables", "host")
BASE = "ChladniError"
HEAD = """# Troubleshooting by message

<!-- written by tools/docs/list_messages.py -->

Search this page for a part of the message that does not change: a key, an option, a word. ‹…› is
what differs from case to case. Where a file is wrong its name comes first, as in
`my.toml, plate.thickness_mm: expected …`. An exit code of 2 says that something given is wrong, 1
that the work failed, 130 that Ctrl-C ended it. In Python the same text is that of the exception.
"""

Sources = Mapping[str, str]


def read_sources(root: Path = ROOT) -> dict[str, str]:
    """Python sources that may raise, by path."""
    return {
        path.relative_to(root).as_posix(): path.read_text("utf-8")
        for folder in FOLDERS
        for path in sorted((root / folder).rglob("*.py"))
    }


def error_classes(trees: Mapping[str, ast.Module]) -> dict[str, str]:
    """The project's errors, each with the one it derives from."""
    parents = {
        node.name: base.id
        for tree in trees.values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef)
        for base in node.bases
        if isinstance(base, ast.Name)
    }
    found = {BASE: ""}
    while more := {n: p for n, p in parents.items() if p in found and n not in found}:
        found |= more
    return found


def messages(sources: Sources) -> dict[str, list[str]]:
    """Texts by group, each text once, in the order of their words."""
    trees = {path: ast.parse(text) for path, text in sources.items()}
    classes = error_classes(trees)
    sites = _call_sites(trees)
    seen: set[str] = set()
    found: dict[str, list[str]] = {}
    for path, tree in trees.items():
        for call, scope in _made(tree, classes):
            for names in _bound(scope, names_of(tree).within(scope), sites):
                new = [text for text in _texts(call, classes, names) if text not in seen]
                seen.update(new)
                found.setdefault(group_of(path), []).extend(new)
    return {group: sorted(texts, key=_as_searched) for group, texts in found.items()}


Site = tuple[ast.Call, Names]


def _call_sites(trees: Mapping[str, ast.Module]) -> dict[str, list[Site]]:
    """Where functions are called with a text, by the function's name."""
    found: dict[str, list[Site]] = {}
    for tree in trees.values():
        module = names_of(tree)
        for scope in module.functions.values():
            names = module.within(scope)
            for node in ast.walk(scope):
                if not isinstance(node, ast.Call):
                    continue
                given = [*node.args, *(word.value for word in node.keywords)]
                if any(is_text(one, names) for one in given):
                    found.setdefault(_called_name(node, module), []).append((node, names))
    return found


def _called_name(call: ast.Call, module: Names) -> str:
    """What is called; of a function that another one makes, its name in there."""
    if isinstance(call.func, ast.Call):
        maker = module.functions.get(ast.unparse(call.func.func))
        made = (
            [node.value for node in ast.walk(maker) if isinstance(node, ast.Return)]
            if maker
            else []
        )
        return next((one.id for one in made if isinstance(one, ast.Name)), "")
    return ast.unparse(call.func).rpartition(".")[2]


def _bound(scope: ast.AST, names: Names, sites: Mapping[str, list[Site]]) -> Iterator[Names]:
    """Names within a function, with the texts that each of its callers gives it."""
    if not isinstance(scope, ast.FunctionDef | ast.AsyncFunctionDef) or scope.name not in sites:
        yield names
        return
    parameters = [one.arg for one in (*scope.args.posonlyargs, *scope.args.args)]
    if parameters[:1] in (["self"], ["cls"]):
        parameters = parameters[1:]
    for call, theirs in sites[scope.name]:
        given = dict(zip(parameters, call.args, strict=False))
        given |= {word.arg: word.value for word in call.keywords if word.arg}
        texts = {
            name: [Given(ast.Constant(text), 0, 0) for text in variants(node, theirs)]
            for name, node in given.items()
            if is_text(node, theirs)
        }
        yield Names({**texts, **names.values}, names.functions)


def group_of(path: str) -> str:
    """The group whose longest path a source's begins with."""
    fitting = [
        (len(prefix), title)
        for title, group in _groups().items()
        for prefix in group.get("sources", [])
        if path.startswith(prefix)
    ]
    if not fitting:
        raise SystemExit(f"{path} belongs to no group of {GROUPS.name}")
    return max(fitting)[1]


def _groups() -> dict[str, dict[str, Any]]:
    return tomllib.loads(GROUPS.read_text("utf-8"))


def _as_searched(text: str) -> tuple[bool, str]:
    """What begins with a hole comes last: no one can look for it by its beginning."""
    return text.startswith("‹"), re.sub(r"[^\w ]", "", text).casefold()


def _made(tree: ast.Module, classes: Mapping[str, str]) -> Iterator[tuple[ast.Call, ast.AST]]:
    """Every place where an error is made, with the function around it.

    An error's own class gives its text to `super().__init__`.
    """

    def walk(node: ast.AST, scope: ast.AST, owner: str) -> Iterator[tuple[ast.Call, ast.AST]]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            scope = node
        if isinstance(node, ast.ClassDef):
            owner = node.name
        if isinstance(node, ast.Call):
            is_own = owner in classes and ast.unparse(node.func) == "super().__init__"
            name = classes[owner] if is_own else ast.unparse(node.func)
            if name in classes and owner not in SHAPES:
                called = ast.Call(ast.Name(name), node.args, node.keywords)
                yield called, scope
        for child in ast.iter_child_nodes(node):
            yield from walk(child, scope, owner)

    yield from walk(tree, ast.Pass(), "")


SHAPES = {
    "InputError": ("field", "value", "expected"),
    "MissingError": ("field", "what"),
    "ConflictError": ("field", "other"),
    "TableRefusedError": ("verdict", "field", "value", "expected"),
    "ToleranceError": (),
    "ResonanceError": (),
    "TooLargeError": (),
    "LinkError": ("text",),
}
"""What errors are made of that put their text together from parts. Those without parts make their
text of numbers, in `OWN`."""

OWN = {
    "ToleranceError": "the field's estimated error is ‹estimate›, above ‹tolerance›: move features "
    "that nearly touch apart or merge them (‹which›), give a plate driven at a mode a loss_factor "
    "or another frequency, or ask for another tolerance",
    "TooLargeError": "‹what› takes about ‹size› GB, more than ‹size›: lower ‹lower›, or go on with "
    "‹--large, or allow_large_work(True)›",
    "ResonanceError": "drive.frequency_hz: ‹frequency› Hz lies on mode ‹mode› (‹frequency› Hz) of "
    "a plate without loss; expected another frequency or a plate.loss_factor above 0",
}
"""Texts that a test compares with the real ones."""


def _texts(call: ast.Call, classes: Mapping[str, str], names: Names) -> list[str]:
    assert isinstance(call.func, ast.Name)
    kind = call.func.id
    if kind in OWN:
        return [OWN[kind]]
    shape = SHAPES.get(kind, ("text",))
    given = dict(zip(shape, call.args, strict=False))
    given |= {word.arg: word.value for word in call.keywords if word.arg}
    parts = {name: variants(node, names) for name, node in given.items() if name in shape}
    if "value" in given:
        parts["value"] = [_shown(given["value"])]
    return list(dict.fromkeys(_put_together(kind, parts)))


def _shown(value: ast.expr) -> str:
    return repr(value.value) if isinstance(value, ast.Constant) else hole(value)


def _put_together(kind: str, parts: Mapping[str, list[str]]) -> Iterator[str]:
    field = parts.get("field", ["‹field›"])
    for place in field:
        if kind in ("InputError", "TableRefusedError"):
            for expected in parts["expected"]:
                what, semicolon, hint = expected.partition("; ")
                yield f"{place}: expected {what}, got {parts['value'][0]}{semicolon}{hint}"
        elif kind == "MissingError":
            for what in parts.get("what", [""]):
                yield f"{place} is required" + (f": {what}" if what else "")
        elif kind == "ConflictError":
            yield from (f"{place} does not go with {other}" for other in parts["other"])
        else:
            yield from parts.get("text", ["interrupted"])


def device_words() -> list[str]:
    """What a device says of itself, and why it refuses."""
    found = {code.text: code.note for codes in (TABLE_STATUS, CONFIG_STATUS, PANEL_HEALTH,
             FAULT_CAUSE) for code in codes.members if code.text != "ok"}  # fmt: skip
    found |= {text: "" for text in STATUS_TEXT.values() if text != "done"}
    return sorted(f"{text} ({note})" if note else text for text, note in found.items())


def page(sources: Sources) -> str:
    """The whole page."""
    found = messages(sources)
    parts = [HEAD]
    for title, group in _groups().items():
        texts = device_words() if group.get("device") else found.get(title, [])
        lines = "\n".join(f"- {_code(text)}" for text in texts)
        parts.append(f"## {title}\n\n{str(group['do']).strip()}\n\n{lines}\n")
    return "\n".join(parts)


def _code(text: str) -> str:
    text = " ".join(text.split())
    return f"`` {text} ``" if "`" in text else f"`{text}`"


def main() -> int:
    """Write or compare the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true")
    text = page(read_sources())
    if parser.parse_args().check:
        if PAGE.is_file() and PAGE.read_text(encoding="utf-8") == text:
            return 0
        print("docs/troubleshooting.md lacks a message, or has one too many: run "
              "tools/docs/list_messages.py")  # fmt: skip
        return 1
    PAGE.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
