"""What people read in place of a key: words and the unit, or nothing.

A key that is not here keeps its own words; its unit, if its end is one, goes to the value.
"""

from __future__ import annotations

from typing import Any

UNITS = {
    "mm": "mm", "mm2": "mm²", "cm2": "cm²", "um": "µm", "db": "dB", "hz": "Hz", "ms": "ms",
    "us": "µs", "s": "s",
    "deg": "°", "g": "g", "ma": "mA", "k": "K", "m_s2": "m/s²", "mh": "mH", "ohm": "Ω",
    "n_per_mm3": "N/mm³", "n_per_mm": "N/mm", "n_per_a": "N/A", "n": "N", "m": "m", "usd": "US$",
    "um_per_n": "µm/N",
}  # fmt: skip
"""By the end of a key; the longest that fits counts."""
WORDS = {
    "ssim": "similarity to the target (SSIM)",
    "ssim_table": "SSIM of the table's own drive",
    "focal_error_mm": "distance from finger to maximum",
    "centroid_error_mm": "distance from finger to loud area",
    "contrast_db": "contrast of the finger's place to the rest",
    "contrast_limit_db": "contrast limit of all drives",
    "second_finger_db": "level over fingers 12 mm away",
    "second_finger_16mm_db": "level over fingers 16 mm away",
    "second_finger_20mm_db": "level over fingers 20 mm away",
    "second_finger_25mm_db": "level over fingers 25 mm away",
    "click_20mm_db": "the same of a click, pressed with 1 N",
    "nearest_coil_20mm_db": "the nearest coil alone, 20 mm away",
    "nearest_second_finger_db": "level over fingers 12 mm away, nearest coil alone",
    "above_second_finger": "share of places louder than any other finger",
    "louder_fraction": "share of the board louder than the finger",
    "spot_mm2": "area above half the maximum",
    "movable": "coils can move the place",
    "finger_um": "largest displacement under the finger",
    "played_um": "displacement under the finger in the recording",
    "full_volts": "voltage at the loudest coil, V",
    "sensation_db": "level above the threshold of feeling",
    "static_um": "steady deflection by the coils' bias",
    "finger_load": "pressing adds",
    "level_db": "level",
    "of_loudest_db": "level, of the loudest that the coils' limits allow there",
    "neighbours": "magnets all the same way up",
    "lateral_n": "largest push along the plate",
    "held_n_per_mm": "stiffness that holds them",
    "link": "link protocol",
    "supply_ma": "draws",
    "expected_ma": "expected",
    "full_current_ma": "at full duty",
    "supply_limit_ma": "limit in all",
    "level_change_db": "level changes by up to",
    "isolation_change_db": "isolation at the worst tenth changes by",
    "over_other_effect_db": "its peak over what it gets of the other's effect",
    "isolation_db": "own signal over its share at the others",
    "two_fingers": "two pressing fingers",
    "one_finger": "one pressing finger alone",
    "fingers_2_db": "two fingers pressing, own signal over its share at the other",
    "fingers_3_db": "of three",
    "fingers_4_db": "of four",
    "fingers_5_db": "of five",
    "fingers_click_db": "a click in place of a tone",
    "click_db": "a click in place of a tone",
    "click_um": "peak of a click",
    "fingers_um": "each of several fingers gets",
    "left": "misfit of the readings, over their noise",
    "device_seconds": "time that the device took, s",
    "over_promised_db": "own level over what the board, as it is known, promises",
    "told": "determined by the readings",
    "score": "score as drawn: what [design.weights] add up to, dB",
    "robust_score": "score within tolerances, by which boards are compared, dB",
    "plate_and_magnets_g": "mass of plate, film and magnets",
    "beside_mm": "fingers lie beside their places",
    "unfelt": "share that feels nothing of the others, at rest",
    "unfelt_pressing": "share that feels nothing of the others, pressing",
    "error_estimate": "estimated error of the fields",
    "tolerance_met": "fields within the tolerance",
    "modes_used": "functions in the sum",
    "baselines": "SSIM for comparison",
    "silent": "nothing moves",
    "nearest_actuator": "nearest coil alone",
    "misplaced": "misplaced focus",
    "other_peak_um": "peak under the other finger",
    "worst_at_mm": "the least of it at",
    "second_finger_20mm_at_mm": "where that is, mm",
    "second_finger_20mm_um": "most under another finger, 20 mm away or farther",
    "just_felt_um": "the least that a resting finger feels",
    "bias_um": "the most that switches' biases move it before and after",
    "bias_duty": "duty at which that bias stands",
    "rested": "rested before its effect, so that the bias stood",
    "mass_g": "mass of each",
    "first_ms": "from the panel's report to the first duty",
    "rise_ms": "from the first duty to 90 % of the peak",
    "envelope_error_db": "its level over time (envelope) is off by up to",
    "fewest_waiting": "fewest samples that waited on the device",
    "latency_ms": "time from touch to first duty",
    "reported_ms": "of which until the panel reports the touch",
    "settled": "settled (1: the table's drive)",
    "target_mm": "finger at",
    "at_ms": "at",
    "fingers": "under a finger",
    "ssim_mean": "SSIM, mean over regions",
    "ssim_min": "SSIM, lowest of all regions",
    "is_within_limits": "losses within the limits",
    "nearer_by_0_1_mm": "change of force, magnet 0.1 mm nearer (share)",
    "farther_by_0_1_mm": "change of force, magnet 0.1 mm farther (share)",
    "softened": "share of the support's stiffness lost to the magnets",
    "fill": "share of the winding that is copper",
    "correlation_at_end": "wave similarity at the last frequency",
    "foam_length_mm": "foam length (4D/k)^¼, over which a force's field decays",
    "waves": "coil on its latch alone",
    "plate": "plate under the coil",
    "loudest_hz": "loudest at",
    "loudest_m_s2": "acceleration there",
    "modes_hz": "natural frequencies",
    "first_natural_hz": "first natural frequency",
    "peak_hz": "peak at",
    "peak_m_s2": "acceleration at the peak",
    "ssim_loss_p99": "SSIM loss at 99 % of regions",
    "ssim_loss_max": "largest SSIM loss",
    "field_error_db_max": "largest field error, dB",
    "second_finger_loss_db_max": "largest loss of second finger, dB",
    "between_ssim_loss_p99": "between regions: SSIM loss at 99 %",
    "between_ssim_loss_max": "between regions: largest SSIM loss",
    "between_field_error_db_max": "between regions: largest field error, dB",
    "between_second_finger_loss_db_max": "between regions: largest loss of second finger, dB",
    "ssim_pressed": "SSIM while a finger presses",
    "looks_better_than_it_is": "places with a good SSIM and no focus",
    "compensated": "drives compensate the finger's load",
    "continuous_from_duty": "duty from which a coil's current never stops",
    "least_duty": "lowest duty of a wave",
    "shortest_on_ns": "shortest pulse, a device's min_on_ns, ns",
    "level_db_at_tenth": "level at a tenth of full amplitude, dB of what it should be",
    "lost_duty": "duty that a bridge loses of each pulse",
    "given_back_duty": "duty that the firmware gives back",
    "third_harmonic_at_tenth": "its third harmonic (share), by what is left",
    "second_harmonic": "twice the frequency",
    "own_db": "under the finger, dB re displacement there",
    "other_20mm_db": "under the loudest finger 20 mm away, dB re finger",
    "second_harmonic_at_tenth": "its second harmonic (share)",
    "built": "as built",
    "nominal": "as drawn",
    "nearest_coil": "nearest coil alone",
    "film": "under a film of 0.125 mm PET",
    "newtons": "a finger presses with, N",
    "pressed": "pressed with N",
    "pressed_mm": "indentation of the sheet",
    "warm": "coils warm",
    "stretched": "a thin sheet bent by the fingers",
    "foam_twice": "foam twice as stiff",
    "together": "all at once: film, pressed, warm, foam up to 3 times as stiff, within tolerances",
    "board_w": "heat in all coils, W",
    "board_k": "the board above the air, K",
    "magnet_k": "its warmest magnet above the air, K",
    "border": "on the border of the active area",
    "perturbed": "boards within tolerances",
    "bits": "bits of a stored integer",
    "labels": "labels (drives are interpolated within one)",
    "full_scale_gain": "largest gain",
    "response_um_per_n": "response",
    "full_scale_um_per_n": "largest response",
    "own_full_scale_um_per_n": "largest own compliance of a fingertip",
    "force_ratio": "measured force over the drawn one",
    "full_force_n": "continuous force of a coil",
    "threshold_um": "displacement that is just felt",
    "own_um_per_n": "a fingertip's own compliance",
    "own_phase_deg": "its phase",
    "responses_hz": "responses at",
    "isolation_lost_db": "isolation lost by rounding and interpolation",
    "exact_isolation_db": "the same with exact responses",
}
UNITLESS = frozenset({"nearer_by_0_1_mm", "farther_by_0_1_mm"})
LEFT_OUT = frozenset({
    "room_for",
    "price_usd",
    "details", "evaluations", "seed", "diffraction_spot_mm",
    "steps_before", "steps_after", "steps_within", "sections", "measured_regions",
    "measured_between", "sfdr_db", "edge_sfdr_db", "um_per_newton", "full_amperes",
})  # fmt: skip
"""For programs, which have them by --json: what takes a page of docs to mean anything."""


def of_loudest(result: dict[str, Any]) -> dict[str, Any]:
    """A result in which several fingers' levels say what they are levels of.

    Under one finger `level_db` is a change; programs know both by that key.
    """
    name = {"level_db": "of_loudest_db"} if "isolation_db" in result else {}
    return {
        name.get(key, key): of_loudest(value) if isinstance(value, dict) else value
        for key, value in result.items()
    }


def words_of(key: str) -> str:
    """A key in words, without its unit."""
    unit = _unit_key(key)
    return WORDS.get(key) or (key.removesuffix(f"_{unit}") if unit else key).replace("_", " ")


def unit_of(key: str) -> str:
    """Its unit, or nothing."""
    unit = _unit_key(key)
    return UNITS[unit] if unit else ""


def _unit_key(key: str) -> str:
    if key in UNITLESS:
        return ""
    return max((unit for unit in UNITS if key.endswith(f"_{unit}")), key=len, default="")
