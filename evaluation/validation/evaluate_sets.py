"""Evaluates the standard sets with this installation, or judges results of another program."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bufferstand.evaluation.document import evaluate_entry
from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.validation.judge import Check, judge_entry
from bufferstand.evaluation.validation.standard_sets import RECORD, StandardSet
from bufferstand.foundation import BadInput
from bufferstand.recording.foreign import ImportOptions, import_file


@dataclass(frozen=True)
class SetResult:
    """What was found in one set, with the evaluation's warnings; ``problem`` says why nothing was found."""

    standard: StandardSet
    checks: tuple[Check, ...]
    warnings: tuple[str, ...] = ()
    problem: str = ""

    @property
    def good(self) -> bool:
        """Whether every agreed value was found."""
        return not self.problem and all(check.good for check in self.checks)

    @property
    def missed(self) -> tuple[Check, ...]:
        """The agreed values that were not found."""
        return tuple(check for check in self.checks if not check.good)


def evaluate_set(standard: StandardSet) -> SetResult:
    """Import a set's record and evaluate it, as ``bufferstand import`` and ``evaluate`` do.

    Returns
    -------
    SetResult
        A record that is refused is a result, too: ``problem`` is the message.
    """
    with tempfile.TemporaryDirectory(prefix="bufferstand-validation-") as name:
        try:
            imported = import_file(standard.folder / RECORD, Path(name), _import_options(standard))
            entry, _ = evaluate_entry(imported.path, _options(standard))
        except BadInput as error:
            checks = judge_entry(standard.truth.agreed, {})
            return SetResult(standard, tuple(checks), problem=f"refused: {error.problem}")
    checks = judge_entry(standard.truth.agreed, entry)
    return SetResult(standard, tuple(checks), tuple(entry["warnings"]))


def judge_results(standard: StandardSet, results: Mapping[str, Any]) -> SetResult | None:
    """Judge what another program found in a set.

    Parameters
    ----------
    standard : StandardSet
    results : mapping
        By id of the set: a run's entry of an evaluation document, or as much of it as the program finds.

    Returns
    -------
    SetResult or None
        Only of what the program found: what it does not offer is left out, and no set of which it offers
        nothing counts.
    """
    entry = results.get(standard.id)
    if not isinstance(entry, Mapping):
        return None
    checks = [check for check in judge_entry(standard.truth.agreed, entry) if check.found is not None]
    return SetResult(standard, tuple(checks)) if checks else None


def _import_options(standard: StandardSet) -> ImportOptions:
    options = standard.truth.options
    return ImportOptions(
        kind=standard.truth.kind,
        column=options.column or {},
        invert=options.invert or (),
        sample_rate_hz=options.sample_rate_Hz,
        mapping=standard.mapping,
    )


def _options(standard: StandardSet) -> Options:
    rule = standard.truth.options.decision_rule
    return Options() if rule is None else Options(decision_rule=rule)
