"""Try all blocks of a page, in order, with sybil: Python, console and TOML.

Every block is tried, or says above it what stands in for it (`marks`); what only shows something
is `text`.
"""

from __future__ import annotations

import contextlib
import re
import shlex
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer
from sybil import Document, Example, Lexeme, Region
from sybil.example import SybilFailure
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

from chladni.host.cli.command_line import app
from docs import marks, transcript
from docs.desk import Desk, new_desk
from docs.page_text import RUN, SHOWN, Block, comments_before, read_page
from docs.toml_pieces import piece_problem, put_into

COMMAND = re.compile(r"^\s*(?:\$ |chladni [a-z]|make [a-z]|pip |pio )", re.MULTILINE)

Parser = Callable[[Document], Iterable[Region]]
Evaluator = Callable[[Example], str | None]


@dataclass
class Trial:
    """What became of a page."""

    ran: int = 0
    """Blocks that ran, with the lines that a mark left out."""
    marked: int = 0
    """Blocks of which nothing ran."""
    problems: list[str] = field(default_factory=list)


def unmarked(block: Block, root: Path) -> str:
    """Why a block is neither tried nor marked, or its mark is wrong; empty if all is well."""
    mark = marks.read_marks(block.comments)
    if problem := marks.problem(mark, root):
        return problem
    if mark.only and block.language == "console":
        return _unused(mark, block)
    if mark.why or block.language in RUN:
        return ""
    if block.language in SHOWN:
        return "a command in a block that only shows" if COMMAND.search(block.text) else ""
    if not block.language:
        return "a block without a language: python, console, toml or text, or a mark above it"
    return f"{block.language} is not tried: mark what stands in"


def _unused(mark: marks.Mark, block: Block) -> str:
    commands = [step.command for step in transcript.steps(block.text)]
    unused = [one for one in mark.only if not any(c.startswith(one) for c in commands)]
    return f"no command begins with {unused[0]}" if unused else ""


def try_page(path: Path, root: Path, built: Path) -> Trial:
    """Try a page; nothing of it stays but the tables in `built`."""
    result = Trial()
    for block in read_page(path).blocks:
        with contextlib.suppress(ValueError):  # a block without commands is told of as it runs
            if problem := unmarked(block, root):
                result.problems.append(f"{path.name}:{block.line}: {problem}")
    with tempfile.TemporaryDirectory(prefix="page-") as name:
        desk = new_desk(Path(name), root / "boards", built)
        try:
            for example in _parsed(path, desk, result).examples():
                with _told(result, path, example):
                    example.evaluate()
        finally:
            desk.close()
    return result


@contextlib.contextmanager
def _told(result: Trial, path: Path, example: Example) -> Iterator[None]:
    """Note what a block comes to, and go on: the next one may tell more."""
    where = f"{path.name}:{example.line}: "
    try:
        yield
    except SybilFailure as error:
        result.problems.append(where + error.result)
    except (Exception, SystemExit) as error:
        result.problems.append(f"{where}{type(error).__name__}: {error}")


def _parsed(path: Path, desk: Desk, result: Trial) -> Document:
    parsers: tuple[Parser, ...] = (
        PythonCodeBlockParser(),
        CodeBlockParser("console", lambda example: _console(example, desk)),
        CodeBlockParser("toml", lambda example: _toml(example, desk)),
    )
    return Document.parse(
        str(path), *(_marked(parser, desk, result) for parser in parsers), encoding="utf-8"
    )


def _marked(parser: Parser, desk: Desk, result: Trial) -> Parser:
    """A parser without the blocks that are marked, and with what goes before the others."""

    def parse(document: Document) -> Iterator[Region]:
        for region in parser(document):
            mark = marks.read_marks(comments_before(document.text, region.start))
            if mark.why and not mark.only:
                result.marked += 1
                continue
            result.ran += 1
            if region.evaluator is not None:
                region.evaluator = _after(region.evaluator, mark, desk)
            yield region

    return parse


def _after(evaluator: Evaluator, mark: marks.Mark, desk: Desk) -> Evaluator:
    """Run what a mark wants first, put an emulated device's port in, then the block."""

    def evaluate(example: Example) -> str | None:
        def here(text: str) -> str:
            name = rf"(?<![\w/]){re.escape(mark.port)}(?![\w/])"
            return re.sub(name, str(desk.port(mark.board)), text) if mark.port else text

        for command in mark.first:
            if problem := desk.run(here(command)):
                return f"{command}: {problem}"
        source = example.parsed
        example.parsed = Lexeme(here(source), source.offset, source.line_offset)
        with contextlib.chdir(desk.folder):
            return evaluator(example)

    return evaluate


def _console(example: Example, desk: Desk) -> str | None:
    mark = marks.read_marks(comments_before(example.document.text, example.start))
    for step in transcript.steps(example.parsed):
        is_left_out = mark.leaves_out(step.command)
        problem = (
            unknown_words(step.command) if is_left_out else desk.run(step.command, step.expected)
        )
        if problem:
            return f"$ {step.command}: {problem}"
    return None


def unknown_words(command: str) -> str:
    """What a command that does not run has that chladni does not know: a word, an option."""
    words = shlex.split(command, comments=True)
    if words[0] != "chladni":
        return ""
    known: Any = typer.main.get_command(app)
    context = None
    try:
        while hasattr(known, "resolve_command"):
            context = known.make_context(known.name, words[1:], parent=context)
            name, known, rest = known.resolve_command(context, words[1:])
            words = [name, *rest]
        known.make_context(known.name, words[1:], parent=context)
    except Exception as error:
        if not hasattr(error, "format_message"):  # typer brings a click of its own
            raise
        return str(error.format_message())
    return ""


def _toml(example: Example, desk: Desk) -> str | None:
    mark = marks.read_marks(comments_before(example.document.text, example.start))
    pieces = [str(example.parsed)]
    if mark.file:
        return put_into(desk.folder / mark.file, pieces[0])
    if mark.table:
        pieces = [f"[{mark.table}]\n{line}" for line in pieces[0].splitlines() if line.strip()]
    boards = desk.folder / "boards"
    return next((p for piece in pieces if (p := piece_problem(piece, boards))), None)
