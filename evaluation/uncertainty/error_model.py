"""What may be wrong with the channels, drawn at random: the input of the Monte Carlo propagation (JCGM 101).

Errors of a channel are the same for every cycle of a run, so that they do not average out; noise does.
A limit (half-width) is drawn from a rectangular distribution, a standard uncertainty from a normal one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.loops import InertiaForce
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.uncertainty.hum_and_drift import OwnErrors
from bufferstand.foundation.channels import ChannelUncertainty

SHAPE_LENGTH_MM = 120.0
"""Half wave of the longest of the smooth deviations that make up a stroke linearity error [mm]."""
SHAPE_HALF_WAVES = (1, 2, 3)
SHAPE_SHARE = 0.46
"""Standard deviation of the deviation at any stroke, as a share of the linearity limit: the limit is 2.2 of
them, which 97 % of the deviations at a stroke keep, and 70 % of the shapes along the whole of 500 mm. With it
the figures of the reference budget (docs/facts/standards.md) are reproduced source by source."""

TIME_BASE_LIMIT = 1e-4
"""Limit of the relative error of the clock that stamps the samples: 100 ppm, twice a plain crystal's. It is
no part of any energy; on frequency and speeds it is negligible beside the rest, and counted all the same."""
_UNRECORDED, _BLUNT, _DRUM, _ENDS = 1, 2, 3, 4
FORCE_TERMS = 5
"""Force as recorded, scale, zero, reversal, skew (order of :attr:`Draws.force`); then inertia, if any."""
STROKE_TERMS = 2 + 2 * len(SHAPE_HALF_WAVES)
"""Stroke as recorded, scale, and a cosine and a sine a half wave (order of :attr:`Draws.stroke`)."""


@dataclass(frozen=True)
class Wave:
    """A wave of the deviation of the mean of all draw wires from the straight line.

    ``name``: by which it is listed. ``u_mm``: standard uncertainty of its cosine and of its sine, by wire, as
    a part of the mean.
    """

    name: str
    length_mm: float
    u_mm: tuple[float, ...]

    @property
    def joint_u_mm(self) -> float:
        """Standard uncertainty of both in the mean [mm]."""
        return math.hypot(*self.u_mm)


@dataclass(frozen=True)
class StrokeFacts:
    """Uncertainty of the mean of all draw wires: limits [share, mm, mm] and standard u of the delay [s].

    ``scale`` and ``zero_mm`` are joint limits: those of one rectangular error with the same standard
    uncertainty. ``scales`` and ``zeros_mm`` are what each wire's own error makes of the mean.
    """

    scale: float
    zero_mm: float
    linearity_mm: float
    u_delay_s: float
    scales: tuple[float, ...]
    zeros_mm: tuple[float, ...]
    waves: tuple[Wave, ...]


@dataclass(frozen=True, eq=False)
class Draws:
    """Random errors, one row a draw.

    Attributes
    ----------
    force : array, shape (N, 5 or 6 + K)
        Factors of the force terms (:func:`force_terms`): 1, scale, zero [kN], reversibility, skew [s], and
        the share by which the moving mass is wrong where the record was corrected for one, and the run's own.
    stroke : array, shape (N, 8 + 2 D)
        Factors of the stroke terms (:func:`stroke_terms`): 1, scale, shape [mm] …
    stroke_zero_mm : array, shape (N,)
    generator : numpy.random.Generator
        For the noise of single cycles, drawn in order.
    time_base : array, shape (N,)
        Relative error of the clock.
    thermometer : array, shape (N,)
        Error of the temperature sensors as a share of their limit, -1 … 1.
    overreach : array, shape (N,)
        -1 or 1. A largest reading is too large, and by how much is known on average. An interval about it
        holds the truth as often as one for an error of that size and either sign. It has one sign in all
        cycles, and does not average out.
    unrecorded : array, shape (N,)
        What is not on record, as a share of its limit, -1 … 1 (:mod:`bufferstand.evaluation.gaps`).
    blunt : array, shape (N, 2)
        How blunt lower and upper turns are, of what they may be: standard normal, the same in all cycles, as
        one stand makes them.
    drums_mm : tuple of float
        Circumferences of the wires' drums that are stated.
    own : int
        The last so many of the force's errors are the run's own
        (:mod:`bufferstand.evaluation.uncertainty.hum_and_drift`).
    ends : array, shape (N, 2)
        Doubt of the forces at lower and upper turns, in its standard uncertainty: standard normal, the same
        in all cycles, as they are read in one way.
    """

    force: FloatArray
    stroke: FloatArray
    stroke_zero_mm: FloatArray
    generator: np.random.Generator
    time_base: FloatArray
    thermometer: FloatArray
    overreach: FloatArray
    unrecorded: FloatArray
    blunt: FloatArray
    ends: FloatArray
    drums_mm: tuple[float, ...] = ()
    own: int = 0

    @property
    def drift(self) -> FloatArray:
        """By how much the force's zero drifts over the run [kN], shape (N,)."""
        return (
            self.force[:, self.force.shape[1] - self.own] if self.own % 2 else np.zeros(self.force.shape[0])
        )

    def errors(self) -> dict[str, FloatArray]:
        """Return the errors that a certificate covers, so that other runs may have them too, by name.

        Neither noise nor overreach, which are each run's own; nor that of the thermometers, whose limit holds
        at every temperature: an error at one says little of that at another.
        """
        shared = self.force.T[1 : self.force.shape[1] - self.own]
        force = ("force scale", "force zero", "force reversibility", "delay", "moving mass")
        lengths = [2.0 * SHAPE_LENGTH_MM / waves for waves in SHAPE_HALF_WAVES]
        waves = [*(f"stroke shape {mm:g} mm" for mm in lengths), *(f"drum {mm:g} mm" for mm in self.drums_mm)]
        shapes = [f"{wave} {part}" for wave in waves for part in ("cosine", "sine")]
        stroke = ("stroke scale", *shapes)
        return {
            **dict(zip(force, shared, strict=False)),  # no mass where none was corrected for
            **dict(zip(stroke, self.stroke.T[1:], strict=True)),
            "stroke zero": self.stroke_zero_mm,
            "clock": self.time_base,
        }


def mean_of_wires(wires: Sequence[ChannelUncertainty]) -> StrokeFacts | None:
    """Return the uncertainty of the mean of independent draw wires; None when none states its accuracy."""
    if not wires or any(wire.accuracy_percent is None and wire.linearity is None for wire in wires):
        return None
    count = len(wires)

    def mean(values: Sequence[float | None]) -> float:
        return float(np.sqrt(sum((value or 0.0) ** 2 for value in values))) / count

    return StrokeFacts(
        scale=mean([wire.accuracy_percent for wire in wires]) / 100.0,
        zero_mm=mean([wire.zero for wire in wires]),
        linearity_mm=mean([wire.linearity for wire in wires]),
        u_delay_s=mean([wire.u_delay_s for wire in wires]),
        scales=tuple((wire.accuracy_percent or 0.0) / 100.0 / count for wire in wires),
        zeros_mm=tuple((wire.zero or 0.0) / count for wire in wires),
        waves=_waves(wires),
    )


def drum_periods_mm(wires: Sequence[ChannelUncertainty]) -> tuple[float, ...]:
    """Return the circumferences of the wires' drums, each once, from the longest down."""
    stated = {wire.drum_circumference_mm for wire in wires if wire.drum_circumference_mm is not None}
    return tuple(sorted(stated, reverse=True))


def _waves(wires: Sequence[ChannelUncertainty]) -> tuple[Wave, ...]:
    """Return the waves of the mean of the wires. All waves of a wire have the same share of its deviation.

    The wave of a drum is one more of them, so that the deviation at a stroke is as large as without it.
    """

    def part(wire: ChannelUncertainty, length_mm: float | None) -> float:
        if length_mm is not None and wire.drum_circumference_mm != length_mm:
            return 0.0
        count = len(SHAPE_HALF_WAVES) + (wire.drum_circumference_mm is not None)
        return SHAPE_SHARE * (wire.linearity or 0.0) / math.sqrt(count) / len(wires)

    smooth = tuple(part(wire, None) for wire in wires)
    lengths = [2.0 * SHAPE_LENGTH_MM / half_waves for half_waves in SHAPE_HALF_WAVES]
    return (
        *(Wave(f"stroke shape {mm:g} mm", mm, smooth) for mm in lengths),
        *(Wave(f"drum {mm:g} mm", mm, tuple(part(w, mm) for w in wires)) for mm in drum_periods_mm(wires)),
    )


def missing_facts(force: ChannelUncertainty | None, wires: Sequence[ChannelUncertainty]) -> list[str]:
    """Return a warning for every fact that the channels do not state."""
    warnings = []
    if force is None or force.accuracy_percent is None:
        warnings.append("no expanded uncertainties: the force channel states no accuracy")
    else:
        names = [n for n in ("reversibility_percent", "zero", "u_delay_s") if getattr(force, n) is None]
        warnings += [
            f"the force channel states no {n}: its part of the uncertainty is missing" for n in names
        ]
    if mean_of_wires(wires) is None:
        warnings.append("no expanded uncertainties: the stroke channel states neither accuracy nor linearity")
    else:
        names = [n for n in ("zero", "u_delay_s") if any(getattr(wire, n) is None for wire in wires)]
        warnings += [f"a stroke channel states no {n}: its part of the uncertainty is missing" for n in names]
    return warnings


def draw_errors(
    force: ChannelUncertainty | None,
    wires: Sequence[ChannelUncertainty],
    draws: int,
    seed: int,
    inertia: InertiaForce | None = None,
    own: OwnErrors | None = None,
) -> Draws | None:
    """Draw the errors of all channels; None when force or stroke states no accuracy.

    Parameters
    ----------
    force : ChannelUncertainty or None
    wires : sequence of ChannelUncertainty
        One entry a draw wire; the stroke is their mean.
    draws : int
    seed : int
        The same seed gives the same draws.
    inertia : InertiaForce, optional
        What the correction for a moving mass added.
    own : OwnErrors, optional
        Hum and drift of the run.
    """
    stroke = mean_of_wires(wires)
    if force is None or force.accuracy_percent is None or stroke is None:
        return None
    generator = np.random.default_rng(seed)

    def within(*limits: float) -> FloatArray:
        """Return sums of rectangular errors: two wires' mean is no rectangle, its tails reach further."""
        return np.asarray(sum(generator.uniform(-limit, limit, draws) for limit in limits))

    skew_s = float(np.hypot(force.u_delay_s or 0.0, stroke.u_delay_s))
    force_errors = np.column_stack(
        (
            np.ones(draws),
            within(force.accuracy_percent / 100.0),
            within(force.zero or 0.0),
            within((force.reversibility_percent or 0.0) / 100.0),
            generator.normal(0.0, skew_s, draws),
        )
    )
    smooth, drums = stroke.waves[: len(SHAPE_HALF_WAVES)], stroke.waves[len(SHAPE_HALF_WAVES) :]
    shape_mm = smooth[0].joint_u_mm
    shapes = generator.normal(0.0, shape_mm, (draws, 2 * len(smooth)))  # before what depends on the wires
    for place, drum in enumerate(drums):  # of a generator of its own: all else stays as it was
        waves_mm = np.random.default_rng((seed, _DRUM, place)).normal(0.0, drum.joint_u_mm, (draws, 2))
        shapes = np.column_stack((shapes, waves_mm))
    stroke_errors = np.column_stack((np.ones(draws), within(*stroke.scales), shapes))
    zero_mm, time_base, thermometer = within(*stroke.zeros_mm), within(TIME_BASE_LIMIT), within(1.0)
    overreach = np.where(generator.random(draws) < 0.5, -1.0, 1.0)
    if inertia is not None:
        force_errors = np.column_stack((force_errors, within(inertia.limit)))
    own_columns = np.zeros((draws, 0)) if own is None else own.draw(draws, seed)
    force_errors = np.column_stack((force_errors, own_columns))
    # Of generators of their own: what is drawn of a record that lacks nothing stays as it was.
    unrecorded = np.random.default_rng((seed, _UNRECORDED)).uniform(-1.0, 1.0, draws)
    drums_mm = drum_periods_mm(wires)
    blunt, ends = (np.random.default_rng((seed, own)).standard_normal((draws, 2)) for own in (_BLUNT, _ENDS))
    return Draws(
        force_errors,
        stroke_errors,
        zero_mm,
        generator,
        time_base,
        thermometer,
        overreach,
        unrecorded,
        blunt,
        ends,
        drums_mm,
        own_columns.shape[1],
    )


def _rates_per_mm(drums_mm: Sequence[float]) -> list[float]:
    """Return the phase that each wave turns by in a millimetre [1/mm]."""
    smooth = [math.pi * half_waves / SHAPE_LENGTH_MM for half_waves in SHAPE_HALF_WAVES]
    return [*smooth, *(2.0 * math.pi / length for length in drums_mm)]


def stroke_terms(stroke_mm: FloatArray, drums_mm: Sequence[float] = ()) -> FloatArray:
    """Return the stroke terms, shape (8 + 2 D, M): stroke, stroke (scale), the waves less their value at 0.

    ``drums_mm``: circumferences of the drums that are stated, shape (D,) (:func:`drum_periods_mm`).
    """
    rows = [stroke_mm, stroke_mm]
    for rate in _rates_per_mm(drums_mm):
        phase = rate * stroke_mm
        rows += [np.cos(phase) - 1.0, np.sin(phase)]
    return np.stack(rows)


def stroke_term_slopes(stroke_mm: float, drums_mm: Sequence[float] = ()) -> FloatArray:
    """Return the derivative of each stroke term at a stroke, shape (8 + 2 D,), as recorded counted as 0."""
    slopes = [0.0, 1.0]
    for rate in _rates_per_mm(drums_mm):
        slopes += [-rate * np.sin(rate * stroke_mm), rate * np.cos(rate * stroke_mm)]
    return np.array(slopes, dtype=np.float64)


def force_terms(
    time_s: FloatArray, force_kN: FloatArray, unloading: slice, inertia_kN: FloatArray | None = None
) -> FloatArray:
    """Return the force terms, shape (5, M): force, force (scale), 1 (zero), reversibility, -dF/dt (skew).

    ``inertia_kN``, which the correction for a moving mass added, is a sixth.

    The reversibility error concerns falling force, in proportion to the force, and vanishes towards the
    peak, where rising and falling are the same state: F (1 - F / F_peak), the usual shape of a hysteresis.
    """
    reversal = np.zeros_like(force_kN)
    falling = force_kN[unloading]
    peak = float(np.max(np.abs(falling))) or 1.0
    reversal[unloading] = falling * (1.0 - np.abs(falling) / peak)
    step = np.gradient(time_s)
    rate = np.gradient(force_kN) / np.where(step > 0.0, step, np.inf)
    terms = [force_kN, force_kN, np.ones_like(force_kN), reversal, -rate]
    return np.stack(terms if inertia_kN is None else [*terms, inertia_kN])
