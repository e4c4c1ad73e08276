"""Errors that runs share: what a mean owes to them, and figures made of several runs."""

from __future__ import annotations

import datetime
import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.across_runs.combine import Figures, RunFigure, coverage_factor_95
from bufferstand.evaluation.across_runs.line import fit_line
from bufferstand.evaluation.across_runs.run_means import figure_of
from bufferstand.evaluation.archive.stored_run import keep
from bufferstand.evaluation.facts.channel_identity import ChannelIdentity, Occasion, identity_of
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.facts.shared_errors import (
    ErrorSource,
    MeasuringChain,
    SharedContributions,
    shared_of,
)
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.evaluation.uncertainty.error_model import draw_errors
from bufferstand.evaluation.uncertainty.shared_errors import Regression
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from tests.evaluation.signals import STATED, Ellipse

FORCE = ChannelUncertainty(accuracy_percent=0.5, reversibility_percent=0.75, zero=0.5, u_delay_s=2e-4)
WIRE = ChannelUncertainty(accuracy_percent=0.1, linearity=0.5, zero=0.2, u_delay_s=1e-4)
SKEW = ErrorSource("delay", "cell", "normal")
SCALE = ErrorSource("force scale", "cell", "rectangular")


def run(frequency_Hz: float, **facts: Any) -> RunEvaluation:
    record = make_record(*Ellipse(mean_kN=250.0).columns(frequency_Hz, 400.0 * frequency_Hz, 4.5, noise=1e-4))
    known = {**STATED, **facts}
    return evaluate_run(record, RunFacts(f"r{frequency_Hz}", "harmonic", **known), Options(draws=500))


def owed(source: ErrorSource, contribution: float) -> SharedContributions:
    return SharedContributions({source: contribution}, abs(contribution))


def channel(name: str = "force", delay_s: float = 0.001, **calibration: Any) -> Channel:
    return Channel(
        name=name,
        quantity="force",
        unit="kN",
        delay_s=delay_s,
        calibration=Calibration(**calibration),
        uncertainty=FORCE,
    )


class TestIdentity:
    def test_by_certificate_wherever_and_whenever_it_was_used(self) -> None:
        dated = channel(id="K1", certificate="D-K 7", date=datetime.date(2026, 1, 15))
        here, there = (
            identity_of(dated, Occasion("stand 1", "B1 in a")),
            identity_of(dated, Occasion("", "B2")),
        )
        assert here.basis == "certificate"
        assert (here.instrument, here.delay) == (there.instrument, there.delay)
        assert here.zero != there.zero  # set with each specimen
        other = identity_of(channel(id="K1", certificate="D-K 8"), Occasion("stand 1", "B1 in a"))
        assert other.instrument != here.instrument

    def test_else_by_the_stand_or_by_what_is_stated(self) -> None:
        plain = channel()
        assert identity_of(plain, Occasion("stand 1")).basis == "stand"
        assert identity_of(plain, Occasion()).basis == "statement"
        assert (
            identity_of(plain, Occasion("stand 1")).instrument
            != identity_of(plain, Occasion("stand 2")).instrument
        )

    def test_a_new_tare_is_another_zero_and_another_filter_another_delay(self) -> None:
        certified: dict[str, Any] = {"certificate": "D-K 7"}
        one = identity_of(channel(**certified), Occasion("s"))
        tared = identity_of(channel(**certified, tare=0.2), Occasion("s"))
        filtered = identity_of(channel(delay_s=0.004, **certified), Occasion("s"))
        assert (one.instrument, one.delay) == (tared.instrument, tared.delay)
        assert one.zero != tared.zero
        assert one.delay != filtered.delay
        assert one.zero == filtered.zero


class TestContributions:
    def test_they_are_those_of_the_draws(self) -> None:
        """A mean that is a known sum of the drawn errors and of noise gives the weights of that sum."""
        chain = MeasuringChain(FORCE, (WIRE, WIRE))
        draws = draw_errors(FORCE, (WIRE, WIRE), 4000, 3)
        assert draws is not None
        errors, noise = draws.errors(), np.random.default_rng(1).normal(0.0, 1e-3, 4000)
        mean = 7.0 * errors["force scale"] - 2e3 * errors["delay"] + noise
        regression = Regression(chain, draws)
        found = regression.shared({"damping": regression.contributions(mean)})
        own = dict(zip(found.errors, found.contributions["damping"][:-1], strict=True))
        assert own["force scale"] == pytest.approx(7.0 * 0.005 / np.sqrt(3.0), rel=0.03)
        assert own["delay"] == pytest.approx(-2e3 * np.hypot(2e-4, 1e-4 / np.sqrt(2.0)), rel=0.03)
        assert all(abs(v) < 1e-4 for name, v in own.items() if name not in ("force scale", "delay"))

    def test_two_wires_each_have_their_share(self) -> None:
        draws = draw_errors(FORCE, (WIRE, WIRE), 1000, 3)
        assert draws is not None
        zero = draws.errors()["stroke zero"]
        regression = Regression(MeasuringChain(FORCE, (WIRE, WIRE)), draws)
        found = regression.shared({"stroke_min_mm": regression.contributions(zero)})
        by_source = found.of("stroke_min_mm").by_source
        shares = [c for source, c in by_source.items() if source.error == "stroke zero"]
        assert shares == pytest.approx([0.1 / np.sqrt(3.0)] * 2, rel=0.05)
        assert found.of("damping") == SharedContributions()

    def test_one_wire_of_two_shares_its_part_only(self) -> None:
        one = ChannelIdentity("w1", "w1 z", "w1 d", "certificate")
        two = ChannelIdentity("w2", "w2 z", "w2 d", "certificate")
        both, alone = run(1.0, stroke_identities=(one, two)), run(
            1.0, stroke_uncertainty=STATED["stroke_uncertainty"][:1], stroke_identities=(one,)
        )  # fmt: skip
        a, b = figure_of(both, "stored_energy_J"), figure_of(alone, "stored_energy_J")
        assert a is not None
        assert b is not None
        common = {s.instrument for s in a.shared.by_source if s in b.shared.by_source}
        assert "w1" in common
        assert "w2" not in common

    def test_all_of_a_mean_but_its_noise_is_shared(self) -> None:
        figure = figure_of(run(1.0), "stored_energy_J")
        assert figure is not None
        assert 0.0 < figure.own_u < 0.2 * figure.u

    def test_they_survive_json_and_the_cache(self) -> None:
        evaluated = run(1.0)
        assert evaluated.shared_errors is not None
        text = json.dumps(evaluated.shared_errors.entry())
        assert shared_of(json.loads(text)) == evaluated.shared_errors
        assert keep(evaluated).light().shared_errors == evaluated.shared_errors
        assert len(text) < 8000

    @pytest.mark.parametrize(
        "spoiled",
        [
            {"errors": ["a"]},
            {"contributions": {"d": [1.0]}},
            {"explained": {}},
            {"sources": [{"error": "x", "instrument": "", "distribution": "normal", "share": 1.0}]},
            {"sources": 3},
        ],
    )
    def test_what_is_none_is_refused(self, spoiled: dict[str, Any]) -> None:
        whole = {
            "basis": "stand",
            "errors": ["a", "b"],
            "sources": [],
            "contributions": {"d": [1.0, 2.0]},
            "explained": {"d": 2.2},
        }
        assert shared_of(whole) is not None
        with pytest.raises(ValueError, match="no errors shared by runs"):
            shared_of(whole | spoiled)
        assert shared_of(None) is None


class TestSums:
    @given(st.floats(0.1, 10.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
    def test_what_is_all_shared_cancels_in_a_difference(self, u: float, share: float, other: float) -> None:
        """Of the same error in both, a share of u², only what each has of its own is left."""
        one = RunFigure(1.0, u, owed(SCALE, u * np.sqrt(share)))
        two = RunFigure(2.0, u, owed(SCALE, u * np.sqrt(other)))
        spread = Figures.of([one, two]).weighted(np.array([-1.0, 1.0]))
        expected = u * u * ((np.sqrt(share) - np.sqrt(other)) ** 2 + (1.0 - share) + (1.0 - other))
        assert spread.u**2 == pytest.approx(expected, rel=1e-9, abs=1e-12)
        assert spread.u <= np.hypot(u, u) * (1.0 + 1e-12)

    def test_the_half_width_of_a_rectangle_is_less_than_that_of_a_normal_error(self) -> None:
        assert coverage_factor_95(0.0) == pytest.approx(1.96, abs=1e-4)
        assert coverage_factor_95(1.0) == pytest.approx(0.95 * np.sqrt(3.0))
        factors = [coverage_factor_95(share) for share in np.linspace(0.0, 1.0, 101)]
        assert np.all(np.diff(factors) < 1e-9)

    def test_the_half_width_is_that_of_a_simulation(self) -> None:
        random = np.random.default_rng(2)
        for rectangles in ([0.5], [0.8], [0.5, 0.3], [0.3, 0.3, 0.3]):
            error = np.sqrt(1.0 - sum(rectangles)) * random.standard_normal(400_000)
            error += sum(np.sqrt(3.0 * s) * random.uniform(-1.0, 1.0, error.size) for s in rectangles)
            found = np.quantile(np.abs(error), 0.95)
            assert coverage_factor_95(max(rectangles)) == pytest.approx(found, rel=0.013)


class TestLine:
    def test_errors_of_each_run_alone_give_weighted_least_squares(self) -> None:
        x, u = [0.1, 0.5, 1.0, 2.0], np.array([0.1, 0.2, 0.1, 0.3])
        y = 3.0 - 0.5 * np.array(x) + np.array([0.02, -0.03, 0.01, 0.05])
        found = fit_line(x, [RunFigure(v, float(s)) for v, s in zip(y, u, strict=True)])
        coefficients, covariance = np.polyfit(x, y, 1, w=1.0 / u, cov="unscaled")
        assert (found.slope.value, found.intercept.value) == pytest.approx(coefficients, rel=1e-9)
        assert (found.slope.u, found.intercept.u) == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-6)
        assert found.scatter_u == 0.0

    def test_a_late_force_turns_the_whole_line(self) -> None:
        """An error proportional to x goes into the slope undiminished, and into nothing else."""
        x = [0.1, 0.5, 1.0, 2.0]
        figures = [RunFigure(3.0 - 0.5 * f, float(np.hypot(0.02 * f, 1e-4)), owed(SKEW, 0.02 * f)) for f in x]
        found = fit_line(x, figures)
        assert found.slope.u == pytest.approx(0.02, rel=1e-3)
        assert found.intercept.u < 1e-3
        alone = fit_line(x, [RunFigure(f.value, f.u) for f in figures])
        assert alone.slope.u < 0.8 * found.slope.u

    def test_an_error_that_all_have_leaves_the_slope(self) -> None:
        x = [0.1, 0.5, 1.0, 2.0]
        found = fit_line(x, [RunFigure(3.0 - 0.5 * f, 0.1, owed(SCALE, 0.0999999)) for f in x])
        assert found.slope.u < 1e-4
        assert found.intercept.u == pytest.approx(0.1, rel=1e-3)
        assert found.intercept.half_width_95 == pytest.approx(0.1 * 1.645, rel=0.01)

    def test_runs_that_scatter_beyond_what_they_state_get_students_t(self) -> None:
        x = np.arange(5.0)
        y = np.array([1.0, 2.5, 2.8, 4.6, 4.9])
        found = fit_line(x.tolist(), [RunFigure(float(v), 1e-6) for v in y])
        coefficients, covariance = np.polyfit(x, y, 1, cov=True)
        assert found.slope.u == pytest.approx(float(np.sqrt(covariance[0, 0])), rel=1e-6)
        assert found.slope.half_width_95 == pytest.approx(3.182446 * found.slope.u, rel=1e-6)
        assert found.scatter_u == pytest.approx(
            float(np.std(y - np.polyval(coefficients, x)) * np.sqrt(5.0 / 3.0)), rel=1e-6
        )

    def test_one_place_is_no_line(self) -> None:
        with pytest.raises(ValueError, match="two different places"):
            fit_line([1.0, 1.0], [RunFigure(1.0, 0.1), RunFigure(2.0, 0.1)])
