"""Without esptool, which is an extra of its own: one clear message, and all else works."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

# Refuses esptool as an environment without it does, and says if anything asked.
RUN = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "esptool":
            raise ModuleNotFoundError("No module named 'esptool'", name="esptool")
sys.meta_path.insert(0, Missing())
sys.argv = ["chladni", *sys.argv[1:]]
from chladni.host.cli.app import start
start()
"""
MESSAGE = "chladni: ROM flashing needs esptool: pip install 'chladni[rom]'\n"


def run(folder: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", RUN, *map(str, words)], cwd=folder, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    "words",
    [
        ("flash", "t.chl", "--rom", "--port", "/dev/null"),
        ("flash", "--firmware", "f.bin", "--port", "/dev/null"),
        ("device", "config", "set", "channels=3", "--rom", "--port", "/dev/null"),
    ],
)
def test_rom_flashing_says_what_to_install(table_file: Path, words: tuple[str, ...]) -> None:
    (table_file.parent / "f.bin").write_bytes(b"\xe9" + bytes(99))
    done = run(table_file.parent, *words)
    assert (done.returncode, done.stdout, done.stderr) == (1, "", MESSAGE)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("--version",),
        ("board", "show", "paper"),
        ("table", "show", "t.chl"),
        ("flash", "t.chl", "--emulator"),
        ("device", "info", "--emulator"),
        ("device", "config", "describe"),
        ("device", "list"),
        ("flash", "--help"),
    ],
)
def test_what_is_not_rom_flashing_works_without(table_file: Path, words: tuple[str, ...]) -> None:
    done = run(table_file.parent, *words)
    assert done.returncode == 0, done.stderr
    assert "esptool" not in done.stderr


def test_esptool_is_imported_in_one_place() -> None:
    found = []
    for path in (ROOT / "host").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if any(name.split(".")[0] == "esptool" for name in names):
                found.append(path.name)
    assert set(found) == {"rom_loader.py"}
