"""How the shipped models were made: closed-form curves, rounded to a table.

``python -m tests.model.recipes`` in the project's folder writes the files anew; ``test_shipped.py`` demands
that they equal what stands here, and that the fits give these parameters.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from bufferstand.model.curves import Curves
from bufferstand.model.file import save_model
from bufferstand.model.spring import HeatBalance, SpringModel, TemperatureLaw, ViscousBranch

FOLDER = Path(__file__).parents[2] / "sample_runs" / "models"

CATEGORY_A_LOSS = (0.1654, 0.5095)
CATEGORY_A_VISCOUS = (0.0448, 9.64)
FREQUENCY_LOSS = (0.23, 0.8002)
FREQUENCY_VISCOUS = (0.0724, 5.3199)
FREQUENCY_PER_DECADE = 0.04
DRAW_HOOK_FIT = (0.978, 541.4, 0.278, 0.00167)

CATEGORY_A_ORIGIN = """\
A stand-in for the paper's buffer of category A with elastomer spring, made so that it shows the
published figures; the paper's own curves are not published. It is no measurement of any make.
F_l = 15 kN + 2 kN/mm x + c x^4 with 600 kN at 96 mm; F_u = F_l (1 - eta), eta = 0.1654 + 0.5095 (x
/ 100 mm)^1.06 up to 80 mm, from there levelling off over 3 mm, so that a full stroke absorbs half
of what it stores; transition over 4 mm. Tables every 2.5 mm, rounded to 1 N.
The two numbers of eta, beta and tau were fitted to the four published dampings: 0.232 at 0.08 Hz
and 0.225 at 1.27 Hz for 0-40 mm, 0.386 at 0.04 Hz and 0.373 at 0.32 Hz for 0-80 mm (four numbers,
four unknowns: a fit, no validation). Other transition lengths fit them as well (3-10 mm). c_ts is
the paper's (measured on a draw-hook spring at 25 and 75 °C); alpha, C, lambda and the sensor's lag
are assumed: C is the order of an elastomer body of 7-10 kg.
"""

FREQUENCY_ORIGIN = """\
A second stand-in for the paper's buffer of category A with elastomer spring: stiffness that rises
with the frequency (flat spectrum of 0.04 per decade), and a last part of the stroke that stores and
absorbs in an impact what table 1 of the paper asks of the category. It is no measurement of any make.
F_l = 15 kN + 2.05 kN/mm x + c x^5, c for 600 kN at 96 mm, and 650 kN ((x - 80 mm) / 25 mm)^4 beyond
80 mm; F_u = F_l (1 - eta), eta = 0.23 + 0.8002 (x / 100 mm)^3, but nowhere falling; k_t = max(k_l,
k_u) + (F_l - F_u) / L, L = 4 mm up to 70 mm, from there evenly to 0.8 mm. Tables every 2.5 mm.
The two numbers of eta, beta and tau were fitted to the four published dampings (four numbers, four
unknowns: a fit, no validation). The spectrum, the curve beyond 80 mm and L there were chosen: two
wagons of 80 t that meet at 8.87 km/h store 30.3 kJ in each buffer over 104.9 mm, of which 61 % are
absorbed (30 kJ and 60 % are asked). The rest is that of category-a-elastomer.toml.
"""

DRAW_HOOK_ORIGIN = """\
A stand-in for the paper's elastomer spring of a drawbar hook (Fig. 9), made so that it shows the
published figures; the paper's own curves are not published. It is no measurement of any make.
F_l = 10 kN + 0.978 kN/mm x + 541.4 kN (x / 42.5 mm)^3; F_u = F_l (1 - eta), eta = 0.278 + 0.3 x /
42.5 mm; transition over 3 mm. Tables every 1.25 mm, rounded to 1 N.
Fitted with c_ts = 0.01 1/K and alpha = 20 mm to 593 kN at 42.5 mm and damping 39 % at 25 °C, 374 kN
at 44.5 mm and 37 % at 75 °C; the dissipation at equal stroke then falls by 44-45 % without being
asked to. The fall of the damping needs c_eta: eq. (5) alone cannot give it. No rate effect is
published (beta = 0); C, lambda and the sensor's lag are assumed.
"""


def category_a_curves(loss: tuple[float, float], digits: int = 3) -> Curves:
    """Return the buffer's tables for the two numbers of eta."""
    x = np.arange(0.0, 105.1, 2.5)
    quartic = (600.0 - 15.0 - 2.0 * 96.0) / 96.0**4

    def loading(stroke):
        return 15.0 + 2.0 * stroke + quartic * stroke**4

    def unloading(stroke):
        return loading(stroke) * (1.0 - loss[0] - loss[1] * (stroke / 100.0) ** 1.06)

    slope = (unloading(80.001) - unloading(79.999)) / 0.002
    levelled = unloading(80.0) + 3.0 * slope * -np.expm1(-np.maximum(x - 80.0, 0.0) / 3.0)
    return Curves(
        stroke_mm=tuple(x.tolist()),
        loading_kN=_table(loading(x), digits),
        unloading_kN=_table(np.where(x <= 80.0, unloading(np.minimum(x, 80.0)), levelled), digits),
        transition_length_mm=4.0,
        contact_ramp_mm=0.2,
    )


def category_a(
    loss: tuple[float, float] = CATEGORY_A_LOSS,
    viscous: tuple[float, float] = CATEGORY_A_VISCOUS,
    digits: int = 3,
) -> SpringModel:
    """Return the shipped buffer; more digits for a fit, which cannot feel its way over rounded tables."""
    return SpringModel(
        name="Side buffer, category A, 105 mm, elastomer",
        origin=CATEGORY_A_ORIGIN,
        curves=category_a_curves(loss, digits=digits),
        temperature=TemperatureLaw(
            reference_C=25.0, sensitivity_per_K=0.01, depth_mm=20.0, valid_C=(15.0, 75.0)
        ),
        heat=HeatBalance(capacity_J_per_K=15000.0, loss_W_per_K=10.0, sensor_lag_s=20.0),
        viscous=ViscousBranch(*viscous),
    )


def frequency_curves(loss: tuple[float, float], digits: int = 3) -> Curves:
    """Return the tables of the buffer with a frequency effect, for the two numbers of eta."""
    x = np.arange(0.0, 105.1, 2.5)
    quintic = (600.0 - 15.0 - 2.05 * 96.0) / 96.0**5
    loading = 15.0 + 2.05 * x + quintic * x**5 + 650.0 * (np.maximum(x - 80.0, 0.0) / 25.0) ** 4
    unloading = np.maximum.accumulate(loading * (1.0 - loss[0] - loss[1] * (x / 100.0) ** 3))
    length = np.interp(x, [0.0, 70.0, 105.0], [4.0, 4.0, 0.8])
    steeper = np.maximum(*(PchipInterpolator(x, curve).derivative()(x) for curve in (loading, unloading)))
    return Curves(
        stroke_mm=tuple(x.tolist()),
        loading_kN=_table(loading, digits),
        unloading_kN=_table(unloading, digits),
        transition_stiffness_kN_per_mm=_table(steeper + (loading - unloading) / length, digits),
        contact_ramp_mm=0.2,
    )


def category_a_with_frequency(
    loss: tuple[float, float] = FREQUENCY_LOSS,
    viscous: tuple[float, float] = FREQUENCY_VISCOUS,
    digits: int = 3,
) -> SpringModel:
    """Return the shipped buffer whose stiffness rises with the frequency, as the paper says."""
    return replace(
        category_a(),
        name="Side buffer, category A, 105 mm, elastomer, with frequency effect",
        origin=FREQUENCY_ORIGIN,
        curves=frequency_curves(loss, digits=digits),
        viscous=ViscousBranch(*viscous, FREQUENCY_PER_DECADE),
    )


def draw_hook(fit: tuple[float, float, float, float] = DRAW_HOOK_FIT, digits: int = 3) -> SpringModel:
    """Return the shipped draw-hook spring; ``fit`` is slope, cubic term, eta at 0 and c_eta."""
    x = np.arange(0.0, 45.1, 1.25)
    loading = 10.0 + fit[0] * x + fit[1] * (x / 42.5) ** 3
    return SpringModel(
        name="Elastomer spring of a drawbar hook",
        origin=DRAW_HOOK_ORIGIN,
        sense="extension",
        curves=Curves(
            stroke_mm=tuple(x.tolist()),
            loading_kN=_table(loading, digits),
            unloading_kN=_table(loading * (1.0 - fit[2] - 0.3 * x / 42.5), digits),
            transition_length_mm=3.0,
            contact_ramp_mm=0.1,
        ),
        temperature=TemperatureLaw(
            reference_C=25.0,
            sensitivity_per_K=0.01,
            depth_mm=20.0,
            loss_sensitivity_per_K=fit[3],
            valid_C=(25.0, 75.0),
        ),
        heat=HeatBalance(capacity_J_per_K=6000.0, loss_W_per_K=4.0, sensor_lag_s=20.0),
    )


def _table(values, digits) -> tuple[float, ...]:
    return tuple(round(float(value), digits) for value in values)


SHIPPED = {
    "category-a-elastomer.toml": category_a,
    "category-a-frequency.toml": category_a_with_frequency,
    "draw-hook-elastomer.toml": draw_hook,
}

if __name__ == "__main__":
    for name, make in SHIPPED.items():
        save_model(make(), FOLDER / name)
