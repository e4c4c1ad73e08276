"""The draw wires of a stand: their mean is the stroke, their difference is a check of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bufferstand.evaluation.facts import DrawWires, FailedWire, RunFacts
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record
from bufferstand.foundation.channels import (
    STROKE_CHANNELS,
    ChannelUncertainty,
    mean_of_strokes,
    tilt_of_strokes,
)

BLOCKS = 200
"""A record is looked at in so many stretches; a wire that stands still while another moves is out."""
STILL = 0.1
"""Still: moving less than this share of what the wire moves that moves most."""
LEAST_MOTION = 0.25
"""A stretch tells when a wire moves by this share of the largest motion in any stretch …"""
LEAST_MOTION_MM = 0.5
"""… and by at least this much (far above the noise of a wire)."""
SLIPS = 0.5
"""A stretch in which one step makes this share of a wire's motion tells nothing: the wire slipped there."""
_LOOKED_AT = 50
"""Of a longer stretch, about so many samples are looked at."""
_MOST_FITTED = 100_000
"""The straight line of the difference over stroke is fitted to at most so many samples, evenly picked."""


def check_wires(record: Record, facts: RunFacts) -> tuple[Record, RunFacts, DrawWires | None]:
    """Compare the draw wires of a run; where one is out, let the others be the stroke.

    Parameters
    ----------
    record : Record
    facts : RunFacts

    Returns
    -------
    (Record, RunFacts, DrawWires or None)
        The same record and facts, but for a wire that is out: then the stroke is that of the others, and
        so is its uncertainty. None where the record has no two wires.
    """
    difference = record.wire_difference_mm
    if difference is None or difference.size == 0:
        return record, facts, None
    # Where the wires' delays differ, the first and last samples of a stretch have no common instant.
    if not np.isfinite(np.sum(difference)):
        difference = np.where(np.isfinite(difference), difference, 0.0)
    peak = max(int(np.argmax(difference)), int(np.argmin(difference)), key=lambda row: abs(difference[row]))
    largest, at_s = float(abs(difference[peak])), float(record.time_s[peak])
    furthest_mm = max(float(np.max(record.stroke_mm)), -float(np.min(record.stroke_mm)))
    limit = difference_limit_mm(facts.stroke_uncertainty, furthest_mm)
    every = _wires_of(record, difference)
    if failed := _wires_out(every, record.time_s):
        missing = {one.wire for one in failed}
        rest = {name: wire for name, wire in every.items() if name not in missing}
        wires = DrawWires(largest, at_s, None, None, None, limit, failed, warnings=_without(failed, [*rest]))
        return _of_the_rest(record, rest), _facts_of(facts, [*every], missing), wires
    line = _line(record.stroke_mm, difference)
    warnings = []
    if limit is None:
        warnings.append("no limit for the difference of the draw wires: the channels state no linearity")
    elif largest > limit:
        parts = "" if line is None else f"; {line[0]:+.2g} mm at stroke 0, {line[1]:+.2%} of the stroke"
        warnings.append(
            f"the draw wires differ by up to {largest:.3g} mm at {at_s:.4g} s (limit {limit:.3g} mm{parts}): "
            "tilt, a slack wire or a wrong calibration"
        )
    if line is None:
        warnings.append("no offset and scale of the draw wires: the stroke does not move")
    offset, mismatch, remaining = line or (None, None, None)
    return (
        record,
        facts,
        DrawWires(largest, at_s, offset, mismatch, remaining, limit, warnings=tuple(warnings)),
    )


def difference_limit_mm(wires: Sequence[ChannelUncertainty], stroke_mm: float) -> float | None:
    """Return the largest difference that any two wires within their stated limits can show [mm], or None.

    Sum over both of zero, linearity and accuracy at the largest stroke (half-widths of the data sheet); of
    more than two wires over those with the largest limits.
    """
    if len(wires) < 2 or any(w.linearity is None and w.accuracy_percent is None for w in wires):
        return None
    limits = [
        (w.linearity or 0.0) + (w.zero or 0.0) + 0.01 * (w.accuracy_percent or 0.0) * stroke_mm for w in wires
    ]
    return sum(sorted(limits)[-2:])


def _wires_of(record: Record, difference: FloatArray) -> dict[str, FloatArray]:
    """Return what each draw wire reads at the instants of the record: of two by their mean and difference."""
    names = [name for name in STROKE_CHANNELS if name in record.as_recorded]
    if len(names) > 2:
        return {name: np.interp(record.time_s, *record.as_recorded[name]) for name in names}
    if len(names) < 2 and record.signals is not None:
        names = list(record.signals.strokes)
    one, two = names if len(names) == 2 else STROKE_CHANNELS[:2]
    return {one: record.stroke_mm + 0.5 * difference, two: record.stroke_mm - 0.5 * difference}


def _wires_out(wires: Mapping[str, FloatArray], time_s: FloatArray) -> tuple[FailedWire, ...]:
    """Return the wires that stand still while another one moves, each from when on.

    Where each of two stands still while the other moves, one is late and none is broken. Of more, that which
    stood still first is out, and the others are compared with each other.
    """
    blocks = {name: _blocks(wire)[0] for name, wire in wires.items()}
    rows = _blocks(time_s)[1]
    moved = {name: np.max(block, axis=1) - np.min(block, axis=1) for name, block in blocks.items()}
    larger = np.maximum.reduce(list(moved.values()))
    farthest = [max(moved, key=lambda name: float(moved[name][block])) for block in range(larger.size)]
    tells = larger > max(LEAST_MOTION * float(np.max(larger)), LEAST_MOTION_MM)
    failed = []
    for name, own in moved.items():
        # The stretch in which the wire went may hold some of its motion: it is out from there on.
        for block in np.flatnonzero(tells & (own < STILL * larger)).tolist():
            part = slice(rows * block, rows * (block + 1))
            if not _is_a_step(wires[farthest[block]][part]):
                failed.append(FailedWire(name, float(time_s[rows * block])))
                break
    if len(failed) < len(wires):
        return tuple(failed)
    if len(wires) == 2:
        return ()
    first = min(failed, key=lambda one: one.from_s)
    rest = {name: wire for name, wire in wires.items() if name != first.wire}
    return first, *_wires_out(rest, time_s)


def _without(failed: Sequence[FailedWire], rest: Sequence[str]) -> tuple[str, ...]:
    stroke = f"{rest[0]} alone, without the tilt" if len(rest) == 1 else f"the mean of {', '.join(rest)}"
    others = f"{rest[0]} moves" if len(failed) + len(rest) == 2 else "others move"
    return tuple(
        f"draw wire {one.wire} stands still from {one.from_s:.4g} s on while {others}: broken or stuck; "
        f"the stroke is {stroke}"
        for one in failed
    )


def _of_the_rest(record: Record, wires: Mapping[str, FloatArray]) -> Record:
    """Return the record with the stroke of the wires that are left."""
    left = list(wires.values())
    difference = tilt_of_strokes(left) if len(left) > 1 else record.wire_difference_mm
    return replace(record, stroke_mm=mean_of_strokes(left), wire_difference_mm=difference)


def _facts_of(facts: RunFacts, names: Sequence[str], gone: Collection[str]) -> RunFacts:
    """Return the facts with what is stated of the wires that are left."""
    stated, known = facts.stroke_uncertainty, facts.stroke_identities
    left = [number for number, name in enumerate(names) if name not in gone]
    return replace(
        facts,
        stroke_uncertainty=tuple(stated[n] for n in left) if len(stated) == len(names) else stated,
        stroke_identities=tuple(known[n] for n in left) if len(known) == len(names) else known,
    )


def _line(stroke_mm: FloatArray, difference_mm: FloatArray) -> tuple[float, float, float] | None:
    """Return offset [mm], slope, and the largest remaining difference [mm] of the line over stroke."""
    every = -(-stroke_mm.size // _MOST_FITTED)
    stroke, difference = stroke_mm[::every], difference_mm[::every]
    mean, mean_difference = float(np.mean(stroke)), float(np.mean(difference))
    centred = stroke - mean
    spread = float(np.dot(centred, centred))
    if float(np.ptp(centred)) < LEAST_MOTION_MM or spread == 0.0:
        return None
    slope = float(np.dot(centred, difference)) / spread
    centred *= -slope
    centred += difference  # in place: fresh memory for what the line leaves would cost more than the sums
    remaining = max(float(np.max(centred)) - mean_difference, mean_difference - float(np.min(centred)))
    return mean_difference - slope * mean, slope, remaining


def _blocks(column: FloatArray) -> tuple[FloatArray, int]:
    """Return a column in stretches, thinned, shape (stretches, samples), and how many rows each has."""
    rows = column.size // min(BLOCKS, max(1, column.size // 8))
    blocks = column.size // rows
    return column[: blocks * rows].reshape(blocks, rows)[:, :: max(1, rows // _LOOKED_AT)], rows


def _is_a_step(wire: FloatArray) -> bool:
    return bool(np.max(np.abs(np.diff(wire))) > SLIPS * np.ptp(wire))
