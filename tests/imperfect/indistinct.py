"""Gain jumps and held channels that nothing on record tells from what a sound channel shows.

A gain that jumps by a factor g leaves two traces: a step of (g - 1) F at that instant, and other forces at
the same stroke after it than before. Where F is about nothing, or the instant is in a hole of the record,
there is no step. Then it is not distinguishable

- if no load is on record before it, or none after it: a record with one gain throughout is the same;
- if it takes from the force of single strokes, between the first and the second one, no more than 20 %
  together with what the specimen softens by: rubber softens most over its first stroke (Mullins), by a share
  that nobody knows beforehand, and hardly at all over later ones.

A force that grows, that falls between later strokes, or that steps, is none of these.

A channel that is held for k rows and then kept in every n-th row only (blanks, interleaved devices), n from k
on, never shows a value twice: each reading is late by another time, which nothing on record says.
"""

from __future__ import annotations

from math import exp

import numpy as np

from .applied import Applied
from .chain import Scene

# plausibility.md, "gain-jump": a step is told from 8 standard deviations of the noise and 0.15 % of the range
# on, if it is 3 % of the force there, which a gain that changes by 5 % and more always makes
STEP_NOISES, STEP_SHARE = 8.0, 0.0015
SOFTENS = 0.2  # plausibility.md: from the first stroke of a static test to the second, in logarithms
REPEATED = 0.05  # of the readings that follow a like one; a channel held for two rows has half of them
HOLE = 3.0  # steps from sample to sample without a sample
LOADED = 0.05  # of the range of the force: below it a share of 5 % is less than the zero may be off


def is_indistinct(scene: Scene, fault: Applied) -> bool:
    """Return whether this is such a fault."""
    if fault.name == "held":
        column = scene.force_read_kN if fault.channel == "force" else scene.strokes_mm[0]
        readings = column[np.isfinite(column)]
        return float(np.mean(np.diff(readings) == 0.0)) < REPEATED
    if fault.name != "gain-jump":
        return False
    motion_s, force_kN, span_kN = scene.motion.time_s, scene.force_kN, scene.force_span
    step_kN = abs(fault.factor - 1.0) * abs(float(np.interp(fault.start_s, motion_s, force_kN)))
    rows_s = np.sort(scene.true_time_s)
    seen = float(np.min(np.abs(rows_s - fault.start_s))) < HOLE * float(np.median(np.diff(rows_s)))
    if seen and step_kN > max(STEP_NOISES * float(str(scene.facts["noise_kN"])), STEP_SHARE * span_kN):
        return False
    loaded_s = rows_s[np.abs(np.interp(rows_s, motion_s, force_kN)) > LOADED * span_kN]
    before_s, after_s = loaded_s[loaded_s < fault.start_s], loaded_s[loaded_s >= fault.start_s]
    if not len(before_s) or not len(after_s):
        return True
    tops_kN = [
        float(np.max(force_kN[(motion_s >= c.start_s) & (motion_s <= c.end_s)]))
        for c in scene.cycles
        if np.any((loaded_s >= c.start_s) & (loaded_s <= c.end_s))
    ]
    first_ends_s = min((c.end_s for c in scene.cycles if c.end_s >= before_s[0]), default=np.inf)
    over_first = before_s[-1] <= first_ends_s and len(tops_kN) > 1
    if scene.motion.kind != "static" or fault.factor > 1.0 or not over_first:
        return False
    return fault.factor * tops_kN[1] / tops_kN[0] >= exp(-SOFTENS)
