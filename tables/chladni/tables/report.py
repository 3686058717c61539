"""What a table came to: SSIM over its regions, what integers lose, how smooth its drives are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.tables.felt_survey import Fingers
from chladni.tables.halfway_points import OWN_TOLERANCE
from chladni.tables.one_frequency import LossesOfTable, OneFrequency
from chladni.tables.phase_synchronisation import Steps
from chladni.tables.quantisation_loss import LIMITS, Losses
from chladni.tables.table import Table

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Quality:
    """SSIM of drives as the firmware plays them, and what their integers lose.

    Attributes
    ----------
    ssim_mean, ssim_min
        Over the regions that were measured.
    ssim_loss_p99, ssim_loss_max
        SSIM lost there against the unrounded drives: the 99th percentile, and the worst.
    field_error_db_max
        20·log₁₀(1 + max‖Ŵ|−|W‖ / max|W|) of the worst region: what a finger could feel of it.
    between_ssim_loss_p99, between_ssim_loss_max, between_field_error_db_max
        The same half-way between regions, against the unrounded drives interpolated alike.
    second_finger_loss_db_max, between_second_finger_loss_db_max
        dB of second finger lost at most, at regions and half-way, of drives that are best at
        `focus`; None of others.
    """

    ssim_mean: float
    ssim_min: float
    ssim_loss_p99: float
    ssim_loss_max: float
    field_error_db_max: float
    between_ssim_loss_p99: float
    between_ssim_loss_max: float
    between_field_error_db_max: float
    second_finger_loss_db_max: float | None
    between_second_finger_loss_db_max: float | None


@dataclass(frozen=True)
class SectionReport(Quality):
    """What one frequency's section came to.

    Attributes
    ----------
    steps_before, steps_after, steps_within
        Steps between neighbours before and after phases were chosen, and within labels.
    """

    frequency_hz: float
    objective: str
    labels: int
    steps_before: Steps
    steps_after: Steps
    steps_within: Steps


@dataclass(frozen=True)
class TableReport(Quality):
    """What a table came to: of several sections the mean SSIM and the worst of all else.

    Attributes
    ----------
    objective
        What the drives are best at.
    bits
        Width of the integers.
    is_within_limits
        Whether no measured point loses more than `LIMITS`.
    error_estimate, tolerance_met
        Largest relative error of the fields that drives were found with, and whether it is as
        small as it should be.
    measured_regions, measured_between
        Points of every section at which losses were measured.
    fingers
        What fingers feel of it.
    sections
        The same per frequency, and more.
    """

    regions: int
    stored_regions: int
    bytes: int
    objective: str
    bits: int
    seconds: float
    is_within_limits: bool
    measured_regions: int
    measured_between: int
    error_estimate: float
    tolerance_met: bool
    fingers: Fingers
    sections: list[SectionReport]

    @property
    def lost(self) -> str:
        """What was lost at most, beside the limits, in words."""
        aim = (
            f"{max(self.ssim_loss_max, self.between_ssim_loss_max):.4f} of SSIM "
            f"(limit {LIMITS.ssim:g})"
        )
        own, between = self.second_finger_loss_db_max, self.between_second_finger_loss_db_max
        if own is not None and between is not None:
            aim = f"{max(own, between):.2f} dB of second finger (limit {LIMITS.second_finger_db:g})"
        field_db = max(self.field_error_db_max, self.between_field_error_db_max)
        return f"{aim} and {field_db:.3f} dB of field (limit {LIMITS.field_db:g})"


def report(
    table: Table,
    drives: Sequence[OneFrequency],
    losses: Sequence[LossesOfTable],
    size: int,
    seconds: float,
    fingers: Fingers,
) -> TableReport:
    """What a table of `size` bytes came to."""
    error = max(one.error_estimate for one in drives)
    sections = [_of_section(one, *lost) for one, lost in zip(drives, losses, strict=True)]
    return TableReport(
        **asdict(_worst(sections)),
        regions=table.grid.count,
        stored_regions=table.regions.count,
        bytes=size,
        objective=table.sections[0].objective,
        bits=table.bits,
        seconds=seconds,
        is_within_limits=are_within(losses),
        measured_regions=len(drives[0].at_regions),
        measured_between=len(drives[0].halfway),
        error_estimate=error,
        tolerance_met=error <= OWN_TOLERANCE,
        fingers=fingers,
        sections=sections,
    )


def are_within(losses: Sequence[LossesOfTable]) -> bool:
    """Whether the limits are kept everywhere."""
    return all(lost.are_within for pair in losses for lost in pair)


def _worst(sections: Sequence[Quality]) -> Quality:
    """Of the mean SSIM the mean, of the smallest the smallest, of every loss the largest."""
    by_name = {
        field.name: [getattr(section, field.name) for section in sections]
        for field in fields(Quality)
    }
    worst: dict[str, Any] = {
        name: None if None in values else max(values) for name, values in by_name.items()
    }
    worst |= {
        "ssim_mean": float(np.mean(by_name["ssim_mean"])),
        "ssim_min": min(by_name["ssim_min"]),
    }
    return Quality(**worst)


def _of_section(one: OneFrequency, regions: Losses, between: Losses) -> SectionReport:
    # A stored region counts as often as the board has it.
    often = one.weights
    return SectionReport(
        frequency_hz=one.solved.board.drive.frequency_hz,
        objective=one.objective,
        labels=len(one.synchronised.crossings),
        ssim_mean=float(np.average(regions.kept, weights=often)),
        ssim_min=float(regions.kept.min()),
        ssim_loss_p99=float(np.percentile(np.repeat(regions.ssim, often), 99)),
        ssim_loss_max=float(regions.ssim.max()),
        field_error_db_max=float(regions.field_db.max()),
        between_ssim_loss_p99=float(np.percentile(between.ssim, 99)),
        between_ssim_loss_max=float(between.ssim.max()),
        between_field_error_db_max=float(between.field_db.max()),
        second_finger_loss_db_max=_largest(regions.second_finger_db),
        between_second_finger_loss_db_max=_largest(between.second_finger_db),
        steps_before=one.synchronised.before,
        steps_after=one.synchronised.after,
        steps_within=one.synchronised.within,
    )


def _largest(lost: FloatArray | None) -> float | None:
    return None if lost is None else float(lost.max())
