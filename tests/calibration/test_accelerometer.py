"""An accelerometer on the plate: what the device reads of it, its mass, and the board found."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from calibration.small_board import small_board
from chladni.calibration import hidden_plate
from chladni.calibration.hidden import HiddenPlate
from chladni.calibration.laboratory.fields_at_places import SENSOR_RADIUS, FieldsAtPlaces
from chladni.calibration.laboratory.fields_fit import fit_fields
from chladni.calibration.laboratory.measured_fields import MeasuredFields, joined
from chladni.calibration.laboratory.refined_fields import SENSOR
from chladni.calibration.parameters import INTERVAL
from chladni.calibration.sensing import BASE_SAMPLES, MULTIPLES, UNIT_HZ
from chladni.calibration.unknowns import unknowns_of
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, TouchEvent
from chladni.host.emulation.sensed_plate import PERIODS, emulator_on
from chladni.host.emulation.shaken_plate import Sensor, SensorModel, ShakenPlate
from chladni.host.measuring.accelerometer import read_motions
from chladni.host.measuring.coil_readings import ReadingError
from chladni.sim.board.board import Board
from chladni.sim.board.file import load_board
from chladni.sim.board.parts import Mass
from chladni.sim.fields.induced import open_coils

AT, OTHER = (8e-3, 5e-3), (-9e-3, -12e-3)
STEP = 0.05
"""Of a logarithm, either way, over which a slope is taken."""
MOVE = 1e-4
"""m, the same of a coil's place."""
ComplexArray = NDArray[np.complex128]
KG = 1.5e-3
SEED = 4
"""Of a plate with a reversed coil."""
HZ = np.array([own * UNIT_HZ for own in MULTIPLES])


@pytest.fixture(scope="module")
def board() -> Board:
    return small_board()


def device_on(
    board: Board, hidden: HiddenPlate, model: SensorModel = "LIS2DW12", kg: float = KG
) -> tuple[Device, Emulator]:
    emulator = emulator_on(board, hidden, listens=False)
    ShakenPlate(hidden, Sensor(kg, model), [AT]).stand(emulator, 0)
    return Device(EmulatorWire(emulator)), emulator


@pytest.mark.parametrize("model", ["LIS2DW12", "ADXL345"])
def test_the_device_reads_what_the_plate_does(board: Board, model: SensorModel) -> None:
    """By another way than its: sines alone. Late by what no one knows, so phases are compared.

    Gain is 3 % off, the filter 4 % at 240 Hz, a coil's phase 0.02 ms of the clock's.
    """
    hidden = hidden_plate(board, SEED)
    device, _ = device_on(board, hidden, model)
    begun = device.wire.now_s()
    read = read_motions(device, board, AT, KG)
    # 10 s for five coils, as all ways may take; here are six.
    assert device.wire.now_s() - begun < 12.0
    at = np.array([AT])
    fields = FieldsAtPlaces(hidden.board, HZ, KG, at)
    for row, hz in enumerate(HZ):
        own = read.hz == hz
        coils = read.coils[own]
        true = fields.at(row, coils, np.repeat(at, coils.size, axis=0))
        ratio = read.compliance(board)[own] / (true * hidden.forces[coils])
        strong = np.abs(true) > 0.2 * np.abs(true).max()
        assert np.abs(ratio[strong]) == pytest.approx(1.0, abs=0.09)
        turned = np.angle(ratio[strong] / ratio[strong][0], deg=True)
        assert turned == pytest.approx(0.0, abs=5.0)


def test_the_sensors_mass_is_a_mass_on_the_plate(board: Board) -> None:
    """Against the plate with the mass among its parts, which another solver's terms have.

    Left are the disc's turning and the straight lines between image points: a seventh of what the
    mass does.
    """
    mass = Mass(AT, KG, SENSOR_RADIUS)
    loaded = dataclasses.replace(board, masses=(*board.masses, mass))
    at, coils = np.array([AT]), np.arange(len(board.actuators))
    places = np.repeat(at, coils.size, axis=0)
    bare, mounted = (FieldsAtPlaces(own, HZ, 0.0, np.empty((0, 2))) for own in (board, loaded))
    own = FieldsAtPlaces(board, HZ, KG, at)
    for row in range(HZ.size):
        true = mounted.at(row, coils, places)
        does = np.linalg.norm(bare.at(row, coils, places) - true)
        assert does > 0.02 * np.linalg.norm(true)
        assert np.linalg.norm(own.at(row, coils, places) - true) < does / 7.0


@pytest.mark.parametrize("sensor_kg", [0.0, 5.0 * KG])
def test_fields_change_with_patches_and_places_as_solved_boards_do(
    board: Board, sensor_kg: float
) -> None:
    """Against differences. Image points are a tenth of a patch apart.

    A coil that moves takes the mass of its magnet with it, which slopes leave out; here is none.
    """
    unknowns = unknowns_of(board)
    at = np.array([AT, OTHER])
    coils, places = np.repeat(np.arange(2), 2), np.tile(at, (2, 1))

    def difference(value: int, step: float) -> ComplexArray:
        moved = []
        for off in (step, -step):
            values = unknowns.mean.copy()
            values[value] = off
            solved = FieldsAtPlaces(unknowns.board_at(values), HZ[:1], sensor_kg, at)
            moved.append(solved.at(0, coils, places))
        return np.asarray((moved[0] - moved[1]) / (2.0 * step))

    drawn = FieldsAtPlaces(unknowns.board_at(unknowns.mean), HZ[:1], sensor_kg, at)
    for of_all, values, step in (
        (drawn.patch_slopes(0, coils, places), unknowns.patch_values, STEP),
        (drawn.place_slopes(0, coils, places), unknowns.places, MOVE),
    ):
        for own in (0, 1, len(of_all) // 2):
            true = difference(values.start + own, step)
            assert np.linalg.norm(of_all[own] - true) <= 0.05 * np.linalg.norm(true)


def on_every_coil(hidden: HiddenPlate, hz: NDArray[np.float64]) -> MeasuredFields:
    """What a sensor on one coil after another would read."""
    at = np.array([own.at for own in hidden.board.actuators])
    coils, places = np.tile(np.arange(len(at)), len(at)), np.repeat(at, len(at), axis=0)
    plate = FieldsAtPlaces(hidden.board, hz, KG, at)
    values = [hidden.strengths[coils] * plate.at(row, coils, places) for row in range(hz.size)]
    return MeasuredFields(
        np.tile(coils, hz.size),
        np.tile(places, (hz.size, 1)),
        np.repeat(hz, coils.size),
        np.concatenate(values),
        sensor_kg=KG,
    )


def fields_off(found: Board, hidden: HiddenPlate) -> float:
    """RMS share that the coils' fields at 160 Hz are off, all over the plate."""
    own, true = (
        forces[:, None, None] * open_coils(board, 160.0, tolerance=1e-3).fields.values
        for board, forces in (
            (found, np.array([own.strength for own in found.actuators])),
            (hidden.board, hidden.strengths),
        )
    )
    return float(np.linalg.norm(own - true) / np.linalg.norm(true))


def test_a_sheet_with_held_edges_is_found_beyond_a_mode() -> None:
    """The plate's 160 Hz lies on the other side of a mode than the drawn one's."""
    board = load_board("paper")
    hidden = hidden_plate(board, 3)
    found = fit_fields(board, on_every_coil(hidden, HZ))
    assert fields_off(found.board, hidden) < 0.05  # 0.22 beyond it, 0.01 on the right side


def test_patches_of_foam_count_where_fields_are_exact() -> None:
    """Patches of ±50 %: the same fields, taken to be 3 % off, left half as much again, 0.056."""
    board = load_board("phone5")
    hidden = hidden_plate(board, 22)
    found = fit_fields(board, on_every_coil(hidden, HZ))
    assert fields_off(found.board, hidden) < 0.045


def test_a_sensor_on_every_coil_tells_forces_and_level() -> None:
    """On foam so stiff that a coil's field is a tenth at the next one, and coils are 0.5 mm off.

    What each pair does both ways differs by their forces alone.
    """
    board = load_board("quiet5")
    hidden = hidden_plate(board, SEED)
    found = fit_fields(board, on_every_coil(hidden, HZ[1:2]))
    forces = np.array([own.strength for own in found.board.actuators])
    assert forces == pytest.approx(hidden.strengths, rel=0.15)
    # No value is told better than a sensor is known.
    told = [np.log(own.high / own.low) / (2.0 * INTERVAL) for own in found.parameters if own.told]
    assert min(told) > SENSOR
    moves = [
        np.diag(open_coils(own, 160.0, tolerance=1e-3).compliance)
        for own in (found.board, hidden.board)
    ]
    level = 20.0 * np.log10(np.abs(forces * moves[0] / (hidden.strengths * moves[1])))
    assert np.abs(level).max() < 1.0


def test_a_board_is_found_by_an_accelerometer_at_two_places(board: Board) -> None:
    """With a reversed coil; its level within 1 dB where the sensor did not stand."""
    hidden = hidden_plate(board, SEED)
    device, emulator = device_on(board, hidden)
    places, parts = (AT, OTHER), []
    standing = ShakenPlate(hidden, Sensor(KG), places)
    for number, place in enumerate(places):
        standing.stand(emulator, number)
        parts.append(read_motions(device, board, place, KG))
    found = fit_fields(board, joined(parts))
    assert found.wiring.signs.tolist() == np.sign(hidden.strengths).tolist()
    fields = [
        np.asarray(open_coils(own, 160.0, tolerance=1e-3).fields.values)
        for own in (found.board, hidden.board)
    ]
    forces = np.array([own.strength for own in found.board.actuators])
    off = [
        np.linalg.norm(forces[k] * fields[0][k]) / np.linalg.norm(own * fields[1][k])
        for k, own in enumerate(hidden.forces)
    ]
    assert np.median(np.abs(20.0 * np.log10(off))) < 1.0


def still(emulator: Emulator, model: SensorModel, address: int, steady_g: float) -> None:
    """Put one on the bus that no coil moves."""
    emulator.core.set_accelerometer(
        model,
        np.zeros((6, PERIODS * BASE_SAMPLES), np.float32),
        address=address,
        clock_hz=800.0,
        noise_g=2e-3,
        steady_g=steady_g,
        seed=1,
    )


def test_what_is_wrong_with_it_is_said(board: Board) -> None:
    hidden = hidden_plate(board, 1)
    device, emulator = device_on(board, hidden)
    faults = emulator.core.accelerometer_faults
    faults.is_absent = True
    with pytest.raises(ReadingError, match="accelerometer missing"):
        read_motions(device, board, AT, KG)
    faults.is_absent = False
    assert read_motions(device, board, AT, KG).hz.size == 3 * len(board.actuators)
    still(emulator, "LIS2DW12", 0x18, steady_g=1.0)
    with pytest.raises(ReadingError, match="feels none of the coils"):
        read_motions(device, board, AT, KG)
    still(emulator, "ADXL345", 0x1D, steady_g=0.1)
    with pytest.raises(ReadingError, match=r"0\.1\d g at rest"):
        read_motions(device, board, AT, KG)


def test_a_finger_ends_a_reading(board: Board) -> None:
    hidden = hidden_plate(board, 1)
    device, emulator = device_on(board, hidden)
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 60.0, (0.0, 0.0)))
    with pytest.raises(ReadingError, match="touched"):
        read_motions(device, board, AT, KG)
    emulator.run(30.0)
    assert emulator.run(20.0).duty_steps.max() == 0


def test_requests_out_of_range_are_refused(board: Board) -> None:
    device, _ = device_on(board, hidden_plate(board, 1))
    usual = {"playing": 0, "multiple": 4, "level_q15": 9_000, "settle_ms": 5, "count": 8}
    for wrong in (
        {"playing": 6},
        {"multiple": 3},
        {"level_q15": 40_000},
        {"count": 0},
        {"count": 257},
    ):
        with pytest.raises(LinkError, match="invalid fields"):
            device.link.request("motion_sense", b"", **usual | wrong)
