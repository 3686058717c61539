"""The user's side: real and emulated devices, and the loop from their pins back to the plate.

Names are loaded when they are first asked for: the command line goes through here, and answers
Ctrl-C before a second of NumPy has been loaded.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # typing's own would load a hundredth of a second of modules
if TYPE_CHECKING:
    from typing import Any

    from chladni.host.device.async_device import AsyncDevice
    from chladni.host.device.device import Device
    from chladni.host.device.wires.link import LinkError
    from chladni.host.device.wires.udp import UdpPort, UdpWire
    from chladni.host.device.wires.wire import EmulatorWire, SerialWire, Wire, WireError
    from chladni.host.emulation.closed_loop import LoopReport, run_loop
    from chladni.host.emulation.emulator import (
        Emulator,
        EmulatorError,
        Recording,
        TouchEvent,
        emulate,
    )
    from chladni.host.emulation.table_score import TableScore, score_table
    from chladni.host.emulation.touches import TouchScore
    from chladni.host.protocol.board_config import config_of
    from chladni.host.protocol.config import DeviceConfig
    from chladni.host.protocol.network import NetworkSettings, read_key

    __version__: str

_PLACES = {
    "device.async_device": ("AsyncDevice",),
    "device.device": ("Device",),
    "device.wires.link": ("LinkError",),
    "device.wires.udp": ("UdpPort", "UdpWire"),
    "device.wires.wire": ("EmulatorWire", "SerialWire", "Wire", "WireError"),
    "emulation.closed_loop": ("LoopReport", "run_loop"),
    "emulation.emulator": ("Emulator", "EmulatorError", "Recording", "TouchEvent", "emulate"),
    "emulation.table_score": ("TableScore", "score_table"),
    "emulation.touches": ("TouchScore",),
    "protocol.board_config": ("config_of",),
    "protocol.config": ("DeviceConfig",),
    "protocol.network": ("NetworkSettings", "read_key"),
}

__all__ = [
    "AsyncDevice",
    "Device",
    "DeviceConfig",
    "Emulator",
    "EmulatorError",
    "EmulatorWire",
    "LinkError",
    "LoopReport",
    "NetworkSettings",
    "Recording",
    "SerialWire",
    "TableScore",
    "TouchEvent",
    "TouchScore",
    "UdpPort",
    "UdpWire",
    "Wire",
    "WireError",
    "config_of",
    "emulate",
    "read_key",
    "run_loop",
    "score_table",
]

_RENAMED = {"board_of": ("chladni.tables", "board_for")}
"""Names until 0.3.0: the package that has them now, and their name there."""


def __getattr__(name: str) -> Any:
    """A name of `__all__`, or the version, loaded now and kept."""
    if name in _RENAMED:
        package, renamed = _RENAMED[name]
        import_module("warnings").warn(
            f"{__name__}.{name} is {package}.{renamed}", DeprecationWarning, stacklevel=2
        )
        return getattr(import_module(package), renamed)
    if name == "__version__":
        value: Any = import_module("importlib.metadata").version("chladni")
    else:
        places = [place for place, names in _PLACES.items() if name in names]
        if not places:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{places[0]}"), name)
    globals()[name] = value
    return value
