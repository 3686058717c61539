"""List what Chladni depends on and under which licences.

    python tools/list_licences.py          write docs/licences.md
    python tools/list_licences.py --check  exit with 1 if the page lacks something, or it changed

Names and ranges are of pyproject.toml, licences of the installed packages' own metadata. Versions
differ between machines, and so does what they depend on in turn: the check asks that what is
installed here is on the page with the same use and the same kind of licence.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "licences.md"
PROJECT = ROOT / "pyproject.toml"
RUNTIME, BUILD, DEVELOPMENT = "runtime", "build", "development"
PERMISSIVE, WEAK, COPYLEFT, UNKNOWN = "permissive", "weak copyleft", "copyleft", "unknown"
RANK = (PERMISSIVE, WEAK, COPYLEFT, UNKNOWN)

SPDX = {
    "BSD License": "BSD", "MIT License": "MIT", "Apache Software License": "Apache-2.0",
    "Python Software Foundation License": "PSF-2.0", "ISC License (ISCL)": "ISC",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0", "The Unlicense (Unlicense)": "Unlicense",
    "Historical Permission Notice and Disclaimer (HPND)": "HPND",
    "GNU General Public License v2 or later (GPLv2+)": "GPL-2.0-or-later",
    "GNU General Public License v3 (GPLv3)": "GPL-3.0-only",
    "GNU Lesser General Public License v3 (LGPLv3)": "LGPL-3.0-only",
    "BSD 3-Clause": "BSD-3-Clause", "Apache License, Version 2.0": "Apache-2.0",
    "Apache 2.0": "Apache-2.0", "Apache": "Apache-2.0",
    "MIT No Attribution License (MIT-0)": "MIT-0",
}  # fmt: skip
"""Words of classifiers and of older metadata, as SPDX has them; BSD where they do not say which."""
FREE = re.compile(
    r"(BSD(-[23]-Clause)?|0BSD|MIT(-CMU|-0)?|Apache-2\.0|PSF-2\.0|Python-2\.0|ISC|Zlib|CC0-1\.0|"
    r"HPND|Unlicense|BSL-1\.0|LLVM-exception)"
)
LONGEST_NAME = 60
"""Characters; a longer line of metadata is a sentence of a licence."""
# Not installed beside the others, or for few Pythons, or silent in their metadata.
ELSEWHERE = {
    "scikit-build-core": "Apache-2.0",
    "nanobind": "BSD-3-Clause",
    "atheris": "Apache-2.0",
    "sounddevice": "MIT",
    "pyuff": "MIT",
}


@dataclass(frozen=True)
class Row:
    """One package: what asks for it, with which range, what for, and its licence."""

    name: str
    asked: str
    use: str
    licence: str

    @property
    def kind(self) -> str:
        """Permissive, weak copyleft, copyleft or unknown."""
        return kind_of(self.licence)

    def line(self) -> str:
        """A row of the page."""
        return f"| {self.name} | {self.asked} | {self.use} | {self.licence} | {self.kind} |"


def kind_of(licence: str) -> str:
    """The kind of a licence expression: of `A AND B` the stricter, of `A OR B` the milder."""
    inner = re.compile(r"\(([^()]*)\)")
    while inner.search(licence):
        licence = inner.sub(lambda found: kind_of(found[1]), licence)
    choices = re.split(r"\s+OR\s+", licence)
    kinds = [
        max(map(_kind, re.split(r"\s+(?:AND|WITH)\s+", one)), key=RANK.index) for one in choices
    ]
    return min(kinds, key=RANK.index)


def _kind(text: str) -> str:
    name = text.strip()
    if name in RANK:  # of a part in brackets
        return name
    if FREE.fullmatch(name):
        return PERMISSIVE
    if re.match(r"LGPL|MPL|EPL|CDDL", name):
        return WEAK
    return COPYLEFT if re.match(r"A?GPL|EUPL|SSPL", name) else UNKNOWN


def licence_of(name: str) -> str:
    """What a package says its licence is: expression, then classifiers, then one short line."""
    if name in ELSEWHERE:
        return ELSEWHERE[name]
    try:
        about = distribution(name).metadata
    except PackageNotFoundError:
        return "?"
    if "License-Expression" in about:
        return re.sub(r"\s+", " ", about["License-Expression"])
    classifiers = [
        line.rsplit(" :: ", 1)[1]
        for line in about.get_all("Classifier") or []
        if line.startswith("License :: ")
    ]
    named = sorted({SPDX.get(one, one) for one in classifiers} - {"OSI Approved"})
    if named:
        return " AND ".join(named)
    # Older packages have a name here, or the whole text, whose first line is one.
    first = (about.get_all("License") or ["?"])[0].strip().split("\n")[0]
    return SPDX.get(first, first) if len(first) < LONGEST_NAME else "?"


def asked_for() -> dict[str, Any]:
    """What pyproject.toml says."""
    return tomllib.loads(PROJECT.read_text(encoding="utf-8"))


def rows(document: dict[str, Any]) -> list[Row]:
    """Every package of a pyproject.toml, runtime ones and extras with all they ask for."""
    project = document["project"]
    found = {row.name: row for row in _closure(project["dependencies"], RUNTIME)}
    for extra, asked in project["optional-dependencies"].items():
        if extra != "dev":
            for row in _closure(asked, f"extra {extra}"):
                found.setdefault(row.name, row)
    for asked, use in (
        (document["build-system"]["requires"], BUILD),
        (project["optional-dependencies"]["dev"], DEVELOPMENT),
    ):
        for requirement in map(Requirement, asked):
            name = canonical(requirement.name)
            if name != project["name"]:
                own = Row(name, str(requirement.specifier) or "any", use, licence_of(name))
                found.setdefault(name, own)
    order = [
        RUNTIME,
        *(f"extra {extra}" for extra in sorted(project["optional-dependencies"])),
        BUILD,
        DEVELOPMENT,
    ]
    return sorted(found.values(), key=lambda row: (order.index(row.use), row.name))


def _closure(asked: list[str], use: str) -> Iterator[Row]:
    """Requirements, and theirs as the installed packages say, each once."""
    left = [(requirement, "") for requirement in map(Requirement, asked)]
    seen: set[str] = set()
    while left:
        requirement, by = left.pop(0)
        name = canonical(requirement.name)
        if name in seen:
            continue
        seen.add(name)
        yield Row(name, f"by {by}" if by else str(requirement.specifier), use, licence_of(name))
        left += [(own, name) for own in _required(name, requirement.extras)]


def _required(name: str, extras: set[str]) -> list[Requirement]:
    try:
        own: Distribution = distribution(name)
    except PackageNotFoundError:
        return []
    requirements = map(Requirement, own.requires or [])
    return [
        one
        for one in requirements
        if one.marker is None or any(one.marker.evaluate({"extra": e}) for e in ("", *extras))
    ]


def canonical(name: str) -> str:
    """A package's name as indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


HEAD = """# Licences of what Chladni uses

<!-- Written by tools/list_licences.py from pyproject.toml and installed packages' metadata. -->

Chladni is under the MIT licence. What it needs to run is under permissive ones (a test checks).
esptool is under the GPL, so it is an extra: `pip install 'chladni[rom]'` adds it, for devices that
do not run ([flash.md](flash.md)).

- *Runtime* comes with `pip install chladni`, *extra* with `chladni[NAME]`.
- *Build* makes the wheel. nanobind and its robin-map (BSD-3-Clause, MIT) are compiled into the
  extension modules. Their licences stand in `licences/` and in the wheel.
- *Development* comes to no user. clang-format and clang-tidy have LLVM's exception.

The firmware for a chip links ESP-IDF (Apache-2.0). An installation on Linux has:

| package | asked for | use | licence | |
|---|---|---|---|---|
"""


def page(found: list[Row]) -> str:
    """The page."""
    return HEAD + "".join(row.line() + "\n" for row in found)


def differences(text: str, found: list[Row]) -> list[str]:
    """What a page lacks or says otherwise; licences of one kind may differ in words."""
    cells = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    there = {cell[0]: cell for cell in cells[1:]}
    faults = []
    for row in found:
        cell = there.get(row.name)
        if cell is None:
            faults.append(f"{row.name} is missing")
        elif cell[2] != row.use or cell[4] != row.kind:
            faults.append(f"{row.name}: {row.use}, {row.kind}, not {cell[2]}, {cell[4]}")
        elif row.asked != cell[1] and not (row.asked.startswith("by") and cell[1][:2] == "by"):
            faults.append(f"{row.name}: {row.asked}, not {cell[1]}")
    asked = {row.name for row in found}
    faults += [
        f"{name} is asked for no more"
        for name, cell in there.items()
        if name not in asked and cell[1][:3] != "by "
    ]
    return faults if text.startswith(HEAD) else [*faults, "the text above the table differs"]


def main() -> int:
    """Write the page, or compare it."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    found = rows(asked_for())
    if not parser.parse_args().check:
        PAGE.write_text(page(found), encoding="utf-8")
        return 0
    faults = differences(PAGE.read_text(encoding="utf-8"), found)
    for fault in faults:
        print(f"docs/licences.md: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
