"""An MIT program asks for nothing to run that would put it under another licence."""

from __future__ import annotations

import copy
import re

import pytest
from list_licences import (
    COPYLEFT,
    PAGE,
    PERMISSIVE,
    RUNTIME,
    UNKNOWN,
    WEAK,
    Row,
    asked_for,
    differences,
    kind_of,
    page,
    rows,
)


def forbidden(found: list[Row]) -> list[str]:
    """Runtime packages under a copyleft licence, a weak one (LGPL, MPL) too, or an unknown one."""
    return [
        f"{row.name}: {row.licence}"
        for row in found
        if row.use == RUNTIME and row.kind != PERMISSIVE
    ]


def test_all_that_runs_with_it_is_under_a_permissive_licence() -> None:
    found = rows(asked_for())
    assert forbidden(found) == []
    runtime = {row.name for row in found if row.use == RUNTIME}
    # Directly, and what those ask for.
    assert {"numpy", "matplotlib", "rich", "markdown-it-py", "mdurl"} <= runtime


@pytest.mark.parametrize("name", ["esptool>=5.1", "hypothesis", "no-such-package-anywhere"])
def test_a_copyleft_or_unknown_licence_is_found_wherever_it_is_asked_for(name: str) -> None:
    document = copy.deepcopy(asked_for())
    document["project"]["dependencies"].append(name)
    assert [line.split(":")[0] for line in forbidden(rows(document))] == [re.split("[>=]", name)[0]]


@pytest.mark.parametrize(
    ("licence", "kind"),
    [
        ("MIT", PERMISSIVE), ("BSD-3-Clause AND 0BSD AND Zlib", PERMISSIVE),
        ("Apache-2.0 WITH LLVM-exception", PERMISSIVE), ("GPL-2.0-or-later", COPYLEFT),
        ("AGPL-3.0-only", COPYLEFT), ("MIT AND GPL-3.0-only", COPYLEFT),
        ("MIT OR GPL-2.0-only", PERMISSIVE), ("(MIT OR GPL-2.0-only) AND BSD-2-Clause", PERMISSIVE),
        ("GPL-2.0-only AND (MIT OR BSD-3-Clause)", COPYLEFT),
        ("LGPL-2.1-or-later", WEAK), ("MPL-2.0", WEAK), ("MIT AND MPL-2.0", WEAK), ("?", UNKNOWN),
        ("MIT AND Whatever", UNKNOWN), ("GNU General Public License (GPL)", UNKNOWN),
    ],
)  # fmt: skip
def test_kinds_of_licences(licence: str, kind: str) -> None:
    assert kind_of(licence) == kind


def test_the_page_is_up_to_date() -> None:
    """In words of licences and in what packages ask for in turn, other machines may differ."""
    assert differences(PAGE.read_text(encoding="utf-8"), rows(asked_for())) == []


def test_a_page_that_is_not_is_noticed() -> None:
    found = rows(asked_for())
    text = page(found)
    assert differences(text, found) == []
    first = next(row for row in found if row.name == "numpy")
    assert differences(text.replace(first.line() + "\n", ""), found) == ["numpy is missing"]
    assert differences(text, [row for row in found if row != first]) == [
        "numpy is asked for no more"
    ]
    other = text.replace("| numpy | >=1.26 |", "| numpy | >=1.20 |")
    assert differences(other, found) == ["numpy: >=1.26, not >=1.20"]
    assert len(differences(text.replace("GPL-2.0-or-later | copyleft", "MIT | permissive"), found))
    assert differences("# Another\n" + text, found)
    # Another version's words for a licence of the same kind are no difference.
    words = first.line().replace(first.licence, "BSD")
    assert differences(text.replace(first.line(), words), found) == []
