"""What people are told in place of a key: words, the unit, or nothing.

A key that is not here keeps its own words; its unit, if its end is one, goes to the value.
"""

from __future__ import annotations

UNITS = {
    "mm": "mm", "mm2": "mm²", "um": "µm", "db": "dB", "hz": "Hz", "ms": "ms", "us": "µs", "s": "s",
    "deg": "°", "g": "g", "ma": "mA", "k": "K", "m_s2": "m/s²", "mh": "mH", "ohm": "Ω",
    "n_per_mm3": "N/mm³", "n_per_mm": "N/mm", "n_per_a": "N/A", "n": "N", "m": "m",
}  # fmt: skip
"""By the end of a key; the longest that fits counts."""
WORDS = {
    "ssim": "SSIM (1: as wanted)",
    "ssim_table": "SSIM of the table's own drive",
    "focal_error_mm": "maximum off the finger",
    "centroid_error_mm": "centre of what is loud off the finger",
    "contrast_db": "the finger's place over the rest",
    "contrast_limit_db": "the most that any drive reaches",
    "second_finger_db": "the finger over any other",
    "second_finger_16mm_db": "over any 16 mm away",
    "second_finger_20mm_db": "over any 20 mm away",
    "second_finger_25mm_db": "over any 25 mm away",
    "above_second_finger": "share of places above every other finger",
    "louder_fraction": "share of the board that moves more",
    "spot_mm2": "area above half the maximum",
    "movable": "coils can move the place",
    "finger_um": "under the finger (coils at their limit)",
    "full_volts": "at the loudest coil, V",
    "sensation_db": "above the threshold of feeling",
    "static_um": "bent by the coils' bias",
    "finger_load": "pressing changes",
    "level_db": "level",
    "error_estimate": "estimated error of the fields",
    "tolerance_met": "as exact as fields should be",
    "modes_used": "functions in the sum",
    "baselines": "SSIM to compare",
    "silent": "nothing moves",
    "nearest_actuator": "nearest coil alone",
    "misplaced": "a focus elsewhere",
    "latency_ms": "touch to first duty",
    "gain_error_db": "gain off by",
    "phase_error_deg": "phase off by",
    "settled": "settled (1: the table's drive)",
    "target_mm": "finger at",
    "at_ms": "at",
    "fingers": "a finger",
    "ssim_mean": "SSIM, mean over regions",
    "ssim_min": "SSIM, least",
    "is_within_limits": "loses as little as it may",
    "nearer_by_0_1_mm": "force, 0.1 mm nearer: share more",
    "farther_by_0_1_mm": "force, 0.1 mm farther: share more",
    "softened": "share of the hold that magnets take",
    "fill": "share of the winding that is copper",
    "distortion_at_peak": "distortion there",
    "correlation_at_end": "wave similarity at the last frequency",
    "peak_hz": "loudest at",
    "peak_m_s2": "with",
    "ssim_loss_p99": "SSIM lost at 99 % of regions",
    "ssim_loss_max": "SSIM lost at most",
    "field_error_db_max": "field off by at most, dB",
    "second_finger_loss_db_max": "second finger lost at most, dB",
    "between_ssim_loss_p99": "between regions: SSIM lost at 99 %",
    "between_ssim_loss_max": "between regions: SSIM lost at most",
    "between_field_error_db_max": "between regions: field off by at most, dB",
    "between_second_finger_loss_db_max": "between regions: second finger lost at most, dB",
    "ssim_pressed": "SSIM while it presses",
    "looks_better_than_it_is": "places with a good SSIM and no focus",
    "compensated": "drives make up for the finger",
    "perturbed": "boards within tolerances",
    "bits": "bits of a stored integer",
    "labels": "labels (drives are mixed within one)",
    "full_scale_gain": "largest gain",
}
UNITLESS = frozenset({"nearer_by_0_1_mm", "farther_by_0_1_mm"})
LEFT_OUT = frozenset({
    "details", "evaluations", "seed", "diffraction_spot_mm",
    "steps_before", "steps_after", "steps_within", "sections", "measured_regions",
    "measured_between", "sfdr_db", "edge_sfdr_db", "um_per_newton", "full_amperes",
})  # fmt: skip
"""For programs, which have them by --json: what takes a page of docs to mean anything."""


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
