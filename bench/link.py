"""The link: how much of the wire a table gets, and when it plays.

    .venv/bin/python bench/link.py      prints tables

On the emulator's virtual wire and clock, so the numbers do not depend on this machine, but for one
table of streams over UDP, which run in real time. A frame is lost whole, either way, with the
probability given; medians of seven seeds.
"""

from __future__ import annotations

import random
import sys
import time
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.synchronize import Event
from pathlib import Path
from statistics import median

import numpy as np

from chladni.host.device.device import Device
from chladni.host.device.streaming import BUFFER_S, StreamStep
from chladni.host.device.wires.link import LinkError
from chladni.host.device.wires.udp import UdpPort, UdpWire
from chladni.host.device.wires.virtual_port import VirtualPort
from chladni.host.device.wires.wire import EmulatorWire, WireError
from chladni.host.emulation.emulator import Emulator, Hardware
from chladni.host.protocol.network import NetworkSettings
from chladni.tables.format import pack

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from made_up import PacketWire, device_of, make_table, random_table  # noqa: E402
from networked import KEY, UnpunctualPort, late_ms, networked, wave  # noqa: E402

SEEDS = range(7)
UDP_PORT = 50_161
STREAM_S = 60.0
BUFFERS_S = (BUFFER_S, 0.01, 0.02)
LATE_MS = (0.0, 2.0, 5.0, 6.0, 9.0, 15.0)
TIMES = 3
"""Minutes with the default ring: no two are alike on a shared machine."""
TIMER_S, TIMED_S = 0.001, 20.0
FAULTS_KEPT = 16
START_TRIES = 4


def lossy_wire(inner: EmulatorWire, loss: float, seed: int) -> PacketWire:
    """Frames that get lost, both ways; one to the device takes its time all the same."""
    rng = random.Random(seed)
    return PacketWire(
        inner,
        lambda data: b"\x01" * len(data) if rng.random() < loss else data,
        lambda data: b"" if rng.random() < loss else data,
    )


def flash(data: bytes, baud: float, loss: float, seed: int, hardware: Hardware) -> float:
    """Seconds of virtual time until a table plays."""
    emulator = Emulator(device_of(), pack(make_table(np.ones((1, 5)))), hardware=hardware)
    wire = lossy_wire(EmulatorWire(emulator), loss, seed)
    done = Device(wire).flash(data)
    assert done.verified
    return done.seconds


def bench_goodput() -> None:
    """Share of the wire that is the table's."""
    data = pack(random_table(60, 50, 5, 3))
    print("## The link: goodput\n")
    print(
        f"The table's share of the wire's bytes: {len(data):,} bytes, erase time left out, three "
        "pieces of 1,024 bytes under way.\n"
    )
    print("| baud | no loss | 1 % of frames lost | 5 % |")
    print("|---|---|---|---|")
    for baud in (115_200.0, 921_600.0):
        shares = []
        for loss in (0.0, 0.01, 0.05):
            hardware = Hardware(baud=baud, erase_us=0.0)
            seconds = median(flash(data, baud, loss, seed, hardware) for seed in SEEDS)
            shares.append(len(data) / seconds / (baud / 10.0))
        print(f"| {baud:,.0f} | " + " | ".join(f"{100.0 * share:.0f} %" for share in shares) + " |")
    print()


def bench_time_to_play() -> None:
    """From the first byte to a table that plays."""
    data = pack(random_table(7, 7, 5, 3))
    print("## The link: time until a table plays\n")
    print(
        f"A table of {len(data):,} bytes, from the first request to the device's answer that it "
        "plays; one sector to erase.\n"
    )
    print("| flash | 115,200 baud | 921,600 baud |")
    print("|---|---|---|")
    kinds = {
        "typical: 45 ms, 2.5 µs a byte": (45e3, 2.5),
        "worst case: 400 ms, 20 µs a byte": (400e3, 20.0),
    }
    for name, (erase_us, program_us) in kinds.items():
        times = []
        for baud in (115_200.0, 921_600.0):
            hardware = Hardware(baud=baud, erase_us=erase_us, program_us=program_us)
            times.append(1e3 * flash(data, baud, 0.0, 0, hardware))
        print(f"| {name} | " + " | ".join(f"{t:.0f} ms" for t in times) + " |")
    print()


def serve(port: int, stop: Event) -> None:
    """The emulated device on UDP, in a process of its own."""
    network = NetworkSettings("bench", "", KEY, port)
    emulator = Emulator(device_of(), pack(make_table(np.ones((1, 5)))), network=network)
    VirtualPort(emulator).serve(stop.is_set)


def streamed(device: Device, buffer_s: float) -> str:
    """A minute of raw duties: frames, lost ones, underruns, latencies."""
    duties = wave(STREAM_S)
    steps: list[StreamStep] = []
    # A device that hears nothing for 0.1 s ends the stream: then frames are lost.
    with suppress(LinkError):
        steps += device.stream_steps(duties, buffer_s=buffer_s)
    device.stop()
    half, most = np.percentile(late_ms(steps), [50, 99])
    taken = sum(step.taken for step in steps)
    faults = [fault["cause"] for fault in device.faults()].count("stream underrun")
    underruns = f"{faults}" if faults < FAULTS_KEPT else f"{faults} or more"
    return f"{taken:,} | {len(duties) - taken} | {underruns} | {half:.1f} ms | {most:.1f} ms"


def timer_late_ms(seconds: float) -> float:
    """By how much a timer of 1 ms is late at most, with nothing else to do."""
    latest, due = 0.0, time.monotonic()
    end = due + seconds
    while due < end:
        due += TIMER_S
        time.sleep(max(due - time.monotonic(), 0.0))
        latest = max(latest, time.monotonic() - due)
    return 1e3 * latest


def stream_row(buffer_s: float) -> str:
    """A minute of raw duties over UDP loopback, in real time."""
    context = get_context("spawn")
    stop = context.Event()
    process = context.Process(target=serve, args=(UDP_PORT, stop))
    process.start()
    try:
        found = streamed(reached(f"127.0.0.1:{UDP_PORT}"), buffer_s)
    finally:
        stop.set()
        process.join()
    default = " (default)" if buffer_s == BUFFER_S else ""
    return f"| {1e3 * buffer_s:g} ms{default} | {found} | {timer_late_ms(TIMED_S):.1f} ms |"


def reached(address: str) -> Device:
    """The device there, whose process may take some seconds to start."""
    for _ in range(START_TRIES):
        with suppress(WireError):
            return Device(UdpWire(UdpPort(address), KEY))
    raise SystemExit(f"no device at {address}")


def bench_stream() -> None:
    """How early frames reach the pins, and what that costs."""
    print("## The link: raw duties over UDP\n")
    print(
        f"Five channels at carrier/8 for {STREAM_S:.0f} s of real time, loopback, idle machine. "
        "Latency: from the host's call to the pin, the answer's way included (the paper's host: "
        f"10 ms). Last column: how late a timer of 1 ms was, at most, in the {TIMED_S:.0f} s "
        "after. A pause longer than the ring is an underrun.\n"
    )
    print("| in the ring | frames | lost | underruns | latency p50 | p99 | timer late by |")
    print("|---|---|---|---|---|---|---|")
    for buffer_s in (BUFFER_S,) * (TIMES - 1) + BUFFERS_S:
        print(stream_row(buffer_s), flush=True)
    print()


def bench_lateness() -> None:
    """How late a host may be, by the emulator's clock."""
    print("## The link: a host that is late\n")
    print(
        f"The same for {STREAM_S:.0f} s of virtual time, with a host that is late one time in "
        "ten. A ring bears what it holds less one piece of 1.6 ms.\n"
    )
    print("| in the ring | host late by | frames | lost | underruns | latency p50 | p99 |")
    print("|---|---|---|---|---|---|---|")
    for buffer_s in BUFFERS_S:
        for host_ms in LATE_MS:
            port = UnpunctualPort(networked(), late_s=host_ms / 1e3)
            row = streamed(Device(UdpWire(port, KEY)), buffer_s)
            print(f"| {1e3 * buffer_s:g} ms | {host_ms:g} ms | {row} |", flush=True)
    print()


if __name__ == "__main__":
    bench_goodput()
    bench_time_to_play()
    bench_stream()
    bench_lateness()
