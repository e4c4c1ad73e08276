"""What a report is made from: recorded runs, each with its evaluation, in the order of their start."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from datetime import datetime, timedelta
from functools import cached_property
from math import isfinite
from pathlib import PurePath
from typing import Any

from bufferstand.evaluation.facts import Extreme, not_whole
from bufferstand.evaluation.record import Record
from bufferstand.evaluation.report.content import DASH, Cell, Image, OwnTemplate, moment_of, usable
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.model_answer import ModelAnswer
from bufferstand.evaluation.report.source.own_text import OwnText
from bufferstand.evaluation.report.source.predecessor import Predecessor
from bufferstand.evaluation.requirements import LimitSet
from bufferstand.evaluation.run.extremes import sample_extremes
from bufferstand.evaluation.wording import ENGLISH, Language, joined, said, said_count
from bufferstand.foundation import Kind
from bufferstand.foundation.files import canonical_json
from bufferstand.recording.runfile import simulated_of

NOT_RECORDED = said("not recorded in the run file")
EVALUATION_NAME = "evaluation.json"
"""Name of the evaluation document inside the PDF."""
_OF_EXTREME = tuple(each.name for each in fields(Extreme))


@dataclass(frozen=True, eq=False)
class ReportRun:
    """One run of the report.

    Parameters
    ----------
    number : int
        Its number in the report, from 1.
    file : str
        Name of the run file, without a machine's path.
    sha256 : str
        Hash of the file.
    metadata : mapping
        The run file's metadata document.
    events : tuple of (float or None, str, str)
        Seconds since the start (None where unknown), kind and text of what happened.
    evaluated : mapping
        The run's entry in the evaluation document.
    record : Record or None
        Its samples; None when they cannot be used, and ``problem`` says why.
    problem : str
        Why there are no samples.
    part : int or None
        Number of a step, where this is one of the steps of a run (:attr:`parts`).
    strokes : tuple of mapping
        What was asked, commanded and reached in each cyclic motion (event ``stroke``, docs/run-file.md).
    forces : tuple of mapping
        What was asked and reached in each motion between two forces (event ``force``).
    """

    number: int
    file: str
    sha256: str
    metadata: Mapping[str, Any]
    events: tuple[tuple[float | None, str, str], ...]
    evaluated: Mapping[str, Any]
    record: Record | None
    problem: str = ""
    part: int | None = None
    strokes: tuple[Mapping[str, Any], ...] = ()
    forces: tuple[Mapping[str, Any], ...] = ()
    place: str = ""
    """Where the file is below the folder that is reported on, as the attached evaluation names it."""

    @property
    def label(self) -> str:
        """Its number in the report, and that of the step: ``3``, ``3#2``."""
        return str(self.number) + ("" if self.part is None else f"#{self.part}")

    @property
    def parts(self) -> tuple[ReportRun, ...]:
        """The run itself; or, where its record has several steps, each with its own cycles and results."""
        parts = []
        for step in self.evaluated.get("steps") or ():
            own = [cycle for cycle in self.cycles if cycle["index"] in step["cycles"]]
            parts.append(
                replace(self, part=step["index"], evaluated={**self.evaluated, **step, "cycles": own})
            )
        return tuple(parts) or (self,)

    @property
    def id(self) -> str:
        """The run's id."""
        return str(self.metadata["run"]["id"])

    @property
    def kind(self) -> Kind:
        """Kind of the run."""
        kind: Kind = self.metadata["run"]["kind"]
        return kind

    @property
    def status(self) -> str:
        """How the run ended."""
        return str(self.metadata["run"]["status"])

    @property
    def simulated(self) -> bool | None:
        """Whether it was made on a simulated stand; None where its record does not tell."""
        return simulated_of(self.metadata)

    @property
    def ended_early(self) -> bool:
        """Whether a limit, the operator or a fault ended it."""
        return self.status in {"stopped", "failed"}

    @property
    def reason(self) -> str:
        """Why it ended as it did, without the full stop."""
        return str(self.metadata["run"].get("reason") or "").rstrip(". ") or said("no reason recorded")

    @property
    def cycles(self) -> list[Mapping[str, Any]]:
        """The cycles of the evaluation document."""
        return list(self.evaluated.get("cycles") or [])

    @property
    def cycles_used(self) -> list[int]:
        """Numbers of the cycles that the run's results are from."""
        return [int(index) for index in self.summary.get("cycles_used") or []]

    @property
    def summary(self) -> Mapping[str, Any]:
        """The run's results."""
        return dict(self.evaluated.get("summary") or {})

    @property
    def requirements(self) -> list[Mapping[str, Any]]:
        """Requirements and conditions that were judged."""
        return list(self.evaluated.get("requirements") or [])

    @property
    def characterises(self) -> bool:
        """Whether no statement of conformity rests on it: its rows tell characteristics only."""
        return self.evaluated.get("purpose") == "characterisation"

    @property
    def stated(self) -> list[Mapping[str, Any]]:
        """The requirements that a statement of conformity rests on; none of a characterisation run."""
        return [] if self.characterises else self.requirements

    @property
    def warnings(self) -> list[str]:
        """What the evaluation warns of."""
        return [str(warning) for warning in self.evaluated.get("warnings") or []]

    @property
    def attention(self) -> list[str]:
        """The warnings without what nobody needs to act on (``notes`` of the document), and how it ended."""
        notes = {not_whole(self.status), *(str(text) for text in self.evaluated.get("notes") or ())}
        return [text for text in self.warnings if text not in notes]

    @property
    def started(self) -> datetime | None:
        """When the run began."""
        return moment_of(self.metadata["run"].get("started_utc"))

    @property
    def ended(self) -> datetime | None:
        """When the run ended; from the length of the record where that is all there is."""
        ended = moment_of(self.metadata["run"].get("ended_utc"))
        if ended is None and self.started is not None and self.record is not None:
            return self.started + timedelta(seconds=self.duration_s)
        return ended

    @property
    def duration_s(self) -> float:
        """Length of the record [s]; 0 without one."""
        if self.record is None:
            return 0.0
        return float(self.record.time_s[-1] - min(0.0, self.record.time_s[0]))

    def limit(self, name: str) -> tuple[float | None, str]:
        """Return a limit in force during the run and who set it, or None where none is on record."""
        entry = self.fact("limits", "in_force", name)
        if isinstance(entry, Mapping):
            return usable(entry.get("value")), str(entry.get("source") or "")
        return usable(self.fact("stand", "limits", name)), said("the stand")

    @property
    def temperature_stop_C(self) -> float | None:  # noqa: N802 - the unit's own letter
        """Specimen temperature at which the test is stopped [°C]."""
        stop = self.fact("limits", "test", "temperature_stop_C")
        return usable(stop if stop is not None else self.fact("limits", "temperature_stop_C"))

    def fact(self, *path: str) -> Any:
        """Return what the metadata holds at a path of keys, or None."""
        value: Any = self.metadata
        for key in path:
            value = value.get(key) if isinstance(value, Mapping) else None
        return value

    def nominal(self, name: str) -> float | None:
        """Return what was required of a step (``prestress_mm`` …), or the mean of what was measured.

        Of a run whose record has several steps, each is what was measured.
        """
        required = usable(self.fact("step", name)) if self.part is None else None
        return required if required is not None else self.result(name)

    def result(self, name: str) -> float | None:
        """Return a result of the run: from the summary, or the last cycle used where it has no such entry.

        Never that of a cycle which was not used: it is not representative.
        """
        if name in self.summary:
            entry = self.summary[name]
            return usable(entry.get("value")) if isinstance(entry, Mapping) else usable(entry)
        cycle = self.shown_cycle() if self.cycles_used else None
        return None if cycle is None else usable(cycle.get(name))

    def extreme(self, name: str) -> Extreme | None:
        """Return an extreme of all samples (``force_max_kN`` …), or None where there is none.

        An evaluation document of an earlier version has no extremes: they are the samples' own then.
        """
        known = self.evaluated.get("extremes")
        if isinstance(known, Mapping):
            entry = known.get(name) or {}
            value = usable(entry.get("value"))
            return None if value is None else Extreme(**{key: entry[key] for key in _OF_EXTREME})
        return None if self.record is None else sample_extremes(self.record).get(name)

    def shown_cycle(self) -> Mapping[str, Any] | None:
        """Return the cycle that stands for the run: the last one used, else the last complete one."""
        used = self.cycles_used
        complete = [cycle for cycle in self.cycles if cycle.get("complete")]
        chosen = [cycle for cycle in complete if cycle["index"] in used] or complete
        return chosen[-1] if chosen else None


@dataclass(frozen=True, eq=False)
class ReportSource:
    """Everything that a report is made from.

    Parameters
    ----------
    name : str
        Name of the campaign's folder or of the run file.
    runs : tuple of ReportRun
        In the order of their start.
    document : mapping
        The evaluation document.
    fields : ReportFields
        What the laboratory adds.
    findings : tuple of str
        What was noticed about the files: journals that are not sealed, files that could not be read.
    """

    name: str
    runs: tuple[ReportRun, ...]
    document: Mapping[str, Any]
    fields: ReportFields
    findings: tuple[str, ...] = ()
    decision_rule: str | None = None
    """``simple`` or ``guard-band``; None where the document does not say."""
    limit_sets: tuple[LimitSet, ...] = ()
    """The limit sets that runs were judged by, as far as they are known by more than their hash."""
    modelled: ModelAnswer | None = None
    """A spring model beside the runs, where one was given."""
    statements: tuple[Mapping[str, Any], ...] = ()
    """On which runs each statement of conformity rests (``conformity`` of the document)."""
    earlier: Mapping[str, Any] | None = None
    """An earlier evaluation document of the same runs, to say what moved."""
    predecessor: Predecessor | None = None
    """The report that this one replaces, where its PDF is given."""
    validation: Mapping[str, Any] | None = None
    """The validation record that the laboratory names (:mod:`bufferstand.evaluation.validation`), if any."""
    mark: Image | None = None
    photo: Image | None = None
    """The laboratory's mark, and the photo of the specimen."""
    setup_photo: Image | None = None
    accreditation: Image | None = None
    """The photo of the set-up, and the mark of the laboratory's accreditation."""
    introduction: OwnText | None = None
    appendices: tuple[OwnText, ...] = ()
    """Texts of the laboratory's own."""
    template: OwnTemplate | None = None
    """What it puts in the place of blocks of the shipped templates."""
    language: Language = ENGLISH
    """In which the report is written, with its time zone."""
    detailed: bool = False
    """Whether the annex has the tables by cycle, every budget and the numbers behind the figures, too."""

    @cached_property
    def evaluation(self) -> dict[str, Any]:
        """The evaluation document as the report is made from it: what the PDF has inside.

        It has the runs of this report only, in its order, and names files below the folder that is reported
        on: a machine's paths are nobody's business, and would make other bytes of the same report.
        """
        named = {
            key: [{**entry, "path": PurePath(str(entry.get("path", ""))).name} for entry in entries]
            for key in ("copies", "failures")
            if (entries := self.document.get(key))
        }
        runs = [
            {**run.evaluated, "run": {**run.evaluated["run"], "path": run.place or run.file}}
            for run in self.runs
        ]
        stated = {"conformity": list(self.statements)} if self.statements else {}
        made: dict[str, Any] = _finite({**self.document, "runs": runs, **named, **stated})
        return made

    @cached_property
    def evaluation_json(self) -> bytes:
        """:attr:`evaluation` as canonical JSON: one text, and so one hash, for one evaluation."""
        return canonical_json(self.evaluation).encode()

    def common(self, *path: str) -> Cell:
        """Return a fact of the runs: one value if they agree, else each value with its runs, or a dash."""
        by_value: dict[str, list[int]] = {}
        for run in self.runs:
            value = run.fact(*path)
            by_value.setdefault("" if value is None else str(value), []).append(run.number)
        if set(by_value) == {""}:
            return Cell(DASH, "missing", NOT_RECORDED)
        if len(by_value) == 1:
            return Cell(next(iter(by_value)))
        return Cell(
            joined(
                "; ",
                (
                    said("{what} ({runs})", what=value or DASH, runs=runs_text(of))
                    for value, of in by_value.items()
                ),
            )
        )


def runs_text(numbers: Iterable[int]) -> str:
    """Return ``run 3`` or ``runs 1–4, 7``."""
    ordered = sorted(numbers)
    return said_count("run {numbers}", "runs {numbers}", len(ordered), numbers=numbers_text(ordered))


def numbers_text(numbers: Iterable[int]) -> str:
    """Return the numbers of runs alone: ``1–4, 7``."""
    ordered = sorted(numbers)
    groups: list[list[int]] = []
    for number in ordered:
        if groups and number == groups[-1][-1] + 1:
            groups[-1].append(number)
        else:
            groups.append([number])
    return ", ".join(str(g[0]) if len(g) == 1 else f"{g[0]}–{g[-1]}" for g in groups)


def _finite(content: Any) -> Any:
    """Return JSON content with null for what no number is: a report shows a dash there."""
    if isinstance(content, Mapping):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not isfinite(content) else content
