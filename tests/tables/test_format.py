"""Table bytes: there and back, and every way they can be wrong."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.sim.errors import InputError
from chladni.tables import format as f
from chladni.tables.packing import PLAIN, UNFOLDED, Folding, Packing
from chladni.tables.regions import RegionGrid
from conftest import ROOT


def make_table(
    columns: int = 3, rows: int = 4, actuators: int = 5, seed: int = 0,
    packing: Packing = PLAIN, folding: Folding = UNFOLDED,
) -> f.Table:  # fmt: skip
    rng = np.random.default_rng(seed)
    grid = RegionGrid(columns, rows, 71500, 146700)
    n = packing.largest
    codes = rng.integers(-n, n + 1, size=(folding.stored(grid).size, actuators, 2))
    return f.Table(
        "prototype", 0x0123456789ABCDEF, 160.0, grid, 10.0, f.Limits(4000, 100000, 10000000),
        folding.unfold(grid, packing.values(codes)), packing, folding,
    )  # fmt: skip


def reversal(count: int) -> tuple[int, ...]:
    """An order that undoes itself."""
    return tuple(range(count))[::-1]


def same(first: f.Table, second: f.Table) -> bool:
    plain = {k: v for k, v in vars(first).items() if k != "iq"}
    return plain == {k: v for k, v in vars(second).items() if k != "iq"} and np.array_equal(
        first.iq, second.iq
    )


@settings(max_examples=50, deadline=None)
@given(
    columns=st.integers(1, 20), rows=st.integers(1, 20), actuators=st.integers(1, 8),
    seed=st.integers(0, 1000), bits=st.tuples(st.integers(2, 16), st.integers(2, 16)),
    scales=st.tuples(st.integers(1, 32767), st.integers(1, 32767)), x=st.booleans(),
    y=st.booleans(),
)  # fmt: skip
def test_a_table_survives_its_bytes(
    columns: int, rows: int, actuators: int, seed: int, bits: tuple[int, int],
    scales: tuple[int, int], x: bool, y: bool,
) -> None:  # fmt: skip
    order = reversal(actuators)
    folding = Folding(order if x else None, order if y else None)
    table = make_table(columns, rows, actuators, seed, Packing(bits, scales), folding)
    assert same(f.unpack(f.pack(table)), table)


def test_values_are_the_formula_of_the_document() -> None:
    """sign · (|code| · scale + n/2) / n in whole numbers, for every code of a few widths."""
    for bits, scale in ((2, 32767), (5, 6132), (8, 32767), (9, 1), (16, 32767), (16, 12345)):
        n = 2 ** (bits - 1) - 1
        codes = np.arange(-n, n + 1)
        values = Packing((bits, bits), (scale, scale)).values(np.stack((codes, -codes), axis=-1))
        exact = [int(np.sign(c)) * ((abs(int(c)) * scale + n // 2) // n) for c in codes]
        assert values[:, 0].tolist() == exact
        assert values[:, 1].tolist() == [-v for v in exact]
        # Within half a unit of the exact quotient.
        assert np.abs(values[:, 0] - codes * scale / n).max() <= 0.5


def test_a_mirrored_region_holds_the_other_actuators_drive() -> None:
    """Against the definition, cell by cell: odd counts keep their middle line."""
    order_x, order_y = (0, 2, 1, 4, 3), (0, 3, 4, 1, 2)
    table = make_table(5, 4, folding=Folding(order_x, order_y))
    assert table.folding.stored(table.grid).tolist() == [0, 1, 2, 5, 6, 7]
    for row in range(4):
        for column in range(5):
            stored = min(row, 3 - row) * 5 + min(column, 4 - column)
            channels = np.arange(5)
            if column > 2:
                channels = channels[list(order_x)]
            if row > 1:
                channels = channels[list(order_y)]
            assert np.array_equal(table.iq[row * 5 + column], table.iq[stored][channels])


def test_what_packing_or_mirrors_cannot_hold_is_refused_when_packed() -> None:
    """A symmetric flag on drives that are not, and values between the codes."""
    plain = make_table(4, 4)
    for change in ({"folding": Folding(reversal(5))}, {"packing": Packing((8, 8))}):
        with pytest.raises(InputError, match=r"table\.iq"):
            f.pack(f.Table(**(vars(plain) | change)))


def test_codes_out_of_range_and_padding_are_refused() -> None:
    packing = Packing((3, 3))
    good = bytearray(f.pack(make_table(1, 1, 1, packing=packing)))
    for payload in (0b00000100, 0b00100000, 0b01000000, 0b10000000):
        good[f.HEADER_BYTES] = payload
        struct.pack_into("<I", good, len(good) - 4, zlib.crc32(good[:-4]))
        with pytest.raises(InputError, match="payload"):
            f.unpack(bytes(good))


def test_quantising_errs_by_half_a_step_at_most() -> None:
    rng = np.random.default_rng(2)
    parts = rng.uniform(-7, 7, (2, 100, 5))
    drives = np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)
    back = f.dequantise(f.quantise(drives, 10.0), 10.0)
    step = 10.0 / 32767.0
    assert np.abs((back - drives).real).max() <= step / 2 * (1 + 1e-9)
    assert np.abs((back - drives).imag).max() <= step / 2 * (1 + 1e-9)


PACKED = {"packing": Packing((8, 6), (32767, 6132)), "folding": Folding((0, 2, 1, 4, 3))}


@pytest.mark.parametrize("form", [{}, PACKED])
def test_every_truncated_prefix_is_refused(form: dict[str, Any]) -> None:
    data = f.pack(make_table(**form))
    for length in range(len(data)):
        with pytest.raises(InputError):
            f.unpack(data[:length])


@pytest.mark.parametrize("form", [{}, PACKED])
def test_every_flipped_bit_is_refused(form: dict[str, Any]) -> None:
    data = bytearray(f.pack(make_table(**form)))
    for position in range(len(data) * 8):
        data[position // 8] ^= 1 << (position % 8)
        with pytest.raises(InputError):
            f.unpack(bytes(data))
        data[position // 8] ^= 1 << (position % 8)


def forge(**fields: Any) -> bytes:
    """A table with header fields changed and the CRC made right again."""
    data = bytearray(f.pack(make_table()))
    offsets = f.header_offsets()
    for name, value in fields.items():
        field = next(item for item in f.HEADER_FIELDS if item.name == name)
        struct.pack_into("<" + field.code, data, offsets[name], value)
    struct.pack_into("<I", data, len(data) - 4, zlib.crc32(data[:-4]))
    return bytes(data)


FORGERIES = [
    ({"magic": b"NOPE"}, "magic"),
    ({"version_major": 1}, "version"),
    ({"version_minor": 1}, "version"),
    ({"version_minor": 3}, "version"),
    ({"header_bytes": 76}, "header_bytes"),
    ({"total_bytes": 12}, "total_bytes"),
    ({"actuators": 0}, "actuators"),
    ({"actuators": 9}, "actuators"),
    ({"actuators": 4}, "total_bytes"),
    ({"mirrors": 4}, "mirrors"),
    ({"mirrors": 1}, "mirror_x"),
    ({"mirrors": 1, "mirror_x": 0x43210}, "total_bytes"),
    ({"mirrors": 1, "mirror_x": 0x43201, "mirror_y": 1}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x10432}, "mirror_y"),
    ({"mirrors": 2, "mirror_y": 0x543210}, "mirror_y"),
    ({"in_phase_bits": 1}, "in_phase_bits"),
    ({"quadrature_bits": 17}, "quadrature_bits"),
    ({"quadrature_bits": 15}, "total_bytes"),
    ({"in_phase_scale": 0}, "in_phase_scale"),
    ({"quadrature_scale": 40000}, "quadrature_scale"),
    ({"columns": 0}, "columns"),
    ({"columns": 65535, "rows": 65535}, "columns"),
    ({"columns": 2048, "rows": 2048}, "regions"),
    ({"width_um": 0}, "width_um"),
    ({"frequency_mhz": 0}, "frequency_mhz"),
    ({"max_on_us": 0xFFFFFFFF}, "max_on_us"),
    ({"ramp_us": 20_000_000}, "ramp_us"),
    ({"touch_timeout_us": 5_000}, "touch_timeout_us"),
    ({"board_name": b"\xff\xe9name"}, "board_name"),
    ({"board_name": b"A" * 16}, "board_name"),
]


@pytest.mark.parametrize(("fields", "named"), FORGERIES)
def test_a_right_crc_does_not_excuse_wrong_fields(fields: dict[str, Any], named: str) -> None:
    with pytest.raises(InputError) as caught:
        f.unpack(forge(**fields), file="x.chl")
    assert caught.value.field == named
    assert str(caught.value).startswith("x.chl: ")


def test_a_damaged_payload_names_the_crc() -> None:
    data = bytearray(f.pack(make_table()))
    data[f.HEADER_BYTES + 3] ^= 0x40
    with pytest.raises(InputError) as caught:
        f.unpack(bytes(data))
    assert caught.value.field == "crc"


def test_what_the_format_cannot_hold_is_refused_when_packed() -> None:
    with pytest.raises(InputError, match=r"table\.actuators"):
        f.pack(make_table(actuators=9))
    with pytest.raises(InputError, match=r"table\.regions"):
        f.pack(make_table(columns=100, rows=100))


def test_the_document_describes_every_field_where_it_is() -> None:
    text = (ROOT / "docs" / "table-format.md").read_text(encoding="utf-8")
    offsets = f.header_offsets()
    for field in f.HEADER_FIELDS:
        assert f"| {offsets[field.name]} | `{field.name}` | {field.kind} |" in text
    assert f"{f.HEADER_BYTES} bytes" in text
