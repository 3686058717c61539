"""A folder in which a page's commands run, one after the other, and devices that they start."""

from __future__ import annotations

import contextlib
import io
import os
import pickle
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from unittest import mock

from chladni.host.cli.app import main
from chladni.host.device.device import Device
from chladni.host.device.wires.wire import SerialWire
from chladni.sim.board.file import shipped_boards
from docs import transcript

PLAIN = {"cp", "ls", "cat", "sleep", "mkdir"}
"""Commands besides `chladni` that run as they stand."""

SHIPPED = frozenset(shipped_boards())
PATIENCE_S = 60.0
"""What is started in the background has so long to print what is expected of it."""


@dataclass
class Desk:
    """Where commands run.

    Attributes
    ----------
    folder
        The working folder; boards/ lies in it.
    built
        Tables that commands built, with what was printed: of all pages, of all workers of a run.
    """

    folder: Path
    built: Path
    _started: list[subprocess.Popen[bytes]] = field(default_factory=list)
    _ports: dict[str, Path] = field(default_factory=dict)

    def run(self, command: str, expected: tuple[str, ...] = ()) -> str:
        """Run one command; what is wrong with it or its output, or nothing."""
        try:
            words = shlex.split(command, comments=True)
        except ValueError as error:
            return str(error)
        if words[-1] == "&":
            return self._start(words[:-1], expected)
        if words[0] == "chladni":
            code, output = self._chladni(words[1:])
        elif words[0] in PLAIN:
            done = subprocess.run(
                words,
                cwd=self.folder,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                check=False,
            )
            code, output = done.returncode, done.stdout
        else:
            return f"{words[0]} is not run here: mark the block with what stands in"
        # A block that shows a refusal shows its words.
        is_shown = any(line.startswith("chladni: ") for line in expected)
        if code != 0 and not is_shown:
            return f"ended with {code}\n{output}"
        return transcript.difference(expected, output)

    def _chladni(self, words: list[str]) -> tuple[int, str]:
        """In this process, which has loaded all modules already.

        What builds a shipped board's table runs for the first page that has it, and for the others
        its file and its output are there again.
        """
        made = self.folder / words[-1]
        is_build = words[:2] == ["table", "build"] and words[-2] == "-o" and words[2] in SHIPPED
        kept = self.built / "-".join(own.strip("-") for own in words)
        if is_build and kept.exists():
            table, output = pickle.loads(kept.read_bytes())
            made.write_bytes(table)
            return 0, output
        heard = io.StringIO()
        with (
            contextlib.chdir(self.folder),
            mock.patch.object(sys, "argv", ["chladni", *words]),
            mock.patch.object(sys, "stdin", io.StringIO()),
            contextlib.redirect_stdout(heard),
            contextlib.redirect_stderr(heard),
        ):
            code = main()
        if is_build and code == 0:
            whole = kept.with_name(f"{kept.name}.{os.getpid()}")
            whole.write_bytes(pickle.dumps((made.read_bytes(), heard.getvalue())))
            whole.rename(kept)
        return code, heard.getvalue()

    def _start(self, words: list[str], expected: tuple[str, ...]) -> str:
        if words[0] != "chladni":
            return f"{words[0]} is not started here"
        said = self.folder / f"said-{len(self._started)}"
        with said.open("wb") as out:
            command = [sys.executable, "-m", "chladni.host.cli.app", *words[1:]]
            process = subprocess.Popen(
                command, cwd=self.folder, stdout=out, stderr=subprocess.STDOUT
            )
        self._started.append(process)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            output = said.read_text("utf-8")
            problem = transcript.difference(expected, output)
            if output.endswith("\n") and not problem:
                return ""
            if process.poll() is not None or time.monotonic() > deadline:
                return problem or f"ended at once, with {process.returncode}\n{output}"
            time.sleep(0.05)

    def port(self, board: str = "") -> Path:
        """The port of an emulated device, configured for a board; `prototype` if none is named.

        Its coils count as cool, as four seconds after power has come on.
        """
        board = board or "prototype"
        if board not in self._ports:
            own = self.folder / f"{board}-port"
            for command in (
                f"chladni emulate --serial --flash {board}-flash --board {board} "
                f"--port-link {board}-port &",
                f"chladni device config set --from {board} --yes --port {board}-port",
            ):
                if problem := self.run(command):
                    raise RuntimeError(problem)
            self.wait_for_coils(own)
            self._ports[board] = own
        return self._ports[board]

    @staticmethod
    def wait_for_coils(port: Path) -> None:
        """Until a device is sure that its coils have cooled."""
        deadline = time.monotonic() + PATIENCE_S
        with Device(SerialWire(str(port))) as device:
            while "coil hot" in device.info()["standing"] and time.monotonic() < deadline:
                device.link.wait(0.1)

    def close(self) -> None:
        """End what was started."""
        for process in self._started:
            process.terminate()
        for process in self._started:
            process.wait()


def new_desk(folder: Path, boards: Path, built: Path) -> Desk:
    """An empty desk but for the shipped boards."""
    os.symlink(boards, folder / "boards")
    return Desk(folder, built)
