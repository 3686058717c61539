"""Let PlatformIO build `platform = native` where its package registry is out of reach.

Before the first build PlatformIO downloads two packages: its build engine (`tool-scons`), which
is SCons, and the `native` platform, which uses the machine's own compiler. With PyPI's SCons
beside PlatformIO, a few lines that tell PlatformIO where things are can stand in for both. This
script writes them into a PlatformIO core directory, so that an unchanged `platformio.ini` builds
without the network:

    python -m pip install platformio==6.2.0 scons==4.11.1
    python tools/platformio_offline.py CORE_DIR                        # write CORE_DIR
    python tools/platformio_offline.py CORE_DIR -- run -e native       # write, then `pio run ...`

It serves `platform = native` only. Any other platform, `lib_deps`, `pio check` and the unity,
doctest and googletest runners still need the registry; PlatformIO tries for about a minute before
it says so. A folder `test/test_*` makes even `pio run` fetch Unity, unless the environment says
`test_framework = custom`.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Final

# PlatformIO 6.2.0 accepts tool-scons ~4.41101.0 alone (platformio/dependencies.py). The registry
# numbers that package after the SCons inside: 4.11.1 is 4.(4)(11)(01).0. The three move together.
PLATFORMIO_VERSION: Final = "6.2.0"
SCONS_VERSION: Final = "4.11.1"
TOOL_SCONS_VERSION: Final = "4.41101.0"

# Any version serves, since the project asks for `platform = native` without one.
NATIVE_VERSION: Final = "1.2.1"

# Stands in both manifests, so that a package that came from the registry is never overwritten.
MARK: Final = "written by platformio_offline.py"

EXIT_USER_CAN_MEND: Final = 2

_SCONS_PY: Final = '''\
"""Run the SCons of the interpreter that runs PlatformIO."""

import sys

from SCons.Script.Main import main

if __name__ == "__main__":
    sys.exit(main())
'''

_PLATFORM_PY: Final = '''\
"""The machine PlatformIO runs on, as a target: no packages, no boards."""

from platformio.platform.base import PlatformBase


class NativePlatform(PlatformBase):
    """Found by PlatformIO under this name."""
'''

# PlatformIO has loaded SCons' generic tools by now, and they chose `cc` and `c++`. Those are
# whatever the machine links them to; `gcc` and `g++` are what the flags are written for.
_BUILDER_MAIN_PY: Final = '''\
"""Build the project with the machine's gcc and g++; `-t exec` also runs it."""

from SCons.Script import AlwaysBuild, COMMAND_LINE_TARGETS, Default, DefaultEnvironment

env = DefaultEnvironment()
env.Replace(CC="gcc", CXX="g++")

program = env.BuildProgram()
Default(program)

if "exec" in COMMAND_LINE_TARGETS:
    AlwaysBuild(
        env.Alias(
            "exec",
            program,
            env.VerboseAction("$PROGPATH $PROGRAM_ARGS", "Executing $PROGPATH"),
        )
    )
'''


class OfflineError(Exception):
    """Something the caller can mend; the message names what was expected, found, and the remedy."""


class ForeignPackageError(OfflineError):
    """The core directory already holds a package that this script did not write."""


class WrongVersionError(OfflineError):
    """PlatformIO or SCons is missing, or is not the version these files are made for."""


def _json(value: Mapping[str, object]) -> str:
    return json.dumps(value, indent=2) + "\n"


def _install_record(*, kind: str, name: str, version: str) -> str:
    """`.piopm`, PlatformIO's note of where a package came from.

    Without the owner `platformio` in it a tool-scons that is already there does not count, and
    PlatformIO asks the registry. Its reader takes these keys and no others.
    """
    spec = {
        "owner": "platformio",
        "id": None,
        "name": name,
        "requirements": None,
        "uri": None,
    }
    return _json({"type": kind, "name": name, "version": version, "spec": spec})


def core_files() -> dict[PurePosixPath, str]:
    """Every file of the core directory.

    Returns
    -------
    dict of PurePosixPath to str
        Contents by path relative to the core directory.
    """
    tool_scons = {
        "name": "tool-scons",
        "version": TOOL_SCONS_VERSION,
        "description": f"PyPI's SCons {SCONS_VERSION} for PlatformIO, {MARK}",
        "system": "*",
    }
    native = {
        "name": "native",
        "title": "Native",
        "version": NATIVE_VERSION,
        "description": f"The machine's own gcc and g++, {MARK}",
    }
    tool_dir = PurePosixPath("packages/tool-scons")
    native_dir = PurePosixPath("platforms/native")
    return {
        tool_dir / "package.json": _json(tool_scons),
        tool_dir / "scons.py": _SCONS_PY,
        tool_dir / ".piopm": _install_record(
            kind="tool", name="tool-scons", version=TOOL_SCONS_VERSION
        ),
        native_dir / "platform.json": _json(native),
        native_dir / "platform.py": _PLATFORM_PY,
        native_dir / "builder" / "main.py": _BUILDER_MAIN_PY,
        native_dir / ".piopm": _install_record(
            kind="platform", name="native", version=NATIVE_VERSION
        ),
    }


def _read_text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None


def _replace_atomically(path: Path, text: str) -> None:
    """Write beside `path`, then rename: another build never reads half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # Named by hand: tempfile's mode 0600 would shut other users out of a shared directory.
    temporary = path.with_name(f".new-{os.getpid()}-{path.name}")
    try:
        temporary.write_text(text, encoding="utf-8", newline="\n")
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_core_dir(core_dir: Path) -> None:
    """Write the two packages into `core_dir`; a file that is already right is left alone.

    Other contents stay: PlatformIO keeps its state and caches here, and packages it did get from
    the registry may live beside these.

    Parameters
    ----------
    core_dir : Path
        What `PLATFORMIO_CORE_DIR` will name; made if missing.

    Raises
    ------
    ForeignPackageError
        A tool-scons or native platform from elsewhere is in the way. Nothing has been written.
    """
    files = core_files()
    for manifest in (p for p in files if p.name in ("package.json", "platform.json")):
        path = core_dir / manifest
        found = _read_text(path)
        foreign = path.with_name(".piopm").exists() if found is None else MARK not in found
        if foreign:
            raise ForeignPackageError(
                f"expected {path.parent} to be absent or {MARK}, found another package; "
                "name a core directory of its own, or use this one without this script"
            )
    # Records come last: PlatformIO counts a package as installed once its .piopm is there.
    for relative in sorted(files, key=lambda p: p.name == ".piopm"):
        path = core_dir / relative
        if _read_text(path) != files[relative]:
            _replace_atomically(path, files[relative])


def core_environment(core_dir: Path) -> dict[str, str]:
    """Environment variables with which PlatformIO uses `core_dir` and stays off the network.

    Parameters
    ----------
    core_dir : Path
        As written by `write_core_dir`.

    Returns
    -------
    dict of str to str
        Variables to add to the environment.
    """
    core = core_dir.resolve()
    return {
        "PLATFORMIO_CORE_DIR": str(core),
        # Each defaults to a folder of the core directory, and if the caller's environment holds
        # one that names another place, PlatformIO would look for the packages there.
        "PLATFORMIO_PACKAGES_DIR": str(core / "packages"),
        "PLATFORMIO_PLATFORMS_DIR": str(core / "platforms"),
        "PLATFORMIO_CACHE_DIR": str(core / ".cache"),
        # Either of these, left on, can hold up every call for a minute while it looks for a host.
        "PLATFORMIO_DISABLE_UPGRADE_CHECK": "true",
        "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no",
    }


def check_versions() -> None:
    """Refuse an environment in which PlatformIO would turn to the registry after all.

    Raises
    ------
    WrongVersionError
        Names the distribution, the version expected and the one found.
    """
    for name, expected in (("platformio", PLATFORMIO_VERSION), ("scons", SCONS_VERSION)):
        try:
            found = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found = "none"
        if found != expected:
            raise WrongVersionError(
                f"expected {name} {expected} beside {sys.executable}, found {found}; "
                f"run: {shlex.quote(sys.executable)} -m pip install {name}=={expected}"
            )


def run_platformio(core_dir: Path, arguments: Sequence[str]) -> int:
    """Run PlatformIO on `core_dir` with this interpreter.

    Parameters
    ----------
    core_dir : Path
        As written by `write_core_dir`.
    arguments : sequence of str
        What would follow `pio`.

    Returns
    -------
    int
        PlatformIO's exit code; 128 + n if signal n ended it, as a shell reports it.
    """
    environment = {**os.environ, **core_environment(core_dir)}
    # PlatformIO starts SCons with the interpreter this variable names, if there is one; it must
    # be the one whose site-packages hold SCons.
    environment["PYTHONEXEPATH"] = sys.executable
    command = [sys.executable, "-m", "platformio", *arguments]
    code = subprocess.run(command, env=environment, check=False).returncode
    return code if code >= 0 else 128 - code


def main(argv: Sequence[str] | None = None) -> int:
    """Command line of this script.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the script's name; `sys.argv` by default.

    Returns
    -------
    int
        PlatformIO's exit code if it ran, 0 if only the directory was written, 2 for what the
        caller can mend.
    """
    given = list(sys.argv[1:] if argv is None else argv)
    # Split here, not in argparse: whatever follows is PlatformIO's, a second "--" included.
    split = given.index("--") if "--" in given else len(given)
    own, for_platformio = given[:split], given[split + 1 :]

    parser = argparse.ArgumentParser(
        description="Make PlatformIO's `platform = native` work without its registry.",
        usage="%(prog)s [-h] CORE_DIR [-- PIO_ARGUMENT ...]",
        epilog="Without PIO_ARGUMENTs the variables that a `pio` of your own needs are printed, "
        "as a POSIX shell takes them.",
    )
    parser.add_argument("core_dir", metavar="CORE_DIR", type=Path)
    core_dir: Path = parser.parse_args(own).core_dir

    try:
        if for_platformio:
            check_versions()
        write_core_dir(core_dir)
        if for_platformio:
            return run_platformio(core_dir, for_platformio)
    except (OfflineError, OSError) as error:
        print(f"platformio_offline: {error}", file=sys.stderr)
        return EXIT_USER_CAN_MEND
    for name, value in core_environment(core_dir).items():
        print(f"export {name}={shlex.quote(value)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
