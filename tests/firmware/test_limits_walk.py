"""No order of requests, touches, faults, hangs, restarts and configurations lifts a limit."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from chladni.host.device.device import Device
from chladni.host.emulation.emulator import TouchEvent
from chladni.host.protocol.config import pack_config
from chladni.sim.board.electronics import NOT_WIRED
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.sim.errors import ChladniError
from firmware.judged_device import BRIDGES, PATIENT, PINS, SUPPLY_MA, JudgedDevice, hot_board
from plate_of_bumps import responses_table
from soaking import seed

STEPS, FEW_STEPS = 20_000, 10_000
MILLIHERTZ = (0, 1_000, 20_000, 160_000, 249_000, 1_000_000)


class Walk(JudgedDevice):
    """One thing after another, most of them at bad moments.

    A third of the boards have bridges, and half of the tables responses: then five fingers play.
    """

    def __init__(self, number: int) -> None:
        super().__init__(
            hot_board(
                full_rise_dk=(4000,) * 5 + (0,) * 11,
                heating_ds=100,
                supply_ma=3000,
                **(BRIDGES if number % 4 in (1, 2) else {}),
            ),
            responses_table(limits=PATIENT) if number % 2 == 0 else None,
            is_rested=number % 2 == 0,
        )
        self.has_fingers = number % 2 == 0
        self.random = random.Random(number)
        self.hosts: dict[bool, Device] = {}
        self.is_hung = False
        self.crashes = 0

    def ask(self, work: Callable[[Device], object]) -> None:
        """Of either host. One that the device no longer knows begins again."""
        if self.is_hung:
            return
        is_near = self.random.random() < 0.6 or self.core.network_port == 0
        try:
            device = self.hosts.setdefault(is_near, self.host(is_near))
            work(device)
        except ChladniError:
            self.hosts.pop(is_near, None)

    def finger(self) -> None:
        """Where the table has responses, one of five comes, jumps or leaves."""
        if not self.has_fingers:
            self.touch(self.random.random() < 0.5)
            return
        drawn = self.random
        at_ms = self.core.now_us / 1e3 + 0.1
        place = drawn.uniform(-29.0, 29.0), drawn.uniform(-49.0, 49.0)
        is_down = drawn.random() < 0.6
        self.emulator.touch(TouchEvent(at_ms, place if is_down else None, drawn.randrange(5)))

    def voice(self) -> None:
        level = self.random.choice([0, 8000, 32767, 32767])
        self.core.set_voice(self.random.randrange(5), self.random.choice(MILLIHERTZ), level)

    def signal(self) -> None:
        """One that stands still, as no tone does: what a coil takes most heat from."""
        finger = self.random.randrange(5)
        if self.random.random() < 0.5:
            self.core.set_signal_voice(finger, self.random.choice([8000, 32767]))
        word = self.random.choice([-32767, 0, 12000, 32767])
        self.core.push_signal(finger, [word] * self.random.randrange(1, 128))

    def panel(self) -> None:
        faults = self.core.panel_faults
        faults.is_palm = self.random.random() < 0.3
        faults.is_silent = self.random.random() < 0.1

    def host_touch(self) -> None:
        self.ask(lambda device: device.touch(0.0, 0.0))

    def host_lift(self) -> None:
        self.ask(lambda device: device.lift())

    def wave(self) -> None:
        amplitudes = [self.random.choice([0.0, 0.5, 1.0]) for _ in range(self.config["channels"])]
        frequency_hz = self.random.choice([1.0, 8.0, 33.0, 160.0, 777.0])
        self.live(amplitudes, frequency_hz, self.random.choice(WAVEFORMS))

    def stream(self) -> None:
        if self.core.state != "streaming" or self.random.random() < 0.05:
            self.core.stream_begin()
        for _ in range(self.random.randrange(1, 3)):
            self.push(
                self.random.choice([0.0, 0.1, 0.3, 0.3, 0.6, 1.0]), self.random.randrange(1, 200)
            )

    def stop(self) -> None:
        self.core.stream_end()

    def hang(self) -> None:
        self.is_hung = not self.is_hung
        self.core.hang_main_loop(self.is_hung)

    def late(self) -> None:
        late_us = self.random.choice([60.0, 500.0, 4_500.0])
        self.core.delay_next_sample(late_us)
        if late_us > 1_000.0:
            self.run(10.0)

    def drop(self) -> None:
        self.core.drop_next_duties(self.random.randrange(32))

    def twice(self) -> None:
        self.run(5.0)  # no sample is late now
        self.core.repeat_next_sample()

    def dead(self) -> None:
        """For longer than a missed sample only where the main loop can cut the gates."""
        self.core.kill_interrupt(True)
        self.run(dead_ms := 0.5 if self.is_hung else self.random.choice([0.3, 2.0, 8.0]))
        self.core.kill_interrupt(False)
        self.run(2.0)
        if dead_ms > 5.0:
            self.reset()  # which alone gives the gates back

    def reset(self) -> None:
        """After more than three crashes a device starts nothing but its wire, and plays nothing."""
        causes = ["software", "brown-out", *([] if self.is_rested else ["power on"])]
        cause = self.random.choice([*causes, *(["watchdog", "panic"] if self.crashes < 3 else [])])
        self.crashes += cause in ("watchdog", "panic")
        self.is_hung = False
        self.restart(cause)

    def settings(self) -> None:
        """Limits and pins, and the start that puts them in force."""
        if self.is_hung:
            return
        drawn = self.random
        pins = drawn.sample(PINS, 5)
        wanted = self.next_config.with_values(
            limit_rise_dk=drawn.choice([300, 600, 600]),
            supply_ma=drawn.choice([120, SUPPLY_MA, 3000]),
            release_ms=drawn.choice([0, 0, 40, 200]),
            pwm_pins=(*pins, *(NOT_WIRED,) * 11),
        )
        self.stop()
        self.touch(is_down=False)
        self.run(10.0)
        if self.core.save_config(pack_config(wanted)) == "ok":
            self.next_config = wanted
            self.restart("software")

    def command(self) -> None:
        self.core.command(self.random.choice(["touch 0 0", "lift", "touch 9000 9000", "info"]))

    def rest(self) -> None:
        self.run(self.random.choice([20.0, 200.0]))

    def step(self) -> None:
        """One of them; a main loop that hangs takes no request."""
        action = self.random.choice(ACTIONS)
        if not (self.is_hung and action in REQUESTS):
            action(self)
        if self.is_hung and self.random.random() < 0.1:
            self.hang()
        self.run(self.random.choice([0.2, 1.0, 3.0]))


ACTIONS = [
    *[Walk.finger] * 8,
    Walk.voice,
    *[Walk.signal] * 4,
    Walk.panel,
    *[Walk.host_touch] * 3,
    Walk.host_lift,
    *[Walk.wave] * 8,
    *[Walk.stream] * 8,
    Walk.stop,
    Walk.hang,
    Walk.late,
    Walk.late,
    Walk.drop,
    Walk.twice,
    Walk.command,
]
REQUESTS = [Walk.wave, Walk.stream, Walk.stop, Walk.command]
RARE = [Walk.reset, Walk.settings, Walk.dead, Walk.rest, Walk.rest, Walk.rest]


@pytest.mark.parametrize("number", [0, 1, 2])
def test_no_order_of_few_requests_lifts_a_limit(number: int) -> None:
    """The first half of the walk below: 20,000 steps of both in `make test`."""
    take_a_walk(number, FEW_STEPS)


@pytest.mark.soak
@pytest.mark.parametrize("number", range(26))
def test_no_order_of_requests_lifts_a_limit(number: int) -> None:
    take_a_walk(number, STEPS)


def take_a_walk(number: int, steps: int) -> None:
    walk = Walk(seed(300 + number))
    for step in range(steps):
        if step % 40 == 39:
            walk.random.choice(RARE)(walk)
        walk.step()
        if step % 100 == 99:
            walk.assert_kept()
    print(f"{walk.judge.on_s:.1f} s on, {walk.judge.most_k:.1f} K, {walk.judge.most_ma:.0f} mA")
    assert walk.judge.on_s > steps / STEPS
    assert walk.judge.most_k > 5.0
