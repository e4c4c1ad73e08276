"""The options by which runs are judged, common to ``evaluate`` and ``report``."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from bufferstand.cli.options import FILE, FiniteFloat, warn
from bufferstand.evaluation.facts import DecisionRule, ForceCell
from bufferstand.foundation import BadInput
from bufferstand.foundation.numbers import MOVING_MASS_MOST_KG

if TYPE_CHECKING:
    from bufferstand.evaluation.facts import Options
    from bufferstand.evaluation.requirements import LimitSet


@dataclass(frozen=True)
class JudgingOptions:
    """What the options say; limit set and inspectors' files are read."""

    options: Options
    limit_set: LimitSet
    conformity: tuple[str, ...] = ()
    """Runs that are the conformity test of their specimen, by id or path."""

    def warn_of_unused(self, runs: Sequence[Mapping[str, Any]]) -> None:
        """Say which inspector's file goes with none of the runs (``run`` of each entry of the document)."""
        from bufferstand.evaluation.requirements import unused

        for inspection in unused(self.options.inspections, runs):
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
        "--conformity",
        metavar="RUN",
        multiple=True,
        help="This run (id or file) is the conformity test of its specimen (default: what the campaign says, "
        "else the first static run that meets the conditions).",
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
        type=FiniteFloat(),
        help="Correct for the inertia of this mass between load cell and specimen "
        "(default: that of the stand file).",
    ),
    click.option(
        "--moving-mass-accuracy",
        metavar="PERCENT",
        type=FiniteFloat(),
        help="Limit of the error of that mass (default: the stand file's, else 5).",
    ),
    click.option(
        "--force-cell",
        type=click.Choice(get_args(ForceCell)),
        help="Where the load cell is: it pushes the moving mass, or stands behind the specimen "
        "(default: the stand file's, else moving-side).",
    ),
)


def judging_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options to a command, which takes them as one argument ``judging``."""

    @wraps(function)
    def with_judging(
        *args: Any,
        decision_rule: DecisionRule,
        limits: str | None,
        conformity: tuple[str, ...],
        inspections: tuple[Path, ...],
        moving_mass: float | None,
        moving_mass_accuracy: float | None,
        force_cell: ForceCell | None,
        **others: Any,
    ) -> Any:
        from bufferstand.evaluation.facts import Options
        from bufferstand.evaluation.requirements import (
            asked_items,
            find_limit_set,
            load_inspection,
            shipped_limit_set,
        )

        limit_set = shipped_limit_set() if limits is None else find_limit_set(limits)
        options = Options(
            decision_rule=decision_rule,
            moving_mass_kg=_mass(moving_mass),
            moving_mass_accuracy_percent=moving_mass_accuracy,
            force_cell=force_cell,
            inspections=tuple(load_inspection(file, asked_items(limit_set)) for file in inspections),
        )
        return function(*args, judging=JudgingOptions(options, limit_set, conformity), **others)

    decorated: Callable[..., Any] = with_judging
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated


def _mass(moving_mass_kg: float | None) -> float | None:
    """Return a moving mass as it is.

    Raises
    ------
    BadInput
        If it can be none.
    """
    if moving_mass_kg is not None and not 0.0 <= moving_mass_kg <= MOVING_MASS_MOST_KG:
        raise BadInput(
            f"{moving_mass_kg:g} kg can be no moving mass",
            file="--moving-mass",
            remedy=f"give kilograms, 0 to {MOVING_MASS_MOST_KG:g}",
        )
    return moving_mass_kg
