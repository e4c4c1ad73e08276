"""What speaks against a channel or a cycle: one finding, with its place, its size and what follows of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bufferstand.evaluation.facts.document_types import Effect, FindingEntry, FindingKind


@dataclass(frozen=True)
class Finding:
    """Something on record that no specimen and no motion make.

    Attributes
    ----------
    kind : str
    channel : str
        ``force``, ``stroke``, ``stroke_1``, ``stroke_2``, ``temperature_1`` …
    start_s, end_s : float
        From when to when.
    cycles : tuple of int
        Numbers of the cycles that it touches; of a whole record all of them.
    size : float or None
        How large it is, in ``unit``; None where it has no size.
    unit : str
    text : str
        What, where, how large, and what to do: one sentence.
    effect : "spoils" or "noted"
    whole_record : bool
        It concerns the record as a whole, not a place in it.
    """

    kind: FindingKind
    channel: str
    start_s: float
    end_s: float
    cycles: tuple[int, ...]
    size: float | None
    unit: str
    text: str
    effect: Effect
    whole_record: bool = False

    @property
    def quantity(self) -> str:
        """What the channel measures: ``force``, ``stroke``, ``temperature``, ``speed``."""
        return self.channel.split("_", maxsplit=1)[0]

    def entry(self) -> FindingEntry:
        """Return it as the evaluation document has it."""
        return {
            "kind": self.kind,
            "channel": self.channel,
            "start_s": self.start_s,
            "end_s": self.end_s,
            "cycles": list(self.cycles),
            "size": self.size,
            "unit": self.unit,
            "text": self.text,
            "effect": self.effect,
        }


def spoiled_cycles(findings: Iterable[Finding], quantities: Iterable[str]) -> Mapping[int, Finding]:
    """Return the cycles in which a quantity is spoiled, each with the first finding that does it.

    Parameters
    ----------
    findings : iterable of Finding
    quantities : iterable of str
        As :attr:`Finding.quantity`.
    """
    wanted = set(quantities)
    spoiled: dict[int, Finding] = {}
    for finding in findings:
        if finding.effect == "spoils" and finding.quantity in wanted:
            for number in finding.cycles:
                spoiled.setdefault(number, finding)
    return spoiled
