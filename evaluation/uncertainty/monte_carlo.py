"""Monte Carlo propagation of channel errors through the raw loop to every figure of a cycle (JCGM 101).

Energies are bilinear in the errors of force and stroke: ∫ (Σ aᵢ fᵢ) d(Σ bⱼ xⱼ). The integrals of all pairs
of terms are taken once on the recorded loop, and each draw is then exact at the cost of a small product.
Damping is propagated as one quantity: scale errors cancel in it, as they do on the stand.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts import Cycle, EndReading, Loop, TurningPoint
from bufferstand.evaluation.loops import InertiaForce, cut_loop
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import absorbed_energy_J, stored_energy_J
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.uncertainty.error_model import (
    Draws,
    force_terms,
    stroke_term_slopes,
    stroke_terms,
)
from bufferstand.evaluation.uncertainty.hum_and_drift import OwnErrors
from bufferstand.evaluation.uncertainty.noise import Noise, Spectrum, white

AnyFloat = TypeVar("AnyFloat", np.float64, np.complex128)

COVERAGE = 2.0
"""Coverage factor k of the expanded uncertainty U = k u."""
NORMAL_95 = 1.959964
"""Half-width of the 95 % interval of a normal distribution, in standard deviations."""
NEAR_LARGEST = 3.0
"""Speeds within so many standard deviations of the largest may be the largest because of their noise."""


@dataclass(frozen=True, eq=False)
class LocalReading:
    """A polynomial reading of the loading branch at a stroke as a linear functional of the force.

    Attributes
    ----------
    force_kN, slope, bend : float
        Force, its first and second derivative by stroke there [kN, kN/mm, kN/mm²].
    value_terms, slope_terms : arrays, shape (5 or 6,)
        The same readings (force, slope) of each force term.
    value_gain, slope_gain : float
        Standard deviation of the readings by noise [kN, kN/mm].
    """

    stroke_mm: float
    force_kN: float
    slope: float
    bend: float
    value_terms: FloatArray
    slope_terms: FloatArray
    value_gain: float
    slope_gain: float


@dataclass(frozen=True, eq=False)
class EnergyTerms:
    """Energies of one loop as sums over pairs of terms, shape (5 or 6, 8) [J], and their noise [J].

    ``loading`` gives W_s, ``loading`` + ``returning`` W_a. ``turn_J``: W_s by the fit of the turning points;
    ``blunt_J``: by how blunt they are, alike in all cycles.
    """

    loading: FloatArray
    returning: FloatArray
    noise_up_J: float
    noise_down_J: float
    turn_J: float
    blunt_J: float


class CyclePropagation:
    """The loop of one complete cycle prepared for drawing: terms, integrals, noise.

    Parameters
    ----------
    record : Record
    cycle : Cycle
        Complete.
    noise : Noise
    inertia : InertiaForce, optional
        What the correction for a moving mass added to the record.
    own : OwnErrors, optional
        Hum and drift of the run.
    loop : Loop, optional
        That of the cycle, if it is cut already.
    """

    def __init__(
        self,
        record: Record,
        cycle: Cycle,
        noise: Noise,
        inertia: InertiaForce | None = None,
        own: OwnErrors | None = None,
        loop: Loop | None = None,
    ) -> None:
        self.own = own or OwnErrors()
        self._drums_mm = record.drums_mm
        self.cycle = cycle
        self.noise = noise
        self.loop = loop or cut_loop(record, cycle)
        self._added_kN = None
        if inertia is not None:
            self._added_kN = np.interp(self.loop.time_s, record.time_s, inertia.added_kN)
        inside = np.searchsorted(record.time_s, [cycle.start_s, cycle.end_s])
        self.samples = int(inside[1] - inside[0])
        self.samples_a_point = self.samples / self.loop.time_s.size

    @cached_property
    def force(self) -> FloatArray:
        """Terms of the force (:func:`bufferstand.evaluation.uncertainty.error_model.force_terms`) and own
        ones, shape (5 + K, M)."""
        terms = force_terms(self.loop.time_s, self.loop.force_kN, self.loop.unloading, self._added_kN)
        return np.concatenate((terms, self.own.rows(self.loop.time_s)))

    @cached_property
    def stroke(self) -> FloatArray:
        """Terms of the stroke (:func:`bufferstand.evaluation.uncertainty.error_model.stroke_terms`), shape
        (8 + 2 D, M)."""
        return stroke_terms(self.loop.stroke_mm, self._drums_mm)

    def _integrals(self, part: slice) -> FloatArray:
        middle = 0.5 * (self.force[:, part][:, 1:] + self.force[:, part][:, :-1])
        return np.asarray(middle @ np.diff(self.stroke[:, part], axis=1).T)

    def _closing(self) -> FloatArray:
        chord = self.stroke[:, 0] - self.stroke[:, -1]
        return np.outer(0.5 * (self.force[:, 0] + self.force[:, -1]), chord)

    def force_noise_kN(self, weights: FloatArray, part: slice | NDArray[np.bool_]) -> FloatArray:  # noqa: N802
        """Return the standard deviation of sums of the points' forces by noise, shape (...,).

        Parameters
        ----------
        weights : array, shape (..., M)
            What each point of the part counts.
        part : slice or array of bool
        """
        return self._summed(weights, part, self.noise.force_kN, self.noise.force)

    def stroke_noise_mm(self, weights: FloatArray, part: slice | NDArray[np.bool_]) -> FloatArray:
        """Return the same for the stroke."""
        return self._summed(weights, part, self.noise.stroke_mm, self.noise.stroke)

    def _summed(
        self,
        weights: FloatArray,
        part: slice | NDArray[np.bool_],
        white: float,
        spectrum: Spectrum | None,
    ) -> FloatArray:
        if spectrum is not None and weights.shape[-1] > 1:
            return np.sqrt(spectrum.variance(self.loop.time_s[part], weights))
        return np.asarray(white * np.linalg.norm(weights, axis=-1) / np.sqrt(self.samples_a_point))

    def _energy_noise(self, part: slice) -> float:
        """Return the standard deviation of an energy by noise on both channels [J]."""
        by_force = self.force_noise_kN(np.gradient(self.loop.stroke_mm[part]), part)
        by_stroke = self.stroke_noise_mm(np.gradient(self.loop.force_kN[part]), part)
        return float(np.hypot(by_force, by_stroke))

    @cached_property
    def energy_terms(self) -> EnergyTerms:
        """The integrals of all pairs of terms, and what noise and turning points add.

        Those of force and stroke, as recorded and scaled, are the energy itself; other errors are integrated
        along the polygon.
        """
        turns = (self.cycle.start, self.cycle.top)
        ends_kN = self.loop.force_kN[[0, self.loop.top]]
        turn_J = np.linalg.norm(ends_kN * [turn.u_stroke_mm * self.turn_share(turn) for turn in turns])
        blunt_J = np.linalg.norm(0.5 * ends_kN * [turn.blunt_mm for turn in turns])
        loading = self._integrals(self.loop.rising)
        returning = self._integrals(slice(self.loop.rising.stop - 1, None)) + self._closing()
        loading[:2, :2] = stored_energy_J(self.loop)
        returning[:2, :2] = absorbed_energy_J(self.loop) - loading[0, 0]
        return EnergyTerms(
            loading=loading,
            returning=returning,
            noise_up_J=self._energy_noise(self.loop.loading),
            noise_down_J=self._energy_noise(self.loop.unloading),
            turn_J=float(turn_J),
            blunt_J=float(blunt_J),
        )

    def energies(
        self, draws: Draws, turn_errors_mm: tuple[FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Return stored and absorbed energy of every draw [J], shape (N,) each.

        A turning point that is fitted too high adds area to the loading branch, and as much to the other one.
        """
        terms = self.energy_terms
        low_mm, high_mm = turn_errors_mm
        scatter = draws.generator.standard_normal((2, draws.force.shape[0]))
        stored = _bilinear(draws, terms.loading) + scatter[0] * terms.noise_up_J
        absorbed = stored + _bilinear(draws, terms.returning) + scatter[1] * terms.noise_down_J
        ends_kN = self.loop.force_kN[[0, self.loop.top]]
        return stored + ends_kN[1] * high_mm - ends_kN[0] * low_mm, absorbed

    def end_scatter(
        self, turn_errors_mm: tuple[FloatArray, FloatArray], draws: Draws
    ) -> tuple[FloatArray, FloatArray]:
        """Return what noise and doubt make of the forces at both ends of the loading branch, every draw [kN].

        ``turn_errors_mm`` are the errors of the turning points there: the force is read at their place.
        """
        start, end = (
            reading.gain * self.reading_noise_kN(reading) * draws.generator.standard_normal(error_mm.size)
            + reading.slope_kN_per_mm * error_mm
            + reading.doubt_kN * doubt
            for reading, error_mm, doubt in zip(self.loop.ends[:2], turn_errors_mm, draws.ends.T, strict=True)
        )
        return start, end

    @property
    def force_spectrum(self) -> Spectrum:
        """Noise of the force over frequency."""
        return self.noise.force or white(self.noise.force_kN, self.cycle.duration_s / self.samples)

    @property
    def stroke_spectrum(self) -> Spectrum:
        """Noise of the stroke over frequency."""
        return self.noise.stroke or white(self.noise.stroke_mm, self.cycle.duration_s / self.samples)

    def turn_share(self, turn: TurningPoint) -> float:
        """Return by how much coloured noise makes a turning point less sure (:func:`turn_share`)."""
        return turn_share(self.noise, turn)

    def moment_share(self, turn: TurningPoint) -> float:
        """Return the same for its moment, which may be that of other samples."""
        if self.noise.stroke is None or not turn.moment_samples:
            return self.turn_share(turn)
        return _coloured(self.noise.stroke, turn.moment_samples)

    def reading_noise_kN(self, reading: EndReading) -> float:  # noqa: N802 - the unit keeps its capitals
        """Return the noise of a sample's force at its stroke: that of both channels [kN].

        Of noise that hangs together over the samples that are read at an end, as much more as it averages out
        less over them than white noise does.
        """
        samples = max(1.0, 1.0 / reading.gain**2 if reading.gain > 0.0 else 1.0)
        force, stroke = (
            samples * spectrum.mean_variance(samples)
            for spectrum in (self.force_spectrum, self.stroke_spectrum)
        )
        return float(np.sqrt(force + reading.slope_kN_per_mm**2 * stroke))

    def extreme_force(
        self,
        which: int,
        draws: Draws,
        ends_kN: tuple[FloatArray, FloatArray],
    ) -> FloatArray:
        """Return the least (``which`` 0) or largest (1) force of every draw [kN], shape (N,).

        ``ends_kN``: what noise makes of the forces at both ends of the loading branch.
        """
        reading = self.loop.extremes[which]
        if reading.place in (0, 1):
            at, scatter = (0, self.loop.top)[reading.place], ends_kN[reading.place]
        elif reading.place == 2:  # where the unloading branch ends
            at, own = self.loop.time_s.size - 1, self.loop.ends[2]
            u_kN = own.gain * self.reading_noise_kN(own)
            u_kN = float(np.hypot(u_kN, own.slope_kN_per_mm * self.cycle.end.u_stroke_mm))
            scatter = u_kN * draws.generator.standard_normal(draws.overreach.size)
            scatter = scatter + own.doubt_kN * draws.ends[:, 0]
        else:
            at = int(np.argmin(np.abs(self.loop.time_s - reading.time_s)))
            u_kN = reading.gain * self.reading_noise_kN(EndReading(reading.gain))
            u_kN = float(np.hypot(u_kN, reading.doubt_kN))
            scatter = u_kN * draws.generator.standard_normal(draws.overreach.size)
            scatter = scatter + reading.overreach_kN * draws.overreach
        return weighted(draws.force, self.force[:, at]) + scatter

    def read(self, stroke_mm: float, half_width_mm: float, degree: int = 3) -> LocalReading | None:
        """Read the loading branch at a stroke; None when it is out of reach or too few samples are near."""
        stroke = self.loop.stroke_mm[self.loop.loading]
        if not stroke[0] <= stroke_mm <= stroke[-1]:
            return None
        return self.fit(stroke_mm, stroke_mm - half_width_mm, stroke_mm + half_width_mm, degree)

    def fit(self, stroke_mm: float, first_mm: float, last_mm: float, degree: int) -> LocalReading | None:
        """Fit the loading branch between two strokes and read the polynomial at a third one.

        Returns None when fewer than ``degree + 2`` samples lie between them, or they cover less than half.
        """
        stroke = self.loop.stroke_mm[self.loop.loading]
        inside = (stroke >= first_mm) & (stroke <= last_mm)
        if np.count_nonzero(inside) < degree + 2 or np.ptp(stroke[inside]) < 0.5 * (last_mm - first_mm):
            return None
        scale = 0.5 * (last_mm - first_mm)
        matrix = np.vander((stroke[inside] - stroke_mm) / scale, degree + 1, increasing=True)
        operator = np.asarray(np.linalg.pinv(matrix), dtype=np.float64)
        terms = operator @ self.force[:, self.loop.loading][:, inside].T
        bend = float(2.0 * terms[2, 0]) / scale**2 if degree > 1 else 0.0
        slope = float(terms[1, 0]) / scale
        part = np.zeros(self.loop.time_s.size, dtype=bool)
        part[self.loop.loading] = inside
        by_stroke = slope * self.stroke_noise_mm(operator[:2], part)
        noise_kN = np.hypot(self.force_noise_kN(operator[:2], part), by_stroke)
        return LocalReading(
            stroke_mm=stroke_mm,
            force_kN=float(terms[0, 0]),
            slope=slope,
            bend=bend,
            value_terms=terms[0],
            slope_terms=terms[1] / scale,
            value_gain=float(noise_kN[0]),
            slope_gain=float(noise_kN[1]) / scale,
        )


def turn_share(noise: Noise, turn: TurningPoint) -> float:
    """Return by how much coloured noise makes a turning point less sure than its residual says.

    A parabola's summit over n samples has the variance 9 σ² / 4 n of white noise, the level of a rest σ² / n,
    where σ is by differences of neighbours. Noise that hangs together averages out less over them.
    """
    spectrum, u_mm = noise.stroke, turn.u_stroke_mm
    if spectrum is None or not 0.0 < u_mm < spectrum.sigma:
        return 1.0
    if turn.method not in ("plateau", "reversal"):
        summit = spectrum.summit_variance(2.25 * (spectrum.sigma / u_mm) ** 2)
        return max(1.0, float(np.sqrt(summit)) / u_mm)
    samples = max(1.0, (noise.stroke_mm / u_mm) ** 2)
    return max(1.0, float(np.sqrt(spectrum.mean_variance(samples))) / u_mm)


def _coloured(spectrum: Spectrum, samples: float) -> float:
    """Return by how much more the mean of so many samples scatters than by white noise, at least 1."""
    return max(1.0, float(np.sqrt(samples * spectrum.mean_variance(samples))) / spectrum.sigma)


def weighted(errors: FloatArray, terms: NDArray[AnyFloat]) -> NDArray[AnyFloat]:
    """Return the sum of the terms of every draw, shape (N,).

    Not by the linear algebra library, whose threads cost more than they save on so little.
    """
    return np.asarray(np.einsum("ni,i->n", errors, terms))


def _bilinear(draws: Draws, integrals: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nj,nj->n", draws.force @ integrals, draws.stroke))


def stroke_error_mm(draws: Draws, stroke_mm: float) -> FloatArray:
    """Return the error of the stroke at a stroke for every draw [mm], shape (N,)."""
    terms = stroke_terms(np.array([stroke_mm]), draws.drums_mm)[:, 0]
    return weighted(draws.stroke[:, 1:], terms[1:]) + draws.stroke_zero_mm


def force_draws(draws: Draws, reading: LocalReading) -> FloatArray:
    """Return the force read at a stroke for every draw [kN], shape (N,)."""
    noise = draws.generator.standard_normal(draws.force.shape[0]) * reading.value_gain
    moved = reading.slope * stroke_error_mm(draws, reading.stroke_mm)
    return weighted(draws.force, reading.value_terms) + moved + noise


def slope_draws(draws: Draws, reading: LocalReading, place_error_mm: FloatArray | None = None) -> FloatArray:
    """Return the slope read at a stroke for every draw [kN/mm], shape (N,).

    ``place_error_mm`` (N,): error of the stroke at which the slope is asked for, where that was measured too,
    as a mean stroke is. What both have in common, the zero, does not move the reading along the branch. None:
    the place is a number.
    """
    noise = draws.generator.standard_normal(draws.force.shape[0]) * reading.slope_gain
    stretch = weighted(draws.stroke, stroke_term_slopes(reading.stroke_mm, draws.drums_mm))
    error_mm = stroke_error_mm(draws, reading.stroke_mm)
    moved = reading.bend * (error_mm if place_error_mm is None else error_mm - place_error_mm)
    return weighted(draws.force, reading.slope_terms) * (1.0 + stretch) + moved + noise


def turn_errors(
    draws: Draws, cycle: Cycle, shares: tuple[float, float] = (1.0, 1.0)
) -> tuple[FloatArray, FloatArray]:
    """Return what noise makes of the lower and upper turning point of every draw [mm], shape (N,) each.

    ``shares``: by how much noise counts more than the residual of each fit says.
    """
    size = draws.stroke_zero_mm.size
    low_mm, high_mm = (
        share * turn.u_stroke_mm * draws.generator.standard_normal(size) + 0.5 * turn.blunt_mm * blunt
        for turn, share, blunt in zip((cycle.start, cycle.top), shares, draws.blunt.T, strict=True)
    )
    return low_mm, high_mm


def turns_with(
    draws: Draws, cycle: Cycle, errors_mm: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return both turning points of every draw with these errors, and those of the channel [mm]."""
    low_mm = cycle.stroke_min_mm + stroke_error_mm(draws, cycle.stroke_min_mm)
    high_mm = cycle.stroke_max_mm + stroke_error_mm(draws, cycle.stroke_max_mm)
    return low_mm + errors_mm[0], high_mm + errors_mm[1]


def expanded(values: FloatArray | Sequence[float]) -> float:
    """Return the expanded uncertainty U = 2 u of drawn values."""
    return COVERAGE * float(np.std(values))


def half_width_95(values: FloatArray) -> float:
    """Return the half-width about their mean that holds 95 % of drawn values."""
    return float(np.quantile(np.abs(values - np.mean(values)), 0.95))
