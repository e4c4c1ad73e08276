"""The laws of the families: closed forms, closing loops, and agreement with the model that is exported."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.model.curves import Curves
from bufferstand.model.families import FAMILIES
from bufferstand.model.families.band_laws import berg, bouc_wen, eq_4, eq_4_with_return_points
from bufferstand.model.families.catalogue import cole_cole
from bufferstand.model.families.data import GRID_TAU_S, nodes_of
from bufferstand.model.identification import Drive, Experiment
from bufferstand.model.simulation import simulate
from bufferstand.model.spring import HeatBalance, SpringModel, ViscousBranch
from bufferstand.model.tables import BandTables
from tests.model.families.worlds import BY_NAME, FRAME, LAW, TRUE, data_on, loading, true_vector


def along(*turns_mm, points=40):
    """Nodes along straight ways between turns."""
    parts = [np.array([turns_mm[0]])]
    halves = [np.array([0])]
    for number, (begin, end) in enumerate(pairwise(turns_mm)):
        parts.append(np.linspace(begin, end, points + 1)[1:])
        halves.append(np.full(points, number + 1))
    x = np.concatenate(parts)
    half = np.append(np.concatenate(halves)[1:] - 1, len(turns_mm) - 2)
    n = x.size
    drive = Drive(np.arange(float(n)), x, half, np.arange(n), np.zeros(n), np.ones(n), np.zeros(n),
                  np.empty(0), np.empty(0), 25.0)  # fmt: skip
    return nodes_of(Experiment(drive, True, np.ones(n, dtype=bool)), np.full(n, 25.0), LAW, 90.0)


def tables():
    x = np.linspace(0.0, 90.0, 10)
    upper = loading(x)
    return BandTables.of(Curves(tuple(x), tuple(upper), tuple(0.6 * upper), 4.0), 20.0)


def test_bergs_friction_goes_half_the_way_in_its_length():
    data = along(0.0, 30.0, 10.0)
    z = 2.0 * berg(data, 3.0) - 1.0
    x = data.x_mm
    first = x[:41]
    np.testing.assert_allclose(z[:41], -1.0 + 2.0 * first / (6.0 + first), atol=1e-12)
    down, begun = x[40] - x[40:], z[40]
    np.testing.assert_allclose(
        z[40:], begun - (1.0 + begun) * down / (3.0 * (1.0 + begun) + down), atol=1e-12
    )


def test_bouc_wen_has_a_closed_form_where_it_is_an_exponential():
    """n = 1, beta = gamma = 1/2: z' = 1 against the way, 1 - |z| with it."""
    z = 2.0 * bouc_wen(along(0.0, 30.0, points=300), 5.0, 1.0, 0.5) - 1.0
    x = np.linspace(0.0, 30.0, 301)
    np.testing.assert_allclose(z, np.where(x < 5.0, x / 5.0 - 1.0, 1.0 - np.exp(1.0 - x / 5.0)), atol=2e-3)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(40.0, 85.0), st.floats(0.2, 0.9), st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.integers(1, 3)
)
def test_inner_loops_close_and_are_forgotten(top, down, up, again, loops):
    """I: with return points the way to ``top`` goes on as if its inner loops had never been."""
    table = tables()
    low = down * top
    inner = low + up * (top - low)
    deep = inner - again * (inner - low)
    nested = [inner, deep] * loops
    with_loops = along(0.0, top, low, *nested, 0.5 * (inner + top), top + 2.0)
    without = along(0.0, top, low, 0.5 * (inner + top), top + 2.0)
    p, q = (eq_4_with_return_points(data, table) for data in (with_loops, without))
    assert np.all((p >= -1e-12) & (p <= 1.0 + 1e-12))
    np.testing.assert_allclose(p[-1], q[-1], atol=1e-9)
    at_inner = [p[40 * (2 + 2 * k + 1)] for k in range(loops)]
    np.testing.assert_allclose(at_inner, at_inner[0], atol=1e-9)


def test_without_return_points_the_loops_creep():
    table = tables()
    data = along(0.0, 60.0, *[50.0, 60.0] * 4)
    creeping, closed = eq_4(data, table), eq_4_with_return_points(data, table)
    tops = slice(40, None, 80)
    assert np.all(np.diff(creeping[tops]) < 0.0)
    assert creeping[40] - creeping[360] > 0.05
    np.testing.assert_allclose(closed[tops], closed[40], atol=1e-9)
    np.testing.assert_allclose(creeping[:81], closed[:81], atol=1e-5)  # the first ways are the same


def test_the_fractional_element_has_its_complex_modulus():
    """(i w tau)^a / (1 + (i w tau)^a), from thirteen branches, within 2 % of its instantaneous stiffness."""
    tau, order = 1.0, 0.6
    shares = cole_cole(order, tau)
    for omega in (0.1, 1.0, 10.0):
        branch = 1j * omega * np.array(GRID_TAU_S)
        ours = np.sum(shares * branch / (1.0 + branch))
        true = (1j * omega * tau) ** order / (1.0 + (1j * omega * tau) ** order)
        assert abs(ours - true) < 0.02


@pytest.mark.parametrize("name", ["ours", "ours-spectrum"])
def test_our_families_are_the_model_that_is_exported(name):
    family, data = BY_NAME[name], data_on(points=60)
    vector = true_vector(family)
    n = len(FRAME.knots_mm)
    curves = Curves(
        FRAME.knots_mm, tuple(np.cumsum(vector[:n])), tuple(np.cumsum(vector[n : 2 * n])), 4.0,
        contact_ramp_mm=FRAME.contact_ramp_mm,
    )  # fmt: skip
    viscous = ViscousBranch(0.06, 6.0, 0.04 if name == "ours-spectrum" else 0.0)
    model = SpringModel("same", curves, LAW, HeatBalance(1e9), viscous)
    drive = data.experiment.drive
    theirs = simulate(model, drive.time_s, drive.stroke_mm, temperature_C=25.0, isothermal=True).force_kN
    ours = family.force_kN(FRAME, vector, data)
    used = data.experiment.used
    # Between nodes the fast branches follow a cubic here, a straight line there: 0.1 % of the force.
    np.testing.assert_allclose(ours[used], theirs[used], atol=0.2 if name == "ours-spectrum" else 0.05)


@pytest.mark.parametrize("family", FAMILIES, ids=[family.name for family in FAMILIES])
def test_a_slow_stroke_at_rest_lies_on_or_between_the_curves(family):
    """Driven so slowly that no rate shows, every family gives forces of its curves, rising."""
    values = family.values(FRAME, true_vector(family))
    assert set(values) == {law.name for law in family.laws}
    assert len(TRUE[family.name]) == len(family.laws)
    data = data_on(steps=((44.0, 44.0, 1e-5, 1),), points=60)
    force = family.force_kN(FRAME, true_vector(family), data)
    turn = int(np.argmax(data.x_mm))
    upper = loading(data.x_mm)
    assert np.all(np.diff(force[1 : turn + 1]) > 0.0)
    assert np.all(force <= 1.03 * upper + 0.5)
    assert np.all(force >= 0.0)
