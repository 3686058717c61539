"""The trial of pages finds mistakes: a small page with each of them in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from conftest import ROOT
from docs.page_text import read_page, slug
from docs.references import broken
from docs.transcript import difference, steps
from docs.trial import Trial, try_page

FINE = """# A page

## How `it` is done, twice

```python
place = (10.0, 25.0)
```

```python
assert place[1] == 25.0
```

```console
$ chladni board parts strip5 --json
...
$ chladni board show no-such-board
chladni: BOARD: expected a board file that is there, or one of: ... got 'no-such-board'
```

```toml
[plate]
thickness_mm = 0.3
```

<!-- each line alone, in [plate] -->
```toml
thickness_mm = 0.3
thickness_mm = { from = 0.1, to = 0.4 }
```

```text
a layout
```

<!-- not run: needs a chip; tests/device and `make dist` stand in -->
```console
$ pio run -e esp32
```

[here](#how-it-is-done-twice), [there](README.md)
"""


def tried(text: str, folder: Path) -> Trial:
    path = folder / "page.md"
    path.write_text(text, "utf-8")
    return try_page(path, ROOT, folder)


def test_a_page_without_mistakes_passes(tmp_path: Path) -> None:
    trial = tried(FINE, tmp_path)
    assert trial.problems == []
    assert (trial.ran, trial.marked) == (5, 1)


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        ("place[1] == 25.0", "place[1] == 26.0", "page.md:9: AssertionError"),
        ("place[1] == 25.0", "plaice", "page.md:9: NameError: name 'plaice' is not defined"),
        ("show no-such-board\nchladni: BOARD", "show no-such-board\nchladni: BOAT", "expected"),
        ("chladni: BOARD: expected a board file that is there, or one of: ... got "
         "'no-such-board'\n", "", "ended with 2"),
        ("board parts strip5 --json\n...", "board parts strip5 --json\n{}", "expected\n    {}"),
        ("$ chladni board parts", "chladni board parts", "expected '$ ' and a command"),
        ("$ chladni board parts", "$ make venv parts", "make is not run here"),
        ("thickness_mm = 0.3\n```\n\n<", "thickness = 0.3\n```\n\n<", "plate.thickness"),
        ("thickness_mm = 0.3\n```\n\n<", "thickness_mm = \n```\n\n<", "no TOML"),
        ("thickness_mm = { from = 0.1, to = 0.4 }", "thickness_mm = { from = 1, at = 2 }",
         "plate.thickness_mm"),
        ("```text\na layout", "```\na layout", "a block without a language"),
        ("```text\na layout", "```text\n$ chladni sweep", "a command in a block that only shows"),
        ("```text\na layout", "```cpp\nint a;", "cpp is not tried"),
        ("<!-- not run: needs a chip; tests/device and `make dist` stand in -->\n", "",
         "pio is not run here"),
        ("tests/device and", "tests/advice and", "tests/advice is said to stand in"),
        ("`make dist` stand", "`make dust` stand", "make dust is said to stand in"),
        ("not run:", "not run (pio test):", "no command begins with pio test"),
        ("needs a chip; tests", "tests", "expected 'not run (COMMANDS): WHY; WHAT stands in'"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_block_is_reported(
    right: str, wrong: str, told: str, tmp_path: Path
) -> None:
    text = FINE.replace(right, wrong, 1)
    assert text != FINE
    problems = tried(text, tmp_path).problems
    assert problems
    assert any(told in problem for problem in problems), problems


def test_an_indented_block_is_reported(tmp_path: Path) -> None:
    trial = tried("# A page\n\n    chladni board show prototype\n", tmp_path)
    assert [problem.partition(", ")[0] for problem in trial.problems] == [
        "page.md:3: a block without a language: python"
    ]


def test_a_port_is_that_of_an_emulated_device(tmp_path: Path) -> None:
    text = """# A page

<!-- an emulated device stands in for /dev/ttyUSB0 -->
```console
$ chladni device info --port /dev/ttyUSB0
...
playing prevented by no table
...
```
"""
    assert tried(text, tmp_path).problems == []
    (problem,) = tried(text.replace("no table", "all is well"), tmp_path).problems
    assert "expected\n    playing prevented by all is well" in problem


def test_broken_references_are_reported(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    (tmp_path / "other.md").write_text("# Other\n\n## A place\n\n## A place\n", "utf-8")
    (tmp_path / "p.png").write_bytes(b"")
    good = (
        "[a](other.md), [a](other.md#a-place), [a](other.md#a-place-1), [a](#here)\n\n"
        "[a](https://example.org/x#y) ![a](p.png)\n\n## Here\n"
    )
    page.write_text(good, "utf-8")
    assert list(broken(read_page(page), tmp_path)) == []
    bad = (
        "[a](another.md)\n[a](other.md#no-place) [a](other.md#a-place-2)\n[a](#there)\n"
        "![a](q.png)\n[a](http://example.org)\n\n[a](../x)\n\n<img src='r.png'>\n"
    )
    page.write_text(bad, "utf-8")
    assert list(broken(read_page(page), tmp_path)) == [
        "page.md:1: no such file: another.md",
        "page.md:2: no such anchor: other.md#no-place",
        "page.md:2: no such anchor: other.md#a-place-2",
        "page.md:3: no such anchor: #there",
        "page.md:4: no such picture: q.png",
        "page.md:5: expected https, got http://example.org",
        "page.md:7: no such file: ../x",
        "page.md:9: no such picture: r.png",
    ]


def test_anchors_are_github_s() -> None:
    taken: dict[str, int] = {}
    names = ["Parts of `prototype`", "What was, and was not, run", "µm – and Δ!", "A", "A", "A b_c"]
    plain = [name.replace("`", "") for name in names]
    assert [slug(name, taken) for name in plain] == [
        "parts-of-prototype",
        "what-was-and-was-not-run",
        "µm--and-δ",
        "a",
        "a-1",
        "a-b_c",
    ]


@pytest.mark.parametrize(
    ("expected", "output", "is_same"),
    [
        ("ssim 0.88", "│ ssim   │ 0.8884 │", True),  # 2 %
        ("ssim 0.8", "ssim 0.88", True),  # one of the last digit shown
        ("ssim 0.80", "ssim 0.83", False),
        ("ssim 0.888", "ssim -0.888", False),
        ("steps 100", "steps 102", True),
        ("steps 100", "steps 103", False),
        ("regions 1,024", "regions 1024", True),
        ("at 10, 25 mm", "at 10, 26 mm", True),
        ("at 10, 25 mm", "at 10, 27 mm", False),
        ("seconds 3", "seconds 17.2", True),
        ("in 3 s", "in 4.2 s", True),
        ("in 3 s", "in 4.2 mm", False),
        ("/dev/pts/1", "/dev/pts/7", True),
        ("wrote ... bytes", "wrote t.chl, 12 bytes", True),
        ("a\nc", "a\nb\nc", False),
        ("a\n...\nc", "a\nb\nb\nc", True),
        ("a", "a\nb", False),
        ("a\n...", "a\nb", True),
        ("a\nb", "a", False),
        ("fingerprint 0x12", "fingerprint 0x13", False),
        ("x1 y", "x2 y", False),
        ("", "anything", True),
    ],
)
def test_what_matters_of_an_output(expected: str, output: str, is_same: bool) -> None:
    assert (difference(tuple(expected.splitlines()), output) == "") == is_same


def test_a_block_is_its_commands_and_their_outputs() -> None:
    first, second = steps("$ one --a\n1\n2\n$ two\n")
    assert (first.command, first.expected) == ("one --a", ("1", "2"))
    assert (second.line, second.command, second.expected) == (3, "two", ())
