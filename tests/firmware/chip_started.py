"""A chip that has started, with a table, a configuration and a network, and one that plays."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.protocol.config import PANELS, DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings, pack_network
from chladni.sim.board.gpio import CHIPS
from chladni.tables.format import pack
from firmware.chip_process import RESET_PIN, Chip
from made_up import make_table

TABLE = pack(make_table(np.array([[10.0, -5.0j, 1.0 + 1.0j, 4.0, 2.0]])))
NETWORK = pack_network(NetworkSettings("net", "12345678", bytes(range(32)), 5555))
UNTIL_NETWORK = 1100
"""Turns of a millisecond: the network begins a second after the wire."""
PINS = (4, 5, 12, 14, 16)
CONFIG = DeviceConfig(
    pwm_pins=(*PINS, *(255,) * 11),
    panel=PANELS.index("ft6x36"),
    sda_pin=15,
    scl_pin=17,
    interrupt_pin=2,
    reset_pin=RESET_PIN,
)
"""That each chip can have."""
on_each_chip = pytest.mark.parametrize("chip_program", CHIPS, indirect=True)


@contextmanager
def started(
    program: Path,
    *,
    fail: str = "",
    config: DeviceConfig = CONFIG,
    options: tuple[str, ...] = (),
    network: bytes = NETWORK,
    tables: bytes = TABLE,
    boots: bytes = b"",
    effects: bytes = b"",
    turns: int = UNTIL_NETWORK,
) -> Iterator[Chip]:
    chip = Chip(
        program,
        fail=fail,
        options=options,
        tables=tables,
        config=pack_config(config),
        network=network,
        boots=boots,
        effects=effects,
    )
    try:
        chip.run(turns)
        yield chip
    finally:
        chip.close()


def playing(chip: Chip, device: Device) -> None:
    device.touch(0.0, 0.0)
    chip.run(30)
    assert chip.on == set(PINS)
