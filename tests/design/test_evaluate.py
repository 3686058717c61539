"""One board of a design: what limits forbid, and what weights count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from chladni.design.evaluate import (
    COARSE,
    FINGER_SETS,
    NO_NUMBER_DB,
    completed_board,
    evaluate,
    evaluate_in_full,
    mass_g,
)
from chladni.design.spec import spec_of
from chladni.drives.methods import SEED
from chladni.drives.scoring.as_built import score_together
from chladni.drives.scoring.several_fingers.fingers_score import score_fingers
from chladni.drives.scoring.small_amplitude import SOFT_DB, SoftWave, soft_wave
from chladni.host.manufacture.board_parts import mechanical_parts
from chladni.sim.board.file import load_board, read_document
from chladni.sim.fields.board_plate import first_natural_hz
from conftest import ROOT
from made_specs import small


def test_limits_and_weights_count() -> None:
    spec = spec_of(small(design={"keep_out": [{"at_mm": [0.0, 9.0], "size_mm": [4.0, 4.0]}]}))
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, -4.0]}, {"name": "b", "at_mm": [0.0, 8.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2, 4]},
    }
    inside = evaluate(spec, document, SEED)
    assert inside.broken is not None
    assert "keep_out" in inside.broken
    document["actuators"][1]["at_mm"] = [0.0, 3.0]
    close = evaluate(spec, document, SEED)
    assert close.broken is not None
    # 7 mm apart instead of 8.
    assert "coil_spacing_mm by 12 %" in close.broken
    document["actuators"][1]["at_mm"] = [0.0, 12.0]
    plain = evaluate(spec, document, SEED)
    assert plain.broken is None
    least = 2.0 * first_natural_hz(completed_board(document, COARSE))
    low = evaluate(spec_of(small(design={"first_natural_hz": least})), document, SEED)
    assert low.broken == "first_natural_hz by 50 %"
    high = evaluate(spec_of(small(design={"first_natural_hz": 0.49 * least})), document, SEED)
    assert high.broken is None
    both = {"second_finger_20mm_db": 1.0, "focal_error_mm": 2.0}
    weighed = evaluate(spec_of(small(design={"weights": both})), document, SEED)
    wanted = plain.terms["second_finger_20mm_db"] + 2.0 * plain.terms["focal_error_mm"]
    assert weighed.robust_score == pytest.approx(wanted, abs=1e-9)


def test_a_board_gets_the_floor_that_its_diodes_need() -> None:
    """Without one a diode stops the current of a soft wave, and twice the frequency comes up."""
    known = read_document(ROOT / "boards" / "pad16.toml")
    told = known["electronics"]
    needs = soft_wave(load_board("pad16"))
    assert isinstance(needs, SoftWave)
    plain = known | {"electronics": {k: v for k, v in told.items() if k != "least_duty"}}
    floor = completed_board(plain, COARSE).electronics.least_duty
    assert floor >= needs.continuous_from_duty
    bent = known | {"electronics": told | {"least_duty": 0.01}}
    assert completed_board(bent, COARSE).electronics.least_duty == 0.01
    none = {"resistance_ohm": 15.0, "inductance_mh": 0.0, "force_factor_n_per_a": 1.0}
    hopeless = {key: own for key, own in plain.items() if key != "winding"} | {"coil": none}
    assert completed_board(hopeless, COARSE).electronics.least_duty == 0.0
    wave = soft_wave(completed_board(plain, COARSE))
    assert isinstance(wave, SoftWave)
    assert not wave.is_bent
    # The lowest hundredth with which diodes take 0.4 dB of a soft wave at most.
    assert wave.level_db_at_tenth >= -SOFT_DB
    lower = known | {"electronics": told | {"least_duty": round(floor - 0.01, 2)}}
    bends = soft_wave(completed_board(lower, COARSE))
    assert isinstance(bends, SoftWave)
    assert bends.level_db_at_tenth < -SOFT_DB


def test_a_search_weighs_the_sheet_that_the_parts_list_names() -> None:
    """Round corners are not of it."""
    phone = load_board("phone5")
    rounded = replace(phone, plate=replace(phone.plate, corner_radius=8e-3))
    parts = {own.part: own for own in mechanical_parts(rounded)}
    listed = sum(parts[one].count * (parts[one].mass_g or 0.0) for one in ("plate", "magnet"))
    assert mass_g(rounded) == pytest.approx(listed, rel=1e-6)
    assert mass_g(rounded) < mass_g(phone) - 0.01


def test_what_a_board_keeps_as_built_can_be_weighed() -> None:
    """By the same boards, and the same press, as the last row of `board score --built`."""
    spec = spec_of(small(design={"weights": {"built_20mm_db": 2.0}}))
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, -4.0]}, {"name": "b", "at_mm": [0.0, 12.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2, 4]},
    }
    found = evaluate(spec, document, SEED)
    assert found.broken is None
    kept = score_together(
        completed_board(document, COARSE),
        pitch=spec.settings.pitch,
        samples=spec.settings.samples,
        seed=SEED,
    )
    assert kept.second_finger_20mm_db is not None
    level = kept.second_finger_20mm_db.p10
    assert found.terms["built_20mm_db"] == pytest.approx(level, abs=1e-9)
    # A board without a coil has no micrometres.
    assert kept.finger_um is None
    assert found.terms["built_finger_db"] == NO_NUMBER_DB
    assert found.robust_score == pytest.approx(2.0 * level, abs=1e-9)


@pytest.mark.parametrize(("asked", "is_told"), [(None, False), (0.0, True), (500.0, True)])
def test_several_fingers_are_not_to_get_what_one_would_of_a_focus(
    asked: float | None, is_told: bool
) -> None:
    """Their device plays no focus: what the SPEC says of micrometres counts, of two fingers."""
    design = {"weights": {"fingers_2_db": 1.0}} | ({"finger_um": asked} if is_told else {})
    spec = spec_of(
        small(
            design=design,
            magnet={"radius_mm": 3.0, "height_mm": 4.0, "remanence_t": 1.28},
            winding={"turns": 300, "wire_mm": 0.1, "inner_mm": 3.0, "outer_mm": 8.0}
            | {"height_mm": 1.5, "gap_mm": 1.0},
            fingers={},
            foundation={"stiffness_n_per_mm3": 0.0005},
        )
    )
    document = spec.document | {
        "actuators": [{"name": "a", "at_mm": [0.0, -9.0]}, {"name": "b", "at_mm": [0.0, 9.0]}],
        "electronics": spec.document["electronics"] | {"pwm_pins": [2, 4]},
    }
    found = evaluate(spec, document, SEED)
    assert found.broken is None
    lacking = 0.0
    if asked:
        lacking = 20.0 * np.log10(asked) - found.terms["fingers_um_db"]
        assert lacking > 0.0
    expected = found.terms["fingers_2_db"] - 3.0 * lacking
    assert found.robust_score == pytest.approx(expected, abs=1e-9)
    # No one finger's focus is worked out where none counts.
    assert "finger_db" not in found.terms
    assert evaluate_in_full(spec, SEED, 1, document)[1] is None
    if not is_told:
        both = replace(spec, document=spec.document | {"focus": {}})
        known = evaluate(both, document, SEED)
        assert known.terms["fingers_2_db"] == found.terms["fingers_2_db"]
        assert known.terms["finger_db"] > NO_NUMBER_DB


def test_a_click_counts_as_score_fingers_has_it() -> None:
    """On its own, of two fingers, and the layouts are rated by two as well."""
    spec = spec_of(small(design={"coils": 2, "weights": {"fingers_click_db": 2.0}}))
    assert spec.is_for_several
    assert spec.finger_counts == (2,)
    places = [{"name": "a", "at_mm": [0.0, -9.0]}, {"name": "b", "at_mm": [0.0, 9.0]}]
    document = spec.document | {"actuators": places}
    document["electronics"] = document["electronics"] | {"pwm_pins": [2, 4]}
    found = evaluate(spec, document, SEED)
    assert found.broken is None
    samples = spec.settings.samples
    board = completed_board(document, COARSE)
    sets = FINGER_SETS * samples
    (two,) = score_fingers(board, (2,), sets=sets, samples=samples, seed=SEED, clicks=True).counts
    assert two.perturbed is not None
    assert two.perturbed.click_db is not None
    assert found.terms["fingers_click_db"] == pytest.approx(two.perturbed.click_db.p10, abs=1e-9)
    assert found.robust_score == pytest.approx(2.0 * two.perturbed.click_db.p10, abs=1e-9)
    assert two.click_db is not None
    assert found.score == pytest.approx(2.0 * two.click_db.p10, abs=1e-9)
    tones = spec_of(small(design={"coils": 2, "weights": {"fingers_2_db": 1.0}}))
    assert evaluate(tones, document, SEED).terms["fingers_click_db"] == NO_NUMBER_DB
