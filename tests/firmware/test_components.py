"""The chip's build files, run as ESP-IDF runs them: no chip build can be configured here."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chladni.sim.board.gpio import CHIPS
from conftest import ROOT

HERE = Path(__file__).parent
FIRMWARE = ROOT / "firmware" / "esp32"
COMPONENTS = {
    FIRMWARE / "components" / "chladni_core": FIRMWARE / "core",
    FIRMWARE / "chip": FIRMWARE / "chip",
    ROOT / "bootloader_components" / "gates": ROOT / "bootloader_components" / "gates",
}
"""Folder of a component: the folder whose sources it must name, each of them."""
OF_IDF = {"core", "hal", "soc", "main", "driver", "esp_wifi", "net80211", "phy", "pp", "mesh"}
"""Components and libraries that come with ESP-IDF: another lib<name>.a would clash."""


def cmake() -> str:
    found = shutil.which("cmake", path=str(Path(sys.executable).parent)) or shutil.which("cmake")
    assert found is not None
    return found


def in_script_mode(component_file: Path, target: str = "esp32") -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [
            cmake(),
            f"-DCOMPONENT_FILE={component_file}",
            f"-DIDF_TARGET={target}",
            "-P",
            str(HERE / "component_model.cmake"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("target", CHIPS)
@pytest.mark.parametrize("component", COMPONENTS, ids=lambda folder: folder.name)
def test_a_component_registers_in_script_mode_and_names_every_source(
    component: Path, target: str
) -> None:
    """But those of another chip: a folder of a chip's name, and an ESP32's gates at start."""
    run = in_script_mode(component / "CMakeLists.txt", target)
    assert run.returncode == 0, run.stderr
    lines = [line.removeprefix("-- ") for line in run.stdout.splitlines()]
    named = {Path(line.removeprefix("source ")) for line in lines if line.startswith("source ")}
    folder = COMPONENTS[component]
    there = {path for ending in ("*.cpp", "*.c") for path in folder.rglob(ending)}
    others = {path for chip in CHIPS if chip != target for path in (folder / chip).rglob("*.cpp")}
    if folder.name == "gates" and target != "esp32":
        others = there
    assert named == there - others
    assert component.name not in OF_IDF


@pytest.mark.parametrize("target", CHIPS)
@pytest.mark.parametrize("component", COMPONENTS, ids=lambda folder: folder.name)
def test_what_stands_after_the_registration_is_right_too(
    component: Path, target: str, tmp_path: Path
) -> None:
    run = subprocess.run(
        [
            cmake(),
            "-S",
            str(HERE / "component_project"),
            "-B",
            str(tmp_path),
            f"-DCOMPONENT_FILE={component / 'CMakeLists.txt'}",
            f"-DIDF_TARGET={target}",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr


def test_required_components_of_ours_are_there() -> None:
    run = in_script_mode(FIRMWARE / "chip" / "CMakeLists.txt")
    (required,) = [line for line in run.stdout.splitlines() if line.startswith("-- requires")]
    assert "chladni_core" in required.replace(";", " ").split()
    assert (FIRMWARE / "components" / "chladni_core").is_dir()


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ('file(GLOB S CONFIGURE_DEPENDS "*.cpp")\nidf_component_register(SRCS a.cpp)',
         "CONFIGURE_DEPENDS"),
        ("idf_component_register(SRCS missing.cpp)", "missing.cpp, which is not there"),
        ("target_compile_options(x PRIVATE -Wall)\nidf_component_register(SRCS a.cpp)",
         "not scriptable"),
        ("idf_component_register(SOURCES a.cpp)", "unknown arguments"),
        ("set(x 1)", "registers nothing"),
    ],
)  # fmt: skip
def test_the_model_refuses_what_esp_idf_refuses(tmp_path: Path, text: str, complaint: str) -> None:
    """Among them the file that could not be configured: a glob that watches for changes."""
    (tmp_path / "a.cpp").write_text("", encoding="utf-8")
    file = tmp_path / "CMakeLists.txt"
    file.write_text(text, encoding="utf-8")
    run = in_script_mode(file)
    assert run.returncode != 0
    assert complaint in " ".join(run.stderr.split())
