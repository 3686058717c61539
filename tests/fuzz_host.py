"""Any bytes at the host's parsers: frames, tables, configurations (atheris).

Run by tools/fuzz.py; what escapes is a bug, InputError is not.
"""

from __future__ import annotations

import contextlib
import inspect
import sys
from types import ModuleType

import atheris

from chladni.host.device.wires import link
from chladni.host.device.wires import udp as datagrams
from chladni.host.device.wires.link import FrameSplitter, _answer
from chladni.host.device.wires.udp import seal, unseal
from chladni.host.protocol import config as device_config
from chladni.host.protocol.config import unpack_config
from chladni.host.protocol.network import Kind
from chladni.sim.errors import InputError
from chladni.tables import format as table_format
from chladni.tables import layout
from chladni.tables import mirror_symmetry as symmetry
from chladni.tables import responses as table_responses
from chladni.tables.format import unpack
from made_up import with_crc

KEY = bytes(range(32))
PARSERS = (
    link,
    datagrams,
    device_config,
    symmetry,
    layout,
    table_format,
    table_responses,
)


def instrument(module: ModuleType) -> None:
    """Let the fuzzer see which branches of a module were taken.

    One by one, since an editable installation's imports pass atheris' own hook by.
    """
    kinds = [module, *(k for _, k in inspect.getmembers(module, inspect.isclass))]
    for kind in kinds:
        for _, function in inspect.getmembers(kind, inspect.isfunction):
            if function.__module__ == module.__name__:
                atheris.instrument_func(function)


def one_input(data: bytes) -> None:
    """Three parsers, the table also with its CRC made right."""
    if len(data) < 8:
        return
    splitter = FrameSplitter()
    half = len(data) // 2
    for part in (data[:half], data[half:], b"\0"):
        for body in splitter.feed(part):
            _answer(body)
    _answer(data)
    unseal(KEY, data)
    opened = unseal(KEY, seal(KEY, Kind.ANSWER, 1, 2, data))
    if opened is not None:
        _answer(opened.body)
    for parse in (unpack, unpack_config):
        for candidate in (data, with_crc(data)):
            with contextlib.suppress(InputError):
                parse(candidate)


if __name__ == "__main__":
    for parser in PARSERS:
        instrument(parser)
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
