"""Figures for the colour-blind, for black-and-white printers and for readers of axes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from bufferstand.evaluation.figures import style
from bufferstand.evaluation.figures.plot import Curve, Plot
from bufferstand.evaluation.report.content.content import Content
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.layout import contents

Floats = NDArray[np.float64]

# Machado, Oliveira and Fernandes (2009), "A physiologically-based model for simulation of color vision
# deficiency", table 1, severity 1.0: matrices in linear RGB.
_DEFICIENCIES = {
    "protanopia": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopia": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopia": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
_TOLD_APART = 9.0
"""Least CIE76 distance of two tones; 2.3 is just noticeable on large patches, lines need more."""


def linear(colour: str) -> Floats:
    """Return a colour in linear RGB."""
    parts = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def lab(rgb: Floats) -> Floats:
    """Return linear RGB as CIE L*a*b* (D65)."""
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = to_xyz @ np.clip(rgb, 0.0, 1.0) / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def seen(colour: str, deficiency: str) -> Floats:
    """Return a colour as someone with a deficiency sees it, in L*a*b*."""
    return lab(np.array(_DEFICIENCIES[deficiency]) @ linear(colour))


def lightness(colour: str) -> float:
    """Return what a black-and-white printer makes of a colour: L*, 0 black to 100 white."""
    return float(lab(np.full(3, np.dot([0.2126, 0.7152, 0.0722], linear(colour))))[0])


@pytest.mark.parametrize("deficiency", _DEFICIENCIES)
def test_every_two_tones_are_told_apart_by_the_colour_blind(deficiency: str) -> None:
    views = {colour: seen(colour, deficiency) for colour in (*style.COLOURS, style.INK)}
    for one, two in combinations(views, 2):
        assert np.linalg.norm(views[one] - views[two]) > _TOLD_APART, (one, two)


def test_the_simulation_finds_red_and_green_alike() -> None:
    # The test must be able to fail: what everyone knows to be confused is confused by it.
    red, green = seen("#b04a3a", "deuteranopia"), seen("#7a7a2a", "deuteranopia")
    assert np.linalg.norm(red - green) < _TOLD_APART
    assert np.linalg.norm(lab(linear("#b04a3a")) - lab(linear("#7a7a2a"))) > 3 * _TOLD_APART


@pytest.fixture(scope="module")
def reports(report: Made, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Content]:
    return contents(tmp_path_factory.mktemp("read")) | {"eleven runs": report.content}


def plots(reports: dict[str, Content]) -> list[Plot]:
    return [panel for c in reports.values() for picture in c.pictures() for panel in picture.plot.panels()]


def test_in_black_and_white_every_two_curves_of_a_panel_differ_by_line_or_symbol(
    reports: dict[str, Content],
) -> None:
    checked = 0
    for plot in plots(reports):
        for one, two in combinations(plot.curves, 2):
            if one.label == two.label:
                continue
            assert alike(one) != alike(two) or prestresses_apart(one, two), (one.label, two.label)
            checked += 1
        for first, second in combinations(plot.points, 2):
            assert style.marker(first.tone) != style.marker(second.tone)
        for fit, other in combinations(plot.fits, 2):
            assert style.dash(fit.dash) != style.dash(other.dash)
    assert checked > 20


def alike(curve: Curve) -> tuple[object, object, int]:
    """Return what a black-and-white print shows of a curve: line style, symbol, grey in steps of 25."""
    symbol = None if curve.marker is None else style.marker(curve.marker)
    return style.dash(curve.dash), symbol, round(lightness(style.colour(curve.tone)) / 25.0)


def prestresses_apart(one: Curve, two: Curve) -> bool:
    """Say whether two loops lie at different strokes, as those of different prestress do."""
    return abs(float(np.nanmean(one.x)) - float(np.nanmean(two.x))) > 5.0


def test_every_axis_of_every_figure_has_a_unit_and_every_column_of_its_numbers(
    reports: dict[str, Content],
) -> None:
    for plot in plots(reports):
        for label in (plot.x_label, plot.y_label):
            assert re.search(r"\S \[(mm|kN|kN/mm|°C|kJ|s|min|h|Hz|%|–|No\.)\]$", label), label
    counts = {"Run", "Cycle", "Step", "E_n", "Whole cycles"}
    for content in reports.values():
        for picture in content.pictures():
            for number, column in enumerate(picture.numbers.columns):
                cells = [row[number] for row in picture.numbers.rows]
                if any(cell.tone == "number" for cell in cells) and column.title not in counts:
                    timed = any(re.search(r"\d (s|min|h)\b", cell.text) for cell in cells)
                    assert column.unit or timed, (picture.caption, column.title)


def test_every_figure_of_the_paper_has_its_counterpart(reports: dict[str, Content]) -> None:
    captions = [picture.caption for content in reports.values() for picture in content.pictures()]
    for words in (
        "Stroke over the campaign",  # Fig. 4
        "over the quasi-static cycle",  # Figs 5 to 7
        "Damping (absorbed over stored energy) over frequency",  # Fig. 8a
        "Tangent stiffness of the loading branch",  # Fig. 8b
        "by the model",  # Figs 10, 12
        "the energy that the complete cycles absorbed",  # Fig. 11
    ):
        assert any(words in caption for caption in captions), words
    assert all(picture.numbers.rows for c in reports.values() for picture in c.pictures())


def test_verdict_marks_differ_by_shape_and_fill() -> None:
    groups: Sequence[Sequence[str]] = (
        ("pass",),
        ("conditional-pass",),
        ("conditional-fail",),
        ("fail", "invalid"),
        ("inconclusive", "not-tested"),
    )
    shapes = [{style.VERDICT_MARKERS[v][::2] for v in group} for group in groups]
    for one, two in combinations(shapes, 2):
        assert not one & two
