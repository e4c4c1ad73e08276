"""The codes that a channel has in place of readings."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.numerics import FloatArray


@dataclass(frozen=True, eq=False)
class ErrorCodes:
    """A channel with codes: when, and what they are, shape (K,)."""

    channel: str
    unit: str
    time_s: FloatArray
    value: FloatArray

    def finding(self, cycles: tuple[int, ...]) -> Finding:
        """Return what is said of it."""
        known = sorted(set(self.value.tolist()), key=abs, reverse=True)
        named = ", ".join(f"{value:.6g}" for value in known[:3])
        start_s, end_s = float(self.time_s[0]), float(self.time_s[-1])
        span = f"from {start_s:.6g} to {end_s:.6g} s"
        held = (
            f"1 sample {span} holds" if (count := self.time_s.size) == 1 else f"{count} samples {span} hold"
        )
        text = (
            f"{self.channel}: {held} a code ({named}) in the place of a reading: a spike as of an overflow "
            "or a sensor that was not there; left out as no reading"
        )
        return Finding("spike", self.channel, start_s, end_s, cycles, None, self.unit, text, effect="noted")
