"""``[guards]`` of a campaign file: how the guards judge the stand itself, and what a trip leads to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ModelWrapValidatorHandler, PrivateAttr, model_validator

from bufferstand.foundation import MISSED_CYCLES_MAX_PER_MIN
from bufferstand.foundation.settings import Settings, Within

TripAction = Literal["note", "finish-cycle", "stop", "emergency"]
"""Say it and go on; end the cycle under way, then stop; stop at once; unload at once."""
FirmAction = Literal["stop", "emergency"]
"""For what must not be waited with."""
Positive = Annotated[float, Field(gt=0)]
"""Its bounds depend on stand and campaign (:mod:`bufferstand.protocols.campaign_file.guard_bounds`)."""


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
    stroke_below_mm: Annotated[
        float,
        Field(gt=0),
        Within(1.0, 50.0, "1 mm is the zero of a draw wire, and behind 50 mm its pretension ends"),
    ] = 20.0
    """So far behind first contact the draw wires may read."""
    zero_force_max_kN: Annotated[
        float,
        Field(gt=0),
        Within(
            0.5, 10.0, "half a kN is zero and noise of a load cell; with more than 10 kN a specimen is loaded"
        ),
    ] = 5.0
    """More force than this at rest with the valve off refuses the start; a fifth of it is said."""
    tilt_max_mm: Positive | None = None
    """Largest difference of the two draw wires; the stand file's, else 5 mm, where it is not given."""
    tilt_hold_s: Annotated[
        float, Field(ge=0), Within(0.0, 0.5, "in 0.5 s a crooked specimen is compressed by 25 mm at 50 mm/s")
    ] = 0.05
    """A tilt must last this long: one bad sample of a draw wire is none."""
    speed_trip_mm_per_s: Positive | None = None
    """Of the stroke, in the mean of 20 ms; 1.25 × the speed limit in force where it is not given."""
    heating_max_K_per_min: Annotated[
        float,
        Field(gt=0),
        Within(
            1.0,
            60.0,
            "1 K/min is the noise of a reading; 1 K/s is 15 kW in a spring of 15 kJ/K, "
            "more than the hydraulics put into any",
        ),
    ] = 20.0
    """A specimen's sensor that rises faster than this."""
    controller_silence_s: Annotated[
        float,
        Field(gt=0),
        Within(0.2, 5.0, "one retry of a request takes 0.2 s; in 5 s without samples 50 mm/s are 250 mm"),
    ] = 2.0
    """No samples, or a standing heartbeat, for so long [s of the wall]."""
    amplifier_silence_s: Annotated[
        float,
        Field(gt=0),
        Within(0.2, 30.0, "a slow amplifier delivers 10 values a second; 30 s are two windows of agreement"),
    ] = 5.0
    """No value of the amplifier for so long [s of the wall]."""
    gap_stop_s: Annotated[
        float,
        Field(gt=0),
        Within(0.05, 2.0, "a slow polled controller has 0.04 s between samples; 2 s are five blind cycles"),
    ] = 0.5
    """A longer gap in the samples left the guards blind."""
    missed_cycles_max_per_min: Annotated[
        int, Field(ge=0), Within(0, 600, "600 a minute are 1 % of 1 kHz: figures of cycles are off by then")
    ] = MISSED_CYCLES_MAX_PER_MIN
    """So many cycles of its loop the controller may miss in a minute: 60 are 0.1 % of 1 kHz."""
    lag_stop_s: Annotated[
        float,
        Field(gt=0),
        Within(1.0, 30.0, "a tenth of it is how late every guard may act: 3 s of 30"),
    ] = 10.0
    """Samples may come late for so long [s of the wall]; a tenth of it is noted."""
    disk_stop_s: Annotated[
        float,
        Field(gt=0),
        Within(1.0, 60.0, "a disk may pause for 1 s; after 60 s what was measured is in memory only"),
    ] = 10.0
    """What was written may wait for the disk so long [s]; a fifth of it is noted."""
    agreement_kN: Positive = 6.0
    """Tolerance between the force and its second way."""
    force_against_model_factor: float = Field(default=1.8, ge=1.25, le=5.0)
    """The specimen's force may differ from that of its model by this factor, either way: right ones are up to
    40 % softer or stiffer; more than 5 would not see a decimal place."""
    action: GuardActions = GuardActions()
    _own: Mapping[str, Mapping[str, Any]] = PrivateAttr(default_factory=dict)

    @property
    def own(self) -> Mapping[str, Mapping[str, Any]]:
        """Tables ``[guards.KIND]`` of guards that bring their own settings: as they are written.

        Which guards there are, and what may stand in their tables, is known where the stand is driven
        (:func:`bufferstand.daq.guards.catalogue.demand_own_tables`).
        """
        return self._own

    @model_validator(mode="wrap")
    @classmethod
    def _keep_own(cls, content: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Keep tables that are none of this schema; a key that is none of it stays unknown."""
        if not isinstance(content, Mapping):
            return handler(content)
        own = {
            key: value
            for key, value in content.items()
            if isinstance(value, Mapping) and key not in cls.model_fields
        }
        table = handler({key: value for key, value in content.items() if key not in own})
        table._own = own
        return table
