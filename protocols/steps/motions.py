"""Motions as data: what the runner executes.

Strokes are required ones [mm], from first contact, compression positive; amplitude is half the range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

from bufferstand.foundation import Harmonic, RampTo, Release, StaticCycles


@dataclass(frozen=True)
class Hold:
    """Stand still where it stands."""

    name: ClassVar[str] = "hold"
    wait_s: float

    def duration_s(self, from_mm: float) -> float:  # noqa: ARG002
        """Return how long it takes [s]."""
        return self.wait_s

    def end_mm(self, from_mm: float) -> float:
        """Return the stroke at its end [mm]."""
        return from_mm


@dataclass(frozen=True)
class WaitUntilCool:
    """Stand still until every specimen sensor is at or below a temperature; give up after ``timeout_s``."""

    name: ClassVar[str] = "wait-until-cool"
    temperature_C: float
    timeout_s: float

    def end_mm(self, from_mm: float) -> float:
        """Return the stroke at its end [mm]."""
        return from_mm


@dataclass(frozen=True)
class ForceCycles:
    """Load at constant speed to one force, unload to another, ``cycles`` times; stand a moment at each turn.

    Within ``tolerance_percent`` of ``force_max_kN`` both are met from the second cycle on. Where the stroke
    limit comes first it turns there.
    """

    name: ClassVar[str] = "force-cycles"
    DWELL_S: ClassVar[float] = 0.1
    REACTION_S: ClassVar[float] = 0.03
    """From the command to hold until the piston stands [s]: a round trip of 10 ms, and a position loop of
    15 Hz that follows some 20 ms late."""
    force_min_kN: float
    force_max_kN: float
    stroke_limit_mm: float
    speed_mm_per_s: float
    cycles: int
    tolerance_percent: float

    @property
    def tolerance_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """So far from its force a turn may be [kN]."""
        return 0.01 * self.tolerance_percent * self.force_max_kN

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the greatest stroke that it can have [mm]; where it ends only the model can say."""
        return self.stroke_limit_mm


@dataclass(frozen=True)
class RampToForce:
    """Move at constant speed until a force is reached, or a stroke, whichever comes first; stand there."""

    name: ClassVar[str] = "ramp-to-force"
    force_kN: float
    stroke_limit_mm: float
    speed_mm_per_s: float

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the greatest stroke at its end [mm]; where the force is reached only the model can say."""
        return self.stroke_limit_mm


@dataclass(frozen=True)
class TouchOff:
    """Creep from the piston's zero to a small force, take where first contact is for stroke 0, and back off.

    ``force_kN`` is over that at rest. What is None is as in ``[zero]`` of the campaign.
    """

    name: ClassVar[str] = "touch"
    USUAL_S: ClassVar[float] = 10.0
    force_kN: float | None = None
    speed_mm_per_s: float | None = None

    def duration_s(self, from_mm: float) -> float:  # noqa: ARG002
        """Return how long it usually takes [s]: a second at rest, some millimetres there and back."""
        return self.USUAL_S

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return 0.0


Motion = (
    RampTo | RampToForce | Release | Hold | WaitUntilCool | Harmonic | StaticCycles | ForceCycles | TouchOff
)
"""What the runner executes. How long a wait for cooling, a static cycle or what goes to a force takes
only the model can say."""


def motion_dict(motion: Motion) -> dict[str, Any]:
    """Return a motion as data: its name under ``motion``, and its parameters."""
    return {"motion": motion.name, **asdict(motion)}


def motions_after(motions: Sequence[Motion], cycles_done: int) -> tuple[Motion, ...]:
    """Return the motions of a step that was interrupted after ``cycles_done`` cycles, for its continuation.

    Cycles count through all of the step's cyclic motions in order. Only those that are left remain; the ramps
    to and from them stay, so that the path is the same, and a cyclic motion that is over becomes a hold of no
    time, so that the estimates still belong to the motions. Empty if no cycles are left.

    Raises
    ------
    ValueError
        If ``cycles_done`` is negative.
    """
    if cycles_done < 0:
        raise ValueError(f"cycles_done must not be negative, got {cycles_done}")
    rest: list[Motion] = []
    total = 0
    for motion in motions:
        if isinstance(motion, Harmonic | StaticCycles | ForceCycles):
            left = motion.cycles - max(0, cycles_done - total)
            total += motion.cycles
            rest.append(replace(motion, cycles=left) if left > 0 else Hold(0.0))
        else:
            rest.append(motion)
    return () if 0 < total <= cycles_done else tuple(rest)
