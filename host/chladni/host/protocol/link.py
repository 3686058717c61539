"""The messages between host and device: the one declaration of the link.

`tools/generate_headers.py` writes the C++ header and docs/link-protocol.md from it.

A frame is kind, sequence, payload and CRC-32, COBS-coded between two zeros. Text may stand between
frames: the boot loader's, a panic's, the console's. The host asks, the device answers with the same
sequence number, the kind's top bit set and a status before the payload. A request that is repeated
with its number is answered again and not done twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct

from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.host.protocol.codes import ACCELEROMETER, AREA_EVENT, SENSE_STATE, numbered
from chladni.sim.board.electronics import DRIVER_KINDS
from chladni.sim.board.gpio import CHIPS
from chladni.sim.coil.waveforms import WAVEFORMS
from chladni.tables.layout import MAX_ACTUATORS, Field

VERSION_MAJOR, VERSION_MINOR = 2, 11
MAX_PAYLOAD = 1024
"""Bytes behind a request's fixed fields, or a response's."""
WINDOW = 3
"""Requests that the host may send before the first is answered."""
CRC_BYTES = 4
HEAD_BYTES = 2
MAX_FRAME = HEAD_BYTES + 64 + MAX_PAYLOAD + CRC_BYTES
"""Before COBS, which adds a byte per 254."""
SILENCE_MS = 100
"""A frame that stops for so long is none."""
UPDATE_SILENCE_MS = 5000
"""An update that hears nothing for so long is dropped; the old table plays on."""
TOUCH_SILENCE_MS = 800
"""A touch whose host says nothing for so long ends: off within a second, with the ramp."""
RESPONSE = 0x80
SIGNAL_SAMPLES = 128
"""That a device keeps of each."""
ISOLATION_STEPS = 16
"""Of a ratio of 1, which is 0 dB: half a decibel there, and 72 dB at most."""
SENSE_PAIRS = 488
"""Of conversions, 78,125 a second: the least that a reading of coils takes, 12.5 ms. What plays has
whole periods then, half of a multiple of them."""
LEAST_MULTIPLE, MOST_MULTIPLE = 2, 200
"""Of 40 Hz, which a playing coil may have; even ones only."""
MOST_READ = 32
"""Such readings in a row for each coil."""
REFERENCE = 16
"""In place of a coil. A test compares these with `chladni.calibration`, which loads more."""
UNIT_HZ = 80e6 / 4096 / SENSE_PAIRS
MOST_MOTIONS, MOTIONS_AT_ONCE = 256, 64
"""Samples of an accelerometer that one request takes, and that one answer holds."""
LEAST_TARGET, MOST_TARGET = 16, 384
"""Frames of a stream that a device may be asked to keep: its ring has 512."""


class Status(IntEnum):
    """How a request went."""

    OK = 0
    BUSY = 1
    UNKNOWN = 2
    MALFORMED = 3
    INCOMPATIBLE = 4
    WRONG_OFFSET = 5
    TOO_LARGE = 6
    FLASH_FAILED = 7
    REFUSED = 8
    NOT_BEGUN = 9
    NO_OTHER = 10
    NOT_NOW = 11
    TOO_OFTEN = 12
    OTHER_DRIVER = 13
    NO_PARTITION = 14
    NOT_WIRED = 15


STATUS_TEXT = {
    Status.OK: "done",
    Status.BUSY: "ask again in a moment",
    Status.UNKNOWN: "no such request in this version",
    Status.MALFORMED: "invalid fields",
    Status.INCOMPATIBLE: "another major version of the link",
    Status.WRONG_OFFSET: "bytes out of order; the answer has the offset that is due",
    Status.TOO_LARGE: "more than a slot holds",
    Status.FLASH_FAILED: "flash failed; the old table stays",
    Status.REFUSED: "the device refuses it; the answer gives the reason",
    Status.NOT_BEGUN: "nothing has begun",
    Status.NO_OTHER: "no other table",
    Status.NOT_NOW: "not in this state",
    Status.TOO_OFTEN: "flash was written 5 times since power came on, or 60 times within an hour; "
    "try again in a minute",
    Status.OTHER_DRIVER: "duties for switches do not suit bridges, nor the other way round",
    Status.NO_PARTITION: "its flash was partitioned before there were effect banks",
    Status.NOT_WIRED: "no sensing pin in its configuration, or no panel's bus",
}


@dataclass(frozen=True)
class Message:
    """A request and its answer: fixed fields, and what may follow them.

    `each` has the fields of an entry, where a tail is a row of those.
    """

    code: int
    name: str
    request: tuple[Field, ...]
    request_tail: str
    answer: tuple[Field, ...]
    answer_tail: str
    doc: str
    each: tuple[Field, ...] = ()

    @property
    def entry(self) -> Struct:
        """An entry of the tail."""
        return Struct("<" + "".join(field.code for field in self.each))


_PLACE = (Field("x_um", "i32", "From the board's centre."), Field("y_um", "i32", "The same."))
_FINGER = Field("finger", "u8", "0 to 4.")
_BANK_STATUS = Field("bank_status", "u8", "0 is ok.")
MOST_EVENTS = 16
"""Of areas, in an answer."""
MESSAGES = (
    Message(1, "hello", (Field("major", "u8", "The host's version."),
                         Field("minor", "u8", "")), "",
            (Field("major", "u8", "The device's."), Field("minor", "u8", ""),
             Field("window", "u16", "Requests it keeps."),
             Field("max_payload", "u16", "Bytes it takes at once.")), "",
            "Another major version is refused."),
    Message(2, "info", (), "",
            (Field("state", "u8", "As in docs/device.md, from 0."),
             Field("table_status", "u8", "0 is ok."), Field("config_status", "u8", "0 is ok."),
             Field("panel_health", "u8", "0 none, 1 missing, 2 fine, 3 fails."),
             Field("slot", "u8", "Of the table in use."), Field("channels", "u8", ""),
             Field("missed", "u16", "Samples, the lower 16 bits."),
             Field("uptime_ms", "u32", ""), Field("faults", "u32", "Ever noted."),
             Field("supply_ma", "u32", "Delivered to the coils, as a mean over the last 64 ms."),
             Field("frequency_millihertz", "u32", "Of the drives in use."),
             Field("table_bytes", "u32", ""), Field("table_crc", "u32", "Its last four bytes."),
             Field("fingerprint", "u64", "Of the table's board."),
             Field("board", "char16", "Its name."),
             Field("rise_dk", f"u16x{MAX_ACTUATORS}", "Every coil's, 0.1 K."),
             Field("stack_free", "u32", "Of the main task's stack, bytes never used; 0 unknown."),
             Field("standing", "u32", "Faults that stand: bit k for the k-th cause."),
             Field("erases", "u32", "Sectors of flash, since power came on."),
             Field("chip", "u8", f"{numbered(CHIPS)}."),
             Field("updates", "u32", "Of flash, ever; each erases a sector once at most.")),
            "",
            "State, table, heat."),
    Message(3, "faults", (), "", (Field("count", "u8", "That follow."),),
            "each: cause u32, detail u32, milliseconds since start u32",
            "The last sixteen, oldest first.",
            each=(Field("cause", "u32", "As in docs/device.md, from 0."),
                  Field("detail", "u32", "By the cause."),
                  Field("at_ms", "u32", "Since start."))),
    Message(4, "table_begin", (Field("total", "u32", "Bytes of the whole table."),
                               Field("crc", "u32", "Its last four bytes.")),
            "the table's header", (Field("table_status", "u8", "0 is ok."),), "",
            "A table for other channels is refused, and nothing is lost. Outputs go off first: "
            "busy until they are off. Erases the other slot, unless the same update broke off "
            "there since the last start: then `table_data` answers with the offset that is due."),
    Message(5, "table_data", (Field("offset", "u32", "Of these bytes in the table."),),
            "bytes of the table", (Field("next", "u32", "Offset that is due."),), "",
            "In order; bytes that are there already are answered ok."),
    Message(6, "table_commit", (), "", (Field("slot", "u8", "In use now."),
                                        Field("table_status", "u8", "0 is ok.")), "",
            "Reads the table back, enters it into the slot's trailer, and loads it."),
    Message(7, "table_previous", (), "", (Field("slot", "u8", "In use now."),
                                          Field("table_status", "u8", "0 is ok.")), "",
            "Back to the other slot's table."),
    Message(8, "touch", _PLACE, "", _PLACE, "",
            f"Plays a place until lift, or until its host says nothing for {TOUCH_SILENCE_MS} ms. "
            "The answer is the nearest place on the board, which plays."),
    Message(9, "lift", (), "", (Field("played_ms", "u32", "From touch-down until now, or until "
                                      "something ended it."),), "", ""),
    Message(10, "frequency", (Field("millihertz", "u32", "Millihertz; one of the table's."),), "",
            (Field("table_status", "u8", "0 is ok."),), "", "Of touches from now on."),
    Message(11, "waveform", (Field("waveform", "u8", f"{numbered(WAVEFORMS)}."),),
            "", (), "", "Of touches from now on."),
    Message(12, "config_get", (), "", (), "a configuration record", "What is in force."),
    Message(13, "config_set", (), "a configuration record",
            (Field("config_status", "u8", "0 is ok."),), "",
            "In force from the next start. Refuses drivers of another kind, unless asked for."),
    Message(14, "restart", (), "", (), "", "Answered first."),
    Message(15, "stream_begin",
            (Field("target", "u16", f"Frames kept in the ring, {LEAST_TARGET} to {MOST_TARGET}."),
             Field("is_signed", "u8", "1: frames for bridges, two's complement. Left out: 0.")),
            "", (), "", "Takes over from a finger. Refuses frames for the other driver."),
    Message(16, "stream_data", (), "frames of duties, 10 bits each, packed from the lowest bit: "
            "0 to 1023 over 1024, for bridges -512 to 511 over 512",
            (Field("taken", "u16", "Frames."), Field("filled", "u16", "Frames in the ring.")), "",
            "As many as the ring has room for."),
    Message(17, "stream_end", (), "", (), "", ""),
    Message(18, "live", (Field("millihertz", "u32", "Millihertz."),
                         Field("waveform", "u8", "As above.")),
            "per channel: in-phase i16, quadrature i16, 32767 for full amplitude", (), "",
            "The host repeats it within the touch timeout. Gains mean the same to both drivers.",
            each=(Field("in_phase_q15", "i16", "32767 for full amplitude."),
                  Field("quadrature_q15", "i16", "The same."))),
    Message(19, "network_set", (), "a network record, or nothing for none", (), "",
            "Over the wire only. In force from the next start."),
    Message(20, "network_get", (), "",
            (Field("state", "u8", "0 off, 1 not on the network, 2 on it."),
             Field("port", "u16", "UDP."), Field("address", "u32", "IPv4, its first byte lowest."),
             Field("accepted", "u32", "Datagrams since start."),
             Field("rejected", "u32", "The same."), Field("ssid", "char32", "")), "",
            "Never the key or the passphrase."),
    Message(21, "touches", (), "", (Field("count", "u8", "That follow."),),
            "each: slot u8, x_um i32, y_um i32, isolation u16, of_loudest u16",
            "Fingers that are down: what each has of its own signal over the most that another has "
            f"of it, in 1/{ISOLATION_STEPS}, 0 if there is none; and in thousandths of the "
            "loudest.",
            each=(Field("slot", "u8", "0 to 4, for as long as it is down."), *_PLACE,
                  Field("isolation", "u16",
                        f"Own displacement over the most of another, 1/{ISOLATION_STEPS}."),
                  Field("of_loudest", "u16", "Own displacement, thousandths of the most."))),
    Message(22, "voice", (_FINGER, Field("millihertz", "u32", "0: the table's."),
                          Field("level_q15", "u16", "32767 is the configured level; 0: it feels, "
                                "and is not heard.")),
            "", (), "", "Of a slot's fingers from their next touch on, where the table has "
            "responses."),
    Message(23, "finger_touch", (_FINGER, *_PLACE), "", _PLACE, "",
            "As `touch`, of one of five fingers; without responses only the first counts."),
    Message(24, "finger_lift", (_FINGER,), "", (), "", "Of one; `lift` lifts all."),
    Message(25, "signal_voice", (_FINGER, Field("level_q15", "u16", "As of `voice`.")),
            "", (), "", "A slot's fingers, from their next touch on, play what `signal_data` "
            "sends, until `voice` says otherwise. Samples that wait are dropped."),
    Message(26, "signal_data", (_FINGER,),
            f"samples i16, 32767 for the level, 80 MHz / 2^15 = {SIGNAL_HZ:.3f} of them a second",
            (Field("taken", "u16", "Samples."), Field("filled", "u16", "Samples that wait.")), "",
            f"As many as there is room for, {SIGNAL_SAMPLES} in all. They wait for the finger; "
            "where they run out, what it plays dies away."),
    Message(27, "bank_begin", (Field("total", "u32", "Bytes of the whole effect bank."),
                               Field("crc", "u32", "Its last four bytes.")),
            "the bank's header", (_BANK_STATUS,), "",
            "As `table_begin`, of an effect bank. Fingers play it once it is whole."),
    Message(28, "bank_data", (Field("offset", "u32", "Of these bytes in the bank."),),
            "bytes of the bank", (Field("next", "u32", "Offset that is due."),), "",
            "As `table_data`."),
    Message(29, "bank_commit", (), "", (Field("slot", "u8", "In use now."), _BANK_STATUS), "",
            "As `table_commit`."),
    Message(30, "bank", (), "", (_BANK_STATUS, Field("effects", "u8", "There are."),
                                 Field("areas", "u8", "There are."),
                                 Field("bytes", "u32", "0 if there is none."),
                                 Field("crc", "u32", "Its last four bytes."),
                                 Field("name", "char16", "")), "",
            "The effect bank in use."),
    Message(31, "bank_area", (Field("area", "u8", "From 0."),), "",
            (Field("name", "char16", ""), Field("left_um", "i32", "Of the box about its shape; "
             "of `everywhere` all are 0."), Field("bottom_um", "i32", "The same."),
             Field("right_um", "i32", "The same."), Field("top_um", "i32", "The same.")), "", ""),
    Message(32, "bank_effect", (Field("effect", "u8", "From 0."),), "",
            (Field("name", "char16", ""), Field("lasts", "u16", "Samples.")), "", ""),
    Message(33, "effect", (_FINGER, Field("effect", "u8", "By its number in the bank."),
                           Field("level_q15", "u16", "32767 as it is.")), "", (), "",
            "Plays it once under a finger that is down, unless `voice` or `signal_voice` gave the "
            "slot something else to play."),
    Message(35, "finger_area", (_FINGER,), "", (Field("area", "u8", "255 none."),), "",
            "The area that a finger is in."),
    Message(34, "area_events", (Field("after", "u32", "Number of the first that is asked for."),),
            "", (Field("next", "u32", "Number to go on with."), Field("count", "u8",
                                                                      "That follow.")),
            f"each: at_ms u32, what u8, finger u8, area u8, x_um i32, y_um i32; {MOST_EVENTS} at "
            "most",
            "What fingers did on the bank's areas. Numbers count from the device's start; the last "
            "32 are kept.",
            each=(Field("at_ms", "u32", "Since start."),
                  Field("what", "u8", f"{numbered(c.text for c in AREA_EVENT.members)}."),
                  Field("finger", "u8", "0 to 4."), Field("area", "u8", "255 none."), *_PLACE)),
    Message(36, "driver_change", (Field("driver", "u8", f"{numbered(DRIVER_KINDS)}."),), "", (), "",
            "The next `config_set` may be for these drivers, as coils were rewired. By wire only."),
    Message(37, "reach", (), "", (Field("left_um", "i32", "All 0 without a table."),
                                  Field("bottom_um", "i32", ""), Field("right_um", "i32", ""),
                                  Field("top_um", "i32", "")), "",
            "Where the table's board is. A place off it plays as the nearest on it."),
    Message(38, "sense",
            (Field("playing", "u8", "Channel of the coil that plays."),
             Field("multiple", "u16", f"Of {UNIT_HZ:.6g} Hz, what it plays: even, "
                   f"{LEAST_MULTIPLE} to {MOST_MULTIPLE}."),
             Field("level_q15", "u16", "32767 for full amplitude."),
             Field("settle_ms", "u8", "Before the first coil is listened to."),
             Field("readings", "u8", f"Of 12.5 ms for each coil, 1 to {MOST_READ}.")), "", (), "",
            "One coil plays, and all others are listened to, one after the other. Ends by itself. "
            "Where nothing is asked for 0.8 s, the converter is stopped, and a new session begins "
            "with the next."),
    Message(39, "sensed", (), "",
            (Field("state", "u8", f"{numbered(c.text for c in SENSE_STATE.members)}."),
             Field("playing", "u8", "As it was asked for."), Field("multiple", "u16", "The same."),
             Field("session", "u16", "Readings of one have the converter's delay in common."),
             Field("amplitude_q16", "u16", "Of the duty, 65536 for 1."),
             Field("count", "u8", "That follow.")),
            "each: coil u8, in_phase_q5 i32, quadrature_q5 i32, sum i32, squares_by_256 u32",
            "What coils read while the last that was asked for played: sums over "
            f"{SENSE_PAIRS} pairs of conversions for each reading, both in steps from 2048.",
            each=(Field("coil", "u8", f"Channel that was listened to; {REFERENCE}: a known share "
                        "of the voltage of channel 0, while that plays."),
                  Field("in_phase_q5", "i32", "Of pairs times the cosine that the duty is, 32 "
                        "for 1."),
                  Field("quadrature_q5", "i32", "The same of the cosine a quarter ahead."),
                  Field("sum", "i32", "Of pairs."),
                  Field("squares_by_256", "u32", "Of their squares, over 256."))),
    Message(40, "signal_limit", (_FINGER, Field("most_10nm", "u16", "0.01 µm that an amplitude "
                                                "of 1 may move a finger.")),
            "", (), "", "Of a slot's fingers from their next touch on, after `signal_voice`. Not "
            "now: the table has no responses, or the configuration no coil's force."),
    Message(41, "motion_sense",
            (Field("playing", "u8", "Channel of the coil that plays."),
             Field("multiple", "u16", f"Of {UNIT_HZ:.6g} Hz, what it plays: even, "
                   f"{LEAST_MULTIPLE} to {MOST_MULTIPLE}."),
             Field("level_q15", "u16", "32767 for full amplitude."),
             Field("settle_ms", "u8", "Before the first sample."),
             Field("count", "u16", f"Samples, 1 to {MOST_MOTIONS}.")), "", (), "",
            "One coil plays, and the accelerometer on the panel's bus is read. Ends by itself."),
    Message(42, "motion", (Field("first", "u16", "Sample that is asked for, from 0."),), "",
            (Field("state", "u8", f"{numbered(c.text for c in SENSE_STATE.members)}."),
             Field("playing", "u8", "As it was asked for."), Field("multiple", "u16", "The same."),
             Field("amplitude_q16", "u16", "Of the duty, 65536 for 1."),
             Field("model", "u8", f"{numbered(c.text for c in ACCELEROMETER.members)}."),
             Field("count", "u8", "That follow.")),
            f"each: z i16, found_at u16; {MOTIONS_AT_ONCE} at most",
            "What the accelerometer read while the last coil that was asked for played.",
            each=(Field("z", "i16", "Along its axis z, as it reports it."),
                  Field("found_at", "u16", "When it was found in its memory: samples of the "
                        "outputs since the coil began with phase 0. Up to a turn of the main loop "
                        "late."))),
)  # fmt: skip
BY_NAME = {message.name: message for message in MESSAGES}
