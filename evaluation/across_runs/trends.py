"""Damping and tangent stiffness over loading frequency (paper, Figs. 8a and 8b).

Runs of one stand have errors in common, and a late force turns the whole line: its slope and its band carry
what the runs share (:mod:`bufferstand.evaluation.across_runs`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.across_runs.grouping import grouped, specimen_of
from bufferstand.evaluation.across_runs.line import coverage_factor, fit_line
from bufferstand.evaluation.across_runs.run_means import assumption, basis_of, figure_of
from bufferstand.evaluation.catalogue import QUANTITIES, Quantity
from bufferstand.evaluation.facts import Basis, Expanded, RunEvaluation, Trend
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import is_two_sided

PRESTRESS_TOLERANCE_MM = 2.0
AMPLITUDE_TOLERANCE_MM = 0.5
AMPLITUDE_TOLERANCE = 0.05
"""Runs belong together when prestress differs by up to 2 mm and amplitude by up to 0.5 mm or 5 %."""
LEAST_FREQUENCY_RATIO = 1.05
"""A trend needs frequencies that differ at least by this ratio."""
TEMPERATURE_SPREAD_C = 5.0
"""Points whose temperatures differ by more are confounded with temperature."""
TEMPERATURE_RELATED_C = 1.0
TEMPERATURE_CORRELATION = 0.7
"""… and so are three or more points that differ by 1 K already, if temperature follows frequency: the
absolute coefficient of correlation is at least 0.7."""
CONFIDENCE = 0.95
_TRENDED = QUANTITIES.that(lambda entry: entry.shown.trend)


def find_trends(runs: Sequence[RunEvaluation]) -> tuple[Trend, ...]:
    """Return every trend that a set of runs shows, one specimen at a time, simulated runs apart.

    Damping and tangent stiffness over frequency at constant prestress and amplitude; tangent stiffness also
    at constant prestress alone, where the amplitude varies with the frequency (Fig. 8b), with a warning.

    Parameters
    ----------
    runs : sequence of RunEvaluation
        Only harmonic runs with a summary count.

    Returns
    -------
    tuple of Trend
    """
    harmonic = [r for r in runs if r.facts.kind == "harmonic" and _value(r, "frequency_Hz") is not None]
    trends = []
    for specimen in dict.fromkeys(specimen_of(r) for r in harmonic):
        own = [r for r in harmonic if specimen_of(r) == specimen]
        for prestressed in grouped(own, _same_prestress):
            by_amplitude = grouped(prestressed, _same_amplitude)
            for group in by_amplitude:
                trends += [_trend(entry, group, constant=True) for entry in _TRENDED]
            if len(by_amplitude) > 1:
                trends += [
                    _trend(entry, prestressed, constant=False)
                    for entry in _TRENDED
                    if entry.trended.amplitudes
                ]
    return tuple(trend for trend in trends if trend is not None)


def _value(run: RunEvaluation, name: str) -> float | None:
    measured = run.summary.values.get(name)
    return None if measured is None else measured.value


def _number(run: RunEvaluation, name: str) -> float:
    value = _value(run, name)
    return float("nan") if value is None else value


def _same_prestress(a: RunEvaluation, b: RunEvaluation) -> bool:
    return abs(_number(a, "prestress_mm") - _number(b, "prestress_mm")) <= PRESTRESS_TOLERANCE_MM


def _same_amplitude(a: RunEvaluation, b: RunEvaluation) -> bool:
    one, two = _number(a, "amplitude_mm"), _number(b, "amplitude_mm")
    return abs(one - two) <= max(AMPLITUDE_TOLERANCE_MM, AMPLITUDE_TOLERANCE * max(one, two))


def _trend(entry: Quantity, group: Sequence[RunEvaluation], *, constant: bool) -> Trend | None:
    name, trended = entry.name, entry.trended
    known = [r for r in group if _value(r, name) is not None]
    two_sided = [r for r in known if not trended.two_sided and _is_two_sided(r)]
    points = sorted((r for r in known if r not in two_sided), key=lambda r: _number(r, "frequency_Hz"))
    frequency = np.array([_number(r, "frequency_Hz") for r in points])
    if len(points) < 2 or frequency[-1] < LEAST_FREQUENCY_RATIO * frequency[0]:
        return None
    values = np.array([_number(r, name) for r in points])
    line = _shared_line(name, points, frequency) or _scattered_line(frequency, values)
    warnings = []
    if len(points) == 2:
        warnings.append("two points only: a line fits them whatever it means")
    left_out = len(group) - len(known)
    if left_out:
        warnings.append(f"{left_out} of {len(group)} runs have no {trended.name.replace('_', ' ')}")
    if two_sided:
        names = ", ".join(r.facts.id for r in two_sided)
        warnings.append(f"left out, as {entry.label.lower()} is not meaningful for two-sided loops: {names}")
    amplitudes = [_number(r, "amplitude_mm") for r in points]
    if not constant:
        warnings.append(
            f"confounded: amplitude varies from {min(amplitudes):.3g} to {max(amplitudes):.3g} mm "
            "along with frequency"
        )
    temperatures = tuple(_value(r, "temperature_max_C") for r in points)
    warnings += _temperature_warnings(frequency, temperatures)
    uncertainty = tuple(r.summary.values[name].expanded_uncertainty for r in points)
    if any(value is None for value in uncertainty):
        warnings.append("no expanded uncertainty of some points: their runs say why")
    warnings += line.warnings
    return Trend(
        quantity=trended.name,
        prestress_mm=float(np.mean([_number(r, "prestress_mm") for r in points])),
        amplitude_mm=float(np.mean(amplitudes)) if constant else None,
        runs=tuple(r.facts.id for r in points),
        frequency_Hz=tuple(float(f) for f in frequency),
        values=tuple(float(v) for v in values),
        expanded_uncertainty=uncertainty,
        temperature_C=temperatures,
        slope_per_Hz=line.slope.value,
        intercept=line.intercept.value,
        slope_u_per_Hz=line.slope.u,
        intercept_u=line.intercept.u,
        band=line.band,
        warnings=tuple(warnings),
        slope_half_width_95_per_Hz=line.slope.half_width_95,
        intercept_half_width_95=line.intercept.half_width_95,
        slope_expanded=line.slope.expanded,
        intercept_expanded=line.intercept.expanded,
        band_expanded=line.band_expanded,
        scatter_u=line.scatter_u,
        shared=line.shared,
    )


@dataclass(frozen=True)
class _Known:
    value: float
    u: float | None = None
    half_width_95: float | None = None

    @property
    def expanded(self) -> Expanded | None:
        """U and its coverage factor; None without a standard uncertainty."""
        if self.u is None or self.half_width_95 is None:
            return None
        k = coverage_factor(self.u, self.half_width_95)
        return Expanded(k * self.u, k)


@dataclass(frozen=True)
class _Line:
    slope: _Known
    intercept: _Known
    band: tuple[float | None, ...]
    band_expanded: tuple[float | None, ...]
    scatter_u: float | None
    shared: Basis | None
    warnings: tuple[str, ...] = ()


def _shared_line(name: str, points: Sequence[RunEvaluation], frequency: FloatArray) -> _Line | None:
    """Return the line with the errors that the runs share; None where one of them states no uncertainty."""
    figures = [figure_of(run, name) for run in points]
    known = [figure for figure in figures if figure is not None]
    if len(known) < len(figures):
        return None
    line = fit_line(frequency.tolist(), known)
    basis = basis_of(points)
    return _Line(
        _Known(line.slope.value, line.slope.u, line.slope.half_width_95),
        _Known(line.intercept.value, line.intercept.u, line.intercept.half_width_95),
        line.band,
        line.band_U,
        line.scatter_u if line.degrees_of_freedom else None,
        basis,
        assumption(basis),
    )


def _scattered_line(frequency: FloatArray, values: FloatArray) -> _Line:
    """Return the line of points without uncertainties: least squares, and their scatter from three on."""
    count = frequency.size
    centre = float(np.mean(frequency))
    spread = float(np.sum((frequency - centre) ** 2))
    slope = float(np.sum((frequency - centre) * (values - np.mean(values)))) / spread
    intercept = float(np.mean(values)) - slope * centre
    if count < 3:
        return _Line(_Known(slope), _Known(intercept), (None,) * count, (None,) * count, None, None)
    s = float(np.sqrt(np.sum((values - intercept - slope * frequency) ** 2) / (count - 2)))
    from scipy.special import stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

    factor = float(stdtrit(count - 2, 0.5 * (1.0 + CONFIDENCE)))
    slope_u = s / float(np.sqrt(spread))
    intercept_u = s * float(np.sqrt(1.0 / count + centre**2 / spread))
    width = tuple((factor * s * np.sqrt(1.0 / count + (frequency - centre) ** 2 / spread)).tolist())
    return _Line(
        _Known(slope, slope_u, factor * slope_u),
        _Known(intercept, intercept_u, factor * intercept_u),
        width,
        width,  # Student's t is more than 2 for any number of points
        s,
        None,
        ("no uncertainty of slope and band but by scatter: errors that the runs share do not show in it",),
    )


def _is_two_sided(run: RunEvaluation) -> bool:
    lowest, highest = _value(run, "force_min_kN"), _value(run, "force_max_kN")
    return lowest is not None and highest is not None and is_two_sided(lowest, highest)


def _temperature_warnings(frequency_Hz: FloatArray, temperatures: Sequence[float | None]) -> list[str]:
    """Say where temperature varies among the points, or is not known, so that frequency is not alone."""
    known = np.array([value is not None for value in temperatures])
    warnings = []
    if not np.all(known):
        warnings.append(
            f"no temperature of {np.count_nonzero(~known)} of {known.size} runs: whether frequency is "
            "confounded with it cannot be told"
        )
    if np.count_nonzero(known) < 2:
        return warnings
    frequency = frequency_Hz[known]
    value = np.array([t for t in temperatures if t is not None])
    spread = float(np.ptp(value))
    correlation = None
    if value.size > 2 and spread > 0.0 and np.ptp(frequency) > 0.0:
        correlation = float(np.corrcoef(frequency, value)[0, 1])
    related = (
        spread > TEMPERATURE_RELATED_C
        and correlation is not None
        and abs(correlation) >= TEMPERATURE_CORRELATION
    )
    if related or spread > TEMPERATURE_SPREAD_C:
        follows = "" if correlation is None else f" (correlation with frequency {correlation:+.2f})"
        warnings.append(f"confounded: temperature differs by {spread:.1f} K between the runs{follows}")
    return warnings
