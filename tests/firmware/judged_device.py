"""A device under test for heat and supply current, and who judges it by its pins alone.

What judges sees the pins and the coils on them, and shares nothing with the firmware.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from chladni.host.device.device import Device
from chladni.host.device.wires.udp import EmulatedPort, UdpWire
from chladni.host.device.wires.wire import EmulatorWire
from chladni.host.emulation.emulator import Emulator, Hardware, Recording, TouchEvent
from chladni.host.protocol.config import DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.tables.table import Limits, Table
from made_up import LIMITS, device_of, make_table
from thermal import SUPPLY_WINDOW_S, means_of

FULL_K, HEATING_S, FULL_MA = 1000.0, 8.0, 333.0
"""Of every coil at a duty of 1."""
LIMIT_K, SUPPLY_MA = 60.0, 500
PINS = (2, 4, 13, 14, 16)
BRIDGES = {
    "driver": 1,
    "lost_ns": 40,
    "sign_pins": (17, 18, 19, 23, 25, *(NOT_WIRED,) * 11),
}
KEY = bytes(range(1, 33))
PATIENT = Limits(LIMITS.ramp_us, LIMITS.touch_timeout_us, 10_000_000)
"""Touches may last."""


class Judge:
    """The coil on every pin and the supply that they share."""

    def __init__(self, rise_k: float = 0.0) -> None:
        self.rise_k = defaultdict(lambda: rise_k, dict.fromkeys(PINS, rise_k))
        self.over_k = self.most_k = self.most_ma = self.over_ma = 0.0
        self.on_s = 0.0
        self.is_on = False
        """Now."""
        self.sees_supply = True
        """Not across a restart: what came before was under other limits."""
        self._before = np.zeros(0)

    def take(self, recording: Recording, config: DeviceConfig) -> None:
        """What the pins did. Beyond a limit that was lowered a coil gets nothing, and may be so."""
        squares = recording.duty**2
        if not len(squares):
            return
        self.is_on = bool(squares[-1].any())
        count = len(squares)
        limit_k, full_k = config["limit_rise_dk"] / 10.0, config["full_rise_dk"][0] / 10.0
        decay = np.exp(-10.0 / (recording.carrier_hz * config["heating_ds"]))
        growth = decay ** np.arange(1.0, count + 1.0)
        for channel, pin in enumerate(config["pwm_pins"][: squares.shape[1]]):
            heated = full_k * (1.0 - decay) * np.cumsum(squares[:, channel] / growth)
            path = growth * (self.rise_k[pin] + heated)
            if heated[-1] > 0.0:
                hottest = float(path[squares[:, channel] > 0.0].max())
                self.over_k = max(self.over_k, hottest - limit_k)
                self.most_k = max(self.most_k, float(path.max()))
            self.rise_k[pin] = float(path[-1])
        for pin in set(self.rise_k) - set(config["pwm_pins"][: squares.shape[1]]):
            self.rise_k[pin] *= float(growth[-1])
        self.on_s += float(squares.any(axis=1).sum()) / recording.carrier_hz
        current = np.concatenate((self._before, FULL_MA * squares.sum(axis=1)))
        window = round(SUPPLY_WINDOW_S * recording.carrier_hz)
        if len(current) > window and self.sees_supply:
            most = float(means_of(current, recording.carrier_hz).max())
            self.most_ma = max(self.most_ma, most)
            self.over_ma = max(self.over_ma, most - config["supply_ma"] * 1.05)
        self._before = current[-window + 1 :] if self.sees_supply else np.zeros(0)


def hot_board(**settings: object) -> DeviceConfig:
    return device_of().with_values(
        **{
            "pwm_pins": (*PINS, *(NOT_WIRED,) * 11),
            "full_rise_dk": (round(FULL_K * 10),) * 5 + (0,) * 11,
            "full_current_ma": (round(FULL_MA),) * 5 + (0,) * 11,
            "limit_rise_dk": round(LIMIT_K * 10),
            "heating_ds": round(HEATING_S * 10),
            "supply_ma": SUPPLY_MA,
            "panel": 1,
            **settings,
        }
    )


def loud_table(limits: Limits = PATIENT) -> Table:
    return replace(make_table(np.array([[10.0, 10.0, 5.0, 1.0, 0.0]])), limits=limits)


class JudgedDevice:
    """A device, both of its hosts, and the judge. `config` is in force, `next_config` written."""

    def __init__(
        self,
        config: DeviceConfig | None = None,
        table: Table | None = None,
        *,
        is_rested: bool = True,
    ) -> None:
        self.is_rested = is_rested
        self.config = self.next_config = config or hot_board()
        self.emulator = Emulator(
            self.config,
            table or loud_table(),
            level=1.0,
            must_play=False,
            hardware=Hardware(is_rested=is_rested),
            network=NetworkSettings("lab", "a passphrase", KEY),
        )
        self.core = self.emulator.core
        self.judge = Judge(0.0 if is_rested else LIMIT_K)

    def run(self, milliseconds: float) -> None:
        self.judge.take(self.emulator.run(milliseconds), self.config)

    def touch(self, is_down: bool = True) -> None:
        place = (0.0, 0.0) if is_down else None
        self.emulator.touch(TouchEvent(self.core.now_us / 1e3 + 0.1, place))

    def restart(self, cause: str) -> None:
        """What was written comes into force."""
        self.run(0.1)
        self.core.restart(cause)
        self.config = self.next_config
        self.judge.sees_supply = False
        self.run(0.1)
        self.judge.sees_supply = True

    def host(self, is_near: bool) -> Device:
        wire = EmulatorWire(self.emulator) if is_near else UdpWire(EmulatedPort(self.emulator), KEY)
        return Device(wire)

    def configure(self, **settings: object) -> None:
        """And a restart. Over the link it would be too often: five, and one each minute."""
        self.core.stream_end()
        self.touch(is_down=False)
        self.run(100.0)  # it is counted that nothing plays any more
        wanted = self.config.with_values(**settings)
        assert self.core.save_config(pack_config(wanted)) == "ok"
        self.next_config = wanted
        self.restart("software")

    def heat(self, milliseconds: float, pin: int = 0) -> None:
        """All coils or one, as far as the device lets a host."""
        pins = self.config["pwm_pins"][: self.config["channels"]]
        for _ in range(round(milliseconds / 40.0)):
            self.live([float(pin in (0, own)) for own in pins], 160.0, "square")
            self.run(40.0)

    def assert_kept(self) -> None:
        assert self.judge.over_k <= 2.0, f"{self.judge.most_k:.1f} K"
        assert self.judge.over_ma <= 0.0, f"{self.judge.most_ma:.0f} mA"

    def push(self, duty: float, frames: int) -> int:
        """Of a bridge's duties every second frame is negative."""
        shape = frames, self.config["channels"]
        if not self.config.has_bridges:
            return self.core.stream_push(np.full(shape, duty * 65535, np.uint16))
        words = np.full(shape, duty * 32767, np.int16)
        words[1::2] *= -1
        return self.core.stream_push(words.view(np.uint16))

    def live(self, amplitudes: list[float], frequency_hz: float, waveform: str) -> bool:
        gains = [(round(32767 * amplitude), 0) for amplitude in amplitudes]
        return self.core.play_live(gains, round(1e3 * frequency_hz), WAVEFORMS.index(waveform))
