"""Links, anchors and pictures of pages: every one that does not leave the repository leads on."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

from docs.page_text import Link, Page, read_page


@cache
def cached_page(path: Path) -> Page:
    """A page, parsed once."""
    return read_page(path)


def broken(page: Page, root: Path) -> Iterator[str]:
    """What is wrong with the references of a page, a line each."""
    for link in page.links:
        if problem := _problem(page, link, root):
            yield f"{page.path.name}:{link.line}: {problem}"


def _problem(page: Page, link: Link, root: Path) -> str:
    parts = urlsplit(link.target)
    if parts.scheme or parts.netloc:
        return "" if parts.scheme == "https" else f"expected https, got {link.target}"
    target = page.path
    if parts.path:
        target = (page.path.parent / unquote(parts.path)).resolve()
        kind = "picture" if link.is_picture else "file"
        if not target.exists():
            return f"no such {kind}: {link.target}"
        if not target.is_relative_to(root):
            return f"outside of the repository: {link.target}"
    if parts.fragment and target.suffix == ".md":
        is_there = unquote(parts.fragment) in cached_page(target).anchors
        return "" if is_there else f"no such anchor: {link.target}"
    return ""


def pages(root: Path) -> list[Path]:
    """Pages that people read."""
    return [
        *(root / f"{name}.md" for name in ("README", "ARCHITECTURE", "CONTRIBUTING", "CHANGELOG")),
        *sorted((root / "docs").glob("*.md")),
    ]


def unused_pictures(root: Path) -> list[str]:
    """Committed pictures that no page shows."""
    committed = subprocess.run(
        ["git", "ls-files", "docs/images"], cwd=root, capture_output=True, text=True, check=True
    ).stdout.split()
    shown = {
        (path.parent / link.target).resolve()
        for path in pages(root)
        for link in cached_page(path).links
    }
    return [name for name in committed if (root / name).resolve() not in shown]
