"""What is known of a spring, and what a further step would add (linearised Gauss–Newton, Bayesian).

The unknowns are the spring's vector and the state in which the next step begins: temperatures of mass and
sensor, and inner stroke. They are held in units of what is known of them beforehand. A step adds the
information Hᵀ H over the correlation that the fit found (the fit's own weights and effective number of
samples), and hands its last temperatures on: P ← P - P Rᵀ (1 + R P Rᵀ)⁻¹ R P with Rᵀ R = Hᵀ H, then the
state's rows by the chain rule. So no step raises a variance, and steps in a row know of each other's warmth.

What is wrong with a channel is the same in every run, and the fit does not look for it. It is considered, not
estimated (Schmidt 1966): what one standard deviation of each error does to the fit's result is carried along
with the fit's own gain, S ← S - G (R S + B). A step repeated for ever brings P to nothing and S to a floor.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
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
_LEFT_mm = 5.0
"""Inner stroke that a step may have left: where it matters, it is beyond the contact ramp."""
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


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known at a moment.

    Attributes
    ----------
    spring : Spring
    covariance : array, shape (p + 3, p + 3)
        Of spring and present state by noise, in units of what is known beforehand.
    by_errors : array, shape (p + 3, q)
        What one standard deviation of each stated error of the channels does to them, in these units.
    temperature_C, sensor_C : float
        Of the specimen's mass, and as its sensor shows it, at present.
    """

    spring: Spring
    covariance: Floats
    by_errors: Floats
    temperature_C: float
    sensor_C: float

    @property
    def of_spring(self) -> Floats:
        """Covariance of the spring's entries, in units of their ranges, shape (p, p)."""
        p = self.spring.frame.size
        return self.covariance[:p, :p]

    def deviation(self, name: str) -> float:
        """Return the standard deviation of a law's parameter by noise, as the fit's intervals state it.

        Of its logarithm where the fit takes that.
        """
        at = self.spring.frame.place(name)
        return float(np.sqrt(self.covariance[at, at]) * self.spring.scale[at])

    def by_noise(self, gradient: Floats) -> float:
        """Return what noise does to a figure with this gradient by the spring's entries, shape (p,)."""
        scaled = gradient * self.spring.scale
        return math.sqrt(max(float(scaled @ self.of_spring @ scaled), 0.0))

    def by_channels(self, gradient: Floats) -> float:
        """Return what the stated errors of the channels do to that figure (standard uncertainty)."""
        scaled = gradient * self.spring.scale
        return float(np.linalg.norm(scaled @ self.by_errors[: scaled.size]))

    def deviation_of(self, gradient: Floats) -> float:
        """Return the standard uncertainty of that figure: noise and errors of the channels."""
        return float(np.hypot(self.by_noise(gradient), self.by_channels(gradient)))

    def after(self, effect: Effect) -> Knowledge:
        """Return what will be known after a step."""
        warmth = effect.warmth(self.temperature_C, self.sensor_C)
        told = self._told(effect.root(warmth))
        step = np.eye(len(told.covariance))
        step[-STATES:] = effect.ends(warmth)
        P = step @ told.covariance @ step.T
        P[-1, -1] = 1.0
        mass_C, sensor_C = effect.end_C(warmth)
        return replace(
            told,
            covariance=0.5 * (P + P.T),
            by_errors=step @ told.by_errors,
            temperature_C=mass_C,
            sensor_C=sensor_C,
        )

    def limit(self, effects: Iterable[Effect]) -> Knowledge:
        """Return what would be known if every step were repeated for ever: errors of the channels stay."""
        roots = [one.root(one.warmth(self.temperature_C, self.sensor_C)) for one in effects]
        return self._told(_FOR_EVER * np.concatenate(roots))

    def _told(self, root: Floats) -> Knowledge:
        """Return what rows of spring, state and errors tell: P - G R P, S - G (R S + B)."""
        size = len(self.covariance)
        rows, shared = root[:, :size], root[:, size:]
        seen = rows @ self.covariance
        gain = np.linalg.solve(np.eye(len(root)) + seen @ rows.T, seen).T
        P = self.covariance - gain @ seen
        S = self.by_errors - gain @ (rows @ self.by_errors + shared)
        return replace(self, covariance=0.5 * (P + P.T), by_errors=S)

    def at(self, temperature_C: float, sensor_C: float | None = None) -> Knowledge:
        """Return the same of a specimen of this temperature; its sensor is even with it unless given [°C]."""
        P = self.covariance.copy()
        shown_C = temperature_C if sensor_C is None else sensor_C
        P[-STATES:], P[:, -STATES:] = 0.0, 0.0
        P[-STATES:-1, -STATES:-1] = (_RESTED_K / STATE_RANGES[0]) ** 2
        S = self.by_errors.copy()
        S[-STATES:] = 0.0
        return replace(self, covariance=P, by_errors=S, temperature_C=temperature_C, sensor_C=shown_C)


def knowledge_of(found: Identification, errors: SharedErrors, *, ambient_C: float) -> Knowledge:
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
    root = np.sqrt(solution.correlation)
    jacobian, shared = jacobian / root, shared / root
    known = np.linalg.inv(jacobian.T @ jacobian + np.eye(jacobian.shape[1]))
    P, S = np.zeros((p + STATES,) * 2), np.zeros((p + STATES, shared.shape[1]))
    P[:p, :p] = known[:p, :p]
    S[:p] = -(known @ (jacobian.T @ shared))[:p]
    for name in untold:
        at = frame.place(name)
        P[at], P[:, at], P[at, at] = 0.0, 0.0, 1.0
        S[at] = 0.0
    return Knowledge(spring, P, S, ambient_C, ambient_C).at(ambient_C)


@dataclass(frozen=True, eq=False)
class _Rows:
    rows: Floats
    ends: Floats
    temperatures_C: Floats
    """Of mass and sensor at the end, and the highest of the mass."""


@dataclass(frozen=True, eq=False)
class Effect:
    """What a piece adds, as a function of the temperatures of mass and sensor at which it begins.

    Its rows are found at three pairs of them and taken as linear between: softening is, and so is a sensor
    that lags behind.

    Attributes
    ----------
    piece : Piece
    duration_s : float
        Of the stand's time.
    """

    piece: Piece
    duration_s: float
    _between_C: tuple[float, float]
    _products: Floats
    """Of the rows at the first pair, of their change with warmth, and with the sensor's lag: (3, 3, z, z)."""
    _ends: Floats
    _temperatures_C: Floats

    @classmethod
    def of(cls, piece: Piece, between_C: tuple[float, float], parts: Sequence[_Rows]) -> Effect:
        """Return the effect of a piece by its rows at cold, at warm, and at warm with a cold sensor."""
        cold, warm, lagging = parts
        rows = (cold.rows, warm.rows - cold.rows, lagging.rows - warm.rows)
        ends = (cold.ends, warm.ends - cold.ends, lagging.ends - warm.ends)
        T = [one.temperatures_C for one in parts]
        return cls(
            piece,
            seconds_of(piece),
            between_C,
            np.array([[one.T @ other for other in rows] for one in rows]),
            np.array(ends),
            np.array([T[0], T[1] - T[0], T[2] - T[1]]),
        )

    def warmth(self, mass_C: float, sensor_C: float) -> Floats:
        """Return the shares of the three parts at these temperatures [°C], shape (3,)."""
        low, high = self._between_C
        return np.array([1.0, (mass_C - low) / (high - low), (mass_C - sensor_C) / (high - low)])

    def root(self, warmth: Floats) -> Floats:
        """Return R with Rᵀ R = Hᵀ H over the correlation, (r, p + 3 + q), errors of the channels last."""
        values, vectors = np.linalg.eigh(np.einsum("i,j,ijkl->kl", warmth, warmth, self._products))
        kept = values > 1e-14 * values[-1]
        return np.asarray(np.sqrt(values[kept])[:, None] * vectors[:, kept].T, dtype=np.float64)

    def ends(self, warmth: Floats) -> Floats:
        """Return how the last state follows from spring and first state, shape (3, p + 3)."""
        return np.asarray(np.tensordot(warmth, self._ends, axes=1), dtype=np.float64)

    def end_C(self, warmth: Floats) -> tuple[float, float]:  # noqa: N802 - the unit keeps its capital
        """Return how warm mass and sensor are afterwards [°C]."""
        mass_C, sensor_C, _ = (warmth @ self._temperatures_C).tolist()
        return mass_C, sensor_C

    def highest_C(self, warmth: Floats) -> float:  # noqa: N802 - the unit keeps its capital
        """Return how warm the mass becomes [°C]."""
        return float(warmth @ self._temperatures_C[:, 2])


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
    low, high = between_C
    pairs = ((low, low), (high, high), (high, low))
    rows = _rows(spring, [(piece, pair) for piece in each for pair in pairs])
    return {
        piece: Effect.of(piece, between_C, rows[3 * number : 3 * number + 3])
        for number, piece in enumerate(each)
    }


def _rows(spring: Spring, begun: list[tuple[Piece, tuple[float, float]]]) -> list[_Rows]:
    """Return rows and last states of pieces, each by itself from temperatures of mass and sensor [°C]."""
    noise, p = spring.noise, spring.frame.size
    experiments = []
    for piece, _ in begun:
        drive = drive_of((piece,), noise, spring.ambient_C)
        one = experiment_of(
            drive, contact_ramp_mm=spring.frame.contact_ramp_mm, sensor_sigma_C=noise.sensor_C
        )
        experiments.append(replace(one, rested=False))
    problem = Problem(spring.frame, experiments)
    starts = [(*pair, _LEFT_mm) for _, pair in begun]
    vector = np.concatenate([spring.vector, np.ravel(starts)])
    scale = problem.scales(vector)
    jacobian, ends = problem.derivatives(vector, np.ones(vector.size, dtype=np.bool_))
    found, at = [], 0
    for number, (experiment, given) in enumerate(zip(experiments, problem.answers(vector), strict=True)):
        readings = experiment.drive.sensor_C.size
        count = int(np.count_nonzero(experiment.used)) + readings
        # Without the row that joins mass and sensor: the chain of steps knows both.
        own = np.concatenate(
            [np.arange(p), problem.temperature_places(number), [problem.inner_place(number)]]
        )
        rows = jacobian[at : at + count, own] * scale[own]
        at += count + int(readings > 0)
        shared = columns(experiment, given, spring.errors)
        states = slice(STATES * number, STATES * (number + 1))
        last = ends[states, own] * scale[own] / np.array(STATE_RANGES)[:, None]
        last[-1] = 0.0  # what is left of the overstress is taken as unknown after each step
        found.append(
            _Rows(
                np.concatenate([rows, shared], axis=1) / np.sqrt(noise.correlation),
                last,
                np.array([given.temperature_C[-1], given.sensor_C[-1], given.temperature_C.max()]),
            )
        )
    return found
