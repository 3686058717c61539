"""Fingers that do whatever panels and people do: outputs end in time, no limit is passed."""

from __future__ import annotations

import random

import numpy as np
import pytest

from chladni.host.emulation.emulator import TouchEvent
from firmware.judged_device import BRIDGES, PATIENT, JudgedDevice, hot_board
from plate_of_bumps import responses_table
from soaking import seed

STEPS, FEW_STEPS = 20_000, 2_000
OFF_MS = (PATIENT.touch_timeout_us + 2 * PATIENT.ramp_us) / 1e3 + 5.0
"""Of the last finger, whatever the panel says of it: the timeout, a ramp that may have to be begun
in the middle of another, and a turn of the main loop."""
Place = tuple[float, float]


class FingersWalk(JudgedDevice):
    """Fingers as people put them down, and numbers as a panel gives them."""

    def __init__(self, number: int) -> None:
        settings = BRIDGES if number % 2 else {}
        super().__init__(
            hot_board(lift_hold_ms=20 * (number % 3), press_reports=1 + number % 2, **settings),
            responses_table(limits=PATIENT),
        )
        self.random = random.Random(number)
        # Half of the walks have bystanders, too.
        self.core.panel_faults.most_listed, self.people = (10, 8) if number % 2 else (5, 6)
        self.down: dict[int, Place] = {}
        self.most = 0

    def put(self, finger: int, place: Place | None) -> None:
        self.emulator.touch(TouchEvent(self.core.now_us / 1e3 + 0.1, place, finger))
        if place is None:
            self.down.pop(finger, None)
        else:
            self.down[finger] = place

    def arrive(self) -> None:
        self.put(self.random.randrange(self.people), self.place())

    def place(self) -> Place:
        return self.random.uniform(-29.0, 29.0), self.random.uniform(-49.0, 49.0)

    def leave(self) -> None:
        if self.down:
            self.put(self.random.choice(list(self.down)), None)

    def leave_as_another_comes(self) -> None:
        self.leave()
        self.arrive()

    def move(self) -> None:
        for finger, (x, y) in list(self.down.items()):
            nudge = self.random.uniform(-2.0, 2.0)
            self.put(finger, (min(29.0, max(-29.0, x + nudge)), y))

    def swap(self) -> None:
        """Numbers, in any order; the fingers stay."""
        fingers, places = list(self.down), list(self.down.values())
        order = self.random.sample(range(len(fingers)), len(fingers))
        for finger, k in zip(fingers, order, strict=True):
            self.put(finger, places[k])

    def jump(self) -> None:
        if self.down:
            self.put(self.random.choice(list(self.down)), self.place())

    def freeze(self) -> None:
        self.core.panel_faults.is_silent = not self.core.panel_faults.is_silent

    def palm(self) -> None:
        self.core.panel_faults.is_palm = not self.core.panel_faults.is_palm

    def lose(self) -> None:
        self.core.panel_faults.loses_next_lift = True

    def late(self) -> None:
        self.core.delay_next_sample(self.random.choice([60.0, 300.0]))

    def voice(self) -> None:
        level = self.random.choice([0, 20_000, 32_767])
        self.core.set_voice(
            self.random.randrange(5), self.random.choice([0, 40_000, 250_000]), level
        )

    def lift_all(self) -> None:
        """Promised: off in time, whatever went before; a panel that is silent counts as no one."""
        for finger in list(self.down):
            self.put(finger, None)
        self.run(OFF_MS)
        recording = self.emulator.run(5.0)
        assert not np.any(recording.duty_steps)
        self.judge.take(recording, self.config)
        for name in ("is_silent", "is_palm", "loses_next_lift"):
            setattr(self.core.panel_faults, name, False)
        self.run(20.0)

    def step(self) -> None:
        self.random.choice(ACTIONS)(self)
        self.run(self.random.choice([0.5, 4.0, 12.0, 30.0]))
        self.most = max(self.most, sum(one[0] for one in self.core.touches()))


ACTIONS = [
    *[FingersWalk.arrive] * 6,
    *[FingersWalk.leave] * 3,
    FingersWalk.leave_as_another_comes,
    *[FingersWalk.move] * 3,
    *[FingersWalk.swap] * 2,
    FingersWalk.jump,
    FingersWalk.freeze,
    FingersWalk.palm,
    FingersWalk.lose,
    FingersWalk.late,
    FingersWalk.voice,
]


@pytest.mark.parametrize(
    ("number", "steps"),
    [(0, FEW_STEPS), (1, FEW_STEPS)]
    + [pytest.param(k, STEPS, marks=pytest.mark.soak) for k in range(2, 7)],
)
def test_whatever_fingers_do_outputs_end_in_time_and_no_limit_is_passed(
    number: int, steps: int
) -> None:
    walk = FingersWalk(seed(700 + number))
    for step in range(steps):
        walk.step()
        if step % 25 == 24:
            walk.lift_all()
            walk.assert_kept()
    assert walk.most == 5
    assert walk.judge.on_s > steps / 1000.0
    assert walk.judge.most_k > 5.0
