"""Table bytes: there and back, and every way they can be wrong, for both readers."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.sim.errors import InputError
from chladni.tables import layout
from chladni.tables._firmware import FirmwareTable
from chladni.tables.folding import UNFOLDED, Folding
from chladni.tables.format import pack, unpack
from chladni.tables.table import Section, Table, dequantise, quantise
from conftest import ROOT
from made_up import forge, make_table, random_table, reversal, with_crc

SMALL = random_table(3, 4, 5, 0)
FOLDED = random_table(
    5, 4, 5, 1, labels=3, coarse=8, folding=Folding((0, 2, 1, 4, 3)), frequencies=(120.0, 160.0)
)


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
    columns=st.integers(1, 20), rows=st.integers(1, 20), actuators=st.integers(1, 16),
    seed=st.integers(0, 1000), labels=st.integers(1, 40), coarse=st.integers(0, 14),
    x=st.booleans(), y=st.booleans(), frequencies=st.sampled_from([(160.0,), (100.0, 250.5)]),
)  # fmt: skip
def test_a_table_survives_its_bytes(
    columns: int, rows: int, actuators: int, seed: int, labels: int, coarse: int, x: bool,
    y: bool, frequencies: tuple[float, ...],
) -> None:  # fmt: skip
    order = reversal(actuators)
    folding = Folding(order if x else None, order if y else None)
    table = random_table(
        columns, rows, actuators, seed, labels=labels, coarse=coarse, folding=folding,
        frequencies=frequencies,
    )  # fmt: skip
    assert same(unpack(pack(table)), table)


def test_a_mirrored_region_holds_the_other_actuators_drive() -> None:
    """Against the definition, cell by cell: odd counts keep their middle line."""
    order_x, order_y = (0, 2, 1, 4, 3), (0, 3, 4, 1, 2)
    table = random_table(5, 4, 5, 0, folding=Folding(order_x, order_y))
    assert table.folding.stored(table.grid).tolist() == [0, 1, 2, 5, 6, 7]
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


def test_quantising_errs_by_half_a_step_at_most() -> None:
    rng = np.random.default_rng(2)
    parts = rng.uniform(-7, 7, (2, 100, 5))
    drives = np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)
    back = dequantise(quantise(drives, 10.0), 10.0)
    step = 10.0 / 32767.0
    assert np.abs((back - drives).real).max() <= step / 2 * (1 + 1e-9)
    assert np.abs((back - drives).imag).max() <= step / 2 * (1 + 1e-9)


def readings(data: bytes, channels: int = 5) -> tuple[str, str]:
    """What Python's reader and the firmware's say of bytes: "ok", or why not."""
    try:
        unpack(data)
        python = "ok"
    except InputError as error:
        python = error.field
    return python, FirmwareTable(data, channels).status


@pytest.mark.parametrize("table", [SMALL, FOLDED])
def test_every_truncated_prefix_is_refused_by_both_readers(table: Table) -> None:
    data = pack(table)
    for length in range(len(data)):
        assert not {"ok", "unknown"} & set(readings(data[:length]))


@pytest.mark.parametrize("table", [SMALL, FOLDED])
def test_every_flipped_bit_is_refused_by_both_readers(table: Table) -> None:
    data = bytearray(pack(table))
    for position in range(len(data) * 8):
        data[position // 8] ^= 1 << (position % 8)
        assert not {"ok", "unknown"} & set(readings(bytes(data)))
        data[position // 8] ^= 1 << (position % 8)


@pytest.mark.parametrize("table", [SMALL, FOLDED])
def test_readers_agree_on_flipped_bits_that_the_crc_allows(table: Table) -> None:
    """With the CRC made right, a reader may take the bytes; then both must, for the same drives."""
    good = pack(table)
    taken = 0
    for position in range((len(good) - 4) * 8):
        data = bytearray(good)
        data[position // 8] ^= 1 << (position % 8)
        forged = with_crc(data)
        try:
            read = unpack(forged)
        except InputError:
            read = None
        firmware = FirmwareTable(forged, 5)
        if read is None or read.actuators != 5:
            assert firmware.status != "ok", position
            continue
        assert firmware.status == "ok", (position, firmware.status)
        assert np.array_equal(firmware.regions(), read.region_iq(read.sections[0])), position
        taken += 1
    assert taken > 100  # names, fingerprints, limits and drives may be others


FORGERIES = [
    ({"magic": b"NOPE"}, "magic"),
    ({"version_major": 0}, "version"),
    ({"version_major": 2}, "version"),
    ({"header_bytes": 76}, "header_bytes"),
    ({"header_bytes": 84}, "header_bytes"),
    ({"section_bytes": 24}, "section_bytes"),
    ({"version_minor": 1, "section_bytes": 16}, "section_bytes"),
    ({"version_minor": 1, "header_bytes": 65535}, "sections"),
    ({"total_bytes": 12}, "total_bytes"),
    ({"total_bytes": 0xFFFFFFFF}, "total_bytes"),
    ({"sections": 0}, "sections"),
    ({"sections": 17}, "sections"),
    ({"actuators": 0}, "actuators"),
    ({"actuators": 17}, "actuators"),
    ({"mirrors": 4}, "mirrors"),
    ({"mirrors": 1}, "mirror_x"),
    ({"mirrors": 1, "mirror_x": 0x43201, "mirror_y": 1}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x10432}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x543210}, "mirror_y"),
    ({"columns": 0}, "columns"),
    ({"columns": 65535, "rows": 65535}, "columns"),
    ({"columns": 2048, "rows": 2048}, "regions"),
    ({"columns": 200, "rows": 200}, "stored regions"),
    ({"width_um": 0}, "width_um"),
    ({"frequency_mhz": 0}, "frequency_mhz"),
    ({"full_scale_gain_milli": 0}, "full_scale_gain_milli"),
    ({"objective": 9}, "objective"),
    ({"labels": 0}, "labels"),
    ({"start_shift": 15}, "start_shift"),
    ({"offset": 0}, "section 0 offset"),
    ({"offset": 0xFFFFFFF0, "bytes": 0x20}, "section 0 offset"),
    ({"bytes": 0xFFFFFFFF}, "section 0 offset"),
    ({"bytes": 3}, "section 0"),
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
    assert str(caught.value).startswith("x.chl: ")
    assert FirmwareTable(forged, 5).status != "ok"


def grown(table: Table, header: int, section: int) -> bytes:
    """The table as a later 1.x might write it: longer headers, and a new minor version."""
    data = bytearray(pack(table))
    first = layout.HEADER_BYTES
    size, count = layout.SECTION_BYTES, len(table.sections)
    rows = [data[first + k * size : first + (k + 1) * size] for k in range(count)]
    added = header + section * count
    at = layout.offsets(layout.SECTION_FIELDS)["offset"]
    for row in rows:
        struct.pack_into("<I", row, at, struct.unpack_from("<I", row, at)[0] + added)
    head = data[:first]
    places = layout.offsets(layout.HEADER_FIELDS)
    head[places["version_minor"]] = 7
    struct.pack_into("<H", head, places["header_bytes"], first + header)
    struct.pack_into("<I", head, places["total_bytes"], len(data) + added)
    head[places["section_bytes"]] = size + section
    body = b"".join(bytes(row) + b"\xaa" * section for row in rows)
    return with_crc(bytes(head) + b"\x55" * header + body + data[first + size * count :])


@pytest.mark.parametrize(("header", "section"), [(0, 0), (4, 0), (0, 12), (40, 100)])
def test_a_later_minor_version_is_read_by_both(header: int, section: int) -> None:
    data = grown(FOLDED, header, section)
    assert same(unpack(data), FOLDED)
    firmware = FirmwareTable(data, 5)
    assert firmware.status == "ok"
    for own in FOLDED.sections:
        assert firmware.select(round(own.frequency_hz * 1000.0)) == "ok"
        assert np.array_equal(firmware.regions(), FOLDED.region_iq(own))


def test_a_damaged_payload_names_the_crc() -> None:
    data = bytearray(pack(SMALL))
    data[-20] ^= 0x40
    with pytest.raises(InputError) as caught:
        unpack(bytes(data))
    assert caught.value.field == "crc"


def test_what_the_format_cannot_hold_is_refused_when_packed() -> None:
    with pytest.raises(InputError, match=r"table\.actuators"):
        pack(random_table(1, 1, 17, 0))
    with pytest.raises(InputError, match="RAM"):
        pack(random_table(100, 100, 5, 0))
    loud = Section(
        160.0, "ssim", 10.0, np.zeros(1, np.uint8), np.zeros((1, 2), np.uint8),
        np.full((1, 1, 2), 30000, dtype=np.int16),
    )  # fmt: skip
    with pytest.raises(InputError, match="beyond full scale"):
        pack(replace(make_table(np.ones((1, 1))), sections=(loud,)))
    with pytest.raises(InputError, match="stored regions"):
        pack(replace(SMALL, folding=Folding(reversal(5))))


def test_the_table_of_a_frequency_is_found_or_those_there_are_named() -> None:
    assert FOLDED.section().frequency_hz == 120.0
    assert FOLDED.section(160.0) is FOLDED.sections[1]
    with pytest.raises(InputError, match="120, 160 Hz"):
        FOLDED.section(161.0)
    assert UNFOLDED.flags == 0


def test_the_document_describes_every_field_where_it_is() -> None:
    text = (ROOT / "docs" / "table-format.md").read_text(encoding="utf-8")
    for fields in (layout.HEADER_FIELDS, layout.SECTION_FIELDS):
        places = layout.offsets(fields)
        for field in fields:
            row = f"| {places[field.name]} | `{field.name}` | {field.kind} | {field.doc} |"
            assert row in text
    assert f"{layout.HEADER_BYTES} bytes" in text
    assert f"{layout.SECTION_BYTES} bytes" in text
