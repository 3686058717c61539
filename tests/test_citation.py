"""CITATION.cff: that it can be read, says what pyproject.toml says, and names the paper."""

from __future__ import annotations

import re
import tomllib
from typing import Any

import pytest
import yaml

from conftest import ROOT

TITLE = (
    "Point-Wise Vibration Pattern Production via a Sparse Actuator Array for Surface Tactile "
    "Feedback"
)
NUMBER = "arXiv:2402.11496"


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    found = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_the_citation_is_of_this_version(citation: dict[str, Any]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"]
    assert citation["abstract"] == project["description"]
    (holder,) = re.findall(r"Copyright \(c\) \d+ (.*)", (ROOT / "LICENSE").read_text("utf-8"))
    assert citation["authors"] == [{"name": holder}]


def test_the_citation_has_what_its_format_requires(citation: dict[str, Any]) -> None:
    """Required by the schema of cff-version 1.2.0, for the software and for a reference."""
    assert citation["cff-version"] == "1.2.0"
    assert {"authors", "message", "title"} <= citation.keys()
    # Else tools would cite the paper in place of Chladni.
    assert "preferred-citation" not in citation
    for reference in citation["references"]:
        assert {"authors", "title", "type"} <= reference.keys()


def test_the_citation_names_the_paper(citation: dict[str, Any]) -> None:
    (paper,) = citation["references"]
    assert paper["title"] == TITLE
    names = [author["family-names"] for author in paper["authors"]]
    assert names == ["Li", "Zhao", "Lu", "Xiao", "Ding"]
    assert paper["year"] == 2024
    assert NUMBER in [one["value"] for one in paper["identifiers"]]


@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/physics.md",
        "docs/five-actuators.md",
        "docs/paper.md",
        "boards/paper.toml",
        "boards/prototype.toml",
    ],
)
def test_a_page_that_speaks_of_the_paper_names_it(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    words = " ".join(text.replace("\n#", "\n").split())
    assert words.count(TITLE) == 1, f"{page} names the paper {words.count(TITLE)} times"
    assert NUMBER in words
