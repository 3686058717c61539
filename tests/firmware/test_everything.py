"""Hosts, fingers, cuts, rot, resets and dying interrupts on one device, against rules alone.

The model knows nothing of the firmware. It sees pins and answers, and holds four rules: outputs are
off within a stated time after everyone has gone; duty and true heat stay within their limits; while
one table is whole a table plays; the link answers.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest

from chladni.host.device.device import Device
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import EmulatedPort, UdpWire
from chladni.host.device.wires.wire import EmulatorWire, WireError
from chladni.host.emulation.emulator import Emulator, Hardware, TouchEvent
from chladni.host.protocol.config import DeviceConfig, pack_config
from chladni.host.protocol.network import NetworkSettings
from chladni.host.protocol.slot_store import SLOT_BYTES
from chladni.sim.errors import ChladniError
from chladni.tables.format import pack
from made_up import MAX_ON_MS, RAMP_MS, TIMEOUT_MS, device_of, make_table
from soaking import seed, tries
from thermal import Coils

LIMIT_K, MAX_DUTY = 60.0, 0.8
OFF_MS = MAX_ON_MS + TIMEOUT_MS + RAMP_MS + 50.0
"""The longest touch, silence, the ramp, and a report of the panel."""
KEY = bytes(range(1, 33))
TABLES = [pack(make_table(np.array([[gain, 10.0, 2.0, 3.0, 4.0]]))) for gain in (10.0, 5.0, 7.0)]
CAUSES = ("software", "watchdog", "panic", "brown-out", "power on")


def hot_config() -> DeviceConfig:
    return device_of().with_values(
        full_rise_dk=(2500,) * 5 + (0,) * 11,
        limit_rise_dk=round(LIMIT_K * 10),
        heating_ds=20,
        max_duty_q15=round(MAX_DUTY * 32768),
    )


class World:
    """One device, whatever comes to it, and the rules."""

    def __init__(self, number: int) -> None:
        self.random = random.Random(number)
        self.config = hot_config()
        self.emulator = Emulator(
            self.config,
            TABLES[0],
            level=1.0,
            must_play=False,
            hardware=Hardware(is_rested=False, seed=number % 1000 + 1),
            network=NetworkSettings("lab", "a passphrase", KEY),
        )
        self.coils = Coils(self.config)
        self.coils.rise_k[:] = LIMIT_K
        self.events: Counter[str] = Counter()
        self.on_s = 0.0

    def run(self, milliseconds: float) -> None:
        """Let time pass, and look at every duty."""
        recording = self.emulator.run(milliseconds)
        if len(recording.duty_steps):
            assert recording.duty.max() <= MAX_DUTY + 1.0 / 1024.0
            self.on_s += float(recording.duty_steps.any(axis=1).mean()) * milliseconds / 1e3
            self.coils.take(recording)
            assert self.coils.most_k <= LIMIT_K + 1e-6

    @property
    def now_ms(self) -> float:
        return self.emulator.core.now_us / 1e3

    def host(self) -> Device | None:
        """By wire or by network, if the device lets one in."""
        try:
            if self.random.random() < 0.5:
                return Device(EmulatorWire(self.emulator))
            return Device(UdpWire(EmulatedPort(self.emulator, self.random.randrange(4)), KEY))
        except (LinkError, WireError):
            return None

    def finger(self) -> None:
        """Comes, moves perhaps, and stays for a while or for long."""
        for _ in range(self.random.randrange(1, 4)):
            place = self.random.uniform(-30.0, 30.0), self.random.uniform(-70.0, 70.0)
            self.emulator.touch(TouchEvent(self.now_ms + 0.5, place))
            self.run(self.random.choice([5.0, 60.0, 300.0, 900.0]))

    def lift(self) -> None:
        self.emulator.touch(TouchEvent(self.now_ms + 0.5, None))
        self.run(self.random.choice([1.0, 40.0, 400.0]))

    def ask(self, work: Callable[[Device], object]) -> None:
        """A host that may be refused, and dies afterwards."""
        device = self.host()
        if device is None:
            return
        try:
            work(device)
        except ChladniError:
            self.events["refused"] += 1

    def host_touch(self) -> None:
        self.ask(lambda device: device.touch(0.0, 0.0))

    def host_live(self) -> None:
        gains = [complex(self.random.random()) for _ in range(5)]

        def work(device: Device) -> None:
            for _ in range(self.random.randrange(1, 8)):
                device.live(gains, 160.0, self.random.choice(["sine", "square"]))
                self.run(40.0)

        self.ask(work)

    def host_stream(self) -> None:
        duties = np.full((self.random.randrange(50, 3_000), 5), self.random.choice([0.3, 1.0]))
        self.ask(lambda device: device.stream(duties))

    def flash(self) -> None:
        self.ask(lambda device: device.flash(self.random.choice(TABLES), force=True))

    def cut_flash(self) -> None:
        """The power fails in the middle of an update, or of a new configuration."""
        area = self.random.choice(["tables", "config"])
        self.emulator.core.cut_power_after(self.random.randrange(0, 9_000), area)
        if area == "tables":
            self.flash()
        else:
            self.configure()
        self.emulator.core.restore_power()
        self.emulator.core.boot(self.random.choice(["brown-out", "power on"]))

    def previous(self) -> None:
        self.ask(lambda device: device.previous())

    def configure(self) -> None:
        """Anything that leaves the limits as they are."""
        level = self.random.randrange(10_000, 32_767)
        self.ask(lambda device: device.set_config(device.config().with_values(level_q15=level)))

    def rot(self) -> None:
        """A bit of one table flips, while another one is whole."""
        core = self.emulator.core
        whole = self.whole_slots()
        if len(whole) < 2:
            return
        at = self.random.choice(whole) * SLOT_BYTES + self.random.randrange(len(TABLES[0]))
        value = core.flash_bytes()[at]
        core.program(at, bytes([value & (value - 1)]) if value else b"\0")

    def rot_config(self) -> None:
        """A bit of the configuration flips; somebody sets it again by wire."""
        core = self.emulator.core
        at = self.random.randrange(2) * 4096 + self.random.randrange(200)
        value = core.flash_bytes("config")[at]
        core.program(at, bytes([value & (value - 1)]) if value else b"\0", "config")
        core.boot(self.random.choice(["brown-out", "power on"]))
        self.run(20.0)
        core.save_config(pack_config(self.config))
        core.boot("power on")

    def reset(self) -> None:
        self.emulator.core.restart(self.random.choice(CAUSES))

    def hang(self) -> None:
        core = self.emulator.core
        core.hang_main_loop(True)
        self.run(self.random.uniform(5.0, 500.0))
        core.hang_main_loop(False)

    def kill_interrupt(self) -> None:
        core = self.emulator.core
        core.kill_interrupt(True)
        self.run(self.random.uniform(1.0, 50.0))
        core.kill_interrupt(False)
        self.run(self.random.choice([0.0, 20.0]))
        core.restart("watchdog")

    def panel(self) -> None:
        faults = self.emulator.core.panel_faults
        name = self.random.choice(["is_absent", "is_wedged", "is_silent", "loses_calls"])
        setattr(faults, name, True)
        self.run(self.random.uniform(5.0, 400.0))
        setattr(faults, name, False)

    def noise(self) -> None:
        """Bytes that mean nothing, on the wire and on the network."""
        core = self.emulator.core
        for _ in range(self.random.randrange(1, 30)):
            core.uart_write(self.random.randbytes(self.random.randrange(1, 60)))
            core.udp_write(self.random.randbytes(self.random.randrange(1, 120)), 9)
            self.run(1.0)

    def rest(self) -> None:
        self.run(self.random.choice([100.0, 2_000.0]))

    def whole_slots(self) -> list[int]:
        flash = self.emulator.core.flash_bytes()
        return [k for k in (0, 1) if any(flash[k * SLOT_BYTES :].startswith(t) for t in TABLES)]

    def step(self) -> None:
        """One thing after another."""
        # After most of what a test can do comes a finger, or the next thing at once.
        action = self.random.choice(ACTIONS)
        self.events[action.__name__] += 1
        action(self)
        self.run(self.random.choice([0.0, 1.0, 30.0]))

    def check(self) -> None:
        """Everyone goes, and then the rules must hold."""
        core = self.emulator.core
        core.finger_up(core.now_us + 500)
        self.run(OFF_MS)
        recording = self.emulator.run(50.0)
        assert not recording.duty_steps.any()
        self.coils.take(recording)
        info = Device(EmulatorWire(self.emulator)).info()
        if self.whole_slots():
            # What has only just rotted is found within a minute, or at the next start.
            core.restart("software")
            self.run(5.0)
            info = Device(EmulatorWire(self.emulator)).info()
            assert info["table_status"] == "ok", info
        assert info["config_status"] == "ok", info
        # A start that lasts, so that not every finger comes after a row of short ones.
        self.run(10_200.0)


ACTIONS = [
    World.finger, World.finger, World.finger, World.lift, World.lift, World.host_touch,
    World.host_live, World.host_stream, World.flash, World.flash, World.cut_flash, World.previous,
    World.configure, World.rot, World.rot_config, World.reset, World.hang, World.kill_interrupt,
    World.panel, World.noise, World.rest,
]  # fmt: skip


@pytest.mark.sweep
@pytest.mark.parametrize("number", range(tries(5, 40)))
def test_everything_at_once_leaves_the_rules_standing(number: int) -> None:
    world = World(seed(900 + number))
    for _ in range(tries(6, 20)):
        for _ in range(12):
            world.step()
        world.check()
    print(f"{sum(world.events.values())} events, {world.on_s:.1f} s on: {dict(world.events)}")
    assert world.on_s > 0.1
