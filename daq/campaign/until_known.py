"""Going on in rounds until a figure is known: `run --until 'u(damping) < 0.002'`.

A campaign is planned as so many rounds of its steps as it may take at most, so that limits, guards, heat and
disk are judged for all of them before anything moves. After each round the runs are evaluated. The mean of a
step's runs has the uncertainty of `across_runs`: errors of the channels are common to all of them and stay,
noise and what the rounds scatter by falls with their number (JCGM 100, 5.2.2 and 4.2.3).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from bufferstand.foundation import BadInput, duration_text
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.steps import PlannedStep

ROUNDS, MOST_ROUNDS = 5, 50
"""So many rounds at most unless said otherwise, and no more than the second."""
HOURS, MOST_HOURS = 8.0, 72.0
"""So long at most by the plan unless said otherwise, and no longer than the second [h]."""
FORM = "u(damping) < 0.002"
_COVERAGE = {"u": 1.0, "U": 2.0}
_LEAST_SCATTER = 3
"""What rounds scatter by counts from so many on."""
_GOAL = re.compile(r"\s*(?P<kind>[uU])\s*\(\s*(?P<name>\w+)\s*\)\s*<\s*(?P<value>[0-9][0-9.eE+-]*)\s*$")

End = Literal["", "known", "cannot", "rounds", "time"]


@dataclass(frozen=True)
class UntilKnown:
    """What is to be known, and how far a campaign may go for it.

    Parameters
    ----------
    text : str
        As asked: ``u(NAME) < VALUE`` is a standard, ``U(NAME) < VALUE`` an expanded uncertainty (k = 2).
    quantity : str
        Of the evaluation's catalogue, in its unit.
    standard_uncertainty : float
        That the mean of every step's runs is to fall below.
    most_rounds : int
    longest_h : float
        By the plan [h].
    """

    text: str
    quantity: str
    standard_uncertainty: float
    most_rounds: int = ROUNDS
    longest_h: float = HOURS

    @classmethod
    def parsed(cls, text: str, most_rounds: int = ROUNDS, longest_h: float = HOURS) -> UntilKnown:
        """Read a goal.

        Raises
        ------
        BadInput
            If it is none: it says where, and what there is.
        """
        from bufferstand.evaluation.catalogue import QUANTITIES  # noqa: PLC0415 - takes a moment to load

        found = _GOAL.match(text)
        if found is None:
            raise BadInput(
                f"“{text}” is no goal: {_where(text)}", file="--until", remedy=f"write it as in “{FORM}”"
            )
        name, value = found["name"], _number(found["value"])
        if name not in QUANTITIES.names:
            raise BadInput(
                f"there is no quantity “{name}”",
                file="--until",
                place=f"character {found.start('name') + 1}",
                remedy=f"use one of {', '.join(QUANTITIES.names)}",
            )
        if value is None or not 0.0 < value < math.inf:
            raise BadInput(
                f"an uncertainty cannot be {found['value']}", file="--until",
                place=f"character {found.start('value') + 1}", remedy="write a number above 0",
            )  # fmt: skip
        return cls(text.strip(), name, value / _COVERAGE[found["kind"]], most_rounds, longest_h)

    def as_dict(self) -> dict[str, Any]:
        """Return it as data, for ``campaign.json``."""
        return asdict(self)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _where(text: str) -> str:
    """Return the place up to which a goal was understood."""
    parts = (r"\s*[uU]", r"\s*\(", r"\s*\w+", r"\s*\)", r"\s*<", r"\s*[0-9][0-9.eE+-]*", r"\s*$")
    expected = ("u or U", "“(”", "a quantity", "“)”", "“<”", "a number", "its end")
    at = 0
    for part, what in zip(parts, expected, strict=True):
        found = re.compile(part).match(text, at)
        if found is None:
            return f"{what} is missing at character {at + 1}"
        at = found.end()
    return "it was not understood"


@dataclass(frozen=True)
class KnownFigure:
    """The mean of a step's runs so far.

    Attributes
    ----------
    step : str
        Name of the step.
    runs : int
    value : float
    u : float
        Standard uncertainty of the mean.
    shared_u : float
        What of that no further round lowers.
    """

    step: str
    runs: int
    value: float
    u: float
    shared_u: float

    def rounds_for(self, u: float) -> float:
        """Return how many runs would bring the uncertainty to u; infinite if none would."""
        left = u**2 - self.shared_u**2
        return math.inf if left <= 0.0 else self.runs * max(self.u**2 - self.shared_u**2, 0.0) / left


def mean_of(step: str, runs: Sequence[Any], quantity: str) -> KnownFigure | None:
    """Return the mean of a quantity over evaluated runs of one step; None where one of them lacks it.

    Parameters
    ----------
    step : str
        Its name.
    runs : sequence of RunEvaluation
    quantity : str
    """
    from bufferstand.evaluation.across_runs import Figures, figure_of  # noqa: PLC0415 - takes a moment

    figures = [figure_of(run, quantity) for run in runs]
    known = [one for one in figures if one is not None]
    if not known or len(known) < len(figures):
        return None
    joined = Figures.of(known)
    count = len(known)
    weights = np.full(count, 1.0 / count)
    shared_u = joined.weighted(weights, own=False).u
    own = float(np.sum((weights * joined.own_u) ** 2))
    if count >= _LEAST_SCATTER:
        own = max(own, float(np.var(joined.value, ddof=1)) / count)
    return KnownFigure(
        step, count, float(np.mean(joined.value)), math.hypot(math.sqrt(own), shared_u), shared_u
    )


@dataclass
class Rounds:
    """The rounds of a campaign that goes on until something is known.

    Parameters
    ----------
    plan : Plan
        Of all rounds.
    until : UntilKnown
    runs_of : callable
        Run files of a step, complete ones.
    """

    plan: Plan
    until: UntilKnown
    runs_of: Callable[[PlannedStep], Sequence[Path]]
    end: End = ""
    sentence: str = ""
    known: tuple[KnownFigure, ...] = ()
    judged: list[dict[str, Any]] = field(default_factory=list)
    _evaluated: dict[Path, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.plan.campaign.content.step) // self.until.most_rounds
        self._rounds: list[list[PlannedStep]] = [[] for _ in range(self.until.most_rounds)]
        for step, request in zip(self.plan.steps, self.plan.requests, strict=True):
            self._rounds[(request.number - 1) // count].append(step)
        self._first = {steps[0].plan_hash: number for number, steps in enumerate(self._rounds) if number}

    def go_on(self, before: Mapping[str, Any]) -> None:
        """Take what an earlier start has judged: what has ended stays so."""
        self.judged = list(before.get("judged", ()))
        self.end, self.sentence = before.get("end", ""), before.get("sentence", "")

    def done_before(self, step: PlannedStep) -> int | None:
        """Return how many rounds are through where a step begins another one; None elsewhere."""
        return self._first.get(step.plan_hash)

    def judge(self, done: int) -> None:
        """Evaluate the first rounds, and say whether it goes on."""
        rows = zip(*self._rounds[:done], strict=True)
        figures, lacking = [], ""
        for same in rows:
            paths = [path for step in same for path in self.runs_of(step)]
            runs = [self._evaluation(path) for path in paths]
            runs = [run for run in runs if run is not None]
            mean = mean_of(same[0].name, runs, self.until.quantity)
            if mean is not None:
                figures.append(mean)
            elif runs:
                lacking = lacking or f"“{same[0].name}” gives no {self.until.quantity} with an uncertainty"
        self.known = tuple(figures)
        self.end, self.sentence = self._ended(done, lacking)
        self.judged.append({"rounds": done, "figures": [asdict(one) for one in figures], "end": self.end})

    def _ended(self, done: int, lacking: str) -> tuple[End, str]:
        asked, goal = self.until.standard_uncertainty, self.until.text
        if not self.known:
            why = lacking or f"no step records a run that gives {self.until.quantity}"
            return "cannot", f"{goal} cannot be known: {why}"
        worst = max(self.known, key=_u)
        state = (
            f"after {done} round{'s' * (done > 1)} u({self.until.quantity}) = {worst.u:.2g} "
            f"(“{worst.step}”, the largest of {len(self.known)})"
        )
        if worst.u < asked:
            return "known", f"{goal} is known: {state}"
        bound = max(self.known, key=_shared_u)
        if bound.shared_u >= asked:
            return "cannot", (
                f"{goal} cannot be known by going on: {state}; {bound.shared_u:.2g} (“{bound.step}”) of it "
                "are errors of the channels, the same in every run; better certificates or another "
                "step lower them, repetition does not"
            )
        if done == self.until.most_rounds:
            needed = max(one.rounds_for(asked) for one in self.known)
            return "rounds", f"{goal} is not known: {state}; some {math.ceil(needed)} rounds would do"
        spent_s = sum(step.expected_duration_s for steps in self._rounds[: done + 1] for step in steps)
        if spent_s > 3600.0 * self.until.longest_h:
            return "time", (
                f"{goal} is not known: {state}; another round would end at {duration_text(spent_s)} of stand "
                f"time, and {self.until.longest_h:g} h are allowed"
            )
        return "", f"{goal}: {state}; another round"

    def _evaluation(self, path: Path) -> Any:
        """Return the evaluation of a run, made once."""
        from bufferstand.evaluation.loading import load_run  # noqa: PLC0415 - takes a moment to load
        from bufferstand.evaluation.run import evaluate_run  # noqa: PLC0415

        if path not in self._evaluated:
            record, facts = load_run(path)
            self._evaluated[path] = evaluate_run(record, facts)
        return self._evaluated[path]

    def as_dict(self) -> dict[str, Any]:
        """Return the goal and how it was judged, for ``campaign.json``."""
        return self.until.as_dict() | {"judged": self.judged, "end": self.end, "sentence": self.sentence}


def _u(figure: KnownFigure) -> float:
    return figure.u


def _shared_u(figure: KnownFigure) -> float:
    return figure.shared_u


def until_of(content: Mapping[str, Any]) -> UntilKnown | None:
    """Return the goal that ``campaign.json`` has on record, None if there is none."""
    if not content:
        return None
    return UntilKnown(
        content["text"],
        content["quantity"],
        float(content["standard_uncertainty"]),
        int(content["most_rounds"]),
        float(content["longest_h"]),
    )
