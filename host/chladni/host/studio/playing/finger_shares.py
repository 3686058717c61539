"""What each of several fingers gets of every signal, with all fingers pressing on the plate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chladni.drives.problem.problem import SolvedBoard
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.felt import MICROMETRE
from chladni.drives.scoring.several_fingers.finger_sets import FingerSet
from chladni.drives.scoring.several_fingers.kept_apart import most_newtons
from chladni.host.emulation.played_fingers import FingerVoice
from chladni.sim.board.quantity import MM
from chladni.sim.image.finger import PRESS, pressing_stiffness, threshold_um

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MOST_TONES = 8
"""Of which the coils' fields are kept: a tone that is new takes some 0.2 s."""


class Tones:
    """A board's fields at the last few tones that were asked for."""

    def __init__(self, solved: SolvedBoard) -> None:
        self._solved = solved
        self._kept: dict[float, SolvedBoard] = {}

    def at(self, frequency_hz: float) -> SolvedBoard:
        """The board, driven at a frequency."""
        found = self._kept.pop(frequency_hz, None) or self._solved.at_frequency(frequency_hz)
        self._kept[frequency_hz] = found
        for oldest in list(self._kept)[:-MOST_TONES]:
            del self._kept[oldest]
        return found


@dataclass(frozen=True)
class PlayedFingers:
    """Several fingers, each with a signal of its own.

    Attributes
    ----------
    numbers
        The page's, of each finger.
    voices
        Their places, tones and levels.
    drives
        Of each finger, complex128, shape (fingers, actuators), in one common unit; the finger's own
        place moves in phase 0.
    of_loudest
        Each drive's signal under its own finger over the most there, shape (fingers,).
    newtons
        What a unit of drives is worth with the loudest coil at the most that limits allow, were all
        voices at full level; None without a coil, or if all are silent.
    shares
        RMS displacement of signal k over the disc of finger j, m per unit of drives, shape
        (signals, fingers).
    """

    numbers: tuple[int, ...]
    voices: tuple[FingerVoice, ...]
    drives: ComplexArray
    of_loudest: FloatArray
    newtons: float | None
    shares: FloatArray

    @classmethod
    def of(
        cls,
        tones: Tones,
        numbers: Sequence[int],
        voices: Sequence[FingerVoice],
        drives: ComplexArray,
        of_loudest: FloatArray,
    ) -> PlayedFingers:
        """Solve the plate with all fingers pressing, at the tone of each signal."""
        places = np.array([voice.place_mm for voice in voices]) * MM
        shares = np.zeros((len(voices), len(voices)))
        with one_blas_thread():
            for tone in {voice.frequency_hz for voice in voices}:
                own = [k for k, voice in enumerate(voices) if voice.frequency_hz == tone]
                stiffness = pressing_stiffness(PRESS, tone)
                shares[own] = FingerSet.of(tones.at(tone), places, stiffness).shares(drives[own])
        # Low tones have the strictest limits: a supply's is for any 64 ms.
        lowest = tones.at(min(voice.frequency_hz for voice in voices))
        levels = np.array([voice.level for voice in voices])
        sounds = levels > 0.0
        full = drives[sounds] / levels[sounds, None]
        newtons = most_newtons(lowest.board, full) if sounds.any() else None
        return cls(tuple(numbers), tuple(voices), drives, of_loudest, newtons, shares)

    @property
    def matrix_db(self) -> list[list[float | None]]:
        """What finger j (row) gets of signal k (column), against finger k; None of silent ones."""
        own = np.diag(self.shares)
        return [
            [
                float(20.0 * np.log10(share / most)) if most > 0.0 and share > 0.0 else None
                for share, most in zip(row, own, strict=True)
            ]
            for row in self.shares.T
        ]

    @property
    def micrometres(self) -> FloatArray | None:
        """Peak of `shares`, µm: RMS over the disc, peak in time; None without a coil."""
        return None if self.newtons is None else self.shares * self.newtons / MICROMETRE

    def is_spared(self, finger: int) -> bool | None:
        """Whether every other signal stays below what a resting finger feels.

        None without a coil, or of a signal outside 40 to 800 Hz.
        """
        moved = self.micrometres
        if moved is None:
            return None
        others = [k for k in range(len(self.voices)) if k != finger and self.voices[k].level > 0.0]
        limits = [threshold_um(self.voices[k].frequency_hz) for k in others]
        if None in limits:
            return None
        return all(
            moved[k, finger] < limit for k, limit in zip(others, limits, strict=True) if limit
        )

    def message(self) -> dict[str, Any]:
        """What a page hears of it besides the drive of the first one that sounds."""
        moved = self.micrometres
        fingers = [
            {
                "finger": number,
                "place_mm": list(voice.place_mm),
                "tone_hz": voice.frequency_hz,
                "level": voice.level,
                "level_db": 20.0 * np.log10(part) if part > 0.0 else None,
                "drive": [[float(value.real), float(value.imag)] for value in drive],
                "finger_um": None if moved is None else float(moved[k, k]),
                "is_spared": self.is_spared(k),
            }
            for k, (number, voice, drive, part) in enumerate(
                zip(self.numbers, self.voices, self.drives, self.of_loudest.tolist(), strict=True)
            )
        ]
        return {
            "fingers": fingers,
            "matrix_db": self.matrix_db,
            "newtons_per_gain": self.newtons,
        }
