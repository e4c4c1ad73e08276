"""Several specimens in one report: the runs of each, and which of them are of the same step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bufferstand.evaluation.report.content import significant, usable
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.own_parts import own_parts
from bufferstand.evaluation.report.source.predecessor import predecessor_of
from bufferstand.evaluation.report.source.source import EVALUATION_NAME, ReportRun, ReportSource
from bufferstand.evaluation.report.source.step_matching import same_step
from bufferstand.evaluation.wording import ENGLISH, Language, joined, kind_words, said

MOST_SIDES = 26


@dataclass(frozen=True, eq=False)
class ComparedSpecimen:
    """One of the compared: a letter, what it is, and its runs with their numbers in this report."""

    letter: str
    source: ReportSource

    @property
    def name(self) -> str:
        """Specimen and folder, in words."""
        specimen = self.source.common("specimen", "id")
        known = specimen.text if specimen.tone != "missing" else ""
        return said("{known} ({name})", known=known, name=self.source.name) if known else self.source.name


@dataclass(frozen=True, eq=False)
class ComparedSpecimens:
    """What is compared; the first is the reference. ``whole`` holds the runs of all."""

    sides: tuple[ComparedSpecimen, ...]
    whole: ReportSource

    @property
    def evaluations(self) -> dict[str, bytes]:
        """The evaluation of each side as JSON, by the name of the file that the PDF has inside."""
        stem, _, ending = EVALUATION_NAME.rpartition(".")
        return {f"{stem}-{side.letter}.{ending}": side.source.evaluation_json for side in self.sides}


@dataclass(frozen=True, eq=False)
class Condition:
    """One step and the run of each side that is of it (None: it has none)."""

    number: int
    words: str
    runs: tuple[ReportRun | None, ...]


def side_by_side(
    sources: Sequence[ReportSource], fields: ReportFields, language: Language = ENGLISH
) -> ComparedSpecimens:
    """Join sources into one, their runs numbered through.

    Parameters
    ----------
    sources : sequence of Source
        Two or more; the first is the reference.
    fields : ReportFields
        What the laboratory says of the comparison.
    language : Language
        In which the comparison is written.
    """
    sides, numbered = [], 0
    for place, source in enumerate(sources):
        runs = tuple(
            replace(run, number=numbered + n, file=f"{source.name}/{run.file}")
            for n, run in enumerate(source.runs, start=1)
        )
        numbered += len(runs)
        sides.append(ComparedSpecimen(chr(ord("A") + place), replace(source, runs=runs)))
    fields, predecessor = predecessor_of(fields)
    rules = {source.decision_rule for source in sources}
    whole = ReportSource(
        name=joined(" vs ", (source.name for source in sources)),
        runs=tuple(run for side in sides for run in side.source.runs),
        document={
            "schema": "bufferstand/evaluation/1",
            "software": sources[0].document.get("software"),
            "runs": [entry for source in sources for entry in source.document.get("runs") or []],
        },
        fields=fields,
        findings=tuple(
            said("{letter}: {text}", letter=side.letter, text=text)
            for side in sides
            for text in side.source.findings
        ),
        decision_rule=rules.pop() if len(rules) == 1 else None,
        limit_sets=_unique(sources),
        statements=tuple(statement for source in sources for statement in source.statements),
        language=language,
        predecessor=predecessor,
        mark=read_image(fields.mark, "mark", said("Mark of the laboratory")),
        **own_parts(fields),
    )
    return ComparedSpecimens(tuple(sides), whole)


def _unique(sources: Sequence[ReportSource]) -> tuple:  # type: ignore[type-arg]
    by_hash = {limits.sha256: limits for source in sources for limits in source.limit_sets}
    return tuple(by_hash[key] for key in sorted(by_hash))


def conditions_of(sides: ComparedSpecimens) -> list[Condition]:
    """Return the steps that two sides or more have run, in the order of the first of them.

    Each run is of one condition; where a side has run a step several times, the first is taken with the first
    of the others, the second with the second.
    """
    found: list[list[ReportRun | None]] = []
    for place, side in enumerate(sides.sides):
        for run in (part for whole in side.source.runs for part in whole.parts):
            fitting = next((c for c in found if c[place] is None and same_step(_any(c), run)), None)
            if fitting is None:
                fitting = [None] * len(sides.sides)
                found.append(fitting)
            fitting[place] = run
    shared = [runs for runs in found if sum(run is not None for run in runs) > 1]
    return [Condition(n, step_words(_any(runs)), tuple(runs)) for n, runs in enumerate(shared, start=1)]


def alone(sides: ComparedSpecimens, conditions: Sequence[Condition]) -> list[ReportRun]:
    """Return the runs that no other side has a counterpart of."""
    paired = {run.label for condition in conditions for run in condition.runs if run is not None}
    return [part for run in sides.whole.runs for part in run.parts if part.label not in paired]


def _any(runs: Sequence[ReportRun | None]) -> ReportRun:
    return next(run for run in runs if run is not None)


def step_words(run: ReportRun) -> str:
    """Return the step of a run in few words: its kind and speed, or mean ± amplitude and frequency."""
    if run.kind != "harmonic":
        speed = usable(run.result("speed_loading_max_mm_per_s"))
        return kind_words(run.kind) + (
            "" if speed is None else said(", {speed} mm/s", speed=significant(speed, 2))
        )
    parts = [run.nominal(name) for name in ("prestress_mm", "amplitude_mm", "frequency_Hz")]
    mean, half, frequency = ("—" if part is None else significant(part, 3) for part in parts)
    return said("{mean} ± {half} mm, {frequency} Hz", mean=mean, half=half, frequency=frequency)
