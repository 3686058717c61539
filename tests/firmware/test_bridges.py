"""Coils driven both ways: signed duties without a bias, by magnitude and sign pins."""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.link import Answer, LinkError
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation._emulator import Pwm, full_span_steps
from chladni.host.emulation.emulator import Emulator, EmulatorError, TouchEvent
from chladni.host.protocol.board_config import config_of
from chladni.host.protocol.config import (
    LEAST_RECORD_BYTES,
    SETTINGS,
    DeviceConfig,
    pack_config,
    unpack_config,
)
from chladni.host.protocol.link import BY_NAME
from chladni.sim.board.board import Board
from chladni.sim.board.electronics import NOT_WIRED, ChipName
from chladni.sim.board.file import load_board
from chladni.sim.coil.bridge import BridgeCircuit
from chladni.sim.coil.circuit import circuit_of
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import InputError
from chladni.tables.table import Limits
from conftest import shipped_board
from firmware.judged_device import BRIDGES, PINS, JudgedDevice, hot_board, loud_table
from made_up import make_table
from wired_boards import SWITCHED

LOST_STEPS = 3
"""40 ns in steps of 12.5."""
COOL = {"limit_rise_dk": 3000, "full_rise_dk": (10,) * 5 + (0,) * 11}


def bridged(**settings: object) -> DeviceConfig:
    return hot_board(**{**COOL, "supply_ma": 20_000, **BRIDGES, **settings})


def harmonics(current: np.ndarray, carrier_hz: float) -> np.ndarray:
    """Amplitudes at 0 to 4 times 160 Hz of whole waves of a coil's current."""
    turns = np.arange(len(current)) * 160.0 / carrier_hz
    waves = np.exp(-2j * np.pi * np.outer(np.arange(5), turns))
    found = np.abs(waves @ current) / len(current)
    return np.concatenate((found[:1], 2.0 * found[1:]))


def settled_waves(bench: JudgedDevice, amplitude: float) -> np.ndarray:
    """Steps of the first pin in 16 waves at 160 Hz that have played for a while."""
    gains = [amplitude, 0.0, 0.0, 0.0, 0.0]
    for _ in range(3):
        bench.live(gains, 160.0, "sine")
        bench.run(20.0)
    steps = []
    for _ in range(5):
        bench.live(gains, 160.0, "sine")
        steps.append(bench.emulator.run(20.0).duty_steps[:, 0])
    return np.concatenate(steps)[:7812]


def test_a_wave_has_no_bias_and_the_whole_range() -> None:
    duties = settled_waves(JudgedDevice(bridged()), 1.0)
    found = harmonics(duties - LOST_STEPS * np.sign(duties), 78_125.0)
    assert found[0] < 0.5  # of 1024 steps
    assert found[1] == pytest.approx(full_span_steps(10, LOST_STEPS), rel=2e-3)
    assert duties.max() <= 1023
    assert duties.min() >= -1023


@pytest.mark.parametrize("lost_ns", [40.0, 100.0])
def test_what_a_pulse_loses_bends_no_soft_wave(lost_ns: float) -> None:
    """A tenth of full scale. Not given back, 40 ns leave a third harmonic of -37 dB."""
    circuit = BridgeCircuit(ohm=10.0, supply_v=5.0, lost_s=lost_ns * 1e-9, carrier_hz=78_125.0)
    made, bent = (
        harmonics(circuit.mean_current(settled_waves(bench, 0.1) / 1024.0), 78_125.0)
        for bench in (
            JudgedDevice(bridged(lost_ns=round(lost_ns))),
            JudgedDevice(bridged(lost_ns=0)),
        )
    )
    assert 20.0 * np.log10(made[2:4] / made[1]).max() < -50.0
    assert 20.0 * np.log10(bent[3] / bent[1]) > -40.0


def played_full(board: Board) -> tuple[float, float]:
    """Amplitude of the loudest coil's current, A, and its rise in a second by the meter, K."""
    emulator = Emulator(config_of(board), make_table(np.ones((1, 5))))
    before = emulator.core.coil_rise_k[3]
    duties = []
    for _ in range(40):
        gains = [(3277, 0), (-9830, 0), (0, 16384), (32767, 0), (-13107, 0)]
        emulator.core.play_live(gains, 160_000, WAVEFORMS.index("sine"))
        duties.append(emulator.run(25.0).duty_steps[:, 3])
    assert emulator.core.state == "streaming"
    circuit = circuit_of(board)
    assert circuit is not None
    current = circuit.mean_current(np.concatenate(duties)[-39_062:] / 1024.0)  # 80 waves
    return float(harmonics(current, 78_125.0)[1]), emulator.core.coil_rise_k[3] - before


@pytest.mark.parametrize("name", ["strip5", "quiet5"])
def test_by_the_same_heat_of_the_meter_a_bridge_gives_half_as_much_again(name: str) -> None:
    """Force goes with the current: at least 4.5 dB more µm, as a device plays all that it may."""
    switched, bridged_ = load_board(SWITCHED / f"{name}.toml"), shipped_board(name)
    (least, cool), (most, warm) = played_full(switched), played_full(bridged_)
    assert 20.0 * np.log10(most / least) - 10.0 * np.log10(warm / cool) > 4.5


@pytest.mark.parametrize("lost_ns", [40.0, 70.0, 126.0])
def test_what_a_pulse_loses_is_measured_as_the_page_says(lost_ns: float) -> None:
    """docs/hardware.md: steady duties that 10 bits can say, while the device gives nothing back."""
    circuit = BridgeCircuit(ohm=10.36, supply_v=5.0, lost_s=lost_ns * 1e-9, carrier_hz=78_125.0)
    currents = []
    for duty in (0.125, 0.25):
        bench = JudgedDevice(bridged(lost_ns=0, link_baud=921_600))
        bench.core.take_duties()
        bench.host(True).stream(np.full((1500, 5), duty))
        currents.append(circuit.mean_current(bench.core.take_duties()[-4000:, 0] / 1024.0).mean())
    first, second = currents
    lost = 0.125 - 0.125 * first / (second - first)
    assert 12_800.0 * lost == pytest.approx(lost_ns, abs=0.5)


@pytest.mark.parametrize("waveform", WAVEFORMS)
@pytest.mark.parametrize("frequency_hz", [20.0, 160.0, 1000.0])
def test_no_sign_changes_within_a_pulse(frequency_hz: float, waveform: str) -> None:
    """The emulator's pins would say so. Samples are late, and a host turns the wave."""
    bench = JudgedDevice(bridged(), loud_table(Limits(500, 100_000, 10_000_000)))
    drawn = np.random.default_rng(3)
    most = 0
    for _ in range(150):
        gains = [complex(g) for g in np.exp(1j * drawn.uniform(0.0, 6.28, 5))]
        pairs = [(round(32767 * g.real), round(32767 * g.imag)) for g in gains]
        bench.core.play_live(pairs, round(1e3 * frequency_hz), WAVEFORMS.index(waveform))
        bench.core.delay_next_sample(float(drawn.choice([0.0, 100.0, 430.0])))
        bench.core.drop_next_duties(int(drawn.integers(32)))
        most = min(most, int(bench.emulator.run(1.0 + drawn.uniform(0.0, 3.0)).duty_steps.min()))
    assert most < -600


def test_a_stream_of_signed_duties_is_played_as_it_is() -> None:
    bench = JudgedDevice(bridged(lost_ns=0, link_baud=921_600))
    device = bench.host(True)
    t = np.arange(1200) / device.config().frame_rate_hz
    wave = np.sin(2.0 * np.pi * 160.0 * t)
    duties = np.stack([wave, -wave, 0.5 * wave, np.sign(wave), 0.0 * wave], axis=1)
    device.stream(duties)
    played = bench.core.take_duties()[-4000:] / 1024.0
    assert np.corrcoef(played[:, 0], played[:, 1])[0, 1] < -0.999
    assert played[:, 0].max() == pytest.approx(1.0, abs=0.01)
    assert np.abs(played[:, 2]).max() == pytest.approx(0.5, abs=0.01)
    assert played[:, 3].min() < -0.9
    assert not played[:, 4].any()


@pytest.mark.parametrize("has_bridges", [False, True])
def test_a_stream_for_the_other_driver_is_refused_by_name(has_bridges: bool) -> None:
    bench = JudgedDevice(bridged() if has_bridges else hot_board())
    link = Device(EmulatorWire(bench.emulator)).link
    with pytest.raises(LinkError, match="switches do not suit bridges"):
        link.request("stream_begin", target=96, is_signed=int(not has_bridges))
    bench.run(20.0)
    assert bench.core.state == "idle"


def test_a_host_from_before_there_were_bridges_is_told_to_be_renewed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It leaves out whether duties are signed, and knows no status but those of its time."""
    now = BY_NAME["stream_begin"]
    monkeypatch.setitem(BY_NAME, "stream_begin", replace(now, request=now.request[:1]))
    link = Device(EmulatorWire(JudgedDevice(bridged()).emulator)).link
    with pytest.raises(LinkError, match="same version"):
        link.request("stream_begin", target=96)


@pytest.mark.parametrize(
    ("has_bridges", "duty"), [(False, -0.1), (False, 1.1), (True, -1.1), (True, np.nan)]
)
def test_duties_that_a_driver_cannot_give_are_named_and_not_sent(
    has_bridges: bool, duty: float
) -> None:
    bench = JudgedDevice(bridged() if has_bridges else hot_board())
    kind = "bridges" if has_bridges else "switches"
    duties = np.zeros((40, 5))
    duties[20, 3] = duty
    with pytest.raises(InputError, match=rf"duties: expected .* {kind}, got '{duty:g}'"):
        bench.host(True).stream(duties)
    with pytest.raises(LinkError, match="switches do not suit bridges"):
        bench.host(True).stream(np.full((40, 5), 0.3), is_signed=not has_bridges)
    assert not bench.core.take_duties().any()


@pytest.mark.parametrize("has_bridges", [False, True])
def test_drivers_change_by_wire_and_a_word_of_their_own(has_bridges: bool) -> None:
    bench = JudgedDevice(bridged() if has_bridges else hot_board())
    before, other = (bridged(), hot_board())[:: 1 if has_bridges else -1]
    device = bench.host(True)
    with pytest.raises(LinkError, match="drivers of another kind"):
        device.set_config(other)
    with pytest.raises(LinkError):
        bench.host(False).set_config(other, change_driver=True)
    if has_bridges:  # as hosts from before there were any write it
        with pytest.raises(LinkError, match="drivers of another kind"):
            device.link.request("config_set", of_version_2_0(other))
    bench.core.restart("software")
    assert bench.host(True).config()["driver"] == before["driver"]
    bench.host(True).set_config(other, change_driver=True)
    with pytest.raises(LinkError, match="drivers of another kind"):  # the word is for one
        bench.host(True).set_config(other)
    bench.core.restart("software")
    assert bench.host(True).config()["driver"] == other["driver"]


def test_the_word_for_other_drivers_is_for_one_request_of_one_program() -> None:
    bench = JudgedDevice(hot_board())
    device = bench.host(True)
    device.link.request("driver_change", driver=1)
    with pytest.raises(LinkError, match="drivers of another kind"):  # another program begins
        bench.host(True).set_config(bridged())
    device.link.request("driver_change", driver=1)
    with pytest.raises(LinkError, match="pins"):  # refused for what is wrong with it
        device.set_config(bridged(sign_pins=(34,) * 16))
    with pytest.raises(LinkError, match="drivers of another kind"):
        device.set_config(bridged())


def test_a_device_of_an_older_link_is_not_told_that_drivers_change(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    device = JudgedDevice(hot_board()).host(True)
    asked, request = [], device.link.request

    def noted(name: str, *tail: bytes, **fields: Any) -> Answer:
        asked.append(name)
        return request(name, *tail, **fields)

    monkeypatch.setitem(device.version.fields, "minor", 6)
    monkeypatch.setattr(device.link, "request", noted)
    with pytest.raises(LinkError):
        device.set_config(bridged(), change_driver=True)
    assert asked == ["config_set"]


@pytest.mark.parametrize("stop", ["lift", "dead", "late"])
def test_outputs_end_at_zero(stop: str) -> None:
    bench = JudgedDevice(bridged())
    for _ in range(4):
        bench.live([1.0] * 5, 160.0, "square")
        bench.run(10.3)
    if stop == "lift":
        bench.core.stream_end()
    elif stop == "dead":
        bench.core.kill_interrupt(True)
    else:
        bench.core.delay_next_sample(3_000.0)
    assert bench.emulator.run(1.0).duty_steps.any()
    bench.run(9.0)
    assert not bench.emulator.run(100.0).duty_steps.any()


def test_pins_are_strict_about_signs() -> None:
    pins = Pwm(channels=1, bits=10, has_signs=True)
    pins.write(period=0, duties=[-1023])
    with pytest.raises(RuntimeError, match="overflows"):
        pins.write(period=1, duties=[-1024])
    with pytest.raises(RuntimeError, match="negative duty of a switch"):
        Pwm(channels=1, bits=10).write(period=0, duties=[-1])


@pytest.mark.parametrize(
    ("signs", "channels"),
    [
        ((NOT_WIRED,) * 5, 5),
        ((17, 17, 19, 23, 25), 5),
        ((PINS[0], 18, 19, 23, 25), 5),
        ((34, 18, 19, 23, 25), 5),
        ((33, 18, 19, 23, 25), 5),
        ((17, 18, 19, 23, 25, 26, 27, 15, 12), 9),
    ],
)
def test_sign_pins_that_cannot_be_are_refused(signs: tuple[int, ...], channels: int) -> None:
    """By the host, and by a device that gets them all the same."""
    config = bridged(
        channels=channels,
        sign_pins=(*signs, *(NOT_WIRED,) * (16 - len(signs))),
        pwm_pins=(*PINS, 5, 32, 21, 22, *(NOT_WIRED,) * 7),
    )
    with pytest.raises(InputError):
        config.check_pins()
    bench = JudgedDevice()
    bench.core.save_config(pack_config(config))
    bench.core.restart("software")
    assert "pin" in bench.core.config_status


def of_version_2_0(config: DeviceConfig) -> bytes:
    """A record that ends before what a bridge added."""
    old = bytearray(pack_config(config, 7)[: LEAST_RECORD_BYTES - 4])
    old[5] = 0
    old[6:8] = LEAST_RECORD_BYTES.to_bytes(2, "little")
    return bytes(old) + zlib.crc32(old).to_bytes(4, "little")


def test_a_record_of_version_2_0_is_a_switch() -> None:
    whole = of_version_2_0(hot_board())
    config, sequence = unpack_config(whole)
    assert (config["driver"], sequence) == (0, 7)
    assert all(config[k.field.name] == hot_board()[k.field.name] for k in SETTINGS[:-6])
    assert [k.field.name for k in SETTINGS[-6:-3]] == ["driver", "lost_ns", "sign_pins"]
    bench = JudgedDevice()
    assert bench.core.save_config(whole) == "ok"
    bench.core.restart("software")
    assert bench.core.config_status == "ok"


@pytest.mark.parametrize("chip", ["esp32", "esp32s3"])
def test_a_study_without_pins_is_played_on_any_that_do(chip: ChipName) -> None:
    board = shipped_board("strip5")
    own = replace(board.electronics, pwm_pins=(), sign_pins=(), chip=chip)
    emulator = Emulator(replace(board, electronics=own), make_table(np.ones((1, 5))))
    emulator.touch(TouchEvent(5.0, (0.0, 0.0)))
    assert emulator.run(60.0).duty_steps.any()


def test_a_configuration_that_is_refused_is_said() -> None:
    with pytest.raises(EmulatorError, match="plays nothing: pins that the chip cannot use so"):
        Emulator(shipped_board("strip5"), make_table(np.ones((1, 5))), sign_pins=(34,) * 16)
