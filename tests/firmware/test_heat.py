"""No coil gets beyond its limit, whatever comes: by a model that sees only the pins."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
import pytest

from chladni.host.emulation.emulator import Emulator, Hardware, Recording, TouchEvent
from chladni.host.protocol.config import DeviceConfig
from chladni.tables.table import Limits, Table
from made_up import LIMITS, device_of, make_table
from thermal import Coils

LIMIT_K = 60.0


def hot_board(full_k: float, heating_s: float) -> DeviceConfig:
    return device_of().with_values(
        full_rise_dk=(round(full_k * 10),) * 5 + (0,) * 11,
        limit_rise_dk=round(LIMIT_K * 10),
        heating_ds=round(heating_s * 10),
    )


@pytest.fixture(scope="module")
def loud() -> Table:
    """Full scale on the first coil, and touches that may last."""
    limits = Limits(LIMITS.ramp_us, LIMITS.touch_timeout_us, 10_000_000)
    return replace(make_table(np.array([[10.0, 10.0, 5.0, 1.0, 0.0]])), limits=limits)


def test_the_model_is_the_exponential(loud: Table) -> None:
    config = hot_board(100.0, 2.0)
    coils = Coils(config)
    emulator = Emulator(config, loud, level=1.0)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    coils.take(emulator.run(400.0))
    rose = coils.rise_k.copy()
    coils.rest(2.0)
    assert coils.rise_k == pytest.approx(rose / math.e)
    # Bias and amplitude of half a duty: a mean square of 3/8.
    assert rose[0] == pytest.approx(37.5 * (1.0 - np.exp(-0.37 / 2.0)), rel=0.03)


@pytest.mark.parametrize("cause", ["software", "watchdog", "panic", "brown-out", "power on"])
@pytest.mark.parametrize(("full_k", "heating_s"), [(300.0, 3.0), (400.0, 2.0)])
def test_play_until_hot_restart_and_again(
    loud: Table, cause: str, full_k: float, heating_s: float
) -> None:
    """With an estimate that began at half its limit the true rise went from 59 to 96 K."""
    config = hot_board(full_k, heating_s)
    emulator = Emulator(config, loud, level=1.0, hardware=Hardware(is_rested=False))
    coils = Coils(config)
    # The truth is as bad as it may be when the power comes.
    coils.rise_k[:] = LIMIT_K
    played = 0.0
    for _ in range(12):
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 10.0, (0.0, 0.0)))
        recording = emulator.run(1_200.0)
        coils.take(recording)
        played += float(recording.duty[:, 0].mean())
        emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
        coils.take(emulator.run(20.0))
        emulator.core.restart(cause)
        coils.take(emulator.run(0.1))
    assert coils.most_k <= LIMIT_K + 1e-9
    # After a loss of power a second is too short to be sure that coils have cooled.
    assert (played > 0.0) == (cause in ("software", "watchdog", "panic"))


@pytest.mark.parametrize("is_rested", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_any_order_of_touches_streams_and_resets(loud: Table, seed: int, is_rested: bool) -> None:
    """Duties of 1 among them, main loops that hang, power that fails, long rests and short ones."""
    rng = random.Random(seed)
    config = hot_board(rng.choice([80.0, 250.0, 400.0]), rng.choice([2.0, 5.0]))
    emulator = Emulator(config, loud, level=1.0, hardware=Hardware(is_rested=is_rested))
    coils = Coils(config)
    coils.rise_k[:] = 0.0 if is_rested else LIMIT_K
    causes = ["software", "watchdog", "panic", "brown-out", *([] if is_rested else ["power on"])]
    core = emulator.core

    def run(milliseconds: float) -> None:
        coils.take(emulator.run(milliseconds))

    def touch() -> None:
        emulator.touch(TouchEvent(core.now_us / 1e3 + 1.0, (0.0, 0.0)))
        run(rng.uniform(50.0, 2_000.0))
        emulator.touch(TouchEvent(core.now_us / 1e3 + 0.5, None))

    def stream() -> None:
        core.stream_begin()
        duty = rng.choice([65_535, 50_000, 20_000])
        for _ in range(rng.randrange(5, 60)):
            core.stream_push(np.full((150, 5), duty, dtype=np.uint16))
            run(15.0)
        core.stream_end()

    def hang() -> None:
        core.hang_main_loop(True)
        run(rng.uniform(10.0, 400.0))
        core.hang_main_loop(False)

    def reset() -> None:
        core.restart(rng.choice(causes))

    for _ in range(25):
        rng.choice([touch, touch, stream, stream, hang, reset])()
        run(rng.choice([1.0, 30.0, 1_000.0]))
    assert coils.most_k <= LIMIT_K + 1e-9


def test_after_a_power_on_coils_count_as_hot_until_they_must_have_cooled(loud: Table) -> None:
    """Seven eighths of the limit: an eighth of a time constant and a little more."""
    config = hot_board(100.0, 30.0)
    emulator = Emulator(config, loud, hardware=Hardware(is_rested=False))
    emulator.run(50.0)
    assert emulator.core.state == "fault"
    assert emulator.core.coil_rise_k == pytest.approx([LIMIT_K] * 5, abs=0.2)
    waited = 0.0
    while emulator.core.state == "fault":
        emulator.run(100.0)
        waited += 0.1
    assert waited == pytest.approx(30.0 * np.log(8.0 / 7.0), rel=0.1)
    # A restart keeps what is known.
    known = emulator.core.coil_rise_k
    emulator.core.restart("software")
    emulator.run(50.0)
    assert emulator.core.coil_rise_k == pytest.approx(known, abs=0.3)
    assert emulator.core.state == "idle"


def test_a_board_that_a_hung_main_loop_would_burn_plays_nothing(loud: Table) -> None:
    """4000 K at full duty within 2 s: no touch is short enough."""
    emulator = Emulator(hot_board(4000.0, 2.0), loud, level=1.0)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    assert not emulator.run(300.0).duty_steps.any()
    assert emulator.core.state == "fault"


def amplitude(recording: Recording, channel: int) -> float:
    """Of the sine at 160 Hz over the last 16 periods, as a duty."""
    count = round(0.1 * recording.carrier_hz)
    turns = 160.0 / recording.carrier_hz * np.arange(count)
    return float(abs(2.0 * np.mean(recording.duty[-count:, channel] * np.exp(-2j * np.pi * turns))))


def test_a_warm_coil_and_a_cool_one_make_forces_in_proportion(loud: Table) -> None:
    """A warm coil's current falls with its resistance, so cooler ones are given less."""
    config = hot_board(140.0, 2.0)
    emulator = Emulator(config, loud, level=1.0)
    coils = Coils(config)
    emulator.touch(TouchEvent(20.0, (0.0, 0.0)))
    coils.take(cold := emulator.run(200.0))
    coils.take(emulator.run(6_000.0))
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, None))
    coils.take(emulator.run(50.0))
    counted = coils.rise_k.copy()
    emulator.touch(TouchEvent(emulator.core.now_us / 1e3 + 1.0, (0.0, 0.0)))
    warm = emulator.run(200.0)
    # T (1 + αT) is what the power of a cold coil comes to; 0.393 % per kelvin is copper's α.
    rise = (np.sqrt(1.0 + 4.0 * 3.93e-3 * counted) - 1.0) / (2.0 * 3.93e-3)
    resistance = 1.0 + 3.93e-3 * rise
    assert resistance[0] / resistance[3] > 1.05
    for channel in (2, 3):
        shares = [amplitude(own, channel) / amplitude(own, 0) for own in (cold, warm)]
        # The estimate is rounded to 0.1 K and errs up by a twentieth of 19 K: 0.4 %.
        expected = shares[0] * resistance[channel] / resistance[0]
        assert shares[1] == pytest.approx(expected, rel=0.01)
    assert amplitude(warm, 0) == pytest.approx(amplitude(cold, 0), rel=1e-3)
