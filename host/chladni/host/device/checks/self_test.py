"""Every coil in turn at half amplitude, and the current that it then draws."""

from __future__ import annotations

from typing import Any

from chladni.host.device.device import Device
from chladni.host.device.live_drive import play_for
from chladni.host.protocol.config import DeviceConfig

SELF_TEST_S = 0.6
SELF_TEST_GAIN, SELF_TEST_STEPS = 0.5, 6
SELF_TEST_TRIES, SELF_TEST_SHARE, SELF_TEST_MA = 3, 0.25, 6
"""A busy machine may leave a gap in a drive, so once is not enough; and what is near enough."""


def try_channel(
    device: Device, channel: int, config: DeviceConfig, seconds: float
) -> dict[str, Any]:
    """Bring one channel up to half amplitude for a while.

    Returns
    -------
    dict
        `channel`, `ok`, and in mA `supply_ma`, `expected_ma` and `full_current_ma`.
    """
    full_ma = config["full_current_ma"][channel]
    # A gain of 1 is a bridge's amplitude of a duty of 1. Of a switch's it is half of one, and the
    # bias as much above a wave's lowest duty. A supply delivers the mean square of the duty.
    gain = SELF_TEST_GAIN * abs(config["coil_gain_q15"][channel]) / 32767.0
    amplitude = gain if config.has_bridges else gain / 2.0
    bias = 0.0 if config.has_bridges else amplitude + config.least_duty
    expected = round(full_ma * (bias**2 + amplitude**2 / 2.0))
    for _ in range(SELF_TEST_TRIES):
        drawn = _draw(device, channel, config["channels"], seconds)
        is_ok = abs(drawn - expected) <= max(SELF_TEST_SHARE * expected, SELF_TEST_MA)
        if is_ok:
            break
    return {
        "channel": channel,
        "ok": is_ok,
        "supply_ma": drawn,
        "expected_ma": expected,
        "full_current_ma": full_ma,
    }


def _draw(device: Device, channel: int, channels: int, seconds: float) -> int:
    """Bring one channel up to half amplitude; mA that the device then estimates."""
    # The last step twice: the device's estimate is a mean of what went before.
    for step in (*range(1, SELF_TEST_STEPS + 1), SELF_TEST_STEPS):
        gains = [0j] * channels
        gains[channel] = complex(SELF_TEST_GAIN * step / SELF_TEST_STEPS)
        play_for(device, gains, 160.0, "sine", seconds / SELF_TEST_STEPS)
    drawn = int(device.info()["supply_ma"])
    device.stop()
    device.link.wait(0.1)
    return drawn


def faults_since(device: Device, before: int) -> list[dict[str, Any]]:
    """What was noted after there were so many; the device keeps the last sixteen."""
    count = device.info()["faults"] - before
    return device.faults()[-count:] if count > 0 else []
