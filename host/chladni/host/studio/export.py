"""The page as one file: fields and drives of a board inlined, for any web host, or for none.

Browsers load no modules from files, so the page's modules become one classic script. Without a
server there is no firmware to play a touch: drives are those that the firmware's own reader gives
for places a millimetre apart.
"""

from __future__ import annotations

import base64
import re
from pathlib import Path, PurePosixPath
from posixpath import normpath
from typing import Any

import numpy as np

from chladni.host.studio.boards.board_message import board_message, fields_bytes
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.messages.sender import in_json
from chladni.host.studio.playing.press_score import WORDS, levels_of_feeling
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack
from chladni.tables.table import dequantise

PAGE = Path(__file__).parent / "page"
ENTRY = "offline"
SPACING_MM = 1.0
"""Between places, where that is no more of them than `MOST_PLACES`."""
MOST_PLACES = 20_000
FROM_TABLE = "Drives are as the firmware reads them from the board's table."
IMPORT = re.compile(r'^import \{([^}]*)\} from "(\.{1,2}/[\w/]+)\.js";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:const|class|function|async function) (\w+))", re.MULTILINE)
STYLE = '<link rel="stylesheet" href="style.css">'
SCRIPT = '<script type="module" src="app.js"></script>'
POLICY = (
    '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
    "script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">"
)
"""Whatever a board's name says, nothing is loaded from anywhere."""


def one_file(ready: ReadyBoard, data: dict[str, Any] | None = None) -> str:
    """The page with a board's fields and drives, as HTML that needs nothing else.

    `data` is `file_data`'s, where that is known already.
    """
    html = (PAGE / "index.html").read_text(encoding="utf-8")
    style = (PAGE / "style.css").read_text(encoding="utf-8")
    html = html.replace(STYLE, f"{POLICY}\n<style>\n{style}</style>").replace(SCRIPT + "\n", "")
    # A name in the data cannot end the element that holds it.
    text = in_json(data or file_data(ready)).replace("<", "\\u003c")
    scripts = (
        f'<script type="application/json" id="data">{text}</script>\n'
        f"<script>\n{bundle(ENTRY)}</script>\n</body>"
    )
    return html.replace("</body>", scripts)


def file_data(ready: ReadyBoard) -> dict[str, Any]:
    """What the page of a file knows: the board, its fields, and a drive for each of many places.

    `drives` are int16 (places, actuators, 2), in units of `full_scale_gain` / 32767, and
    `newtons` float32 (places,), what a gain of one is worth; places go along x first.
    """
    table, section = ready.table, ready.table.sections[0]
    x_mm, y_mm = places_mm(ready)
    across, along = np.meshgrid(x_mm, y_mm)
    x_um, y_um = (np.rint(axis.ravel() * 1e3).astype(np.int64) for axis in (across, along))
    reader = FirmwareReader(pack(table), table.actuators)
    integers = reader.integers(section.frequency_hz, x_um, y_um)
    newtons = np.zeros(len(integers))
    for k, drive in enumerate(dequantise(integers, section.full_scale_gain)):
        full = full_drive(ready.board, drive, section.frequency_hz)
        newtons[k] = full.newtons / np.abs(drive).max() if full else np.nan
    return {
        "board": board_message(ready, FROM_TABLE) | {"most_fingers": 1},
        "fields": _base64(fields_bytes(ready)),
        "places": {"x_mm": x_mm, "y_mm": y_mm},
        "words": WORDS,
        "levels": levels_of_feeling(section.frequency_hz),
        "full_scale_gain": section.full_scale_gain,
        "drives": _base64(integers.astype("<i2").tobytes()),
        "newtons": _base64(newtons.astype("<f4").tobytes()),
    }


def places_mm(ready: ReadyBoard) -> tuple[list[float], list[float]]:
    """The places' coordinates along x and y, to a micrometre, from edge to edge."""
    sides = [side / MM for side in ready.board.plate.size]
    spacing = max(SPACING_MM, float(np.sqrt(sides[0] * sides[1] / MOST_PLACES)))
    x, y = (
        np.round(np.linspace(-side / 2.0, side / 2.0, int(np.ceil(side / spacing)) + 1), 3)
        for side in sides
    )
    return x.tolist(), y.tolist()


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def bundle(entry: str) -> str:
    """A module and all that it imports as one classic script; each keeps a scope of its own."""
    parts: dict[str, str] = {}
    _collect(PurePosixPath(entry), parts)
    return '"use strict";\nconst modules = {};\n' + "".join(parts.values())


def _imported(module: PurePosixPath, used: str) -> PurePosixPath:
    return PurePosixPath(normpath(module.parent / used))


def _collect(module: PurePosixPath, parts: dict[str, str]) -> None:
    if str(module) in parts:
        return
    text = (PAGE / f"{module}.js").read_text(encoding="utf-8")
    for _, used in IMPORT.findall(text):
        _collect(_imported(module, used), parts)
    exported = ", ".join(EXPORT.findall(text))
    text = IMPORT.sub(
        lambda found: f'const {{{found[1]}}} = modules["{_imported(module, found[2])}"];\n', text
    )
    text = EXPORT.sub("", text)
    parts[str(module)] = (
        f'modules["{module}"] = (() => {{\n{text}return {{ {exported} }};\n}})();\n'
    )
