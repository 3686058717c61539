"""A command loads its own module and no other, and none loads SciPy to talk to a device."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import pytest
import typer

from chladni.host.cli import app as cli_app
from chladni.host.cli import command_line
from chladni.host.cli.common.command_modules import MODULES

LOADED = """
import atexit, sys
from chladni.host.cli.app import start
names = sys.argv.pop(1).split(",")
atexit.register(lambda: print("loaded", *(name for name in names if name in sys.modules)))
sys.argv = ["chladni", *sys.argv[1:]]
start()
"""


@pytest.mark.parametrize("module", sorted(set(MODULES.values())))
def test_a_module_has_the_commands_that_are_looked_for_in_it(module: str) -> None:
    app = typer.Typer()
    import_module(f"chladni.host.cli.{module}").register(app)
    assert set(typer.main.get_group(app).commands) == {
        command for command, place in MODULES.items() if place == module
    }


def test_what_is_loaded_by_name_is_told_to_import_linter() -> None:
    """A name in a string is no import to it, and rooms could use each other unseen."""
    tree = ast.parse(Path(str(command_line.__file__)).read_text("utf-8"))
    under_type_checking = next(one for one in tree.body if isinstance(one, ast.If)).body
    told = {
        f"{imported.module}.{name.name}"
        for imported in under_type_checking
        if isinstance(imported, ast.ImportFrom)
        for name in imported.names
    }
    assert told == {f"chladni.host.cli.{module}" for module in MODULES.values()}


@pytest.mark.parametrize(
    ("words", "loaded"),
    [
        (("device", "info", "--emulator", "--table", "no.chl"), []),
        (("emulate", "no.chl", "--serial"), []),
        (("table", "show", "no.chl"), ["chladni.host.cli.table", "scipy"]),
    ],
)
def test_a_command_loads_no_more_than_it_needs(
    words: tuple[str, ...], loaded: list[str], tmp_path: Path
) -> None:
    """All of it takes two seconds of a core, at every command."""
    names = ("chladni.host.cli.board", "chladni.host.cli.table", "matplotlib", "scipy", "skimage")
    done = loading(names, words, tmp_path)
    assert done.stdout.splitlines()[-1].split() == ["loaded", *loaded], done.stderr
    assert "no.chl" in done.stderr


@pytest.mark.parametrize("words", [("--help",), ("board", "parts", "strip5")])
def test_lists_need_no_figures_and_no_statistics(words: tuple[str, ...], tmp_path: Path) -> None:
    """These three took half of what `chladni board parts` took, and two thirds of `--help`."""
    names = ("matplotlib", "scipy.stats", "scipy.optimize")
    done = loading(names, words, tmp_path)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "loaded"


def loading(
    names: Sequence[str], words: Sequence[str], folder: Path
) -> subprocess.CompletedProcess[str]:
    """A command that says on its last line which of these modules it has loaded."""
    return subprocess.run(
        [sys.executable, "-c", LOADED, ",".join(names), *words],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(("given", "wanted"), [(None, "1"), ("3", "3")])
def test_linear_algebra_has_one_thread_unless_the_user_says_more(
    given: str | None, wanted: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Set before NumPy loads. Threads that wait for each other make a sweep five times as long."""
    told: list[str] = []
    for name in cli_app.ONE_THREAD:
        monkeypatch.delenv(name, raising=False)
        if given is not None:
            monkeypatch.setenv(name, given)
    monkeypatch.setattr(
        cli_app, "as_process", lambda *_: told.extend(os.environ[n] for n in cli_app.ONE_THREAD)
    )
    cli_app.start()
    assert told == [wanted, wanted]
