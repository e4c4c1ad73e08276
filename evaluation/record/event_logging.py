"""Records that are written by event: a sample whenever stroke or force has changed by so much.

Such a logger looks at its channels all the time and writes nothing while nothing changes. While the specimen
moves fast it writes whenever it looks; where the motion turns, or rests, it waits. Told from that, a long
step has lost nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.numerics import FloatArray, IndexArray
from bufferstand.foundation.numbers import median, quantile

_LEAST_SAMPLES, _LEAST_WAITS = 32, 8
_SHORTEST = 0.02
"""Nearly the shortest step (this quantile) is how often the logger looks."""
_WAITED = 1.5
"""It waited in a step longer than so many of these …"""
_LONG_WAIT = 2.5
"""… and some of its waits are longer than a lost sample makes a step."""
_BEAT = 0.9
"""Steps of nearly the longest (this share of it) may be those of a logger that writes now and then anyway."""
_ALIKE = (0.05, 0.9)
_NARROW_CHANGE = 0.2
"""In all steps but 5 % the change is no less than this share of that which 90 % of the waits stay below."""
_NO_MORE = 2.2
"""What changes in a wait is no more than so many times what changes in a look: lost samples make it so."""
_LARGER = 2.5
"""A wait with so many times the usual change, and what the next step makes, was not ended when it should."""
_BEATS = 5
"""So many of the longest waits, equal to a look, are those of a timer that writes while nothing changes …"""
_STILL = 0.5
"""… where less than this share of what nearly every look of the motion changed did change in them …"""
_SLOW = 10.0
"""… and which last so many looks: shorter waits are alike by chance."""
_FALLEN_SILENT = 1.5
"""A wait of more than so many of them lost what the timer would have written; none is a little longer."""


@dataclass(frozen=True, eq=False)
class EventChanges:
    """The change of each step as a share of that at which the logger writes; shape (N - 1,) all.

    ``changes``: the larger one of stroke and force. ``waited``: steps in which the logger waited.
    """

    changes: FloatArray
    waited: NDArray[np.bool_]


def event_changes(time_s: FloatArray, stroke_mm: FloatArray, force_kN: FloatArray) -> EventChanges | None:
    """Return what changed from sample to sample of a record that is written by event; None of another one.

    Parameters
    ----------
    time_s, stroke_mm, force_kN : arrays, shape (N,)
    """
    if time_s.size < _LEAST_SAMPLES:
        return None
    step = np.diff(time_s)
    beat = step >= _BEAT * float(np.max(step))
    looks_s = quantile(step, _SHORTEST)
    waited = step > _WAITED * looks_s
    own = waited & ~beat
    if not own.any() or np.count_nonzero(step > _LONG_WAIT * looks_s) < _LEAST_WAITS or waited.all():
        return None
    shares = []
    for values in (stroke_mm, force_kN):
        change = np.abs(np.diff(values))
        most = quantile(change[own], _ALIKE[1])
        shares.append(change / most if most > 0.0 else np.zeros_like(change))
    change = np.maximum(*shares)
    alike = quantile(change[~beat], _ALIKE[0]) >= _NARROW_CHANGE
    no_more = median(change[own]) <= _NO_MORE * median(change[~waited])
    return EventChanges(change, waited) if alike and no_more else None


def waits_show(time_s: FloatArray) -> bool:
    """Say whether waits of many lengths show that a logger waits for events; a slow one's are alike at rest.

    Parameters
    ----------
    time_s : array, shape (N,)
        Of the samples that were read.
    """
    step = np.diff(time_s)
    own = (step > _WAITED * quantile(step, _SHORTEST)) & (step < _BEAT * float(np.max(step)))
    return int(np.count_nonzero(own)) >= _LEAST_WAITS


def lost_between(events: EventChanges) -> IndexArray:
    """Return the samples before which more changed than an event, and than the motion makes in a look."""
    change = events.changes
    looks = np.where(events.waited, 0.0, change)
    beside = np.maximum(np.append(looks[1:], 0.0), np.append(0.0, looks[:-1]))
    return np.asarray(np.flatnonzero(events.waited & (change > _LARGER + beside)) + 1, dtype=np.intp)


def silent_beyond_beat(time_s: FloatArray, events: EventChanges) -> IndexArray:
    """Return the samples before which a logger was silent that writes by a timer, too, while nothing changes.

    None where no timer shows: such a logger makes a rest of any length one step.
    """
    step, none = np.diff(time_s), np.zeros(0, dtype=np.intp)
    waits = np.flatnonzero(events.waited)
    longest = waits[np.argsort(-step[waits], kind="stable")][: 2 * _BEATS - 1]
    if longest.size <= _BEATS:
        return none
    length_s, look_s = step[longest], quantile(step, _SHORTEST)
    alike = length_s[: 1 - _BEATS] - length_s[_BEATS - 1 :] <= look_s
    first = int(np.argmax(alike))
    beat_s = float(length_s[first])
    if not alike[first] or first == 0 or length_s[first - 1] <= _FALLEN_SILENT * beat_s:
        return none
    if beat_s < _SLOW * look_s:
        return none
    event = quantile(events.changes[~events.waited], _ALIKE[0])
    if median(events.changes[longest[first : first + _BEATS]]) >= _STILL * event:
        return none
    return np.asarray(np.sort(longest[:first]) + 1, dtype=np.intp)
