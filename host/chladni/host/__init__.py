"""The user's side: devices and how to reach them, the emulated one, the loop back to the plate."""

from importlib.metadata import version

from chladni.host.device.async_device import AsyncDevice
from chladni.host.device.device import Device
from chladni.host.device.link import LinkError
from chladni.host.device.udp import UdpPort, UdpWire
from chladni.host.device.wire import EmulatorWire, SerialWire, Wire, WireError
from chladni.host.emulation.closed_loop import LoopReport, board_of, run_loop
from chladni.host.emulation.emulator import Emulator, EmulatorError, Recording, TouchEvent, emulate
from chladni.host.protocol.config import DeviceConfig, config_of
from chladni.host.protocol.network import NetworkSettings, read_key

__version__ = version("chladni")

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
    "TouchEvent",
    "UdpPort",
    "UdpWire",
    "Wire",
    "WireError",
    "board_of",
    "config_of",
    "emulate",
    "read_key",
    "run_loop",
]
