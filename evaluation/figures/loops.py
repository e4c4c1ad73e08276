"""Force–stroke figures: the quasi-static cycles, and dynamic loops over them (paper, Figs 5, 6 and 7)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TypedDict

import numpy as np

from bufferstand.evaluation.figures.decimate import kept_samples
from bufferstand.evaluation.figures.plot import BLACK, Curve, Floats, Plot, Window
from bufferstand.evaluation.figures.style import COLOURS
from bufferstand.evaluation.wording import numeral, said

STROKE_LABEL = said("Stroke [mm]")
FORCE_LABEL = said("Force [kN]")
STATIC_MM = 80.0
"""Height of the figure of quasi-static cycles [mm]."""
_LOOPS_MM = 56.0
_PANEL_MM = 24.0
_GRID = 200
_LOOP_POINTS = 1500
_FIGURE_POINTS = 12_000
_LEAST_POINTS = 200
"""Points of a loop: fewer where many share a figure; 300 still draw a smooth one."""
_DOTTED = -1
_SAME_PRESTRESS_MM = 2.0


class Ranges(TypedDict):
    """Both axes of a figure."""

    x_range: tuple[float, float]
    y_range: tuple[float, float]


@dataclass(frozen=True, eq=False)
class LoopCurve:
    """One closed cycle of a run.

    Parameters
    ----------
    run : str
        The run's short name in the report.
    cycle : int
        The cycle's number in its run.
    stroke_mm, force_kN : ndarray, shape (n,)
        The cycle's samples in the order of time; NaN where samples were lost.
    prestress_mm, amplitude_mm, frequency_Hz : float or None
        Mean stroke, half the stroke range, and frequency; None where the cycle has none.
    """

    run: str
    cycle: int
    stroke_mm: Floats
    force_kN: Floats
    prestress_mm: float | None = None
    amplitude_mm: float | None = None
    frequency_Hz: float | None = None


def static_loops(
    loops: Sequence[LoopCurve],
    windows: Sequence[Window] = (),
    windows_of: str = "",
    *,
    height_mm: float = STATIC_MM,
) -> Plot:
    """Return the quasi-static cycles of one run, the permitted force ranges and the measured forces.

    ``windows_of`` names standard and clause of the ranges, for the legend; ``height_mm`` is that of the axes.
    """
    curves = tuple(
        _curve(loop, said("cycle {cycle}", cycle=loop.cycle), tone=number, dash=number)
        for number, loop in enumerate(loops)
    )
    ranges = _ranges(loops, windows)
    return Plot(
        STROKE_LABEL,
        FORCE_LABEL,
        curves=curves,
        windows=tuple(windows),
        windows_of=windows_of,
        height_mm=height_mm,
        **ranges,
    )


def dynamic_loops(loops: Sequence[LoopCurve], static: LoopCurve | None) -> Plot:
    """Return all dynamic loops over the quasi-static cycle: a colour a prestress, a dash an amplitude."""
    tones = _tones(loop.prestress_mm or 0.0 for loop in loops)
    within: dict[int, int] = {}
    curves = []
    for loop in sorted(loops, key=_by_condition):
        tone = tones[loop.prestress_mm or 0.0]
        variant = within[tone] = within.get(tone, -1) + 1
        label = said(
            "{prestress_mm} ± {amplitude_mm} mm, {loop}",
            prestress_mm=_mm(loop.prestress_mm),
            amplitude_mm=_mm(loop.amplitude_mm),
            loop=_hz(loop),
        )
        curves.append(_curve(loop, label, tone=tone, dash=variant, among=len(loops)))
    return _over(static, loops, curves, whole=True)


def frequency_loops(loops: Sequence[LoopCurve], static: LoopCurve | None) -> Plot:
    """Return loops of one prestress and amplitude at several frequencies (paper, Fig. 6)."""
    ordered = sorted(loops, key=lambda loop: loop.frequency_Hz or 0.0)
    curves = [
        _curve(loop, _hz(loop), tone=n, dash=n, marker=n, among=len(loops)) for n, loop in enumerate(ordered)
    ]
    plot = _over(static, loops, curves)
    return replace(plot, below=_less_the_first(ordered, curves, plot))


def amplitude_loops(loops: Sequence[LoopCurve], static: LoopCurve | None) -> Plot:
    """Return loops of one prestress at several amplitudes (paper, Fig. 7)."""
    ordered = sorted(loops, key=_by_condition)
    curves = [
        _curve(
            loop,
            said("± {amplitude_mm} mm, {loop}", amplitude_mm=_mm(loop.amplitude_mm), loop=_hz(loop)),
            tone=n,
            dash=n,
            marker=n,
            among=len(loops),
        )
        for n, loop in enumerate(ordered)
    ]
    return _over(static, loops, curves)


def labelled_loops(loops: Sequence[LoopCurve], labels: Sequence[str]) -> Plot:
    """Return loops of one step with their labels: several temperatures (paper, Fig. 9), or specimens."""
    curves = tuple(
        _curve(loop, label, tone=n, dash=n, marker=n)
        for n, (loop, label) in enumerate(zip(loops, labels, strict=True))
    )
    return Plot(STROKE_LABEL, FORCE_LABEL, curves=curves, height_mm=_LOOPS_MM, **_ranges(loops, ()))


def _over(
    static: LoopCurve | None, loops: Sequence[LoopCurve], curves: list[Curve], *, whole: bool = False
) -> Plot:
    """Lay curves over the quasi-static cycle, dotted as in the paper; show it ``whole`` or near the loops."""
    ranges = framed_ranges(loops)
    if static is not None:
        envelope = _curve(static, said("quasi-static"), tone=BLACK, dash=_DOTTED, filled=True)
        curves = [envelope, *curves]
        loops = [static, *loops]
    if whole:
        ranges = _ranges(loops, ())
    return Plot(STROKE_LABEL, FORCE_LABEL, curves=tuple(curves), height_mm=_LOOPS_MM, **ranges)


def _less_the_first(ordered: Sequence[LoopCurve], curves: Sequence[Curve], over: Plot) -> Plot | None:
    """Return a panel of the forces less those of the first loop at equal stroke, where curves coincide."""
    differences = [
        replace(curve, x=x, y=y)
        for loop, curve in zip(ordered[1:], curves[1:], strict=True)
        for x, y in (_difference(loop, ordered[0]),)
        if x.size
    ]
    if not differences:
        return None
    ends = [float(end(curve.y)) for curve in differences for end in (np.nanmin, np.nanmax)]
    margin = 0.1 * (max(ends) - min(ends)) or 1.0
    return Plot(
        STROKE_LABEL,
        said("Less {ordered} [kN]", ordered=_hz(ordered[0])),
        curves=tuple(differences),
        x_range=over.x_range,
        y_range=(min(ends) - margin, max(ends) + margin),
        height_mm=_PANEL_MM,
    )


def _difference(loop: LoopCurve, reference: LoopCurve) -> tuple[Floats, Floats]:
    """Return strokes up and down again, and the force of a loop less that of another at the same stroke.

    Within the strokes that both reach, without the twentieth at each end: there they turn.
    """
    low, high = (
        end([float(of(one.stroke_mm)) for one in (loop, reference)])
        for end, of in ((max, np.nanmin), (min, np.nanmax))
    )
    if high <= low:
        return np.empty(0), np.empty(0)
    spare = 0.05 * (high - low)
    stroke = np.linspace(low + spare, high - spare, _GRID)
    pairs = zip(_branches(loop), _branches(reference), strict=True)
    up, down = (np.interp(stroke, *one) - np.interp(stroke, *other) for one, other in pairs)
    break_ = np.array([np.nan])
    return np.concatenate([stroke, break_, stroke[::-1]]), np.concatenate([up, break_, down[::-1]])


def _branches(loop: LoopCurve) -> list[tuple[Floats, Floats]]:
    """Return stroke and force of the loading and the unloading branch, in the order of the stroke."""
    whole = ~(np.isnan(loop.stroke_mm) | np.isnan(loop.force_kN))
    stroke, force = loop.stroke_mm[whole], loop.force_kN[whole]
    top = int(np.argmax(stroke))
    branches = []
    for part in (slice(0, top + 1), slice(top, None)):
        order = np.argsort(stroke[part], kind="stable")
        branches.append((stroke[part][order], force[part][order]))
    return branches


def _curve(
    loop: LoopCurve,
    label: str,
    *,
    tone: int,
    dash: int,
    marker: int | None = None,
    filled: bool = False,
    among: int = 1,
) -> Curve:
    points = min(_LOOP_POINTS, max(_LEAST_POINTS, _FIGURE_POINTS // among))
    kept = kept_samples(loop.stroke_mm, loop.force_kN, points)
    return Curve(label, loop.stroke_mm[kept], loop.force_kN[kept], tone, dash, marker, filled)


def _ranges(loops: Sequence[LoopCurve], windows: Sequence[Window]) -> Ranges:
    """Return both axes from zero, or from the least value if that is negative, with room for symbols."""
    xs = [0.0, *(window.at for window in windows)]
    ys = [0.0, *(window.upper for window in windows)]
    for loop in loops:
        xs += [float(np.nanmin(loop.stroke_mm)), float(np.nanmax(loop.stroke_mm))]
        ys += [float(np.nanmin(loop.force_kN)), float(np.nanmax(loop.force_kN))]
    margin = 0.03 * (max(xs) - min(xs)) or 1.0
    left = min(xs) - (margin if windows or min(xs) < 0 else 0.0)
    low, high = min(ys), max(ys)
    # Noise around zero force is no reason to start the axis far below it.
    return Ranges(x_range=(left, max(xs) + margin), y_range=(min(0.0, 1.02 * low), 1.1 * high or 1.0))


def framed_ranges(loops: Sequence[LoopCurve]) -> Ranges:
    """Return axes that frame the loops with a quarter of their extent around, yet not below zero."""
    x_range = _framed([loop.stroke_mm for loop in loops])
    y_range = _framed([loop.force_kN for loop in loops])
    return Ranges(x_range=x_range, y_range=y_range)


def _framed(values: Sequence[Floats]) -> tuple[float, float]:
    low = min(float(np.nanmin(value)) for value in values)
    high = max(float(np.nanmax(value)) for value in values)
    margin = 0.25 * (high - low) or 1.0
    return min(low, max(0.0, low - margin)), high + margin


def _by_condition(loop: LoopCurve) -> tuple[float, float, float]:
    """Order by prestress, amplitude and frequency; the measured strokes of equal steps differ a little."""
    return (_rounded(loop.prestress_mm), _rounded(loop.amplitude_mm), loop.frequency_Hz or 0.0)


def _rounded(value: float | None) -> float:
    return round(value or 0.0)


def _tones(prestresses_mm: Iterable[float]) -> dict[float, int]:
    """Return a tone for each prestress; one that follows within 2 mm has the tone of the last."""
    tones: dict[float, int] = {}
    last, tone = -np.inf, -1
    for value in sorted(prestresses_mm):
        tone += value - last > _SAME_PRESTRESS_MM
        last = value
        # Beyond the last colour they begin again; the dashes of a colour go on, so no two curves are alike.
        tones[value] = int(tone) % len(COLOURS)
    return tones


def _mm(value: float | None) -> str:
    return "—" if value is None else said("{value}", value=numeral(f"{value:.3g}"))


def _hz(loop: LoopCurve) -> str:
    return (
        said("— Hz")
        if loop.frequency_Hz is None
        else said("{frequency_hz} Hz", frequency_hz=numeral(f"{loop.frequency_Hz:.3g}"))
    )
