"""From plot data to SVG text or PNG: the same data give the same bytes."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, ScalarFormatter
from matplotlib.transforms import blended_transform_factory

from bufferstand.evaluation.figures import style
from bufferstand.evaluation.figures.plot import Curve, Fit, Plot, Points, Window
from bufferstand.evaluation.wording import ENGLISH, Language, said, spoken, verdict_words

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.container import ErrorbarContainer

    Handle = Artist | ErrorbarContainer

_LEGEND_ROW_MM = 4.6
_LEGEND_LETTER_MM, _HANDLE_MM, _MOST_COLUMNS = 1.6, 15.0, 4
"""Width of a letter of the legend, and of what stands before an entry, with the space behind it."""
_LETTER_MM, _SURE = 1.9, 0.6
"""Width of a letter at an axis. A label is looked at where it may be longer than this share of its panel."""
# A hundredth of a point is 0.004 mm on paper; matplotlib writes six decimals, which only make files large.
_VERTEX = re.compile(r"([ML]) (-?\d+\.?\d*) (-?\d+\.?\d*) $", re.MULTILINE)
_BALLAST = re.compile(r"<!DOCTYPE[^>]*>\s*|<metadata>.*?</metadata>\s*", re.DOTALL)


def draw(plot: Plot, language: Language = ENGLISH) -> str:
    """Return the figure as SVG text, 170 mm wide, its lettering as outlines.

    Nothing in it depends on the date, the machine or the order of calls.

    Parameters
    ----------
    plot : Plot
        What to draw.
    language : Language
        Of its texts and of the numbers at its axes.

    Returns
    -------
    str
        A whole SVG document.
    """
    text = io.StringIO()
    with mpl.rc_context():
        canvas: Any = FigureCanvasSVG(_figure(spoken(plot, language), language))
        canvas.print_svg(text, metadata={"Date": None, "Creator": None})
    return _VERTEX.sub(_rounded, _BALLAST.sub("", text.getvalue()))


def draw_png(plot: Plot, dots_per_inch: float = 150.0) -> bytes:
    """Return the same figure as PNG, for programs and eyes that want pixels."""
    picture = io.BytesIO()
    with mpl.rc_context():
        canvas: Any = FigureCanvasAgg(_figure(plot, ENGLISH))
        canvas.figure.savefig(picture, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return picture.getvalue()


def _figure(plot: Plot, language: Language) -> Figure:
    """Return the figure painted; the caller restores matplotlib's settings."""
    mpl.rcdefaults()
    mpl.rcParams.update(style.RC)
    figure = Figure(layout="constrained")
    panels = plot.panels()
    heights = [panel.height_mm for panel in panels]
    grid = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)
    by_label: dict[str, Handle] = {}
    for axes, panel in zip(grid[:, 0], panels, strict=True):
        for handle in _paint(axes, panel, language):
            by_label.setdefault(str(handle.get_label()), handle)
        if panel is not panels[-1]:
            axes.set_xlabel("")
        if language.code != "en":
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter(_Ticks(language))
    figure.align_ylabels()
    labels, columns = _legend(plot, list(by_label))
    handles = [by_label[label] for label in labels]
    rows = -(-len(handles) // columns)
    height_mm = sum(heights) + _LEGEND_ROW_MM * rows
    figure.set_size_inches(style.WIDTH_MM * style.MM, height_mm * style.MM)
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=columns)
    _fit_labels(figure, list(zip(grid[:, 0], panels, strict=True)))
    return figure


def _fit_labels(figure: Figure, painted: Sequence[tuple[Axes, Plot]]) -> None:
    """Break labels that are longer than their axis as it is laid out: before the unit, else in the middle."""
    long = [axes for axes, plot in painted if _LETTER_MM * len(axes.get_ylabel()) > _SURE * plot.height_mm]
    for breaks in (_before_unit, _in_the_middle):
        if long:
            figure.draw_without_rendering()
        long = [axes for axes in long if axes.yaxis.label.get_window_extent().height > axes.bbox.height]
        for axes in long:
            axes.set_ylabel(breaks(axes.get_ylabel()))


def _before_unit(label: str) -> str:
    return "\n[".join(label.rsplit(" [", 1))


def _in_the_middle(label: str) -> str:
    """Return a label with a further break, at the space that is nearest to the middle of its first line."""
    first, *_ = label.split("\n", maxsplit=1)
    spaces = [at for at, sign in enumerate(first) if sign == " "]
    if not spaces:
        return label
    at = min(spaces, key=lambda at: abs(2 * at - len(first)))
    return f"{label[:at]}\n{label[at + 1 :]}"


class _Ticks(ScalarFormatter):
    """Numbers at an axis as a language writes them."""

    def __init__(self, language: Language) -> None:
        super().__init__()
        self._language = language

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the number at a tick."""
        return self._language.numeral(super().__call__(x, pos))


def _rounded(vertex: re.Match[str]) -> str:
    return f"{vertex[1]} {round(float(vertex[2]), 2):g} {round(float(vertex[3]), 2):g} "


def _legend(plot: Plot, labels: list[str]) -> tuple[list[str], int]:
    """Return the entries of a legend in their order, and in how many columns: points beside their line."""
    points, fits = [one.label for one in plot.points], [one.label for one in plot.fits]
    paired = len(points) == len(fits) > 1 and sorted(labels) == sorted([*points, *fits])
    if paired and _widths_mm([len(one) for one in (*points, *fits)], 2) <= style.WIDTH_MM:
        return [*points, *fits], 2
    return labels, legend_columns([len(label) for label in labels])


def _widths_mm(lengths: Sequence[int], columns: int) -> float:
    letters = sum(max(column) for column in _filled(lengths, columns))
    return letters * _LEGEND_LETTER_MM + columns * _HANDLE_MM


def legend_columns(lengths: Sequence[int]) -> int:
    """Return in how many columns the entries of a legend stand, by the letters of each.

    As few rows as fit the width, and of as few columns as these rows need. An entry never stands alone in
    the last of two rows: then they stand below each other.
    """
    count, most = len(lengths), 1
    for columns in range(2, min(_MOST_COLUMNS, count) + 1):
        if _widths_mm(lengths, columns) <= style.WIDTH_MM:
            most = columns
    rows = -(-count // most) if count else 1
    columns = -(-count // rows) if count else 1
    return 1 if rows == 2 and count == 3 else max(1, columns)


def _filled(lengths: Sequence[int], columns: int) -> list[Sequence[int]]:
    """Return the entries of each column as matplotlib fills them: one by one, the first ones longer."""
    rows, longer = divmod(len(lengths), columns)
    sizes = [rows + (number < longer) for number in range(columns)]
    ends = np.cumsum(sizes)
    return [lengths[end - size : end] for end, size in zip(ends, sizes, strict=True)]


def _paint(axes: Axes, plot: Plot, language: Language) -> list[Handle]:
    axes.set_xlabel(plot.x_label)
    axes.set_ylabel(plot.y_label)
    _paint_spans(axes, plot)
    handles: list[Handle] = [_paint_curve(axes, curve) for curve in plot.curves]
    for points in plot.points:
        handles.append(_paint_points(axes, points))
        handles += [_paint_fit(axes, fit) for fit in plot.fits if fit.tone == points.tone]
    limit: dict[str, Any] = {"color": style.INK, "linestyle": style.dash(4), "linewidth": 1.8}
    handles += [axes.axhline(level.at, label=level.label, **limit) for level in plot.levels]
    stop_line: dict[str, Any] = {"color": style.INK, "linestyle": style.DOTTED, "linewidth": 1.6}
    handles += [axes.axvline(stop.at, label=stop.label, **stop_line) for stop in plot.stops]
    for window in plot.windows:
        _paint_window(axes, window)
    if plot.windows:
        handles += _window_legend(plot.windows, plot.windows_of, language)
    if plot.x_range is not None:
        axes.set_xlim(*plot.x_range)
    if plot.whole_x:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if plot.y_range is not None:
        axes.set_ylim(*plot.y_range)
    return handles


def _paint_curve(axes: Axes, curve: Curve) -> Line2D:
    if curve.filled:
        whole = ~(np.isnan(curve.x) | np.isnan(curve.y))
        axes.fill(curve.x[whole], curve.y[whole], color=style.SHADE, linewidth=0, zorder=1.5)
    marked: dict[str, Any] = {}
    if curve.marker is not None:
        # Few symbols, shifted from curve to curve, so that those of neighbours do not hide each other.
        spacing = max(1, curve.x.size // 6)
        marked = {
            "marker": style.marker(curve.marker),
            "markevery": (spacing * (curve.marker % 5) // 5, spacing),
            "markersize": 3.6,
        }
    (line,) = axes.plot(
        curve.x,
        curve.y,
        color=style.colour(curve.tone),
        linestyle=style.dash(curve.dash),
        label=curve.label,
        **marked,
    )
    return line


def _paint_fit(axes: Axes, fit: Fit) -> Line2D:
    tint = style.colour(fit.tone)
    if fit.lower is not None and fit.upper is not None:
        axes.fill_between(fit.x, fit.lower, fit.upper, color=tint, alpha=0.15, linewidth=0)
    (line,) = axes.plot(fit.x, fit.y, color=tint, linestyle=style.dash(fit.dash), label=fit.label)
    return line


def _paint_points(axes: Axes, points: Points) -> ErrorbarContainer:
    return axes.errorbar(
        points.x,
        points.y,
        yerr=points.error if np.any(points.error > 0) else None,
        fmt=style.marker(points.tone),
        color=style.colour(points.tone),
        capsize=2.5,
        elinewidth=0.9,
        label=points.label,
    )


def _paint_spans(axes: Axes, plot: Plot) -> None:
    above = blended_transform_factory(axes.transData, axes.transAxes)
    lettering: dict[str, Any] = {"transform": above, "ha": "center", "va": "bottom", "fontsize": 7.5}
    for number, span in enumerate(plot.spans):
        face = style.SHADE if number % 2 == 0 else style.LIGHT_SHADE
        axes.axvspan(span.start, span.end, facecolor=face, linewidth=0, zorder=0)
        if span.label:
            axes.text((span.start + span.end) / 2, 1.01, span.label, **lettering)


def _verdict_symbol(verdict: str) -> dict[str, Any]:
    shape, tint, fill = style.VERDICT_MARKERS[verdict]
    return {
        "linestyle": "none",
        "marker": shape,
        "color": tint,
        "fillstyle": fill,
        "markersize": 6.5,
        "markeredgecolor": style.INK if fill == "full" else tint,
        "markeredgewidth": 0.8,
    }


def _paint_window(axes: Axes, window: Window) -> None:
    axes.errorbar(
        window.at,
        (window.lower + window.upper) / 2,
        yerr=(window.upper - window.lower) / 2,
        fmt="none",
        ecolor=style.INK,
        elinewidth=1.6,
        capsize=6.0,
        capthick=1.6,
        zorder=4,
    )
    leftmost = window.at == 0.0
    axes.annotate(
        window.label,
        (window.at, window.upper),
        xytext=(-6 if leftmost else 0, 5),
        textcoords="offset points",
        ha="left" if leftmost else "center",  # at the left edge a centred text would run over the axis
        va="bottom",
        zorder=6,
        bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
    )
    if window.measured:
        at = [window.at] * len(window.measured)
        axes.plot(at, window.measured, zorder=5, **_verdict_symbol(window.verdict))


def _window_legend(windows: tuple[Window, ...], source: str, language: Language) -> list[Handle]:
    named = f" ({source})" if source else ""
    permitted = language.say(said("permitted range{named}", named=named))
    bar = Line2D([], [], color=style.INK, linewidth=1.6, label=permitted)
    seen = dict.fromkeys(window.verdict for window in windows if window.measured)
    marks = [
        Line2D(
            [],
            [],
            label=language.say(said("measured: {verdict}", verdict=verdict_words(verdict))),
            **_verdict_symbol(verdict),
        )
        for verdict in seen
    ]
    return [bar, *marks]
