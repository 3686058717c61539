"""Table bytes: there and back, and every way they can be wrong, for both readers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.effects.bank.layout import MAGIC as BANK_MAGIC
from chladni.sim.errors import InputError
from chladni.tables import layout
from chladni.tables._firmware import FirmwareTable
from chladni.tables.firmware_reader import FirmwareReader
from chladni.tables.format import OF_BANKS, pack, unpack
from chladni.tables.mirror_symmetry import NO_MIRRORS, MirrorSymmetry
from chladni.tables.table import Section, Table, dequantise, quantise
from conftest import ROOT
from made_up import forge, make_table, random_table, reversal, with_crc
from table_readings import OK, assert_both_refuse, readings

SMALL = random_table(3, 4, 5, 0)
FOLDED = random_table(
    5,
    4,
    5,
    1,
    labels=3,
    symmetry=MirrorSymmetry((0, 2, 1, 4, 3)),
    frequencies=(120.0, 160.0),
    bits=12,
)
NARROW = random_table(2, 3, 5, 2, labels=2, bits=8)


def same(first: Table, second: Table) -> bool:
    if replace(first, sections=()) != replace(second, sections=()):
        return False
    return all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for a, b in zip(first.sections, second.sections, strict=True)
        for name in vars(a)
    )


@settings(max_examples=80, deadline=None)
@given(
    columns=st.integers(1, 20),
    rows=st.integers(1, 20),
    actuators=st.integers(1, 16),
    seed=st.integers(0, 1000),
    labels=st.integers(1, 40),
    bits=st.sampled_from(layout.BITS),
    x=st.booleans(),
    y=st.booleans(),
    frequencies=st.sampled_from([(160.0,), (100.0, 250.5)]),
)
def test_a_table_survives_its_bytes(
    columns: int,
    rows: int,
    actuators: int,
    seed: int,
    labels: int,
    bits: int,
    x: bool,
    y: bool,
    frequencies: tuple[float, ...],
) -> None:
    order = reversal(actuators)
    symmetry = MirrorSymmetry(order if x else None, order if y else None)
    table = random_table(
        columns,
        rows,
        actuators,
        seed,
        labels=labels,
        symmetry=symmetry,
        frequencies=frequencies,
        bits=bits,
    )
    data = pack(table)
    assert same(unpack(data), table)
    cells = table.regions.count
    record = 1 + actuators * bits // 4
    assert len(data) == 80 + len(frequencies) * (12 + labels + cells * record) + 4


def test_a_record_is_what_the_document_says_byte_by_byte() -> None:
    """One region, written out by hand: offset binary, of 12 bits the upper eight first."""
    known = {
        8: ([[0x5A00, -0x0300]], "da 7d"),
        12: ([[0x5A30, -0x0310]], "da 7c f3"),
        16: ([[0x5A31, -0x0312]], "31 da ee 7c"),
    }
    for bits, (pair, expected) in known.items():
        section = Section(
            160.0,
            "ssim",
            10.0,
            np.zeros(1, np.uint8),
            np.array([[0, 2]], np.uint8),
            np.array([pair], dtype=np.int16),
        )
        table = replace(make_table(np.ones((1, 1))), sections=(section,), bits=bits)
        data = pack(table)
        # Cut in x, negated in y; then the label and the gain.
        assert data[92:-4] == bytes([0b1001, 0]) + bytes.fromhex(expected)


def test_a_mirrored_region_holds_the_other_actuators_drive() -> None:
    """Against the definition, cell by cell: odd counts keep their middle line."""
    order_x, order_y = (0, 2, 1, 4, 3), (0, 3, 4, 1, 2)
    table = random_table(5, 4, 5, 0, symmetry=MirrorSymmetry(order_x, order_y))
    assert table.regions.numbers.tolist() == [0, 1, 2, 5, 6, 7]
    kinds: list[tuple[int, int]] = [(0, 0), (1, 1), (2, 0), (0, 2), (2, 2)]
    for crossings in kinds:
        section = replace(table.sections[0], crossings=np.array([crossings], dtype=np.uint8))
        regions = table.region_iq(section)
        for row in range(4):
            for column in range(5):
                stored = min(row, 3 - row) * 3 + min(column, 4 - column)
                channels, sign = np.arange(5), 1
                if column > 2:
                    channels = channels[list(order_x)]
                    sign *= -1 if crossings[0] == 2 else 1
                if row > 1:
                    channels = channels[list(order_y)]
                    sign *= -1 if crossings[1] == 2 else 1
                expected = sign * section.iq[stored][channels]
                assert np.array_equal(regions[row * 5 + column], expected)


@pytest.mark.parametrize("bits", layout.BITS)
def test_quantising_errs_by_half_a_step_at_most(bits: int) -> None:
    """And by up to one at full scale, where rounding up would be beyond it."""
    rng = np.random.default_rng(2)
    parts = rng.uniform(-7, 7, (2, 100, 5))
    drives = np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)
    step = 10.0 * (1 << (16 - bits)) / 32767.0
    iq = quantise(drives, 10.0, bits)
    back = dequantise(iq, 10.0)
    assert not np.any(iq & ((1 << (16 - bits)) - 1))
    inside = np.abs(drives) < 10.0 - step
    assert np.abs((back - drives).real[inside]).max() <= step / 2 * (1 + 1e-9)
    assert np.abs((back - drives).imag[inside]).max() <= step / 2 * (1 + 1e-9)
    loudest = 10.0 * np.exp(1j * np.linspace(0.0, 7.0, 999))
    back = dequantise(quantise(loudest, 10.0, bits), 10.0)
    assert np.abs(back).max() <= 10.0
    assert np.abs(back - loudest).max() <= np.sqrt(2.0) * step


@pytest.mark.parametrize("table", [SMALL, FOLDED, NARROW])
def test_every_truncated_prefix_is_refused_by_both_readers(table: Table) -> None:
    data = pack(table)
    for length in range(len(data)):
        assert_both_refuse(data[:length])


@pytest.mark.parametrize("table", [SMALL, FOLDED, NARROW])
def test_every_flipped_bit_is_refused_by_both_readers(table: Table) -> None:
    data = bytearray(pack(table))
    for position in range(len(data) * 8):
        data[position // 8] ^= 1 << (position % 8)
        assert_both_refuse(bytes(data))
        data[position // 8] ^= 1 << (position % 8)


def everywhere(table: Table) -> tuple[np.ndarray, np.ndarray]:
    """Places in and around the board, in µm."""
    rng = np.random.default_rng(4)
    x_um, y_um = (
        rng.integers(-span, span + 1, 200) for span in (table.grid.width_um, table.grid.length_um)
    )
    return x_um, y_um


@pytest.mark.parametrize("table", [SMALL, FOLDED, NARROW])
def test_readers_agree_on_flipped_bits_that_the_crc_allows(table: Table) -> None:
    """With the CRC made right, a reader may take the bytes; then both must, for the same drives."""
    good = pack(table)
    taken = 0
    for position in range((len(good) - 4) * 8):
        data = bytearray(good)
        data[position // 8] ^= 1 << (position % 8)
        forged = with_crc(data)
        python, firmware = readings(forged)
        assert python == firmware, position
        if python == OK:
            read = unpack(forged)
            x_um, y_um = everywhere(read)
            played = FirmwareReader(forged, read.actuators)
            section = read.sections[0]
            assert np.array_equal(
                played.integers(section.frequency_hz, x_um, y_um), read.lookup(section, x_um, y_um)
            )
            taken += 1
    assert taken > 100  # names, fingerprints, limits and drives may be others


FORGERIES = [
    ({"magic": b"NOPE"}, "magic"),
    ({"version_major": 0}, "version"),
    ({"version_major": 1}, "version"),
    ({"version_minor": 2}, "version"),
    ({"total_bytes": 12}, "total_bytes"),
    ({"total_bytes": 0xFFFFFFFF}, "total_bytes"),
    ({"sections": 0}, "sections"),
    ({"sections": 17}, "sections"),
    ({"sections": 2}, "section 1"),
    ({"actuators": 0}, "actuators"),
    ({"actuators": 17}, "actuators"),
    ({"actuators": 4}, "section 0 label"),
    ({"actuators": 6}, "section 0"),
    ({"bits": 9}, "bits"),
    ({"bits": 12}, "section 0 label"),
    ({"mirrors": 4}, "mirrors"),
    ({"mirrors": 1}, "mirror_x"),
    ({"mirrors": 1, "mirror_x": 0x43201, "mirror_y": 1}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x10432}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x543210}, "mirror_y"),
    ({"columns": 0}, "columns"),
    ({"rows": 0}, "rows"),
    ({"columns": 65535, "rows": 65535}, "columns"),
    ({"columns": 2048, "rows": 2048}, "section 0"),
    ({"columns": 2}, "end of the sections"),
    ({"rows": 5}, "section 0"),
    ({"width_um": 0}, "width_um"),
    ({"frequency_millihertz": 0}, "frequency_millihertz"),
    ({"full_scale": 0}, "full_scale"),
    ({"objective": 9}, "objective"),
    ({"labels": 0}, "labels"),
    ({"labels": 2}, "section 0"),
    ({"labels": 255}, "section 0"),
    ({"max_on_us": 0xFFFFFFFF}, "max_on_us"),
    ({"ramp_us": 20_000_000}, "ramp_us"),
    ({"touch_timeout_us": 5_000}, "touch_timeout_us"),
    ({"board_name": b"\xff\xe9name"}, "board_name"),
    ({"board_name": b"A" * 16}, "board_name"),
]


@pytest.mark.parametrize(("fields", "named"), FORGERIES)
def test_a_right_crc_does_not_excuse_wrong_fields(fields: dict[str, Any], named: str) -> None:
    forged = forge(SMALL, **fields)
    with pytest.raises(InputError) as caught:
        unpack(forged, file="x.chl")
    assert caught.value.field == named
    assert str(caught.value).startswith("x.chl, ")
    assert_both_refuse(forged)


@pytest.mark.parametrize(
    ("at", "value", "named"),
    [
        (92, 0x10, "crossings"),
        (92, 0x05, "crossings"),
        (93, 1, "label"),
        (93, 255, "label"),
        (95, 0xFF, "gains"),
        (95, 0x00, "gains"),
    ],
)
def test_a_right_crc_does_not_excuse_wrong_records(at: int, value: int, named: str) -> None:
    """The first crossing, the first label, the upper byte of the first gain at full scale."""
    iq = np.full_like(SMALL.section().iq, 23000)
    data = bytearray(pack(replace(SMALL, sections=(replace(SMALL.section(), iq=iq),))))
    data[at] = value
    forged = with_crc(data)
    with pytest.raises(InputError, match=named):
        unpack(forged)
    assert readings(forged) == ("kBadDrives", "kBadDrives")


@pytest.mark.parametrize("version", [(0, 2), (1, 0)])
def test_a_table_of_an_older_format_is_refused_with_what_to_do(version: tuple[int, int]) -> None:
    old = forge(SMALL, version_major=version[0], version_minor=version[1])
    with pytest.raises(InputError, match="build the table again with `chladni table build`"):
        unpack(old)
    assert "build it again" in FirmwareTable(old, 5).status


def test_bytes_behind_the_table_are_refused() -> None:
    with pytest.raises(InputError, match="total_bytes"):
        unpack(pack(SMALL) + b"\0")


def test_a_damaged_payload_names_the_crc() -> None:
    data = bytearray(pack(SMALL))
    data[-20] ^= 0x40
    with pytest.raises(InputError) as caught:
        unpack(bytes(data))
    assert caught.value.field == "crc"


def test_what_the_format_cannot_hold_is_refused_when_packed() -> None:
    with pytest.raises(InputError, match=r"table\.actuators"):
        pack(random_table(1, 1, 17, 0))
    with pytest.raises(InputError, match=r"a device's slot: a larger regions\.pitch_mm"):
        pack(random_table(130, 100, 5, 0))
    loud = Section(
        160.0,
        "ssim",
        10.0,
        np.zeros(1, np.uint8),
        np.zeros((1, 2), np.uint8),
        np.full((1, 1, 2), 30000, dtype=np.int16),
    )
    with pytest.raises(InputError, match="beyond full scale"):
        pack(replace(make_table(np.ones((1, 1))), sections=(loud,)))
    with pytest.raises(InputError, match="finer steps"):
        pack(replace(make_table(np.ones((1, 1))), bits=12))
    with pytest.raises(InputError, match="stored regions"):
        pack(replace(SMALL, symmetry=MirrorSymmetry(reversal(5))))


def test_the_table_of_a_frequency_is_found_or_those_there_are_named() -> None:
    assert FOLDED.section().frequency_hz == 120.0
    assert FOLDED.section(160.0) is FOLDED.sections[1]
    with pytest.raises(InputError, match="120, 160 Hz"):
        FOLDED.section(161.0)
    assert NO_MIRRORS.flags == 0


def test_the_document_describes_every_field_where_it_is() -> None:
    text = (ROOT / "docs" / "table-format.md").read_text(encoding="utf-8")
    for fields in (layout.HEADER_FIELDS, layout.SECTION_FIELDS):
        places = layout.offsets(fields)
        for field in fields:
            row = f"| {places[field.name]} | `{field.name}` | {field.kind} | {field.doc} |"
            assert row in text
    assert f"{layout.HEADER_BYTES} bytes" in text
    assert f"{layout.SECTION_BYTES} bytes" in text


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"CHLE" + bytes(range(200, 240)) * 4, "an effect bank .`chladni effects flash`."),
        (b"# A board\n[plate]\n" * 10, "text: a board file?"),
        (bytes(range(200, 240)) * 4, "got b'"),
    ],
)
def test_what_is_another_kind_of_file_is_named(data: bytes, told: str) -> None:
    with pytest.raises(InputError, match=told):
        unpack(data)
    assert OF_BANKS == BANK_MAGIC
