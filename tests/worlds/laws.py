"""What must be true of every world, by the truth of its stand: a function a law, its docstring the statement.

Each takes what was lived and returns the breaches that it finds, in words; none if the law is kept.
"""

from __future__ import annotations

import bisect
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from bufferstand.recording.sealing.verification import verify
from tests.daq.run_in_process import COARSE
from tests.worlds.causes import explains
from tests.worlds.life import Lived, Start

ZERO_KN = 2.0
"""Below this the specimen counts as unloaded (SafeStopSettings.zero_force_kN)."""
RELEASE_MM_PER_S = 20.0
MARGIN_S = 2.0
"""Of a watchdog's time: its looks, the actuator's lag (as in tests/two_programs/rules.py)."""
CUT_KN = 5.0
"""The valve may go off under no more: what zero_force_max_kN lets stand at a start."""
OWN_LIMIT = 1.02
"""The controller trips this much above its own force limit (docs/simulated-stand.md)."""
LAG_S = 0.06
"""Of the slowest actuator that is drawn, and of what its valve takes to turn."""
ZERO_ERROR_KN = 1.5
"""Of the force transducer, where nobody touched off, with its noise."""
TIMES_U = 2.0
"""U has a coverage factor of 2: a figure beyond twice U is four standard deviations off."""
FLICKERS = 2.0
"""Noise of the force that falls as 1/f makes, between loading and unloading, a work of its size times the
stroke, which U does not state whole in small loops (docs/worlds.md): twice its deviation is granted."""
Law = Callable[[Lived], Iterator[str]]


def every_end_comes_to_rest(lived: Lived) -> Iterator[str]:
    """After every end the force is below 2 kN and the valve off: at once where the program says that it saw
    it, else within the watchdog's time, the release at 20 mm/s and 2 s."""
    time_s, force_kN = times_of(lived), np.abs(lived.truth["force_kN"])
    for start, until_s in zip(lived.starts, _rests_until(lived), strict=True):
        if start.safe and (start.valve_on or abs(start.force_kN) > ZERO_KN):
            yield (
                f"start {start.number + 1} ended with status {start.status} and a safe stop that it calls "
                f"safe, with {start.force_kN:.1f} kN and the valve {'on' if start.valve_on else 'off'}"
            )
        stated_s = 0.0
        if not start.safe:
            stated_s = lived.watchdog_s + max(start.position_mm, 0.0) / RELEASE_MM_PER_S + MARGIN_S
        from_s = start.ended_s + stated_s
        if from_s >= until_s:
            continue
        after = (time_s > from_s) & (time_s < until_s)
        if np.any(force_kN[after] > ZERO_KN):
            last_s = time_s[after][force_kN[after] > ZERO_KN][-1]
            yield (
                f"start {start.number + 1} ended at {start.ended_s:.2f} s; stated are {stated_s:.1f} s, and "
                f"{force_kN[after].max():.1f} kN were there later, until {last_s - start.ended_s:.1f} s after"
            )
        if _valve_at(lived, from_s):
            yield f"start {start.number + 1}: the valve is on {stated_s:.1f} s after its end"


def valve_never_cuts_a_load(lived: Lived) -> Iterator[str]:
    """The valve never goes off under a load, unless the safe stop says that it saw no safe stand."""
    for at_s, on, force_kN in lived.valve:
        start = _start_at(lived, at_s)
        if not on and abs(force_kN) > CUT_KN and start.safe is not False:
            yield f"start {start.number + 1}: valve off at {at_s:.2f} s under {force_kN:.1f} kN"


def force_stays_explained(lived: Lived) -> Iterator[str]:
    """The true force is never above the trip by more than two round trips, two passes and the actuator's lag
    explain, at the rate at which the force rose."""
    force_kN = lived.truth["force_kN"]
    if not force_kN.size:
        return
    peak = int(np.argmax(force_kN))
    before = force_kN[max(0, peak - 300) : peak + 1]
    rise_kN = float(np.max(before[5:] - before[:-5])) if before.size > 5 else 0.0
    stand = {key: float(lived.world.stand[key]) for key in ("reply_latency_s", "reply_jitter_s")}
    round_trip_s = stand["reply_latency_s"] + 4.0 * stand["reply_jitter_s"]
    explained_s = 2.0 * (round_trip_s + COARSE.pace.tick_s) + LAG_S
    limits = lived.plan.limits
    trip_kN = max(limits.force_trip_kN, OWN_LIMIT * limits.force.value)
    bound_kN = trip_kN + rise_kN / (5.0 * lived.period_s) * explained_s + ZERO_ERROR_KN
    if force_kN[peak] > bound_kN:
        yield (
            f"{force_kN[peak]:.1f} kN at {times_of(lived)[peak]:.2f} s, with a trip at {trip_kN:.1f} kN: "
            f"explained are {bound_kN:.1f} kN"
        )


def nothing_acknowledged_is_lost(lived: Lived) -> Iterator[str]:
    """Every run that a recorder made visible has a file with all samples that it acknowledged; one that was
    closed without a fault has all that it was given."""
    for kept in lived.evidence:
        run = lived.runs.get(kept.run_id)
        if run is None:
            yield f"{kept.run_id} (start {kept.start + 1}, {kept.acknowledged} acknowledged): no run file"
            continue
        rows = run.streams["controller"].rows if "controller" in run.streams else 0
        if rows < kept.acknowledged:
            yield f"{kept.run_id}: {kept.acknowledged - rows} acknowledged samples are lost"
        if run.status in ("complete", "stopped"):
            for stream in kept.given:
                held = run.streams[stream].rows if stream in run.streams else 0
                if held != len(kept.of(stream)[0]):
                    yield f"{kept.run_id}, {stream}: {held} rows of {len(kept.of(stream)[0])} given"


def nothing_is_altered(lived: Lived) -> Iterator[str]:
    """Sequence numbers, time stamps and counts of every run are those that its recorder was given, bit by
    bit, from the first on."""
    for kept in lived.evidence:
        run = lived.runs.get(kept.run_id)
        for name, content in run.streams.items() if run is not None else ():
            if not content.rows:
                continue
            if name not in kept.given:
                yield f"{kept.run_id}, {name}: {content.rows} rows that nobody gave"
                continue
            sequence, stamps, counts = kept.of(name)
            held = content.rows
            if not (
                np.array_equal(content.sequence, sequence[:held])
                and np.array_equal(content.time, stamps[:held])
                and all(
                    values.tobytes() == counts[channel][:held].astype(values.dtype).tobytes()
                    for channel, values in content.counts.items()
                )
            ):
                yield f"{kept.run_id}, {name}: not what was given"


def every_file_is_whole(lived: Lived) -> Iterator[str]:
    """Every run file opens, verifies, and says how it ended; a complete campaign leaves no journal."""
    for path in sorted((lived.out / "runs").glob("*.h5")):
        if path.stem not in lived.runs:
            yield f"{path.name} does not open"
            continue
        for finding in verify(path):
            if finding.level == "fault":
                yield f"{path.name}: {finding.text}"
        if lived.runs[path.stem].status not in ("complete", "stopped", "failed", "recovered"):
            yield f"{path.name}: status {lived.runs[path.stem].status}"
    if lived.starts[-1].status == 0:
        left = [path.name for path in (lived.out / "runs").iterdir() if path.suffix != ".h5"]
        if left:
            yield f"behind a complete campaign there is left: {', '.join(sorted(left))}"


def a_stop_names_its_cause(lived: Lived) -> Iterator[str]:
    """A start that does not complete names one of the troubles that struck in it, with its exit status;
    no trouble, no stop. A fault of the software itself is no reason, unless its memory was taken."""
    for start in lived.starts:
        if start.killed_at or start.status == 0:
            continue
        causes = start.causes
        tight = lived.world.tight is not None
        assert start.status is not None
        if not explains(causes, start.status, start.reason, unsafe=start.safe is not True, tight=tight):
            names = ", ".join(f"{one.name} ({phase})" for one, phase, _ in start.struck) or "nothing"
            yield f"start {start.number + 1} ended with {start.status}: “{start.reason}”, but {names} struck"
        if start.error and "MemoryError" not in start.error:
            yield f"start {start.number + 1}: a bug of the software: {start.error}"


def resume_repeats_nothing(lived: Lived) -> Iterator[str]:
    """A step that was complete at the end of a start stays as it was, run files and all."""
    for before, after in zip(lived.starts, lived.starts[1:], strict=False):
        for key, step in before.complete.items():
            if after.complete.get(key) != step:
                yield f"step “{step['name']}”, complete in start {before.number + 1}, was touched in the next"


def the_last_start_completes(lived: Lived) -> Iterator[str]:
    """A start without any trouble completes the campaign with exit status 0, whatever happened before."""
    last = lived.starts[-1]
    if last.status == 0:
        if len(last.complete) != len(lived.plan.steps):
            yield f"complete, with {len(last.complete)} of {len(lived.plan.steps)} steps"
    elif not last.struck and not last.killed_at and lived.world.tight is None:
        yield f"start {last.number + 1}, without trouble, ended with {last.status}: {last.reason}"


def a_second_program_is_refused(lived: Lived) -> Iterator[str]:
    """Another program that asks for the stand of one that has it is refused."""
    for start in lived.starts:
        if start.second == "it was let":
            yield f"start {start.number + 1}: a second program was let to the stand"


def the_evaluation_tells_the_truth(lived: Lived) -> Iterator[str]:
    """Of every run there is an evaluation; the energy absorbed in each complete cycle of a sound run is the
    work that the specimen kept, within twice its U and what flicker makes, or is missing with a reason."""
    if lived.evaluation_error:
        yield f"no evaluation: {lived.evaluation_error}"
    flicker_kN = float(lived.world.stand["force_flicker_kN"])
    for figure, found, true, expanded, range_mm in figures_of(lived):
        if found is None or expanded is None:
            continue
        if abs(found - true) > TIMES_U * expanded + FLICKERS * flicker_kN * range_mm:
            yield f"{figure}: {found:.5g} ± {expanded:.2g}, in truth {true:.5g}"


def a_report_comes_out(lived: Lived) -> Iterator[str]:
    """Of whatever runs there are a report can be written, and it names the specimen."""
    if lived.report_error:
        yield f"no report: {lived.report_error}"
    elif lived.report and lived.plan.specimen.id not in lived.report:
        yield "the report does not name the specimen"


LAWS: tuple[Law, ...] = (
    every_end_comes_to_rest,
    valve_never_cuts_a_load,
    force_stays_explained,
    nothing_acknowledged_is_lost,
    nothing_is_altered,
    every_file_is_whole,
    a_stop_names_its_cause,
    resume_repeats_nothing,
    the_last_start_completes,
    a_second_program_is_refused,
    the_evaluation_tells_the_truth,
    a_report_comes_out,
)


def broken(lived: Lived) -> tuple[list[str], dict[str, int]]:
    """Return every breach, with its law's name in front, and how many figures were judged and beyond U."""
    found = [f"{law.__name__}: {text}" for law in LAWS for text in law(lived)]
    judged = [
        abs(value - true) > expanded
        for _, value, true, expanded, _ in figures_of(lived)
        if value is not None and expanded is not None
    ]
    return found, {"judged": len(judged), "beyond U": sum(judged)}


# --- what the laws look at ----------------------------------------------------------------------------


def times_of(lived: Lived) -> Any:
    """Return the stand time of every sample of the truth [s]: the device's own clock may be set, or jump."""
    at_s, rows = np.array(lived.marks).T if lived.marks else np.zeros((2, 1))
    return np.interp(np.arange(1, lived.truth["time_us"].size + 1), rows, at_s)


def figures_of(lived: Lived) -> Iterator[tuple[str, float | None, float, float | None, float]]:
    """Yield each figure of each complete cycle of a sound run: name, value, truth, U, range in mm."""
    wrong = _with_wrong_signals(lived)
    for entry in lived.document["runs"] if lived.document is not None else ():
        name = entry["run"]["id"]
        run = lived.runs.get(name)
        if run is None or run.status != "complete" or name in wrong or not run.streams["controller"].rows:
            continue
        first = int(run.streams["controller"].sequence[0])
        begins_us = np.interp(first, lived.truth["sequence"], lived.truth["time_us"])
        for cycle in entry["cycles"]:
            if not cycle["complete"]:
                continue
            at_us = [begins_us + 1e6 * cycle["start_s"], begins_us + 1e6 * cycle["end_s"]]
            figure = "absorbed_energy_J"
            expanded = (cycle.get("expanded_uncertainty") or {}).get(figure)
            true_J = _kept_work_J(lived, at_us)
            range_mm = cycle["stroke_max_mm"] - cycle["stroke_min_mm"]
            yield f"{name}, cycle {cycle['index']}, {figure}", cycle[figure], true_J, expanded, range_mm


def _kept_work_J(lived: Lived, at_us: Sequence[float]) -> float:  # noqa: N802 - the unit keeps its capital
    """Return the work that the specimen kept between two instants; a loop that does not close ends in a
    chord, as it does in the evaluation."""
    work, stroke, force = (
        np.interp(at_us, lived.truth["time_us"], lived.truth[name])
        for name in ("work_J", "stroke_mm", "force_kN")
    )
    return float(work[1] - work[0] - 0.5 * (force[0] + force[1]) * (stroke[1] - stroke[0]))


def _with_wrong_signals(lived: Lived) -> set[str]:
    """Return the runs of starts in which a transducer's signal was wrong: what they show is no truth."""
    starts = {
        start.number
        for start in lived.starts
        for trouble in start.causes
        if trouble.kind == "device" and not trouble.what.startswith(("controller=", "temperature"))
    }
    return {kept.run_id for kept in lived.evidence if kept.start in starts}


def _rests_until(lived: Lived) -> list[float]:
    """Return until when the stand must be at rest behind each start: until the next one switches it on."""
    ends = []
    for following in [*lived.starts[1:], None]:
        if following is None:
            ends.append(float("inf"))
            continue
        on = [at_s for at_s, on, _ in lived.valve if on and at_s >= following.began_s]
        ends.append(on[0] - 0.1 if on else float("inf"))
    return ends


def _valve_at(lived: Lived, at_s: float) -> bool:
    times = [one[0] for one in lived.valve]
    index = bisect.bisect_right(times, at_s) - 1
    return index >= 0 and lived.valve[index][1]


def _start_at(lived: Lived, at_s: float) -> Start:
    index = bisect.bisect_right([one.began_s for one in lived.starts], at_s) - 1
    return lived.starts[max(index, 0)]
