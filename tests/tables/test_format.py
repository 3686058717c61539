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
from chladni.tables.regions import RegionGrid
from conftest import ROOT


def make_table(columns: int = 3, rows: int = 4, actuators: int = 5, seed: int = 0) -> f.Table:
    rng = np.random.default_rng(seed)
    iq = rng.integers(-23000, 23000, size=(columns * rows, actuators, 2)).astype(np.int16)
    return f.Table(
        "prototype", 0x0123456789ABCDEF, 160.0, RegionGrid(columns, rows, 71500, 146700), 10.0,
        f.Limits(4000, 100000, 10000000), iq,
    )  # fmt: skip


def same(first: f.Table, second: f.Table) -> bool:
    plain = {k: v for k, v in vars(first).items() if k != "iq"}
    return plain == {k: v for k, v in vars(second).items() if k != "iq"} and np.array_equal(
        first.iq, second.iq
    )


@settings(max_examples=50, deadline=None)
@given(
    columns=st.integers(1, 20), rows=st.integers(1, 20), actuators=st.integers(1, 8),
    seed=st.integers(0, 1000),
)  # fmt: skip
def test_a_table_survives_its_bytes(columns: int, rows: int, actuators: int, seed: int) -> None:
    table = make_table(columns, rows, actuators, seed)
    assert same(f.unpack(f.pack(table)), table)


def test_quantising_errs_by_half_a_step_at_most() -> None:
    rng = np.random.default_rng(2)
    parts = rng.uniform(-7, 7, (2, 100, 5))
    drives = np.asarray(parts[0] + 1j * parts[1], dtype=np.complex128)
    back = f.dequantise(f.quantise(drives, 10.0), 10.0)
    step = 10.0 / 32767.0
    assert np.abs((back - drives).real).max() <= step / 2 * (1 + 1e-9)
    assert np.abs((back - drives).imag).max() <= step / 2 * (1 + 1e-9)


def test_every_truncated_prefix_is_refused() -> None:
    data = f.pack(make_table())
    for length in range(len(data)):
        with pytest.raises(InputError):
            f.unpack(data[:length])


def test_every_flipped_bit_is_refused() -> None:
    data = bytearray(f.pack(make_table()))
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
    ({"version_minor": 2}, "version"),
    ({"header_bytes": 76}, "header_bytes"),
    ({"total_bytes": 12}, "total_bytes"),
    ({"actuators": 0}, "actuators"),
    ({"actuators": 9}, "actuators"),
    ({"actuators": 4}, "total_bytes"),
    ({"encoding": 7}, "encoding"),
    ({"columns": 0}, "columns"),
    ({"columns": 65535, "rows": 65535}, "columns"),
    ({"columns": 2048, "rows": 2048}, "regions"),
    ({"width_um": 0}, "width_um"),
    ({"frequency_mhz": 0}, "frequency_mhz"),
    ({"max_on_us": 0xFFFFFFFF}, "max_on_us"),
    ({"ramp_us": 20_000_000}, "ramp_us"),
    ({"touch_timeout_us": 5_000}, "touch_timeout_us"),
    ({"reserved": 1}, "reserved"),
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
