"""How commands end: Ctrl-C at any time, a full disk, output that no one takes."""

from __future__ import annotations

import io
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import pytest

import chladni.host
from chladni.host.cli.app import main
from conftest import ROOT, CommandLine, made_once
from one_process import run_all

pytestmark = pytest.mark.slow

# The console script as pip writes it, which says when its first line runs.
SCRIPT = """
import sys
sys.argv = ["chladni", *sys.argv[1:]]
from chladni.host.cli.app import start
print("up", file=sys.stderr, flush=True)
sys.exit(start())
"""
BUILD = ("table", "build", str(ROOT / "tests" / "chain" / "coarse.toml"), "-o", "t.chl")


def interrupted(process: subprocess.Popen[str], after_ms: int) -> str:
    """What a process says to Ctrl-C after so much processor time, on a busy machine too."""
    ticks_ms = 1000 // os.sysconf("SC_CLK_TCK")
    used_ms = 0
    while used_ms < after_ms and process.poll() is None:
        time.sleep(0.005)
        stat = Path(f"/proc/{process.pid}/stat").read_text("utf-8").rpartition(")")[2].split()
        used_ms = ticks_ms * (int(stat[11]) + int(stat[12]))
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    return process.stderr.read()


@pytest.mark.parametrize(
    "after_ms",
    [20, 300, 1000, *(pytest.param(ms, marks=pytest.mark.soak) for ms in (100, 600, 1400))],
)
def test_ctrl_c_at_any_time_shows_no_traceback_and_leaves_nothing(
    tmp_path: Path, after_ms: int
) -> None:
    """Once the program's first line has run: before it, Python itself loads and answers."""
    command = [sys.executable, "-c", SCRIPT, *BUILD]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "up\n"
        said = interrupted(process, after_ms)
    assert process.returncode == 130, said
    assert said.count("\n") <= 1
    assert "Traceback" not in said
    # What was found before Ctrl-C is kept, and nothing else.
    left = [path.name for path in tmp_path.iterdir()]
    assert left == (["t.chl.partial"] if "goes on" in said and left else [])


@pytest.mark.parametrize("is_taken", [False, True])
def test_sigterm_takes_a_served_devices_link_away(
    tmp_path: Path, table_file: Path, is_taken: bool
) -> None:
    """Unless another device has the name by now."""
    link = tmp_path / "a-port"
    words = ("emulate", table_file, "--serial", "--port-link", link)
    with subprocess.Popen(
        [sys.executable, "-m", "chladni.host.cli.app", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == f"{link}\n"
        if is_taken:
            link.unlink()
            link.symlink_to("/dev/pts/another")
        process.terminate()
        assert process.stderr.read() == ""
    assert process.returncode == 143
    assert link.is_symlink() == is_taken


def test_sigterm_ends_work_as_ctrl_c_does() -> None:
    """Workers, temporary files and what was kept are put in order by the same way out."""
    script = """
import os, signal
from chladni.host.cli.app import as_process
from chladni.host.cli.common.ending import run
def work():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    finally:
        print("in order", flush=True)
as_process(["json"], lambda: run("chladni", work))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (
        143,
        "in order\n",
        "chladni: interrupted\n",
    )


def test_ctrl_c_while_a_class_is_made_is_ctrl_c() -> None:
    """Python raises a RuntimeError over it."""
    script = """
from chladni.host.cli.app import as_process
def work():
    class Field:
        def __set_name__(self, owner, name):
            raise KeyboardInterrupt
    class Any:
        field = Field()
as_process(["json"], work)
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (130, "")


def test_ctrl_c_at_a_question_is_ctrl_c(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def press(*_: object, **__: object) -> str:
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("typer.prompt", press)
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    answer = chladni("device", "network", "set", "--ssid", "x", "--key", "k", "--emulator")
    assert (answer.code, answer.err) == (130, "chladni: interrupted\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("entry", ["chladni.host.cli.app", "chladni.host.cli.demo"])
def test_ctrl_c_in_the_module_as_it_is_run(tmp_path: Path, entry: str) -> None:
    command = [sys.executable, "-m", entry, *(BUILD if entry.endswith("app") else ())]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        said = interrupted(process, 700)
    assert process.returncode == 130, said
    assert "Traceback" not in said


def test_ctrl_c_while_text_is_run_ends_a_module_with_its_code(tmp_path: Path) -> None:
    """As dataclasses run it: Python remembers that, and would end what -m runs by the signal."""
    (tmp_path / "own.py").write_text(
        "from chladni.host.cli.app import as_process\n"
        "as_process(['json'], lambda: exec('raise KeyboardInterrupt'))\n",
        "utf-8",
    )
    done = subprocess.run([sys.executable, "-m", "own"], cwd=tmp_path, check=False)
    assert done.returncode == 130


def test_nothing_large_is_loaded_before_ctrl_c_is_answered() -> None:
    code = (
        "import sys, chladni.host.cli.app\n"
        "print(sorted({'numpy', 'matplotlib', 'typing', 'enum', 're'} & sys.modules.keys()))"
    )
    # Without site, whose .pth files of an editable installation load what they like.
    paths = [ROOT / "host" / "chladni", *sys.path]
    done = subprocess.run(
        [
            sys.executable,
            "-S",
            "-c",
            "import sys, types\n"
            f"sys.path[:0] = {[str(path) for path in paths]!r}\n"
            "own = sys.modules['chladni'] = types.ModuleType('chladni')\n"
            f"own.__path__ = [{str(ROOT / 'host' / 'chladni')!r}]\n" + code,
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "[]\n"


def test_every_name_of_the_package_can_be_had() -> None:
    for name in chladni.host.__all__:
        assert getattr(chladni.host, name).__name__ in (name, "Wire")
    assert chladni.host.__version__
    with pytest.raises(AttributeError, match="nonsense"):
        _ = chladni.host.nonsense


# Every command that writes, and the option that says where.
WRITING: dict[str, Sequence[str]] = {
    "field": ("field", "paper", "--actuator", "centre", "-o", "@.npz"),
    "modes": ("modes", "paper", "--count", "2", "-o", "@.npz"),
    "modes' figure": ("modes", "paper", "--count", "2", "--figure", "@.svg"),
    "sweep": ("sweep", "prototype", "-o", "@.npz"),
    "sweep's figure": ("sweep", "prototype", "--figure", "@.pdf"),
    "wiring": ("board", "wiring", "prototype", "-o", "@.svg"),
    "sensitivity": ("board", "sensitivity", "paper", "--figure", "@.png"),
    "solve": ("solve", "paper", "--target", "0,0", "--method", "anneal", "--steps", "5",
              "--trace", "@.npz"),
    "compare": ("compare", "paper", "--pitch", "60", "--methods", "nearest", "-o", "@.csv"),
    "compare's figure": ("compare", "paper", "--pitch", "60", "--methods", "nearest", "--figure",
                         "@.png"),
    "build": ("table", "build", "prototype", "-o", "@.chl"),
    "export": ("table", "export", "t.chl", "--csv", "@.csv"),
    "emulate": ("emulate", "t.chl", "--touch", "0,0@5", "--ms", "200", "-o", "@.npz"),
    "the emulator's flash": ("emulate", "--serial", "--ms", "1", "--flash", "@.bin"),
    "key": ("device", "key", "new", "@.key"),
}  # fmt: skip
NEW_ONLY = {"key", "the emulator's flash", "solve"}
"""What they write is no file of theirs unless they wrote it; an old one is another matter."""


Ended = tuple[int, str, dict[str, bytes], dict[str, bytes]]
"""Exit code, standard error, and the files of the folder before and after."""


def fill_disks(folder: Path, table: bytes) -> dict[str, Ended]:
    """All of `WRITING`, in one process that may write 40 bytes to a file: the same calls fail."""

    def contents(folder: Path) -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    runs = []
    for number, (case, template) in enumerate(WRITING.items()):
        own = folder / str(number)
        own.mkdir()
        words = [word.replace("@.", "result.") for word in template]
        (own / "t.chl").write_bytes(table)
        if case not in NEW_ONLY:
            (name,) = (word for word in words if word.startswith("result."))
            (own / name).write_bytes(b"what was there")
        runs.append((own, words))
    olds = [contents(own) for own, _ in runs]
    limit = partial(resource.setrlimit, resource.RLIMIT_FSIZE, (40, 40))
    rows = zip(WRITING, runs, olds, run_all(runs, before=limit), strict=True)
    return {case: (code, err, old, contents(own)) for case, (own, _), old, (code, _, err) in rows}


@pytest.fixture(scope="module")
def on_a_full_disk(
    table_bytes: bytes, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Ended]:
    folder = tmp_path_factory.mktemp("full")
    return made_once(tmp_path_factory, "full-disk", lambda: fill_disks(folder, table_bytes))


@pytest.mark.parametrize("case", WRITING)
def test_a_full_disk_is_said_and_leaves_what_was_there(
    on_a_full_disk: dict[str, Ended], case: str
) -> None:
    code, err, before, after = on_a_full_disk[case]
    assert code == 1, err
    assert "File too large" in err
    assert "Traceback" not in err
    assert after == before


def test_an_answer_that_no_one_can_take_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Some set it for all their programs: then nothing is left to be written at the end.
    monkeypatch.delenv("PYTHONUNBUFFERED", raising=False)
    for words in (("--version",), ("board", "show", "paper", "--json")):
        with Path("/dev/full").open("w", encoding="utf-8") as full:
            done = subprocess.run(
                [sys.executable, "-m", "chladni.host.cli.app", *words],
                cwd=tmp_path,
                stdout=full,
                stderr=subprocess.PIPE,
                text=True,
                check=False,
            )
        assert (done.returncode, done.stderr) == (1, "chladni: output: No space left on device\n")


def test_a_reader_that_leaves_early_is_no_traceback(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "chladni.host.cli.app", "--version", "--json"],
        cwd=tmp_path,
        stdout=writer,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (1, "")


def test_a_closed_output_is_a_line_and_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python has no stream where a shell closed it, as by `>&-`."""
    monkeypatch.setattr(sys, "argv", ["chladni", "board", "parts", "prototype"])
    monkeypatch.setattr(sys, "stdin", None)
    monkeypatch.setattr(sys, "stdout", None)
    assert main() == 1
    assert capsys.readouterr().err == "chladni: output: Bad file descriptor\n"
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, None)
    assert main() == 1


def test_a_terminal_without_unicode_gets_all_answers(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    written = {}
    for encoding in ("ascii", "utf-8"):
        out = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "argv", ["chladni", "board", "parts", "prototype"])
        assert main() == 0
        written[encoding] = out.buffer.getvalue().decode(encoding)
    lost = {letter for letter in written["utf-8"] if not letter.isascii()}
    assert lost
    assert "?" not in written["ascii"]
