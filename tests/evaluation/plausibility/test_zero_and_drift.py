"""The force's zero, off or moving, beside what softens, relaxes or rests on the cell."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.plausibility.run_view.cycle_series import CycleSeries
from bufferstand.evaluation.plausibility.zero_and_drift.drift import SURE, _pace
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static
from tests.evaluation.signals import STATED
from tests.evaluation.stepped import Block, columns


def free(extra_kN: Callable[[Floats], Floats] | None = None) -> Callable[..., object]:
    """Return what lets a test begin 2 mm before contact, where no force is, and adds to the force."""

    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        met = np.where(stroke < 2.0, force - 15.0 - 2.0 * stroke, force)
        return time_s, stroke - 2.0, met + (0.0 if extra_kN is None else extra_kN(time_s))

    return change


@pytest.mark.parametrize("off_kN", [-20.0, -4.0, 4.0, 20.0])
def test_zero_off_before_contact(off_kN: float) -> None:
    run = static(free(lambda t: np.full_like(t, off_kN)))  # type: ignore[arg-type]
    (found,) = of_kind(run, "zero")
    assert found.size == pytest.approx(off_kN, abs=0.3)
    assert found.channel == "force"
    assert run.verdict == "inconclusive"


@pytest.mark.parametrize("off_kN", [-0.3, 0.0, 0.3, 1.5])
def test_a_zero_within_its_limit_or_what_a_cell_returns_to_is_none(off_kN: float) -> None:
    """0.3 kN are stated; 0.3 % of the range are 1.8 kN."""
    run = static(free(lambda t: np.full_like(t, off_kN)))  # type: ignore[arg-type]
    assert not of_kind(run, "zero")
    assert not of_kind(run, "drift")


def test_a_preload_at_first_contact_is_no_zero() -> None:
    assert not of_kind(static(), "zero")


def test_where_no_zero_is_stated_half_a_per_cent_is_allowed() -> None:
    for off_kN, count in ((2.5, 0), (4.0, 1)):  # of 600 kN
        run = static(free(lambda t, off_kN=off_kN: np.full_like(t, off_kN)), stated=False)  # type: ignore[misc]
        assert len(of_kind(run, "zero")) == count


@pytest.mark.parametrize("off_kN", [-15.0, 15.0])
def test_a_zero_is_named_beside_a_turned_stroke(off_kN: float) -> None:
    def turned(t: Floats, x: Floats, f: Floats, off_kN: float = off_kN) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = free(lambda t: np.full_like(t, off_kN))(t, x, f)  # type: ignore[misc]
        return time_s, -stroke, force

    assert {finding.kind for finding in static(turned).findings} == {"sign", "zero"}
    right = static(lambda *columns: turned(*columns, off_kN=0.0))
    assert {finding.kind for finding in right.findings} == {"sign"}


@pytest.mark.parametrize("share", [-0.04, 0.04, 0.12])
def test_drift_between_the_rests_of_a_static_test(share: float) -> None:
    run = static(lambda t, x, f: (t, x, f + share * np.ptp(f) * t / t[-1]))
    (found,) = of_kind(run, "drift")
    assert found.whole_record
    assert found.size is not None
    assert np.sign(found.size) == np.sign(share)
    assert not of_kind(run, "offset-jump")


Both = Callable[[Floats, Floats, Floats], tuple[Floats, Floats, Floats]]
BESIDE: dict[str, tuple[str, Both]] = {
    "a wire that slips": ("stroke-jump", lambda t, x, f: (t, x + 8.0 * (t >= 60.3), f)),
    "a wire that slips back": ("stroke-jump", lambda t, x, f: (t, x - 8.0 * (t >= 60.3), f)),
    "an offset that jumps": ("gain-jump", lambda t, x, f: (t, x, f - 30.0 * (t >= 62.0))),
    "metres": ("unit", lambda t, x, f: (t, 0.001 * x, f)),
    "newtons": ("unit", lambda t, x, f: (t, x, 1000.0 * f)),
}


@pytest.mark.parametrize("other", BESIDE)
def test_a_drift_is_named_beside_another_fault(other: str) -> None:
    kind, change = BESIDE[other]
    run = static(lambda t, x, f: change(t, x, f + 0.1 * np.ptp(f) * t / t[-1]))
    kinds = {finding.kind for finding in run.findings}
    assert "drift" in kinds
    assert kind in kinds
    assert "drift" not in {finding.kind for finding in static(change).findings}


@pytest.mark.parametrize("other", ["a wire that slips", "newtons"])
def test_a_zero_is_named_beside_another_fault(other: str) -> None:
    kind, change = BESIDE[other]
    off = static(lambda *columns: change(*free(lambda t: np.full_like(t, 20.0))(*columns)))  # type: ignore[misc]
    assert {finding.kind for finding in off.findings} == {"zero", kind}
    right = static(lambda *columns: change(*free()(*columns)))  # type: ignore[misc]
    assert "zero" not in {finding.kind for finding in right.findings}


def released(change: Both, *, drift: float, jump_kN: float = 0.0) -> Both:
    """Return what moves the force of a test that begins 2 mm before contact, and then changes it."""

    def made(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        moved = drift * np.ptp(f) * t / t[-1] + jump_kN * (t >= 62.0)
        return change(*free(lambda _: moved)(t, x, f))  # type: ignore[misc]

    return made


@pytest.mark.parametrize("drift", [-0.1, 0.1])
def test_a_drift_and_a_jump_are_named_beside_each_other(drift: float) -> None:
    """The force is switched in a hole of the record, at rest."""

    def slowly(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        keep = (t < 60.0) | (t > 64.0)
        return t[keep], x[keep], f[keep]

    run = static(released(slowly, drift=drift, jump_kN=120.0))
    (drifts,), (jump,) = of_kind(run, "drift"), of_kind(run, "offset-jump")
    assert drifts.size is not None
    assert drifts.size == pytest.approx(0.67 * drift * 600.0, rel=0.1)  # without what it did from 46 to 93 s
    assert jump.start_s < 62.0 < jump.end_s
    assert not of_kind(static(released(slowly, drift=0.0, jump_kN=120.0)), "drift")


TURNED: dict[str, Both] = {
    "stroke": lambda t, x, f: (t, -x, f),
    "force": lambda t, x, f: (t, x, -f),
}


@pytest.mark.parametrize("drift", [-0.1, 0.1])
@pytest.mark.parametrize("turned", TURNED)
def test_a_drift_is_named_beside_a_turned_sign(turned: str, drift: float) -> None:
    run = static(released(TURNED[turned], drift=drift))
    (found,) = of_kind(run, "drift")
    assert found.size is not None
    assert np.sign(found.size) == (-np.sign(drift) if turned == "force" else np.sign(drift))
    assert {finding.kind for finding in static(released(TURNED[turned], drift=0.0)).findings} == {"sign"}


@pytest.mark.parametrize("other", ["metres", "an offset that jumps", "newtons"])
def test_a_drift_is_named_beside_a_jump_and_another_fault(other: str) -> None:
    """A preload that is met at another force every time looks like a jump, too: both are told."""
    _, change = BESIDE[other]
    run = static(lambda t, x, f: change(t, -x, f + np.ptp(f) * (0.1 * t / t[-1] - 0.08 * (t >= 62.0))))
    assert {"sign", "drift"} <= {finding.kind for finding in run.findings}


def test_an_offset_that_jumps_in_the_first_stroke_is_named_beside_a_turned_stroke() -> None:
    """Its rests before the first stroke and behind the last one are no turns of its cycles."""
    run = static(released(lambda t, x, f: (t, -x, f - 40.0 * (t >= 12.0)), drift=0.0), cycles=2)
    kinds = [finding.kind for finding in run.findings]
    assert kinds[0] == "sign"
    assert set(kinds) & {"offset-jump", "gain-jump"}


def test_a_drift_is_named_of_a_force_that_is_held() -> None:
    """Two of three rows repeat the one before in every rest: nothing is frozen there."""

    def held(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        drifting = f + 0.1 * np.ptp(f) * t / t[-1]
        return t, x, np.repeat(drifting[::3], 3)[: t.size]

    assert {finding.kind for finding in static(held).findings} == {"held", "drift"}


def test_a_drift_is_named_where_the_record_begins_with_the_motion() -> None:
    """Of two strokes two rests are on record, both behind a stroke."""

    def begun(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        drifting = f + 0.1 * np.ptp(f) * t / t[-1]
        return t[t > 2.0], x[t > 2.0], drifting[t > 2.0]

    assert len(of_kind(static(begun, cycles=2), "drift")) == 1


@pytest.mark.parametrize("share", [-0.05, -0.04, 0.04, 0.12])
def test_drift_of_loops(share: float) -> None:
    run = harmonic(lambda t, x, f: (t, x, f + share * np.ptp(f) * t / t[-1]), cycles=8.2)
    (found,) = of_kind(run, "drift")
    assert found.size == pytest.approx(share * 162.0, rel=0.05)
    assert run.unfit


@pytest.mark.parametrize("softer", [0.05, 0.2])
def test_softening_by_heat_is_no_drift(softer: float) -> None:
    run = harmonic(lambda t, x, f: (t, x, f * (1.0 - softer * t / t[-1])), cycles=10.2)
    assert not of_kind(run, "drift")
    assert not of_kind(run, "gain-jump")


def test_relaxation_under_prestress_is_no_drift() -> None:
    run = harmonic(lambda t, x, f: (t, x, f + 10.0 * np.exp(-t / 2.0)), cycles=10.2)
    assert not of_kind(run, "drift")
    assert not of_kind(run, "offset-jump")


@pytest.mark.parametrize("mm_per_cycle", [-0.3, 0.2])
def test_a_stroke_whose_middle_moves_is_no_drift_of_the_force(mm_per_cycle: float) -> None:
    """The force goes with it; only what a drift adds to that is one."""

    def moved(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        return t, x + mm_per_cycle * t, f + 4.0 * mm_per_cycle * t

    def drifting(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        t, x, f = moved(t, x, f)
        return t, x, f + np.sign(mm_per_cycle) * 0.08 * 162.0 * t / t[-1]

    assert not of_kind(harmonic(moved, cycles=8.2), "drift")
    assert of_kind(harmonic(drifting, cycles=8.2), "drift")


@pytest.mark.parametrize("cycles", [4, 6, 9])
def test_the_scatter_of_a_few_cycles_is_no_drift(cycles: int) -> None:
    """Noise alone looked like a drift in up to one run of fifty of four cycles each."""
    random = np.random.default_rng(5)
    start_s = np.arange(cycles) / 2.55
    others = [np.full(cycles, figure) for figure in (1.0, 0.0, 20.0, 45.0, 10.0)]
    told = 0
    for _ in range(1000):
        levels = [end_kN + 0.2 * random.standard_normal(cycles) for end_kN in (81.0, 166.0)]
        series = CycleSeries(np.arange(cycles), start_s, start_s + 1 / 2.55, *levels, *others)
        pace = _pace(series)
        told += abs(pace.moved_kN) > pace.within(SURE)
    assert told <= 3  # 3.5 standard deviations of a normal distribution: one in two thousand


def test_what_slows_down_from_step_to_step_is_no_drift() -> None:
    """A zero that drifts does not know of steps; an elastomer under its prestress settles all the time."""

    def settles(pace: Sequence[float]) -> tuple[Floats, Floats, Floats]:
        t, x, f = columns([Block(), Block(frequency_Hz=1.5), Block(frequency_Hz=2.0)], noise=0.002)
        knots = np.array([0.0, t[-1] / 2.1, t[-1] / 1.3, t[-1]])
        return t, x, f + np.interp(t, knots, np.concatenate(([0.0], np.cumsum(pace * np.diff(knots)))))

    facts = RunFacts("h", "harmonic", **STATED)  # type: ignore[arg-type]
    for pace, drifts in (([-1.2, -1.2, -1.2], True), ([-1.8, -0.6, -0.4], False)):
        run = evaluate_run(make_record(*settles(pace)), facts, Options(draws=0))
        assert len(run.steps) == 3
        assert bool(of_kind(run, "drift")) == drifts


def test_drift_within_the_stated_zero_is_none() -> None:
    run = static(lambda t, x, f: (t, x, f + 0.3 * t / t[-1]))
    assert not of_kind(run, "drift")


@pytest.mark.parametrize(
    ("change", "drifts"),
    [
        (lambda t, x, f: (t, x, 1e6 * f), False),  # whether it is within the stated zero is not known
        (lambda t, x, f: (t, x, -f), True),
    ],
)
def test_drift_of_loops_beside_a_wrong_unit_or_sign(change: Both, drifts: bool) -> None:
    run = harmonic(lambda t, x, f: change(t, x, f + 0.1 * np.ptp(f) * t / t[-1]), cycles=9.2)
    kinds = {finding.kind for finding in run.findings}
    assert kinds & {"unit", "sign"}
    assert ("drift" in kinds) == drifts
