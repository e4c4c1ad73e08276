"""The campaign as it was run: of every step what was planned, what was expected last, and what happened.

One line of JSON a step in ``as-run.jsonl`` of the campaign's folder: appended and brought to the disk, so
that a program that is killed leaves all steps before it, and ``resume`` knows the specimen.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from bufferstand.daq.warm_up import WarmUpOutcome
from bufferstand.foundation import BadInput, counted, duration_text
from bufferstand.foundation.files import append_line, json_lines, typed
from bufferstand.protocols.prediction import Observation
from bufferstand.recording.runfile import Run, open_run

AS_RUN_NAME = "as-run.jsonl"
REPORT_HEADER = (
    "step", "name", "duration planned", "measured", "heat kJ planned", "measured",
    "end °C planned", "as learned", "measured",
)  # fmt: skip
"""Columns of :func:`report_rows`; “as learned” is what was expected just before the step."""
NOT_KNOWN = "not known"
MEND = "mend the value, or take the line out: the campaign goes on without what that step has taught"


@dataclass(frozen=True)
class ExpectedOutcome:
    """What is expected of a step.

    Parameters
    ----------
    duration_s : float
        How long it takes [s].
    heat_J : float or None
        Its heat [J]; None where nobody can say.
    end_C : float or None
        The sensor at its end [°C]; None where nobody can say.
    at_most : bool
        Whether it may as well end much sooner: a warm-up of which nobody knows how many cycles it takes.
    """

    duration_s: float
    heat_J: float | None
    end_C: float | None
    at_most: bool = False

    def duration_text(self) -> str:
        """Return how long it takes, as a person says it."""
        return ("at most " if self.at_most else "") + duration_text(self.duration_s)

    def heat_text(self, unit: str = "") -> str:
        """Return its heat in kJ."""
        return NOT_KNOWN if self.heat_J is None else f"{self.heat_J / 1000.0:.1f}{unit}"

    def end_text(self, unit: str = "") -> str:
        """Return the sensor at its end in °C."""
        return NOT_KNOWN if self.end_C is None else f"{self.end_C:.1f}{unit}"


@dataclass(frozen=True)
class AsRun:
    """One step, or one wait between two, as it was run.

    Parameters
    ----------
    index, name, kind, plan_hash
        As in the plan; a pause of the planner's has the number of the step that it waits for.
    pause : bool
        Whether it is a wait that the test itself does not demand.
    run : str
        The run file, relative to the campaign's folder; empty for what is not recorded.
    ended_utc : str
        Civil time (ISO 8601).
    complete : bool
        Whether it came to its end.
    cycles : int
        Full cycles done.
    duration_s : float
        How long it took, in stand time [s].
    start_C, end_C, ambient_C : float or None
        Measured: the warmest specimen sensor, and the air [°C].
    heat_J : float
        Measured: ∮ F ds [J].
    modelled_heat_J : float
        What the model, unscaled, expects of what was done [J].
    planned : Expected or None
        By the plan that the campaign began with; None for what was not in it.
    estimated : Expected
        Just before it began, with all that had been learned by then.
    heating, cooling : float
        The learned factors after it.
    left_s, planned_left_s : float
        How long the rest should take from here, as learned and by the first plan [s].
    warmed : Warmed or None
        How a warm-up went; None for any other step, and for one that was stopped.
    """

    index: int
    name: str
    kind: str
    plan_hash: str
    pause: bool
    run: str
    ended_utc: str
    complete: bool
    cycles: int
    duration_s: float
    start_C: float | None
    end_C: float | None
    ambient_C: float | None
    heat_J: float
    modelled_heat_J: float
    planned: ExpectedOutcome | None
    estimated: ExpectedOutcome
    heating: float
    cooling: float
    left_s: float
    planned_left_s: float
    warmed: WarmUpOutcome | None = None

    def sentence(self) -> str:
        """Return it as a person says it while the campaign runs."""
        end = "" if self.end_C is None else f", {self.end_C:.1f} °C at its end"
        text = f"took {duration_text(self.duration_s)}, {_kilojoules(self.heat_J, 1)} kJ{end}"
        if self.planned is not None:
            planned = self.planned
            heat = "heat not known" if planned.heat_J is None else planned.heat_text(" kJ")
            end = "end not known" if planned.end_C is None else planned.end_text(" °C")
            text += f" (planned: {planned.duration_text()}, {heat}, {end})"
        left = f"; about {duration_text(self.left_s)} left"
        if abs(self.left_s - self.planned_left_s) > 0.05 * self.planned_left_s + 1.0:
            left += f" (by the first plan {duration_text(self.planned_left_s)})"
        return text + left

    def observation(self) -> Observation | None:
        """Return it as something to learn from; None if a temperature is missing."""
        if self.start_C is None or self.end_C is None or self.ambient_C is None or not self.duration_s > 0.0:
            return None
        return Observation(
            self.name,
            self.start_C,
            self.end_C,
            self.ambient_C,
            max(0.0, self.modelled_heat_J),
            self.duration_s,
        )


def add_as_run(folder: Path, row: AsRun) -> None:
    """Append a step to the folder's ``as-run.jsonl`` and bring it to the disk.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    append_line(folder / AS_RUN_NAME, json.dumps(asdict(row), ensure_ascii=False))


def read_as_run(folder: Path) -> tuple[AsRun, ...]:
    """Return the steps of a campaign's folder as they were run; a line that is cut off is left out.

    Raises
    ------
    BadInput
        If the file cannot be read, or a value in a whole line is missing or of another type: with its line.
    """
    path = folder / AS_RUN_NAME
    return tuple(
        typed(AsRun, content, path, place=f"line {number}", remedy=MEND)
        for number, content in json_lines(path)
    )


def rows_in_force(rows: Sequence[AsRun], hashes: Collection[str]) -> tuple[AsRun, ...]:
    """Return the rows of steps that the campaign still has: an edit may have put others in their place.

    Parameters
    ----------
    rows : sequence of AsRun
        Of the campaign's folder, in their order.
    hashes : collection of str
        Plan hashes of its steps, also those that they had before limits or data were edited.
    """
    kept: list[AsRun] = []
    waiting: list[AsRun] = []  # a pause of the planner's belongs to the step that comes after it
    for row in rows:
        if row.pause and row.plan_hash not in hashes:
            waiting.append(row)
            continue
        if row.plan_hash in hashes:
            kept += [*waiting, row]
        waiting = []
    return (*kept, *waiting)


def replaced_sentence(rows: Sequence[AsRun], kept: Sequence[AsRun]) -> str:
    """Return what is said of rows that are not ``kept``: how many steps, how long; empty if none."""
    gone = [row for row in rows if row not in kept]
    steps = sum(not row.pause for row in gone)
    if not gone:
        return ""
    took = duration_text(sum(row.duration_s for row in gone))
    return f"without {counted(steps, 'step')} that edits have replaced ({took})"


def report_rows(rows: Sequence[AsRun]) -> list[tuple[str, ...]]:
    """Return planned against measured, a row a step, in the columns of :data:`REPORT_HEADER`."""
    return [
        (
            "" if row.pause else str(row.index),
            row.name + ("" if row.complete else " (stopped)"),
            "" if row.planned is None else row.planned.duration_text(),
            duration_text(row.duration_s),
            "" if row.planned is None else row.planned.heat_text(),
            f"{row.heat_J / 1000.0:.1f}",
            "" if row.planned is None else row.planned.end_text(),
            row.estimated.end_text(),
            "" if row.end_C is None else f"{row.end_C:.1f}",
        )
        for row in rows
    ]


def observed_run(path: Path, ambient: Collection[str]) -> Observation | None:
    """Return what a recorded run shows of the specimen's heating: for steps that left no line of their own.

    Its heat is the measured one. None where it cannot be had: a damaged file, a sensor without readings.

    Parameters
    ----------
    path : Path
        The run file.
    ambient : collection of str
        Streams of the sensors that do not touch the specimen.
    """
    try:
        run = open_run(path)
        warm = [
            _first_and_last(run, name)
            for name in run.streams
            if _is_temperature(run, name) and name not in ambient
        ]
        air = [_first_and_last(run, name) for name in run.streams if name in ambient]
        force, stroke = run.series("force"), run.series("stroke")
    except BadInput:
        return None
    ends = [pair for pair in warm if pair is not None]
    aired = [pair for pair in air if pair is not None]
    if not ends or not aired or len(force.value) < 2:
        return None
    steps = 0.5 * (force.value[1:] + force.value[:-1]) * np.diff(stroke.value)
    for row, _ in run.gaps(run.stream_of("force").name):
        steps[row] = 0.0
    work_J, duration_s = float(np.nansum(steps)), float(force.time_s[-1] - force.time_s[0])
    if not duration_s > 0.0:
        return None
    start_C, end_C = (max(pair[place] for pair in ends) for place in (0, 1))
    ambient_C = sum(pair[1] for pair in aired) / len(aired)
    return Observation(path.stem, start_C, end_C, ambient_C, max(0.0, work_J), duration_s)


def _is_temperature(run: Run, name: str) -> bool:
    return all(channel.quantity == "temperature" for channel in run.streams[name].channels.values())


def _first_and_last(run: Run, name: str) -> tuple[float, float] | None:
    value = run.series(name).value
    known = [one for one in value.tolist() if math.isfinite(one)]
    return (known[0], known[-1]) if known else None


@dataclass(frozen=True)
class Totals:
    """Planned against measured, over all steps of a campaign that were run.

    Parameters
    ----------
    planned_s, measured_s : float
        Of the steps that came to their end, and of the waits [s].
    planned_wait_s, measured_wait_s : float
        The part of it that is waiting for the specimen to cool.
    planned_heat_J, measured_heat_J : float or None, float
        Of the steps that came to their end; None where nobody could say it of one of them.
    planned_missed_K, learned_missed_K : float or None
        How far the expected temperatures at the steps' ends were from those measured, in the mean: by the
        first plan, and just before each step. None where nothing was measured, or expected.
    planned_at_most : bool
        Whether one of the steps was planned with the most time that it could take.
    """

    planned_s: float
    measured_s: float
    planned_wait_s: float
    measured_wait_s: float
    planned_heat_J: float | None
    measured_heat_J: float
    planned_missed_K: float | None
    learned_missed_K: float | None
    planned_at_most: bool = False

    def sentence(self) -> str:
        """Return them as a person says it."""
        heat = NOT_KNOWN if self.planned_heat_J is None else f"{self.planned_heat_J / 1000.0:.0f} kJ"
        planned = ("at most " if self.planned_at_most else "") + duration_text(self.planned_s)
        text = (
            f"took {duration_text(self.measured_s)} (planned {planned}), of which "
            f"{duration_text(self.measured_wait_s)} waiting to cool (planned "
            f"{duration_text(self.planned_wait_s)}); {_kilojoules(self.measured_heat_J, 0)} kJ of heat "
            f"(planned {heat})"
        )
        if self.planned_missed_K is not None and self.learned_missed_K is not None:
            text += (
                f"; temperatures at the steps' ends missed by {self.planned_missed_K:.1f} K by the plan, by "
                f"{self.learned_missed_K:.1f} K as learned"
            )
        return text


def totals(rows: Sequence[AsRun]) -> Totals:
    """Return planned against measured, over all steps that were run."""
    over = [row for row in rows if row.complete]
    waits = [row for row in over if row.pause or row.kind == "cool-down"]
    known = [row for row in over if row.planned is not None and row.end_C is not None and row not in waits]

    plans = [row.planned for row in over if row.planned is not None]
    heats = [plan.heat_J for plan in plans if plan.heat_J is not None]

    def planned_s(of: Sequence[AsRun]) -> float:
        return float(sum(row.planned.duration_s for row in of if row.planned is not None))

    def missed(name: str) -> float | None:
        ends = [(getattr(row, name).end_C, row.end_C or 0.0) for row in known]
        apart = [abs(expected_C - end_C) for expected_C, end_C in ends if expected_C is not None]
        return sum(apart) / len(apart) if apart else None

    return Totals(
        planned_s(over),
        sum(row.duration_s for row in over),
        planned_s(waits),
        sum(row.duration_s for row in waits),
        sum(heats) if len(heats) == len(plans) else None,
        sum(row.heat_J for row in over),
        missed("planned"),
        missed("estimated"),
        any(plan.at_most for plan in plans),
    )


def _kilojoules(heat_J: float, digits: int) -> str:
    """Return a heat in kJ; noise about none is 0, not −0."""
    return f"{round(heat_J / 1000.0, digits) + 0.0:.{digits}f}"
