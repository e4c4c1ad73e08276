"""Findings from what the stand's guards reported of its devices during the run."""

from __future__ import annotations

from bufferstand.evaluation.facts import Finding, GuardDoubt
from bufferstand.evaluation.plausibility.run_view import RunView

_OF_FIGURES = ("force", "stroke", "temperature", "speed")


def told_by_guards(look: RunView) -> list[Finding]:
    """Return the doubts that guards wrote into the run file, as they were written.

    A guard that doubts a channel of the figures takes them; any other is noted.

    Parameters
    ----------
    look : Look
    """
    return [_finding(look, doubt) for doubt in look.facts.guard_doubts]


def _finding(look: RunView, doubt: GuardDoubt) -> Finding:
    start_s = float(look.samples.time_s[0]) if doubt.time_s is None else doubt.time_s
    end_s = max(start_s, float(look.samples.time_s[-1]))
    spoils = doubt.wiring and doubt.channel.split("_")[0] in _OF_FIGURES and doubt.channel != "force_2"
    cycles = look.all_cycles if spoils else ()
    text = f"told by the guard “{doubt.guard}” while it was recorded: {doubt.text}"
    return Finding(
        "guard",
        doubt.channel or doubt.guard,
        start_s,
        end_s,
        cycles,
        doubt.value,
        doubt.unit,
        text,
        "spoils" if spoils else "noted",
        whole_record=spoils,
    )
