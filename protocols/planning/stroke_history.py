"""The required stroke over time of a planned step, as points: what the paper's Fig. 4 shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation import Harmonic, StaticCycles
from bufferstand.protocols.steps import (
    ExpectedTurns,
    ForceCycles,
    Motion,
    MotionEstimate,
    PlannedStep,
    RampToForce,
)

Floats = NDArray[np.float64]

POINTS_PER_CYCLE = 40


def stroke_over_time(step: PlannedStep) -> tuple[Floats, Floats]:
    """Return time from the step's start [s] and required stroke [mm], if nothing stops it.

    A ramp to a force and a static cycle go as far as the plan expects; ramps and holds are two points, a sine
    has :data:`POINTS_PER_CYCLE` in a cycle.

    Returns
    -------
    time_s, stroke_mm : NDArray, shape (n,)
    """
    times, strokes = [np.zeros(1)], [np.zeros(1)]
    began_s, at_mm = step.wait_s, 0.0
    if step.wait_s > 0.0:
        times.append(np.array([step.wait_s]))
        strokes.append(np.zeros(1))
    for motion, estimate in zip(step.motions, step.estimates, strict=True):
        if estimate.duration_s > 0.0:
            time, stroke = _of_motion(motion, estimate, at_mm, step.expected_cycles)
            times.append(began_s + time)
            strokes.append(stroke)
            began_s, at_mm = began_s + estimate.duration_s, float(stroke[-1])
    return np.concatenate(times), np.concatenate(strokes)


def _of_motion(
    motion: Motion, estimate: MotionEstimate, at_mm: float, expected_cycles: float | None
) -> tuple[Floats, Floats]:
    lasts_s = estimate.duration_s
    if expected_cycles is not None and isinstance(motion, Harmonic | StaticCycles):
        motion = replace(motion, cycles=max(1, round(expected_cycles)))
    if isinstance(motion, Harmonic):
        cycles = motion.cycles + motion.FADE_CYCLES
        phase = np.linspace(0.0, cycles, POINTS_PER_CYCLE * cycles + 1)[1:]
        fade = np.clip(np.minimum(phase, cycles - phase), 0.0, 1.0)
        sine = motion.mean_mm + motion.amplitude_mm * fade * np.sin(2.0 * np.pi * phase)
        return phase / motion.frequency_Hz, sine
    if isinstance(motion, StaticCycles):
        cycle_s = (lasts_s - (motion.cycles - 1) * motion.pause_s) / motion.cycles
        turns = estimate.turns  # the piston, whose speed it is, goes further than the specimen
        top_mm = motion.speed_mm_per_s * cycle_s / 2.0 if turns is None else turns.upper_mm
        begins = np.arange(motion.cycles) * (cycle_s + motion.pause_s)
        time = (begins[:, None] + np.array([0.0, 0.5, 1.0]) * cycle_s).ravel()
        return time, np.tile([0.0, top_mm, 0.0], motion.cycles)
    if isinstance(motion, ForceCycles) and estimate.turns is not None:
        return _between_forces(motion, estimate.turns, lasts_s)
    if isinstance(motion, RampToForce):
        return np.array([lasts_s]), np.array([at_mm + motion.speed_mm_per_s * lasts_s])
    return np.array([lasts_s]), np.array([motion.end_mm(at_mm)])


def _between_forces(motion: ForceCycles, turns: ExpectedTurns, lasts_s: float) -> tuple[Floats, Floats]:
    """Up and down between the turns that are expected at its beginning, standing a moment at each."""
    up_s = turns.piston_upper_mm / motion.speed_mm_per_s
    part_s = (lasts_s - up_s - motion.DWELL_S) / (2 * motion.cycles - 1)
    ends_s = up_s + motion.DWELL_S + np.arange(2 * motion.cycles) * part_s
    turned_mm = np.tile([turns.upper_mm, turns.lower_mm], motion.cycles)
    time_s = np.column_stack([ends_s - motion.DWELL_S, ends_s]).ravel()
    return time_s, np.repeat(turned_mm, 2)
