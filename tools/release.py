"""Check that a tag is the version everywhere, and take its notes from CHANGELOG.md.

    python tools/release.py --tag v0.2.0 --notes notes.md

Exits with 1 and a line for each disagreement; then no notes are written.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEADING = re.compile(r"^## (?P<version>\S+) – (?P<date>\d{4}-\d\d-\d\d)$", re.MULTILINE)


def notes_of(changelog: str, version: str) -> str | None:
    """What CHANGELOG.md tells of a version; None if it has no dated heading of it."""
    headings = list(HEADING.finditer(changelog))
    for number, heading in enumerate(headings):
        if heading["version"] == version:
            end = headings[number + 1].start() if number + 1 < len(headings) else len(changelog)
            return changelog[heading.end() : end].strip() + "\n"
    return None


def faults_of(tag: str, root: Path = ROOT) -> list[str]:
    """Where a tag disagrees with what is there."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    version = str(project["version"])
    faults = []
    if tag != f"v{version}":
        faults.append(f"pyproject.toml: expected the version of the tag {tag}, got {version}")
    citation = (root / "CITATION.cff").read_text(encoding="utf-8")
    if not re.search(rf'^version: "?{re.escape(version)}"?$', citation, re.MULTILINE):
        faults.append(f"CITATION.cff: expected version {version}")
    changelog = (root / "CHANGELOG.md").read_text(encoding="utf-8")
    if not notes_of(changelog, version):
        faults.append(f"CHANGELOG.md: expected a heading '## {version} – YYYY-MM-DD', and notes")
    if "## Unreleased" in changelog:
        faults.append("CHANGELOG.md: expected nothing unreleased")
    return faults


def main() -> int:
    """Check a tag and write its notes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--tag", required=True, help="vX.Y.Z")
    parser.add_argument("--notes", type=Path, required=True, help="file to write")
    asked = parser.parse_args()
    faults = faults_of(asked.tag)
    if faults:
        sys.stderr.write("\n".join(faults) + "\n")
        return 1
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    asked.notes.write_text(notes_of(changelog, asked.tag.removeprefix("v")) or "", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
