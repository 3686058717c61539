"""States, statuses and causes that a device sends as numbers, with the words for them.

The one declaration of them; `tools/generate_headers.py` writes the C++ enumerations and texts.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from chladni.sim.coil.waveforms import WAVEFORMS


def numbered(names: Iterable[str]) -> str:
    """What numbers from 0 stand for, as a field's meaning says it."""
    return ", ".join(f"{k} {name}" for k, name in enumerate(names))


@dataclass(frozen=True)
class Code:
    """A number's name in C++, the words for people, and what it means beyond them."""

    name: str
    text: str
    note: str = ""


@dataclass(frozen=True)
class Codes:
    """An enumeration: its numbers count from 0; `is_counted` if C++ asks how many there are."""

    name: str
    about: str
    members: tuple[Code, ...]
    is_counted: bool = False

    def text(self, number: int) -> str:
        """The words for a number, also for one that a later version may send."""
        known = 0 <= number < len(self.members)
        return self.members[number].text if known else f"unknown ({number})"


DEVICE_STATE = Codes("DeviceState", "What a device is doing.", (
    Code("kIdle", "idle", "waiting for a touch; outputs off"),
    Code("kPlaying", "playing", "a finger is on the board"),
    Code("kStreaming", "streaming", "a host drives the outputs"),
    Code("kUpdating", "updating", "flash is being written; outputs off"),
    Code("kFault", "fault", "something keeps it from playing; outputs off until it clears"),
    Code("kLifted", "lifted", "the finger has left, and its lift pulse plays"),
    Code("kRestarting", "restarting", "outputs fade out, then everything starts again"),
), is_counted=True)  # fmt: skip
TABLE_STATUS = Codes("TableStatus", "What became of a table.", (
    Code("kOk", "ok"),
    Code("kNone", "no table", "the partition is blank"),
    Code("kReadFailed", "flash could not be read"),
    Code("kBadMagic", "not a table"),
    Code("kBadVersion", "table of another format: build it again, or update the firmware"),
    Code("kBadSize", "table sizes contradict each other"),
    Code("kBadCrc", "table is damaged"),
    Code("kBadField", "table header out of range"),
    Code("kBadDrives", "table labels or gains out of range"),
    Code("kWrongActuators", "table is for another number of actuators"),
    Code("kNoSection", "no drives for that frequency"),
))  # fmt: skip
BANK_STATUS = Codes("BankStatus", "What became of an effect bank.", (
    Code("kOk", "ok"),
    Code("kNone", "no effect bank", "the partition is blank, or there is none"),
    Code("kBadMagic", "not an effect bank"),
    Code("kBadVersion", "effect bank of another format: build it again, or update the firmware"),
    Code("kBadSize", "effect bank's sizes contradict each other"),
    Code("kBadCrc", "effect bank is damaged"),
    Code("kBadField", "effect bank's header out of range"),
    Code("kBadArea", "an area of the effect bank out of range"),
    Code("kBadEffect", "an effect of the effect bank out of range"),
))  # fmt: skip
AREA_EVENT = Codes("AreaEvent", "What a finger did on an effect bank's areas.", (
    Code("kPressed", "pressed", "it came down"),
    Code("kEntered", "entered", "it came from another area"),
    Code("kStepped", "stepped", "it moved by the area's `every_um`"),
    Code("kReleased", "released", "it left the board"),
))  # fmt: skip
SENSE_STATE = Codes("SenseState", "What became of a reading of coils.", (
    Code("kNone", "none", "none was asked for"),
    Code("kRunning", "running"),
    Code("kDone", "done"),
    Code("kTooLoud", "too loud", "the converter's range ended a coil's"),
    Code("kTouched", "touched", "a finger came down"),
    Code("kNoExpander", "expander missing", "its outputs choose the coil"),
    Code("kNoConverter", "converter fails"),
    Code("kLost", "samples lost", "the main loop was kept from reading them"),
    Code("kStopped", "stopped", "a fault, an update or another drive came between"),
    Code("kNoAccelerometer", "accelerometer missing", "none answers at its addresses"),
))  # fmt: skip
ACCELEROMETER = Codes("AccelerometerModel", "An accelerometer on the panel's bus.", (
    Code("kNone", "none"),
    Code("kLis2dw12", "LIS2DW12", "±8 g in 4096 steps per g"),
    Code("kAdxl345", "ADXL345", "±16 g in 256 steps per g"),
))  # fmt: skip
CONFIG_STATUS = Codes("ConfigStatus", "What became of a configuration.", (
    Code("kOk", "ok"),
    Code("kNone", "never configured", "outputs stay off"),
    Code("kDamaged", "configuration damaged", "outputs stay off"),
    Code("kReadFailed", "flash read failed", "outputs stay off"),
    Code("kWriteFailed", "flash write failed"),
    Code("kBadPins", "pins that the chip cannot use so", "outputs stay off"),
    Code("kBadVersion", "configuration of another version: set it again", "outputs stay off"),
    Code("kOlder", "an older configuration, as the newest is damaged: set it again",
         "outputs stay off"),
    Code("kByWireOnly", "limits, pins and carrier are set by wire only",
         "what a network asked for was refused"),
    Code("kOtherDriver", "drivers of another kind than the device's",
         "refused: its coils would have to be rewired first"),
))  # fmt: skip
PANEL_HEALTH = Codes("PanelHealth", "How the touch panel is.", (
    Code("kNone", "no panel configured"),
    Code("kMissing", "panel missing", "looked for every 250 ms"),
    Code("kFine", "panel fine"),
    Code("kWedged", "panel fails", "answered once, and fails now"),
))  # fmt: skip
RESET_CAUSE = Codes("ResetCause", "Why the processor started.", (
    Code("kPowerOn", "power on"),
    Code("kSoftware", "software"),
    Code("kPanic", "panic"),
    Code("kWatchdog", "watchdog"),
    Code("kBrownOut", "brown-out"),
    Code("kOther", "other"),
), is_counted=True)  # fmt: skip
FAULT_CAUSE = Codes("FaultCause", "What went wrong.", (
    Code("kReset", "reset", "not by power; detail: ResetCause"),
    Code("kNoTable", "no table", "the partition is blank"),
    Code("kTableRefused", "table refused", "detail: TableStatus"),
    Code("kConfigRefused", "configuration refused", "outputs stay off; detail: ConfigStatus"),
    Code("kPanelMissing", "panel missing", "no panel answers at the panel's addresses"),
    Code("kPanelFails", "panel fails", "the panel answered before, and fails now"),
    Code("kPanelRange", "panel out of range", "the panel reported a place off its pixels"),
    Code("kTouchTimeout", "touch timeout", "the panel fell silent under a finger"),
    Code("kTouchTooLong", "touch too long", "a touch outlasted its limit"),
    Code("kInterruptLate", "interrupt late", "detail: samples missed in all"),
    Code("kUnderrun", "stream underrun", "a stream ran dry"),
    Code("kHostSilent", "host silent", "the host of a drive or of a touch fell silent"),
    Code("kCoilHot", "coil hot", "detail: channel"),
    Code("kSupplyCurrent", "supply current", "detail: mA"),
    Code("kInterruptStopped", "interrupt stopped",
         "outputs are cut until the next start; detail: ms without a sample"),
    Code("kBrownOut", "brown-out", "the supply gave way; outputs stay off until a host plays"),
    Code("kShortStarts", "short starts in a row",
         "outputs stay off; detail: starts that did not last 10 s, or crashes"),
    Code("kNotConfigured", "never configured",
         "outputs stay off until `chladni device config set --from BOARD`"),
    Code("kOlderTable", "older table", "the newest table is damaged; the older one plays"),
    Code("kNetworkHeld", "network held back",
         "the last start crashed, or several did not last; detail: ResetCause"),
    Code("kBankRefused", "effect bank refused", "outputs stay off; detail: BankStatus"),
    Code("kOlderBank", "older effect bank", "the newest is damaged; the older one plays"),
    Code("kExpanderMissing", "expander missing",
         "it chooses the coil that is listened to, and may have left bridges asleep"),
), is_counted=True)  # fmt: skip
WAVEFORM = Codes(
    "Waveform",
    "What a touch is played with.",
    tuple(Code(f"k{name.capitalize()}", name) for name in WAVEFORMS),
    is_counted=True,
)
ALL_CODES = (
    DEVICE_STATE,
    TABLE_STATUS,
    BANK_STATUS,
    AREA_EVENT,
    SENSE_STATE,
    ACCELEROMETER,
    CONFIG_STATUS,
    PANEL_HEALTH,
    RESET_CAUSE,
    FAULT_CAUSE,
    WAVEFORM,
)
