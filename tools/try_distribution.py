"""Build the distribution and use it elsewhere: every command, without the checkout.

    python tools/try_distribution.py

Makes an sdist, a wheel of that sdist, and an empty environment in a temporary folder with nothing
but the wheel and what it asks for. There every command of `chladni` runs and must end with 0. A
command that is not in `COMMANDS` is a failure too. Then comes the extra `rom`. It needs Python, and
nothing of this checkout's environment.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIST_COMMANDS = """
import json, typer
from chladni.host.cli.command_line import app
def walk(command, path=()):
    for name, own in getattr(command, "commands", {}).items():
        yield from walk(own, (*path, name))
    if not hasattr(command, "commands"):
        yield " ".join(path)
print(json.dumps(list(walk(typer.main.get_command(app)))))
"""
IN_PYTHON = """
import chladni.host
from chladni.drives import solve
from chladni.host import Device, EmulatorWire, config_of
from chladni.host.figures import field_figure
from chladni.sim import load_board
from chladni.tables import build_table
print(chladni.host.__version__, len(solve(load_board("prototype"), (10.0, 25.0)).drive))
"""
# In this order: later ones read what earlier ones wrote.
COMMANDS: dict[str, tuple[str, ...]] = {
    "design": ("small", "-o", "own.toml", "--samples", "1"),
    "board show": ("prototype",),
    "board score": ("own.toml", "--no-perturbed", "--figure", "score.png"),
    "board sensitivity": ("paper",),
    "board refit": ("strip5", "--foam", "1.9", "-o", "refitted.toml"),
    "fingers": ("strip5", "--fingers", "2", "--sets", "4", "--samples", "1", "--figure", "two.png"),
    "effects list": (),
    "effects show": ("click",),
    "effects convert": ("click", "-o", "click.ahap"),
    "effects build": ("calculator", "-o", "calculator.che"),
    "effects flash": ("calculator", "--emulator"),
    "calibrate": (
        "--board",
        "strip5",
        "--emulator",
        "--hidden",
        "4",
        "-o",
        "measured.toml",
        "--sets",
        "1",
    ),
    "board wiring": ("prototype", "-o", "wiring.svg"),
    "board drawing": ("strip5", "-o", "strip5.dxf"),
    "board parts": ("strip5",),
    "modes": ("prototype", "--count", "4", "--figure", "modes.png"),
    "field": ("prototype", "--target", "10,25", "-o", "f.npz"),
    "solve": ("prototype", "--target", "10,25"),
    "sweep": ("prototype", "--from", "150", "--to", "170", "--figure", "sweep.png"),
    "compare": ("prototype", "--pitch", "60", "--methods", "phasor,nearest", "-o", "c.csv"),
    "table build": ("prototype", "-o", "t.chl"),
    "table show": ("t.chl", "--at", "10,25"),
    "play": ("click.ahap", "--at", "10,25", "--emulator", "--table", "t.chl", "--figure", "p.png"),
    "table verify": ("t.chl",),
    "table score": ("t.chl", "--pitch", "60", "--samples", "1", "--figure", "played.png"),
    "table diff": ("t.chl", "t.chl"),
    "table export": ("t.chl", "--csv", "t.csv"),
    "emulate": ("t.chl", "--touch", "10,25@20", "--ms", "300", "-o", "r.npz"),
    "studio": ("strip5", "--export", "page"),
    "flash": ("t.chl", "--emulator"),
    "device info": ("--emulator", "--table", "t.chl"),
    "device touch": ("10,25", "--seconds", "0.2", "--emulator", "--table", "t.chl"),
    "device touches": ("--emulator", "--table", "t.chl"),
    "device stream": ("1@0,0.5@90,0.2@0,0@0,0@0", "--seconds", "0.2", "--emulator"),
    "device self-test": ("--emulator",),
    "device frequency": ("160", "--emulator", "--table", "t.chl"),
    "device waveform": ("square", "--emulator", "--table", "t.chl"),
    "device key new": ("own.key",),
    "device log": ("--seconds", "0.2", "--emulator"),
    "device config": ("get", "--emulator"),
    "device network": ("show", "--emulator"),
    "device list": (),
}
NOTICES = ("LICENSE", "licences/nanobind.txt", "licences/robin-map.txt")
"""Of Chladni, and of the sources that the extension modules are compiled with."""
TEXT = {"device log"}
"""Commands that answer with text alone."""


def run(*command: str | Path, cwd: Path, quiet: bool = True) -> str:
    """A program's standard output; what it said besides is shown if it fails."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    done = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def new_environment(folder: Path) -> Path:
    """The Python of a new environment, with nothing in it."""
    venv.create(folder, with_pip=True)
    return folder / "bin" / "python"


def pip_of(python: Path) -> tuple[Path | str, ...]:
    """Its installer."""
    return python, "-m", "pip", "--quiet", "--disable-pip-version-check"


def check_contents(wheel: Path) -> None:
    """A wheel holds Chladni, and the licences of what was compiled into it; nothing else."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    lacking = [
        one for one in NOTICES if not any(name.endswith(f"licenses/{one}") for name in names)
    ]
    foreign = [
        name for name in names if not name.startswith("chladni/") and ".dist-info/" not in name
    ]
    if lacking or foreign:
        sys.exit(f"{wheel.name} lacks {lacking}, and should not hold {foreign}")


def try_rom_extra(folder: Path, python: Path, wheel: Path) -> None:
    """Flashing through the ROM's loader asks for its extra, and with it for a port."""
    flash = (python, "-m", "chladni.host.cli.app", "flash", "t.chl", "--rom", "--port", "nowhere")
    for begin in ("chladni: ROM flashing needs esptool; pip install 'chladni[rom]'", "nowhere: "):
        done = subprocess.run(flash, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 1 or begin not in done.stderr:
            sys.exit(f"{begin!r} expected: {done.returncode}\n{done.stdout}{done.stderr}")
        print(f"chladni flash --rom: {begin}", flush=True)
        if begin.startswith("chladni"):
            run(*pip_of(python), "install", f"{wheel}[rom]", cwd=folder)


def main() -> None:
    """Build, install, run; without the extra `rom` and with it."""
    with tempfile.TemporaryDirectory(prefix="chladni-") as name:
        folder = Path(name)
        builder, python = (new_environment(folder / own) for own in ("builder", "env"))
        run(*pip_of(builder), "install", "build>=1.2", cwd=folder)
        # The wheel is made of the sdist, in a folder of its own.
        run(builder, "-m", "build", "--outdir", folder, ROOT, cwd=folder)
        (sdist,) = folder.glob("chladni-*.tar.gz")
        (wheel,) = folder.glob("chladni-*.whl")
        check_contents(wheel)
        print(f"{sdist.name}: {sdist.stat().st_size} bytes; {wheel.name}: {wheel.stat().st_size}")
        # Compiled when it is used: of all that pip would compile, a third.
        run(*pip_of(python), "install", "--no-compile", wheel, cwd=folder)
        chladni = folder / "env" / "bin" / "chladni"
        known = json.loads(run(python, "-c", LIST_COMMANDS, cwd=folder))
        if missing := sorted(set(known) ^ set(COMMANDS)):
            sys.exit(f"not tried, or there no more: {', '.join(missing)}")
        print(run(chladni, "--version", cwd=folder).strip())
        print("from Python: version", run(python, "-c", IN_PYTHON, cwd=folder).strip())
        for command, arguments in COMMANDS.items():
            as_json = () if command in TEXT else ("--json",)
            answer = run(chladni, *command.split(), *arguments, *as_json, cwd=folder)
            if as_json:
                json.loads(answer)
            print(f"chladni {command}: ok", flush=True)
        try_rom_extra(folder, python, wheel)


if __name__ == "__main__":
    main()
