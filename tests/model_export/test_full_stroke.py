"""From runs that end short of the full stroke to an impact that does not: fit, FMU, and the true spring.

The true spring is known as a formula. Its impact is integrated here from eq. (4) itself, in the force, by
scipy; nothing of the model's own step or tables is used for it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bufferstand.model import SpringModel, load_model, save_model
from bufferstand.model.curves import Curves
from bufferstand.model.export import FmuOptions, export_fmu
from bufferstand.model.identification import FitSettings, Identification, identify
from bufferstand.model.spring import HeatBalance, TemperatureLaw, ViscousBranch
from tests.model.identification.synthetic import FINER, RATE_Hz, harmonic, measured, simulated, static
from tests.model_export.cases import unpack
from tests.model_export.host import CO_SIMULATION, OK, Host

FULL_mm = 105.0
REACHED_mm = 98.4
TRANSITION_mm, BETA, TAU_s = 4.0, 0.045, 8.0
C = (600.0 - 15.0 - 192.0) / 96.0**4
MASS_t = 80.0
"""Of each of two wagons. Each end has two buffers, and each buffer half of the way: F = -(MASS / 2) x''."""
SPEED_m_per_s = 7.95 / 3.6
DT_s = 2e-5


def loading(x):
    return 15.0 + 2.0 * x + C * x**4


def unloading(x):
    return loading(x) * (0.83 - 0.0038 * x)


@cache
def true_spring() -> SpringModel:
    """The formula in a table of 1 mm; it neither warms up nor softens."""
    x = np.linspace(0.0, FULL_mm, 106)
    tables = (tuple(values.tolist()) for values in (x, loading(x), unloading(x)))
    return SpringModel(
        name="true",
        curves=Curves(*tables, transition_length_mm=TRANSITION_mm),
        temperature=TemperatureLaw(),
        heat=HeatBalance(capacity_J_per_K=1e6),
        viscous=ViscousBranch(beta=BETA, tau_s=TAU_s),
    )


@cache
def fitted(full_mm: float | None = FULL_mm) -> Identification:
    """From a slow stroke to 98.4 mm and loops inside it."""
    rate = RATE_Hz * FINER
    parts = [
        static(REACHED_mm, 5.0, rate), 30.0,
        harmonic(50.0, 10.0, 0.8, 3, rate), 20.0,
        harmonic(20.0, 8.0, 0.8, 3, rate), 20.0,
        harmonic(80.0, 10.0, 0.5, 3, rate), 60.0,
        harmonic(40.0, 38.0, 0.3, 3, rate),
    ]  # fmt: skip
    pieces, _ = simulated(true_spring(), parts, 25.0, 25.0)
    return identify(measured(22, [pieces]), FitSettings(knots=15, full_stroke_mm=full_mm, hold_out=False))


def true_peak():
    """Largest force [kN] and stroke [mm] of the impact: eq. (4) in F, the viscous branch beside it."""

    def rates(_, y):
        x, v, force, inner = y
        k_l, h = 2.0 + 4.0 * C * x**3, loading(x) - unloading(x)
        k_u = k_l * (0.83 - 0.0038 * x) - 0.0038 * loading(x)
        k_t = max(k_l, k_u) + h / TRANSITION_mm
        rise = k_l + (k_t - k_l) * (loading(x) - force) / h  # loading alone: v > 0 up to the peak
        return v, -1000.0 * total(x, force, inner) / (0.5 * MASS_t), rise * v, (x - inner) / TAU_s

    def total(x, force, inner):
        return force + BETA * (middle(x) - middle(inner))

    def middle(x):
        return 0.5 * (loading(x) + unloading(x))

    def stands(_, y):
        return y[1]

    stands.terminal = True
    start = (0.0, 500.0 * SPEED_m_per_s, unloading(0.0), 0.0)
    y = solve_ivp(rates, (0.0, 1.0), start, events=stands, rtol=1e-9, atol=1e-9).y[:, -1]
    return total(y[0], y[2], y[3]), y[0]


def impact(folder, model):
    """Largest force [kN] and stroke [mm] by the exported FMU, and what it told."""
    export_fmu(model, folder / "spring.fmu", FmuOptions("mm-kN"))
    host = Host(unpack(folder / "spring.fmu", folder / "content"), CO_SIMULATION).start()
    x, v, force, peak, k = 0.0, 500.0 * SPEED_m_per_s, 0.0, 0.0, 0
    while v > 0.0:  # leapfrog; kN / t = m/s², times 1000 for mm/s²
        v -= DT_s * force / (0.5 * MASS_t) * 1000.0
        host.set("stroke_mm", x)
        host.set("stroke_rate_mm_per_s", v)
        assert host.do_step(k * DT_s, DT_s) == OK
        x += v * DT_s
        force = host.get("force_kN")
        peak, k = max(peak, force), k + 1
    told = list(host.messages)
    host.close()
    return peak, x, told


def test_the_true_spring_in_the_fmu_is_that_of_the_equations(tmp_path):
    """Else the next test would compare two fits of one mistake."""
    peak, stroke, told = impact(tmp_path, true_spring())
    force_kN, stroke_mm = true_peak()
    assert peak == pytest.approx(force_kN, rel=0.002)
    assert stroke == pytest.approx(stroke_mm, rel=0.001)
    assert FULL_mm - 1.0 < stroke_mm < FULL_mm
    assert told == []


def test_an_impact_to_full_stroke_meets_the_force_of_the_true_spring(tmp_path):
    save_model(fitted().model, tmp_path / "spring.toml")
    peak, stroke, told = impact(tmp_path, load_model(tmp_path / "spring.toml"))
    force_kN, stroke_mm = true_peak()
    assert peak == pytest.approx(force_kN, rel=0.03)
    assert stroke == pytest.approx(stroke_mm, rel=0.01)
    assert [sentence.split(" of ")[0] for sentence in told] == ["the speed", "the stroke"]


def test_the_true_force_lies_within_the_stated_bounds():
    low, high = fitted().model.identified.loading_at_end_kN
    assert low < loading(FULL_mm) < high
    assert high - low < 0.04 * loading(FULL_mm)


def test_without_the_full_stroke_the_stop_is_met_and_that_is_said(tmp_path):
    """What the continuation is for: the wall at the end of the runs gives far larger forces."""
    found = fitted(None)
    assert any("no run states the specimen's full stroke" in note for note in found.notes)
    peak, _, told = impact(tmp_path, found.model)
    assert peak > 1.5 * true_peak()[0]
    assert any("goes beyond the end of the curves at 98.4 mm into the stop of 500 kN/mm" in s for s in told)


def test_the_range_is_that_of_the_runs():
    known = fitted().model.identified
    assert known.stroke_mm == (0.0, pytest.approx(REACHED_mm, abs=0.05))
    assert known.speed_mm_per_s[0] == pytest.approx(5.0, rel=0.15)
    assert known.speed_mm_per_s[1] == pytest.approx(2.0 * np.pi * 0.3 * 38.0, rel=0.1)
    assert known.frequency_Hz[0] == pytest.approx(0.5 * 5.0 / REACHED_mm, rel=0.15)
    assert known.frequency_Hz[1] == pytest.approx(0.8, rel=0.1)
    assert (known.continuation, known.stop) == ("own-shape", "assumed")
