"""The cost of the paper's explicit step, as docs/model.md shows it: ``python -m tests.model.step_errors``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.model.paper import simulate_paper, slope
from bufferstand.model.simulation import simulate
from bufferstand.model.stepper import SpringStepper
from tests.model.cases import path, reference_curves, spring

STEPS_MM = (0.05, 0.2, 1.0, 2.0, 8.0, 16.0)
IMPACT_STEPS_S = (1e-5, 1e-3, 5e-3)
MASS_KG, SPEED_MM_PER_S = 10_000.0, 1900.0


@dataclass(frozen=True)
class StepError:
    """Of the second loop 0-80-0 mm in steps of ``step_mm``, against the exact step at the same strokes."""

    step_mm: float
    force_kN: float
    area: float
    """Relative, of the loop area."""
    largest_force_kN: float


def step_error(step_mm: float) -> StepError:
    """Measure the explicit step; both areas are sums over the same strokes: what differs is its own error."""
    model = spring(reference_curves())
    stroke = path(0.0, 80.0, 0.0, 80.0, 0.0, step_mm=step_mm)
    time = np.arange(len(stroke)) * 0.1
    euler = simulate_paper(model, time, stroke, temperature_C=25.0, isothermal=True).force_kN
    exact = simulate(model, time, stroke, temperature_C=25.0, isothermal=True).force_kN
    exact[stroke == 0.0] = euler[stroke == 0.0]  # contact lost: the paper has no such state
    cycle = slice(len(stroke) // 2, None)
    fine = path(0.0, 80.0, 0.0, 80.0, 0.0, step_mm=0.01)
    truth = simulate(model, np.arange(len(fine)), fine, temperature_C=25.0, isothermal=True).force_kN
    area = np.trapezoid(truth[len(fine) // 2 :], fine[len(fine) // 2 :])
    reached = np.trapezoid(euler[cycle], stroke[cycle]) - np.trapezoid(exact[cycle], stroke[cycle])
    return StepError(
        step_mm,
        float(np.abs(euler - exact)[cycle].max()),
        float(abs(reached) / area),
        float(np.abs(euler).max()),
    )


def impact_loss(step_s: float, *, exact: bool) -> float:
    """Return the share of its energy that a mass loses which runs into the spring, by semi-implicit Euler."""
    curves = reference_curves()
    model = spring(curves)
    stepper = SpringStepper(model, 25.0, 25.0)
    tables = model.tables
    grid = np.linspace(0.0, tables.end_mm, len(tables.A))
    low, high = tables.loading - tables.width, tables.loading
    k_l, k_u = curves.loading_stiffness(grid), curves.unloading_stiffness(grid)
    k_t = curves.transition_stiffness(grid)
    x, speed, force = 1e-9, SPEED_MM_PER_S, float(low[0])
    while x > 0.0:
        speed -= 1e6 * force / MASS_KG * step_s
        before, x = x, x + speed * step_s
        if exact:
            force = stepper.step(x, step_s)
        else:
            at = min(int(before / tables.step_mm), len(grid) - 1)
            rates = float(k_t[at]), float(k_l[at]), float(k_u[at])
            force += (x - before) * slope(force, float(low[at]), float(high[at]), *rates, loading=x > before)
    return 1.0 - (speed / SPEED_MM_PER_S) ** 2


def lines() -> list[str]:
    """Return both tables of the page."""
    made = ["| Δx [mm] | largest force error [kN] | error of the loop area |", "|---|---|---|"]
    for error in map(step_error, STEPS_MM):
        diverges = error.largest_force_kN > 1000.0
        force = f"{float(f'{error.force_kN:.2g}'):g}"
        figures = "diverges | –" if diverges else f"{force} | {100.0 * error.area:.2g} %"
        made.append(f"| {error.step_mm:g} | {figures} |")
    made += ["", "| step [ms] | energy lost, exact step | explicit step |", "|---|---|---|"]
    for step_s in IMPACT_STEPS_S:
        exact, explicit = (impact_loss(step_s, exact=way) for way in (True, False))
        made.append(f"| {1e3 * step_s:g} | {exact:.4f} | {explicit:.4f} |")
    return made


if __name__ == "__main__":
    print("\n".join(lines()))
