from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import cast

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.figures import style
from bufferstand.evaluation.figures.loops import (
    LoopCurve,
    amplitude_loops,
    dynamic_loops,
    frequency_loops,
    static_loops,
)
from bufferstand.evaluation.figures.paint import _figure, draw, legend_columns
from bufferstand.evaluation.figures.plot import Plot, Window
from bufferstand.evaluation.figures.timeline import (
    TimelineStep,
    Trace,
    stroke_plot,
    temperature_plot,
    time_unit,
)
from bufferstand.evaluation.figures.trends import TrendSeries, trend_plot
from bufferstand.evaluation.report.content.content import Picture
from bufferstand.evaluation.report.pictures.trends import _with_u, trend_pictures
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.wording import ENGLISH, LANGUAGES, Code, Language, language_of, spoken
from tests.evaluation_report.conftest import Made


def loop(
    prestress: float = 50.0, amplitude: float = 20.0, frequency: float = 0.5, size: int = 4001
) -> LoopCurve:
    phase = np.linspace(0.0, 2.0 * np.pi, size)
    stroke = prestress - amplitude * np.cos(phase)
    return LoopCurve("1", 1, stroke, 4.0 * stroke + 20.0 * np.sin(phase), prestress, amplitude, frequency)


def words(svg: str) -> set[str]:
    """Return the lettering: matplotlib keeps each text as a comment beside its outlines."""
    return set(re.findall(r"<!-- (.*?) -->", svg))


def plots() -> dict[str, Plot]:
    f, v = np.array([0.1, 0.5, 1.0]), np.array([0.23, 0.228, 0.225])
    series = TrendSeries("20 ± 20 mm", f, v, 0.01 * v, -0.005, 0.23, (f, v - 0.01, v + 0.01))
    steps = [TimelineStep("1", 0.0, 50.0), TimelineStep("2", 60.0, 100.0, "stopped")]
    time = np.arange(0.0, 100.0)
    trace = Trace("spring plate 3", time, 20.0 + time / 5.0)
    window = Window(60.0, 100.0, 400.0, (240.0,), "pass", "100–400")
    return {
        "static": static_loops([loop()], [window]),
        "dynamic": dynamic_loops([loop(20.0, 10.0), loop(50.0, 5.0)], loop()),
        "frequency": frequency_loops([loop(frequency=0.1), loop(frequency=1.0)], loop()),
        "amplitude": amplitude_loops([loop(amplitude=5.0), loop(amplitude=10.0)], None),
        "damping": trend_plot([series], "Damping W$_a$/W$_s$ [–]"),
        "stiffness": trend_plot([series], "Tangent stiffness [kN/mm]"),
        "temperature": temperature_plot([trace], steps, 40.0),
        "stroke": stroke_plot([trace], steps),
    }


LOOPS = ("Stroke [mm]", "Force [kN]")
AXES = (
    LOOPS,
    LOOPS,
    LOOPS,
    LOOPS,
    ("Frequency of loading [Hz]", "Damping W$_a$/W$_s$ [–]"),
    ("Frequency of loading [Hz]", "Tangent stiffness [kN/mm]"),
    ("Time since the start of the first step [s]", "Temperature [°C]"),
    ("Time since the start of the first step [s]", "Stroke [mm]"),
)


def test_both_axes_of_every_figure_name_quantity_and_unit(report: Made) -> None:
    for labels, svg in zip(AXES, report.figures, strict=True):
        for label in labels:
            what, unit = label.rsplit(" [", 1)  # below each other where the axis is too short for both
            assert label in words(svg) or {what, f"[{unit}"} <= words(svg)
        assert all(re.search(r"\[.+\]$", label) for label in labels)


def test_the_same_data_give_the_same_bytes_and_no_date() -> None:
    first, second = draw(plots()["dynamic"]), draw(plots()["dynamic"])
    assert first == second
    assert "<metadata>" not in first
    assert "DOCTYPE" not in first


def test_the_caller_s_matplotlib_settings_do_not_show() -> None:
    import matplotlib as mpl

    expected = draw(plots()["damping"])
    with mpl.rc_context({"font.size": 30, "axes.grid": False, "svg.hashsalt": "other"}):
        assert draw(plots()["damping"]) == expected
        assert mpl.rcParams["font.size"] == 30


def test_svg_is_whole_and_as_wide_as_the_text_of_a_page() -> None:
    root = ET.fromstring(draw(plots()["static"]))
    assert root.attrib["width"].endswith("pt")
    assert float(root.attrib["width"].removesuffix("pt")) / 72.0 * 25.4 == pytest.approx(style.WIDTH_MM)


def test_long_loops_are_thinned_to_1500_points() -> None:
    (curve,) = static_loops([loop(size=50_000)]).curves
    assert 1000 < curve.x.size <= 1500
    assert curve.y.max() == loop(size=50_000).force_kN.max()


def test_no_two_curves_of_a_figure_differ_by_colour_alone() -> None:
    loops = [loop(p, a, f) for p in (20.0, 50.0, 80.0) for a, f in ((5.0, 2.5), (10.0, 1.2), (15.0, 0.8))]
    frequencies = [loop(frequency=f) for f in (0.1, 0.2, 0.4, 0.8, 1.6)]
    for plot in (frequency_loops(frequencies, None), static_loops([loop(), loop(), loop()])):
        assert len({(curve.dash, curve.marker) for curve in plot.curves}) == len(plot.curves)
    # All dynamic loops in one figure: within one prestress by dash; prestresses lie apart on the stroke axis.
    curves = dynamic_loops(loops, None).curves
    assert len({(curve.tone, curve.dash) for curve in curves}) == len(curves)
    scattered = [loop(p, 5.0, 1.0) for p in np.linspace(10.0, 90.0, 15)]
    curves = dynamic_loops(scattered, None).curves
    assert len({(style.colour(curve.tone), style.dash(curve.dash)) for curve in curves}) == len(curves)
    assert len(set(style.DASHES)) >= 6
    assert len(set(style.COLOURS)) >= 6


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_every_colour_stands_out_from_white_paper() -> None:
    assert all(1.05 / (luminance(colour) + 0.05) > 2.0 for colour in style.COLOURS)


def test_verdicts_differ_by_shape() -> None:
    shape = {verdict: mark[0] for verdict, mark in style.VERDICT_MARKERS.items()}
    assert shape["pass"] != shape["fail"] != shape["inconclusive"] != shape["pass"]


def test_an_overlay_frames_the_loops_and_the_full_view_shows_the_static_curve() -> None:
    static = loop(50.0, 50.0)
    near = frequency_loops([loop(20.0, 10.0), loop(20.0, 10.0, 1.0)], static)
    whole = dynamic_loops([loop(20.0, 10.0)], static)
    assert near.x_range is not None
    assert whole.x_range is not None
    assert near.x_range[1] < 40.0
    assert whole.x_range[1] > 100.0
    assert near.curves[0].filled
    assert near.curves[0].label == "quasi-static"


def test_the_quasi_static_curve_is_dotted_black() -> None:
    curve = dynamic_loops([loop()], loop()).curves[0]
    assert style.colour(curve.tone) == style.INK
    assert style.dash(curve.dash) == style.DOTTED


def test_the_temperature_limit_and_the_stop_are_in_the_figure_even_if_never_reached() -> None:
    plot = plots()["temperature"]
    assert plot.y_range is not None
    assert plot.y_range[1] > 40.0
    lettering = words(draw(plot))
    assert {"stop at 40 °C", "run 2 stopped", "spring plate 3", "1", "2"} <= lettering


def test_without_a_known_limit_no_limit_is_drawn() -> None:
    assert temperature_plot([Trace("a", np.array([0.0, 1.0]), np.array([20.0, 21.0]))], [], None).levels == ()


def test_a_flat_trend_looks_flat() -> None:
    f = np.array([0.1, 1.0])
    plot = trend_plot([TrendSeries("a", f, np.array([0.230, 0.231]), np.zeros(2))], "Damping")
    assert plot.y_range is not None
    assert plot.y_range[1] - plot.y_range[0] > 0.04


def test_a_trend_without_a_fit_has_points_only() -> None:
    f = np.array([0.1])
    plot = trend_plot([TrendSeries("a", f, np.array([0.230]), np.zeros(1))], "Damping")
    assert plot.fits == ()
    assert plot.points[0].label == "a"


@pytest.mark.parametrize(
    ("duration", "unit"), [(299.0, "s"), (301.0, "min"), (10_800.0, "min"), (10_801.0, "h")]
)
def test_time_is_in_a_unit_that_reads_well(duration: float, unit: str) -> None:
    assert time_unit(duration)[0] == unit


def test_facts_of_a_plot_are_json_without_nan() -> None:
    curve = static_loops([LoopCurve("1", 1, np.array([0.0, np.nan, 2.0]), np.array([1.0, np.nan, 3.0]))])
    facts = curve.facts()
    assert facts["curves"][0]["x"] == [0.0, None, 2.0]
    assert facts["x_label"] == "Stroke [mm]"


def test_loops_that_coincide_show_their_difference_at_equal_stroke() -> None:
    slow, fast = loop(frequency=0.1), loop(frequency=1.0)
    stiffer = LoopCurve("2", 1, fast.stroke_mm, 1.02 * fast.force_kN + 3.0, 50.0, 20.0, 1.0)
    below = frequency_loops([stiffer, slow], None).below
    assert below is not None
    assert below.y_label == "Less 0.1 Hz [kN]"
    (curve,) = below.curves
    up = curve.x[: int(np.flatnonzero(np.isnan(curve.x))[0])]
    angle = np.arccos((50.0 - up) / 20.0)
    expected = 0.02 * (4.0 * up + 20.0 * np.sin(angle)) + 3.0
    assert curve.y[: up.size] == pytest.approx(expected, abs=0.02)
    assert frequency_loops([slow], None).below is None


@pytest.mark.parametrize(
    ("points", "confounded", "drawn"), [(4, False, False), (5, False, True), (12, True, False)]
)
def test_a_band_is_drawn_where_it_means_something(points: int, confounded: bool, drawn: bool) -> None:
    """From three degrees of freedom on, of a line that nothing is confounded with."""
    f = np.linspace(0.1, 1.0, points)
    v = 0.23 - 0.005 * f
    band, slope = (f, v - 0.01, v + 0.01), "−0.0050 ± 0.0012 per Hz"
    series = TrendSeries("20 ± 20 mm", f, v, 0.01 * v, -0.005, 0.23, band, confounded, slope)
    (fit,) = trend_plot([series], "Damping [–]").fits
    assert (fit.lower is not None) is drawn
    assert fit.label == f"linear fit, slope −0.0050 ± 0.0012 per Hz, ν = {points - 2}"
    (bare,) = trend_plot([replace(series, slope="")], "Damping [–]").fits
    assert bare.label == f"linear fit, ν = {points - 2}", "without its U the slope says nothing"


def test_the_caption_says_why_a_line_has_no_band() -> None:
    trend = {
        "quantity": "damping",
        "prestress_mm": 50.0,
        "amplitude_mm": None,
        "runs": ["a"] * 6,
        "frequency_Hz": [0.1 * n for n in range(1, 7)],
        "values": [0.2] * 6,
        "slope_per_Hz": 0.0,
        "intercept": 0.2,
        "confidence_band": [0.01] * 6,
        "warnings": [],
    }
    confounded = {**trend, "warnings": ["confounded: amplitude varies from 5 to 30 mm along with frequency"]}
    why = "confounded with another condition, has no confidence band"
    for trends, banded, explained in (([trend], True, False), ([confounded], False, True)):
        source = cast(ReportSource, SimpleNamespace(document={"trends": trends}, runs=()))
        (picture,) = trend_pictures(source)
        assert ("95 % confidence bands" in picture.caption) is banded
        assert (why in picture.caption) is explained


def test_the_slope_of_a_fit_stands_in_the_legend_with_u_and_unit() -> None:
    trend = {"slope_per_Hz": -0.001234, "slope_half_width_95_per_Hz": 0.00056}
    assert _with_u(trend, "–") == "−0.00123 ± 0.00056 per Hz"
    assert _with_u(trend | {"slope_expanded_uncertainty_per_Hz": 0.0021}, "kN/mm") == (
        "−0.0012 ± 0.0021 kN/mm per Hz"
    )
    assert _with_u(trend | {"slope_half_width_95_per_Hz": None}, "–") == ""


@given(st.lists(st.tuples(st.floats(0.5, 300.0), st.floats(0.0, 900.0)), min_size=1, max_size=70))
def test_the_numbers_of_steps_do_not_run_into_each_other(lengths: list[tuple[float, float]]) -> None:
    steps, at = [], 0.0
    for number, (lasts, rests) in enumerate(lengths, start=1):
        steps.append(TimelineStep(str(number), at, at + lasts))
        at += lasts + rests
    spans = stroke_plot([Trace("stroke", np.arange(2.0), np.zeros(2))], steps).spans
    named = [span for span in spans if span.label]
    assert named[0].label == "1"
    whole = max(span.end for span in spans)
    for before, after in pairwise(named):
        apart_mm = 140.0 * 0.5 * (after.start + after.end - before.start - before.end) / whole
        assert apart_mm >= 0.5 * 1.6 * (len(before.label) + len(after.label))


def cut_labels(picture: Picture, language: Language) -> list[str]:
    """Return the texts of axes and legend that do not lie within the figure and their own axis, as drawn."""
    with mpl.rc_context():
        figure = _figure(spoken(picture.plot, language), language)
        figure.draw_without_rendering()
        whole = figure.bbox
        labels = [axes.yaxis.label for axes in figure.axes]
        tall = [
            label.get_text()
            for label, axes in zip(labels, figure.axes, strict=True)
            if label.get_window_extent().height > axes.bbox.height
        ]
        shown = [(axes.xaxis.label.get_text(), axes.xaxis.label) for axes in figure.axes]
        shown += [(label.get_text(), label) for label in labels]
        shown += [(f"legend of {picture.caption}", legend) for legend in figure.legends]
        boxes = [(text, one.get_window_extent()) for text, one in shown]
    return tall + [text for text, box in boxes if box.x0 < whole.x0 or box.x1 > whole.x1]


@pytest.mark.parametrize("code", LANGUAGES)
def test_no_label_of_any_figure_is_cut(report: Made, code: Code) -> None:
    """Drawn as they are, every text of the axes and the legend lies within the figure and its own axis."""
    pictures = report.content.pictures()
    assert len(pictures) >= 8
    assert {one.caption: cut for one in pictures if (cut := cut_labels(one, language_of(code)))} == {}


def test_a_label_that_is_cut_would_be_seen(report: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    for breaks in ("_before_unit", "_in_the_middle"):
        monkeypatch.setattr(f"bufferstand.evaluation.figures.paint.{breaks}", lambda label: label)
    label = "Tangentensteifigkeit des Belastungsastes und des Entlastungsastes des Prüflings [kN/mm]"
    picture = replace(report.content.pictures()[0], plot=Plot("Frequenz [Hz]", label, height_mm=56.0))
    assert label in cut_labels(picture, language_of("de"))


def test_the_longest_label_is_broken_where_it_does_not_fit() -> None:
    label = "Tangentensteifigkeit des Belastungsastes [kN/mm]"
    with mpl.rc_context():
        figure = _figure(Plot("Frequenz [Hz]", label, height_mm=56.0), language_of("de"))
        figure.draw_without_rendering()
        (axes,) = figure.axes
        assert axes.yaxis.label.get_window_extent().height <= axes.bbox.height
        assert axes.get_ylabel().replace("\n", " ") == label


@pytest.mark.parametrize(
    ("lengths", "columns"),
    [
        ((), 1),
        ((90,), 1),
        ((20, 20, 20, 20), 2),
        ((15, 15, 15, 15), 4),
        ((24, 24, 24), 3),
        ((45, 45, 45), 1),  # two and one would leave one alone
        ((30, 30, 30, 30), 2),  # three and one would
        ((24,) * 5, 3),
        ((60, 60, 60, 60), 1),
    ],
)
def test_no_entry_of_a_legend_stands_alone_in_its_row(lengths: tuple[int, ...], columns: int) -> None:
    assert legend_columns(lengths) == columns


def test_a_line_stands_beside_its_points_in_the_legend() -> None:
    f = np.linspace(0.1, 1.0, 4)
    names = ("20 ± 20 mm", "40 ± 40 mm", "50 mm, several amplitudes")
    series = [
        TrendSeries(
            name, f, 0.2 + 0.01 * n - 0.01 * f, 0.01 * f, -0.01, 0.2 + 0.01 * n, slope=f"−0.0{n + 1} per Hz"
        )
        for n, name in enumerate(names)
    ]
    (legend,) = _figure(trend_plot(series, "Damping [–]"), ENGLISH).legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert legend._ncols == 2
    assert texts[:3] == list(names)
    assert [text.partition(",")[0] for text in texts[3:]] == ["linear fit"] * 3
    assert texts[3].startswith("linear fit, slope −0.01 per Hz"), "that of the first series"
    long = [
        replace(one, label="a name of more letters than a page has room for, as a laboratory gives them")
        for one in series
    ]
    (legend,) = _figure(trend_plot(long, "Damping [–]"), ENGLISH).legends
    assert legend._ncols == 1
