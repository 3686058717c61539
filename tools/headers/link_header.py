"""The link's C++ header and its page in the documentation, from one declaration."""

from __future__ import annotations

from headers import cpp_text

from chladni.host.protocol import link as link_protocol
from chladni.host.protocol import network as network_format
from chladni.host.protocol.config import DeviceConfig
from chladni.tables import layout


def link_header() -> str:
    """`link_format.hpp`: frames and statuses."""
    values = {
        "kVersionMajor": link_protocol.VERSION_MAJOR,
        "kVersionMinor": link_protocol.VERSION_MINOR,
        "kMaxPayload": link_protocol.MAX_PAYLOAD,
        "kIsolationSteps": link_protocol.ISOLATION_STEPS,
        "kSensePairs": link_protocol.SENSE_PAIRS,
        "kSenseMillihertz": round(1e3 * link_protocol.UNIT_HZ),
        "kReference": link_protocol.REFERENCE,
        "kLeastMultiple": link_protocol.LEAST_MULTIPLE,
        "kMostMultiple": link_protocol.MOST_MULTIPLE,
        "kMostRead": link_protocol.MOST_READ,
        "kMostMotions": link_protocol.MOST_MOTIONS,
        "kMotionsAtOnce": link_protocol.MOTIONS_AT_ONCE,
        "kLeastTarget": link_protocol.LEAST_TARGET,
        "kMostTarget": link_protocol.MOST_TARGET,
        "kMostEvents": link_protocol.MOST_EVENTS,
        "kWindow": link_protocol.WINDOW,
        "kHeadBytes": link_protocol.HEAD_BYTES,
        "kCrcBytes": link_protocol.CRC_BYTES,
        "kMaxFrame": link_protocol.MAX_FRAME,
        "kSilenceMs": link_protocol.SILENCE_MS,
        "kUpdateSilenceMs": link_protocol.UPDATE_SILENCE_MS,
        "kTouchSilenceMs": link_protocol.TOUCH_SILENCE_MS,
        "kResponse": link_protocol.RESPONSE,
    }
    body = [
        *cpp_text.constants(values),
        "",
        "enum class Status : uint8_t {",
        *(
            f"  k{cpp_text.camel(status.name.lower())} = {status.value},"
            f"  // {link_protocol.STATUS_TEXT[status]}"
            for status in link_protocol.Status
        ),
        "};",
    ]
    about = "Frames between host and device (docs/link-protocol.md), little-endian."
    return cpp_text.header(about, "chladni::link_format", body)


def messages_header() -> str:
    """`link_messages.hpp`: what is read of each request, and what is written of each answer."""
    body = [
        "// What is read is plain. In what is written every field has a type of its own: an answer",
        "// in which one is left out, comes twice or stands elsewhere does not compile.",
    ]
    for message in link_protocol.MESSAGES:
        body += ["", f"namespace {message.name} {{", f"constexpr uint32_t kCode = {message.code}U;"]
        if message.request:
            body += read_struct("Request", message.request)
        if message.answer:
            body += written_struct("Answer", message.answer)
        if message.each:
            of_tail = written_struct if message.answer_tail else read_struct
            body += of_tail("Entry", message.each)
        body.append(f"}}  // namespace {message.name}")
    return cpp_text.header(
        "Requests, answers, and entries of their tails (docs/link-protocol.md).",
        "chladni::link_format",
        body,
        includes=("array", "cstdint"),
    )


def _comment(field: layout.Field) -> str:
    return f"  // {field.doc}" if field.doc else ""


def _bytes_of(fields: tuple[layout.Field, ...]) -> str:
    size = sum(field.size for field in fields)
    return f"  static constexpr uint32_t kBytes = {size}U;"


def read_struct(name: str, fields: tuple[layout.Field, ...]) -> list[str]:
    """A struct of what the device reads, and the function that reads it through `take`."""
    places = layout.offsets(fields)
    return [
        f"struct {name} {{",
        _bytes_of(fields),
        *(f"  {cpp_text.cpp_type(f)} {f.name};{_comment(f)}" for f in fields),
        "};",
        f"template <typename Take> {name} read_{name.lower()}(const uint8_t* from, Take take) {{",
        f"  {name} found{{}};",
        *(f"  take(from + {places[f.name]}, found.{f.name});" for f in fields),
        "  return found;",
        "}",
    ]


def written_struct(name: str, fields: tuple[layout.Field, ...]) -> list[str]:
    """A struct of what the device writes, and the function that writes it through `put`."""
    places = layout.offsets(fields)
    return [
        f"struct {name} {{",
        _bytes_of(fields),
        *(
            f"  struct {cpp_text.camel(f.name)} {{ {cpp_text.cpp_type(f)} value; }} {f.name};"
            f"{_comment(f)}"
            for f in fields
        ),
        "};",
        f"template <typename Put> void write(const {name}& from, uint8_t* to, Put put) {{",
        *(f"  put(to + {places[f.name]}, from.{f.name}.value);" for f in fields),
        "}",
    ]


def network_header() -> str:
    """`network_format.hpp`: the network record, datagrams, and where their fields stand."""
    values = {
        "kVersion": network_format.VERSION,
        "kRecordMagic": int.from_bytes(network_format.RECORD_MAGIC, "little"),
        "kRecordBytes": network_format.RECORD_BYTES,
        "kKeyBytes": network_format.KEY_BYTES,
        "kSsidBytes": network_format.SSID_BYTES,
        "kPassphraseBytes": network_format.PASSPHRASE_BYTES,
        "kLowestPort": network_format.LOWEST_PORT,
        "kDatagramMagic": network_format.DATAGRAM_MAGIC,
        "kHeadBytes": network_format.HEAD.size,
        "kMacBytes": network_format.MAC_BYTES,
        "kHelloBytes": network_format.HELLO_BYTES,
        "kMaxDatagram": network_format.MAX_DATAGRAM,
        "kSessionSilenceMs": network_format.SESSION_SILENCE_MS,
        "kRenewAt": network_format.RENEW_AT,
    }
    return cpp_text.header(
        "The network record in flash, and datagrams (docs/security.md), little-endian.",
        "chladni::network_format",
        [
            *cpp_text.constants(values),
            *cpp_text.field_offsets("kRecordAt", network_format.RECORD_FIELDS),
            *cpp_text.field_offsets("kAt", network_format.DATAGRAM_FIELDS),
            "",
            "enum class Kind : uint8_t {",
            *(
                f"  k{cpp_text.camel(kind.name.lower())} = {kind.value},"
                for kind in network_format.Kind
            ),
            "};",
        ],
    )


PAGE = """\
# The link

<!-- Generated by tools/generate_headers.py from host/chladni/host/protocol/link.py. -->

Host and device talk over UART0, at {baud} baud unless `link_baud` is set otherwise, or over UDP,
where a datagram takes the place of a frame ([security](security.md)). This is version
{major}.{minor}. All numbers are little-endian.

```text
frame    00  COBS( kind u8 | sequence u8 | fields | tail | CRC-32 of all before )  00
answer   kind + 80h, the request's sequence, status u8, then fields and tail
```

A tail has at most {payload} bytes. A frame that stops for {silence} ms is dropped. Bytes between
frames are text: the boot loader's, a panic's, the console's. Garbage costs at most the frame that
follows it.

A request that comes again byte by byte is answered again and not done twice. One of the same kind
and number with other bytes, of another program, is a request of its own. Lines of text that come
faster than half the wire takes their answers are not run.

Up to {window} `table_data` may be under way at once. One that comes twice or out of order does no
harm. The host waits for the answer of any other request before it sends the next one. An update
that gets no data for {update} s is dropped, and the old table plays on.
"""


def link_page() -> str:
    """docs/link-protocol.md."""
    lines = [
        PAGE.format(
            major=link_protocol.VERSION_MAJOR,
            minor=link_protocol.VERSION_MINOR,
            baud=DeviceConfig()["link_baud"],
            payload=link_protocol.MAX_PAYLOAD,
            silence=link_protocol.SILENCE_MS,
            window=link_protocol.WINDOW,
            update=link_protocol.UPDATE_SILENCE_MS // 1000,
        ),
        "| code | request | fields | tail | answer | tail | |",
        "|---|---|---|---|---|---|---|",
    ]

    def cells(fields: tuple[layout.Field, ...]) -> str:
        return ", ".join(f"`{field.name}` {field.kind}" for field in fields)

    for m in link_protocol.MESSAGES:
        row = (
            m.code,
            f"`{m.name}`",
            cells(m.request),
            m.request_tail,
            cells(m.answer),
            m.answer_tail,
            m.doc,
        )
        lines.append("| " + " | ".join(map(str, row)) + " |")
    lines += ["", "| status | | |", "|---|---|---|"]
    lines += [
        f"| {status.value} | {status.name.lower()} | {link_protocol.STATUS_TEXT[status]} |"
        for status in link_protocol.Status
    ]
    return "\n".join([*lines, ""])
