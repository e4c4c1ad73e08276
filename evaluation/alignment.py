"""The instants of force and stroke: moving the force in time, and what a millisecond of it changes.

A force that is late by τ is recorded as F(t - τ). Moving it earlier by τ turns the loop area W_a into
W_a + τ ∮ Ḟ dx: of an elastic spring the area is zero, and its recorded one is that of the skew alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

from evaluation.cycles import cycle_samples
from evaluation.loops import cut_loop
from evaluation.motion import Cycle, Loop
from evaluation.quantities import absorbed_energy_J, first_harmonic, stored_energy_J
from evaluation.record import FloatArray, Record
from evaluation.spectra import HARMONICS, spectra

SINE_STROKE = 0.05
"""Up to this distortion the closed form is that of a sine stroke, above it that of constant speed."""
SHIFT_S = 0.5e-3
"""The force is moved by this much to both sides to see what a millisecond changes."""
MOST_CYCLES = 3
"""Cycles of a run that are shifted; what they say is their mean."""
_SPLINE_SAMPLES = 20_000
"""Cycles with more samples are interpolated by straight lines: their step is 1/20 000 of the cycle."""
_MARGIN = 6

ClosedForm = Literal["sine-stroke", "constant-speed", "none"]


@dataclass(frozen=True)
class SkewSensitivity:
    """What changes when the force is moved earlier by 1 ms (``delay_s`` of its channel raised by 1 ms).

    Attributes
    ----------
    cycles : tuple of int
        Cycles that were shifted; the figures are means over them.
    absorbed_energy_J_per_ms, damping_per_ms : mapping
        ``by_shifting``: figures of the shifted loop; ``closed_form``: that of ``form``. None: not to be had.
    form : str
        ``sine-stroke``: ΔW_a = π ω K′ x_a² τ, half of it on the loading branch; ``constant-speed``:
        ΔW_a = (v_loading + v_unloading) (F_top - F_bottom) τ, the first part on the loading branch.
    """

    cycles: tuple[int, ...]
    absorbed_energy_J_per_ms: Mapping[str, float | None]
    damping_per_ms: Mapping[str, float | None]
    form: ClosedForm


def advanced(record: Record, cycle: Cycle, by_s: float) -> Record:
    """Return the record about one cycle with its force moved earlier by ``by_s`` (later if negative).

    Not across a break of the record; at most a few samples are extrapolated where it begins or ends.
    """
    inside = cycle_samples(record, cycle)
    step = float(np.median(np.diff(record.time_s[inside]))) if inside.stop - inside.start > 1 else np.inf
    margin = _MARGIN + int(abs(by_s) / step)
    before = [b for b in record.breaks if b <= inside.start]
    after = [b for b in record.breaks if b >= inside.stop]
    first = max(inside.start - margin, before[-1] if before else 0)
    last = min(inside.stop + margin, after[0] if after else record.time_s.size)
    time, force = record.time_s[first:last], record.force_kN[first:last]
    if time.size <= _SPLINE_SAMPLES:
        moved = CubicSpline(time, force)(time + by_s)
    else:
        moved = np.interp(time + by_s, time, force)
    return Record(time, record.stroke_mm[first:last], np.asarray(moved, dtype=np.float64))


def area_rate_J_per_s(record: Record, cycle: Cycle) -> float:  # noqa: N802 - the unit keeps its capital
    """Return ∮ Ḟ dx [J/s]: the growth of the loop area per second that the force is moved earlier.

    From harmonics 1 to 10 of force and stroke: π ω Σ k² Re(F_k x_k*); of a sine stroke π ω K′ x_a².
    """
    found = spectra(record, [cycle])
    order = np.arange(HARMONICS + 1.0)
    omega = 2.0 * np.pi / cycle.duration_s
    return float(np.pi * omega * np.sum(order**2 * np.sum(found.stroke[0] * found.force[0], axis=1)))


def skew_sensitivity(record: Record, cycles: Sequence[Cycle], *, periodic: bool) -> SkewSensitivity:
    """Return what 1 ms between force and stroke changes in absorbed energy and damping.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Those that represent the run; the first three are shifted.
    periodic : bool
        Whether the stroke is one for which there is a closed form (harmonic and static runs).

    Returns
    -------
    SkewSensitivity
    """
    chosen = list(cycles)[:MOST_CYCLES]
    form: ClosedForm = "none"
    if periodic and chosen:
        sine = all((c.stroke_distortion or 1.0) <= SINE_STROKE for c in chosen)
        form = "sine-stroke" if sine else "constant-speed"
    shifted, closed = [], []
    for cycle in chosen:
        shifted.append(_by_shifting(record, cycle))
        if form != "none":
            closed.append(_closed_form(record, cycle, form))
    return SkewSensitivity(
        cycles=tuple(cycle.index for cycle in chosen),
        absorbed_energy_J_per_ms={
            "by_shifting": _mean([a for a, _ in shifted]),
            "closed_form": _mean([a for a, _ in closed]),
        },
        damping_per_ms={
            "by_shifting": _mean([d for _, d in shifted]),
            "closed_form": _mean([d for _, d in closed]),
        },
        form=form,
    )


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known and len(known) == len(values) else None


def _by_shifting(record: Record, cycle: Cycle) -> tuple[float, float | None]:
    """Return absorbed energy [J] and damping gained by a millisecond, from loops shifted to both sides."""
    late, early = (cut_loop(advanced(record, cycle, by_s), cycle) for by_s in (-SHIFT_S, SHIFT_S))
    per_ms = 1e-3 / (2.0 * SHIFT_S)
    energy = (absorbed_energy_J(early) - absorbed_energy_J(late)) * per_ms
    one, two = _damping(early), _damping(late)
    return energy, None if one is None or two is None else (one - two) * per_ms


def _damping(loop: Loop) -> float | None:
    stored = stored_energy_J(loop)
    return absorbed_energy_J(loop) / stored if stored > 0.0 else None


def _closed_form(record: Record, cycle: Cycle, form: ClosedForm) -> tuple[float, float | None]:
    loop = cut_loop(record, cycle)
    if form == "sine-stroke":
        omega = 2.0 * np.pi / cycle.duration_s
        stiffness = first_harmonic(record, cycle).real
        energy = float(np.pi * omega * stiffness * (0.5 * cycle.range_mm) ** 2) * 1e-3
        loading = 0.5 * energy
    else:
        peak_kN = float(np.max(loop.force_kN))  # that of the turning point is a mean of both branches
        rise_kN, fall_kN = peak_kN - float(loop.force_kN[0]), peak_kN - float(loop.force_kN[-1])
        loading = _mean_speed(loop.time_s[loop.loading], loop.stroke_mm[loop.loading]) * rise_kN * 1e-3
        down = _mean_speed(loop.time_s[loop.unloading], loop.stroke_mm[loop.unloading])
        energy = loading + down * fall_kN * 1e-3
    stored, absorbed = stored_energy_J(loop), absorbed_energy_J(loop)
    return energy, (energy - absorbed / stored * loading) / stored if stored > 0.0 else None


def _mean_speed(time_s: FloatArray, stroke_mm: FloatArray) -> float:
    return float(abs(stroke_mm[-1] - stroke_mm[0]) / (time_s[-1] - time_s[0]))
