"""Rules of the house (ARCHITECTURE.md) that neither import-linter nor a compiler checks."""

from __future__ import annotations

import ast
import re
import subprocess
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from chladni.sim.board.file import load_board
from conftest import ROOT

TESTS = ROOT / "tests"
CORE = ROOT / "firmware" / "esp32" / "core"
CORE_SOURCES = sorted([*CORE.rglob("*.cpp"), *CORE.rglob("*.hpp")])
ROOMS = (
    "generated", "hal.hpp", "base", "synthesis", "table", "fingers", "touch", "effects", "storage",
    "sensing", "limits", "device", "link",
)  # fmt: skip
IN_SINGLE_PRECISION = {
    *(path for path in CORE_SOURCES if path.relative_to(CORE).parts[0] in ("fingers", "effects")),
    CORE / "generated/low_pass_sections.hpp",
    CORE / "base/floats.hpp",
    CORE / "table/responses.hpp",
    CORE / "table/responses.cpp",
}
"""Runs in the main loop alone; what reaches the sample interrupt is checked by its objects
(firmware/test_iram.py) and may not include it (test_the_sample_path_is_below_single_precision)."""
# What is there without an operating system.
FREESTANDING = {"array", "atomic", "cstdint", "cstddef", "limits", "type_traits"}


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_a_room_of_the_core_uses_only_those_before_it(path: Path) -> None:
    own = ROOMS.index(path.relative_to(CORE).parts[0])
    for room in re.findall(r'#include "core/([\w.]+)', path.read_text(encoding="utf-8")):
        assert ROOMS.index(room) <= own, f"{path.relative_to(CORE)} includes something of {room}"


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_core_includes_nothing_but_itself_and_freestanding_headers(path: Path) -> None:
    for header in re.findall(r'#include\s+[<"]([^>"]+)[>"]', path.read_text(encoding="utf-8")):
        own = header.startswith("core/") and (ROOT / "firmware" / "esp32" / header).is_file()
        assert own or header in FREESTANDING, f"{path.name} includes {header}"


@pytest.mark.parametrize("path", CORE_SOURCES, ids=lambda p: p.name)
def test_core_neither_allocates_nor_throws_nor_uses_floating_point(path: Path) -> None:
    text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
    text = re.sub(r'"[^"\n]*"', '""', text)
    words = ["new", "delete", "malloc", "free", "throw", "try", "double", "dynamic_cast", "typeid"]
    if path not in IN_SINGLE_PRECISION:
        words.append("float")
    for word in words:
        assert not re.search(rf"\b{word}\b", text), f"{path.name} says {word}"


def test_the_sample_path_is_below_single_precision() -> None:
    """No header that what lies in IRAM includes, by however many steps, has a float in it."""
    fragment = (ROOT / "firmware/esp32/components/chladni_core/linker.lf").read_text("utf-8")
    names = re.findall(r"^ +(\w+) \(noflash", fragment, re.M)
    assert "sample_player" in names
    todo = [path for path in CORE_SOURCES if path.suffix == ".cpp" and path.stem in names]
    assert len(todo) == len(names)
    reached: set[Path] = set()
    while todo:
        path = todo.pop()
        reached.add(path)
        for name in re.findall(r'#include "(core/[^"]+)', path.read_text(encoding="utf-8")):
            if (header := ROOT / "firmware" / "esp32" / name) not in reached:
                todo.append(header)
    assert not IN_SINGLE_PRECISION & reached


def test_no_constant_is_generated_that_nothing_uses() -> None:
    """Named by its innermost namespace, by the alias `f` of that, or within its own header."""
    rooms = [ROOT / name for name in ("firmware", "tables/native", "bootloader_components")]
    sources = [path for room in rooms for path in room.rglob("*.[ch]*") if path.is_file()]
    text = "\n".join(
        path.read_text(encoding="utf-8") for path in sources if "generated" not in path.parts
    )
    counted = 0
    for header in sorted((CORE / "generated").glob("*.hpp")):
        lines = header.read_text(encoding="utf-8").splitlines()
        spaces: list[str] = []
        for line in lines:
            if opened := re.match(r"namespace ([\w:]+) \{", line):
                spaces.append(opened[1].rpartition("::")[2])
            elif line.startswith("}  // namespace"):
                spaces.pop()
            elif found := re.match(r"constexpr uint\d+_t (k\w+) =", line):
                counted += 1
                qualified = rf"\b(?:{spaces[-1]}|f)::{found[1]}\b"
                bare = rf"(?:\bchladni::|(?<!:)\b){found[1]}\b"
                is_used = re.search(bare if spaces[-1] == "chladni" else qualified, text)
                in_header = len(re.findall(bare, "\n".join(lines))) > 1
                assert is_used or in_header, f"{header.name}: {found[1]}"
    assert counted > 100


def test_emulator_and_platformio_build_the_same_core() -> None:
    """Both take every .cpp of core/ by pattern; the chip's list is checked by running it."""
    cmake = (ROOT / "firmware/esp32/emulator/CMakeLists.txt").read_text(encoding="utf-8")
    ini = (ROOT / "platformio.ini").read_text(encoding="utf-8")
    assert 'file(GLOB_RECURSE CORE CONFIGURE_DEPENDS "${FIRMWARE}/core/*.cpp")' in cmake
    assert "+<../core/>" in ini


def test_every_board_number_lives_in_board_files() -> None:
    """No number of the paper's board is in code."""
    for path in [*(ROOT / "sim").rglob("*.py"), *(ROOT / "tables").rglob("*.py"), *CORE_SOURCES]:
        text = path.read_text(encoding="utf-8")
        for number in ("71.5", "146.7", "24.25", "43.35", "25.75", "63.35"):
            for match in re.finditer(rf"(?<![\d.]){re.escape(number)}(?![\d.])", text):
                line = text[text.rfind("\n", 0, match.start()) + 1 : text.find("\n", match.end())]
                assert line.lstrip().startswith(("#", "//", '"""')), f"{path}: {line}"


def test_the_authors_pins_are_declared_in_board_files_alone() -> None:
    pins = load_board("prototype").electronics.pwm_pins
    written = (", ".join(map(str, pins)), " | ".join(f"BIT({pin})" for pin in pins))
    rooms = ("sim", "tables", "host", "firmware", "bootloader_components", "tools")
    holders = [
        path.relative_to(ROOT).as_posix()
        for room in rooms
        for path in (ROOT / room).rglob("*.*")
        if path.suffix in (".py", ".cpp", ".hpp", ".c", ".h")
        and any(text in path.read_text(encoding="utf-8") for text in written)
    ]
    assert holders == ["bootloader_components/gates/gates.h"]


@pytest.mark.parametrize("page", ["security.md", "reliability.md"])
def test_what_is_promised_names_tests_that_there_are(page: str) -> None:
    """Whole files of tests, or single ones."""
    promised = set(re.findall(r"`(test_\w+)`", (ROOT / "docs" / page).read_text()))
    files = list((ROOT / "tests").rglob("test_*.py"))
    known = {file.stem for file in files}
    known |= {
        name for file in files for name in re.findall(r"^def (test_\w+)", file.read_text(), re.M)
    }
    assert len(promised) > 5
    assert promised <= known, promised - known


MOST_LINES, MOST_OF_A_FUNCTION, MOST_FILES = 350, 50, 15
CODE = {".py", ".cpp", ".hpp", ".c", ".h", ".js"}
GENERATED = "// Generated by tools/"
WITHOUT_A_BOUND = ("tests", "docs")
"""Of the files in a folder, as the root is."""


def code_files() -> list[Path]:
    """Committed code, but what a tool has written."""
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    paths = [ROOT / name for name in listed if Path(name).suffix in CODE]
    return [path for path in paths if path.exists() and not is_generated(path)]


def is_generated(path: Path) -> bool:
    """Whether the first line names the tool that wrote the file."""
    return path.read_text("utf-8").startswith(GENERATED)


def python_functions(text: str) -> Iterator[tuple[str, int]]:
    """Name and lines of each body, docstring aside; clang-tidy counts a body's lines too."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node, clean=False) is not None else node.body
            yield node.name, (node.end_lineno or 0) - body[0].lineno + 1 if body else 0


def script_functions(text: str) -> Iterator[tuple[str, int]]:
    """First line and lines of each body; a block ends where a brace stands as its first line."""
    lines = text.splitlines()
    for first, line in enumerate(lines):
        if re.search(r"\bfunction\b.*\{$|=> \{$", line):
            end = line[: len(line) - len(line.lstrip())] + "}"
            last = next(k for k in range(first + 1, len(lines)) if lines[k].startswith(end))
            yield line.strip(), last - first - 1


def c_functions(text: str) -> Iterator[tuple[str, int]]:
    """Signature and lines of each body of C, as clang-format sets them."""
    for found in re.finditer(r"^(\w[^;{}]*\)) \{\n(.*?)^\}", text, re.M | re.S):
        yield found[1], found[2].count("\n")


MEASURES = {
    ".py": python_functions,
    ".js": script_functions,
    ".c": c_functions,
    ".h": c_functions,
}


def too_long(files: Iterable[Path], root: Path) -> list[str]:
    """Files, functions and folders that have more than ARCHITECTURE.md allows.

    Functions of C++ are clang-tidy's to measure.
    """
    found, folders = [], Counter[Path]()
    for path in files:
        name, text = path.relative_to(root), path.read_text("utf-8")
        if len(text.splitlines()) > MOST_LINES:
            found.append(f"{name}: {len(text.splitlines())} lines")
        measure = MEASURES.get(path.suffix)
        for function, lines in measure(text) if measure else ():
            if lines > MOST_OF_A_FUNCTION:
                found.append(f"{name}, {function}: {lines} lines")
        if path.stem != "__init__" and len(name.parts) > 1 and name.parts[0] not in WITHOUT_A_BOUND:
            folders[name.parent] += 1
    return found + [f"{at}: {count} files" for at, count in folders.items() if count > MOST_FILES]


def test_files_functions_and_folders_are_small() -> None:
    assert too_long(code_files(), ROOT) == []


def test_only_what_a_tool_wrote_has_no_bound() -> None:
    listed = {path.relative_to(ROOT).as_posix() for path in code_files()}
    assert "bootloader_components/gates/gates_hook.c" in listed
    assert "bootloader_components/gates/gates.h" not in listed
    assert not any("generated" in Path(name).parts for name in listed)


def test_what_is_too_long_is_found(tmp_path: Path) -> None:
    """One more of each than is allowed; docstrings, signatures and tests' folders do not count."""
    body = "    x = 1\n" * MOST_OF_A_FUNCTION
    signature = "def f(\n    a: int,\n) -> None:\n"
    texts = {
        "a/lines.cpp": "\n" * 351,
        "a/enough.cpp": "\n" * 350,
        "a/lines.h": "\n" * 351,
        "a/lines.c": "\n" * 351,
        "a/long.py": f'{signature}    """Long."""\n{body}    y = 2\n',
        "a/short.py": f'{signature}    """Short.\n\n    So long.\n    """\n{body}',
        "a/long.js": f"export function f() {{\n{body}  y();\n}}\n",
        "a/short.js": f"on(() => {{\n{body}}});\nf();\n",
        "a/long.c": f"static void f(int a,\n    int b) {{\n{body}  g();\n}}\nvoid h(void) {{}}\n",
        "a/short.c": f"int x;\nint f(void) {{\n{body}}}\n",
        **{f"b/{k}.js": "" for k in range(16)},
        "b/__init__.py": "",
        **{f"c/{k}.js": "" for k in range(15)},
        "c/__init__.py": "",
        **{f"tests/{k}.py": "" for k in range(16)},
        **{f"{k}.py": "" for k in range(16)},
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, "utf-8")
    assert too_long([tmp_path / name for name in texts], tmp_path) == [
        "a/lines.cpp: 351 lines",
        "a/lines.h: 351 lines",
        "a/lines.c: 351 lines",
        "a/long.py, f: 51 lines",
        "a/long.js, export function f() {: 51 lines",
        "a/long.c, static void f(int a,\n    int b): 51 lines",
        "b: 16 files",
    ]


def test_names_of_test_files_are_used_once() -> None:
    """Of two outside a package, whoever runs both folders gets one."""
    files = [
        path for path in TESTS.rglob("test_*.py") if not (path.parent / "__init__.py").exists()
    ]
    assert [name for name, times in Counter(path.name for path in files).items() if times > 1] == []
