"""Pages name what the Makefile can make."""

from __future__ import annotations

import re

import pytest

from conftest import ROOT
from docs.references import pages
from make_targets import idle_targets, targets

MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
PAGES = [*pages(ROOT), *sorted((ROOT / "tools").rglob("*.md"))]
NAMED = re.compile(r"(?:`|^\$ |&& )make ([a-z-]+)", re.MULTILINE)


def test_every_target_does_something() -> None:
    assert idle_targets(MAKEFILE) == set()


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_target_that_a_page_names_is_there(path: str) -> None:
    named = set(NAMED.findall((ROOT / path).read_text("utf-8")))
    assert named <= targets(MAKEFILE), path


def test_pages_name_targets() -> None:
    named = {name for path in PAGES for name in NAMED.findall(path.read_text("utf-8"))}
    assert {"test", "lint", "paper", "venv"} <= named


def test_a_rule_that_was_lost_is_missed() -> None:
    recipe = "\tcd tools && ../$(BIN)/python -m paper\n"
    assert recipe in MAKEFILE
    without_recipe = MAKEFILE.replace(recipe, "")
    without_rule = re.sub(r"^paper:.*\n", "", without_recipe, flags=re.MULTILINE)
    for text in (without_recipe, without_rule):
        assert idle_targets(text) == {"paper"}
        assert "paper" not in targets(text)


def test_what_is_not_sanitized_is_there() -> None:
    """A name that stands for nothing would leave nothing out, and say nothing."""
    lists = re.findall(r"^UNSANITIZED .= \$\(addprefix (\S+), (.*?)\)$", MAKEFILE, re.M | re.S)
    names = [(folder, name) for folder, own in lists for name in own.replace("\\\n", " ").split()]
    assert len(lists) == 2
    assert len(names) > 10
    for folder, name in names:
        file, _, test = name.partition("[")[0].partition("::")
        text = (ROOT / folder.rstrip(",") / file).read_text("utf-8")
        assert f"def {test}" in text, name
