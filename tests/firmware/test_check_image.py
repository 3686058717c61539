"""What a linked image is asked: on small images that are linked here, for want of the chip's own.

The compiler is another Xtensa's, without windows and floating-point unit; the layouts are those of
both chips.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from check_image import MEMORIES, complaints, functions

from conftest import ROOT

PREFIX = "xtensa-lx106-elf-"
SOURCE = """
#define IRAM __attribute__((noinline, section(".iram0.text")))
#define FLASH __attribute__((noinline, section(".flash.text")))
#define DRAM __attribute__((section(".dram0.data")))
#define RODATA __attribute__((section(".flash.rodata")))
volatile unsigned sink DRAM = 1;
namespace another {{
extern unsigned kSineQuarter[2];
unsigned kSineQuarter[2] RODATA = {{3, 4}};
}}
extern unsigned kSineQuarter[2];
unsigned kSineQuarter[2] {table} = {{1, 2}};
{helper} void helper() {{ sink = sink + kSineQuarter[sink & 1U] * {used}; }}
IRAM void on_alarm() {{ helper(); sink = 5; }}
static IRAM __attribute__((used)) void {set_duties}() {{ sink = 6; }}
extern unsigned other[2];
unsigned other[2] RODATA = {{5, 6}};
namespace chladni::chip {{
IRAM void pwm_set_duties() {{ {set_duties}(); sink = 7 + {read}; }}
IRAM void cut_outputs() {{ sink = 8; }}
}}
IRAM void start_together() {{ sink = 9; }}
extern "C" FLASH void report() {{ sink = 12; }}
extern "C" IRAM void esp_panic_handler() {{ report(); sink = 10; }}
extern "C" IRAM void __wrap_esp_panic_handler() {{
  chladni::chip::cut_outputs(); {panic} sink = 11;
}}
unsigned bulk[{bulk}] __attribute__((section(".dram0.bulk")));
extern "C" FLASH void start() {{
  on_alarm(); chladni::chip::pwm_set_duties(); chladni::chip::cut_outputs(); start_together();
  __wrap_esp_panic_handler();
  sink = bulk[sink] + another::kSineQuarter[sink & 1U];
}}
"""
GOOD = {
    "used": "1",
    "table": "DRAM",
    "helper": "IRAM",
    "bulk": "16",
    "read": "0",
    "set_duties": "set_duties",
    "panic": "esp_panic_handler();",
}
LAYOUTS = {
    "esp32": {".iram0.text": 0x40080400, ".flash.text": 0x400D0020, ".dram0.data": 0x3FFB0000,
              ".flash.rodata": 0x3F400020, ".dram0.bulk": 0x3FFB4000},
    "far": {".iram0.text": 0x40080400, ".flash.text": 0x40140020, ".dram0.data": 0x3FFB0000,
            ".flash.rodata": 0x3F400020, ".dram0.bulk": 0x3FFB4000},
    "esp32s3": {".iram0.text": 0x40374400, ".flash.text": 0x42010020, ".dram0.data": 0x3FC90000,
                ".flash.rodata": 0x3C010020, ".dram0.bulk": 0x3FC94000},
}  # fmt: skip
"""Of each chip, and of an ESP32 whose code in flash is out of a call's reach."""


def image(folder: Path, layout: str = "esp32", **changes: str) -> Path:
    """Linked where a chip has its memories."""
    source, made = folder / "a.cpp", folder / "a.elf"
    source.write_text(SOURCE.format(**(GOOD | changes)), "utf-8")
    starts = LAYOUTS[layout]
    subprocess.run(
        [
            f"{PREFIX}g++",
            "-std=c++17",
            "-O1",
            "-nostdlib",
            "-mlongcalls",
            "-mtext-section-literals",
            "-Wl,--entry=start",
            *(f"-Wl,--section-start={name}={at:#x}" for name, at in starts.items()),
            source,
            "-o",
            made,
        ],
        check=True,
        capture_output=True,
    )
    return made


def checked(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(ROOT / "tools" / "check_image.py"), str(path), *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.usefixtures("cross_compilers")
@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, "nothing wrong"),
        ({"helper": "FLASH"}, "helper: at 0x4"),
        ({"table": "RODATA"}, "which is not DRAM"),
        ({"read": "other[sink & 1U]"}, "pwm_set_duties: the address 0x3"),
        ({"set_duties": "reset_duties"}, "set_duties: not in the image"),
        ({"bulk": "100000"}, "DRAM: 400,"),
        ({"used": "0"}, "kSineQuarter: the interrupt has no address of it"),
    ],
)
def test_an_image_is_told_what_lies_where_it_must_not(
    tmp_path: Path, changes: dict[str, str], told: str, layout: str
) -> None:
    chip = "esp32s3" if layout == "esp32s3" else "esp32"
    run = checked(image(tmp_path, layout, **changes), "--tools", PREFIX, "--chip", chip)
    assert told in run.stdout, run.stdout + run.stderr
    assert run.returncode == (1 if changes else 0)


@pytest.mark.usefixtures("cross_compilers")
def test_an_image_of_something_else_lacks_the_interrupt(tmp_path: Path) -> None:
    made = image(tmp_path)
    subprocess.run(
        [f"{PREFIX}objcopy", "--redefine-sym", "_Z8on_alarmv=_Z5alarmv", made], check=True
    )
    assert "on_alarm: not in the image" in checked(made, "--tools", PREFIX).stdout


LOST = """
.section .iram0.text, "ax"
.global on_alarm
on_alarm: j 1f
.byte 0
1: call0 helper
ret
.section .flash.text, "ax"
helper: ret
"""


@pytest.mark.usefixtures("cross_compilers")
def test_calls_behind_padding_are_seen(tmp_path: Path) -> None:
    """A linker that drops sections drops what tells padding from code."""
    source, made = tmp_path / "a.S", tmp_path / "a.elf"
    source.write_text(LOST, "utf-8")
    subprocess.run(
        [
            f"{PREFIX}gcc",
            "-nostdlib",
            "-mtext-section-literals",
            "-Wl,--entry=on_alarm",
            "-Wl,--section-start=.iram0.text=0x40080400",
            "-Wl,--section-start=.flash.text=0x400d0020",
            source,
            "-o",
            made,
        ],
        check=True,
        capture_output=True,
    )
    subprocess.run([f"{PREFIX}objcopy", "--remove-section=.xt.*", made], check=True)
    assert "helper: at 0x400d0020, which is not IRAM" in checked(made, "--tools", PREFIX).stdout


def test_floating_point_on_the_path_is_seen() -> None:
    """By its instructions, as the chip's own disassembler writes them."""
    text = "\n".join(
        f"40080{k}00 <{name}>:\n40080{k}03:\t0a1234 \tadd.s\tf0, f1, f2\n40080{k}06:\t1df0 \tretw.n"
        for k, name in enumerate(("on_alarm", "other"))
    )
    said = complaints(functions(text), [], MEMORIES["esp32"], {})
    assert "on_alarm: add.s, of the floating-point unit" in said
    assert not any(line.startswith("other") for line in said)


def test_what_cannot_be_looked_into_is_named(tmp_path: Path) -> None:
    missing = checked(tmp_path / "no.elf", "--tools", "no-such-")
    assert (missing.returncode, missing.stderr) == (
        2,
        "check_image: no-such-objdump: not on the PATH\n",
    )
    path = tmp_path / "a.elf"
    path.write_bytes(b"text")
    broken = checked(path, "--tools", "")
    assert broken.returncode == 2
    assert "a.elf" in broken.stderr
    assert "Traceback" not in broken.stderr
