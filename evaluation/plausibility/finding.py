"""What speaks against a channel or a cycle: one finding, with its place, its size and what follows of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

Effect = Literal["spoils", "noted"]
"""``spoils``: what is read there is no figure of the specimen. ``noted``: nothing hangs on it."""

FindingKind = Literal[
    "clipped",
    "held",
    "frozen",
    "spike",
    "stroke-jump",
    "gain-jump",
    "offset-jump",
    "drift",
    "unit",
    "sign",
    "zero",
    "unlike",
    "scale",
    "delay",
    "slip",
    "exchanged",
    "not-following",
    "detached",
    "swapped",
    "guard",
]


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

    def entry(self) -> dict[str, Any]:
        """Return it as the evaluation document has it."""
        entry = asdict(self)
        del entry["whole_record"]
        return {**entry, "cycles": list(self.cycles)}


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
