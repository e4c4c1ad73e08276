"""Samples that are no readings leave a record, as if they had been lost (docs/evaluation-document.md)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bufferstand.evaluation.record import Defect, Record

_LEAST_LEFT = 2


def left_out(record: Record, gone: Mapping[int, str]) -> Record:
    """Return a record without some of its samples; each group of neighbours leaves a break behind.

    Parameters
    ----------
    record : Record
    gone : mapping of int to str
        Row and why, in words. Nothing: the same record.
    """
    if not gone:
        return record
    rows = np.array(sorted(gone), dtype=np.intp)
    keep = np.ones(record.time_s.size, dtype=bool)
    keep[rows] = False
    left = int(np.count_nonzero(keep))
    if left < _LEAST_LEFT:
        return record  # nothing would be left to look at: what is wrong with it is said by its findings
    before = np.cumsum(keep)  # how many stay up to each row
    places = {int(before[row]) for row in rows} | {int(before[b - 1]) for b in record.breaks}
    defects = [*record.defects]
    for group in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        first, last = max(int(group[0]) - 1, 0), min(int(group[-1]) + 1, record.time_s.size - 1)
        start_s, end_s = float(record.time_s[first]), float(record.time_s[last])
        defects.append(Defect("spike", start_s, end_s, gone[int(group[0])], group.size))
    return replace(
        record,
        time_s=record.time_s[keep],
        stroke_mm=record.stroke_mm[keep],
        force_kN=record.force_kN[keep],
        speed_mm_per_s=None if record.speed_mm_per_s is None else record.speed_mm_per_s[keep],
        wire_difference_mm=None if record.wire_difference_mm is None else record.wire_difference_mm[keep],
        breaks=tuple(sorted(place for place in places if 0 < place < left)),
        defects=tuple(sorted(defects, key=lambda defect: defect.start_s)),
    )
