"""What cycles between two forces were asked for, and what they reached: said aloud, and kept in the run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from bufferstand.daq.strokes import spans
from bufferstand.protocols.steps import ForceCycles


@dataclass(frozen=True)
class ForceTurns:
    """The forces at which one cycle turned [kN], and whether the stroke limit came before the upper one."""

    number: int
    lower_kN: float
    upper_kN: float
    by_limit: bool

    def is_off(self, motion: ForceCycles) -> bool:
        """Return whether one of them is further from what was asked for than the tolerance."""
        apart_kN = max(abs(self.lower_kN - motion.force_min_kN), abs(self.upper_kN - motion.force_max_kN))
        return apart_kN > motion.tolerance_kN

    def text(self) -> str:
        """Return them as a person says them."""
        return f"{self.lower_kN:.1f} … {self.upper_kN:.1f} kN"


@dataclass(frozen=True)
class ForceRow:
    """One motion between two forces [kN]; what a report needs of it.

    Parameters
    ----------
    asked_min_kN, asked_max_kN, tolerance_kN : float
        As the step asks.
    reached_min_kN, reached_max_kN : float
        In the last cycle.
    cycles : int
        That were made.
    cycles_off : str
        Those of them that were off by more than the tolerance, as ``1-3, 6``; empty if none.
    stroke_limit_mm : float or None
        Where the stroke limit came before the upper force in one of these; None where it did not.
    """

    asked_min_kN: float
    asked_max_kN: float
    tolerance_kN: float
    reached_min_kN: float
    reached_max_kN: float
    cycles: int
    cycles_off: str
    stroke_limit_mm: float | None

    def sentence(self) -> str:
        """Return it as a person says it."""
        asked = f"{self.asked_min_kN:g} … {self.asked_max_kN:g} kN"
        last = f"{self.reached_min_kN:.1f} … {self.reached_max_kN:.1f} kN in the last cycle"
        if not self.cycles_off:
            return f"asked {asked}, {last}: met within {self.tolerance_kN:.3g} kN in every cycle"
        where = f"cycles {self.cycles_off} of {self.cycles}"
        text = f"asked {asked}, {last}: not met within {self.tolerance_kN:.3g} kN in {where}"
        if self.stroke_limit_mm is not None:
            text += f"; the stroke limit of {self.stroke_limit_mm:g} mm came before {self.asked_max_kN:g} kN"
        return text

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON-ready data."""
        return asdict(self)


def force_row(motion: ForceCycles, made: Sequence[ForceTurns]) -> ForceRow | None:
    """Return the row of a motion.

    Parameters
    ----------
    motion : ForceCycles
        What was asked for.
    made : sequence of ForceTurns
        What every cycle reached.

    Returns
    -------
    ForceRow or None
        None before the first cycle.
    """
    if not made:
        return None
    off = [one for one in made if one.is_off(motion)]
    return ForceRow(
        motion.force_min_kN,
        motion.force_max_kN,
        motion.tolerance_kN,
        made[-1].lower_kN,
        made[-1].upper_kN,
        len(made),
        spans([one.number for one in off]),
        motion.stroke_limit_mm if any(one.by_limit for one in off) else None,
    )
