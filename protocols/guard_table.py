"""``[guards]`` of a campaign file: how the guards judge the stand itself, and what a trip leads to."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from foundation.clock import MISSED_CYCLES_MAX_PER_MIN
from foundation.settings import Settings

TripAction = Literal["note", "finish-cycle", "stop", "emergency"]
"""Say it and go on; end the cycle under way, then stop; stop at once; unload at once."""
FirmAction = Literal["stop", "emergency"]
"""For what must not be waited with."""
Positive = Annotated[float, Field(gt=0)]


class GuardActions(Settings):
    """``[guards.action]``: what each guard's trip leads to; force, stroke and tilt cannot be made a note."""

    force: FirmAction = "emergency"
    stroke: FirmAction = "emergency"
    tilt: FirmAction = "emergency"
    following_error: FirmAction = "stop"
    speed: FirmAction = "stop"
    temperature: Literal["finish-cycle", "stop", "emergency"] = "stop"
    heating: TripAction = "stop"
    frozen: TripAction = "stop"
    agreement: TripAction = "note"
    wiring: TripAction = "stop"
    ambient_silence: TripAction = "note"
    amplifier_silence: TripAction = "note"


class GuardTable(Settings):
    """``[guards]``; every key has a default, and the defaults are those of docs/guards-and-safe-stop.md."""

    force_below_kN: Positive = 10.0
    """A buffer cannot pull: more tension than this is a wrong sign or a stuck specimen."""
    stroke_below_mm: Positive = 20.0
    """So far behind first contact the draw wires may read."""
    zero_force_max_kN: Positive = 5.0
    """More force than this at rest with the valve off refuses the start; a fifth of it is said."""
    tilt_max_mm: Positive | None = None
    """Largest difference of the two draw wires; the stand file's, else 5 mm, where it is not given."""
    tilt_hold_s: float = Field(default=0.05, ge=0)
    """A tilt must last this long: one bad sample of a draw wire is none."""
    speed_trip_mm_per_s: Positive | None = None
    """Of the stroke, in the mean of 20 ms; 1.25 × the speed limit in force where it is not given."""
    heating_max_K_per_min: Positive = 20.0
    """A specimen's sensor that rises faster than this."""
    controller_silence_s: Positive = 2.0
    """No samples, or a standing heartbeat, for so long [s of the wall]."""
    amplifier_silence_s: Positive = 5.0
    """No value of the amplifier for so long [s of the wall]."""
    gap_stop_s: Positive = 0.5
    """A longer gap in the samples left the guards blind."""
    missed_cycles_max_per_min: int = Field(default=MISSED_CYCLES_MAX_PER_MIN, ge=0)
    """So many cycles of its loop the controller may miss in a minute: 60 are 0.1 % of 1 kHz."""
    lag_stop_s: Positive = 10.0
    """Samples may come late for so long [s of the wall]; a tenth of it is noted."""
    disk_stop_s: Positive = 10.0
    """What was written may wait for the disk so long [s]; a fifth of it is noted."""
    agreement_kN: Positive = 6.0
    """Tolerance between the force and its second way."""
    force_against_model_factor: float = Field(default=1.8, ge=1.25, le=5.0)
    """The specimen's force may differ from that of its model by this factor, either way: right ones are up to
    40 % softer or stiffer; more than 5 would not see a decimal place."""
    action: GuardActions = GuardActions()
