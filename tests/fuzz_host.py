"""Any bytes at the host's parsers: frames, tables, configurations (atheris).

Run by tools/fuzz.py; what escapes is a bug, InputError is not.
"""

from __future__ import annotations

import contextlib
import sys

import atheris

with atheris.instrument_imports(include=["chladni.host.link", "chladni.host.datagrams",
                                         "chladni.host.device_config",
                                         "chladni.tables"]):  # fmt: skip
    from chladni.host.datagrams import seal, unseal
    from chladni.host.device_config import unpack_config
    from chladni.host.link import FrameSplitter, _answer
    from chladni.host.network_format import Kind
    from chladni.sim.errors import InputError
    from chladni.tables.format import unpack
    from made_up import with_crc

KEY = bytes(range(32))


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
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()
