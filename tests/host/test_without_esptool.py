"""Without esptool, which is an extra of its own: one clear message, and all else works."""

from __future__ import annotations

import ast

import pytest

from conftest import ROOT, made_once
from one_process import run_all

# Refuses esptool as an environment without it does.
MISSING = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "esptool":
            raise ModuleNotFoundError("No module named 'esptool'", name="esptool")
sys.meta_path.insert(0, Missing())
"""
MESSAGE = "chladni: ROM flashing needs esptool; pip install 'chladni[rom]'\n"
NEEDS_IT = (
    ("flash", "t.chl", "--rom", "--port", "/dev/null"),
    ("flash", "--firmware", "f.bin", "--port", "/dev/null"),
    ("device", "config", "set", "channels=3", "--rom", "--port", "/dev/null"),
)
WORKS_WITHOUT = (
    ("--version",),
    ("board", "show", "paper"),
    ("table", "show", "t.chl"),
    ("flash", "t.chl", "--emulator"),
    ("device", "info", "--emulator"),
    ("device", "config", "describe"),
    ("device", "list"),
    ("flash", "--help"),
)


@pytest.fixture(scope="module")
def without(
    table_bytes: bytes, tmp_path_factory: pytest.TempPathFactory
) -> dict[tuple[str, ...], tuple[int, str, str]]:
    """What every command comes to; those that need esptool come first, and nothing has loaded."""
    folder = tmp_path_factory.mktemp("without")
    (folder / "t.chl").write_bytes(table_bytes)
    (folder / "f.bin").write_bytes(b"\xe9" + bytes(99))
    commands = (*NEEDS_IT, *WORKS_WITHOUT)
    runs = [(folder, words) for words in commands]
    ended = made_once(tmp_path_factory, "no-esptool", lambda: run_all(runs, first=MISSING))
    return dict(zip(commands, ended, strict=True))


@pytest.mark.parametrize("words", NEEDS_IT)
def test_rom_flashing_says_what_to_install(
    without: dict[tuple[str, ...], tuple[int, str, str]], words: tuple[str, ...]
) -> None:
    assert without[words] == (1, "", MESSAGE)


@pytest.mark.parametrize("words", WORKS_WITHOUT)
def test_what_is_not_rom_flashing_works_without(
    without: dict[tuple[str, ...], tuple[int, str, str]], words: tuple[str, ...]
) -> None:
    code, _, err = without[words]
    assert code == 0, err
    assert "esptool" not in err


def test_esptool_is_imported_in_one_place() -> None:
    found = []
    for path in (ROOT / "host").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if any(name.split(".")[0] == "esptool" for name in names):
                found.append(path.name)
    assert set(found) == {"rom_loader.py"}
