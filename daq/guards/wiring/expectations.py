"""Makes the expectations for the signals from plan, specimen and stand."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bufferstand.daq.guards.trips import Action
from bufferstand.daq.guards.wiring.settings import ForceCurve, WiringGuard
from bufferstand.drivers import Stand
from bufferstand.evaluation.plausibility.units_and_signs import BUFFER_MM, WINDOWS
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.prediction import Predictor, Temperatures

SLOW_MM_PER_S = 5.0
"""Speed of the slow compression whose curve is expected."""
WARMER_K = 20.0
"""The curve is taken at the temperature of the start, and at one so much higher."""
_POINTS = 43
_PROBE_W, _PROBE_S = 1000.0, 1.0


def wiring_guard(
    plan: Plan,
    stand: Stand,
    predictor: Predictor | None,
    *,
    action: Action,
    force_factor: float,
    ambient: Collection[str],
    speed: float = 1.0,
) -> WiringGuard:
    """Return what the signals of a campaign are compared with.

    Parameters
    ----------
    plan : Plan
    stand : Stand
        Its channels and thermometers.
    predictor : Predictor or None
        The specimen's; without it the limits of its kind serve, where there are any.
    action : Action
        What a doubt leads to.
    force_factor : float
        Within it a specimen's force is right.
    ambient : collection of str
        Temperature streams that do not touch the specimen.
    speed : float
        Seconds of the stand in one of the wall.
    """
    facts = (stand.controller.facts, *(sensor.facts for sensor in stand.sensors))
    sensors = [sensor.facts for sensor in stand.sensors]
    thermometers = [one.name for one in sensors if one.channels[0].quantity == "temperature"]
    conditions = plan.campaign.content.conditions
    return WiringGuard(
        action=action,
        force_factor=force_factor,
        curve=expected_curve(plan, predictor),
        frame_kN_per_mm=plan.limits.machine.stiffness_kN_per_mm,
        force_max_kN=plan.stand_limits.force_max_kN,
        delays_s={
            channel.name: channel.delay_s for one in facts for channel in one.channels if channel.delay_s
        },
        specimen=tuple(name for name in thermometers if name not in ambient),
        ambient=tuple(name for name in thermometers if name in ambient),
        ambient_C=conditions.ambient_C,
        capacity_J_per_K=_capacity_J_per_K(predictor),
        sensor_lag_s=None if predictor is None else predictor.sensor_lag_s,
        speed=speed,
    )


def expected_curve(plan: Plan, predictor: Predictor | None) -> ForceCurve | None:
    """Return the force that is expected of the specimen's first slow compression, None if nobody knows it."""
    if predictor is None or not predictor.known_to_mm > 0.0:
        return _window(plan.specimen)
    end_mm = min(predictor.known_to_mm, plan.limits.stroke.value)
    start_C = plan.campaign.content.conditions.start_C()
    stroke = np.linspace(0.0, end_mm, _POINTS)
    cold = predictor.forces(stroke / SLOW_MM_PER_S, stroke, start_C)
    warm = predictor.forces(stroke / SLOW_MM_PER_S, stroke, start_C + WARMER_K)
    fastest = max([step.peak_speed_mm_per_s or 0.0 for step in plan.steps] + [SLOW_MM_PER_S])
    quick = predictor.forces(stroke / fastest, stroke, start_C)
    pressed = cold > 1.0
    fast = float(np.max(quick[pressed] / cold[pressed])) if pressed.any() else 1.0
    knows = predictor.assumptions
    source = "curve of the specimen, which has no spring model" if knows else "spring model of the specimen"
    return ForceCurve(
        _rounded(stroke), _rounded(cold), _rounded(warm), start_C, start_C + WARMER_K, round(max(1.0, fast),
        3), source,
    )  # fmt: skip


def little_expected(plan: Plan, predictor: Predictor | None) -> str:
    """Return what is to be said of a specimen whose curve nobody states, empty where somebody does."""
    if predictor is not None and predictor.known_to_mm > 0.0:
        return ""
    window = _window(plan.specimen)
    against = (
        "against another way to it alone"
        if window is None
        else f"against what EN 15551 asks of a buffer of its stroke, within a factor of {window.factor:g}"
    )
    return (
        "no spring model and no [catalogue]: a scale that is wrong in each force is not seen; "
        f"it is held {against}"
    )


def _window(specimen: Specimen) -> ForceCurve | None:
    """Return the middle of what a buffer of its stroke must show by EN 15551, with a factor to its limits."""
    length_mm = specimen.max_stroke_mm
    if specimen.kind != "buffer" or length_mm is None or not BUFFER_MM[0] <= length_mm <= BUFFER_MM[1]:
        return None
    strokes = (0.0, *(stroke for stroke, _, _ in WINDOWS))
    middle = (1.0, *(float(np.sqrt(low * high)) for _, low, high in WINDOWS))
    factor = 1.25 * max(float(np.sqrt(high / low)) for _, low, high in WINDOWS)
    source = "what EN 15551 asks of a buffer of its stroke; it has no spring model"
    return ForceCurve(strokes, middle, middle, 21.0, 21.0, 1.2, source, round(factor, 2), WINDOWS[0][0])


def _capacity_J_per_K(predictor: Predictor | None) -> float | None:  # noqa: N802 - the unit keeps its capital
    """Return the heat capacity that a predictor reckons with: a second of a kilowatt, without cooling."""
    if predictor is None or not predictor.knows_heat:
        return None
    start = Temperatures(20.0, 20.0)
    rise_K = predictor.temperatures_after(start, 20.0, _PROBE_W, _PROBE_S).mass_C - 20.0
    return float(f"{_PROBE_W * _PROBE_S / rise_K:.4g}") if rise_K > 0.0 else None


def _rounded(values: np.ndarray) -> tuple[float, ...]:
    return tuple(round(float(value), 2) for value in values)
