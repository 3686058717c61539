"""Read and write a drive table: headers as layout.py declares them, streams as coding.py does."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from chladni.sim.errors import InputError
from chladni.tables.coding import (
    FULL_SCALE,
    BitReader,
    BitWriter,
    read_drives,
    read_labels,
    write_drives,
    write_labels,
)
from chladni.tables.folding import Folding, Order
from chladni.tables.layout import (
    CRC_BYTES,
    CROSSING_BITS,
    HEADER_BYTES,
    HEADER_FIELDS,
    HEADER_STRUCT,
    LARGEST_FILE,
    MAGIC,
    OBJECTIVE_NAMES,
    SECTION_BYTES,
    SECTION_FIELDS,
    SECTION_STRUCT,
    VERSION_MAJOR,
    VERSION_MINOR,
    Field,
    Refuse,
    check_header,
    check_section,
)
from chladni.tables.lookup import CUT, JOINED, NEGATED
from chladni.tables.regions import RegionGrid
from chladni.tables.table import Limits, Section, Table


def pack(table: Table) -> bytes:
    """The bytes of a table file.

    Raises
    ------
    InputError
        More actuators, regions or millimetres than the format holds, or drives of another shape.
    """
    check_fits(table)
    first = HEADER_BYTES + len(table.sections) * SECTION_BYTES
    streams = [_stream(table, section) for section in table.sections]
    head = _header_values(table)
    head["total_bytes"] = first + sum(len(stream) for stream in streams) + CRC_BYTES
    body = HEADER_STRUCT.pack(*(head[field.name] for field in HEADER_FIELDS))
    offset = first
    for section, stream in zip(table.sections, streams, strict=True):
        values = _section_values(section) | {"offset": offset, "bytes": len(stream)}
        body += SECTION_STRUCT.pack(*(values[field.name] for field in SECTION_FIELDS))
        offset += len(stream)
    body += b"".join(streams)
    return body + struct.pack("<I", zlib.crc32(body))


def _stream(table: Table, section: Section) -> bytes:
    columns, rows = table.folding.shape(table.grid)
    shapes = (section.labels.shape, section.iq.shape)
    cells = columns * rows
    if shapes != ((cells,), (cells, table.actuators, 2)):
        raise InputError("table.iq", shapes, f"labels and drives of {cells} stored regions")
    if np.any((section.iq.astype(np.int64) ** 2).sum(axis=-1) > FULL_SCALE**2):
        raise InputError("table.iq", "a gain beyond full scale", f"at most {FULL_SCALE}")
    writer = BitWriter()
    for crossing in section.crossings.ravel().tolist():
        writer.number(crossing, CROSSING_BITS)
    write_labels(writer, section.labels, columns, len(section.crossings))
    write_drives(writer, section.labels, columns, section.iq, section.start_shift)
    return writer.to_bytes()


def check_fits(table: Table) -> None:
    """Raise `InputError` unless the format and the device can hold a table like this.

    Only sizes and limits are looked at, so it can be asked before any drive is solved.
    """

    def refuse(field: str, value: object, expected: str) -> InputError:
        return InputError(f"table.{field}", value, expected)

    check_header(_header_values(table), refuse)
    for section in table.sections:
        values = _section_values(section)
        check_section(values, refuse)
        if abs(values["full_scale_gain_milli"] / 1000.0 - section.full_scale_gain) > 1e-9:
            expected = "whole thousandths, from 0.001"
            raise InputError("drive.max_gain", section.full_scale_gain, expected)


def _header_values(table: Table) -> dict[str, Any]:
    return {
        "magic": MAGIC,
        "version_major": VERSION_MAJOR,
        "version_minor": VERSION_MINOR,
        "header_bytes": HEADER_BYTES,
        "sections": len(table.sections),
        "section_bytes": SECTION_BYTES,
        "actuators": table.actuators,
        "mirrors": table.folding.flags,
        "board_fingerprint": table.board_fingerprint,
        "board_name": table.board_name.encode("ascii"),
        **vars(table.grid),
        **vars(table.limits),
        "mirror_x": table.folding.nibbles(0),
        "mirror_y": table.folding.nibbles(1),
    }


def _section_values(section: Section) -> dict[str, Any]:
    return {
        "frequency_mhz": round(section.frequency_hz * 1000.0),
        "full_scale_gain_milli": round(section.full_scale_gain * 1000.0),
        "objective": OBJECTIVE_NAMES.index(section.objective),
        "labels": len(section.crossings),
        "start_shift": section.start_shift,
        "reserved": 0,
    }


def unpack(data: bytes, *, file: str | None = None) -> Table:
    """The table in the bytes of a file.

    Raises
    ------
    InputError
        Truncated, wrong magic, version or CRC, or fields that contradict each other.
    """

    def refuse(field: str, value: object, expected: str) -> InputError:
        return InputError(field, value, expected, file=file)

    head = _read_header(data, refuse)
    grid = RegionGrid(head["columns"], head["rows"], head["width_um"], head["length_um"])
    folding = _folding(head, refuse)
    sections = []
    for number in range(head["sections"]):
        at = head["header_bytes"] + number * head["section_bytes"]
        values = _named(SECTION_FIELDS, SECTION_STRUCT, data, at)
        begin, end = values["offset"], values["offset"] + values["bytes"]
        first = head["header_bytes"] + head["sections"] * head["section_bytes"]
        if begin < first or end > len(data) - CRC_BYTES:
            expected = f"a stream within bytes {first} to {len(data) - CRC_BYTES}"
            raise refuse(f"section {number} offset", f"{begin} + {values['bytes']}", expected)
        check_section(values, refuse)
        try:
            section = _read_section(data[begin:end], values, folding.shape(grid), head["actuators"])
        except ValueError as error:
            raise refuse(f"section {number}", "damaged drives", str(error)) from None
        sections.append(section)
    return Table(
        board_name=head["board_name"].rstrip(b"\0").decode("ascii"),
        board_fingerprint=head["board_fingerprint"],
        grid=grid,
        limits=Limits(head["ramp_us"], head["touch_timeout_us"], head["max_on_us"]),
        sections=tuple(sections),
        folding=folding,
    )


def _named(
    fields: tuple[Field, ...], layout: struct.Struct, data: bytes, at: int
) -> dict[str, Any]:
    return dict(zip((f.name for f in fields), layout.unpack_from(data, at), strict=True))


def _read_header(data: bytes, refuse: Refuse) -> dict[str, Any]:
    """The file header, once all bytes are known to be whole."""
    least = HEADER_BYTES + SECTION_BYTES + CRC_BYTES
    if len(data) < least:
        raise refuse("size", f"{len(data)} bytes", f"at least {least}: truncated")
    head = _named(HEADER_FIELDS, HEADER_STRUCT, data, 0)
    if head["magic"] != MAGIC:
        raise refuse("magic", head["magic"], f"{MAGIC!r}, a Chladni table")
    if head["version_major"] != VERSION_MAJOR:
        version = f"{head['version_major']}.{head['version_minor']}"
        raise refuse("version", version, f"{VERSION_MAJOR}.x")
    if head["total_bytes"] != len(data):
        raise refuse("total_bytes", head["total_bytes"], f"{len(data)}, the size of the file")
    stored = struct.unpack_from("<I", data, len(data) - CRC_BYTES)[0]
    computed = zlib.crc32(data[:-CRC_BYTES])
    if stored != computed:
        raise refuse("crc", f"{stored:#010x}", f"{computed:#010x}: the bytes are damaged")
    for name, low in (("header_bytes", HEADER_BYTES), ("section_bytes", SECTION_BYTES)):
        if head[name] < low or (head["version_minor"] == VERSION_MINOR and head[name] != low):
            raise refuse(name, head[name], f"{low}, or more in a later version")
    check_header(head, refuse)
    payload = head["header_bytes"] + head["sections"] * head["section_bytes"]
    if payload > len(data) - CRC_BYTES:
        raise refuse("sections", head["sections"], f"headers that fit into {len(data)} bytes")
    return head


def _read_section(
    data: bytes, values: dict[str, Any], shape: tuple[int, int], actuators: int
) -> Section:
    columns, rows = shape
    reader = BitReader(data)
    crossings = np.zeros((values["labels"], 2), dtype=np.uint8)
    for label in range(values["labels"]):
        for axis in range(2):
            crossings[label, axis] = reader.number(CROSSING_BITS)
    if np.any(crossings > NEGATED):
        raise ValueError(f"crossings {CUT}, {JOINED} or {NEGATED}")
    labels = read_labels(reader, columns * rows, columns, values["labels"])
    iq = read_drives(reader, labels, columns, actuators, values["start_shift"])
    reader.finish()
    return Section(
        frequency_hz=values["frequency_mhz"] / 1000.0,
        objective=OBJECTIVE_NAMES[values["objective"]],
        full_scale_gain=values["full_scale_gain_milli"] / 1000.0,
        labels=labels,
        crossings=crossings,
        iq=iq,
    )


def _folding(head: dict[str, Any], refuse: Refuse) -> Folding:
    """The mirrors of a header, each an order of the actuators that undoes itself."""
    count = head["actuators"]
    orders: list[Order | None] = []
    for bit, name in enumerate(("mirror_x", "mirror_y")):
        nibbles = tuple((head[name] >> (4 * k)) & 15 for k in range(count))
        is_stored = bool(head["mirrors"] >> bit & 1)
        if is_stored and (
            sorted(nibbles) != list(range(count))
            or any(nibbles[nibbles[k]] != k for k in range(count))
            or head[name] >> (4 * count)
        ):
            raise refuse(name, hex(head[name]), "an order of the actuators that undoes itself")
        if not is_stored and head[name]:
            raise refuse(name, hex(head[name]), "0 without that mirror")
        orders.append(nibbles if is_stored else None)
    return Folding(orders[0], orders[1])


def read_table(path: str | Path) -> Table:
    """Read a table file; `InputError` names file and field."""
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise InputError("TABLE", "no regular file", "a table file", file=str(path))
        with Path(path).open("rb") as file:
            data = file.read(LARGEST_FILE)
    except OSError as error:
        raise InputError("TABLE", error.strerror, "a readable file", file=str(path)) from None
    return unpack(data, file=str(path))
