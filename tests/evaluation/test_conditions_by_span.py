"""No condition passes that is broken, and none fails that is met, whatever of the record its rows hide.

Static tests with a known breach, or none, lose rows in the ways of loggers. By hypothesis: each example is a
specimen's whole test, then what is left of its rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bufferstand.evaluation.facts.results import RequirementResult, RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Temperature, make_record
from bufferstand.evaluation.requirements.conditions.spans import ValueSpan
from bufferstand.evaluation.requirements.conditions.speed import between_rows
from bufferstand.evaluation.requirements.rows import RowLimits
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.signals import BUFFER, STARTED, STATED, Floats

Mask = NDArray[np.bool_]
FACTS = RunFacts("s", "static", specimen=dict(BUFFER), started=STARTED, **STATED)  # type: ignore[arg-type]
TOP_MM, SPEED_MM_PER_S, DWELL_S, PAUSE_S, WARM_C = 102.0, 50.0, 1.0, 600.0, 25.0
NEAR = {"speed-limit": 0.5, "immediate-unloading": 0.05, "pause-limit": 0.1, "temperature-range": 0.05}
"""So near to its limit a true value may fall on either side: noise, and the moments of the turns."""
KEEP = ("all", "few", "slow at rest", "none at rest", "by event", "a hole", "a lost turn", "cut", "blanks")


@dataclass(frozen=True)
class Stroke:
    """One stroke as it is commanded; ``burst``: this share of its way up is made at that speed [mm/s]."""

    up: float = 20.0
    down: float = 20.0
    dwell_s: float = 0.0
    pause_s: float = 4.0
    warm_C: float = 20.0
    burst: tuple[float, float] = (0.0, 20.0)

    @property
    def fastest(self) -> float | None:
        """Its greatest speed over 5 % of a branch [mm/s]; None where a burst lasts for about that."""
        share, speed = self.burst
        burst_s, rest_s = share * TOP_MM / speed, (1.0 - share) * TOP_MM / self.up
        windows = burst_s / (0.05 * (burst_s + rest_s))
        if 0.3 < windows < 1.3:
            return None
        return max(self.up, self.down, speed if windows >= 1.3 else 0.0)

    def corners(self) -> list[tuple[float, float]]:
        """Return (duration, stroke at its end) of its legs."""
        share, speed = self.burst
        middle = 0.5 * TOP_MM
        legs = [((middle / self.up), middle)]
        if share > 0.0:
            legs.append((share * TOP_MM / speed, middle + share * TOP_MM))
        legs.append(((TOP_MM - legs[-1][1]) / self.up, TOP_MM))
        return [*legs, (self.dwell_s, TOP_MM), (TOP_MM / self.down, 0.0), (self.pause_s, 0.0)]


@dataclass(frozen=True)
class Made:
    """A test, when its strokes begin, are at the top and end, and its rows."""

    strokes: tuple[Stroke, ...]
    spans_s: tuple[tuple[float, float, float], ...]
    time_s: Floats
    stroke_mm: Floats
    force_kN: Floats
    readings: tuple[Floats, Floats]
    resting: Mask


def made(strokes: tuple[Stroke, ...], rate_Hz: float, noise_mm: float, every_s: float, seed: int) -> Made:
    """Return the whole test."""
    at, stroke, spans, warm = [0.0, 2.0], [0.0, 0.0], [], [(0.0, strokes[0].warm_C)]
    for own in strokes:
        start, top = at[-1], 0.0
        for seconds, end_mm in own.corners():
            at.append(at[-1] + max(seconds, 1e-9))
            stroke.append(end_mm)
            top = at[-1] if end_mm == TOP_MM and top == 0.0 else top
        spans.append((start, top + 0.5 * own.dwell_s, at[-2]))
        # Before and after the rests it is as warm as the specimen is in the stroke beside.
        warm += [(start - 1.0, own.warm_C), (at[-2] + 1.0, own.warm_C)]
    random = np.random.default_rng(seed)
    time = np.arange(0.0, at[-1], 1.0 / rate_Hz)
    mm = np.interp(time, at, stroke)
    rising = np.interp(time, at, np.concatenate(([0.0], np.sign(np.diff(stroke))))) >= 0.0
    force = (20.0 + 2.0 * mm + 3.8e-6 * mm**4) * np.where(rising, 1.0, 0.45) + 0.02 * random.normal(
        size=time.size
    )
    begins, _, ends = np.array(spans).T
    inside = np.searchsorted(begins - 0.1, time) > np.searchsorted(ends + 0.1, time)
    read_s = np.arange(random.uniform(0.0, min(every_s, 1.0)), time[-1], every_s)
    celsius = np.interp(read_s, *np.array(warm).T)
    measured = mm + noise_mm * random.normal(size=time.size)
    return Made(strokes, tuple(spans), time, measured, force, (read_s, celsius), ~inside)


def kept(test: Made, way: str, size: float, place: float) -> Mask:
    """Return which rows a logger keeps, by mask; ``size`` and ``place`` are shares."""
    rows = np.arange(test.time_s.size)
    number = min(int(place * len(test.strokes)), len(test.strokes) - 1)
    start, top, end = test.spans_s[number]
    length_s = size * 1.5 * (end - start)
    time_s, at_s = test.time_s, test.time_s[0] + place * (test.time_s[-1] - test.time_s[0])
    about_s = (top, end, start)[int(3 * size)]
    ways: dict[str, Callable[[], Mask]] = {
        "few": lambda: rows % max(1, int(3 ** (5.0 * size))) == 0,
        "slow at rest": lambda: ~test.resting | (rows % max(2, int(200 * size)) == 0),
        "none at rest": lambda: ~test.resting,
        "by event": lambda: by_event(test, 0.05 + 0.4 * size),
        "a hole": lambda: (time_s < at_s) | (time_s > at_s + length_s),
        "a lost turn": lambda: np.abs(time_s - about_s) > 0.2 * length_s,
        # something is left of it
        "cut": lambda: time_s > min(at_s, end) if size < 0.5 else time_s < max(at_s, end),
    }
    return ways[way]() if way in ways else np.ones(rows.size, dtype=bool)


def by_event(test: Made, event_mm: float) -> Mask:
    """Return the rows of a logger that writes what has changed, and every five seconds."""
    keep, last = np.zeros(test.time_s.size, dtype=bool), 0
    changed = np.column_stack((test.stroke_mm / event_mm, test.force_kN / (3.0 * event_mm)))
    for i in range(test.time_s.size):
        if (
            i == 0
            or np.max(np.abs(changed[i] - changed[last])) > 1.0
            or test.time_s[i] > test.time_s[last] + 5.0
        ):
            keep[i], last = True, i
    return keep


def evaluated(test: Made, keep: Mask, *, blanks: bool) -> RunEvaluation:
    """Evaluate what a logger kept."""
    read_s, celsius = test.readings
    if blanks:  # the thermometer was read in the first seconds of each stroke only
        begins = np.array([start for start, _, _ in test.spans_s])
        some = (np.abs(read_s[:, None] - begins - 0.5) < 1.5).any(axis=1)
        read_s, celsius = read_s[some], celsius[some]
    record = make_record(
        test.time_s[keep],
        test.stroke_mm[keep],
        test.force_kN[keep],
        temperatures=[Temperature("temperature_1", read_s, celsius, accuracy_C=0.5)],
    )
    return evaluate_run(record, FACTS, Options(draws=0))


def true_value(test: Made, identity: str, number: int) -> float | None:
    """Return the true value of a condition of a stroke (from 0); None where it has none."""
    own = test.strokes[number]
    if identity == "speed-limit":
        return own.fastest
    if identity == "immediate-unloading":
        return own.dwell_s
    if identity == "pause-limit":
        return test.strokes[number - 1].pause_s if number else None
    return own.warm_C if identity == "temperature-range" else None


LIMITS = {
    "speed-limit": SPEED_MM_PER_S,
    "immediate-unloading": DWELL_S,
    "pause-limit": PAUSE_S,
    "temperature-range": WARM_C,
}


def untrue(test: Made, keep: Mask, run: RunEvaluation) -> list[str]:
    """Return the conditions that pass though broken, or fail though met.

    A stroke counts of which something is between the first and the last row: of others nobody can know.
    """
    first_s, last_s = test.time_s[keep][[0, -1]]
    happened = sum(end > first_s and start < last_s for start, _, end in test.spans_s)
    spans = {result.cycle.index: (result.cycle.start_s, result.cycle.end_s) for result in run.cycles}
    found = []
    for row in run.requirements:
        if row.id == "cycle-count":
            met = happened >= 3
            found += (
                [f"{row.id}: {row.verdict}, {row.why}"] if row.verdict == ("fail" if met else "pass") else []
            )
        if row.id not in LIMITS or row.verdict not in ("pass", "fail"):
            continue
        start_s, end_s = spans[row.cycle or 0]
        inside = [n for n, (_, top_s, _) in enumerate(test.spans_s) if start_s <= top_s <= end_s]
        if row.id == "pause-limit":
            inside = inside[:1]  # the pause is that before the first of them
        if not inside:
            found.append(f"{row.id} of no stroke: {row.verdict}, {row.why}")
            continue
        values = [value for n in inside if (value := true_value(test, row.id, n)) is not None]
        if any(abs(value - LIMITS[row.id]) <= NEAR[row.id] for value in values) or not values:
            continue
        # Where a hole makes one cycle of several strokes, all have to keep the limit, or one breaks it.
        if (row.verdict == "pass") != (max(values) < LIMITS[row.id]):
            found.append(f"{row.id} of stroke {inside[0] + 1}, truly {values}: {row.verdict}, {row.why}")
    return found


BREACHES: tuple[dict[str, object], ...] = (
    {},
    {"dwell_s": 0.5}, {"dwell_s": 0.9}, {"dwell_s": 1.15}, {"dwell_s": 1.5}, {"dwell_s": 3.0},
    {"up": 47.0}, {"up": 54.0}, {"down": 80.0}, {"burst": (0.15, 60.0)}, {"burst": (0.3, 75.0)},
    {"pause_s": 590.0}, {"pause_s": 612.0}, {"pause_s": 700.0}, {"warm_C": 24.5}, {"warm_C": 27.0},
)  # fmt: skip


@dataclass(frozen=True)
class Example:
    """A test and what a logger leaves of it, in few words: what fails can be read and made again."""

    strokes: tuple[Stroke, ...]
    rate_Hz: float
    noise_mm: float
    every_s: float
    seed: int
    way: str
    size: float
    place: float


@st.composite
def examples(draw: st.DrawFn) -> Example:
    speed = draw(st.sampled_from([4.0, 9.0, 20.0, 44.0]))
    usual = Stroke(
        up=speed, down=speed * draw(st.sampled_from([0.8, 1.0])), dwell_s=draw(st.sampled_from([0.0, 0.2]))
    )
    strokes = [usual] * draw(st.sampled_from([2, 3, 3, 3, 4]))
    bad = draw(st.integers(0, len(strokes) - 1))
    strokes[bad] = replace(usual, **draw(st.sampled_from(BREACHES)))  # type: ignore[arg-type]
    rates = [20.0, 50.0, 200.0] if speed > 9.0 else [20.0, 50.0]
    share = st.floats(0.01, 0.99)
    return Example(
        tuple(strokes),
        draw(st.sampled_from(rates)),
        draw(st.sampled_from([0.002, 0.02, 0.1])),
        draw(st.sampled_from([0.5, 5.0, 14.5, 25.0])),
        draw(st.integers(0, 999)),
        draw(st.sampled_from(KEEP)),
        draw(share),
        draw(share),
    )


def hold(example: Example) -> None:
    own = example
    test = made(own.strokes, own.rate_Hz, own.noise_mm, own.every_s, own.seed)
    keep = kept(test, own.way, own.size, own.place)
    assert untrue(test, keep, evaluated(test, keep, blanks=own.way == "blanks")) == [], own


def drawn(seed: int) -> Example:
    """Return one of :func:`examples` by a number: hypothesis draws by what modules are loaded, too."""
    random = Random(seed)
    speed = random.choice([4.0, 9.0, 20.0, 44.0])
    usual = Stroke(up=speed, down=speed * random.choice([0.8, 1.0]), dwell_s=random.choice([0.0, 0.2]))
    strokes = [usual] * random.choice([2, 3, 3, 3, 4])
    strokes[random.randrange(len(strokes))] = replace(usual, **random.choice(BREACHES))  # type: ignore[arg-type]
    rate_Hz = random.choice([20.0, 50.0, 200.0] if speed > 9.0 else [20.0, 50.0])
    noise_mm, every_s = random.choice([0.002, 0.02, 0.1]), random.choice([0.5, 5.0, 14.5, 25.0])
    way, size, place = random.choice(KEEP), random.uniform(0.01, 0.99), random.uniform(0.01, 0.99)
    return Example(tuple(strokes), rate_Hz, noise_mm, every_s, seed, way, size, place)


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_no_condition_passes_broken_or_fails_met(first: int) -> None:
    for seed in range(first, first + 10):
        hold(drawn(seed))


@pytest.mark.long
@given(examples())
@settings(max_examples=4000, suppress_health_check=list(HealthCheck))
def test_no_condition_passes_broken_or_fails_met_in_thousands(
    example: Example,
) -> None:
    hold(example)


# ── the spans themselves ───────────────────────────────────────────────────────────────────────────────────
def test_a_span_is_met_broken_or_neither() -> None:
    most = RowLimits(None, 1.0, "s")
    assert [ValueSpan(*ends).verdict(most) for ends in ((0.0, 1.0), (0.5, 1.5), (1.1, 2.0))] == [
        "pass", "inconclusive", "fail",
    ]  # fmt: skip
    window = RowLimits(71.0, 73.0, "h")
    ends = ((71.0, 73.0), (70.0, 74.0), (73.5, 80.0), (50.0, 70.9))
    assert [ValueSpan(*own).verdict(window) for own in ends] == ["pass", "inconclusive", "fail", "fail"]


def test_what_rows_far_apart_hide_of_a_speed() -> None:
    """Of 2 s a window takes 0.1 s: rows 0.2 s apart at 20 mm/s may hide 80, rows 0.05 s apart none."""
    for step_s, wanted in ((0.2, 80.0), (0.05, 20.0), (0.04, 0.0)):
        time = np.arange(0.0, 2.0 + 0.5 * step_s, step_s)
        assert between_rows(time, 20.0 * time, 2.0) == pytest.approx(wanted)


def row(test: Made, identity: str, cycle: int | None = None, keep: Mask | None = None) -> RequirementResult:
    """Return one row of a test of which a logger kept some."""
    some = np.ones(test.time_s.size, dtype=bool) if keep is None else keep
    run = evaluated(test, some, blanks=False)
    return next(one for one in run.requirements if (one.id, one.cycle) == (identity, cycle))


SLOW = (Stroke(up=4.0, down=4.0),) * 3


def test_a_dwell_that_noise_hides_is_not_excluded() -> None:
    """At 4 mm/s a dwell of 1.5 s is not told from the turn by its level amid noise of 0.1 mm."""
    dwelling = (replace(SLOW[0], dwell_s=1.5), *SLOW[1:])
    found = [row(made(strokes, 50.0, 0.1, 1.0, 3), "immediate-unloading", 1) for strokes in (SLOW, dwelling)]
    assert [one.verdict for one in found] == ["pass", "inconclusive"]
    assert "how long it dwelt is known no better" in found[1].why


def test_a_dwell_between_rows_is_not_excluded() -> None:
    """Rows are lost about the top, over 1.4 s: less than a tenth of the stroke, so that it is evaluated."""
    strokes = (Stroke(up=9.0, down=9.0),) * 3
    test = made(strokes, 50.0, 0.002, 1.0, 3)
    top_s = test.spans_s[1][1]
    keep = np.abs(test.time_s - top_s) > 0.7
    assert row(test, "immediate-unloading", 2).verdict == "pass"
    assert row(test, "immediate-unloading", 2, keep).verdict in ("pass", "inconclusive")
    late = made((strokes[0], replace(strokes[1], dwell_s=1.3), strokes[2]), 50.0, 0.002, 1.0, 3)
    keep = np.abs(late.time_s - late.spans_s[1][1]) > 0.7
    assert row(late, "immediate-unloading", 2, keep).verdict == "inconclusive"


def test_a_hole_in_the_only_stroke_may_hide_another() -> None:
    """The stroke lasts as long as the hole in it: that is no measure of how long strokes take."""
    test = made((Stroke(), Stroke(), Stroke()), 50.0, 0.002, 1.0, 3)
    hidden_s = (test.spans_s[1][0] - 1.0, test.spans_s[1][2] + 1.0)
    keep = (test.time_s < hidden_s[0]) | (test.time_s > hidden_s[1])
    keep &= test.time_s > test.spans_s[0][2] + 1.0
    count = row(test, "cycle-count", None, keep)
    assert count.verdict == "inconclusive", count.why


def test_the_step_of_a_slow_logger_may_hide_a_stroke() -> None:
    """At rest it writes every 15 s, and a stroke of 10 s fits between: if it is slow in strokes as well.

    A logger whose rate follows the motion has lost nothing (contract, section 3).
    """
    test = made((Stroke(pause_s=60.0), Stroke(pause_s=60.0)), 20.0, 0.002, 1.0, 3)
    rows = np.arange(test.time_s.size)
    slow_at_rest = ~test.resting | (rows % 300 == 0)
    start_s, _, end_s = test.spans_s[1]
    second = (test.time_s > start_s - 1.0) & (test.time_s < end_s + 1.0)
    assert row(test, "cycle-count").verdict == "fail"
    assert row(test, "cycle-count", None, slow_at_rest).verdict == "fail"
    slow_in_second = slow_at_rest & (~second | (rows % 32 == 0))
    assert row(test, "cycle-count", None, slow_in_second).verdict == "inconclusive"


def test_readings_that_end_before_the_stroke_came_to_rest_do_not_cover_it() -> None:
    """How long a stand eases into its rest, noise hides: 14.9 s to the end that is found may be 15.1 s."""
    test = made((Stroke(up=14.0, down=14.0, pause_s=20.0),) * 3, 50.0, 0.02, 1.0, 3)
    start, _, end = test.spans_s[1]
    read_s = np.array([start - 1.0, end - 14.9, end + 30.0])
    alone = replace(test, readings=(read_s, np.full(3, 20.0)))
    assert row(alone, "temperature-range", 2).verdict == "inconclusive"
    nearer = replace(test, readings=(read_s + np.array([0.0, 0.6, 0.0]), np.full(3, 20.0)))
    assert row(nearer, "temperature-range", 2).verdict == "pass"


def test_a_record_that_ends_in_the_way_up_of_a_stroke_does_not_say_that_there_were_too_few() -> None:
    test = made((Stroke(),) * 3, 50.0, 0.002, 1.0, 3)
    start, top, _ = test.spans_s[2]
    count = row(test, "cycle-count", None, test.time_s < 0.5 * (start + top))
    assert count.verdict == "inconclusive"
    assert row(test, "cycle-count", None, test.time_s < start - 1.0).verdict == "fail"


def test_a_reading_behind_the_stroke_that_may_be_its_own_says_only_how_cold_it_was() -> None:
    """Between 20 °C within it and 27 °C in the pause: at its end anything between."""
    test = made((Stroke(up=20.0, down=20.0),) * 3, 50.0, 0.002, 1.0, 3)
    start, _, end = test.spans_s[0]
    read_s = np.array([start - 1.4, end + 2.7, test.time_s[-1]])
    alone = replace(test, readings=(read_s, np.array([20.0, 27.0, 27.0])))
    assert row(alone, "temperature-range", 1).verdict == "inconclusive"


def test_a_stroke_that_ends_in_the_last_step_before_a_rest_may_have_ended_anywhere_in_it() -> None:
    """Rows end 0.2 mm above the rest and go on 5 s later; in between the specimen was warmed."""
    test = made((Stroke(up=10.0, down=10.0, pause_s=30.0),) * 3, 20.0, 0.002, 1.0, 3)
    end_s = test.spans_s[1][2]
    rows = np.arange(test.time_s.size)
    keep = (~test.resting & (np.abs(test.stroke_mm) > 0.2)) | (rows % 100 == 0)
    warm = np.where(test.readings[0] > end_s + 0.5, 30.0, 20.0)
    warmed = replace(test, readings=(test.readings[0], warm))
    assert row(warmed, "temperature-range", 2).verdict == "pass"
    assert row(warmed, "temperature-range", 2, keep).verdict in ("pass", "inconclusive")


def test_a_warm_reading_before_the_stroke_breaks_nothing() -> None:
    """12 s before the start it was 27 °C, and in the stroke it is 20 °C: what it was at the start is open."""
    test = made((Stroke(pause_s=20.0),) * 3, 50.0, 0.02, 1.0, 3)
    start, _, end = test.spans_s[1]
    read_s = np.array([start - 4.0, start + 14.0, end + 1.0])
    alone = replace(test, readings=(read_s, np.array([27.0, 20.0, 20.0])))
    assert row(alone, "temperature-range", 2).verdict == "inconclusive"


def test_a_cold_reading_long_before_leaves_the_start_open() -> None:
    """It was read at 13.8 °C, a minute later, in the stroke, at 15.0 °C: what at its start?"""
    test = made((Stroke(pause_s=60.0), Stroke(), Stroke()), 50.0, 0.02, 1.0, 3)
    start, _, end = test.spans_s[1]
    for before_C, verdict in ((13.8, "inconclusive"), (15.0, "pass")):
        readings = np.array([start - 60.0, start + 4.0, end + 1.0]), np.array([before_C, 15.0, 15.0])
        assert row(replace(test, readings=readings), "temperature-range", 2).verdict == verdict
