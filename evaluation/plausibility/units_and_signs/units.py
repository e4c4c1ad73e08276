"""Units and scales: strokes and forces that no stand, specimen or plan of the field makes.

Bounds are so wide that nothing true is beyond them; a wrong unit is off by 4.4, 10, 25.4 or 1000.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.plausibility.run_view import RunView, Samples, pass_of, ways_of
from bufferstand.foundation.numbers import median

FORCE_KN, STROKE_MM = 5000.0, 1000.0
"""No stand of the field has more: impacts reach 3000 kN, proof loads F1 and F4 of EN 15551 2500 kN, strokes
are 50 to 150 mm on stands of 250 mm (paper, 2.1 and 3)."""
BEYOND_STAND = 2.0
"""Nor does a stand reach so many times the limits that its own file states."""
LONGER, APPROACH_MM = 1.6, 20.0
"""A specimen is not compressed by so many times the stroke that it has, and this for the approach."""
SHORTEST = 0.005
"""A cycle of less than this share of the specimen's stroke (0.5 mm of 105) is no test."""
STIFFEST_STATIC, STIFFEST = 60.0, 150.0
"""Force range over stroke range that no buffer and no draw gear reaches [kN/mm], statically and otherwise: a
buffer has 1000 kN at 100 mm at most (EN 15551, Table 3, in the paper: 10), a draw hook 593 kN at 42.5 mm
(paper, Fig. 9: 14), and ten times that where friction sticks."""
WINDOWS = ((25.0, 30.0, 130.0), (60.0, 100.0, 400.0), (100.0, 350.0, 1000.0))
"""Stroke [mm] and force [kN] of EN 15551, Table 3, as the paper quotes it, of a buffer of 105 mm."""
BUFFER_MM = (90.0, 160.0)
"""Buffers whose static forces these windows bound: 105, 110 and 150 mm; the longer one is softer."""
ABOVE, BELOW = 1.5, 10.0
"""A static force at every place reached (two at least) that is above so many times its window, or below it by
this ratio, is that of another unit: a buffer that fails does so at a place, and by less."""
DAMPER_KN, DAMPER_KN_S_PER_MM = 500.0, 3.0
"""What pulls and pushes alike with its speed is a damper. Those of rail vehicles have some 60 kN, and up to
1 kN for each mm/s of slow motion: none has these two at once."""
BOTH_WAYS, OF_BOX = 0.3, 0.3
"""It pulls by this share of what it pushes, and its loops fill this share of stroke times force: those of a
spring that works both ways, however much of its work it takes up, a quarter."""
PLAN = 8.0
"""A run is not off its plan by this ratio."""
_FEWEST = 8


class _Suspect(NamedTuple):
    """A channel, what it shows, and what that is beyond."""

    channel: str
    size: float
    unit: str
    why: str


def implausible_units(look: RunView) -> list[Finding]:
    """Return the channels whose unit or scale cannot be what is stated.

    Where a record has no facts of its specimen, only the absolute bounds apply.

    Parameters
    ----------
    look : Look
    """
    for check in (_absolute, _of_specimen, _of_plan, _stiffness, _both_ways, _static_forces):
        found = list(check(look))
        if found:
            return [_finding(look, suspect) for suspect in found]
    return []


def _ends(channel: Samples) -> tuple[float, float]:
    return channel.share(0.005), channel.share(0.995)


def _absolute(look: RunView) -> Iterator[_Suspect]:
    """Beyond any stand, or beyond the own one."""
    low, high = _ends(look.force)
    peak_kN, own_kN = max(abs(low), abs(high)), look.facts.force_limit_kN
    if peak_kN > FORCE_KN:
        yield _Suspect("force", peak_kN, "kN", f"{peak_kN:.4g} kN, beyond any stand ({FORCE_KN:.0f} kN)")
    elif own_kN is not None and peak_kN > BEYOND_STAND * own_kN:
        yield _Suspect(
            "force", peak_kN, "kN", f"{peak_kN:.4g} kN, beyond the range of the stand ({own_kN:.4g} kN)"
        )
    low, high = _ends(look.stroke)
    range_mm, own_mm = high - low, look.facts.stroke_limit_mm
    if range_mm > STROKE_MM:
        yield _Suspect("stroke", range_mm, "mm", f"{range_mm:.4g} mm, beyond any stand ({STROKE_MM:.0f} mm)")
    elif own_mm is not None and range_mm > BEYOND_STAND * own_mm:
        why = f"{range_mm:.4g} mm, beyond the range of the stand ({own_mm:.4g} mm)"
        yield _Suspect("stroke", range_mm, "mm", why)


def _length_mm(look: RunView) -> float | None:
    """Return the stroke that a buffer or a draw gear has; None of others, and where it is not known."""
    stated = look.facts.specimen
    length = stated.get("max_stroke_mm")
    known = stated.get("kind") in ("buffer", "draw-gear") and isinstance(length, int | float) and length > 0.0
    return float(length) if known and isinstance(length, int | float) else None


def _of_specimen(look: RunView) -> Iterator[_Suspect]:
    """Longer than the specimen has stroke, or cycles that are next to nothing of it."""
    length_mm = _length_mm(look)
    if length_mm is None:
        return
    low, high = _ends(look.stroke)
    range_mm = high - low
    if range_mm > LONGER * length_mm + APPROACH_MM:
        why = f"{range_mm:.4g} mm, beyond the {length_mm:.4g} mm that the specimen has"
        yield _Suspect("stroke", range_mm, "mm", why)
    elif range_mm < SHORTEST * length_mm and (
        any(result.cycle.complete for result in look.results) or _as_found(look) > STIFFEST
    ):
        why = f"cycles of {range_mm:.3g} mm, of {length_mm:.4g} mm that the specimen has"
        yield _Suspect("stroke", range_mm, "mm", why)


def _as_found(look: RunView) -> float:
    """Return the median stiffness of cycles as they were found, with figures or without [kN/mm]; 0: of none.

    Their force at the top less that at both ends: a force that only relaxes makes nothing of that.
    """
    cycles = [result.cycle for result in look.results if result.cycle.range_mm > 0.0]
    if not cycles:
        return 0.0
    ends_s = np.array([(cycle.start_s, cycle.top.time_s, cycle.end_s) for cycle in cycles])
    low, top, back = look.force.at(ends_s.ravel()).reshape(-1, 3).T
    ranges_mm = np.array([cycle.range_mm for cycle in cycles])
    return float(np.median(np.abs(top - 0.5 * (low + back)) / ranges_mm))


def _of_plan(look: RunView) -> Iterator[_Suspect]:
    """Another amplitude than the step that was planned."""
    planned = look.facts.step.get("amplitude_mm")
    if look.facts.kind != "harmonic" or not isinstance(planned, int | float) or planned <= 0.0:
        return
    found = [0.5 * result.cycle.range_mm for result in look.results if result.cycle.complete]
    if not found:
        return
    amplitude_mm = median(found)
    if not planned / PLAN < amplitude_mm < planned * PLAN:
        why = f"an amplitude of {amplitude_mm:.3g} mm, planned were {planned:.4g} mm"
        yield _Suspect("stroke", amplitude_mm, "mm", why)


def _stiffness(look: RunView) -> Iterator[_Suspect]:
    """Stiffer than any buffer or draw gear."""
    length_mm = _length_mm(look)
    if length_mm is None:
        return
    table = look.whole_figures if look.whole_figures.size else _cut_in_force(look)
    if table.size:
        ranges_mm = table[:, 8]
        range_mm = median(ranges_mm)
        moved = ranges_mm > 0.0
        stiffness = median((table[:, 4] - table[:, 3])[moved] / ranges_mm[moved])
    elif look.figures.size:
        range_mm, stiffness = _up_to_the_cut(look)
    else:
        low, high = _ends(look.stroke)
        range_mm, stiffness = high - low, _as_found(look)
    limit = STIFFEST_STATIC if look.facts.kind == "static" else STIFFEST
    if stiffness > limit:
        channel = "stroke" if range_mm < 0.1 * length_mm else "force"
        why = f"{stiffness:.4g} kN/mm over {range_mm:.3g} mm, which no such specimen has (up to {limit:.0f})"
        yield _Suspect(channel, stiffness, "kN/mm", why)


def _both_ways(look: RunView) -> Iterator[_Suspect]:
    """A damper of more force than any of the field, at its speed."""
    table = look.whole_figures
    if look.facts.kind != "harmonic" or _length_mm(look) is None or not table.size:
        return
    low_kN, high_kN, area_J, range_mm, speed = (median(table[:, column]) for column in (3, 4, 5, 8, 9))
    most_kN, least_kN = max(-low_kN, high_kN), min(-low_kN, high_kN)
    if most_kN <= DAMPER_KN or least_kN < BOTH_WAYS * most_kN:
        return
    if area_J > OF_BOX * range_mm * (high_kN - low_kN) and most_kN > DAMPER_KN_S_PER_MM * speed:
        why = f"{most_kN:.4g} kN to and fro at {speed:.3g} mm/s, which no damper of rail vehicles has"
        yield _Suspect("force", most_kN, "kN", why)


def _up_to_the_cut(look: RunView) -> tuple[float, float]:
    """Return range [mm] and stiffness [kN/mm], the medians of ways in up to where the stroke is clipped."""
    found = []
    for way in ways_of([result.cycle for result in look.results]):
        rows = look.stroke.rows(way.start_s, way.end_s)
        stroke_mm = look.stroke.value[rows]
        if way.way < 0 or stroke_mm.size < _FEWEST:
            continue
        cut = int(np.argmax(stroke_mm))
        range_mm = float(stroke_mm[cut] - np.min(stroke_mm[: cut + 1]))
        force_kN = look.force.at(look.stroke.time_s[rows][[0, cut]])
        if range_mm > 0.0:
            found.append((range_mm, float(force_kN[1] - force_kN[0]) / range_mm))
    if not found:
        return 0.0, 0.0
    ranges_mm, stiffnesses = zip(*found, strict=True)
    return median(ranges_mm), median(stiffnesses)


def _cut_in_force(look: RunView) -> FloatArray:
    """Return the figures of cycles whose force alone is clipped: they are stiffer than what is on record."""
    table = look.figures
    return table[~np.isin(table[:, 0], [*look.clipped.get("stroke", ())])]


def _static_forces(look: RunView) -> Iterator[_Suspect]:
    """Statically far from what any buffer of this stroke has, wherever it is looked at."""
    length_mm = _length_mm(look)
    if look.facts.kind != "static" or look.facts.specimen.get("kind") != "buffer" or length_mm is None:
        return
    if not BUFFER_MM[0] <= length_mm <= BUFFER_MM[1]:
        return
    for way in ways_of([result.cycle for result in look.results]):
        one = pass_of(look, way)
        if way.way < 0 or one.stroke_mm.size < _FEWEST:
            continue
        reached = [window for window in WINDOWS if one.stroke_mm[0] < window[0] < one.stroke_mm[-1]]
        if len(reached) < 2:
            continue
        forces = [float(np.interp(window[0], one.stroke_mm, one.force_kN)) for window in reached]
        pairs = list(zip(forces, reached, strict=True))
        above = all(force > ABOVE * window[2] for force, window in pairs)
        if above or all(0.0 < force < window[1] / BELOW for force, window in pairs):
            places = ", ".join(f"{force:.3g} kN at {window[0]:.0f} mm" for force, window in pairs)
            why = f"{places}: no buffer has that (EN 15551: {_ranges(reached)} kN)"
            yield _Suspect("force", forces[-1], "kN", why)
        return


def _ranges(windows: list[tuple[float, float, float]]) -> str:
    return ", ".join(f"{window[1]:.0f} to {window[2]:.0f}" for window in windows)


def _finding(look: RunView, suspect: _Suspect) -> Finding:
    text = (
        f"{suspect.channel} has the wrong unit or factor: {suspect.why}; name the unit and import the record "
        f"again (--unit {suspect.channel}=…), or mend the calibration"
    )
    start_s, end_s = float(look.force.time_s[0]), float(look.force.time_s[-1])
    cycles, size, unit = look.all_cycles, suspect.size, suspect.unit
    return Finding(
        "unit", suspect.channel, start_s, end_s, cycles, size, unit, text, "spoils", whole_record=True
    )
