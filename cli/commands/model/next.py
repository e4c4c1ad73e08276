"""``bufferstand model next``: which step tells most for a minute of stand time?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bufferstand.cli.options import EXISTING, FILE, FiniteRange, ambient_option, warn, write_json
from bufferstand.cli.terminal_tables import show_table
from bufferstand.foundation import ExitStatus, program
from bufferstand.foundation.files import write_text

if TYPE_CHECKING:
    from bufferstand.cli.model import Admission
    from bufferstand.model.identification import Identification
    from bufferstand.model.next_step import Choice, ChosenStep, Effect, Goal, Knowledge, Piece, Question

SCHEMA = "bufferstand/model-next/1"
MINUTES, MOST_MINUTES = 30.0, 1440.0
STEPS, MOST_STEPS = 12, 60
_WARMER_K = 15.0
_MARGIN_K = 1.0


@click.command(
    "next",
    epilog="Example:  bufferstand model next campaign/runs --stand stand.toml --specimen specimen.toml "
    "--out next.toml",
)
@click.argument("paths", metavar="PATH...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--stand", metavar="STAND.toml", type=EXISTING, required=True, help="Its limits and channels are kept to."
)
@click.option(
    "--specimen", metavar="FILE.toml", type=EXISTING, required=True, help="Specimen file, with its limits."
)
@click.option(
    "--question",
    help="What is to be known, and to which U (k = 2): “damping at 40 +- 40 mm, 1 Hz, 20 C to 0.002”, also "
    "stiffness (secant, kN/mm) and force (upper turn, kN), or a parameter: “beta to 0.001”. Without it: "
    "every parameter.",
)
@click.option("--out", metavar="CAMPAIGN.toml", type=FILE, help="Write the chosen steps as a campaign.")
@click.option(
    "--minutes",
    type=FiniteRange(min=0.1, max=MOST_MINUTES),
    default=MINUTES,
    help=f"Most stand time, rests included (default {MINUTES:g}, at most {MOST_MINUTES:g}).",
)
@click.option(
    "--steps",
    type=click.IntRange(1, MOST_STEPS),
    default=STEPS,
    help=f"Most steps (default {STEPS}, at most {MOST_STEPS}).",
)
@click.option("--knots", type=click.IntRange(3, 60), help="Points of the curves (default one every 5 mm).")
@ambient_option("Temperature of the air (default: the runs' own sensor).")
@click.option("--in-a-row", is_flag=True, help="As for model fit: the runs are all there was.")
@click.option("--json", "json_file", metavar="FILE|-", help="Write the choice as JSON; - is standard output.")
def command(
    *,
    paths: tuple[Path, ...],
    stand: Path,
    specimen: Path,
    question: str | None,
    out: Path | None,
    minutes: float,
    steps: int,
    knots: int | None,
    ambient_C: float | None,
    in_a_row: bool,
    json_file: str | None,
) -> int:
    """Choose the steps that tell most of the spring for a minute of stand time, and write their campaign.

    Fits the runs, and for every step that the stand may do (its limits, the specimen's, the guards, the
    temperature stop) foretells what its parameters would be known to afterwards (docs/next-step.md).
    Warming up and cooling down count as time. Errors of the channels are the same in all runs: what no
    repetition lowers is said.
    """
    from bufferstand.cli.model import admission, beyond_the_runs, read_runs, settings_of, sittings
    from bufferstand.model.identification import identify
    from bufferstand.model.next_step import Question

    asked = None if question is None else Question.parsed(question)
    runs = read_runs(paths, ambient_C)
    air_C = runs[-1].drive.ambient_C if ambient_C is None else ambient_C
    place = out or Path("next.toml")
    admitting = admission(place, stand, specimen, air_C)
    base = admitting.base()
    settings = beyond_the_runs(settings_of(runs), runs, specimen)
    found = identify(sittings(runs, chain=in_a_row), replace(settings, knots=knots, hold_out=False))
    chosen = _Chosen.of(
        found, admitting, asked, air_C, base.campaign.limits.temperature_stop_C, minutes, steps
    )
    if not chosen.errors_stated:
        warn("the stand file states no uncertainty of its channels: U is of noise alone")
    if json_file is not None:
        write_json(chosen.document(), json_file)
    if json_file != "-":
        chosen.show()
    if out is not None:
        _write(chosen, admitting, out, err=json_file == "-")
    return ExitStatus.DONE


@dataclass(frozen=True, eq=False)
class _Chosen:
    """What was chosen, and for what.

    ``value``, ``gradient`` and ``floor`` are of the figure that is asked for: its value, its derivatives by
    the spring's entries, and the least U that such steps can reach.
    """

    found: Identification
    admitting: Admission
    asked: Question | None
    choice: Choice
    gradient: Any
    value: float
    floor: float
    looked_at: int
    errors_stated: bool

    @classmethod
    def of(
        cls,
        found: Identification,
        admitting: Admission,
        asked: Question | None,
        air_C: float,
        stop_C: float,
        minutes: float,
        steps: int,
    ) -> _Chosen:
        """Choose."""
        from bufferstand.cli.model import shared_errors_of
        from bufferstand.model.next_step import (
            EveryParameter,
            Figure,
            candidates,
            choose,
            effects_of,
            knowledge_of,
        )

        errors = shared_errors_of(admitting.base().stand_file)
        knowledge = knowledge_of(found, errors, ambient_C=air_C)
        value, gradient = (0.0, None) if asked is None else asked.value_and_gradient(knowledge.spring)
        every = candidates(found.solution.problem.frame.knots_mm[-1], admitting)
        effects = effects_of(
            knowledge.spring, (piece for one in every for piece in one), (air_C, air_C + _WARMER_K)
        )
        goal: Goal = EveryParameter()
        if asked is not None and gradient is not None:
            goal = Figure(gradient, asked.expanded_uncertainty / 2.0)
        choice = choose(
            knowledge, every, effects, goal,
            warmest_C=stop_C - _MARGIN_K, most_minutes=minutes, most_steps=steps,
        )  # fmt: skip
        floor = 0.0 if asked is None else _floor(asked, knowledge, effects, gradient)
        return cls(found, admitting, asked, choice, gradient, value, floor, len(every), errors.stated)

    def show(self) -> None:
        """Print the steps, and how it ends."""
        asked = self.asked
        figure = [] if asked is None else [(f"U of {asked.figure}", "right")]
        rows = []
        for number, step in enumerate(self.choice.steps, start=1):
            u = [] if asked is None else [f"{asked.deviation(step.after, self.gradient):.2g}"]
            warm = f"{step.before.temperature_C:.1f}"
            rows.append([str(number), self._what(step), warm, f"{step.minutes:.1f}", *u, _tells(step)])
        if rows:
            show_table(
                [
                    ("", "right"), ("step", "left"), ("from °C", "right"), ("min", "right"), *figure,
                    ("tells (standard deviation before → after)", "left"),
                ],
                rows,
                title=f"{self.found.model.name}: what to run next",
            )  # fmt: skip
        for line in self.sentences():
            click.echo(line)

    @staticmethod
    def _what(step: ChosenStep) -> str:
        from bufferstand.model.next_step import text_of

        return text_of(step.candidate)

    def sentences(self) -> list[str]:
        """Return how it ends, in words."""
        refused = self.admitting.refused
        said = []
        if refused:
            piece, why = next(iter(refused.items()))
            said.append(f"{len(refused)} steps are not admissible, the first: {piece.text}: {why}")
        said.append(
            f"{self.looked_at} candidates looked at; {len(self.choice.steps)} chosen, "
            f"{self.choice.minutes:.1f} min of stand time"
        )
        if self.asked is None:
            return said
        asked, unit = self.asked, f" {self.asked.unit}" if self.asked.unit else ""
        u = asked.deviation(self.choice.last, self.gradient)
        now = f"{asked.figure} {self.value:.4g}{unit} would be known to U = {u:.2g}{unit} (k = 2)"
        if self.choice.end == "reached":
            return [*said, f"{now}: {asked.expanded_uncertainty:g} is reached"]
        ends = {
            "nothing-more": "no admissible step lowers it further",
            "time": "no step that would lower it fits into --minutes",
            "steps": "more --steps would lower it further",
        }
        if self.floor > asked.expanded_uncertainty:
            cannot = f"{asked.expanded_uncertainty:g} cannot be reached by any number of such steps"
            left = f"errors of the channels, the same in all runs, leave {self.floor:.2g}{unit}"
            return [*said, f"{now}: {cannot}", f"{left}: better certificates (force, delay) would lower it"]
        return [*said, f"{now}, not to {asked.expanded_uncertainty:g}: {ends[self.choice.end]}"]

    def pieces(self) -> list[tuple[Piece, str]]:
        """Return the pieces in a row, each with its comment."""
        found = []
        for step in self.choice.steps:
            tells = _tells(step)
            for number, piece in enumerate(step.candidate):
                found.append((piece, f"tells {tells}" if number == len(step.candidate) - 1 and tells else ""))
        return found

    def document(self) -> dict[str, Any]:
        """Return the choice as JSON-ready data."""
        asked = self.asked
        steps = [
            {
                "step": self._what(step),
                "start_temperature_C": step.before.temperature_C,
                "duration_s": 60.0 * step.minutes,
                "expanded_uncertainty": None if asked is None else asked.deviation(step.after, self.gradient),
                "tells": [{"name": n, "before": b, "after": a} for n, b, a in step.told(len(self._names()))],
            }
            for step in self.choice.steps
        ]
        return {
            "schema": SCHEMA,
            "question": None
            if asked is None
            else {
                "text": asked.text,
                "value": self.value,
                "unit": asked.unit or "1",
                "asked": asked.expanded_uncertainty,
                "least_by_repetition": self.floor,
            },
            "end": self.choice.end,
            "duration_s": 60.0 * self.choice.minutes,
            "candidates": self.looked_at,
            "not_admissible": [{"step": p.text, "why": why} for p, why in self.admitting.refused.items()],
            "steps": steps,
        }

    @staticmethod
    def _names() -> tuple[str, ...]:
        from bufferstand.model.identification import NAMES

        return NAMES


def _floor(asked: Question, knowledge: Knowledge, effects: dict[Piece, Effect], gradient: Any) -> float:
    return asked.deviation(knowledge.limit(effects.values()), gradient)


def _tells(step: ChosenStep) -> str:
    return "; ".join(f"{name} {before:.2g} → {after:.2g}" for name, before, after in step.told())


def _write(chosen: _Chosen, admitting: Admission, out: Path, *, err: bool) -> None:
    """Write the campaign, once it is seen that a plan takes it."""
    from bufferstand.cli.campaign import prepare_campaign

    pieces = chosen.pieces()
    if not pieces:
        click.echo("no campaign written: no step was chosen", err=err)
        return
    each, why = [piece for piece, _ in pieces], [said for _, said in pieces]
    prepare_campaign(admitting.campaign(each, why))
    write_text(out, admitting.text(each, why))
    click.echo(f"written: {out} (see it with: {program()} plan {out})", err=err)
