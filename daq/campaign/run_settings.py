"""How a campaign is run, apart from its steps."""

from __future__ import annotations

from dataclasses import dataclass, field

from bufferstand.daq.acquisition import LoopPace
from bufferstand.daq.motions import MotionTimeLimit
from bufferstand.protocols.campaign_file import GuardTable


@dataclass(frozen=True)
class RunSettings:
    """How a campaign is run, apart from what it does.

    Parameters
    ----------
    guards : GuardTable or None
        How the guards judge the stand itself; ``[guards]`` of the campaign if not given.
    pace : Pace
        Of the acquisition.
    patience : Patience
        How long a motion may take.
    cool_limit_s : float
        So long at most a specimen may take to cool to the resume threshold after a temperature stop [s].
    waited_for : bool
        Whether the stand waits for its reader, as a simulated one that this program has started does: a busy
        computer then costs time and no samples, and neither the lag guard nor the keeping up is judged.
    says_it_waits : bool
        Whether the stand itself says so: a slow wire then does not refuse the start. The lag guard judges it
        as any other, so that a wrong word blinds nothing.
    awaits_stand : bool
        Whether a start waits for what a killed program has left to come to rest; else it is refused.
    speed : float
        Seconds of the stand in one of the wall: more than 1 for a simulated stand that runs fast.
    """

    guards: GuardTable | None = None
    pace: LoopPace = field(default_factory=LoopPace)
    patience: MotionTimeLimit = field(default_factory=MotionTimeLimit)
    cool_limit_s: float = 4.0 * 3600.0
    waited_for: bool = False
    says_it_waits: bool = False
    awaits_stand: bool = False
    speed: float = 1.0
