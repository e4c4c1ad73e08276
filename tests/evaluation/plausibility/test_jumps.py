"""Jumps are found at the smallest size that matters, and what a specimen or a motion makes is none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.plausibility.affected_figures import read_from
from bufferstand.evaluation.record.record import Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.evaluation.plausibility.records import Floats, harmonic, of_kind, static
from tests.evaluation.signals import STATED, StaticTest
from tests.evaluation.stepped import Block, columns

JUMPS = ("stroke-jump", "gain-jump", "offset-jump")
Made = Callable[..., RunEvaluation]


def jumps(run: RunEvaluation) -> list[tuple[str, str]]:
    return [(found.kind, found.channel) for found in run.findings if found.kind in JUMPS]


def from_on(at_s: float, column: int, *, gain: float = 1.0, offset: float = 0.0) -> Callable[..., object]:
    """Return what changes a column from a moment on: by a factor, or by a share of its span."""

    def change(*columns: Floats) -> tuple[Floats, ...]:
        values = columns[column]
        changed = np.where(columns[0] >= at_s, gain * values + offset * np.ptp(values), values)
        return tuple(changed if n == column else c for n, c in enumerate(columns))

    return change


@pytest.mark.parametrize("share", [-0.12, -0.04, 0.04, 0.12])
@pytest.mark.parametrize("at_s", [55.0, 60.3, 63.0])
def test_a_wire_that_slips(at_s: float, share: float) -> None:
    run = static(from_on(at_s, 1, offset=share))  # type: ignore[arg-type]
    assert jumps(run) == [("stroke-jump", "stroke")]
    (found,) = run.findings
    assert found.start_s == pytest.approx(at_s, abs=0.05)
    assert found.size == pytest.approx(share * 102.0, rel=0.05)
    assert 1 not in found.cycles
    assert [cycle.cycle.index for cycle in run.cycles] == [1, 2, 3]  # a jump is no turn of the motion
    read = [row.verdict for row in run.requirements if row.cycle == 3 and "stroke" in read_from(row.id)]
    assert read
    assert set(read) == {"inconclusive"}


@pytest.mark.parametrize("share", [-0.04, 0.04])
@pytest.mark.parametrize("rate_Hz", [100.0, 500.0])
def test_a_wire_that_slips_while_it_swings(rate_Hz: float, share: float) -> None:
    run = harmonic(from_on(3.3, 1, offset=share), rate_Hz=rate_Hz)  # type: ignore[arg-type]
    assert jumps(run) == [("stroke-jump", "stroke")]
    assert len(run.cycles) == len(harmonic(rate_Hz=rate_Hz).cycles)


@pytest.mark.parametrize(("slips_mm", "count"), [(2.4, 1), (0.0, 0)])
def test_a_wire_that_slips_amid_noise(slips_mm: float, count: int) -> None:
    """Twice what noise makes of its largest leaps in 9000 samples, but less than three times."""

    def change(t: Floats, x: Floats, f: Floats) -> tuple[Floats, Floats, Floats]:
        noise = 0.1 * np.random.default_rng(4).standard_normal(t.size)
        return t, x + noise + slips_mm * (t > 33.3), f

    run = harmonic(change, rate_Hz=150.0, cycles=60.2, amplitude_mm=7.0)
    assert jumps(run) == [("stroke-jump", "stroke")] * count


@pytest.mark.parametrize(
    ("column", "gain", "kind"), [(1, 0.001, "unit"), (1, -1.0, "sign"), (2, -1.0, "sign")]
)
def test_a_wire_that_slips_is_named_beside_a_wrong_unit_or_sign(column: int, gain: float, kind: str) -> None:
    slips, wrong = from_on(60.3, 1, offset=0.08), from_on(0.0, column, gain=gain)
    run = static(lambda *columns: wrong(*slips(*columns)))  # type: ignore[misc]
    assert ("stroke-jump", "stroke") in jumps(run)
    assert kind in {found.kind for found in run.findings}


@pytest.mark.parametrize("gain", [0.95, 1.05])
@pytest.mark.parametrize("at_s", [57.0, 62.0, 75.0])
def test_an_amplifier_that_is_switched_under_load(at_s: float, gain: float) -> None:
    run = static(from_on(at_s, 2, gain=gain))  # type: ignore[arg-type]
    assert jumps(run) == [("gain-jump", "force")]
    (found,) = (one for one in run.findings if one.kind == "gain-jump")
    assert found.start_s == pytest.approx(at_s, abs=0.05)
    assert found.cycles == (1, 2, 3)
    assert run.verdict == "inconclusive"


@pytest.mark.parametrize("share", [-0.05, 0.05])
@pytest.mark.parametrize("at_s", [45.5, 57.0, 75.0, 89.0])
def test_a_plug_that_is_loose(at_s: float, share: float) -> None:
    """Also at rest, at 45.5 and 89 s, where the stroke stands still."""
    run = static(from_on(at_s, 2, offset=share))  # type: ignore[arg-type]
    assert len(jumps(run)) == 1
    assert jumps(run)[0][1] == "force"


@pytest.mark.parametrize("at_s", [3.1, 3.34, 3.6])
@pytest.mark.parametrize(("gain", "offset"), [(1.06, 0.0), (0.94, 0.0), (1.0, 0.05), (1.0, -0.05)])
def test_harmonic_forces_that_jump(at_s: float, gain: float, offset: float) -> None:
    run = harmonic(from_on(at_s, 2, gain=gain, offset=offset))  # type: ignore[arg-type]
    assert jumps(run) in ([("gain-jump", "force")], [("offset-jump", "force")])


def test_a_gain_that_changes_between_two_strokes() -> None:
    run = static(from_on(89.0, 2, gain=1.06), preload_kN=0.0)  # type: ignore[arg-type]
    assert jumps(run) == [("gain-jump", "force")]
    assert "between cycles 2 and 3" in next(f.text for f in run.findings if f.kind == "gain-jump")


@pytest.mark.parametrize("softer", [0.02, 0.05, 0.10])
def test_softening_is_none(softer: float) -> None:
    def change(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        path = np.cumsum(np.abs(np.diff(np.interp(time_s, time_s, stroke), prepend=stroke[0])))
        smooth = np.where(path > 0.0, path, 0.0)
        return time_s, stroke, force * (1.0 + softer * np.exp(-smooth / 250.0))

    assert not jumps(static(change, noise_mm=0.002))


@pytest.mark.parametrize("warmer_K", [0.0, 10.0])
def test_a_stroke_that_is_softer_is_none_where_it_is_warmer(warmer_K: float) -> None:
    made = StaticTest(cycles=4)
    record = made.record()
    late = record.time_s > 137.0
    warm = Temperature("t", record.time_s, np.where(late, 20.0 + warmer_K, 20.0))
    force = np.where(late, 0.9 * record.force_kN, record.force_kN)
    changed = make_record(record.time_s, record.stroke_mm, force, temperatures=(warm,))
    run = evaluate_run(changed, made.facts(), Options(draws=0))
    assert bool(jumps(run)) == (warmer_K == 0.0)


@pytest.mark.parametrize("rate_Hz", [20.0, 100.0, 400.0])
@pytest.mark.parametrize("preload_kN", [0.0, 50.0])
def test_a_preload_that_is_met_in_one_step_is_none(rate_Hz: float, preload_kN: float) -> None:
    def met(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, stroke - 1.5, np.where(stroke < 1.5, 0.0, force)

    assert not jumps(static(met, preload_kN=preload_kN, rate_Hz=rate_Hz))


def test_friction_that_turns_in_one_step_is_none() -> None:
    def ring(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        rises = np.gradient(stroke, time_s) >= 0.0
        return time_s, stroke, np.where(rises, 4.0, 1.7) * stroke

    assert not jumps(static(ring, noisy=False))
    assert not jumps(harmonic(ring, noise=0.0))


@pytest.mark.parametrize("share", [0.01, 0.04])
def test_stick_and_slip_is_none(share: float) -> None:
    """The force of a spring whose rings stick falls by a share of it again and again while it is loaded."""

    def sawtooth(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        phase = np.random.default_rng(5).uniform(0.0, 1.0, 4)[(time_s // 43.0).astype(int) % 4]
        teeth = (stroke / 4.0 + phase) % 1.0
        return time_s, stroke, force * (1.0 + share * (teeth - 0.5))

    assert not jumps(static(sawtooth, noise_mm=0.001))


def test_a_corner_of_the_motion_is_none() -> None:
    def triangle(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
        return time_s, 50.0 + 20.0 * (2.0 * np.abs(2.0 * ((time_s + 0.1) % 1.0) - 1.0) - 1.0), force

    assert not jumps(harmonic(triangle, rate_Hz=60.0, noise=0.0))


@pytest.mark.parametrize("slips_mm", [0.0, -3.0])
def test_a_machine_that_goes_fast_from_step_to_step_is_no_wire_that_slips(slips_mm: float) -> None:
    """The force goes along with it; a wire moves no specimen."""
    steps = [Block(12.0, 0.05, 70.0, 4), Block(8.0, 0.05, 58.0, 4)]
    time, stroke, force = columns(steps, rate_Hz=12.0, ramp_s=0.3, noise=0.002)
    stroke = stroke + np.where(time > 0.37 * time[-1], slips_mm, 0.0)
    facts = RunFacts("h", "harmonic", **STATED)  # type: ignore[arg-type]
    run = evaluate_run(make_record(time, stroke, force), facts, Options(draws=0))
    found = [finding.size for finding in of_kind(run, "stroke-jump")]
    assert found == pytest.approx([slips_mm] if slips_mm else [], abs=0.05)
