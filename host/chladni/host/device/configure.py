"""A configuration written to a device, and in force."""

from __future__ import annotations

from typing import Any

from chladni.host.device.device import Device
from chladni.host.device.wires.link import TRY_AGAIN, LinkError
from chladni.host.protocol.board_config import check_driver
from chladni.host.protocol.codes import CONFIG_STATUS
from chladni.host.protocol.config import DeviceConfig
from chladni.host.protocol.settings import changes

OLDER = next(one.text for one in CONFIG_STATUS.members if one.name == "kOlder")
START_S = 1.0
"""After a restart, until the device answers."""


def has_driver(config_status: str) -> bool:
    """Whether the kind of a device's drivers is known: of a damaged newest record the older has it.

    Parameters
    ----------
    config_status
        As of `Device.info`.
    """
    return config_status in ("ok", OLDER)


def restart_with(device: Device, config: DeviceConfig, *, change_driver: bool = False) -> None:
    """Keep a configuration and restart into it.

    Raises
    ------
    LinkError
        The device refused, or started with another one.
    """
    device.set_config(config, change_driver=change_driver)
    device.restart()
    device.link.wait(START_S)
    if device.config() != config:
        raise LinkError("the device started with another configuration", hint=TRY_AGAIN)


def change_settings(device: Device, wanted: dict[str, Any]) -> list[dict[str, Any]]:
    """Change settings over a wire and restart; what changed, as `protocol.settings.changes`.

    Parameters
    ----------
    wanted
        Values by the record's names.

    Raises
    ------
    InputError
        Values that do not go together, pins that cannot be driven, or another driver.
    LinkError
        The device refused, or started with another configuration.
    """
    before = device.config()
    after = before.with_values(**wanted)
    info = device.info()
    after.check_pins(info["chip"])
    after = after.by_wire()
    is_configured = info["config_status"] == "ok"
    if has_driver(info["config_status"]):
        check_driver(before, after)
    if before != after or not is_configured:
        restart_with(device, after)
    return changes(before, after)
