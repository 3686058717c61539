"""What keeps a device from playing is named in the same words by every command."""

from __future__ import annotations

import numpy as np
import pytest

from chladni.host.device.checks.readiness import (
    HOST_CLEARS,
    OF_THE_TABLE,
    WARNINGS,
    check_ready,
    obstacle,
)
from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator
from chladni.host.protocol.codes import FAULT_CAUSE
from conftest import CommandLine
from made_up import device_of, make_table


@pytest.mark.parametrize(
    ("standing", "by_host", "hint"),
    [
        (["never configured", "no table"], False, "config set --from BOARD, then chladni flash"),
        (["never configured"], True, "config set --from BOARD"),
        (["no table"], False, "chladni flash T.chl"),
        (["coil hot"], True, "some seconds after power came on"),
        (["interrupt stopped"], True, "`chladni device info` shows its faults"),
    ],
)
def test_an_obstacle_is_named_with_what_to_do(
    standing: list[str], by_host: bool, hint: str
) -> None:
    found = obstacle({"standing": standing}, by_host=by_host)
    assert found is not None
    assert found.text == f"the device plays nothing: {', '.join(standing)}"
    assert hint in found.hint
    with pytest.raises(LinkError, match=standing[0]):
        check_ready({"standing": standing}, by_host=by_host)


@pytest.mark.parametrize(
    ("standing", "by_host"),
    [
        ([], False),
        (["older table", "network held back"], False),
        (["brown-out", "short starts in a row"], False),
        (["no table", "table refused"], True),
    ],
)
def test_what_a_host_may_play_through_is_no_obstacle(standing: list[str], by_host: bool) -> None:
    assert obstacle({"standing": standing}, by_host=by_host) is None


def test_what_is_forgiven_are_faults_that_a_device_declares() -> None:
    declared = {code.text for code in FAULT_CAUSE.members}
    assert declared >= HOST_CLEARS | OF_THE_TABLE | WARNINGS


@pytest.mark.parametrize("cause", ["brown-out", "power on"])
def test_a_host_plays_after_what_it_is_trusted_with(cause: str) -> None:
    """As `obstacle` promises: the device takes a host's touch for someone who sees to it."""
    table = make_table(np.array([[10.0, 1.0, 2.0, 3.0, 4.0]]))
    emulator = Emulator(device_of(table), table)
    for _ in range(4):
        emulator.core.restart(cause)
    with Device(EmulatorWire(emulator)) as device:
        assert device.info()["state"] == "fault"
        check_ready(device.info())
        device.touch(0.0, 0.0)
        assert emulator.run(60.0).duty_steps[-1].any()


def test_commands_name_it_alike(chladni: CommandLine) -> None:
    touched = chladni("device", "touch", "0,0", "--emulator")
    assert touched.code == 1
    assert "the device plays nothing: no table; give it one by --table" in touched.err


def test_a_place_off_an_emulated_board_is_named_before_a_missing_table(
    chladni: CommandLine,
) -> None:
    there = ("--emulator", "--board", "strip5")
    refused = chladni("device", "touch", "0,0", "60,0", *there)
    assert "X,Y: expected a place on the board in mm: |x| up to 7" in refused.err
    assert "no table" in chladni("device", "touch", "0,0", *there).err
