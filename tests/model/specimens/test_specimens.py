"""Mean and spread over specimens: against a published analysis, against the truth of simulated families."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.model.specimens import between_specimens, compare_specimens, difference_of, figures_of
from tests.model.cases import spring
from tests.model.twin.specimens import drawn_spring, known_model

# The 13 trials of dat.bcg (Colditz et al. 1994): log risk ratios and variances. What is expected of them is
# what R's package metafor gives: rma(yi, vi, method = "REML") and confint().
BCG = (
    (-0.8893, 0.3256), (-1.5854, 0.1946), (-1.3481, 0.4154), (-1.4416, 0.0200), (-0.2175, 0.0512),
    (-0.7861, 0.0069), (-1.6209, 0.2230), (0.0120, 0.0040), (-0.4694, 0.0564), (-1.3713, 0.0730),
    (-0.3394, 0.0124), (0.4459, 0.5325), (-0.0173, 0.0714),
)  # fmt: skip


def test_a_published_analysis_comes_out():
    found = between_specimens([y for y, _ in BCG], [v**0.5 for _, v in BCG])
    assert found.spread**2 == pytest.approx(0.3132, abs=5e-4)
    assert found.mean == pytest.approx(-0.7145, abs=5e-4)
    assert found.spread_interval[0] ** 2 == pytest.approx(0.1197, abs=1e-3)
    assert found.spread_interval[1] ** 2 == pytest.approx(1.1115, abs=5e-3)
    assert found.own_share == pytest.approx(0.9222, abs=1e-3)


def test_equal_uncertainties_have_a_closed_form():
    """tau² is then the variance of the figures less u², and the mean theirs."""
    values = np.array([1.0, 1.4, 0.7, 1.2, 1.9])
    found = between_specimens(values, [0.2] * 5)
    assert found.spread**2 == pytest.approx(np.var(values, ddof=1) - 0.04, rel=1e-4)
    assert found.mean == pytest.approx(values.mean())
    assert found.standard_uncertainty == pytest.approx(np.std(values, ddof=1) / 5**0.5, rel=1e-4)


def test_figures_that_agree_within_their_uncertainty_have_no_spread():
    found = between_specimens([1.0, 1.05, 0.97], [0.2] * 3)
    assert found.spread == 0.0
    assert found.spread_interval[0] == 0.0
    assert found.own_share == 0.0


def test_intervals_hold_the_truth_as_often_as_they_say():
    random = np.random.default_rng(8)
    held = np.zeros(2)
    for _ in range(400):
        u = random.uniform(0.2, 1.0, 6)
        y = 5.0 + random.normal(0.0, 0.7, 6) + random.normal(0.0, u)
        found = between_specimens(y, u)
        held += [
            found.interval[0] <= 5.0 <= found.interval[1],
            found.spread_interval[0] <= 0.7 <= found.spread_interval[1],
        ]
    assert np.all(held / 400.0 > 0.92)  # 0.95 less three standard deviations


def test_two_specimens_are_refused():
    with pytest.raises(BadInput, match="three or more"):
        between_specimens([1.0, 2.0], [0.1, 0.1])
    with pytest.raises(BadInput, match="how well it is known"):
        figures_of(spring(), (20.0,))


def test_forces_at_common_strokes_have_the_uncertainty_of_drawn_models():
    random = np.random.default_rng(2)
    strokes = (20.0, 50.0, 80.0)
    drawn = [figures_of(drawn_spring(random), strokes)[-6:] for _ in range(150)]
    scatter = np.std([[one.value for one in figures] for figures in drawn], axis=0)
    stated = [one.standard_uncertainty for one in figures_of(known_model(), strokes)[-6:]]
    assert stated == pytest.approx(scatter, rel=0.25)


def test_used_specimens_that_are_softer_are_told_from_new_ones():
    random = np.random.default_rng(6)

    def made(softer):
        model = drawn_spring(random)
        return replace(model, curves=model.curves.scaled(softer * float(np.exp(random.normal(0.0, 0.01)))))

    new, used = [made(1.0) for _ in range(4)], [made(0.9) for _ in range(4)]
    found = {one.name: one for one in compare_specimens(new, used)}
    top = found["loading at 96 mm"]
    assert top.first.spread == pytest.approx(0.01, abs=0.012)
    assert top.difference is not None
    assert top.difference.distinguished
    assert top.difference.value == pytest.approx(np.log(0.9), abs=0.03)
    beta = found["beta"]
    assert beta.difference is not None
    assert not beta.difference.distinguished
    alone = {one.name: one for one in compare_specimens(new)}
    assert alone["beta"].difference is None
    same = difference_of(beta.first, beta.first)
    assert same.value == 0.0
