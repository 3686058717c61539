"""The site is built without a warning, names every page and public name, and loads nothing."""

from __future__ import annotations

import re
import shutil
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
from build_site import AT_ROOT, CONFIG, PACKAGES, build, public_names

from conftest import ROOT

LOADED = re.compile(r"""<(?:link|script|img|iframe|source)\b[^>]*=["'](?:https?:)?//[^>]*""")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    to = tmp_path_factory.mktemp("site") / "site"
    assert build(to) == ""
    return to


def test_the_site_loads_nothing_from_elsewhere(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        assert LOADED.findall(page.read_text("utf-8")) == [], page.name
    assert LOADED.search('<script async src="https://example.org/x.js">')


def test_a_search_finds_every_page(site: Path) -> None:
    found = (site / "search.json").read_text("utf-8")
    for page in (ROOT / "docs").glob("*.md"):
        assert f'"{page.stem}.html' in found, page.name


def named(entries: list[dict[str, object]]) -> Iterator[str]:
    for entry in entries:
        for value in entry.values():
            if isinstance(value, list):
                yield from named(value)
            else:
                yield str(value)


def test_the_reading_order_has_every_page_once() -> None:
    order = list(named(tomllib.loads(CONFIG.read_text("utf-8"))["project"]["nav"]))
    docs = ROOT / "docs"
    pages = [str(page.relative_to(docs)) for page in docs.rglob("*.md") if page.parts[-2] != "api"]
    api = [f"api/{package}.md" for package in PACKAGES]
    assert sorted(order) == sorted([*pages, *AT_ROOT, *api])


@pytest.mark.parametrize("package", PACKAGES)
def test_the_reference_has_every_public_name(package: str, site: Path) -> None:
    text = (site / "api" / f"{package}.html").read_text("utf-8")
    names = public_names(package)
    assert list(names) == import_module(f"chladni.{package}").__all__
    for place in names.values():
        assert f'id="{place}"' in text


def test_broken_references_end_the_build(tmp_path: Path) -> None:
    """To a heading that is not on its page, which the builder finds last."""
    pages = tmp_path / "docs"
    shutil.copytree(ROOT / "docs", pages)
    wrong = "# A page\n\n[there](metrics.md#nowhere)\n"
    (pages / "feel.md").write_text(wrong, "utf-8")
    said = build(tmp_path / "site", pages)
    assert "anchor does not exist" in said
    assert not (tmp_path / "site").exists()
