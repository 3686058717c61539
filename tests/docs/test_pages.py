"""What pages say runs, and where they point there is something."""

from __future__ import annotations

from pathlib import Path

import pytest

from conftest import ROOT, built_once
from docs.references import broken, cached_page, pages, unused_pictures
from docs.trial import try_page

PAGES = pages(ROOT)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_every_block_of_a_page_runs_or_names_what_stands_in(
    path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    trial = try_page(path, ROOT, built_once(tmp_path_factory, "page-tables", lambda _: None))
    print(f"{path.name}: {trial.ran} ran, {trial.marked} marked")
    assert not trial.problems, "\n".join(trial.problems)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_links_anchors_and_pictures_of_a_page_are_there(path: Path) -> None:
    assert list(broken(cached_page(path), ROOT)) == []


def test_every_committed_picture_is_shown() -> None:
    assert unused_pictures(ROOT) == []
