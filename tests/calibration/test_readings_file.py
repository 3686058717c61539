"""What coils read, kept in a file."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from calibration.reading_arithmetic import read_hidden
from calibration.small_board import small_board
from chladni.calibration import hidden_plate
from chladni.calibration.readings_file import load_readings, readings_file
from chladni.sim.errors import InputError


def test_readings_are_kept_in_a_file(tmp_path: Path) -> None:
    board = small_board()
    readings = read_hidden(hidden_plate(board, 1))
    path = tmp_path / "r.json"
    path.write_bytes(readings_file(readings, board))
    again = load_readings(path, board)
    assert again.volts == pytest.approx(readings.volts)
    assert again.high.volts == pytest.approx(readings.high.volts)
    assert again.noise == pytest.approx(readings.noise)
    thick = dataclasses.replace(board, plate=dataclasses.replace(board.plate, thickness=0.5e-3))
    with pytest.raises(InputError, match="those of small, as it is drawn now"):
        load_readings(path, thick)
    for text, said in (
        ("{", "JSON"),
        ("[]", "its kind"),
        ("[" * 100_000, "JSON"),
        ('{"a": ' + "1" * 5000 + "}", "JSON"),
        (path.read_text().replace('"noise": [', '"noise": [[[-1]], '), "numbers of 6 coils|writes"),
        (re.sub(r'"seconds": [^,]*', '"seconds": NaN', path.read_text()), "numbers of 6 coils"),
        (path.read_text().replace('"noise"', '"nose"'), "calibrate. writes"),
        (path.read_text().replace("[", "[[", 1).replace("]", "]]", 1), "numbers of 6 coils"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=said):
            load_readings(path, board)
