"""What is said of the cycles of a run, and which of a run's warnings ask nobody to do anything."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.cycles import is_lead
from bufferstand.evaluation.facts import CycleResult, RequirementResult, RunFacts
from bufferstand.evaluation.run.missing_values import requirement_warnings


def cycle_warnings(results: Sequence[CycleResult]) -> list[str]:
    """Return the warnings of all cycles, each text once with the numbers of its cycles."""
    where: dict[str, list[int]] = {}
    for result in results:
        for text in result.warnings:
            where.setdefault(text, []).append(result.cycle.index)
    return [f"{numbered(numbers)}: {text}" for text, numbers in where.items()]


def numbered(numbers: Sequence[int]) -> str:
    """Return cycle numbers in words; more than two in a row as from – to."""
    parts: list[tuple[int, int]] = []
    for number in numbers:
        if parts and number == parts[-1][1] + 1:
            parts[-1] = (parts[-1][0], number)
        else:
            parts.append((number, number))
    texts = [f"{a}" if a == b else f"{a}, {b}" if b == a + 1 else f"{a} to {b}" for a, b in parts]
    return ("cycle " if len(numbers) == 1 else "cycles ") + ", ".join(texts)


def notes_of(
    warnings: Sequence[str],
    facts: RunFacts,
    results: Sequence[CycleResult],
    requirements: Sequence[RequirementResult],
    bridged: Sequence[str],
) -> tuple[str, ...]:
    """Return those of a run's warnings that nobody needs to act on.

    The lead-in and lead-out of a harmonic motion are planned; what a requirement lacks is said with it; a few
    lost samples that change next to nothing are part of U.

    Parameters
    ----------
    warnings : sequence of str
        All warnings of the run.
    facts, results, requirements
        Of the same run.
    bridged : sequence of str
        What is said of holes that may change no figure, or next to nothing.

    Returns
    -------
    tuple of str
        In the order of ``warnings``.
    """
    planned = [one for one in (results[0], results[-1]) if is_lead(one.cycle)] if results else []
    known = {*requirement_warnings(requirements), *bridged}
    if facts.kind == "harmonic":
        known |= {*cycle_warnings(planned), *(text for one in planned for text in cycle_warnings([one]))}
    return tuple(text for text in warnings if text in known)
