"""The variables of the FMU: one list for the description (XML), the start values and the C side.

Value references are those of the ``enum`` in ``c/bufferstand_spring_fmu.c``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from bufferstand.model.export.options import FmuOptions
from bufferstand.model.spring import SpringModel

Kind = Literal["Real", "Boolean"]


@dataclass(frozen=True)
class Variable:
    """One scalar variable.

    Parameters
    ----------
    name : str
        With its unit at the end.
    kind : str
        ``Real`` or ``Boolean``.
    reference : int
        Value reference, counted for each kind.
    causality, variability : str
        As FMI 2.0 names them.
    description : str
        For people.
    unit : str
        Name of the unit; empty for plain numbers.
    start : float or bool, optional
        Start value of inputs and parameters.
    derivative_of : str
        Name of the state of which this is the derivative.
    """

    name: str
    kind: Kind
    reference: int
    causality: str
    variability: str
    description: str
    unit: str = ""
    start: float | bool | None = None
    derivative_of: str = ""


def variables(model: SpringModel, options: FmuOptions) -> tuple[Variable, ...]:
    """Return all variables of a spring's FMU in their order in the description."""
    return (
        *_signals(options),
        *_parameters(model, options),
        *_range(model, options),
        *_switches(model, options),
    )


def start_values(found: tuple[Variable, ...]) -> tuple[list[float], list[float]]:
    """Return the start values of parameters and switches in the order of the C side."""
    parameters = [v for v in found if v.causality == "parameter"]
    return (
        [float(v.start or 0.0) for v in parameters if v.kind == "Real"],
        [float(v.start or 0.0) for v in parameters if v.kind == "Boolean"],
    )


def _signals(options: FmuOptions) -> list[Variable]:
    length, rate, force = ("m", "m/s", "N") if options.units == "SI" else ("mm", "mm/s", "kN")
    stroke, speed = f"stroke_{length}", f"stroke_rate_{rate.replace('/', '_per_')}"
    inner = f"inner_stroke_{length}"
    rows = [
        (stroke, "input", "stroke from first contact, at the present time", length, 0.0, ""),
        (speed, "input", "its rate: Co-Simulation extrapolates with it to the step's end", rate, 0.0, ""),
        (f"force_{force}", "output", "spring force", force, None, ""),
        ("temperature_C", "output", "temperature of the spring's mass", "degC", None, ""),
        ("sensor_temperature_C", "output", "temperature of a sensor on it", "degC", None, ""),
        ("heat_J", "output", "energy lost in the spring since the start", "J", None, ""),
        ("work_J", "output", "work done on the spring since the start", "J", None, ""),
        ("band", "output", "p = (F - F_u)/(F_l - F_u) of the hysteresis, 0 to 1", "", None, ""),
        (inner, "local", "inner stroke of the viscous branch, loading positive", length, None, ""),
        (f"der({inner})", "local", "its derivative", rate, None, inner),
    ]
    return [
        Variable(name, "Real", k, causality, "continuous", text, unit, start, state)
        for k, (name, causality, text, unit, start, state) in enumerate(rows)
    ]


def _parameters(model: SpringModel, options: FmuOptions) -> list[Variable]:
    law, heat, viscous = model.temperature, model.heat, model.viscous
    begin = law.reference_C if options.temperature_C is None else options.temperature_C
    ambient = law.reference_C if options.ambient_C is None else options.ambient_C
    stop = model.curves.stop_stiffness_kN_per_mm * options.force_per_kN * options.mm_per_stroke
    stop_unit = "N/m" if options.units == "SI" else "kN/mm"
    rows: list[tuple[str, str, str, float]] = [
        ("initial_temperature_C", "temperature at the start", "degC", begin),
        ("ambient_C", "temperature of the surroundings; may change while running", "degC", ambient),
        ("initial_band", "band position at the start: 0 unloading curve, 1 loading curve", "", 0.0),
        ("sensitivity_per_K", "c_ts of eq. (5)", "1/K", law.sensitivity_per_K),
        ("loss_sensitivity_per_K", "c_eta: loss sensitivity", "1/K", law.loss_sensitivity_per_K),
        ("floor", "least factor of eq. (5)", "", law.floor),
        ("capacity_J_per_K", "C of eq. (6)", "J/K", heat.capacity_J_per_K),
        ("loss_W_per_K", "lambda of eq. (6)", "W/K", heat.loss_W_per_K),
        ("sensor_lag_s", "time constant of the sensor", "s", heat.sensor_lag_s),
        ("sensor_gain", "share of the excess temperature at the sensor's place", "", heat.sensor_gain),
        ("beta", "share of the viscous branch", "", viscous.beta),
        ("tau_s", "relaxation time of the viscous branch", "s", viscous.tau_s),
        ("spectrum_per_decade", "b of the flat viscous spectrum", "", viscous.spectrum_per_decade),
        (
            f"stop_stiffness_{stop_unit.replace('/', '_per_')}",
            "added beyond the last stroke",
            stop_unit,
            stop,
        ),
    ]
    return [
        Variable(
            name,
            "Real",
            10 + k,
            "parameter",
            "tunable" if name == "ambient_C" else "fixed",
            text,
            unit,
            start,
        )
        for k, (name, text, unit, start) in enumerate(rows)
    ]


def range_rows(model: SpringModel, options: FmuOptions) -> list[tuple[str, str, str, float]]:
    """Return name, meaning, unit and value of what says where the model was identified; infinite: unknown.

    In the order of the C side's ``bs_resource.range``.
    """
    length, rate, force = ("m", "m/s", "N") if options.units == "SI" else ("mm", "mm/s", "kN")
    speed = rate.replace("/", "_per_")
    known, endless = model.identified, (-math.inf, math.inf)
    stroke = endless if known is None else known.stroke_mm
    fast = endless if known is None else known.speed_mm_per_s
    frequency = endless if known is None else known.frequency_Hz
    low_C, high_C = model.temperature.valid_C or endless
    bounds = (known.loading_at_end_kN if known is not None else None) or endless
    full = math.inf if known is None else model.curves.end_mm
    mm, kN = options.mm_per_stroke, options.force_per_kN
    return [
        (f"identified_stroke_min_{length}", "least measured stroke", length, stroke[0] / mm),
        (f"identified_stroke_max_{length}", "largest measured stroke", length, stroke[1] / mm),
        (f"identified_rate_min_{speed}", "mean rate of the slowest half stroke", rate, fast[0] / mm),
        (f"identified_rate_max_{speed}", "largest stroke rate of the runs", rate, fast[1] / mm),
        ("identified_frequency_min_Hz", "of the slowest half stroke of the runs", "Hz", frequency[0]),
        ("identified_frequency_max_Hz", "of the fastest half stroke of the runs", "Hz", frequency[1]),
        ("identified_temperature_min_C", "lowest temperature of the runs", "degC", low_C),
        ("identified_temperature_max_C", "highest temperature of the runs", "degC", high_C),
        (f"curves_end_{length}", "where the stop begins", length, full / mm),
        (f"loading_at_end_min_{force}", "least force of the continued loading curve", force, bounds[0] * kN),
        (f"loading_at_end_max_{force}", "largest force of the continued curve", force, bounds[1] * kN),
    ]


def _range(model: SpringModel, options: FmuOptions) -> list[Variable]:
    first = 10 + len(_parameters(model, options))
    return [
        Variable(name, "Real", first + k, "local", "constant", text, unit, value)
        for k, (name, text, unit, value) in enumerate(range_rows(model, options))
        if math.isfinite(value)
    ]


def _switches(model: SpringModel, options: FmuOptions) -> list[Variable]:
    rows = [
        ("sign_inverted", "stroke and force are negative in a loaded spring", options.inverted(model)),
        ("isothermal", "keep the temperature, whatever the heat", False),
        ("paper_heat", "heat by the paper's eq. (8), not by the free energy", model.heat.rule == "paper"),
    ]
    return [
        Variable(name, "Boolean", k, "parameter", "fixed", text, start=start)
        for k, (name, text, start) in enumerate(rows)
    ]
