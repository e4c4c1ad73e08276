"""The spring in time, one step after the other, in plain floats: what a simulated stand drives.

The laws are those of :mod:`bufferstand.model.simulation`, which computes whole histories at once and gives
the same figures; here every table is looked up once a step and nothing is allocated.
"""

from __future__ import annotations

from math import exp

from bufferstand.model.spring import SpringModel

_Cell = tuple[float, ...]
_Constants = tuple[
    list[_Cell], float, float, float, float, float, float, float, float, tuple[float, ...], float, bool, float
]
_Inner = tuple[float, float, float]
"""Of one viscous branch: lag x - xi, F_m(xi) and the depth of eq. (5) there."""


class SpringStepper:
    """A spring that remembers: band position, inner stroke of the viscous branch, temperature.

    It begins unloaded: at stroke 0, on the unloading curve, without overstress, everything at
    ``temperature_C``.

    Parameters
    ----------
    model : SpringModel
        The spring.
    temperature_C : float
        Its temperature at the beginning [°C].
    ambient_C : float
        Temperature of the surroundings [°C]; may be set later.

    Attributes
    ----------
    stroke_mm, force_kN : float
        Present stroke and force.
    band : float
        p = (F - F_u) / (F_l - F_u) of the hysteresis, 0 … 1.
    temperature_C, sensor_temperature_C : float
        Of the spring's mass and of the sensor on it.
    work_J : float
        Work done on the spring since the beginning, integral of F dx.
    heat_J : float
        Energy lost in it since the beginning; never falls.
    """

    def __init__(self, model: SpringModel, temperature_C: float, ambient_C: float) -> None:
        self.model = model
        self.ambient_C = ambient_C
        self.temperature_C = temperature_C
        self.sensor_temperature_C = temperature_C
        self.stroke_mm = 0.0
        self.force_kN = 0.0
        self.band = 0.0
        self.work_J = 0.0
        self.heat_J = 0.0
        self._width_scale_max = model.tables.width_scale_max
        self._cells: list[_Cell] = [tuple(row) for row in model.tables.rows().tolist()]
        self._last = (0.0,) * 7
        self._inner: list[_Inner] = []
        self._owed = 0.0
        self._law = self._constants()
        self._dt_s = self._share = self._per_joule = self._follow = 0.0
        self._relaxed: tuple[tuple[float, float], ...] = ()
        self._prepare_duration(0.0)
        self._rest()

    def step(self, stroke_mm: float, dt_s: float) -> float:  # noqa: PLR0912, PLR0915 - see below
        """Go to ``stroke_mm`` in ``dt_s`` [s] at constant speed; get the force there [kN].

        Exact in stroke: a monotone stroke gives the same force in one step or in many. Long, because a call
        costs a tenth of all it computes, and a simulated stand makes ten thousand a second.
        """
        if dt_s != self._dt_s:
            self._prepare_duration(dt_s)
        cells, per_step, cell_mm, end, reference, c_ts, c_eta, spent, softest, shares, stop, paper, gain = (
            self._law
        )
        x_0, A_0, B_0, g_0, h_0, m_0, psi_0 = self._last
        x = 0.0 if stroke_mm < 0.0 else stroke_mm if stroke_mm < end else end
        i = int(x * per_step)
        f = x - i * cell_mm
        A, a, B, b, F_l, dF_l, h, dh, F_m, dF_m, p_c, dp_c, G, dG, g, dg = cells[i]
        dx = x - x_0
        p = p_0 = self.band
        A += a * f
        B += b * f
        if dx > 0.0:
            if A > A_0:
                p = 1.0 - (1.0 - p) * exp(A_0 - A)
        elif dx < 0.0 and B < B_0:
            p *= exp(B - B_0)
        h += dh * f
        g += dg * f
        r = p - p_c - dp_c * f
        m = h * r
        psi = 0.5 * (G + dG * f) * r * r
        self._last = (x, A, B, g, h, m, psi)

        # Heat of the step, at the temperature with which it begins.
        T = self.temperature_C
        warmer = T - reference
        soft = c_ts * warmer if warmer < spent else softest
        s_0 = 1.0 - soft * g_0
        s = 1.0 - soft * g
        if paper:
            q = -0.5 * (s_0 * h_0 * (1.0 - p_0) + s * h * (1.0 - p)) * dx if dx < 0.0 else 0.0
        else:
            q = 0.5 * (s_0 * m_0 + s * m) * dx - s * psi + s_0 * psi_0 + self._owed
            if q < 0.0:
                self._owed = q
                q = 0.0
            else:
                self._owed = 0.0
        if c_eta:
            q *= self._width_scale(warmer)
        states = self._inner
        for k, (kept, added) in enumerate(self._relaxed):
            lag_0, inner_0, g_in_0 = states[k]
            lag = lag_0 * kept + dx * added
            xi = x - lag
            i = int(xi * per_step)
            cell = cells[i]
            xi -= i * cell_mm
            inner = cell[8] + cell[9] * xi
            g_in = cell[14] + cell[15] * xi
            loss = (lag_0 + lag) * ((1.0 - soft * g_in) * inner - (1.0 - soft * g_in_0) * inner_0)
            if loss > 0.0:
                q += 0.5 * shares[k] * loss
            states[k] = (lag, inner, g_in)
        self.heat_J += q

        # Eq. (7); the sensor follows the mass.
        ambient = self.ambient_C
        T += q * self._per_joule - (T - ambient) * self._share
        self.temperature_C = T
        sensed = self.sensor_temperature_C
        self.sensor_temperature_C = sensed + (ambient + gain * (T - ambient) - sensed) * self._follow

        # Force at the new temperature, with the band position kept.
        warmer = T - reference
        soft = c_ts * warmer if warmer < spent else softest
        s = 1.0 - soft * g
        if c_eta:
            h *= self._width_scale(warmer)
        force = s * (F_l + dF_l * f - (1.0 - p) * h)
        if shares:
            middle = s * (F_m + dF_m * f)
            for beta, (_, inner, g_in) in zip(shares, states, strict=True):
                force += beta * (middle - (1.0 - soft * g_in) * inner)
        if force < 0.0 or stroke_mm <= 0.0:
            force = 0.0
        if stroke_mm > end:
            force += stop * (stroke_mm - end)
        self.work_J += 0.5 * (self.force_kN + force) * (stroke_mm - self.stroke_mm)
        self.stroke_mm = stroke_mm
        self.force_kN = force
        self.band = p
        return force

    def force_at(self, stroke_mm: float, dt_s: float) -> float:
        """Get the force [kN] that :meth:`step` would give, without going there."""
        kept, inner = self.__dict__.copy(), self._inner.copy()
        force = self.step(stroke_mm, dt_s)
        self.__dict__.update(kept)
        self._inner = inner
        return force

    @property
    def lags_mm(self) -> list[float]:
        """Lags x - xi of the viscous branches [mm]; with stroke, band and temperature its whole state."""
        return [lag for lag, _, _ in self._inner]

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802 - the unit's own letters
        """Get dF/dx [kN/mm] with which the force goes on from here, loading or unloading (eq. (4))."""
        cells, per_step, cell_mm, end, reference, c_ts, _, spent, softest, shares, stop, _, _ = self._law
        if self.stroke_mm > end or (self.stroke_mm == end and loading):
            return stop
        if self.stroke_mm < 0.0 or (self.stroke_mm == 0.0 and not loading):
            return 0.0
        i = int(self.stroke_mm * per_step)
        f = self.stroke_mm - i * cell_mm
        _, a, _, b, F_l, dF_l, h, dh, F_m, dF_m, _, _, _, _, g, dg = cells[i]
        warmer = self.temperature_C - reference
        soft = c_ts * warmer if warmer < spent else softest
        s, ds = 1.0 - soft * (g + dg * f), -soft * dg
        e = self._width_scale(warmer)
        width = e * (h + dh * f)
        rest = 1.0 - self.band
        rise = dF_l - rest * e * dh + width * (rest * a if loading else self.band * b)
        band_kN = F_l + dF_l * f - rest * width
        return ds * band_kN + s * rise + sum(shares) * (ds * (F_m + dF_m * f) + s * dF_m)

    def _constants(self) -> _Constants:
        """Return what every step needs, in one tuple: one unpacking costs less than a dozen look-ups."""
        tables, law = self.model.tables, self.model.temperature
        return (
            self._cells,
            1.0 / tables.step_mm,
            tables.step_mm,
            tables.end_mm,
            law.reference_C,
            law.sensitivity_per_K,
            law.loss_sensitivity_per_K,
            law.spent_K,
            law.softest,
            tuple(beta for beta, _ in self.model.viscous.branches),
            self.model.curves.stop_stiffness_kN_per_mm,
            self.model.heat.rule == "paper",
            self.model.heat.sensor_gain,
        )

    def _prepare_duration(self, dt_s: float) -> None:
        """Compute once what depends on the step's duration only."""
        if not dt_s >= 0.0:
            raise ValueError(f"a step takes 0 s or more, got {dt_s}")
        self._dt_s = dt_s
        self._relaxed = self.model.viscous.responses(dt_s)
        self._share, self._per_joule, self._follow = self.model.heat.step_factors(dt_s)

    def _rest(self) -> None:
        """Stand at stroke 0 without overstress."""
        A, _, B, _, _, _, h, _, F_m, _, p_c, _, G, _, g, _ = self._cells[0]
        r = self.band - p_c
        self._last = (0.0, A, B, g, h, h * r, 0.5 * G * r * r)
        self._inner = [(0.0, F_m, g)] * len(self.model.viscous.branches)

    def _width_scale(self, warmer_K: float) -> float:
        e = 1.0 - self.model.temperature.loss_sensitivity_per_K * warmer_K
        return 0.0 if e < 0.0 else min(e, self._width_scale_max)
