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
from numpy.typing import NDArray

from chladni.drives.fingers.silence import disc_weights, ring_offsets
from chladni.host.studio.boards.board_message import board_message, fields_bytes
from chladni.host.studio.boards.prepared import ReadyBoard
from chladni.host.studio.messages.sender import in_json
from chladni.host.studio.playing.press_score import WORDS, levels_of_feeling
from chladni.sim.board.quantity import MM
from chladni.sim.coil.full_drive import full_drive
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import pack
from chladni.tables.layout import FULL_SCALE
from chladni.tables.responses import TableResponses
from chladni.tables.table import dequantise

FloatArray = NDArray[np.float64]

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
    x_mm, y_mm = places_mm(ready)
    across, along = (axis.ravel() for axis in np.meshgrid(x_mm, y_mm))
    integers, full_scale_gain = _drives(ready, np.stack((across, along), axis=1) * MM)
    newtons = np.zeros(len(integers))
    for k, drive in enumerate(dequantise(integers, full_scale_gain)):
        full = full_drive(ready.board, drive, ready.frequency_hz)
        newtons[k] = full.newtons / np.abs(drive).max() if full else np.nan
    return {
        "board": board_message(ready, FROM_TABLE) | {"most_fingers": 1},
        "fields": _base64(fields_bytes(ready)),
        "places": {"x_mm": x_mm, "y_mm": y_mm},
        "words": WORDS,
        "levels": levels_of_feeling(ready.frequency_hz),
        "full_scale_gain": full_scale_gain,
        "drives": _base64(integers.astype("<i2").tobytes()),
        "newtons": _base64(newtons.astype("<f4").tobytes()),
    }


def _drives(ready: ReadyBoard, places: FloatArray) -> tuple[NDArray[np.int16], float]:
    """What one finger at each place (k, 2), m, plays, and the gain that full scale stands for.

    Without drives in the table it is the loudest: the conjugate of what coils do under the finger.
    """
    table = ready.table
    if table.sections:
        x_um, y_um = np.rint(places / MM * 1e3).astype(np.int64).T
        section, reader = table.sections[0], FirmwareReader(pack(table), table.actuators)
        return reader.integers(section.frequency_hz, x_um, y_um), section.full_scale_gain
    points = places[:, None] + ring_offsets()
    known = TableResponses.of(table).at(points.reshape(-1, 2))
    means = np.einsum("p,kpa->ka", disc_weights(), known.reshape(*points.shape[:2], -1))
    loudest = means.conj() / np.abs(means).max(axis=1, keepdims=True).clip(1e-300)
    parts = np.stack((loudest.real, loudest.imag), axis=2)
    return np.rint(parts * FULL_SCALE).astype(np.int16), 1.0


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
