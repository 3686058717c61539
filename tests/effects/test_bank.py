"""Effect banks: their bytes, by both readers, and what the firmware makes of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.path import Path as Outline
from scipy import signal

from chladni.effects import Area, Bank, Circle, Clip, Curve, Effect, Noise, Polygon, Tone
from chladni.effects import shipped_effects as shipped
from chladni.effects.bank.areas import Everywhere
from chladni.effects.bank.curves import thinned
from chladni.effects.bank.layout import LARGEST_FILE, MAX_SAMPLES, SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import BankRefusedError, unpack_bank
from chladni.effects.effect import Part
from chladni.effects.low_pass import sections
from chladni.host.emulation._emulator import area_at, bank_status, effect_samples
from chladni.host.protocol.codes import BANK_STATUS
from chladni.sim.errors import InputError
from effects.banks import ALL, BYTES, HUM, with_crc

VERDICTS = {code.text: code.name for code in BANK_STATUS.members}
NO_AREA = 255


def hiss(lasts_s: float) -> Noise:
    return Noise(0.0, lasts_s, Curve.constant(0.5))


def agree(data: bytes) -> str:
    """Both readers' verdict, which must be one."""
    found = VERDICTS[bank_status(data)]
    # What no host writes, and a device can play, is left to the host.
    assert verdict_of(data) in (found, "kOk")
    return found


def verdict_of(data: bytes) -> str:
    try:
        unpack_bank(data)
    except BankRefusedError as error:
        return error.verdict
    # All is well, so it must be for the firmware too.
    assert VERDICTS[bank_status(data)] == "kOk"
    return "kOk"


def test_a_bank_comes_back_as_it_was() -> None:
    found = unpack_bank(BYTES)
    assert (found.name, found.hysteresis_mm, list(found.effects)) == ("all", 1.0, list(ALL.effects))
    for area, again in zip(ALL.areas, found.areas, strict=True):
        assert replace(again, level_db=area.level_db) == area
        assert again.level_db == pytest.approx(area.level_db, abs=2e-3)
    assert found.effects["hum"].loop_s == pytest.approx(HUM.loop_s, abs=0.5 / SIGNAL_HZ)


def test_thirty_effects_and_forty_areas_fit_into_16_kb() -> None:
    """As rich as those that ship, and a rectangle each."""
    effects = {f"{name} {k}": own for k in range(5) for name, own in shipped().items()}
    assert len(effects) >= 30
    areas = tuple(
        Area(f"key {k}", Polygon.rectangle(k, 0.0, k + 1.0, 9.0), press=next(iter(effects)))
        for k in range(40)
    )
    assert len(pack_bank(Bank("large", effects, areas))) < 16 * 1024


@pytest.mark.parametrize("name", [*shipped(), "hum", "recorded"])
def test_the_firmware_makes_the_samples_of_an_effect(name: str) -> None:
    """As Python makes them of what the bank has; noise apart, which each makes of its own.

    The rest is single precision, and a sine of 15 bits: 5e-6 each; a click's three of those.
    """
    effect = {**shipped(), **ALL.effects}[name]
    data = pack_bank(Bank("one", {"own": effect}))
    kept = unpack_bank(data).effects["own"]
    wanted = kept.samples(SIGNAL_HZ)
    found = np.array(effect_samples(data, 0, len(wanted)))
    if any(isinstance(part, Noise) for part in effect.parts):
        assert np.abs(found).max() > 0.1
        return
    assert np.abs(wanted).max() > 0.2
    np.testing.assert_allclose(found, wanted, atol=1e-4)
    # And those are the effect's, up to times that are whole samples, a clip's 8 bits, and half a
    # step of frequency, 0.019 Hz, which turns by 0.12 in a second.
    original = effect.samples(SIGNAL_HZ)[: len(wanted)]
    np.testing.assert_allclose(wanted[: len(original)], original, atol=0.12)


def test_noise_is_noise_of_the_amplitude_asked_for() -> None:
    """Even from -1 to 1, so its variance is a third; white, so the low-pass leaves its share."""
    lasts_s = 20.0
    effect = Effect("hiss", (hiss(lasts_s),))
    data = pack_bank(Bank("one", {"own": effect}))
    found = np.array(effect_samples(data, 0, round(lasts_s * SIGNAL_HZ)))
    impulse = np.zeros(2000)
    impulse[0] = 1.0
    share = float((signal.sosfilt(sections(SIGNAL_HZ), impulse) ** 2).sum())
    # 49,000 samples, of which a fifth are independent: 2 % off at one sigma of its variance.
    assert found.std() == pytest.approx(0.5 * np.sqrt(share / 3.0), rel=0.05)
    assert abs(found.mean()) < 0.01


def test_what_is_held_goes_round_its_loop() -> None:
    """From 0.2 s back to 0.1: amplitude and frequency come again each 0.1 s, and no phase jumps."""
    data = pack_bank(Bank("one", {"own": Effect("t", HUM.parts[:1], HUM.loop_s)}))
    loop = round(0.1 * SIGNAL_HZ)
    held = np.array(effect_samples(data, 0, 12 * loop, is_held=True))
    once = np.array(effect_samples(data, 0, 12 * loop))
    behind = round(0.21 * SIGNAL_HZ)
    assert np.abs(held[: 2 * loop] - once[: 2 * loop]).max() < 1e-6
    assert np.abs(once[round(0.33 * SIGNAL_HZ) :]).max() < 1e-4
    envelope = np.abs(signal.hilbert(held))
    inner = envelope[behind:-loop]
    again = envelope[behind + loop :]
    np.testing.assert_allclose(inner[loop:], again[loop : len(inner)], atol=0.08)
    # A wave of 145 Hz at 0.6 turns by 0.37 of a radian a sample.
    assert np.abs(np.diff(held)).max() < 0.6 * 2.0 * np.pi * 150.0 / SIGNAL_HZ


@settings(max_examples=300, deadline=None)
@given(data=st.data())
def test_both_readers_agree_on_mangled_banks(data: st.DataObject) -> None:
    mangled = bytearray(BYTES)
    for _ in range(data.draw(st.integers(1, 3))):
        mangled[data.draw(st.integers(0, len(BYTES) - 5))] = data.draw(st.integers(0, 255))
    agree(with_crc(bytes(mangled)))


def test_every_byte_at_its_limits_is_judged_alike() -> None:
    refused = 0
    for at in range(len(BYTES) - 4):
        for value in (0x00, 0xFF, BYTES[at] ^ 0x01, BYTES[at] ^ 0x80):
            changed = BYTES[:at] + bytes([value]) + BYTES[at + 1 :]
            refused += agree(with_crc(changed)) != "kOk"
    assert refused > len(BYTES)


def test_a_cut_or_flipped_bank_is_refused_by_both() -> None:
    for size in range(len(BYTES)):
        assert agree(BYTES[:size]) != "kOk"
    for at in range(len(BYTES)):
        flipped = BYTES[:at] + bytes([BYTES[at] ^ 0x10]) + BYTES[at + 1 :]
        assert agree(flipped) != "kOk"


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Bank("b" * 16, {}), "bank name: expected 1 to 15 printable ASCII letters"),
        (lambda: Area("ü"), "area name: expected 1 to 15 printable ASCII letters"),
        (lambda: Area("a", press="click", level_db=1.0), "level_db: expected -60 to 0"),
        (lambda: Area("a", every_mm=3.0), "every_mm: expected an effect for hold beside it"),
        (lambda: Area("a", hold="x", every_mm=0.1), "every_mm: expected 0, or 0.2"),
        (lambda: Area("a", along="z"), "along: expected one of path, x, y"),
        (lambda: Area("a", hold="x", along="y"), "along: expected every_mm beside it"),
        (lambda: Circle((0.0, 0.0), 0.1), "circle_mm: expected a radius of 0.5 mm or more"),
        (lambda: Circle((0.0, float("nan")), 3.0), "place: expected -500 to 500 mm"),
        (lambda: Polygon(((0.0, 0.0), (9.0, 0.0))), "polygon_mm: expected 3 to 32 corners"),
        (lambda: Polygon.rectangle(0.0, 0.0, 0.1, 0.1), "polygon_mm: expected 0.5 mm at least"),
        (
            lambda: Polygon(((0.0, 0.0), (9.0, 9.0), (9.0, 0.0), (0.0, 9.0))),
            "polygon_mm: expected sides that do not cross, got 'sides 0 and 2'",
        ),
        (
            lambda: Polygon(((0.0, 0.0), (9.0, 0.0), (4.0, 0.0), (4.0, 9.0))),
            "polygon_mm: expected sides that do not cross, got 'sides 0 and 1'",
        ),
        (
            lambda: Bank("b", {}, (Area("a", press="clack"),)),
            "area a.press: expected one of",
        ),
        (
            lambda: Bank("b", {}, (Area("a", Circle((0.0, 0.0), 3.0)), Area("a"))),
            "area: expected names that differ, got 'a'",
        ),
        (
            lambda: Bank("b", {}, (Area("a"), Area("c", Circle((0.0, 0.0), 3.0)))),
            "area a: expected a shape, or the last place",
        ),
        (
            lambda: pack_bank(Bank("b", {"long": Effect("l", (hiss(60.0),))})),
            "effect long: expected 26.8 s at most in a bank, got '60 s'",
        ),
        (
            lambda: pack_bank(Bank("b", {"e": Effect("e", HUM.parts * 9)})),
            "effect e: expected 16 at most, got 'more tones'",
        ),
        (
            lambda: pack_bank(Bank("b", {"e": Effect("e", HUM.parts, (0.1, 9.0))})),
            "effect e.loop_ms: expected from before to, within it",
        ),
        (
            lambda: pack_bank(
                Bank("b", {"e": Effect("e", (Clip(0.0, np.ones(MAX_SAMPLES - 1), SIGNAL_HZ),))})
            ),
            f"bank: expected {LARGEST_FILE:,} at most",
        ),
    ],
)  # fmt: skip
def test_what_no_device_can_keep_is_refused(make: object, said: str) -> None:
    with pytest.raises(InputError) as raised:
        make()  # type: ignore[operator]
    assert said in str(raised.value)


def test_an_area_off_the_board_is_named() -> None:
    bank = Bank("b", {}, (Area("edge", Circle((30.0, 0.0), 6.0)), Area("rest", Everywhere())))
    bank.check_on(72.0, 146.0)
    with pytest.raises(InputError, match="area edge: expected within the board, 70 × 146 mm"):
        bank.check_on(70.0, 146.0)


@settings(max_examples=60, deadline=None)
@given(
    corners=st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=3, max_size=9),
    places=st.lists(
        st.tuples(st.integers(-35, 35), st.integers(-35, 35)), min_size=20, max_size=20
    ),
)
def test_a_place_is_in_the_polygon_that_it_is_in(
    corners: list[tuple[int, int]], places: list[tuple[int, int]]
) -> None:
    """By Matplotlib's own reckoning, at places beside the grid, so that none is on a side."""
    try:
        polygon = Polygon(tuple((float(x), float(y)) for x, y in corners))
    except InputError:
        return
    data = pack_bank(Bank("b", {}, (Area("own", polygon),)))
    outline = Outline(polygon.corners_mm)
    for x, y in places:
        place = (x + 0.0257, y + 0.0113)
        wanted = 0 if outline.contains_point(place) else NO_AREA
        assert area_at(data, round(1e3 * place[0]), round(1e3 * place[1])) == wanted


def test_a_finger_leaves_its_area_only_beyond_the_hysteresis() -> None:
    sides = (Polygon.rectangle(-10.0, -5.0, 0.0, 5.0), Polygon.rectangle(0.0, -5.0, 10.0, 5.0))
    bank = Bank(
        "b", {}, (Area("a", sides[0]), Area("b", sides[1]), Area("c", Circle((0.0, 20.0), 5.0)))
    )
    data = pack_bank(bank)
    # Across the border between two keys and back, 1 mm each way.
    assert [area_at(data, x, 0, 0) for x in (-10, 500, 999, 1001)] == [0, 0, 0, 1]
    assert [area_at(data, x, 0, 1) for x in (10, -10)] == [1, 0]
    # Off the outer edge, round a corner, and off a circle.
    assert [area_at(data, -11_000 - k, 0, 0) for k in (-1, 1)] == [0, NO_AREA]
    corner = round(1e3 / np.sqrt(2.0))
    assert area_at(data, -10_000 - corner + 5, -5000 - corner + 5, 0) == 0
    assert area_at(data, -10_000 - corner - 5, -5000 - corner - 5, 0) == NO_AREA
    assert [area_at(data, 0, 26_000 + k, 2) for k in (-1, 1)] == [2, NO_AREA]


@settings(max_examples=50, deadline=None)
@given(
    values=st.lists(st.integers(0, 32767), min_size=2, max_size=60),
    tolerance=st.integers(0, 4000),
)
def test_a_thinned_curve_passes_within_its_tolerance(values: list[int], tolerance: int) -> None:
    at = np.arange(len(values)) * 7
    own = np.array(values)
    kept = thinned(at, own, tolerance)
    line = np.interp(at, at[kept], own[kept])
    assert np.abs(line - own).max() <= tolerance
    assert {0, len(values) - 1} <= set(kept.tolist())


def test_a_long_recording_of_an_envelope_comes_down_to_few_points() -> None:
    """A bell of 2,000 breakpoints, within 0.2 %."""
    times = np.linspace(0.0, 5.0, 2000)
    bell = np.exp(-((times - 2.5) ** 2))
    tone = Tone(0.0, 5.0, Curve(tuple(times), tuple(bell)), Curve.constant(150.0))
    data = pack_bank(Bank("b", {"bell": Effect("bell", (tone,))}))
    assert len(data) < 500
    found = unpack_bank(data).effects["bell"].parts[0]
    assert isinstance(found, Tone)
    np.testing.assert_allclose(found.amplitude.at(times), bell, atol=3e-3)


@pytest.mark.parametrize(
    "parts",
    [
        (Tone(0.1, 0.1, Curve.constant(1.0), Curve.constant(160.0)),),
        (Clip(0.0, np.array([0.5]), 8000.0),),
        (Clip(0.2, np.array([0.3, 0.4]), 40_000.0), *HUM.parts),
        (Clip(0.0, np.array([0.0, 5.0, 0.0]), 900.0),),
    ],
    ids=["no length", "one sample", "less than a sample, at the end", "a peak between samples"],
)
def test_what_is_packed_is_read(parts: tuple[Part, ...]) -> None:
    """Whatever the parts are, the bank is one that a device takes."""
    data = pack_bank(Bank("b", {"own": Effect("own", parts)}))
    assert agree(data) == "kOk"
    made = np.array(effect_samples(data, 0, 1000))
    assert np.abs(made).max() <= 1.0 + 1e-6


def test_a_saw_tooth_stays_one() -> None:
    """Steps between equal values: 1 down to 0, at once back to 1, and on."""
    saw = Curve((0.0, 0.05, 0.05, 0.1), (1.0, 0.0, 1.0, 1.0))
    effect = Effect("saw", (Tone(0.0, 0.1, saw, Curve.constant(100.0)),))
    (kept,) = unpack_bank(pack_bank(Bank("b", {"saw": effect}))).effects["saw"].parts
    assert isinstance(kept, Tone)
    times = np.array([0.01, 0.025, 0.045, 0.055, 0.09])
    np.testing.assert_allclose(kept.amplitude.at(times), saw.at(times), atol=0.01)


def test_corners_that_a_device_cannot_tell_apart_are_refused() -> None:
    thin = Polygon(((0.0, 0.0), (10.0, 0.0), (10.0, 0.0001), (0.0, 9.0)))
    with pytest.raises(InputError):
        pack_bank(Bank("b", {}, (Area("thin", thin),)))
