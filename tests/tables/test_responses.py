"""Responses in tables: their bytes, what both readers make of them, and what they refuse."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.drives.fingers import drives_for
from chladni.drives.problem.region_grid import RegionGrid
from chladni.sim.errors import InputError
from chladni.tables import layout
from chladni.tables._firmware import FirmwareTable
from chladni.tables.format import pack, unpack
from chladni.tables.mirror_symmetry import NO_MIRRORS, MirrorSymmetry
from chladni.tables.responses import TableResponses
from chladni.tables.several_fingers.section import section_of
from chladni.tables.stored_regions import StoredRegions
from chladni.tables.table import ReckonedFinger, ResponsesSection, Table
from made_up import LIMITS, forge, random_table, reversal, with_crc, with_responses
from plate_of_bumps import plate_of_bumps
from table_readings import OK, assert_both_refuse, readings

BOTH = with_responses(
    random_table(5, 4, 5, 1, labels=3, symmetry=MirrorSymmetry((0, 2, 1, 4, 3)), bits=12), 1
)
ALONE = with_responses(random_table(3, 2, 3, 2, bits=8), 2, alone=True, frequencies=(120.0, 160.0))
HEAD = layout.HEADER_BYTES + layout.SECTION_BYTES
"""Where the first section's own scale stands, if it is of responses."""
COUPLING = HEAD + layout.RESPONSES_STRUCT.size


def firmware_floats(section: ResponsesSection, integers: np.ndarray) -> np.ndarray:
    """Responses in float32, with the roundings that C++ prescribes: of the unit, of the product."""
    unit = np.float32(1e-12) / np.float32(32767.0)
    count = integers.shape[1] - 1
    scales = [section.full_scale_pm] * count + [section.own_full_scale_pm]
    units = np.array(scales, dtype=np.float32) * unit
    parts = integers.astype(np.float32) * units[:, None]
    return np.asarray(parts[..., 0] + 1j * parts[..., 1])


@settings(max_examples=100, deadline=None)
@given(
    columns=st.integers(1, 30),
    rows=st.integers(1, 30),
    actuators=st.integers(1, 16),
    seed=st.integers(0, 10_000),
    x=st.booleans(),
    y=st.booleans(),
    alone=st.booleans(),
    width=st.integers(1000, 500_000),
    length=st.integers(1000, 500_000),
    bits=st.sampled_from(layout.BITS),
)
def test_firmware_and_reference_read_the_same_responses_everywhere(
    columns: int,
    rows: int,
    actuators: int,
    seed: int,
    x: bool,
    y: bool,
    alone: bool,
    width: int,
    length: int,
    bits: int,
) -> None:
    """Places on the board, off it, and at the ends of 32 bits; drives beside them as before."""
    order = reversal(actuators)
    symmetry = MirrorSymmetry(order if x else None, order if y else None)
    drives = random_table(
        columns,
        rows,
        actuators,
        seed,
        labels=2,
        symmetry=symmetry,
        bits=bits,
        span_um=(width, length),
    )
    table = with_responses(drives, seed, alone=alone)
    data = pack(table)
    firmware = FirmwareTable(data, actuators)
    assert (firmware.has_drives, firmware.has_responses) == (not alone, True)
    rng = np.random.default_rng(seed)
    x_um, y_um = (rng.integers(-span, span + 1, 300) for span in (width, length))
    x_um[:2], y_um[1:3] = (-(2**31), 2**31 - 1), (2**31 - 1, -(2**31))
    at = x_um.astype(np.int32), y_um.astype(np.int32)
    known = TableResponses.of(unpack(data))
    wanted = firmware_floats(known.section, known.integers(x_um, y_um))
    assert np.array_equal(firmware.responses(*at), wanted)
    assert np.array_equal(firmware.coupling(), table.responses[0].coupling)
    told = known.section.finger
    assert told == table.responses[0].finger
    # Two roundings of float32.
    wanted_finger = (told.full_force_un * 1e-6, told.threshold_pm * 1e-12, told.stiffness)
    assert firmware.finger() == pytest.approx(wanted_finger, rel=2e-7)
    places = np.array([x_um, y_um], dtype=np.float64).T[3:] * 1e-6
    # Five roundings of float32: of 1e-12, of a quotient, of the scale, and of two products.
    for got, floats in (
        (known.at(places), wanted[3:, :-1]),
        (known.own_at(places), wanted[3:, -1]),
    ):
        assert np.all(np.abs(got - floats) <= 3e-7 * np.abs(floats))
    played = np.zeros((300, actuators, 2), np.int16)
    if not alone:
        played = table.lookup(table.section(), x_um, y_um)
    assert np.array_equal(firmware.lookup(*at), played)


@settings(max_examples=40, deadline=None)
@given(
    columns=st.integers(1, 12),
    rows=st.integers(1, 12),
    actuators=st.integers(1, 16),
    seed=st.integers(0, 1000),
    bits=st.sampled_from(layout.BITS),
    alone=st.booleans(),
)
def test_responses_survive_their_bytes(
    columns: int, rows: int, actuators: int, seed: int, bits: int, alone: bool
) -> None:
    drives = random_table(columns, rows, actuators, seed, bits=bits)
    table = with_responses(drives, seed, alone=alone, frequencies=(120.0, 160.0))
    data = pack(table)
    read = unpack(data)
    assert len(read.responses) == 2
    for own, again in zip(table.responses, read.responses, strict=True):
        for name in vars(own):
            assert np.array_equal(getattr(own, name), getattr(again, name)), name
    assert pack(read) == data
    section = 12 + 20 + 8 * actuators * (actuators + 1) // 2
    section += columns * rows * (actuators + 1) * bits // 4
    assert len(data) == (84 if alone else len(pack(drives))) + 2 * section


def test_a_section_is_what_the_document_says_byte_by_byte() -> None:
    """Two coils and one region of 8 bits, written out by hand."""
    section = ResponsesSection(
        160.0,
        0x01020304,
        0x05060708,
        np.array([[1.0 + 2.0j, -1.0], [-1.0, 0.5j]]),
        np.array([[[0x0100, -0x0100], [0x7F00, 0], [0x4000, -0x4000]]], np.int16),
        ReckonedFinger(0x090A0B0C, 0x0D0E0F10, 2.0 - 0.5j),
    )
    grid = RegionGrid(1, 1, 71500, 146700)
    data = pack(Table("t", 1, grid, LIMITS, (), NO_MIRRORS, 8, (section,)))
    assert data[4:8] == bytes([2, 1, 1, 2])
    assert data[80:-4].hex(" ", -4) == (
        "00027100 04030201 06000000 08070605 0c0b0a09 100f0e0d 00000040 000000bf "
        "0000803f 00000040 000080bf 00000000 00000000 0000003f "
        "817fff80 c040"
    ).replace("00027100", struct.pack("<I", 160_000).hex())


def test_tables_of_drives_alone_stay_tables_of_2_0() -> None:
    drives = replace(BOTH, responses=())
    assert pack(drives)[4:6] == bytes([2, 0])
    assert pack(BOTH)[4:6] == bytes([2, 1])
    # A table of 2.1 may be without responses; in one of 2.0 there are none.
    assert readings(forge(drives, version_minor=1)) == (OK, OK)
    assert readings(forge(BOTH, version_minor=0)) == ("kBadField", "kBadField")
    assert readings(forge(BOTH, version_minor=2)) == ("kBadVersion", "kBadVersion")
    assert readings(forge(ALONE, version_minor=0)) == ("kBadField", "kBadField")


SQUARE = MirrorSymmetry((1, 0, 3, 2), (2, 3, 0, 1))


@pytest.mark.parametrize("columns", [20, 21])
@pytest.mark.parametrize("symmetry", [SQUARE, MirrorSymmetry(SQUARE.x), NO_MIRRORS])
def test_a_mirrored_table_reads_as_the_plate_it_was_made_of(
    symmetry: MirrorSymmetry, columns: int
) -> None:
    known = plate_of_bumps()
    regions = StoredRegions(RegionGrid(columns, 33, 60000, 100000), symmetry)
    section = section_of(known, ReckonedFinger(), regions, 16)
    table = Table("t", 1, regions.grid, LIMITS, (), symmetry, 16, (section,))
    read = TableResponses.of(unpack(pack(table)))
    places = np.random.default_rng(7).uniform(-1, 1, (500, 2)) * (0.0285, 0.0484)
    # Bilinear over 3 mm on bumps of 30 mm: h² max|f″| / 8 both ways, 0.5 % of the largest; and a
    # place that is off by 1/4000 of the board.
    assert np.abs(read.at(places) - known.at(places)).max() < 6e-3 * np.abs(known.values).max()
    assert np.abs(read.own_at(places) - known.own_at(places)).max() < 4e-3 * np.abs(known.own).max()
    assert np.allclose(read.coupling, known.coupling, rtol=1e-7)
    fingers = [(-0.02, 0.01), (0.015, -0.02)]
    exact, found = (drives_for(plate, fingers, stiffness=2e3) for plate in (known, read))
    assert np.abs(found.means - exact.means).max() < 0.02 * np.abs(exact.means).max()


def test_a_frequency_selects_its_drives_and_its_responses() -> None:
    drives = random_table(2, 2, 5, 3, frequencies=(100.0, 160.0))
    table = with_responses(drives, 3, frequencies=(160.0, 200.0))
    firmware = FirmwareTable(pack(table), 5)
    zero, wide = np.zeros(1, np.int32), np.zeros(1, np.int64)
    for frequency, has in (
        (100.0, (True, False)),
        (200.0, (False, True)),
        (160.0, (True, True)),
    ):
        assert firmware.select(round(frequency * 1000)) == "ok"
        assert (firmware.has_drives, firmware.has_responses) == has
        assert np.any(firmware.lookup(zero, zero)) == has[0]
        if has[1]:
            known = TableResponses.of(table, frequency)
            wanted = firmware_floats(known.section, known.integers(wide, wide))
            assert np.array_equal(firmware.responses(zero, zero), wanted)
            assert np.array_equal(firmware.coupling(), known.coupling)
    assert firmware.select(123_000) != "ok"
    assert (firmware.has_drives, firmware.has_responses) == (True, True)


def test_what_a_table_does_not_have_is_named() -> None:
    with pytest.raises(InputError, match="expected a section of drives, got 'only responses'"):
        ALONE.section()
    with pytest.raises(InputError, match="expected a section of responses, got 'only drives'"):
        TableResponses.of(replace(BOTH, responses=()))
    with pytest.raises(InputError, match="120, 160 Hz"):
        TableResponses.of(ALONE, 100.0)


@pytest.mark.parametrize("table", [BOTH, ALONE])
def test_every_truncated_prefix_and_flipped_bit_is_refused(table: Table) -> None:
    data = bytearray(pack(table))
    for length in range(len(data)):
        assert_both_refuse(bytes(data[:length]))
    for position in range(0, len(data) * 8, 3):
        data[position // 8] ^= 1 << (position % 8)
        assert_both_refuse(bytes(data))
        data[position // 8] ^= 1 << (position % 8)


@pytest.mark.parametrize("table", [BOTH, ALONE])
def test_readers_agree_on_flipped_bits_that_the_crc_allows(table: Table) -> None:
    good = pack(table)
    places = np.random.default_rng(4).integers(-90_000, 90_001, (2, 50))
    taken = 0
    for position in range((len(good) - 4) * 8):
        data = bytearray(good)
        data[position // 8] ^= 1 << (position % 8)
        forged = with_crc(data)
        python, firmware = readings(forged)
        assert python == firmware, position
        if python == OK and position % 5 == 0 and unpack(forged).responses:
            read = unpack(forged)
            player = FirmwareTable(forged, read.actuators)
            section = read.responses[0]
            assert player.select(round(section.frequency_hz * 1000.0)) == "ok"
            known = TableResponses(read.regions, section)
            wanted = firmware_floats(section, known.integers(*places))
            assert np.array_equal(player.responses(*places.astype(np.int32)), wanted)
            assert np.array_equal(player.coupling(), section.coupling)
            taken += 1
    assert taken > 100


def put(at: int, raw: bytes) -> Callable[[bytearray], None]:
    def change(data: bytearray) -> None:
        data[at : at + len(raw)] = raw

    return change


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (put(84, bytes(4)), "kBadField"),  # full scale
        (put(HEAD, bytes(4)), "kBadField"),  # of the own compliance
        (put(89, b"\x01"), "kBadField"),  # a label
        (put(88, b"\x07"), "kBadField"),  # an objective to come
        (put(88, b"\x05\x01"), "kBadDrives"),  # drives, whose crossing would be the own scale
        (put(HEAD + 12, struct.pack("<f", np.nan)), "kBadDrives"),  # a stiffness
        (put(HEAD + 16, struct.pack("<f", np.inf)), "kBadDrives"),
        (put(COUPLING, struct.pack("<f", np.nan)), "kBadDrives"),
        (put(COUPLING + 4, struct.pack("<f", -np.inf)), "kBadDrives"),
        (put(COUPLING + 8 * 6 - 4, struct.pack("<f", np.inf)), "kBadDrives"),  # the last of six
        (put(COUPLING + 8 * 6, b"\x00\x00"), "kBadDrives"),  # a response of -1 - 1i
        (put(COUPLING + 8 * 6 + 6, b"\xff\xff"), "kBadDrives"),  # an own compliance of 1 + 1i
    ],
)
def test_a_right_crc_does_not_excuse_wrong_responses(
    change: Callable[[bytearray], None], verdict: str
) -> None:
    data = bytearray(pack(replace(ALONE, responses=ALONE.responses[:1])))
    change(data)
    assert readings(with_crc(data)) == (verdict, verdict)


def test_drives_behind_responses_are_refused() -> None:
    """So that each table has one order of its sections."""
    drives = replace(BOTH, responses=())
    data = pack(drives)
    size = len(pack(BOTH)) - len(data)
    both = pack(BOTH)
    head, own = bytearray(both[:80]), both[80:-4]
    swapped = with_crc(bytes(head) + own[-size:] + own[:-size] + bytes(4))
    assert readings(swapped) == ("kBadField", "kBadField")


def test_what_the_format_cannot_hold_is_refused_when_packed() -> None:
    section = ALONE.responses[0]

    def with_section(**changed: object) -> Table:
        own = replace(section, **changed)  # type: ignore[arg-type]
        return replace(ALONE, responses=(own,))

    lopsided = section.coupling.copy()
    lopsided[0, 1] += 1.0
    for changed, named in (
        ({"full_scale_pm": 0}, "full_scale"),
        ({"full_scale_pm": 2**32}, "full_scale"),
        ({"own_full_scale_pm": 0}, "own_full_scale"),
        ({"coupling": lopsided}, "symmetric"),
        ({"coupling": section.coupling * np.inf}, "float32"),
        ({"coupling": section.coupling * 1e60}, "float32"),
        ({"coupling": section.coupling[:2, :2]}, "shapes"),
        ({"finger": ReckonedFinger(stiffness=complex(0.0, np.inf))}, "table.stiffness"),
        ({"finger": ReckonedFinger(threshold_pm=2**32)}, "table.threshold"),
        ({"finger": ReckonedFinger(full_force_un=-1)}, "table.full_force"),
        ({"iq": section.iq[:-1]}, "shapes"),
        ({"iq": section.iq + 1}, "steps"),
        ({"iq": np.full_like(section.iq, 24064)}, "beyond full scale"),
    ):
        with pytest.raises(InputError, match=named):
            pack(with_section(**changed))
