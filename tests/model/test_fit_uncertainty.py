"""What a fit knows travels in the model file, and is refused where it contradicts itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bufferstand.foundation.errors import BadInput
from bufferstand.model.file import load_model, save_model
from bufferstand.model.fit_uncertainty import FitUncertainty, knot_name, knot_of
from bufferstand.model.identification.fitting import curve_spread
from bufferstand.model.identification.known_parameters import uncertainty_of
from tests.model.cases import reference_curves, spring
from tests.model.identification.synthetic import KNOTS_mm, fitted, measured

NAMES = ("ln depth_mm", "beta", "loading_kN at 0 mm")


def known() -> FitUncertainty:
    matrix = np.array([[4e-4, 1e-5, 0.0], [1e-5, 1e-6, -2e-4], [0.0, -2e-4, 0.25]])
    return FitUncertainty.of(NAMES, matrix, 1234.5, (7, 0.8, 0.0016))


def test_a_covariance_comes_back_from_the_file(tmp_path):
    model = replace(spring(reference_curves()), fit=known())
    save_model(model, tmp_path / "m.toml")
    again = load_model(tmp_path / "m.toml")
    assert again == model
    assert again.fit is not None
    assert again.fit.covariance[1, 2] == pytest.approx(-2e-4, rel=1e-5)
    assert np.diag(again.fit.covariance) == pytest.approx([4e-4, 1e-6, 0.25])


def test_a_file_without_it_is_read_as_ever(tmp_path):
    save_model(spring(reference_curves()), tmp_path / "m.toml")
    assert "[fit]" not in (tmp_path / "m.toml").read_text(encoding="utf-8")
    assert load_model(tmp_path / "m.toml").fit is None


@pytest.mark.parametrize(
    ("changed", "place"),
    [
        ({"correlation": (0.1,)}, "fit.correlation"),
        ({"correlation": (0.1, 0.2, 1.5)}, "fit.correlation"),
        ({"standard_uncertainty": (0.1, 0.2)}, "fit.standard_uncertainty"),
        ({"standard_uncertainty": (0.1, 0.2, -1.0)}, "fit.standard_uncertainty"),
        ({"parameter": ("beta", "beta", "tau_s")}, "fit.parameter"),
    ],
)
def test_what_contradicts_itself_is_refused(changed, place):
    with pytest.raises(BadInput) as caught:
        replace(known(), **changed)
    assert place in str(caught.value)


def test_names_of_knots_are_read_again():
    assert knot_of(knot_name("unloading_kN", 12.5)) == ("unloading_kN", 12.5)
    assert knot_of("beta") is None
    assert knot_of("loading_kN at the end") is None


@pytest.mark.slow
def test_the_covariance_of_a_fit_is_that_of_its_estimates():
    """Of curves at the knots, against the deviations that the fit states; of laws, its own entries."""
    solution = fitted(measured(1))
    found = uncertainty_of(solution, [])
    at = {name: place for place, name in enumerate(found.parameter)}
    _, (loading, unloading) = curve_spread(solution)
    stated = np.array(found.standard_uncertainty)
    for curve, wanted in (("loading_kN", loading), ("unloading_kN", unloading)):
        assert stated[[at[knot_name(curve, x)] for x in KNOTS_mm]] == pytest.approx(wanted, rel=1e-5)
    entry = solution.problem.frame.place("tau_s")
    place = int(np.count_nonzero(solution.free[:entry]))
    assert stated[at["ln tau_s"]] ** 2 == pytest.approx(solution.covariance[place, place], rel=1e-5)
    assert found.held_out_cycles == 0
    assert np.linalg.eigvalsh(found.covariance).min() > -1e-6 * np.max(found.covariance)
