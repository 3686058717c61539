"""Drives as a stream of bits, coarse regions first and the rest as what they differ from those.

Regions are visited in levels: every 16th both ways, then the ones half-way, and so on. Each is
predicted as the mean of the neighbours visited before that carry its label (same branch, so the
mean means something), and what is left is stored in Rice codes: nothing but a zero bit where the
prediction does. So the size follows the detail of the drives, not the number of regions.

`docs/table-format.md` has the stream bit by bit; `core/table_stream.cpp` decodes it on the device.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

IntArray = NDArray[np.int64]
LabelArray = NDArray[np.uint8]

FULL_SCALE = 32767
"""The integer that stands for the largest gain."""
COARSEST = 16
"""Regions between those of the first level, or the power of two that a smaller board needs."""
MAX_SHIFT, MAX_RICE = 14, 15
MAX_UNARY = 40
"""Ones in a row that a reader takes for damage."""
START_RICE = 3
TOO_MANY = 1 << 20
"""Bits of what no reader takes."""
SHARES = (0, 65536, 32768, 21845, 16384)
"""65536 / n: the device has no division to spare."""


@dataclass(frozen=True)
class Visit:
    """One region, and the regions visited before whose mean predicts it."""

    at: int
    neighbours: tuple[int, ...]


def passes(columns: int, rows: int) -> Iterator[list[Visit]]:
    """All stored regions in the order of the stream; none of a pass predicts another of it."""
    step = 1
    while step < COARSEST and step < max(columns, rows):
        step *= 2

    def visit(i: int, j: int, *places: tuple[int, int]) -> Visit:
        inside = [(a, b) for a, b in places if 0 <= a < columns and 0 <= b < rows]
        return Visit(j * columns + i, tuple(b * columns + a for a, b in inside))

    for j in range(0, rows, step):
        for i in range(0, columns, step):
            yield [visit(i, j, (i - step, j), (i, j - step))]
    while step > 1:
        h = step // 2
        yield [
            visit(i, j, (i - h, j - h), (i + h, j - h), (i - h, j + h), (i + h, j + h))
            for j in range(h, rows, step)
            for i in range(h, columns, step)
        ]
        yield [
            visit(i, j, (i, j - h), (i - h, j), (i + h, j), (i, j + h))
            for j in range(0, rows, h)
            for i in range(h if j % step == 0 else 0, columns, step)
        ]
        step = h


def visits(columns: int, rows: int) -> Iterator[Visit]:
    """All stored regions in the order of the stream."""
    for together in passes(columns, rows):
        yield from together


class Predictor:
    """What a region is expected to be, from those that were before."""

    def __init__(self, labels: LabelArray, width: int) -> None:
        self._labels = labels
        self._latest: dict[int, int] = {}
        self.values = np.zeros((labels.size, width), dtype=np.int64)

    def has_neighbours(self, visit: Visit) -> bool:
        """Whether neighbours visited before tell what to expect."""
        return any(self._labels[k] == self._labels[visit.at] for k in visit.neighbours)

    def predict(self, visit: Visit) -> IntArray:
        """The mean of its neighbours of the same label, the latest of that label, or silence."""
        label = int(self._labels[visit.at])
        same = [k for k in visit.neighbours if self._labels[k] == label]
        if not same and label in self._latest:
            same = [self._latest[label]]
        if not same:
            return np.zeros_like(self.values[0])
        total = self.values[same].sum(axis=0)
        return np.asarray((total * SHARES[len(same)] + 32768) >> 16)

    def put(self, visit: Visit, values: IntArray) -> None:
        """The region's values are known now."""
        self.values[visit.at] = values
        self._latest[int(self._labels[visit.at])] = visit.at


@dataclass(frozen=True)
class Rates:
    """Parameters of the Rice codes, which carry over from region to region."""

    shift: int
    rice: tuple[int, int] = (START_RICE, START_RICE)

    def bits(self, residuals: IntArray, shift: int | IntArray) -> tuple[IntArray, IntArray]:
        """Bits that residuals take, and the Rice parameters that make them so few.

        Parameters
        ----------
        residuals
            Shape (many, 2 · actuators), in-phase and quadrature alternating, in steps of 2^shift.
        shift
            One for all, or each its own.

        Returns
        -------
        (IntArray, IntArray)
            Shapes (many,) and (many, 2).
        """
        codes = zigzag(residuals).reshape(len(residuals), -1, 2)
        # Of three codes and more each further k takes more than getting there could save.
        most = int(codes.max(initial=0)).bit_length() if codes.shape[1] > 2 else MAX_RICE
        k = np.arange(min(most, MAX_RICE) + 1)
        ones = codes[..., None] >> k
        bits = (ones + 1 + k).sum(axis=1)
        bits += unary_bits(k[None] - np.array(self.rice)[:, None])
        bits = np.where(ones.max(axis=1) > MAX_UNARY, TOO_MANY, bits)
        rice = bits.argmin(axis=-1)
        total = 1 + unary_bits(np.asarray(shift) - self.shift) + bits.min(axis=-1).sum(axis=-1)
        return np.where(residuals.any(axis=1), total, 1), rice

    def best(self, residual: IntArray) -> tuple[int, Rates]:
        """The fewest bits for one residual, in steps of 1, and the parameters that they take."""
        if not residual.any():
            return 1, self
        used = int(np.bitwise_or.reduce(np.abs(residual)))
        shifts = np.arange(min(MAX_SHIFT, (used & -used).bit_length() - 1) + 1)
        bits, rice = self.bits(residual >> shifts[:, None], shifts)
        best = int(bits.argmin())
        return int(bits[best]), Rates(best, (int(rice[best, 0]), int(rice[best, 1])))


def unary_bits(signed: IntArray) -> IntArray:
    """Bits of small signed numbers in unary."""
    return zigzag(signed) + 1


def zigzag(signed: IntArray) -> IntArray:
    """Write 0, −1, 1, −2, 2 … as 0, 1, 2, 3, 4 and so on."""
    return np.asarray(np.where(signed < 0, -2 * signed - 1, 2 * signed))


@dataclass
class BitWriter:
    """Bits, the least significant of a byte first."""

    bits: list[int] = field(default_factory=list)

    def number(self, value: int, width: int) -> None:
        """`width` bits, the least significant first."""
        self.bits += [value >> k & 1 for k in range(width)]

    def unary(self, value: int) -> None:
        """So many ones, and a zero."""
        self.bits += [1] * value + [0]

    def signed(self, value: int) -> None:
        """A small signed number in unary."""
        self.unary(int(zigzag(np.array(value))))

    def to_bytes(self) -> bytes:
        """Zeros fill up the last byte."""
        return np.packbits(np.array(self.bits, dtype=np.uint8), bitorder="little").tobytes()


class BitReader:
    """The way back.

    Raises
    ------
    ValueError
        From every method: past the end, or more ones in a row than a stream has.
    """

    def __init__(self, data: bytes) -> None:
        self._bits = np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little").tolist()
        self._at = 0

    def number(self, width: int) -> int:
        """`width` bits."""
        if self._at + width > len(self._bits):
            raise ValueError("a stream as long as its drives")
        chosen = self._bits[self._at : self._at + width]
        self._at += width
        return sum(bit << k for k, bit in enumerate(chosen))

    def unary(self) -> int:
        """Ones before a zero."""
        value = 0
        while self.number(1):
            value += 1
            if value > MAX_UNARY:
                raise ValueError(f"at most {MAX_UNARY} ones in a row")
        return value

    def signed(self, start: int, largest: int) -> int:
        """A number from 0 to `largest`, told by its step from `start`."""
        step = self.unary()
        value = start + (-(step + 1) // 2 if step & 1 else step // 2)
        if not 0 <= value <= largest:
            raise ValueError(f"code parameters from 0 to {largest}")
        return value

    def finish(self) -> None:
        """Nothing but the zeros that fill up the last byte may be left."""
        left = self._bits[self._at :]
        if len(left) > 7 or any(left):
            raise ValueError("less than a byte of zeros after the last drive")


def write_labels(writer: BitWriter, labels: LabelArray, columns: int, count: int) -> None:
    """The map of labels: how many are as expected, then one that is not, and so on."""
    width = (count - 1).bit_length()
    run = 0
    for at, label in enumerate(labels.tolist()):
        if label == expected_label(labels, at, columns):
            run += 1
            continue
        _write_run(writer, run)
        writer.number(label, width)
        run = 0
    _write_run(writer, run)


def read_labels(reader: BitReader, cells: int, columns: int, count: int) -> LabelArray:
    """The way back, shape (cells,).

    Raises
    ------
    ValueError
        A run past the end, or a label that is not below `count`.
    """
    labels = np.zeros(cells, dtype=np.uint8)
    width = (count - 1).bit_length()
    at = 0
    while True:
        run = _read_run(reader)
        if run > cells - at:
            raise ValueError("a map of labels as large as the board")
        for _ in range(run):
            labels[at] = expected_label(labels, at, columns)
            at += 1
        if at == cells:
            return labels
        label = reader.number(width)
        if label >= count:
            raise ValueError(f"labels below {count}")
        labels[at] = label
        at += 1


def expected_label(labels: LabelArray, at: int, columns: int) -> int:
    """The label above; where the one left of that is the same, the label to the left."""
    column = at % columns
    if at < columns:
        return int(labels[at - 1]) if column else 0
    above = int(labels[at - columns])
    if column == 0:
        return above
    left, corner = int(labels[at - 1]), int(labels[at - columns - 1])
    return left if corner == above else above


def _write_run(writer: BitWriter, run: int) -> None:
    """Exponential Golomb code: how many bits run + 1 has in unary, then all but its top one."""
    length = (run + 1).bit_length() - 1
    writer.unary(length)
    writer.number(run + 1 - (1 << length), length)


def _read_run(reader: BitReader) -> int:
    length = reader.unary()
    if length > 16:
        raise ValueError("runs of at most 65535 labels")
    return (1 << length) + reader.number(length) - 1


def write_drives(
    writer: BitWriter, labels: LabelArray, columns: int, iq: NDArray[np.int16], shift: int
) -> None:
    """All drives, iq of shape (cells, actuators, 2)."""
    flat = np.asarray(iq, dtype=np.int64).reshape(labels.size, -1)
    predictor, rates = Predictor(labels, flat.shape[1]), Rates(shift)
    for visit in visits(columns, labels.size // columns):
        residual = flat[visit.at] - predictor.predict(visit)
        predictor.put(visit, flat[visit.at])
        _, chosen = rates.best(residual)
        writer.number(int(residual.any()), 1)
        if not residual.any():
            continue
        writer.signed(chosen.shift - rates.shift)
        for k, before in zip(chosen.rice, rates.rice, strict=True):
            writer.signed(k - before)
        for place, value in enumerate(zigzag(residual >> chosen.shift).tolist()):
            k = chosen.rice[place % 2]
            writer.unary(value >> k)
            writer.number(value & ((1 << k) - 1), k)
        rates = chosen


def read_drives(
    reader: BitReader, labels: LabelArray, columns: int, actuators: int, shift: int
) -> NDArray[np.int16]:
    """The way back, int16 of shape (cells, actuators, 2).

    Raises
    ------
    ValueError
        Code parameters out of range, or a gain beyond full scale.
    """
    predictor, rates = Predictor(labels, 2 * actuators), Rates(shift)
    for visit in visits(columns, labels.size // columns):
        values = predictor.predict(visit)
        if reader.number(1):
            shift = reader.signed(rates.shift, MAX_SHIFT)
            rice = [reader.signed(k, MAX_RICE) for k in rates.rice]
            rates = Rates(shift, (rice[0], rice[1]))
            for place in range(2 * actuators):
                k = rice[place % 2]
                code = (reader.unary() << k) + reader.number(k)
                if code >> (18 - shift):
                    raise ValueError("differences within twice the full scale")
                values[place] += (-((code + 1) // 2) if code & 1 else code // 2) << shift
        if np.any((values.reshape(-1, 2) ** 2).sum(axis=1) > FULL_SCALE**2):
            raise ValueError("gains within full scale")
        predictor.put(visit, values)
    return predictor.values.reshape(labels.size, actuators, 2).astype(np.int16)
