"""The guided first boot, against an emulated device and a person's answers."""

from __future__ import annotations

import io

import pytest

from conftest import CommandLine


def test_it_goes_through_every_step_and_says_what_was_found(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n" * 20))
    done = chladni("device", "self-test", "--first-boot", "--emulator", "--json")
    assert done.code == 0, done.err
    steps = done.json["steps"]
    assert len(steps) == 5 + 5
    assert all(step["ok"] for step in steps)
    assert "state fault; no table" in done.err
    assert "GPIO 2, 4, 15, 16, 17" in done.err
    assert done.err.count("played for 1 s") == 6


def test_a_walk_along_bridges_asks_for_both_pins(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n" * 9 + "n\n"))
    there = ("--emulator", "--board", "strip5")
    stopped = chladni("device", "self-test", "--first-boot", *there)
    assert "GPIO 2, 4, 15, 16, 17; signs GPIO 18, 19, 23, 25, 26" in stopped.err
    assert stopped.err.count("and its phase pin turn with it?") == 5
    assert "no motion: the coil or its bridge" in stopped.err
    assert "diode" not in stopped.err


def test_it_stops_at_the_first_thing_that_is_not_so(
    chladni: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("y\nn\n"))
    stopped = chladni("device", "self-test", "--first-boot", "--emulator")
    assert stopped.code == 1
    assert "step 2, Gates at rest; fit a pull-down" in stopped.err
