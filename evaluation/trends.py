"""Damping and tangent stiffness over loading frequency (paper, Figs. 8a and 8b)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from evaluation.grouping import grouped
from evaluation.quantities import is_two_sided
from evaluation.record import FloatArray
from evaluation.results import RunEvaluation, Trend

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

TrendQuantity = Literal["damping", "tangent_stiffness"]
_NAMES: dict[TrendQuantity, str] = {
    "damping": "damping",
    "tangent_stiffness": "tangent_stiffness_kN_per_mm",
}


def find_trends(runs: Sequence[RunEvaluation]) -> tuple[Trend, ...]:
    """Return every trend that a set of runs shows, one specimen at a time.

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
    for specimen in dict.fromkeys(_specimen(r) for r in harmonic):
        own = [r for r in harmonic if _specimen(r) == specimen]
        for prestressed in grouped(own, _same_prestress):
            by_amplitude = grouped(prestressed, _same_amplitude)
            for group in by_amplitude:
                trends += [t for q in _NAMES if (t := _trend(q, group, constant=True)) is not None]
            if len(by_amplitude) > 1:
                trend = _trend("tangent_stiffness", prestressed, constant=False)
                trends += [trend] if trend is not None else []
    return tuple(trends)


def _specimen(run: RunEvaluation) -> str:
    return str(run.facts.specimen.get("id", ""))


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


def _trend(quantity: TrendQuantity, group: Sequence[RunEvaluation], *, constant: bool) -> Trend | None:
    name = _NAMES[quantity]
    known = [r for r in group if _value(r, name) is not None]
    two_sided = [r for r in known if quantity == "damping" and _is_two_sided(r)]
    points = sorted((r for r in known if r not in two_sided), key=lambda r: _number(r, "frequency_Hz"))
    frequency = np.array([_number(r, "frequency_Hz") for r in points])
    if len(points) < 2 or frequency[-1] < LEAST_FREQUENCY_RATIO * frequency[0]:
        return None
    values = np.array([_number(r, name) for r in points])
    centre = float(np.mean(frequency))
    spread = float(np.sum((frequency - centre) ** 2))
    slope = float(np.sum((frequency - centre) * (values - np.mean(values)))) / spread
    intercept = float(np.mean(values)) - slope * centre
    slope_u = intercept_u = None
    band: tuple[float | None, ...] = (None,) * len(points)
    warnings = []
    if len(points) > 2:
        residual = values - intercept - slope * frequency
        s = float(np.sqrt(np.sum(residual**2) / (len(points) - 2)))
        slope_u = s / float(np.sqrt(spread))
        intercept_u = s * float(np.sqrt(1.0 / len(points) + centre**2 / spread))
        from scipy.special import stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

        factor = float(stdtrit(len(points) - 2, 0.5 * (1.0 + CONFIDENCE)))
        width = factor * s * np.sqrt(1.0 / len(points) + (frequency - centre) ** 2 / spread)
        band = tuple(float(w) for w in width)
    else:
        warnings.append("two points only: a line fits them whatever it means")
    left_out = len(group) - len(known)
    if left_out:
        warnings.append(f"{left_out} of {len(group)} runs have no {quantity.replace('_', ' ')}")
    if two_sided:
        names = ", ".join(r.facts.id for r in two_sided)
        warnings.append(f"left out, as damping is not meaningful for two-sided loops: {names}")
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
    return Trend(
        quantity=quantity,
        prestress_mm=float(np.mean([_number(r, "prestress_mm") for r in points])),
        amplitude_mm=float(np.mean(amplitudes)) if constant else None,
        runs=tuple(r.facts.id for r in points),
        frequency_Hz=tuple(float(f) for f in frequency),
        values=tuple(float(v) for v in values),
        expanded_uncertainty=uncertainty,
        temperature_C=temperatures,
        slope_per_Hz=slope,
        intercept=intercept,
        slope_u_per_Hz=slope_u,
        intercept_u=intercept_u,
        band=band,
        warnings=tuple(warnings),
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
