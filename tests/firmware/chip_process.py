"""The chip's layer on a fake of ESP-IDF, as a process that a test talks to."""

from __future__ import annotations

import gzip
import json
import os
import struct
import subprocess
import zlib
from collections.abc import Sequence
from pathlib import Path

from chladni.sim.board.electronics import ChipName
from chladni.sim.board.gpio import CHIPS
from conftest import ROOT

HERE = Path(__file__).parent
FIRMWARE = ROOT / "firmware" / "esp32"
HEADERS = (
    "driver/gpio.h", "driver/gptimer.h", "driver/i2c_master.h", "driver/ledc.h", "driver/uart.h",
    "driver/usb_serial_jtag.h",
    "esp_adc/adc_continuous.h",
    "esp_attr.h", "esp_brownout.h", "esp_cpu.h", "esp_err.h", "esp_event.h", "esp_intr_alloc.h",
    "esp_netif.h",
    "esp_partition.h", "esp_private/panic_internal.h", "esp_random.h", "esp_system.h",
    "esp_task_wdt.h", "esp_timer.h", "esp_wifi.h", "freertos/FreeRTOS.h", "freertos/task.h",
    "hal/timer_ll.h", "lwip/sockets.h", "mbedtls/md.h", "sdkconfig.h", "soc/gpio_reg.h",
    "soc/gpio_sig_map.h", "soc/ledc_reg.h", "soc/ledc_struct.h", "soc/soc.h", "soc/timer_periph.h",
)  # fmt: skip
"""Of ESP-IDF, that chip/ includes: each becomes the fake's one header."""


def includes(folder: Path, chip: ChipName = "esp32") -> list[str]:
    """Options: the chip, and where the fake is found as ESP-IDF's headers, made in a folder."""
    for name in HEADERS:
        path = folder / "include" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text('#pragma once\n#include "idf.hpp"\n', encoding="utf-8")
    own = FIRMWARE / "chip"
    folders = (folder / "include", HERE / "idf", FIRMWARE, own, own / chip)
    return [f"-DFAKE_{chip.upper()}=1", *(f"-I{path}" for path in folders)]


def chip_sources(chip: ChipName = "esp32") -> list[Path]:
    """Of chip/, without those of another chip."""
    own = FIRMWARE / "chip"
    others = [own / name for name in CHIPS if name != chip]
    return [path for path in sorted(own.rglob("*.cpp")) if path.parent not in others]


def build(folder: Path, core: Sequence[Path], chip_name: ChipName = "esp32") -> Path:
    """Compile chip/ on the fake, with counts of lines and branches, and link it to a core.

    `core` has objects, which are the same on every chip.
    """
    include = includes(folder, chip_name)
    objects = [
        *_compile(chip_sources(chip_name), folder, [*include, "--coverage"]),
        *_compile(sorted((HERE / "idf").glob("*.cpp")), folder, include),
        *core,
    ]
    program = folder / chip_name
    subprocess.run(["g++", "--coverage", "-o", program, *objects], check=True)
    return program


def _compile(sources: Sequence[Path], folder: Path, options: Sequence[str]) -> list[Path]:
    """Compile on all cores; the objects."""
    objects = [
        folder / f"{k}_{source.parent.name}_{source.stem}.o" for k, source in enumerate(sources)
    ]
    running: list[subprocess.Popen[bytes]] = []
    for source, made in zip(sources, objects, strict=True):
        command = ["g++", "-std=c++17", "-O0", "-c", str(source), "-o", str(made), *options]
        running.append(subprocess.Popen(command))
        while len([one for one in running if one.poll() is None]) >= (os.cpu_count() or 2):
            running[0].wait()
            running = [one for one in running if one.poll() is None or one.returncode != 0]
            assert not [one for one in running if one.poll() is not None]
    for one in running:
        assert one.wait() == 0
    return objects


def branches(program: Path) -> tuple[int, int, list[str]]:
    """(taken, all, not taken) branches of chip/, by gcov."""
    folder = program.parent
    notes = sorted(folder.glob("*.gcda"))
    subprocess.run(
        ["gcov", "-b", "-c", "-j", *map(str, notes)], cwd=folder, check=True, capture_output=True
    )
    taken = total = 0
    missed: list[str] = []
    for report in folder.glob("*.gcov.json.gz"):
        for file in json.loads(gzip.decompress(report.read_bytes()))["files"]:
            if str(FIRMWARE / "chip") not in file["file"]:
                continue
            for line in file["lines"]:
                for branch in line["branches"]:
                    if branch["throw"]:
                        continue
                    total += 1
                    taken += branch["count"] > 0
                    if branch["count"] == 0:
                        missed.append(f"{Path(file['file']).name}:{line['line_number']}")
    return taken, total, missed


PINS = 1 + max(max(chip.inputs) for chip in CHIPS.values())
RESET_PIN = 13
"""Of the panel, whose line is high while the panel runs: no gate."""


def retained_bytes(rise_k: float = 0.0, crashes: int = 0) -> bytes:
    """What RTC memory holds of coils so warm, after so many crashes (core/storage/retained.cpp)."""
    words = [0x52484C43, *[round(rise_k * 1e6)] * PINS, 0, 0, 0, 0xFFFFFFFF]
    held = struct.pack(f"<{len(words)}I", *words)
    count = struct.pack("<II", 0x52434C43, crashes)
    return b"".join(own + struct.pack("<I", zlib.crc32(own)) for own in (held, count))


class Chip:
    """A chip with these partitions, of which one call fails."""

    def __init__(
        self, program: Path, *, fail: str = "", options: tuple[str, ...] = (), **partitions: bytes
    ) -> None:
        if not any(option.startswith("retained=") for option in options):
            options = (f"retained={retained_bytes().hex()}", *options)
        arguments = [f"{name}:{data.hex()}" for name, data in partitions.items()] + [*options]
        if fail:
            arguments.append(f"fail={fail}")
        self.process = subprocess.Popen(
            [str(program), *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.us = 0
        self.on: set[int] = set()
        self.ended = ""
        self._sent = b""

    def ask(self, line: str) -> str:
        """One line to it, one back."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def tell(self, line: str) -> None:
        """One line to it that it answers with nothing."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def run(self, turns: int) -> None:
        """So many turns of the main loop; what was on is in `on`."""
        answer = self.ask(f"run {turns}")
        if not answer.startswith("="):
            self.ended = answer
            return
        sent, pins, us = answer.split()
        self._sent += bytes.fromhex(sent[1:])
        self.on = gates_of(pins)
        self.us = int(us)

    def down(self, way: str) -> set[int]:
        """Go down that way; gates that are on after it."""
        return gates_of(self.ask(way))

    @property
    def calls(self) -> dict[str, int]:
        """How often each call was made."""
        words = self.ask("calls").split()
        return dict(zip(words[::2], map(int, words[1::2]), strict=True))

    def close(self) -> None:
        """The end of its input."""
        assert self.process.stdin is not None
        if not self.process.stdin.closed:
            self.process.stdin.close()
        self.process.wait(timeout=20)

    # A wire to it.

    baud = 115_200.0

    def write(self, data: bytes) -> None:
        """Send bytes."""
        self.tell(f"rx {data.hex()}")

    def read(self, timeout_s: float) -> bytes:
        """What has come; the chip runs on until there is something."""
        end = self.now_s() + timeout_s
        while not self._sent and self.now_s() < end and not self.ended:
            self.run(1)
        data, self._sent = self._sent, b""
        return data

    def now_s(self) -> float:
        """Seconds since power-on."""
        return self.us / 1e6


def gates_of(text: str) -> set[int]:
    """Pins of a list with commas, less the panel's."""
    return {int(pin) for pin in text.split(",") if pin and pin != "-"} - {RESET_PIN}
