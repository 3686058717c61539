"""A page of Markdown as its parts: blocks of code, headings, links and pictures."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

RUN = {"python", "console", "toml"}
"""Languages of blocks that are tried."""

SHOWN = {"text"}
"""Languages of blocks that only show something: layouts, formulas, messages."""

COMMENTS = re.compile(r"(?:<!--(?:(?!-->).)*-->\s*)+\Z", re.DOTALL)
COMMENT = re.compile(r"<!--\s*(.*?)\s*-->", re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A block of code."""

    line: int
    language: str
    """Empty for an indented block, and for a fence that names none."""
    text: str
    comments: tuple[str, ...]
    """The HTML comments right above it."""


@dataclass(frozen=True)
class Link:
    """A link, or a picture."""

    line: int
    target: str
    is_picture: bool


@dataclass(frozen=True)
class Page:
    """What tests look at."""

    path: Path
    blocks: tuple[Block, ...]
    links: tuple[Link, ...]
    anchors: frozenset[str]


def comments_before(text: str, position: int) -> tuple[str, ...]:
    """The HTML comments that end right before a place of a text; blank lines are passed over."""
    found = COMMENTS.search(text[:position])
    return tuple(" ".join(one.split()) for one in COMMENT.findall(found[0])) if found else ()


def slug(heading: str, taken: dict[str, int]) -> str:
    """The anchor that GitHub makes of a heading: github/markup's rules, as html-pipeline has them.

    Parameters
    ----------
    taken
        How often each slug came before, on the same page; is kept up to date.
    """
    name = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
    count = taken.get(name, 0)
    taken[name] = count + 1
    return f"{name}-{count}" if count else name


def read_page(path: Path) -> Page:
    """Parse a page."""
    text = path.read_text(encoding="utf-8")
    tokens = MarkdownIt("commonmark").enable("table").parse(text)
    starts = [0]
    for one in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(one))
    blocks: list[Block] = []
    links: list[Link] = []
    anchors = set(re.findall(r'<a (?:id|name)="([^"]+)"', text))
    taken: dict[str, int] = {}
    for token, after in zip(tokens, [*tokens[1:], None], strict=True):
        line = token.map[0] if token.map else 0
        if token.type in ("fence", "code_block"):
            above = comments_before(text, starts[line])
            blocks.append(Block(line + 1, token.info.strip(), token.content, above))
        elif token.type == "heading_open" and after is not None:
            anchors.add(slug(_plain(after), taken))
        elif token.type == "inline":
            links.extend(_links(token, line + 1))
        elif token.type == "html_block":
            sources = re.findall(r"<(a|img)[^>]* (?:href|src)=[\"']([^\"']+)", token.content)
            links.extend(Link(line + 1, target, tag == "img") for tag, target in sources)
    return Page(path, tuple(blocks), tuple(links), frozenset(anchors))


def _plain(heading: Token) -> str:
    parts = heading.children or []
    return "".join(part.content for part in parts if part.type in ("text", "code_inline"))


def _links(inline: Token, line: int) -> list[Link]:
    found = []
    for part in inline.children or []:
        if part.type == "link_open":
            found.append(Link(line, str(part.attrs["href"]), is_picture=False))
        elif part.type == "image":
            found.append(Link(line, str(part.attrs["src"]), is_picture=True))
        elif part.type in ("softbreak", "hardbreak"):
            line += 1
    return found
