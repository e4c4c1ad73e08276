"""Finds the order and the pauses with which a campaign ends soonest within its temperature limit.

A spring cools the faster the warmer it is, and a warm one absorbs less; but a step that brings much heat must
begin cool, and the way down to there is long. So the order decides how long the pauses are. Where there are
few steps every order is tried; else the best of four rules is improved step by step.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from math import ceil, factorial, prod
from typing import Any

from bufferstand.foundation import Harmonic, RampTo, Release, duration_text
from bufferstand.protocols.campaign_file import Campaign
from bufferstand.protocols.campaign_file.step_kinds import CoolDownStep, HoldStep, WarmUpStep
from bufferstand.protocols.limits import TestLimits
from bufferstand.protocols.planning.expansion import Request, motions_of
from bufferstand.protocols.planning.heating import (
    LONGEST_WAIT_S,
    Surroundings,
    Walk,
    Walker,
    cooling_time_s,
)
from bufferstand.protocols.planning.temperature_limits import limits_of
from bufferstand.protocols.prediction import Temperatures
from bufferstand.protocols.steps import Hold, Motion, StartBand, WaitUntilCool, Warmth

EXACT_ORDERS = 5040
"""Up to so many orders are all tried."""
BUDGET = 20_000
"""So many steps of trial orders are walked at most when they are too many to try all."""
_RESOLUTION_C = 0.1
_AFTERWARDS_S = (10.0, 20.0, 40.0, 80.0, 160.0)
"""Times at which a lagging sensor is looked at after a job [s]."""
_ABOVE_AIR_C = 0.5
"""No pause waits for less than so much above the air [K]: it would never end."""


@dataclass(frozen=True)
class Ordering:
    """What the planner's order gains.

    Parameters
    ----------
    method : str
        ``exact`` (every order was tried) or ``heuristic``.
    tried : int
        How many orders.
    given_s : float
        Expected duration as written, with the cool-downs and waits of the file [s].
    given_paused_s : float
        The same order, with the planner's pauses in place of the file's cool-downs.
    chosen_s : float
        The chosen order with its pauses.
    pauses_s : float
        The pauses in it.
    """

    method: str
    tried: int
    given_s: float
    given_paused_s: float
    chosen_s: float
    pauses_s: float

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return asdict(self) | {"saved_s": self.given_s - self.chosen_s}

    def sentence(self) -> str:
        """Return it as a person says it."""
        share = 100.0 * (1.0 - self.chosen_s / self.given_s) if self.given_s > 0.0 else 0.0
        how = f"best of all {self.tried}" if self.method == "exact" else f"best of {self.tried} tried"
        return (
            f"order “soonest” ({how}): {duration_text(self.chosen_s)}, of which "
            f"{duration_text(self.pauses_s)} pauses; as given {duration_text(self.given_s)} "
            f"({share:.0f} % less), in the given order with the planner's pauses "
            f"{duration_text(self.given_paused_s)}"
        )


@dataclass(frozen=True)
class Job:
    """One step to be put in order: its motions, whether it must stay where it is, whose strokes it has."""

    motions: tuple[Motion, ...]
    stays: bool
    nominal_s: float = 0.0
    band: StartBand | None = None
    test: TestLimits | None = None
    """The limits with its own temperatures; None: the campaign's."""
    compensate: bool = True
    warmth: Warmth | None = None

    @property
    def cools(self) -> bool:
        """Whether it is itself a wait for cooling."""
        return isinstance(self.motions[0], WaitUntilCool)


def steps_to_order(requests: Sequence[Request]) -> list[Request]:
    """Return the steps without the cool-downs that the planner's pauses replace.

    A cool-down that stands before a step that stays, or is to stay itself, belongs to the test and is kept.
    """
    kept = []
    for position, request in enumerate(requests):
        later = [other for other in requests[position + 1 :] if not isinstance(other.step, CoolDownStep)]
        free = isinstance(request.step, CoolDownStep) and not request.stays
        if not (free and (not later or not later[0].stays)):
            kept.append(replace(request, stays=request.stays or isinstance(request.step, CoolDownStep)))
    return kept


@dataclass
class OrderSearch:
    """Walks orders of jobs, remembering what it found (temperatures are rounded to 0.1 K for that).

    Parameters
    ----------
    around : Surroundings
        Model, limits, guards, air.
    jobs : sequence of Job
        By their numbers in an order.
    margin_C : float
        So far below the temperature stop the pauses keep the sensor [K].
    start_max_C : float or None
        No job that may be moved begins warmer.
    """

    around: Surroundings
    jobs: Sequence[Job]
    margin_C: float
    start_max_C: float | None
    walked: int = 0
    _walks: dict[tuple[int, Temperatures, bool], Walk] = field(default_factory=dict)
    _pauses: dict[tuple[int, Temperatures], float] = field(default_factory=dict)

    def pause_s(self, number: int, now: Temperatures) -> float:
        """Return how long to wait before a job, so that it runs through below the limit [s]; 0 if in vain."""
        key = (number, _rounded(now))
        if key not in self._pauses:
            self._pauses[key] = self._find_pause(number, key[1])
        return self._pauses[key]

    def after(self, number: int, now: Temperatures) -> tuple[float, Temperatures]:
        """Return how long a job takes with its pause and what it waits for [s], and the state at its end."""
        self.walked += 1
        pause_s = self.pause_s(number, now)
        walk = self._walk(number, self.rested(now, pause_s), cautious=False)
        total_s, end = pause_s + walk.expected_duration_s, walk.end
        if walk.ended:
            wait_s = walk.stops[-1].wait_s
            rest_s = LONGEST_WAIT_S if wait_s is None else wait_s
            total_s, end = total_s + rest_s, self.rested(end, rest_s)
        return total_s, end

    def total_s(self, order: Iterable[int], start: Temperatures) -> float:
        """Return how long an order takes [s]."""
        total_s, now = 0.0, start
        for number in order:
            lasts_s, now = self.after(number, now)
            total_s += lasts_s
        return total_s

    def rested(self, now: Temperatures, duration_s: float) -> Temperatures:
        """Return the temperatures after a rest of ``duration_s``."""
        if duration_s == 0.0:
            return now
        return self.around.predictor.temperatures_after(now, self.around.ambient_C, 0.0, duration_s)

    def heat_J(self, number: int, now: Temperatures) -> float:  # noqa: N802 - the unit keeps its capital
        """Return what a job absorbs [J]."""
        return self._walk(number, now, cautious=False).heat_J

    def _test(self, number: int) -> TestLimits:
        return self.jobs[number].test or self.around.test

    def _stays_cool(self, number: int, end: Temperatures) -> bool:
        """Return whether the sensor, which lags behind, stays below the limit in a rest after a job, too."""
        stop_C = self._test(number).temperature_stop_C - self.margin_C
        if end.mass_C < stop_C:
            return True
        return all(self.rested(end, rest_s).sensor_C < stop_C for rest_s in _AFTERWARDS_S)

    def _walk(self, number: int, now: Temperatures, *, cautious: bool) -> Walk:
        key = (number, _rounded(now), cautious)
        if key not in self._walks:
            test = self._test(number)
            if cautious:
                stop_C = test.temperature_stop_C - self.margin_C
                changed = {"temperature_stop_C": stop_C, "on_temperature_stop": "stop"}
                test = test.model_copy(update=changed)
            job = self.jobs[number]
            walker = Walker(replace(self.around, test=test), key[1], compensate=job.compensate)
            walker.cool_into(job.band)
            self._walks[key] = walker.walk(job.motions, job.warmth)
        return self._walks[key]

    def _find_pause(self, number: int, now: Temperatures) -> float:
        job, around = self.jobs[number], self.around
        if job.cools:
            return 0.0
        least_s = 0.0
        if self.start_max_C is not None and not job.stays:
            to_C = max(self.start_max_C, around.ambient_C + _ABOVE_AIR_C)
            least_s = cooling_time_s(around.predictor, now, to_C, around.ambient_C) or 0.0

        def passes(wait_s: float) -> bool:
            walk = self._walk(number, self.rested(now, wait_s), cautious=True)
            return not walk.stops and self._stays_cool(number, walk.end)

        if passes(least_s):
            return least_s
        coolest_C = around.ambient_C + _ABOVE_AIR_C
        high_s = cooling_time_s(around.predictor, now, coolest_C, around.ambient_C) or 0.0
        if high_s <= least_s or not passes(high_s):
            return least_s
        low_s = least_s
        while high_s - low_s > max(2.0, 0.005 * high_s):
            middle_s = (low_s + high_s) / 2.0
            low_s, high_s = (low_s, middle_s) if passes(middle_s) else (middle_s, high_s)
        return high_s


def _rounded(now: Temperatures) -> Temperatures:
    return Temperatures(
        round(round(now.mass_C / _RESOLUTION_C) * _RESOLUTION_C, 6),
        round(round(now.sensor_C / _RESOLUTION_C) * _RESOLUTION_C, 6),
    )


def soonest(course: OrderSearch, start: Temperatures) -> tuple[tuple[int, ...], str, int]:
    """Return the order that ends soonest, whether it is exact, and how many orders were tried.

    Parameters
    ----------
    course : Course
        The jobs; those that stay keep their place, the others move between them.
    start : Temperatures
        Of the specimen at the start.

    Returns
    -------
    order : tuple of int
        Numbers of the jobs.
    method : str
        ``exact`` or ``heuristic``.
    tried : int
        Orders that were compared.
    """
    groups = _groups(course.jobs)
    orders = prod(factorial(len(group)) for group in groups)
    if orders <= EXACT_ORDERS:
        return _every_order(course, groups, start), "exact", orders
    return _improved(course, groups, start)


def _groups(jobs: Sequence[Job]) -> list[list[int]]:
    """Return runs of jobs that may change places; one that stays is a run of its own."""
    groups: list[list[int]] = []
    for number, job in enumerate(jobs):
        if groups and not job.stays and not jobs[groups[-1][-1]].stays:
            groups[-1].append(number)
        else:
            groups.append([number])
    return groups


def _every_order(
    course: OrderSearch, groups: Sequence[Sequence[int]], start: Temperatures
) -> tuple[int, ...]:
    """Try all, leaving out what cannot become better than the best so far; the given order comes first."""
    least_s = [job.nominal_s for job in course.jobs]
    group_of = {number: place for place, group in enumerate(groups) for number in group}
    best: tuple[int, ...] = tuple(number for group in groups for number in group)
    best_s = course.total_s(best, start)

    def go_on(done: tuple[int, ...], left: tuple[int, ...], spent_s: float, now: Temperatures) -> None:
        nonlocal best, best_s
        if not left:
            if spent_s < best_s - 1.0:
                best, best_s = done, spent_s
            return
        if spent_s + sum(least_s[number] for number in left) >= best_s - 1.0:
            return
        for number in left:
            if group_of[number] == group_of[left[0]]:
                lasts_s, end = course.after(number, now)
                rest = tuple(other for other in left if other != number)
                go_on((*done, number), rest, spent_s + lasts_s, end)

    go_on((), best, 0.0, start)
    return best


def _improved(
    course: OrderSearch, groups: Sequence[Sequence[int]], start: Temperatures
) -> tuple[tuple[int, ...], str, int]:
    """Take the best of given, warming, cooling and greedy order, and move single steps while that helps."""
    heat_J = {number: course.heat_J(number, start) for group in groups for number in group}
    candidates = [
        _flat(groups),
        _flat(sorted(group, key=lambda number: heat_J[number]) for group in groups),
        _flat(sorted(group, key=lambda number: -heat_J[number]) for group in groups),
        _greedy(course, groups, start, heat_J),
    ]
    timed = [course.total_s(order, start) for order in candidates]
    best_s = min(timed)
    best = candidates[timed.index(best_s)]
    tried = len(candidates)
    bounds = _bounds(groups)
    improved = True
    while improved and course.walked < BUDGET:
        improved = False
        for low, high in bounds:
            for moved in range(low, high):
                for place in range(low, high):
                    if place == moved or course.walked >= BUDGET:
                        continue
                    order = _with_moved(best, moved, place)
                    found_s = course.total_s(order, start)
                    tried += 1
                    if found_s < best_s - 1.0:
                        best, best_s, improved = order, found_s, True
    return best, "heuristic", tried


def _flat(groups: Iterable[Iterable[int]]) -> tuple[int, ...]:
    return tuple(number for group in groups for number in group)


def _bounds(groups: Sequence[Sequence[int]]) -> list[tuple[int, int]]:
    ends = [0]
    for group in groups:
        ends.append(ends[-1] + len(group))
    return [(low, high) for low, high in pairwise(ends) if high - low > 1]


def _with_moved(order: tuple[int, ...], moved: int, place: int) -> tuple[int, ...]:
    rest = [*order[:moved], *order[moved + 1 :]]
    rest.insert(place, order[moved])
    return tuple(rest)


def _greedy(
    course: OrderSearch, groups: Sequence[Sequence[int]], start: Temperatures, heat_J: dict[int, float]
) -> tuple[int, ...]:
    """Take next what needs the shortest pause now; of equals what heats most."""
    order: list[int] = []
    now = start
    for group in groups:
        left = list(group)
        while left:
            chosen = min(left, key=lambda n: (course.pause_s(n, now), -heat_J[n]))
            left.remove(chosen)
            order.append(chosen)
            _, now = course.after(chosen, now)
    return tuple(order)


def _pause(pause_s: float, to_C: float, now: Temperatures, number: int) -> Request:
    """Return a wait for a temperature; for a time where the sensor lags so far that none would be waited."""
    if now.sensor_C <= to_C:
        hold = HoldStep(kind="hold", duration_s=float(ceil(pause_s)))
        return Request(hold, f"pause of {hold.duration_s:g} s", number, pause=True)
    timeout_s = max(7200.0, float(round(3.0 * pause_s)))
    cool = CoolDownStep(kind="cool-down", temperature_C=to_C, timeout_s=timeout_s)
    return Request(cool, f"pause until {to_C:g} °C", number, pause=True)


def with_pauses(
    course: OrderSearch, order: Sequence[int], requests: Sequence[Request], start: Temperatures
) -> tuple[Request, ...]:
    """Return the requests in an order, with the planner's pauses between them as cool-downs."""
    found: list[Request] = []
    now = start
    for number in order:
        pause_s = course.pause_s(number, now)
        if pause_s > 0.0:
            to_C = round(course.rested(now, pause_s).sensor_C, 1)
            found.append(_pause(pause_s, to_C, now, requests[number].number))
        found.append(requests[number])
        _, now = course.after(number, now)
    return tuple(found)


@dataclass(frozen=True)
class InOrder:
    """Requests put in order: as chosen, and as given but with the planner's pauses, for comparison."""

    chosen: tuple[Request, ...]
    given: tuple[Request, ...]
    method: str
    tried: int


def course_of(requests: Sequence[Request], campaign: Campaign, around: Surroundings) -> OrderSearch:
    """Return what walks orders of requests, by the settings of a campaign's ``[plan]``."""
    settings, jobs = campaign.content.plan, []
    for request in requests:
        motions = motions_of(request.step, campaign.content.motion, around.limits)
        step = request.step
        limits = limits_of(step, around.test)
        band = step.start_band()
        warmth = step.warmth() if isinstance(step, WarmUpStep) else None
        jobs.append(Job(motions, request.stays, _least_s(motions), band, limits, request.compensate, warmth))
    return OrderSearch(around, jobs, settings.margin_C, settings.start_max_C)


def put_in_order(
    requests: Sequence[Request], campaign: Campaign, around: Surroundings, start: Temperatures
) -> InOrder:
    """Return the requests in the order in which the campaign ends soonest, with the pauses it needs.

    Parameters
    ----------
    requests : sequence of Request
        As written, cool-downs included.
    campaign : Campaign
        Its ``[plan]`` and ``[motion]``.
    around : Surroundings
        Model (better a coarse one: it is asked often), limits, guards, air.
    start : Temperatures
        Of the specimen at the start.
    """
    kept = steps_to_order(requests)
    course = course_of(kept, campaign, around)
    order, method, tried = soonest(course, start)
    given = range(len(kept))
    return InOrder(
        with_pauses(course, order, kept, start), with_pauses(course, given, kept, start), method, tried
    )


def _least_s(motions: Sequence[Motion]) -> float:
    """Return the part of a duration that needs no model [s]."""
    total_s, at_mm = 0.0, 0.0
    for motion in motions:
        if isinstance(motion, RampTo | Release | Hold | Harmonic):
            total_s += motion.duration_s(at_mm)
        at_mm = motion.end_mm(at_mm)
    return total_s
