"""How runs are judged: the options that ``evaluate`` and ``report`` share, with one meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, get_args

import click

from cli.options import FILE, warn
from evaluation.requirements.checklist import asked_items
from evaluation.requirements.inspection import Inspection, load_inspection, unused
from evaluation.requirements.limit_set import LimitSet, find_limit_set, shipped_limit_set
from evaluation.results import DecisionRule
from foundation.errors import BadInput


@dataclass(frozen=True)
class Judging:
    """What the options say; limit set and inspectors' files are read."""

    decision_rule: DecisionRule
    limit_set: LimitSet
    moving_mass_kg: float | None
    inspections: tuple[Inspection, ...]

    def warn_of_unused(self, runs: Sequence[Mapping[str, Any]]) -> None:
        """Say which inspector's file goes with none of the runs (``run`` of each entry of the document)."""
        for inspection in unused(self.inspections, runs):
            facts = inspection.inspection
            of = f"specimen “{facts.specimen}”" + (f", run “{facts.run}”" if facts.run else "")
            warn(f"--inspection: {facts.inspector}'s file is of {of}; no run here is of it: it was not used")


_OPTIONS = (
    click.option(
        "--decision-rule",
        type=click.Choice(get_args(DecisionRule)),
        default="simple",
        help="How a value near a limit is judged (default simple acceptance).",
    ),
    click.option(
        "--limits",
        metavar="FILE.toml",
        help="Judge every run by this limit set: a file, or the name of a shipped one "
        "(default en15551-105mm).",
    ),
    click.option(
        "--inspection",
        "inspections",
        metavar="FILE.toml",
        type=FILE,
        multiple=True,
        help="What an inspector saw and measured by hand; goes with the runs of its specimen.",
    ),
    click.option(
        "--moving-mass",
        metavar="KG",
        type=float,
        help="Correct for the inertia of this mass between load cell and specimen "
        "(default: that of the stand file).",
    ),
)


def judging_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command, which takes them as one argument ``judging``."""

    @wraps(function)
    def with_judging(
        *args: Any,
        decision_rule: DecisionRule,
        limits: str | None,
        inspections: tuple[Path, ...],
        moving_mass: float | None,
        **others: Any,
    ) -> Any:
        return function(*args, judging=_read(decision_rule, limits, inspections, moving_mass), **others)

    decorated: Callable[..., Any] = with_judging
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated


def _read(
    decision_rule: DecisionRule, limits: str | None, files: tuple[Path, ...], moving_mass_kg: float | None
) -> Judging:
    """Read what the options name.

    Raises
    ------
    BadInput
        If a limit set or an inspector's file cannot be used, or the mass is none.
    """
    if moving_mass_kg is not None and not 0.0 <= moving_mass_kg < float("inf"):
        raise BadInput(
            f"{moving_mass_kg:g} kg can be no moving mass",
            file="--moving-mass",
            remedy="give kilograms, 0 or more",
        )
    limit_set = shipped_limit_set() if limits is None else find_limit_set(limits)
    inspections = tuple(load_inspection(file, asked_items(limit_set)) for file in files)
    return Judging(decision_rule, limit_set, moving_mass_kg, inspections)
