"""`chladni calibrate`: from a drawn board to one that was measured, on plates that no one sees."""

from __future__ import annotations

import dataclasses
import threading
import tomllib
from pathlib import Path

import numpy as np
import pytest

from calibration.small_board import small_board
from chladni.calibration import hidden_plate
from chladni.calibration.hidden import foot_name
from chladni.calibration.laboratory.measured_fields import joined
from chladni.calibration.laboratory.measured_files import fields_csv, read_measured
from chladni.calibration.parameters import Parameter
from chladni.calibration.restored import Restored, Truth
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.drives.scoring.spread import Spread
from chladni.host.cli.measured.calibrate import _for_people
from chladni.host.cli.measured.verdict import FEET_ALIKE, verdict
from chladni.host.cli.measured.ways import Calibrated
from chladni.host.device.device import Device
from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.sensed_plate import emulator_on
from chladni.host.emulation.shaken_plate import Sensor, ShakenPlate
from chladni.host.measuring.accelerometer import read_motions
from chladni.sim.board.file import load_board
from chladni.sim.board.fingers import Focus
from chladni.sim.board.parts import Isolation, Spring
from chladni.sim.board.writing import board_file, measured_file
from conftest import CommandLine

SEED = 4
"""Of a plate on which one coil is reversed."""
RATIOS = {"ratio": "value", "low": "low", "high": "high"}


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_bytes(board_file(small_board()))
    return path


def test_a_board_is_calibrated_and_its_file_is_one(
    chladni: CommandLine, drawn: Path, tmp_path: Path
) -> None:
    output, figure = tmp_path / "measured.toml", tmp_path / "c.png"
    done = chladni(
        *("calibrate", "--board", drawn, "--emulator", "--hidden", str(SEED), "-o", output),
        *("--sets", "20", "--figure", figure, "--json"),
    )
    assert (done.code, "no block [sensing]" in done.err) == (0, True), done.err
    found = done.json
    hidden = hidden_plate(small_board(), SEED)
    for own, strength in zip(found["coils"], hidden.strengths, strict=True):
        assert own["dead"] is False
        assert own["polarity"] == (-1 if strength < 0.0 else 1)
        assert own["force"] == pytest.approx(abs(strength), abs=0.1)
        assert own["true"] == strength
    best, after = (found[key]["fingers_2_db"]["median"] for key in ("plate_known", "after"))
    assert found["before"]["fingers_2_db"]["median"] < best - 6.0 < after < best + 1.0
    true = {own["name"]: own["true"] for own in found["parameters"]}
    assert true["sheet thickness"] == hidden.board.plate.thickness / small_board().plate.thickness
    assert all(own["low"] < own["true"] < own["high"] for own in found["parameters"])
    foam = next(own for own in found["parameters"] if own["name"] == "foam")
    assert foam["low"] < foam["value"] < foam["high"]
    before, after = (found[key]["fingers_2_db"] for key in ("before", "after"))
    assert {"median", "p10"} <= after.keys()
    assert after["median"] > before["median"] + 6.0
    assert found["after"]["second_finger_20mm_db"]["p10"] is not None
    assert abs(found["after"]["level_db"]["median"]) < 1.0
    assert "is reversed: swap its wires" in found["verdict"]
    assert found["device_seconds"] <= 10.0
    assert figure.stat().st_size > 10_000

    board = load_board(output)
    assert board.measured is not None
    assert "emulated, plate 4" in board.measured.by
    assert {own.name for own in board.measured.values} >= {"foam"}
    assert output.read_text(encoding="utf-8").startswith("# small as it was measured")
    shown = chladni("board", "show", output, "--json").json
    digits = {key: float(f"{foam[of]:.5g}") for key, of in RATIOS.items()}
    origin = {"by": board.measured.by, "date": board.measured.date}
    assert shown["measured"]["foam"] == digits | origin
    told = [shown[key]["fingers_2_db"] for key in ("measured_before", "measured_after")]
    assert told == [float(f"{own['median']:.5g}") for own in (before, after)]
    assert [board.measured.before, board.measured.after] == [Isolation(own) for own in told]
    assert shown["measured_by"] == f"{board.measured.by}, {board.measured.date}"
    again = chladni(
        "calibrate", "--board", output, "--emulator", "--hidden", "1", "-o", tmp_path / "x.toml"
    )
    assert again.code == 2
    assert "calibrate from the board as it is drawn" in again.err


@pytest.mark.parametrize("focus", [None, Focus()])
def test_people_read_the_truth_and_one_fingers_level_where_it_matters(focus: Focus | None) -> None:
    coil = {"name": "coil-1", "polarity": 1, "dead": False, "force": 1.1, "true": -1.08}
    scores = {"second_finger_20mm_db": {"median": 15.0}, "level_db": {"median": 1.0}}
    result = {"coils": [coil], "as_drawn": scores, "before": scores, "after": scores}
    result |= {"plate_known": scores}
    board = dataclasses.replace(small_board(), focus=focus)
    rows = _for_people(board, result, is_scored_on_itself=False)
    assert rows["coils"] == {"coil-1": "1.10 of the drawn force (true 1.08, reversed)"}
    assert ("second_finger_20mm_db" in rows["after"]) == (focus is not None)
    assert "second_finger_20mm_db" in result["after"]


def test_measured_values_have_five_digits_and_drawn_ones_all_of_theirs() -> None:
    board = small_board()
    drawn = dataclasses.replace(
        board, plate=dataclasses.replace(board.plate, poissons_ratio=0.312345678)
    )
    plate = dataclasses.replace(drawn.plate, thickness=0.98372618e-3)
    coils = tuple(dataclasses.replace(own, trim_db=-1.23456789) for own in drawn.actuators)
    measured = dataclasses.replace(drawn, plate=plate, actuators=coils)
    written = tomllib.loads(measured_file(drawn, measured).decode())
    assert written["plate"]["thickness_mm"] == 0.98373
    assert {own["trim_db"] for own in written["actuators"]} == {-1.2346}
    assert written["plate"]["poissons_ratio"] == 0.312345678


def test_a_plate_that_a_file_describes_is_found(
    chladni: CommandLine, drawn: Path, tmp_path: Path
) -> None:
    """Foam three times as stiff, one coil reversed, one of half its force, one dead.

    A coil is believed to have its force within a fifth, and under such foam its readings are small.
    """
    board = small_board()
    assert board.foundation is not None
    coils = list(board.actuators)
    coils[0] = dataclasses.replace(coils[0], polarity=-1)
    coils[1] = dataclasses.replace(coils[1], trim_db=6.0)
    coils[4] = dataclasses.replace(coils[4], is_dead=True)
    true = dataclasses.replace(
        board, actuators=tuple(coils), foundation=board.foundation.stiffer(3.0)
    )
    given = tmp_path / "true.toml"
    given.write_bytes(board_file(true))
    on_it = ("--emulator", "--hidden", given, "--sets", "2")
    done = chladni(
        "calibrate", "--board", drawn, *on_it, "-o", tmp_path / "measured.toml", "--json"
    )
    assert done.code == 0, done.err
    assert [own["polarity"] for own in done.json["coils"]] == [-1, 1, 1, 1, 1, 1]
    assert [own["dead"] for own in done.json["coils"]] == [False] * 4 + [True, False]
    assert done.json["coils"][1]["force"] == pytest.approx(0.5, abs=0.08)
    assert "force than drawn: look at its magnet and its gap" in done.json["verdict"]
    foam = next(own for own in done.json["parameters"] if own["name"] == "foam")
    assert foam["value"] == pytest.approx(3.0, rel=0.15)
    assert foam["true"] == pytest.approx(3.0)
    other = chladni("calibrate", "--board", "strip5", *on_it, "-o", tmp_path / "measured.toml")
    assert (other.code, "of the size and coils of strip5" in other.err) == (2, True)


def test_an_accelerometer_finds_it_too(chladni: CommandLine, drawn: Path, tmp_path: Path) -> None:
    """A place on each coil; all but one were read before, by another run."""
    board, kept = small_board(), tmp_path / "kept.csv"
    hidden = hidden_plate(board, SEED)
    emulator = emulator_on(board, hidden, listens=False)
    before, places = [], [own.at for own in board.actuators]
    standing = ShakenPlate(hidden, Sensor(1.5e-3), places)
    with Device(EmulatorWire(emulator)) as device:
        for number, own in enumerate(board.actuators[1:], 1):
            standing.stand(emulator, number)
            before.append(read_motions(device, board, own.at, 1.5e-3))
    kept.write_bytes(fields_csv(joined(before)))
    done = chladni(
        *("calibrate", "--board", drawn, "--emulator", "--hidden", str(SEED), "--sets", "8"),
        *("--accelerometer", "coils", "--sensor-g", "1.5", "--readings", kept),
        *("-o", tmp_path / "measured.toml", "--json"),
    )
    assert (done.code, done.err.count(f"is in {kept} already")) == (0, len(before)), done.err
    assert "Another one needs a file of its own" in " ".join(done.err.split())
    signs = [own["polarity"] for own in done.json["coils"]]
    assert signs == np.sign(hidden.strengths).tolist()
    assert done.json["by"] == f"an accelerometer, emulated, plate {SEED}"
    drawn_db, found_db = (done.json[key]["fingers_2_db"]["median"] for key in ("before", "after"))
    assert found_db > drawn_db + 6.0
    assert max(np.abs(list(done.json["after"]["level_db"].values()))) < 1.0
    fields = read_measured(kept, board, "acceleration", "current")
    at = np.array([own.at for own in board.actuators])
    assert np.unique(fields.places, axis=0) == pytest.approx(np.unique(at, axis=0), abs=1e-6)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("--accelerometer 8,5", "--sensor-g is required"),
        ("--accelerometer 8,5 --sensor-g 900", "--sensor-g"),
        ("--accelerometer 80,5 --sensor-g 1", "a place on the board"),
        ("--accelerometer 8,5 --sensor-g 1 --microphone", "does not go with another way"),
        ("--accelerometer 8,5 --sensor-g 1 --readings r.json", ".csv"),
        ("--sensor-g 1", "no --accelerometer"),
    ],
)
def test_what_an_accelerometer_lacks_is_said(
    chladni: CommandLine, drawn: Path, tmp_path: Path, given: str, said: str
) -> None:
    output = tmp_path / "measured.toml"
    emulated = ("calibrate", "--board", drawn, "--emulator", "--hidden", str(SEED), "-o", output)
    refused = chladni(*emulated, *given.split())
    assert refused.code == 2
    assert said in refused.err
    assert not output.exists()


@pytest.mark.parametrize("named", ["small.toml", "small", "other.toml"])
def test_the_drawn_board_is_not_written_over(
    chladni: CommandLine, drawn: Path, tmp_path: Path, named: str
) -> None:
    """By whatever name; the next calibration begins with it."""
    text = drawn.read_bytes()
    (tmp_path / "other.toml").symlink_to(drawn)
    emulated = ("--emulator", "--hidden", str(SEED), "--sets", "1")
    refused = chladni("calibrate", "--board", tmp_path / named, *emulated, "-o", drawn)
    assert (refused.code, "another file than --board's" in refused.err) == (2, True)
    assert drawn.read_bytes() == text


def test_bad_input_is_named_and_nothing_is_written(
    chladni: CommandLine, drawn: Path, tmp_path: Path
) -> None:
    output = tmp_path / "o.toml"
    here = ("-o", output, "--emulator", "--hidden", "1")
    no_coil = tmp_path / "plain.toml"
    text = drawn.read_text(encoding="utf-8")
    no_coil.write_text(
        text[: text.index("[coil]")] + text[text.index("[foundation]") :], encoding="utf-8"
    )
    for arguments, said in (
        (
            ("--board", drawn, "-o", output),
            "--emulator, --port, --udp, --recording, --measured and --readings is required",
        ),
        (("--board", drawn, "-o", output, "--emulator"), "--hidden is required"),
        (here, "--board is required"),
        (("--board", drawn, "-o", tmp_path / "o.txt", "--emulator", "--hidden", "1"), "-o"),
        (("--board", drawn, "-o", output, "--emulator", "--hidden", "-1"), "--hidden"),
        (("--board", "none", *here), "board"),
        (("--board", no_coil, *here), "[coil]"),
        (("--board", drawn, *here, "--port", "none"), "--emulator does not go with --port"),
        (("--board", drawn, "-o", output, "--udp", "127.0.0.1"), "--key is required"),
        (("--board", drawn, "-o", output, "--readings", tmp_path / "r.txt"), "--readings"),
        (
            ("--board", drawn, "-o", output, "--readings", no_coil.with_suffix(".json")),
            "plain.json",
        ),
        (
            ("--board", drawn, *here, "--microphone", "--readings", tmp_path / "r.json"),
            "--readings",
        ),
        (("--board", drawn, "-o", output, "--port", "p", "--hidden", "1"), "--hidden"),
        (("--board", drawn, "-o", output, "--emulator", "--port", ""), "--port"),
    ):
        refused = chladni("calibrate", *map(str, arguments))
        assert refused.code == 2, arguments
        assert said in refused.err, (arguments, refused.err)
    assert not output.exists()


def test_a_device_on_a_port_measures_its_board(
    chladni: CommandLine, drawn: Path, tmp_path: Path
) -> None:
    """Ten seconds of real time, as on a desk; the scores are of the board that was found."""
    hidden = hidden_plate(small_board(), SEED)
    port = VirtualPort(emulator_on(small_board(), hidden))
    ends = threading.Event()
    served = threading.Thread(target=port.serve, args=(ends.is_set,))
    served.start()
    try:
        output, read = tmp_path / "measured.toml", tmp_path / "read.json"
        done = chladni(
            *("calibrate", "--board", drawn, "--port", port.port, "--readings", read),
            *("--sets", "2", "-o", output, "--json"),
        )
    finally:
        ends.set()
        served.join()
        port.close()
    assert done.code == 0, done.err
    signs = [own["polarity"] for own in done.json["coils"]]
    assert signs == [-1 if strength < 0.0 else 1 for strength in hidden.strengths]
    assert done.json["by"] == "its own coils"
    assert done.json["device_seconds"] <= 15.0
    assert not any("true" in own for own in done.json["coils"] + done.json["parameters"])
    # What was read is fitted again without a device, to the same board.
    again = chladni(
        "calibrate", "--board", drawn, "--readings", read, "--sets", "2", "-o", output, "--json"
    )
    assert again.code == 0, again.err
    assert again.json["parameters"] == done.json["parameters"]
    assert again.json["by"] == "its own coils, read.json"


def test_micrometres_stand_beside_decibels() -> None:
    """On a board that is as it was drawn they are those of its own score."""
    board = small_board()
    truth = Truth.found(board, board, sets=20).score(board)
    assert truth.fingers_um is not None
    (scored,) = score_fingers(board, (2,), sets=20, samples=0).counts
    assert scored.finger_um is not None
    assert truth.fingers_um.median == pytest.approx(scored.finger_um.median, rel=0.01)
    # As `fingers` has it, worst tenth and all: both choose λ as the board's device does.
    assert truth.fingers_2_db.p10 == pytest.approx(scored.isolation_db.p10, abs=0.05)
    told = verdict(board, Calibrated(board, (), "coils", None), truth, truth, 20)
    tail = f"{truth.fingers_2_db.p10:.0f}"
    assert f"At the worst tenth two fingers {tail} dB before, {tail} after. Each gets " in told
    assert " dB after (over 20 pairs, with the solver's drives). At the worst" in told
    um = truth.fingers_um
    assert f" µm before, {um.median:.2g} after, {um.p10:.2g} at the worst tenth." in told
    assert told.endswith("its thickness and modulus go together, and are not told apart.")


def test_a_verdict_says_when_new_drives_are_worse_and_which_foot_is_odd() -> None:
    feet = tuple(Spring((x, 0.0), 8e3) for x in (-26e-3, 26e-3))
    board = dataclasses.replace(small_board(), foundation=None, springs=feet)
    old, new = [
        Restored(None, Spread(db, db - 9.0, db + 9.0), Spread(0, 0, 0)) for db in (35.0, 31)
    ]
    means = Parameter("feet", 1.2, 1.1, 1.3, True)
    by_ear = Calibrated(board, (means,), "a microphone", None)
    told = verdict(board, by_ear, old, new, 60)
    assert "4.0 dB less apart than the old ones: keep the drawn board's file" in told
    assert FEET_ALIKE in told
    assert "less apart than the old ones: keep" not in verdict(
        board, by_ear, old, new, 60, is_on_plate=False
    )
    assert "less apart than the old ones: keep" not in verdict(board, by_ear, new, old, 60)
    names = [foot_name(own) for own in feet]
    each = (Parameter(names[0], 1.1, 1.0, 1.2, True), Parameter(names[1], 1.7, 1.6, 1.8, True))
    told = verdict(board, Calibrated(board, (means, *each), "coils", None), old, new, 60)
    assert FEET_ALIKE not in told
    assert told.endswith("feet 1.20 times the drawn one, of them the foot at 26, 0 mm 1.70 times.")


def test_a_file_keeps_one_finger_where_focus_is_what_its_board_is_for() -> None:
    board, median = small_board(), Spread(20.0, 10.0, 30.0)
    scores = Restored(Spread(24.0, 18.0, 29.0), median, median)
    assert scores.isolation(board) == Isolation(20.0)
    focuses = dataclasses.replace(board, focus=Focus())
    assert scores.isolation(focuses) == Isolation(20.0, 24.0)
    smaller = dataclasses.replace(scores, second_finger_20mm_db=None)
    assert smaller.isolation(focuses) == Isolation(20.0)
