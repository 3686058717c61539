"""A drive that this machine plays: repeated, since a device goes quiet soon after the last one."""

from __future__ import annotations

from collections.abc import Sequence

from chladni.host.device.device import Device

REPEAT_S = 0.02
"""A device goes quiet after its table's `touch_timeout_ms`, which is 30 at least."""


def play_for(
    device: Device, gains: Sequence[complex], frequency_hz: float, waveform: str, seconds: float
) -> None:
    """Repeat a live drive for a while, well within the device's timeout."""
    end = device.wire.now_s() + seconds
    while device.wire.now_s() < end:
        device.live(gains, frequency_hz, waveform)
        device.link.wait(REPEAT_S)
