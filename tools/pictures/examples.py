"""Run the examples and put their figures, and their texts, where docs/examples.md shows them.

    python tools/pictures/examples.py

The device is emulated, on a port of this machine.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs" / "images"
PAGE = ROOT / "docs" / "examples.md"
ALONE = ("field", "table", "swipe", "design")


def run(name: str, *arguments: str | Path) -> None:
    """One example, its figure into the pages' images."""
    subprocess.run([sys.executable, ROOT / "examples" / f"{name}.py", *arguments], check=True)


def main() -> None:
    """Draw all figures; take over the examples as they are."""
    out = ROOT / "out"
    for name in ALONE:
        run(name, out)
    command = [sys.executable, "-m", "chladni.host.cli.app", "emulate", str(out / "strip5.chl")]
    device = subprocess.Popen([*command, "--serial"], stdout=subprocess.PIPE, text=True)
    assert device.stdout is not None
    try:
        run("device", device.stdout.readline().strip(), out)
    finally:
        device.terminate()
        device.wait()
    for name in (*ALONE, "device"):
        (IMAGES / f"example-{name}.png").write_bytes((out / f"example-{name}.png").read_bytes())
        text = (ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8")
        page = PAGE.read_text(encoding="utf-8")
        before, after = page.split(f"`examples/{name}.py`")
        head, _, rest = after.partition("```python\n")
        shown = f"{before}`examples/{name}.py`{head}```python\n{text}```{rest.partition('```')[2]}"
        PAGE.write_text(shown, encoding="utf-8")


if __name__ == "__main__":
    main()
