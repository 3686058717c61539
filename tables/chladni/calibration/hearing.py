"""Foam or stand-offs, forces and polarity from the sound of a sweep.

A microphone hears the volume that the plate moves, −ω² ∫W dA, through a room and a response of its
own. Those are the same for all coils: how coils sound beside each other tells how strong each is,
which way round, and much of the plate. Of what they have in common only level and slope over
octaves are unknown, and where it rings tells how stiff the board is held. Without foam in patches
each foot is told; with it feet are one. Patches and coils' places stay as they are drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from chladni.calibration.coils_known import with_coils_known
from chladni.calibration.fit import HELD_BY, check_this_board, farthest_off
from chladni.calibration.hidden import FORCE
from chladni.calibration.parameters import Parameter, parameters_of
from chladni.calibration.sweep import DAMPING, HeardCoils, sweep_frequencies
from chladni.calibration.unknowns import UNIFORM, Unknowns, unknowns_of
from chladni.calibration.wiring import Wiring
from chladni.drives.problem.threads import one_blas_thread
from chladni.drives.scoring.tolerances import DRAWN_TOLERANCE
from chladni.sim.board.board import Board
from chladni.sim.coil.full_drive import strengths
from chladni.sim.errors import InputError
from chladni.sim.fields.board_plate import plate_model
from chladni.sim.fields.induced import open_coils

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Report = Callable[[int, int], None]

STARTS = (-2.0, -1.33, -0.67, 0.0, 0.67, 1.33, 2.0)
"""Deviations of what holds the board, from which a search may begin."""
STEPS, STEP = 5, 0.02
"""Of the search, and of a logarithm, over which slopes are taken."""
ERROR = 0.15
"""Of what coils are like beside each other: patches of foam, places, a band's width."""
LEVEL_DB = 2.5
"""Of what all coils have in common, at one frequency: microphone and room."""
DRIFT = 60e-6
"""How far the device's clock and the recorder's may differ."""
TURN, FINER = 0.5, 8
"""By which the last sweep's highest frequency turns from one difference of clocks that is tried to
the next, rad, and into how many the last step is divided."""
DEAD = 0.25
"""Of a usual force, below which a coil is dead."""
SILENT = 0.01
"""Of the loudest coil's power, below which there is no sweep: a coil of half its force has 0.25."""
ROUNDS = 12
"""In which coils' factors and what they have in common are found by turns."""
BY_EAR = 0.1
"""Deviation of a value's logarithm that no covariance knows of: patches of foam, above all."""
UNLIKE = 0.6
"""Share of what is heard that no board of this kind leaves unexplained."""
UNLIKE_ON_FEET = 0.3
"""The same where each foot is told: ten plates left 8 % at most, with a foot that does not touch 43
and more."""


@dataclass(frozen=True)
class Heard:
    """What a recording tells.

    Attributes
    ----------
    board
        As it is, as far as it is heard; polarity, trim and dead coils included.
    wiring
        Of its coils.
    parameters
        Of the whole board, over the drawn ones.
    left
        RMS share of what is heard that the board does not explain.
    """

    board: Board
    wiring: Wiring
    parameters: tuple[Parameter, ...]
    left: float


def sound(board: Board, hz: FloatArray, *, damping: float = 0.0) -> ComplexArray:
    """What a microphone far off hears of a volt at each coil, any unit, (coils, frequencies).

    Parameters
    ----------
    damping
        Ratio by which all is to die away sooner. It is a loss factor of twice that of all that
        gives way, but for its square.

    Raises
    ------
    MissingError
        The board has no `[coil]`.
    """
    coil = board.known_coil
    model = plate_model(board, more_loss=2.0 * damping)
    found = np.empty((len(board.actuators), hz.size), np.complex128)
    for k, one in enumerate(hz.tolist()):
        omega = 2.0 * np.pi * one
        fields = open_coils(board, one, model=model, tolerance=DRAWN_TOLERANCE).fields.values
        volume = np.asarray(fields).mean(axis=(1, 2)) * float(np.prod(board.plate.size))
        blocked = coil.force_factor / (coil.resistance + 1j * omega * coil.inductance)
        found[:, k] = -(omega**2) * volume * blocked
    return found


def fit_sound(board: Board, heard: HeardCoils, progress: Report | None = None) -> Heard:
    """Find the board that sounds like this.

    A recording does not tell when the first coil's turn was: where the first or the last is silent,
    the other one may be, and of both the board that explains more is taken.

    Raises
    ------
    InputError
        The board sounds like none that may come out.
    """
    found, refused = [], []
    solved: dict[bytes, ComplexArray] = {}  # plates are the same, whoever's turn it was
    for one in turns_of(heard):
        try:
            found.append(_sounds_like(board, one, solved, progress))
        except InputError as error:
            refused.append(error)
    if not found:
        raise refused[0]
    return min(found, key=lambda own: own.left)


def turns_of(heard: HeardCoils) -> list[HeardCoils]:
    """What was heard, and by one coil later or earlier where an end of it is silent."""
    power = np.mean(np.abs(heard.values) ** 2, axis=1)
    is_silent = power < SILENT * power.max()
    turned = [shift for shift, end in ((1, -1), (-1, 0)) if is_silent[end]]
    later = [replace(heard, values=np.roll(heard.values, own, axis=0)) for own in turned]
    return [heard, *later]


def _sounds_like(
    board: Board, heard: HeardCoils, solved: dict[bytes, ComplexArray], progress: Report | None
) -> Heard:
    unknowns = unknowns_of(board)
    with one_blas_thread():
        search = _Search(unknowns, heard, solved, progress)
        scales = search.solve()
        parameters = search.parameters(scales)
        found = search.compared(scales)
    if found.left > (UNLIKE_ON_FEET if search.tells_feet else UNLIKE):
        given = f"{100.0 * found.left:.0f} % unexplained"
        hint = "is it this board, and nothing on it?"
        if len(board.springs) > 1:
            hint += " Does each foot touch? The coils' own readings tell one that does not"
        raise InputError(
            "recording", given, f"the sound of {board.name}, as it may come out", hint=hint
        )
    wiring = Wiring.of_forces(found.forces, DEAD)
    # A foot that is farther off than any may come out does not touch.
    values = search.values_at(scales)
    far = farthest_off(unknowns, values, 0.0)
    if far is not None and unknowns.is_foot(far[0]):
        check_this_board(unknowns, values, 0.0, wiring)
    forces = np.abs(found.forces) * wiring.signs * strengths(board)
    known = with_coils_known(_with_patches_as_drawn(search.board_at(scales), board), forces)
    return Heard(known, wiring, parameters, found.left)


@dataclass(frozen=True)
class _Compared:
    """A plate's sound beside what was heard: coils' factors, what is left, how clocks differ."""

    forces: FloatArray
    off: ComplexArray
    off_db: FloatArray
    drift: float

    @property
    def left(self) -> float:
        """RMS share of what was heard."""
        return ERROR * float(np.sqrt(np.mean(np.abs(self.off) ** 2)))

    @property
    def residuals(self) -> FloatArray:
        """All, over what each may be."""
        beliefs = (np.abs(self.forces) - 1.0) / (FORCE * UNIFORM)
        off = self.off.ravel()
        return np.concatenate((off.real, off.imag, self.off_db / LEVEL_DB, beliefs))


class _Search:
    def __init__(
        self,
        unknowns: Unknowns,
        heard: HeardCoils,
        solved: dict[bytes, ComplexArray],
        progress: Report | None,
    ) -> None:
        self._unknowns, self._heard, self._progress = unknowns, heard, progress
        self._hz = sweep_frequencies()
        # Feet follow the scales where there are no patches between them.
        self._count = unknowns.foot_values.stop if not unknowns.patches else len(unknowns.scales)
        self._spread = unknowns.spread[: self._count]
        self._solved = solved
        power = np.mean(np.abs(heard.values) ** 2, axis=0)
        self._sizes = np.sqrt(ERROR**2 * power + heard.noise)

    @property
    def tells_feet(self) -> bool:
        """Whether each of several is found."""
        return self._count > len(self._unknowns.scales)

    def values_at(self, scales: FloatArray) -> FloatArray:
        """All that is not known: what is not heard as it is drawn."""
        values = self._unknowns.mean.copy()
        values[: self._count] = scales
        return values

    def board_at(self, scales: FloatArray) -> Board:
        """With its patches all alike."""
        return self._unknowns.board_at(self.values_at(scales))

    def solve(self) -> FloatArray:
        """Logarithms of the board's scales and maybe feet, the most likely ones."""
        mean = self._unknowns.mean[: self._count]
        holds = np.array([own in HELD_BY for own in self._unknowns.names[: self._count]])
        starts = [off * holds for off in (STARTS if holds.any() else (0.0,))]

        def residuals(off: FloatArray) -> FloatArray:
            return np.concatenate((self.compared(mean + off * self._spread).residuals, off))

        def jacobian(off: FloatArray) -> FloatArray:
            return self._jacobian(mean + off * self._spread)

        begin = min(starts, key=lambda off: float(np.sum(residuals(off) ** 2)))
        found = scipy.optimize.least_squares(
            residuals,
            begin,
            jac=jacobian,
            ftol=1e-2,
            xtol=1e-2,
            max_nfev=STEPS,
        )
        return np.asarray(mean + found.x * self._spread)

    def parameters(self, scales: FloatArray) -> tuple[Parameter, ...]:
        """Of the whole board, and of feet that are told."""
        slopes = self._jacobian(scales)
        slopes[: -self._count] /= max(1.0, self.compared(scales).left / ERROR)
        covariance = np.linalg.inv(slopes.T @ slopes) * np.outer(self._spread, self._spread)
        return tuple(parameters_of(self._unknowns, scales, covariance, BY_EAR))

    def compared(self, scales: FloatArray) -> _Compared:
        """The board's sound beside what was heard, as clocks differ when it fits best."""
        own = self._sound(scales)
        numbers = max(len(own) - 1, 1)
        step = TURN / (2.0 * np.pi * self._hz[-1] * self._heard.slot_s * numbers)
        best = self._best(own, np.arange(-DRIFT, DRIFT + step, step))
        return self._best(own, best.drift + step * np.linspace(-1.0, 1.0, 2 * FINER + 1))

    def _best(self, own: ComplexArray, drifts: FloatArray) -> _Compared:
        found = [self._beside(own, drift) for drift in drifts.tolist()]
        return min(found, key=lambda one: float(np.sum(one.residuals**2)))

    def _beside(self, own: ComplexArray, drift: float) -> _Compared:
        """Forces and the common response fitted, at one difference of clocks."""
        sweeps = np.arange(len(own))[:, None]
        early = 2.0 * np.pi * self._hz * self._heard.slot_s * sweeps * drift
        heard = self._heard.values * np.exp(1j * early)
        forces = _first_signs(heard, own)
        certain = 1.0 / (FORCE * UNIFORM) ** 2
        for _ in range(ROUNDS):
            common = _common(heard, forces[:, None] * own)
            each = common * own / self._sizes
            over = np.sum((each.conj() * heard / self._sizes).real, axis=1)
            under = np.sum(np.abs(each) ** 2, axis=1)
            forces = (over + certain * np.sign(forces)) / (under + certain)
        common = _common(heard, forces[:, None] * own)
        off = (heard - common * forces[:, None] * own) / self._sizes
        level = 20.0 * np.log10(np.maximum(np.abs(common), 1e-300))
        line = np.stack((np.ones(level.size), np.log(self._hz)), axis=1)
        level -= line @ np.linalg.lstsq(line, level, rcond=None)[0]
        return _Compared(forces, off, level, drift)

    def _jacobian(self, scales: FloatArray) -> FloatArray:
        before = self.compared(scales).residuals
        columns = []
        for row in range(self._count):
            more = scales.copy()
            more[row] += STEP
            slope = (self.compared(more).residuals - before) / STEP * self._spread[row]
            columns.append(np.concatenate((slope, np.eye(self._count)[row])))
        return np.stack(columns, axis=1)

    def _sound(self, scales: FloatArray) -> ComplexArray:
        key = scales.tobytes()
        if key not in self._solved:
            # From the highest down: the basis for that one does for the others.
            down = sound(self.board_at(scales), self._hz[::-1], damping=DAMPING)
            self._solved[key] = down[:, ::-1]
            if self._progress:
                done = len(self._solved)
                self._progress(done, max(done, len(STARTS) + (STEPS - 2) * (self._count + 1)))
        return self._solved[key]


def _common(heard: ComplexArray, own: ComplexArray) -> ComplexArray:
    """What all coils have in common, (frequencies,)."""
    found: ComplexArray = np.sum(own.conj() * heard, axis=0) / np.sum(np.abs(own) ** 2, axis=0)
    return found


def _first_signs(heard: ComplexArray, own: ComplexArray) -> FloatArray:
    """1 or −1 of each coil; most are the right way round.

    Turns of a frequency are told by squares, and half a turn more by what others say.
    """
    products = heard * own.conj()
    turns = np.exp(-0.5j * np.angle(np.sum(products**2, axis=0)))
    each = (products * turns / np.abs(products).max(axis=0)).real
    sums = each[:, np.argmax(np.sum(np.abs(each), axis=0))]
    for _ in range(3):
        sums = each @ np.sign(sums @ each)
    signs = np.where(sums < 0.0, -1.0, 1.0)
    return signs if signs.sum() >= 0.0 else -signs


def _with_patches_as_drawn(board: Board, drawn: Board) -> Board:
    if board.foundation is None or drawn.foundation is None:
        return board
    own = replace(board.foundation, patches=drawn.foundation.patches)
    return replace(board, foundation=own)
