"""The course of a warm-up, part of the campaign as it was run."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class WarmUpOutcome:
    """How a warm-up went.

    Parameters
    ----------
    goes : int
        How often it cycled.
    lag_s : float or None
        Of the sensors behind the spring, as it was last believed [s].
    rise_K : float or None
        Of the spring in one cycle, as it was last measured [K].
    spring_C : float
        Of the spring at the end, by readings, slope and lag [°C].
    above_K : float
        By how much the highest reading was above the band, 0 where none was [K].
    rested_s : float
        How much of it was rest [s].
    """

    goes: int
    lag_s: float | None
    rise_K: float | None
    spring_C: float
    above_K: float
    rested_s: float

    def sentence(self) -> str:
        """Return it as a person says it."""
        goes = f"{self.goes} go{'' if self.goes == 1 else 'es'} of cycles"
        parts = [goes, f"{self.rested_s:.0f} s of rest"]
        if self.lag_s is not None:
            parts.append(f"the sensors lag by {self.lag_s:.0f} s")
        if self.rise_K is not None:
            parts.append(f"a cycle heats by {self.rise_K:.2f} K")
        over = f"up to {self.above_K:.2f} K above the band" if self.above_K > 0.0 else "never above the band"
        return f"{', '.join(parts)}; {over}; the spring is at {self.spring_C:.2f} °C"
