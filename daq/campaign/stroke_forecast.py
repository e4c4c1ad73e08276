"""Of each step: the stroke that is asked for, what is commanded for it, and what it should reach."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bufferstand.daq.campaign.stroke_settings import bounds_of, knowledge_in
from bufferstand.daq.strokes import (
    commanded_sine,
    first_loading,
    learned_in,
    read_strokes,
    uncompensated_sine,
)
from bufferstand.foundation import BadInput, Harmonic
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.prediction import Sine
from bufferstand.protocols.steps import PlannedStep

HEADER = ("step", "name", "asked mm", "commanded mm", "reached mm", "off")
"""Columns of :func:`outlook_rows` and :func:`reached_rows`."""


@dataclass(frozen=True)
class StrokeOutlook:
    """One sine to come: as asked for, as commanded (the piston's), and what the specimen should do.

    Strokes from first contact [mm]; without compensation what is asked for is the piston's.
    """

    step: int
    name: str
    asked: Sine
    commanded: Sine
    reached: Sine
    compensated: bool
    said: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return asdict(self)


def stroke_outlook(
    plan: Plan, folder: Path, steps: Iterable[PlannedStep] | None = None
) -> list[StrokeOutlook]:
    """Return what is commanded for the sines of a plan by what a campaign's folder has learned.

    Parameters
    ----------
    plan : Plan
    folder : Path
        With ``strokes.jsonl``.
    steps : iterable of PlannedStep, optional
        Those to look at; all if not given.

    Raises
    ------
    BadInput
        If nothing was learned there.
    """
    if learned_in(folder) is None:
        raise BadInput(
            "nothing was learned of the stroke here (strokes.jsonl is not there or empty)",
            file=folder,
            remedy="give the --out folder of a run with cyclic steps",
        )
    known, bounds = knowledge_in(folder, plan), bounds_of(plan)
    found = []
    for step in plan.steps if steps is None else steps:
        for motion, estimate in zip(step.motions, step.estimates, strict=True):
            if not isinstance(motion, Harmonic):
                continue
            asked = Sine(motion.mean_mm, motion.amplitude_mm)
            expected = estimate.usual_turns(motion.cycles)
            if step.compensate:
                share = first_loading(step, motion, estimate)
                one = commanded_sine(motion, expected, share, known, bounds)
            else:
                one = uncompensated_sine(motion, expected, known)
            found.append(
                StrokeOutlook(
                    step.index, step.name, asked, one.piston, one.specimen, step.compensate, one.said
                )
            )
    return found


def outlook_rows(outlook: Iterable[StrokeOutlook]) -> list[tuple[str, ...]]:
    """Return them as rows of text, in the columns of :data:`HEADER`."""
    return [
        (
            str(one.step), one.name, _text(one.asked), _text(one.commanded), _text(one.reached),
            _off(one.asked, one.reached),
        )
        for one in outlook
    ]  # fmt: skip


def reached_rows(folder: Path) -> list[tuple[str, ...]]:
    """Return what was asked, commanded and reached in a campaign that was run, in the same columns."""
    found = []
    for line in read_strokes(folder):
        for row in line["motions"]:
            asked, commanded, reached = (
                (row[f"{name}_mean_mm"], row[f"{name}_amplitude_mm"])
                for name in ("asked", "last_commanded", "reached")
            )
            if asked[1] is None:
                texts = [f"{pair[0]:.2f}" for pair in (asked, commanded, reached)]
                off = "at its force limit" if row["by_force"] else f"{row['off_mm']:+.2f} mm"
            else:
                texts = [_text(Sine(*pair)) for pair in (asked, commanded, reached)]
                off = _off(Sine(*asked), Sine(*reached))
            found.append((str(line["step"]), str(line["name"]), *texts, off))
    return found


def _text(sine: Sine) -> str:
    return f"{sine.mean_mm:.2f} ± {sine.amplitude_mm:.2f}"


def _off(asked: Sine, reached: Sine) -> str:
    percent = 100.0 * (reached.amplitude_mm / asked.amplitude_mm - 1.0)
    return f"{reached.mean_mm - asked.mean_mm:+.2f} mm, {percent:+.2f} %"
