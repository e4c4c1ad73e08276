"""What is known of a spring, and what a further step would add (linearised Gauss–Newton, Bayesian).

The unknowns are the spring's vector, the errors that the channels have in all runs, and the state in which the
next step begins: temperatures of mass and sensor, and inner stroke. All are held in units of what is known of
them beforehand. A step adds the information Hᵀ H over the correlation that the fit found (the fit's own
weights and effective number of samples), and hands its last state on: P ← P - P Rᵀ (1 + R P Rᵀ)⁻¹ R P with
Rᵀ R = Hᵀ H, then the state's rows by the chain rule. So no step raises a variance, steps in a row
know of each other's warmth, and what is wrong with a channel stays as it is however often a step is repeated.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification import (
    LAWS,
    STATE_RANGES,
    STATES,
    FixedParts,
    Identification,
    Problem,
    Solution,
    experiment_of,
)
from bufferstand.model.next_step.pieces import Piece, RunNoise, drive_of, seconds_of
from bufferstand.model.next_step.shared_errors import SharedErrors, columns

Floats = NDArray[np.float64]

_RESTED_K = 0.5
"""A specimen that has rested is as warm as the air within this (one standard deviation)."""
_FOR_EVER = 1e3
"""Square root of how often a step is repeated to see what no repetition lowers."""


@dataclass(frozen=True, eq=False)
class Spring:
    """Where everything is linearised.

    Attributes
    ----------
    frame : FixedParts
    vector : array, shape (p,)
        Of the fit; usual values where it left a parameter out, so that a step can tell of it.
    scale : array, shape (p,)
        Plausible ranges.
    noise : RunNoise
    errors : SharedErrors
    ambient_C : float
        Temperature of the air [°C].
    """

    frame: FixedParts
    vector: Floats
    scale: Floats
    noise: RunNoise
    errors: SharedErrors
    ambient_C: float

    @property
    def size(self) -> int:
        """Number of unknowns without the state."""
        return self.frame.size + len(self.errors.names)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known at a moment.

    Attributes
    ----------
    spring : Spring
    covariance : array, shape (p + q + 3, p + q + 3)
        Of spring, shared errors and present state, in units of what is known beforehand.
    temperature_C : float
        Of the specimen's mass at present.
    """

    spring: Spring
    covariance: Floats
    temperature_C: float

    @property
    def of_spring(self) -> Floats:
        """Covariance of the spring's entries, in units of their ranges, shape (p, p)."""
        p = self.spring.frame.size
        return self.covariance[:p, :p]

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a law's parameter, of its logarithm where the fit takes that."""
        at = self.spring.frame.place(name)
        return float(np.sqrt(self.covariance[at, at]) * self.spring.scale[at])

    def deviation_of(self, gradient: Floats) -> float:
        """Return the standard deviation of a figure with this gradient by the spring's entries, shape (p,)."""
        scaled = gradient * self.spring.scale
        return float(np.sqrt(max(scaled @ self.of_spring @ scaled, 0.0)))

    def after(self, effect: Effect) -> Knowledge:
        """Return what will be known after a step."""
        P = _told(self.covariance, effect.root(self.temperature_C))
        ends = effect.ends(self.temperature_C)
        step = np.eye(len(P))
        step[-STATES:] = ends
        P = step @ P @ step.T
        return replace(self, covariance=0.5 * (P + P.T), temperature_C=effect.end_C(self.temperature_C))

    def limit(self, effects: Iterable[Effect]) -> Knowledge:
        """Return what would be known if every step were repeated for ever: errors of the channels stay."""
        found = self
        for effect in effects:
            found = replace(found, covariance=_told(found.covariance, _FOR_EVER * effect.root(self.temperature_C)))
        return found

    def at(self, temperature_C: float) -> Knowledge:
        """Return the same of a specimen that has rested until it was as warm as its surroundings."""
        P = self.covariance.copy()
        P[-STATES:], P[:, -STATES:] = 0.0, 0.0
        P[-STATES:-1, -STATES:-1] = (_RESTED_K / STATE_RANGES[0]) ** 2
        return replace(self, covariance=P, temperature_C=temperature_C)


def knowledge_of(
    found: Identification, errors: SharedErrors, *, ambient_C: float
) -> Knowledge:
    """Return what an identification knows, of a specimen that has rested at the temperature of the air.

    A parameter that its runs do not tell counts as unknown, within its plausible range.

    Parameters
    ----------
    found : Identification
    errors : SharedErrors
        Of the stand's channels.
    ambient_C : float
        Temperature of the air [°C].
    """
    return known_by(found.solution, [one.name for one in found.unknown], errors, ambient_C=ambient_C)


def known_by(
    solution: Solution, untold: Iterable[str], errors: SharedErrors, *, ambient_C: float
) -> Knowledge:
    """Return :func:`knowledge_of` of a solution of which these parameters have no interval."""
    problem, frame = solution.problem, solution.problem.frame
    p = frame.size
    whole = solution.vector.copy()
    for law in LAWS:
        if not solution.free[frame.place(law.name)]:
            whole[frame.place(law.name)] = law.to_vector(law.start)
    noise = RunNoise.of(problem.experiments, solution.correlation)
    scale = problem.scales(whole)
    spring = Spring(frame, whole[:p], scale[:p], noise, errors, ambient_C)
    free = np.concatenate([np.ones(p, dtype=np.bool_), problem.always_free()[p:]])
    jacobian = problem.jacobian(whole, free) * scale[free]
    shared = np.concatenate(
        [
            np.concatenate([one, np.zeros((starts, one.shape[1]))])
            for one, starts in (
                (columns(e, given, errors), int(e.drive.sensor_C.size > 0 and not e.rested))
                for e, given in zip(problem.experiments, problem.answers(whole), strict=True)
            )
        ]
    )
    rows = np.concatenate([jacobian, shared], axis=1) / np.sqrt(solution.correlation)
    known = np.linalg.inv(rows.T @ rows + np.eye(rows.shape[1]))
    kept = np.concatenate([np.arange(p), np.arange(known.shape[0] - shared.shape[1], known.shape[0])])
    P = np.zeros((spring.size + STATES,) * 2)
    P[: spring.size, : spring.size] = known[np.ix_(kept, kept)]
    for name in untold:
        at = frame.place(name)
        P[at], P[:, at], P[at, at] = 0.0, 0.0, 1.0
    return Knowledge(spring, P, ambient_C).at(ambient_C)


def _told(covariance: Floats, root: Floats) -> Floats:
    """Return P - P Rᵀ (1 + R P Rᵀ)⁻¹ R P."""
    seen = root @ covariance
    told = covariance - seen.T @ np.linalg.solve(np.eye(len(root)) + seen @ root.T, seen)
    return np.asarray(0.5 * (told + told.T), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class _Rows:
    rows: Floats
    ends: Floats
    end_C: float
    highest_C: float


@dataclass(frozen=True, eq=False)
class Effect:
    """What a piece adds, as a function of the temperature at which it begins.

    Its rows are found at two temperatures and taken as linear between: softening is.

    Attributes
    ----------
    piece : Piece
    duration_s : float
        Of the stand's time.
    """

    piece: Piece
    duration_s: float
    _cold: _Rows
    _warm: _Rows
    _between_C: tuple[float, float]
    _products: tuple[Floats, Floats, Floats]
    """Of the rows at the one temperature and their change to the other."""

    def _share(self, temperature_C: float) -> float:
        low, high = self._between_C
        return (temperature_C - low) / (high - low)

    def root(self, temperature_C: float) -> Floats:
        """Return R with Rᵀ R = Hᵀ H over the correlation, shape (r, p + q + 3)."""
        t = self._share(temperature_C)
        cold, cross, change = self._products
        values, vectors = np.linalg.eigh(cold + t * cross + t * t * change)
        kept = values > 1e-14 * values[-1]
        return np.asarray(np.sqrt(values[kept])[:, None] * vectors[:, kept].T, dtype=np.float64)

    def ends(self, temperature_C: float) -> Floats:
        """Return how the last state follows from spring, errors and first state, shape (3, p + q + 3)."""
        t = self._share(temperature_C)
        return self._cold.ends + t * (self._warm.ends - self._cold.ends)

    def end_C(self, temperature_C: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return how warm the specimen is afterwards [°C]."""
        t = self._share(temperature_C)
        return self._cold.end_C + t * (self._warm.end_C - self._cold.end_C)

    def highest_C(self, temperature_C: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return how warm the specimen becomes [°C]."""
        t = self._share(temperature_C)
        return self._cold.highest_C + t * (self._warm.highest_C - self._cold.highest_C)


def effects_of(
    spring: Spring, pieces: Iterable[Piece], between_C: tuple[float, float]
) -> dict[Piece, Effect]:
    """Return the effect of every piece on what is known of a spring.

    Parameters
    ----------
    spring : Spring
    pieces : iterable of Piece
    between_C : tuple of float
        Two temperatures at which they may begin, between which their rows are taken as linear [°C].
    """
    each = list(dict.fromkeys(pieces))
    rows = _rows(spring, [(piece, T) for piece in each for T in between_C])
    found = {}
    for piece, cold, warm in zip(each, rows[::2], rows[1::2], strict=True):
        change = warm.rows - cold.rows
        cross = cold.rows.T @ change
        products = (cold.rows.T @ cold.rows, cross + cross.T, change.T @ change)
        found[piece] = Effect(piece, seconds_of(piece), cold, warm, between_C, products)
    return found


def _rows(spring: Spring, begun: list[tuple[Piece, float]]) -> list[_Rows]:
    """Return rows and last states of pieces, each by itself from its first temperature [°C]."""
    noise, p, q = spring.noise, spring.frame.size, len(spring.errors.names)
    experiments = []
    for piece, _ in begun:
        drive = drive_of((piece,), noise, spring.ambient_C)
        one = experiment_of(
            drive, contact_ramp_mm=spring.frame.contact_ramp_mm, sensor_sigma_C=noise.sensor_C
        )
        experiments.append(replace(one, rested=False))
    problem = Problem(spring.frame, experiments)
    starts = [(start_C, start_C, 0.0) for _, start_C in begun]
    vector = np.concatenate([spring.vector, np.ravel(starts)])
    scale = problem.scales(vector)
    jacobian, ends = problem.derivatives(vector, np.ones(vector.size, dtype=np.bool_))
    found, at = [], 0
    for number, (experiment, given) in enumerate(zip(experiments, problem.answers(vector), strict=True)):
        readings = experiment.drive.sensor_C.size
        count = int(np.count_nonzero(experiment.used)) + readings
        # Without the row that joins mass and sensor: the chain of steps knows both.
        own = np.concatenate([np.arange(p), problem.temperature_places(number), [problem.inner_place(number)]])
        rows = jacobian[at : at + count, own] * scale[own]
        at += count + int(readings > 0)
        shared = columns(experiment, given, spring.errors)
        states = slice(STATES * number, STATES * (number + 1))
        last = ends[states, own] * scale[own] / np.array(STATE_RANGES)[:, None]
        found.append(
            _Rows(
                np.concatenate([rows[:, :p], shared, rows[:, p:]], axis=1) / np.sqrt(noise.correlation),
                np.concatenate([last[:, :p], np.zeros((STATES, q)), last[:, p:]], axis=1),
                float(given.temperature_C[-1]),
                float(given.temperature_C.max()),
            )
        )
    return found
