"""Messages that the page of causes shows are in the program's own words."""

from __future__ import annotations

import ast
import re
from difflib import SequenceMatcher

import pytest

from conftest import ROOT

PAGE = ROOT / "docs" / "troubleshooting.md"
BLOCK = re.compile(r"^```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
# What differs from case to case: numbers, quoted or bracketed values, names of files, "…".
VARIABLE = re.compile(
    r"'[^']*'|\[[^\]]*\]|\b\w+\.\w+\b|\S*\.(?:toml|chl|key)\b|/\S+|-?\d[\w.,:]*|0x\w+|…"
)
SHORTEST = 4
"""Words of a run that tell one message from another."""
NOT_OURS = ("CMake Error",)


def own_texts() -> list[str]:
    """All texts of the sources, a space where an f-string has a hole."""
    texts = []
    for room in ("sim", "tables", "host"):
        for path in sorted((ROOT / room).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.JoinedStr):
                    texts.append(
                        " ".join(
                            part.value
                            for part in node.values
                            if isinstance(part, ast.Constant) and isinstance(part.value, str)
                        )
                    )
                elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                    texts.append(node.value)
    return texts


def is_from(run: str, texts: list[str]) -> bool:
    """Whether a text has a run's words in their order, two of three where holes stand between."""
    words = run.split()
    for text in texts:
        own = re.split(r"[\s,.:;()]+", text)
        same = sum(block.size for block in SequenceMatcher(None, words, own).get_matching_blocks())
        if run in text or same * 3 >= len(words) * 2:
            return True
    return False


def runs(message: str) -> list[str]:
    """What of a message must be the program's own: its words between values, fields and marks."""
    message = re.sub(r"\bexpected |, got |\bgot |^chladni: ", "\0", message)
    found = re.split(r"\0|; |: |\(|\)|, ", VARIABLE.sub("\0", message))
    return [run.strip(" ,.;") for run in found if len(run.split()) >= SHORTEST]


def messages() -> list[str]:
    found = [
        line for block in BLOCK.findall(PAGE.read_text("utf-8")) for line in block.splitlines()
    ]
    return [line for line in found if line.strip() and not line.startswith(NOT_OURS)]


@pytest.fixture(scope="module")
def texts() -> list[str]:
    return own_texts()


def test_a_message_of_the_page_is_in_the_program_s_words(texts: list[str]) -> None:
    shown = messages()
    assert len(shown) >= 20
    missing = {run: line for line in shown for run in runs(line) if not is_from(run, texts)}
    assert not missing, "\n".join(f"{run!r} of: {line}" for run, line in missing.items())


def test_another_wording_is_found(texts: list[str]) -> None:
    line = "coil_ohm: expected above 0, got 0; a strong magnet must have a height, too"
    assert [run for run in runs(line) if not is_from(run, texts)] == [
        "a strong magnet must have a height"
    ]
