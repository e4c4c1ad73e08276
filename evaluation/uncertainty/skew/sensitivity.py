"""Aligning force and stroke in time, and the effect of one millisecond between them.

A force that is late by τ is recorded as F(t - τ). Moving it earlier by τ turns the loop area W_a into
W_a + τ ∮ Ḟ dx: of an elastic spring the area is zero, and its recorded one is that of the skew alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles import HARMONICS, cycle_samples, spectra
from bufferstand.evaluation.facts import ClosedForm, Cycle, SkewSensitivity
from bufferstand.evaluation.numerics import FloatArray, moved_evenly, spline_at
from bufferstand.evaluation.record import Record

SINE_STROKE = 0.05
"""Up to this distortion the closed form is that of a sine stroke, above it that of constant speed."""
SHIFT_S = 0.5e-3
"""The force is moved by this much to both sides to see what a millisecond changes."""
MOST_CYCLES = 3
"""Cycles of a run that are shifted; what they say is their mean."""
_SPLINE_SAMPLES = 20_000
"""Cycles with more samples are interpolated by straight lines: their step is 1/20 000 of the cycle."""
_MARGIN = 6


def advanced(record: Record, cycle: Cycle, by_s: float) -> Record:
    """Return the record about one cycle with its force moved earlier by ``by_s`` (later if negative).

    Not across a break of the record; at most a few samples are extrapolated where it begins or ends.
    """
    time, stroke, force = _about(record, cycle, by_s)
    (moved,) = _moved(time, force, (by_s,))
    return Record(time, stroke, moved, averaged=record.averaged)


def _about(record: Record, cycle: Cycle, by_s: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return time, stroke and force about a cycle, with the samples that a force moved by ``by_s`` needs."""
    part = _samples_about(record, cycle, by_s)
    return record.time_s[part], record.stroke_mm[part], record.force_kN[part]


def _samples_about(record: Record, cycle: Cycle, by_s: float) -> slice:
    inside = cycle_samples(record, cycle)
    steps = inside.stop - inside.start - 1
    lasts_s = float(record.time_s[inside.stop - 1] - record.time_s[inside.start]) if steps > 0 else np.inf
    margin = _MARGIN + int(abs(by_s) * max(steps, 1) / lasts_s)
    before = [b for b in record.breaks if b <= inside.start]
    after = [b for b in record.breaks if b >= inside.stop]
    first = max(inside.start - margin, before[-1] if before else 0)
    return slice(first, min(inside.stop + margin, after[0] if after else record.time_s.size))


def _moved_about(
    record: Record, cycles: Sequence[Cycle], by_s: Sequence[float]
) -> list[tuple[slice, list[FloatArray]]]:
    """Return the samples about each cycle, and their force moved earlier by each of some times.

    One spline serves all cycles where they lie close together.
    """
    furthest = max(abs(by) for by in by_s)
    parts = [_samples_about(record, cycle, furthest) for cycle in cycles]
    whole = slice(min(part.start for part in parts), max(part.stop for part in parts))
    apart = whole.stop - whole.start > 2 * sum(part.stop - part.start for part in parts)
    if apart or whole.stop - whole.start > _SPLINE_SAMPLES or record.has_break(whole.start, whole.stop - 1):
        return [(part, _moved(record.time_s[part], record.force_kN[part], by_s)) for part in parts]
    moved = _moved(record.time_s[whole], record.force_kN[whole], by_s)
    return [
        (part, [own[part.start - whole.start : part.stop - whole.start] for own in moved]) for part in parts
    ]


def _moved(time_s: FloatArray, force_kN: FloatArray, by_s: Sequence[float]) -> list[FloatArray]:
    """Return the force moved earlier by each of some times."""
    if time_s.size <= _SPLINE_SAMPLES:
        even = [own for by in by_s if (own := moved_evenly(time_s, force_kN, time_s + by)) is not None]
        if len(even) == len(by_s):
            return even
        wanted_s = np.concatenate([time_s + by for by in by_s])
        return list(spline_at(time_s, force_kN[:, None], wanted_s)[:, 0].reshape(len(by_s), -1))
    return [np.asarray(np.interp(time_s + by, time_s, force_kN), dtype=np.float64) for by in by_s]


def area_rate_J_per_s(record: Record, cycle: Cycle) -> float:  # noqa: N802 - the unit keeps its capital
    """Return ∮ Ḟ dx [J/s]: the growth of the loop area per second that the force is moved earlier.

    From harmonics 1 to 10 of force and stroke: π ω Σ k² Re(F_k x_k*); of a sine stroke π ω K′ x_a².
    """
    found = spectra(record, [cycle])
    order = np.arange(HARMONICS + 1.0)
    omega = 2.0 * np.pi / cycle.duration_s
    return float(np.pi * omega * np.sum(order**2 * np.sum(found.stroke[0] * found.force[0], axis=1)))


def skew_sensitivity(
    record: Record,
    cycles: Sequence[Cycle],
    *,
    periodic: bool,
    storage_stiffness_kN_per_mm: Sequence[float | None] | None = None,
) -> SkewSensitivity:
    """Return what 1 ms between force and stroke changes in absorbed energy and damping.

    Parameters
    ----------
    record : Record
    cycles : sequence of Cycle
        Those that represent the run; the first three are shifted.
    periodic : bool
        Whether the stroke is one for which there is a closed form (harmonic and static runs).
    storage_stiffness_kN_per_mm : sequence of float or None, optional
        K′ of the cycles in this record, where it is known already.

    Returns
    -------
    SkewSensitivity
    """
    chosen = list(cycles)[:MOST_CYCLES]
    form: ClosedForm = "none"
    if periodic and chosen:
        sine = all((c.stroke_distortion or 1.0) <= SINE_STROKE for c in chosen)
        form = "sine-stroke" if sine else "constant-speed"
    paths: list[_Path] = []
    shifted: list[tuple[float, float | None]] = []
    closed: list[tuple[float, float | None]] = []
    if chosen:
        moved = _moved_about(record, chosen, (-SHIFT_S, SHIFT_S))
        paths = [_Path.of(record, cycle, *own) for cycle, own in zip(chosen, moved, strict=True)]
        shifted = [path.by_shifting() for path in paths]
    if form != "none":
        known = [k for k in (storage_stiffness_kN_per_mm or ())[: len(chosen)] if k is not None]
        if len(known) < len(chosen):
            known = spectra(record, chosen).first_harmonic().real.tolist()
        closed = [path.closed_form(k, form) for path, k in zip(paths, known, strict=True)]
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


@dataclass(frozen=True, eq=False)
class _Path:
    """Force over stroke of one cycle from leaving its lower turn to being back, shape (N,) each.

    Its areas are plain ones: what a shift changes hangs on the motion alone, which stands still at the turns
    whose forces other figures are read with so much care. ``late_kN``, ``early_kN``: the force moved by
    :data:`SHIFT_S`. Sample ``top`` is the first of unloading, ``arrived`` the first after loading: between
    them the stroke dwells.
    """

    time_s: FloatArray
    stroke_mm: FloatArray
    force_kN: FloatArray
    late_kN: FloatArray
    early_kN: FloatArray
    arrived: int
    top: int
    cycle: Cycle

    @classmethod
    def of(cls, record: Record, cycle: Cycle, part: slice, moved: Sequence[FloatArray]) -> _Path:
        """Return the path of a cycle; ``moved``: the force about it, moved later and earlier."""
        time_s, start, top, end = record.time_s, cycle.start, cycle.top, cycle.end
        rows = cycle_samples(record, cycle)
        inside = slice(rows.start - part.start, rows.stop - part.start)
        ends_s = np.array([start.leave_s, end.time_s])

        def whole(column: FloatArray) -> FloatArray:
            first, last = np.interp(ends_s, time_s[part], column).tolist()
            return np.concatenate(([first], column[inside], [last]))

        stroke = np.concatenate(([start.leave_mm], record.stroke_mm[rows], [end.stroke_mm]))
        at = np.concatenate((ends_s[:1], time_s[rows], ends_s[1:]))
        forces = [whole(column) for column in (record.force_kN[part], *moved)]
        arrived, leaves = (int(np.searchsorted(at, moment_s)) for moment_s in (top.time_s, top.leave_s))
        return cls(at, stroke, forces[0], forces[1], forces[2], arrived, leaves, cycle)

    def areas_J(self, force_kN: FloatArray) -> tuple[float, float]:  # noqa: N802 - the unit keeps its capital
        """Return stored and absorbed energy of one of the forces [J]; an open loop is closed by a chord."""
        stroke = self.stroke_mm
        areas = 0.5 * (force_kN[1:] + force_kN[:-1]) * np.diff(stroke)
        chord = 0.5 * float(force_kN[-1] + force_kN[0]) * float(stroke[0] - stroke[-1])
        creeps = self.cycle.top.leave_mm > self.cycle.top.stroke_mm
        stored = areas[: self.top if creeps else self.arrived]
        return float(np.sum(stored)), float(np.sum(areas)) + chord

    def by_shifting(self) -> tuple[float, float | None]:
        """Return absorbed energy [J] and damping gained by a millisecond, by shifting to both sides."""
        per_ms = 1e-3 / (2.0 * SHIFT_S)
        (stored, early), (late_stored, late) = self.areas_J(self.early_kN), self.areas_J(self.late_kN)
        gained = (early - late) * per_ms
        if min(stored, late_stored) <= 0.0:
            return gained, None
        return gained, (early / stored - late / late_stored) * per_ms

    def closed_form(self, stiffness: float, form: ClosedForm) -> tuple[float, float | None]:
        """Return the same by the closed form for sines or for constant speed."""
        if form == "sine-stroke":
            omega = 2.0 * np.pi / self.cycle.duration_s
            energy = float(np.pi * omega * stiffness * (0.5 * self.cycle.range_mm) ** 2) * 1e-3
            loading = 0.5 * energy
        else:
            peak_kN = float(np.max(self.force_kN))  # that of the turning point is a mean of both branches
            rise_kN, fall_kN = peak_kN - float(self.force_kN[0]), peak_kN - float(self.force_kN[-1])
            up, down = slice(0, self.arrived + 1), slice(self.top, None)
            loading = _mean_speed(self.time_s[up], self.stroke_mm[up]) * rise_kN * 1e-3
            energy = loading + _mean_speed(self.time_s[down], self.stroke_mm[down]) * fall_kN * 1e-3
        stored, absorbed = self.areas_J(self.force_kN)
        return energy, (energy - absorbed / stored * loading) / stored if stored > 0.0 else None


def _mean_speed(time_s: FloatArray, stroke_mm: FloatArray) -> float:
    return float(abs(stroke_mm[-1] - stroke_mm[0]) / (time_s[-1] - time_s[0]))
