"""Held samples: found with their rate and lateness; converter steps and rests are none."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.evaluation.plausibility.run_view.samples import Samples
from bufferstand.evaluation.plausibility.stuck_channels.held_samples import hold_by_event, hold_of
from tests.evaluation.plausibility.records import Change, Floats, harmonic, of_kind, static


def holding(column: int, rows: float, both: bool = False) -> Change:
    """Return what repeats each value of a column for so many rows (also for parts of rows)."""

    def change(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        at = np.arange(columns[0].size)
        first = np.ceil(np.floor(at / rows) * rows - 1e-9).astype(int)
        changed = [c[first] if n == column or (both and n > 0) else c for n, c in enumerate(columns)]
        return changed[0], changed[1], changed[2]

    return change


@pytest.mark.parametrize("rows", [2, 3, 12, 2.5])
@pytest.mark.parametrize(("column", "channel"), [(1, "stroke"), (2, "force")])
def test_a_slower_channel_written_at_the_faster_rate(rows: float, column: int, channel: str) -> None:
    run = harmonic(holding(column, rows))
    (finding,) = of_kind(run, "held")
    assert (finding.channel, finding.whole_record) == (channel, True)
    assert finding.size == pytest.approx(0.5 * (rows - 1.0) / 500.0, rel=0.02)
    assert f"true rate {500.0 / rows:.4g} Hz" in finding.text
    assert finding.effect == "spoils"  # ωτ / tan δ is 2 % and more


def test_lateness_is_what_it_does_to_the_loop() -> None:
    """The area changes by what the text says, against the loop that is not held."""
    good, run = harmonic(noise=1e-4), harmonic(holding(2, 4), noise=1e-4)
    (finding,) = of_kind(run, "held")
    areas = [r.summary.values["absorbed_energy_J"].value for r in (good, run)]
    assert areas[0] is not None
    assert areas[1] is not None
    stated = float(finding.text.split("W_a changes by up to ")[1].split()[0])
    assert abs(areas[1] / areas[0] - 1.0) == pytest.approx(stated, rel=0.15)


def test_slow_cycles_are_not_spoiled_by_a_short_hold() -> None:
    run = static(holding(2, 3))
    (finding,) = of_kind(run, "held")
    assert finding.effect == "noted"
    assert run.verdict == static().verdict


def test_channels_held_alike_are_late_together() -> None:
    found = of_kind(harmonic(holding(1, 4, both=True)), "held")
    assert {finding.channel for finding in found} == {"force", "stroke"}
    assert {finding.effect for finding in found} == {"noted"}


@pytest.mark.parametrize("speed", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("shape", ["triangle", "sine"])
def test_converter_steps_are_no_hold(shape: str, speed: float) -> None:
    """Slow ramps dwell on each step of a converter for as many rows as on the next."""
    time = np.arange(20_000) / 100.0
    way = np.abs(time * speed % 2.0 - 1.0) if shape == "triangle" else 0.5 + 0.5 * np.sin(time * speed * 3.0)
    for noise in (0.0, 0.2, 1.0):
        read = way * 20.0 + 0.1 * noise * np.random.default_rng(2).standard_normal(time.size)
        assert hold_of(Samples("stroke", time, np.round(read / 0.1) * 0.1)) is None


def _every(rows: int, time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
    return time_s[::rows], stroke[::rows], force[::rows]


def by_event(time_s: Floats, stroke: Floats, force: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the rows that are written when stroke or force changed by 0.2 mm or 1 kN, or after 1 s."""
    rows = [0]
    for row in range(1, time_s.size):
        last = rows[-1]
        changed = abs(stroke[row] - stroke[last]) > 0.2 or abs(force[row] - force[last]) > 1.0
        if changed or time_s[row] - time_s[last] >= 1.0:
            rows.append(row)
    return time_s[rows], stroke[rows], force[rows]


def test_a_held_force_in_a_log_by_event() -> None:
    made = {"rate_Hz": 35.0, "preload_kN": 40.0}
    run = static(lambda *columns: by_event(*holding(2, 11)(*columns)), **made)
    assert run.record.by_event
    (finding,) = of_kind(run, "held")
    assert (finding.channel, finding.effect) == ("force", "spoils")
    assert finding.size == pytest.approx(5.0 / 35.0, rel=0.1)
    plain = static(by_event, **made)
    assert plain.record.by_event
    assert not of_kind(plain, "held")


def test_a_held_stroke_of_constant_speeds_in_a_log_by_event() -> None:
    """In and out at two speeds it changes at the same even times, by unlike amounts: no event does."""

    looks = np.arange(4000)
    x = np.interp(looks % 500, [0.0, 250.0, 430.0, 500.0], [0.0, 40.0, 0.0, 0.0])
    f = 3.0 * x + 0.4 * np.random.default_rng(3).standard_normal(x.size)
    held_stroke = by_event(looks / 40.0, x[looks // 5 * 5], f)
    hold = hold_by_event(Samples("stroke", *held_stroke[:2]))
    assert hold is not None
    assert hold.late_s == pytest.approx(2.0 / 40.0)
    own = x.copy()  # keeps its value till it changed enough
    for row in range(1, x.size):
        own[row] = x[row] if abs(x[row] - own[row - 1]) > 0.65 else own[row - 1]
    assert hold_by_event(Samples("stroke", *by_event(looks / 40.0, own, f)[:2])) is None


@pytest.mark.parametrize(("held_for", "every"), [(3, 2), (4, 3), (6, 5)])
def test_a_held_channel_that_is_written_at_nearly_its_own_rate(held_for: int, every: int) -> None:
    run = harmonic(lambda *columns: _every(every, *holding(2, held_for)(*columns)))
    (finding,) = of_kind(run, "held")
    assert finding.size == pytest.approx(0.5 * (held_for - every) / 500.0, rel=0.02)


def test_values_that_repeat_by_chance_are_no_hold() -> None:
    """As many repeat as of a channel that is held for one and a half rows, but not evenly."""
    rng = np.random.default_rng(5)
    moves = 0.1 + rng.random(6000)
    for share in (0.2, 0.25, 1.0 / 3.0):
        value = np.cumsum(np.where(rng.random(moves.size) < share, 0.0, moves))
        assert hold_of(Samples("force", np.arange(value.size) / 100.0, value)) is None


def test_a_held_force_of_a_logger_that_goes_on_more_slowly() -> None:
    def slows(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = holding(2, 4)(*columns)
        kept = (time_s < 1.2) | (np.arange(time_s.size) % 5 == 0)
        return time_s[kept], stroke[kept], force[kept]

    (finding,) = of_kind(harmonic(slows), "held")
    assert finding.channel == "force"
    assert "repeated in 4 rows (true rate 125 Hz)" in finding.text


def test_a_held_force_of_coarse_steps() -> None:
    """At rest it changes now and then by a step of its converter, always a whole number of holds later."""

    def coarse(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = holding(2, 6)(*columns)
        return time_s, stroke, np.round(force / 1.26) * 1.26

    made = {"rate_Hz": 200.0, "speed_mm_per_s": 40.0, "noise_kN": 0.5, "pause_s": 8.0}
    (finding,) = of_kind(static(coarse, **made), "held")
    assert "repeated in 6 rows" in finding.text
    plain = static(lambda t, x, f: (t, x, np.round(f / 1.26) * 1.26), **made)
    assert not of_kind(plain, "held")


def test_a_held_force_of_a_logger_that_is_slow_at_rest() -> None:
    def slow(*columns: Floats) -> tuple[Floats, Floats, Floats]:
        time_s, stroke, force = holding(2, 6)(*columns)
        moves = np.abs(np.gradient(columns[1])) > 0.1
        kept = moves | (np.arange(time_s.size) % 10 == 0)
        return time_s[kept], stroke[kept], force[kept]

    made = {"rate_Hz": 25.0, "speed_mm_per_s": 12.0, "pause_s": 120.0}
    (finding,) = of_kind(static(slow, **made), "held")
    assert finding.channel == "force"


def test_clean_records_are_not_held() -> None:
    for run in (static(), static(noisy=False), harmonic(), harmonic(noise=0.0)):
        assert not of_kind(run, "held")
