"""Run a netlist of this folder with other parameters, and read what it measures."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

FOLDER = Path(__file__).parent
MEASURED = re.compile(r"^(\w+_[av])\s*=\s*(\S+)", re.MULTILINE)


def simulate(netlist: str, folder: Path, **parameters: float) -> dict[str, float]:
    """Currents (A) and voltages (V) by the names of a netlist's `.meas` lines.

    Parameters
    ----------
    netlist
        Its name in this folder. It runs by itself too: `ngspice -b switch.cir`.
    folder
        Where the changed netlist goes.
    parameters
        In place of its `.param` lines.
    """
    text = (FOLDER / f"{netlist}.cir").read_text("utf-8")
    for name, value in parameters.items():
        text, count = re.subn(
            rf"^\.param {name}=.*$", f".param {name}={value:.9g}", text, flags=re.MULTILINE
        )
        assert count == 1, f"{netlist}.cir has no .param {name}"
    for name in re.findall(r"^\.include (.*)$", text, re.MULTILINE):
        (folder / name).write_text((FOLDER / name).read_text("utf-8"), "utf-8")
    path = folder / f"{netlist}.cir"
    path.write_text(text, "utf-8")
    run = subprocess.run(["ngspice", "-b", str(path)], capture_output=True, text=True, check=False)
    found = {name: float(value) for name, value in MEASURED.findall(run.stdout)}
    assert found, run.stdout + run.stderr
    # ngspice counts a source's current into its positive end.
    return {name: -value if name == "supply_a" else value for name, value in found.items()}
