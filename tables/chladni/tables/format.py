"""Read and write a drive table: headers, and a record per stored region, as layout.py has them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from chladni.drives.problem.region_grid import RegionGrid
from chladni.sim.errors import InputError
from chladni.sim.files import read_whole
from chladni.tables.layout import (
    CRC_BYTES,
    DRIVES_MINOR,
    FULL_SCALE,
    HEADER_BYTES,
    HEADER_FIELDS,
    HEADER_STRUCT,
    LARGEST_FILE,
    MAGIC,
    OBJECTIVE_NAMES,
    SECTION_BYTES,
    SECTION_FIELDS,
    SECTION_STRUCT,
    SMALLEST_FILE,
    VERSION_MAJOR,
    VERSION_MINOR,
    Field,
    Refuse,
    as_bytes,
    as_integers,
    check_header,
    check_section,
    is_loud,
    is_responses,
    record_bytes,
    stored_region_count,
)
from chladni.tables.mirror_symmetry import (
    MirrorSymmetry,
    Order,
    crossing_codes,
    crossings_of,
    order_of,
)
from chladni.tables.responses import (
    check_responses,
    header_values,
    pack_responses,
    responses_bytes,
    unpack_responses,
)
from chladni.tables.table import Limits, ResponsesSection, Section, Table

OF_BANKS = b"CHLE"  # begins an effect bank (effects/bank/layout.py)
VERDICTS = ("kBadSize", "kBadField", "kBadDrives")
"""That a section may come to."""


class TableRefusedError(InputError):
    """Bytes that are no table this version reads.

    Attributes
    ----------
    verdict
        The firmware's answer to the same bytes: the name of its `TableStatus`.
    """

    def __init__(
        self, verdict: str, field: str, value: object, expected: str, *, file: str | None = None
    ) -> None:
        self.verdict = verdict
        super().__init__(field, value, expected, file=file)


def pack(table: Table) -> bytes:
    """The bytes of a table file.

    Raises
    ------
    InputError
        More actuators, bytes or millimetres than a device holds, or drives of another shape.
    """
    check_fits(table)
    head = _header_values(table)
    body = HEADER_STRUCT.pack(*(head[field.name] for field in HEADER_FIELDS))
    for section in table.sections:
        _check_section(table, section)
        body += _section_header(_section_values(section))
        body += crossing_codes(section.crossings).tobytes()
        gains = as_bytes(section.iq.astype(np.int64) >> (16 - table.bits), table.bits)
        records = np.concatenate((section.labels[:, None], gains), axis=1)
        body += records.astype(np.uint8).tobytes()
    for known in table.responses:
        check_responses(known, table.regions.count, table.actuators, table.bits)
        body += _section_header(header_values(known)) + pack_responses(known, table.bits)
    return body + struct.pack("<I", zlib.crc32(body))


def check_fits(table: Table) -> None:
    """Raise `InputError` unless the format and a device's slot can hold a table like this.

    Only sizes and limits are looked at, so it can be asked before any drive is solved.
    """

    def refuse(field: str, value: object, expected: str) -> InputError:
        return InputError(f"table.{field}", value, expected)

    head = _header_values(table)
    check_header(head, refuse)
    for known in table.responses:
        check_section(header_values(known), refuse, may_be_responses=True)
    for section in table.sections:
        values = _section_values(section)
        check_section(values, refuse, may_be_responses=False)
        if abs(values["full_scale"] / 1000.0 - section.full_scale_gain) > 1e-9:
            expected = "whole thousandths, from 0.001"
            raise InputError("drive.max_gain", section.full_scale_gain, expected)
    if head["total_bytes"] > LARGEST_FILE:
        expected = f"at most {LARGEST_FILE}, a device's slot: a larger regions.pitch_mm"
        raise refuse("bytes", head["total_bytes"], expected)


def table_bytes(table: Table) -> int:
    """Bytes of a table, by its numbers of labels, regions and actuators alone."""
    cells, actuators, bits = table.regions.count, table.actuators, table.bits
    records = cells * record_bytes(actuators, bits)
    drives = sum(SECTION_BYTES + len(section.crossings) + records for section in table.sections)
    known = SECTION_BYTES + responses_bytes(cells, actuators, bits)
    return HEADER_BYTES + drives + len(table.responses) * known + CRC_BYTES


def _section_header(values: dict[str, Any]) -> bytes:
    return SECTION_STRUCT.pack(*(values[field.name] for field in SECTION_FIELDS))


def _check_section(table: Table, section: Section) -> None:
    cells = table.regions.count
    shapes = (section.labels.shape, section.iq.shape)
    if shapes != ((cells,), (cells, table.actuators, 2)):
        raise InputError("table.iq", shapes, f"labels and drives of {cells} stored regions")
    if np.any(section.iq & ((1 << (16 - table.bits)) - 1)):
        expected = f"integers of {table.bits} bits, in steps of {1 << (16 - table.bits)}"
        raise InputError("table.iq", "finer steps", expected)
    if is_loud(section.iq):
        raise InputError("table.iq", "a gain beyond full scale", f"at most {FULL_SCALE}")


def _header_values(table: Table) -> dict[str, Any]:
    return {
        "magic": MAGIC,
        "version_major": VERSION_MAJOR,
        "version_minor": VERSION_MINOR if table.responses else DRIVES_MINOR,
        "sections": len(table.sections) + len(table.responses),
        "actuators": table.actuators,
        "total_bytes": table_bytes(table),
        "bits": table.bits,
        "mirrors": table.symmetry.flags,
        "reserved": 0,
        "board_fingerprint": table.board_fingerprint,
        "board_name": table.board_name.encode("ascii"),
        **vars(table.grid),
        **vars(table.limits),
        "mirror_x": table.symmetry.nibbles(0),
        "mirror_y": table.symmetry.nibbles(1),
    }


def _section_values(section: Section) -> dict[str, Any]:
    return {
        "frequency_millihertz": round(section.frequency_hz * 1000.0),
        "full_scale": round(section.full_scale_gain * 1000.0),
        "objective": OBJECTIVE_NAMES.index(section.objective),
        "labels": len(section.crossings),
        "reserved": 0,
    }


def unpack(data: bytes, *, file: str | None = None) -> Table:
    """The table in the bytes of a file.

    Raises
    ------
    TableRefusedError
        Truncated, wrong magic, version or CRC, or fields that contradict each other.
    """
    head = _read_header(data, file)
    symmetry = _symmetry(head, _refusing("kBadField", file))
    at = HEADER_BYTES
    sections: list[Section] = []
    responses: list[ResponsesSection] = []
    for number in range(head["sections"]):
        section, at = _read_section(data, at, head, number, bool(responses), file)
        if isinstance(section, Section):
            sections.append(section)
        else:
            responses.append(section)
    if at != len(data) - CRC_BYTES:
        expected = f"{len(data) - CRC_BYTES}, where the CRC begins"
        raise _refusing("kBadSize", file)("end of the sections", at, expected)
    return Table(
        board_name=head["board_name"].rstrip(b"\0").decode("ascii"),
        board_fingerprint=head["board_fingerprint"],
        grid=RegionGrid(head["columns"], head["rows"], head["width_um"], head["length_um"]),
        limits=Limits(head["ramp_us"], head["touch_timeout_us"], head["max_on_us"]),
        sections=tuple(sections),
        bits=head["bits"],
        symmetry=symmetry,
        responses=tuple(responses),
    )


def _refusing(verdict: str, file: str | None) -> Refuse:
    """Errors of one verdict, to be raised."""

    def refuse(field: str, value: object, expected: str) -> InputError:
        return TableRefusedError(verdict, field, value, expected, file=file)

    return refuse


def _named(
    fields: tuple[Field, ...], layout: struct.Struct, data: bytes, at: int
) -> dict[str, Any]:
    return dict(zip((f.name for f in fields), layout.unpack_from(data, at), strict=True))


def _read_header(data: bytes, file: str | None) -> dict[str, Any]:
    """The file header, once all bytes are known to be whole."""
    if len(data) < HEADER_BYTES:
        expected = f"at least {HEADER_BYTES}: truncated"
        raise _refusing("kReadFailed", file)("size", f"{len(data)} bytes", expected)
    head = _named(HEADER_FIELDS, HEADER_STRUCT, data, 0)
    if data[:HEADER_BYTES] == b"\xff" * HEADER_BYTES:
        raise _refusing("kNone", file)("magic", "blank flash", f"{MAGIC!r}, a Chladni table")
    if head["magic"] != MAGIC:
        what = "text: a board file?" if data[:HEADER_BYTES].isascii() else head["magic"]
        if data[:4] == OF_BANKS:
            what = "an effect bank (`chladni effects flash`)"
        raise _refusing("kBadMagic", file)("magic", what, f"{MAGIC!r}, a Chladni table")
    version = head["version_major"], head["version_minor"]
    if version not in ((VERSION_MAJOR, DRIVES_MINOR), (VERSION_MAJOR, VERSION_MINOR)):
        remedy = "build the table again with `chladni table build`"
        if version > (VERSION_MAJOR, VERSION_MINOR):
            remedy = "update Chladni, which is older than the table"
        expected = f"{VERSION_MAJOR}.{DRIVES_MINOR} or {VERSION_MAJOR}.{VERSION_MINOR}: {remedy}"
        raise _refusing("kBadVersion", file)("version", "{}.{}".format(*version), expected)
    total = head["total_bytes"]
    expected = f"{len(data)}, the size of the file, from {SMALLEST_FILE} to {LARGEST_FILE}"
    if not SMALLEST_FILE <= total <= min(len(data), LARGEST_FILE):
        raise _refusing("kBadSize", file)("total_bytes", total, expected)
    stored = struct.unpack_from("<I", data, total - CRC_BYTES)[0]
    computed = zlib.crc32(data[: total - CRC_BYTES])
    if stored != computed:
        raise _refusing("kBadCrc", file)(
            "crc", f"{stored:#010x}", f"{computed:#010x}: the bytes are damaged"
        )
    if total != len(data):
        raise _refusing("kBadSize", file)("total_bytes", total, expected)
    check_header(head, _refusing("kBadField", file))
    return head


def _read_section(
    data: bytes, at: int, head: dict[str, Any], number: int, after_responses: bool, file: str | None
) -> tuple[Section | ResponsesSection, int]:
    """The section that begins at a byte, and where the next one would."""
    bits, actuators, cells = head["bits"], head["actuators"], stored_region_count(head)
    end, refuse = len(data) - CRC_BYTES, {name: _refusing(name, file) for name in VERDICTS}
    left, name = end - at, f"section {number}"
    if left < SECTION_BYTES:
        raise refuse["kBadSize"](name, f"{left} bytes", f"at least {SECTION_BYTES}")
    values = _named(SECTION_FIELDS, SECTION_STRUCT, data, at)
    is_new = head["version_minor"] != DRIVES_MINOR
    check_section(values, refuse["kBadField"], may_be_responses=is_new)
    begin, are_responses = at + SECTION_BYTES, is_responses(values)
    if after_responses and not are_responses:
        raise refuse["kBadField"](f"{name} objective", "drives", "drives before responses")
    size = responses_bytes(cells, actuators, bits)
    if not are_responses:
        size = values["labels"] + cells * record_bytes(actuators, bits)
    after = begin + size
    if after > end:
        raise refuse["kBadSize"](name, f"{left} bytes", f"{after - at}: {cells} regions")
    if are_responses:
        return unpack_responses(data[begin:after], values, head, cells, name, refuse), after
    return _read_drives(data[begin:after], values, head, cells, name, refuse["kBadDrives"]), after


def _read_drives(
    data: bytes, values: dict[str, Any], head: dict[str, Any], cells: int, name: str, refuse: Refuse
) -> Section:
    """The drives in the bytes behind a section's header, whose fields are `values`."""
    labels, bits = values["labels"], head["bits"]
    try:
        crossings = crossings_of(np.frombuffer(data[:labels], np.uint8))
    except ValueError:
        raise refuse(f"{name} crossings", data[:labels].hex(), "cut, joined or negated") from None
    records = np.frombuffer(data[labels:], np.uint8).reshape(cells, -1)
    if np.any(records[:, 0] >= labels):
        raise refuse(f"{name} label", int(records[:, 0].max()), f"below {labels}")
    iq = as_integers(records[:, 1:], head["actuators"], bits) << (16 - bits)
    if is_loud(iq):
        raise refuse(f"{name} gains", "one beyond full scale", f"at most {FULL_SCALE}")
    return Section(
        frequency_hz=values["frequency_millihertz"] / 1000.0,
        objective=OBJECTIVE_NAMES[values["objective"]],
        full_scale_gain=values["full_scale"] / 1000.0,
        labels=records[:, 0].copy(),
        crossings=crossings,
        iq=iq.astype(np.int16),
    )


def _symmetry(head: dict[str, Any], refuse: Refuse) -> MirrorSymmetry:
    """The mirrors of a header, each an order of the actuators that undoes itself."""
    count = head["actuators"]
    orders: list[Order | None] = []
    for bit, name in enumerate(("mirror_x", "mirror_y")):
        is_stored = bool(head["mirrors"] >> bit & 1)
        if is_stored:
            try:
                orders.append(order_of(head[name], count))
            except ValueError as error:
                expected = "an order of the actuators that undoes itself"
                raise refuse(name, str(error), expected) from None
            continue
        if head[name]:
            raise refuse(name, hex(head[name]), "0 without that mirror")
        orders.append(None)
    return MirrorSymmetry(orders[0], orders[1])


def read_table(path: str | Path) -> Table:
    """Read a table file; `InputError` names file and field."""
    return unpack(read_table_bytes(path), file=str(path))


def read_table_bytes(path: str | Path) -> bytes:
    """The bytes of a table file, not looked at yet; no more than a device's slot holds.

    Raises
    ------
    InputError
        Not readable, or longer.
    """
    return read_whole(Path(path), "table", LARGEST_FILE, "a table: a regular file")
