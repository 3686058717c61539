"""Build the site from the pages as they are: docs/, and what stands at the root.

    python tools/docs/build_site.py            write out/site
    python tools/docs/build_site.py --to DIR   write it there

Pages are copied beside `zensical.toml`, a page per package is added of which docstrings make the
reference, and Zensical builds. Any warning is an error: a page or an anchor that is not there, a
name without a page.
"""

from __future__ import annotations

import argparse
import ast
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIG = Path(__file__).with_name("zensical.toml")
AT_ROOT = ("ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")
PACKAGES = {
    "sim": "sim",
    "drives": "tables",
    "tables": "tables",
    "design": "tables",
    "effects": "tables",
    "host": "host",
}
"""Packages, and the folders in which they lie."""


def face_of(package: str) -> ast.Module:
    """A package's `__init__.py`, read and not imported."""
    path = ROOT / PACKAGES[package] / "chladni" / package / "__init__.py"
    return ast.parse(path.read_text("utf-8"))


def public_names(package: str) -> dict[str, str]:
    """What a package's `__all__` names, each with where it is defined.

    A function may be called as the module that it is in, so the package's own name is not enough.
    """
    places, names = {}, []
    for node in ast.walk(face_of(package)):
        if isinstance(node, ast.ImportFrom) and node.module:
            places.update({one.name: f"{node.module}.{one.name}" for one in node.names})
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names = ast.literal_eval(node.value)
    return {name: places[name] for name in names}


def api_page(package: str) -> str:
    """The reference of a package: its own line, then every public name."""
    about = ast.get_docstring(face_of(package)) or ""
    names = "\n\n".join(f"::: {place}" for place in public_names(package).values())
    return f"# chladni.{package}\n\n{about}\n\n{names}\n"


def stage(folder: Path, docs: Path) -> None:
    """Lay out what Zensical reads."""
    pages = folder / "pages"
    shutil.copytree(docs, pages)
    for name in AT_ROOT:
        text = (ROOT / name).read_text("utf-8")
        (pages / name).write_text(re.sub(r"\]\(docs/", "](", text), "utf-8")
    for page in pages.glob("*.md"):
        text = page.read_text("utf-8")
        page.write_text(re.sub(r"\]\(\.\./", "](", text), "utf-8")
    (pages / "api").mkdir()
    for package, place in PACKAGES.items():
        (pages / "api" / f"{package}.md").write_text(api_page(package), "utf-8")
        if not (folder / place).exists():  # three packages lie in one
            (folder / place).symlink_to(ROOT / place)
    shutil.copy(CONFIG, folder / CONFIG.name)


def build(to: Path, docs: Path = ROOT / "docs") -> str:
    """Build from a folder of pages; returns what is wrong, or nothing."""
    with tempfile.TemporaryDirectory(prefix="site-") as name:
        folder = Path(name)
        stage(folder, docs)
        done = subprocess.run(
            [sys.executable, "-m", "zensical", "build", "--clean", "--strict"],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        said = done.stdout + done.stderr
        if done.returncode != 0 or "Warning" in said or "WARNING" in said:
            return said
        shutil.rmtree(to, ignore_errors=True)
        shutil.move(folder / "site", to)
    return ""


def main() -> int:
    """Build, or say why not."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--to", type=Path, default=ROOT / "out" / "site")
    to = parser.parse_args().to
    to.parent.mkdir(parents=True, exist_ok=True)
    if problem := build(to):
        print(problem)
        return 1
    print(f"{to}/index.html")
    return 0


if __name__ == "__main__":
    sys.exit(main())
