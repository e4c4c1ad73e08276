"""Dwells of a stand at its reversals: they belong to the motion and do not separate cycles.

A servo valve crosses its overlap at each reversal, and the piston stands meanwhile: 20 to 100 ms at usual
stands. Such a dwell is no rest of the specimen: nobody commanded it, and the period of the motion has it in
it. A cycle lasts from the middle of one lower dwell to the middle of the next, so that cycles that follow
each other leave no time between them, and 1 / duration is the frequency of the motion.

A pause between strokes is commanded. It is told by its length: longer than any stand needs to reverse
(:data:`LONGEST_S`), or longer than one of the strokes beside it.

Where a stand dwells, its turns are flat: their lowest stroke is wherever noise puts it within the dwell. In
such a record the moment of each lower turn is read at its flanks, where the stroke moves: the middle between
the crossings of one level on the way down and on the way up. What is the same at each turn (another shape of
the two flanks) leaves the period as it is. Where the record begins or ends within a dwell, the one flank that
is there and the next turn say where its middle was; beyond the record, its end stands for it, and what is
missing is part of the uncertainty of the moment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.evaluation.cycles.level_crossings import LikeFlanks, crossings, like_flanks
from bufferstand.evaluation.facts import TurningPoint
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.record import Record
from bufferstand.foundation.numbers import median

LONGEST_S = 0.2
"""No stand is taken to need longer to reverse [s] …"""
_SMOOTH, _SMOOTH_S = 0.02, 0.1
"""… and the smooth turn about a dwell, which within the noise looks like it, adds this share of the shorter
stroke beside it, but no more than so many seconds."""
_LEAST_LEVEL = 4
"""Samples of the middle half of a dwell from which its level is read."""
_LEAST_PERIODS = 2
"""So many periods tell which reading of the turns makes them more even."""
_ALIKE = 0.02
"""A turn at an end of the record is like the next one of its kind within this share of the stroke."""


@dataclass(frozen=True)
class _Flanks:
    """A lower turn by its flanks: its moment, how long after the crossing before it and before the one behind
    it that is, its u [s], how many samples' mean that is; and the window in which the flanks were read [mm].
    """

    moment_s: float
    beside_s: tuple[float, float]
    u_s: float
    samples: float
    window_mm: tuple[float, float]


def with_reversals(record: Record, turns: list[TurningPoint], sigma_mm: float) -> list[TurningPoint]:
    """Return turning points, dwells of the reversing stand taken for one moment each.

    Parameters
    ----------
    record : Record
        Only its time, stroke and breaks are used; no flank is read across a break.
    turns : list of TurningPoint
        Lower and upper ones in turn.
    sigma_mm : float
        Noise of the stroke.

    Returns
    -------
    list of TurningPoint
        Each such dwell is a moment (``reversal``); the moments of lower turns are those of their flanks
        where these make the durations of the cycles more even.
    """
    lower = [i for i in range(1, len(turns) - 1) if turns[i].kind == "lower"]
    rests = [i for i in range(1, len(turns) - 1) if turns[i].method == "plateau"]
    both = [i for i in rests if _is_reversal(*turns[i - 1 : i + 2])]
    dwells = {i for i in both if turns[i].kind == "lower"}
    fitted = [i for i in lower if turns[i].method in ("polynomial", "lines")]
    found = list(turns)
    for i in both:
        found[i] = _at_one_level(turns[i], record, sigma_mm)
    for i in dwells:
        found[i] = _as_moment(found[i], record.time_s)
    known: dict[int, _Flanks] = {}
    for flanks in like_flanks(record, turns, sorted(dwells.union(fitted)), sigma_mm):
        known |= _moments(found, flanks)
    places = _places(record.time_s, [own.moment_s for own in known.values()])
    for (i, own), at in zip(known.items(), places, strict=True):
        found[i] = found[i]._replace(
            time_s=own.moment_s,
            leave_s=own.moment_s,
            index=at,
            u_time_s=own.u_s,
            u_leave_s=own.u_s,
            moment_samples=own.samples,
        )
    if not dwells and not known:
        return found
    return _with_ends(record, found, turns, known, sigma_mm)


def _moments(turns: Sequence[TurningPoint], flanks: LikeFlanks) -> dict[int, _Flanks]:
    """Return the moments of turns by their flanks; none where fitted turns are as good.

    The one that makes the periods of the motion more even is nearer to the truth: what is uneven in the
    motion itself is in both.
    """
    own_s = np.array([turns[i].time_s for i in flanks.place.tolist()])
    own_u_s = np.array([turns[i].u_time_s for i in flanks.place.tolist()])
    next_to = np.diff(flanks.place) == 2
    uneven = [_uneven(np.diff(moments)[next_to]) for moments in (own_s, flanks.middle_s)]
    if np.count_nonzero(next_to) >= _LEAST_PERIODS:
        surer = uneven[1] < uneven[0]
    else:
        surer = median(flanks.u_s) < median(own_u_s)
    if not surer:
        return {}
    later_s = median(own_s - flanks.middle_s)
    window_mm = (flanks.level_mm, flanks.half_width_mm)
    columns = (flanks.place, flanks.middle_s, flanks.half_s, flanks.u_s, flanks.samples)
    return {
        i: _Flanks(middle_s + later_s, (half_s + later_s, half_s - later_s), u_s, samples, window_mm)
        for i, middle_s, half_s, u_s, samples in zip(*(a.tolist() for a in columns), strict=True)
    }


def _uneven(periods_s: FloatArray) -> float:
    """Return by how much periods differ from most of them [s]."""
    return median(np.abs(periods_s - median(periods_s))) if periods_s.size else 0.0


def _is_reversal(before: TurningPoint, turn: TurningPoint, after: TurningPoint) -> bool:
    """Say whether a dwell (a plateau) is what the stand needs to reverse, and no pause."""
    beside = ((before, turn.time_s - before.leave_s), (after, after.time_s - turn.leave_s))
    # How long a stroke lasts that the record cuts off is not known.
    strokes_s = min((own_s for top, own_s in beside if top.method not in ("edge", "cut")), default=0.0)
    longest_s = LONGEST_S + min(_SMOOTH * strokes_s, _SMOOTH_S)
    return turn.dwell_s <= min(longest_s, strokes_s)


def _at_one_level(turn: TurningPoint, record: Record, sigma_mm: float) -> TurningPoint:
    """Return a dwell at one level, that of its middle half: so short a dwell has no other, but for noise.

    What a stand eases into it and out of it is no part of it. By half of what the stroke goes within the
    dwell on a straight line, if it does, the level may be another.
    """
    quarter_s = 0.25 * turn.dwell_s
    ends_s = (turn.time_s + quarter_s, turn.leave_s - quarter_s)
    inside = slice(*np.searchsorted(record.time_s, ends_s).tolist())
    time_s, stroke_mm = record.time_s[inside], record.stroke_mm[inside]
    if stroke_mm.size < _LEAST_LEVEL:
        level_mm = 0.5 * (turn.stroke_mm + turn.leave_mm)
        u_mm = float(np.hypot(turn.u_stroke_mm, 0.5 * (turn.stroke_mm - turn.leave_mm)))
    else:
        level_mm = float(np.mean(stroke_mm))
        since_s = time_s - np.mean(time_s)
        speed = float(since_s @ stroke_mm) / float(since_s @ since_s)
        scatter_mm = max(sigma_mm, float(np.std(stroke_mm - speed * since_s, ddof=2)))
        gone_mm = max(0.0, abs(speed) - 2.0 * scatter_mm / float(np.sqrt(since_s @ since_s))) * turn.dwell_s
        u_mm = float(np.hypot(scatter_mm / np.sqrt(stroke_mm.size), 0.5 * gone_mm / np.sqrt(3.0)))
    return turn._replace(stroke_mm=level_mm, leave_mm=level_mm, u_stroke_mm=u_mm)


def _as_moment(turn: TurningPoint, time_s: FloatArray) -> TurningPoint:
    """Return a dwell as one moment, its middle."""
    at_s, u_s = 0.5 * (turn.time_s + turn.leave_s), 0.5 * float(np.hypot(turn.u_time_s, turn.u_leave_s))
    (at,) = _places(time_s, [at_s])
    return turn._replace(time_s=at_s, leave_s=at_s, index=at, u_time_s=u_s, u_leave_s=u_s, method="reversal")


def _places(time_s: FloatArray, moments_s: Sequence[float]) -> list[int]:
    """Return the samples at or next behind some moments."""
    found: list[int] = np.minimum(np.searchsorted(time_s, moments_s), time_s.size - 1).tolist()
    return found


def _with_ends(
    record: Record,
    turns: list[TurningPoint],
    recorded: Sequence[TurningPoint],
    known: Mapping[int, _Flanks],
    sigma_mm: float,
) -> list[TurningPoint]:
    """Return the turns, those at an end of the record at the moment that their one flank tells.

    From the crossing (of few samples: from the corner) to the moment of the turn it takes as long as at the
    next lower turn, if that is alike. ``recorded`` are the turns with their dwells.
    """
    last = len(turns) - 1
    begin_s, until_s = float(record.time_s[0]), float(record.time_s[-1])
    for place, inward, sign, end_s in ((0, 1, -1.0, begin_s), (last, -1, 1.0, until_s)):
        turn, top, like = turns[place], turns[place + inward], recorded[place + 2 * inward]
        short = turn.method == "plateau" and turn.dwell_s <= LONGEST_S
        if turn.kind == "upper" or not (turn.method == "edge" or short):
            continue
        if abs(like.stroke_mm - turn.stroke_mm) > _ALIKE * (top.stroke_mm - turn.stroke_mm):
            continue
        flanks = known.get(place + 2 * inward)
        crossed = None if flanks is None else _crossed(record, turn, top, flanks, sigma_mm)
        if flanks is not None and crossed is not None:
            middle_s = crossed[0] + sign * flanks.beside_s[(1 + inward) // 2]
            u_s = float(np.hypot(crossed[1], flanks.u_s))
        elif short and like.method == "plateau":
            corner_s, own_s = (turn.leave_s, turn.u_leave_s) if place == 0 else (turn.time_s, turn.u_time_s)
            middle_s = corner_s + sign * 0.5 * like.dwell_s
            u_s = float(np.hypot(own_s, 0.5 * np.hypot(like.u_time_s, like.u_leave_s)))
        else:
            continue
        # Beyond the record a turn is only where its own fit has found one.
        at_s = sign * min(sign * middle_s, max(sign * end_s, sign * turn.time_s))
        u_s += abs(middle_s - at_s)
        turns[place] = turn._replace(time_s=at_s, leave_s=at_s, u_time_s=u_s, u_leave_s=u_s)
    return turns


def _crossed(
    record: Record, turn: TurningPoint, top: TurningPoint, flanks: _Flanks, sigma_mm: float
) -> tuple[float, float] | None:
    """Return when the one flank of a turn at an end of the record crosses the level, and its u [s]."""
    first = turn.time_s < top.time_s
    ends_s = (turn.time_s, top.time_s) if first else (top.leave_s, turn.leave_s)
    begin_s, end_s = (np.array([at_s]) for at_s in ends_s)
    found = crossings(record, begin_s, end_s, flanks.window_mm, sigma_mm)
    return (float(found.time_s[0]), float(found.u_s[0])) if np.isfinite(found.time_s[0]) else None
