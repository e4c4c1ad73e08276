"""Figures of damping and tangent stiffness over frequency, from the trends of the evaluation."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.figures import LEAST_FREEDOM, TrendSeries, trend_plot
from bufferstand.evaluation.report.content import (
    DASH,
    Cell,
    Column,
    Picture,
    Table,
    measured_cell,
    quantity_cell,
    significant,
    usable,
    with_uncertainty,
)
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import capital, joined, label, said

_HYPHEN_MINUS = re.compile(r"(?<= )-(?=\d)")
CONFOUNDED = "confounded:"
"""The evaluation's warnings of a trend begin so, where something varies along with the frequency."""
_NO_BAND = said(
    "A line of fewer than {least} degrees of freedom ν, or one that is confounded with another condition, "
    "has no confidence band. ",
    least=LEAST_FREEDOM,
)


def runs_of_trend(source: ReportSource, trend: Mapping[str, Any]) -> list[int]:
    """Return the numbers of a trend's runs in this report."""
    wanted = [str(run) for run in trend.get("runs") or []]
    return [run.number for identifier in wanted for run in source.runs if run.id == identifier]


def trend_pictures(source: ReportSource) -> list[Picture]:
    """Return one figure a quantity with all its series, where there are any."""
    pictures = []
    for entry in QUANTITIES.that(lambda entry: entry.shown.trend):
        trended, unit = entry.trended, entry.printed_unit
        words = label(trended.caption)
        every = source.document.get("trends") or []
        trends = [trend for trend in every if trend.get("quantity") == trended.name]
        series = [(trend, one) for trend in trends if (one := _series(trend, unit)) is not None]
        if not series:
            continue
        fits = [trend for trend, _ in series if usable(trend.get("slope_per_Hz")) is not None]
        plot = trend_plot([one for _, one in series], label(trended.axis))
        bands = [fit.lower is not None for fit in plot.fits]
        pictures.append(
            Picture(
                caption=said("{words} over frequency", words=words)
                + (said(" with linear fits") if fits else "")
                + (said(" and their 95 % confidence bands (ν: degrees of freedom)") if any(bands) else "")
                + said(". Bars: expanded uncertainty (k = 2). ")
                + ("" if all(bands) else _NO_BAND)
                + joined(" ", _warned(series)),
                alt=said(
                    "{words} of {count_of_series} series over frequency. ",
                    words=words,
                    count_of_series=len(series),
                )
                + joined(
                    " ",
                    (
                        said("{label}: {trend}.", label=one.label, trend=_slope_text(trend, unit))
                        for trend, one in series
                    ),
                ),
                plot=plot,
                numbers=_numbers(source, [trend for trend, _ in series], words, unit),
            )
        )
    return pictures


def _warned(series: Sequence[tuple[Mapping[str, Any], TrendSeries]]) -> list[str]:
    """Return the warnings of the series, each once, with those that it is of where it is not of all."""
    labels: dict[str, list[str]] = {}
    for trend, one in series:
        for warning in dict.fromkeys(_printed(str(text)) for text in trend.get("warnings") or []):
            labels.setdefault(warning, []).append(one.label)
    warnings: dict[tuple[str, ...], list[str]] = {}
    for warning, of in labels.items():
        warnings.setdefault(tuple(of), []).append(warning)
    return [
        _sentence(text)
        for of, told in warnings.items()
        for text in (
            map(capital, told)
            if len(of) == len(series)
            else [said("{named} – {text}", named=joined(", ", of), text="; ".join(told))]
        )
    ]


def _printed(warning: str) -> str:
    """Return a warning as it is printed: with a true minus sign, without its full stop."""
    return _HYPHEN_MINUS.sub("−", warning.rstrip("."))


def _sentence(text: str) -> str:
    return said("{text}.", text=text)


def _slope_text(trend: Mapping[str, Any], unit: str) -> str:
    slope = usable(trend.get("slope_per_Hz"))
    if slope is None:
        return said("no fit")
    return said("slope {slope}", slope=_with_u(trend, unit) or _per_hertz(significant(slope, 3), unit))


def _per_hertz(slope: str, unit: str) -> str:
    shown = "" if unit == "–" else said(" {unit}", unit=unit)
    return said("{slope}{shown} per Hz", slope=slope, shown=shown)


def _with_u(trend: Mapping[str, Any], unit: str) -> str:
    """Return the slope ± U with the unit; empty where U is not known.

    Where no channel states an accuracy, the half width of the fit's own 95 % interval stands for U.
    """
    slope = usable(trend.get("slope_per_Hz"))
    known = (trend.get(f"slope_{name}_per_Hz") for name in ("expanded_uncertainty", "half_width_95"))
    U = next((value for one in known if (value := usable(one)) is not None), None)
    if slope is None or U is None or U <= 0.0:
        return ""
    return _per_hertz(with_uncertainty(slope, U), unit)


def _label(trend: Mapping[str, Any]) -> str:
    prestress, amplitude = usable(trend.get("prestress_mm")), usable(trend.get("amplitude_mm"))
    mean = DASH if prestress is None else significant(prestress, 3)
    return (
        said("{mean} mm, several amplitudes", mean=mean)
        if amplitude is None
        else said("{mean} ± {amplitude} mm", mean=mean, amplitude=significant(amplitude, 3))
    )


def _floats(values: object) -> list[float | None]:
    return [usable(value) for value in values] if isinstance(values, list | tuple) else []


def _series(trend: Mapping[str, Any], unit: str) -> TrendSeries | None:
    frequency, value = _floats(trend.get("frequency_Hz")), _floats(trend.get("values"))
    both = range(min(len(frequency), len(value)))
    pairs = [n for n in both if frequency[n] is not None and value[n] is not None]
    if not pairs:
        return None
    pairs.sort(key=lambda n: frequency[n] or 0.0)
    f = np.array([frequency[n] for n in pairs], dtype=np.float64)
    v = np.array([value[n] for n in pairs], dtype=np.float64)
    uncertainty = _floats(trend.get("expanded_uncertainty"))
    u = np.array([(uncertainty[n] if n < len(uncertainty) else None) or 0.0 for n in pairs])
    slope, intercept = usable(trend.get("slope_per_Hz")), usable(trend.get("intercept"))
    half = [(_floats(trend.get("confidence_band")) + [None] * len(frequency))[n] for n in pairs]
    band = None
    if slope is not None and intercept is not None and all(h is not None for h in half):
        width = np.array(half, dtype=np.float64)
        line = intercept + slope * f
        band = (f, line - width, line + width)
    confounded = any(str(text).startswith(CONFOUNDED) for text in trend.get("warnings") or ())
    return TrendSeries(_label(trend), f, v, u, slope, intercept, band, confounded, _with_u(trend, unit))


def _numbers(source: ReportSource, trends: list[Mapping[str, Any]], words: str, unit: str) -> Table:
    rows = []
    for trend in trends:
        frequency, value = _floats(trend.get("frequency_Hz")), _floats(trend.get("values"))
        uncertainty = _floats(trend.get("expanded_uncertainty")) + [None] * len(frequency)
        temperature = _floats(trend.get("temperature_C")) + [None] * len(frequency)
        numbers = {run.id: run.number for run in source.runs}
        for n, identifier in enumerate(str(run) for run in trend.get("runs") or []):
            rows.append(
                (
                    Cell(_label(trend)),
                    Cell(str(numbers.get(identifier, identifier)), "number"),
                    quantity_cell("frequency_Hz", frequency[n], said("no frequency")),
                    measured_cell(value[n], uncertainty[n], said("no value")),
                    quantity_cell("temperature_C", temperature[n], said("no specimen temperature on record")),
                )
            )
    fits = joined(
        "; ",
        (said("{trend}: {trend_2}", trend=_label(trend), trend_2=_fit_text(trend, unit)) for trend in trends),
    )
    return Table(
        words,
        (
            Column(said("Series")),
            Column(said("Run")),
            Column(said("Frequency"), "Hz"),
            Column(said("Value ± U"), unit),
            Column(said("Temperature"), "°C"),
        ),
        tuple(rows),
        note=said("Linear fits: {fits}.", fits=fits),
    )


def _fit_text(trend: Mapping[str, Any], unit: str) -> str:
    slope, intercept = usable(trend.get("slope_per_Hz")), usable(trend.get("intercept"))
    if slope is None or intercept is None:
        return said("no fit")
    shown = "" if unit == "–" else said(" {unit}", unit=unit)
    spread = _with_u(trend, unit)
    return said(
        "{intercept}{shown}, slope {slope}{how}",
        intercept=significant(intercept),
        shown=shown,
        slope=spread or _per_hertz(significant(slope, 3), unit),
        how=said(" (95 %)") if spread else "",
    )
