"""The stream of bits: its order, its predictions and its fewest bits, each by its definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.tables.coding import (
    MAX_UNARY,
    BitReader,
    BitWriter,
    Rates,
    passes,
    read_drives,
    read_labels,
    visits,
    write_drives,
    write_labels,
)


@given(columns=st.integers(1, 70), rows=st.integers(1, 70))
def test_every_region_is_visited_once_and_predicted_by_earlier_ones(
    columns: int, rows: int
) -> None:
    seen: set[int] = set()
    for together in passes(columns, rows):
        for visit in together:
            assert set(visit.neighbours) <= seen
        seen |= {visit.at for visit in together}
    assert seen == set(range(columns * rows))
    assert len(list(visits(columns, rows))) == columns * rows


def test_the_order_is_the_documents() -> None:
    """The figure of docs/table-format.md, 5 × 5 with S = 4: A, 2, 3, 2', 4 in turn."""
    figure = ["A434A", "42424", "34243", "42424", "A434A"]
    kinds = [figure[visit.at // 5][visit.at % 5] for visit in visits(5, 5)]
    assert "".join(kinds) == "AAAA" + "2" + "3333" + "2222" + "4" * 12
    centre = next(visit for visit in visits(5, 5) if visit.at == 12)
    assert set(centre.neighbours) == {0, 4, 20, 24}


def drawn_labels(columns: int, rows: int, count: int, seed: int) -> np.ndarray:
    """Patches: the label of the nearest of a few random seeds."""
    rng = np.random.default_rng(seed)
    y, x = np.divmod(np.arange(columns * rows), columns)
    seeds = rng.random((count, 2)) * (columns, rows)
    distance = (x[:, None] - seeds[:, 0]) ** 2 + (y[:, None] - seeds[:, 1]) ** 2
    return np.asarray(distance.argmin(axis=1).astype(np.uint8))


@settings(max_examples=60, deadline=None)
@given(
    columns=st.integers(1, 30), rows=st.integers(1, 30), count=st.integers(1, 255),
    seed=st.integers(0, 999), patches=st.booleans(),
)  # fmt: skip
def test_a_map_of_labels_survives_its_bits(
    columns: int, rows: int, count: int, seed: int, patches: bool
) -> None:
    labels = drawn_labels(columns, rows, count, seed)
    if not patches:
        labels = np.random.default_rng(seed).integers(0, count, labels.size).astype(np.uint8)
    writer = BitWriter()
    write_labels(writer, labels, columns, count)
    reader = BitReader(writer.to_bytes())
    assert np.array_equal(read_labels(reader, labels.size, columns, count), labels)
    reader.finish()


def test_a_map_of_few_patches_takes_few_bits() -> None:
    """Two halves of 20 × 20: a label per row at the border would be 20 times more than one."""
    labels = np.repeat(np.arange(20) >= 10, 20).astype(np.uint8)
    across, along = BitWriter(), BitWriter()
    write_labels(across, labels, 20, 2)
    write_labels(along, labels.reshape(20, 20).T.ravel(), 20, 2)
    assert max(len(across.bits), len(along.bits)) < 40


@settings(max_examples=60, deadline=None)
@given(
    columns=st.integers(1, 20), rows=st.integers(1, 20), actuators=st.integers(1, 16),
    count=st.integers(1, 9), coarse=st.integers(0, 13), seed=st.integers(0, 999),
)  # fmt: skip
def test_drives_survive_their_bits(
    columns: int, rows: int, actuators: int, count: int, coarse: int, seed: int
) -> None:
    labels = drawn_labels(columns, rows, count, seed)
    rng = np.random.default_rng(seed)
    iq = rng.integers(-23000, 23001, (labels.size, actuators, 2))
    iq = (np.sign(iq) * (np.abs(iq) >> coarse << coarse)).astype(np.int16)
    writer = BitWriter()
    write_drives(writer, labels, columns, iq, coarse)
    reader = BitReader(writer.to_bytes())
    assert np.array_equal(read_drives(reader, labels, columns, actuators, coarse), iq)
    reader.finish()


@pytest.mark.parametrize("columns", [9, 17, 33])
def test_a_linear_table_takes_a_bit_a_region(columns: int) -> None:
    """Means foretell what is linear: the size follows the detail, not the number of regions."""
    x, y = np.meshgrid(np.arange(columns), np.arange(columns))
    # Multiples of the coarsest step, so that every mean is a whole number.
    step = 16 * (32 // (columns - 1))
    iq = np.stack((x * step, y * step), axis=-1).reshape(-1, 1, 2).astype(np.int16)
    labels = np.zeros(columns**2, dtype=np.uint8)
    writer = BitWriter()
    write_drives(writer, labels, columns, iq, 9)
    inside = (columns - 2) ** 2
    edge = 4 * (columns - 1)
    # Inside, one bit each; at the edges three neighbours have a mean that is off by a third of h.
    assert len(writer.bits) < inside + 30 * edge
    predicted = [visit for visit in visits(columns, columns) if len(visit.neighbours) == 4]
    assert len(predicted) >= inside - (columns // 16) ** 2


@settings(max_examples=100, deadline=None)
@given(
    residual=st.lists(st.integers(-65534, 65534), min_size=2, max_size=10).filter(
        lambda values: len(values) % 2 == 0
    ),
    shift=st.integers(0, 14), rice=st.tuples(st.integers(0, 15), st.integers(0, 15)),
)  # fmt: skip
def test_the_bits_foretold_are_those_written_and_the_fewest(
    residual: list[int], shift: int, rice: tuple[int, int]
) -> None:
    """Against writing the numbers out with every pair of parameters that hold them."""
    rates = Rates(shift, rice)
    values = np.array(residual)
    bits, best = rates.best(values)

    def written(own: Rates) -> int | None:
        if np.any(values % (1 << own.shift)):
            return None
        writer = BitWriter()
        writer.number(1, 1)
        writer.signed(own.shift - shift)
        for new, old in zip(own.rice, rice, strict=True):
            writer.signed(new - old)
        for place, value in enumerate((values >> own.shift).tolist()):
            code, k = 2 * value if value >= 0 else -2 * value - 1, own.rice[place % 2]
            if code >> k > MAX_UNARY:
                return None
            writer.unary(code >> k)
            writer.number(code & ((1 << k) - 1), k)
        return len(writer.bits)

    if not values.any():
        assert bits == 1
        return
    assert written(best) == bits
    near = [
        written(Rates(best.shift + ds, (best.rice[0] + di, best.rice[1] + dq)))
        for ds in (-1, 0, 1) for di in (-1, 0, 1) for dq in (-1, 0, 1)
        if 0 <= best.shift + ds <= 14 and 0 <= best.rice[0] + di <= 15
        and 0 <= best.rice[1] + dq <= 15
    ]  # fmt: skip
    assert bits <= min(cost for cost in near if cost is not None)


@pytest.mark.parametrize(
    ("bits", "expected"),
    [
        ([1] * 60, "ones in a row"),
        ([0] * 3, "as long as its drives"),
        ([1] + [1] * 39 + [0] + [0] * 40, "from 0 to"),
    ],
)
def test_a_stream_that_cannot_be_is_refused(bits: list[int], expected: str) -> None:
    reader = BitReader(BitWriter(bits).to_bytes())
    labels = np.zeros(40, dtype=np.uint8)
    with pytest.raises(ValueError, match=expected):
        read_drives(reader, labels, 5, 3, 5)


def test_what_is_left_over_is_refused() -> None:
    for left in ([0] * 8, [0, 1]):
        reader = BitReader(BitWriter([0] * 8 + left).to_bytes())
        reader.number(8 if len(left) == 8 else 4)
        with pytest.raises(ValueError, match="zeros after the last"):
            reader.finish()
