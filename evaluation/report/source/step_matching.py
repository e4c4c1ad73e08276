"""When two runs are of the same step; and where they are not, which condition differs, and by how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bufferstand.evaluation.report.content import significant
from bufferstand.evaluation.report.source.source import ReportRun
from bufferstand.evaluation.wording import said


@dataclass(frozen=True)
class StepCondition:
    """A figure that runs of one step have in common, within an absolute or a relative tolerance.

    Parameters
    ----------
    name : str
        Of the figure, with its unit.
    words, unit : str
        As a report says them.
    absolute : float
        Permitted difference in that unit.
    relative : float
        Permitted difference over the greater of both; the larger of the two tolerances holds.
    """

    name: str
    words: str
    unit: str
    absolute: float
    relative: float

    def permitted(self, one: float, two: float) -> float:
        """Return the difference within which two values are the same."""
        return max(self.absolute, self.relative * max(abs(one), abs(two)))


_OF_KIND: dict[str, tuple[StepCondition, ...]] = {
    "harmonic": (
        StepCondition("prestress_mm", said("prestress"), "mm", 2.0, 0.0),
        StepCondition("amplitude_mm", said("amplitude"), "mm", 0.5, 0.05),
        StepCondition("frequency_Hz", said("frequency"), "Hz", 0.0, 0.05),
    ),
    "static": (StepCondition("speed_loading_max_mm_per_s", said("loading speed"), "mm/s", 0.1, 0.10),),
}


@dataclass(frozen=True)
class StepDifference:
    """A condition in which two runs are not of the same step (None: the run does not have it on record)."""

    condition: StepCondition
    one: float | None
    two: float | None

    @property
    def weight(self) -> float:
        """How far apart they are: in multiples of what is permitted; without bound where one is unknown."""
        if self.one is None or self.two is None:
            return float("inf")
        return abs(self.one - self.two) / self.condition.permitted(self.one, self.two)

    def sentence(self, one: str, two: str) -> str:
        """Return it in words, given how the two runs are called."""
        words, unit = self.condition.words, self.condition.unit
        if self.one is None or self.two is None:
            return said(
                "{words} of {one} is not on record", words=words, one=one if self.one is None else two
            )
        apart, permitted = abs(self.one - self.two), self.condition.permitted(self.one, self.two)
        return said(
            "{words} {one} {unit} against {two} {unit}: {apart} {unit} apart, at most {permitted} {unit} "
            "permitted",
            words=words,
            one=significant(self.one, 3),
            unit=unit,
            two=significant(self.two, 3),
            apart=significant(apart, 2),
            permitted=significant(permitted, 2),
        )


def step_differences(one: ReportRun, two: ReportRun) -> tuple[StepDifference, ...]:
    """Return in what two runs of one kind are not of the same step; nothing where they are."""
    found = []
    for condition in _OF_KIND.get(one.kind, ()):
        a, b = one.nominal(condition.name), two.nominal(condition.name)
        apart = StepDifference(condition, a, b)
        if (a is None) != (b is None) or (a is not None and apart.weight > 1.0):
            found.append(apart)
    return tuple(found)


def same_step(one: ReportRun, two: ReportRun) -> bool:
    """Say whether two runs are of the same step."""
    return one.kind == two.kind and not step_differences(one, two)


def nearest_step(run: ReportRun, others: Sequence[ReportRun]) -> ReportRun | None:
    """Return which of others of its kind differs from a run in the fewest conditions, and least; or None."""
    alike = [other for other in others if other.kind == run.kind]

    def distance(other: ReportRun) -> tuple[int, float]:
        apart = step_differences(run, other)
        return len(apart), max((one.weight for one in apart), default=0.0)

    return min(alike, key=distance, default=None)
