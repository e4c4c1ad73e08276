"""``[zero]`` of a campaign file: how stroke 0 is set to first contact, and how far off it may be found."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bufferstand.foundation.settings import Settings, Within

TOUCH_FORCE_MAX_KN = 2.0
"""No touch goes further over the force at rest than this: a buffer's preload is several times as much, so
that its first compression is not used up [kN]."""
TOUCH_SPEED_MAX = 1.0
"""No touch is faster [mm/s]: a frame of 150 kN/mm gains 0.15 kN a millisecond then."""

TouchForce = Annotated[float, Field(ge=0.2, le=TOUCH_FORCE_MAX_KN)]
TouchSpeed = Annotated[
    float,
    Field(gt=0, le=TOUCH_SPEED_MAX),
    Within(0.01, TOUCH_SPEED_MAX, "slower is drift, faster uses a preload up before it is turned"),
]
WireReading = Annotated[
    float, Field(gt=0), Within(0.05, 50.0, "0.05 mm is its noise, and 50 mm is the pretension of a draw wire")
]


class ZeroTable(Settings):
    """``[zero]``; every key has a default, and the defaults are those of docs/how-to/zero.md."""

    touch: bool = True
    """Find first contact before the first stroke."""
    touch_force_kN: TouchForce | None = None
    """Rise of the force at which the piston turns back; at most 2 [kN]. Default: 8 × the noise of the
    force, 0.5 to 2.
    """
    speed_mm_per_s: TouchSpeed = 0.5
    """Piston speed of the touch; at most 1 [mm/s]."""
    travel_max_mm: Annotated[float, Field(gt=0), Within(0.5, 100.0, "10 cm of gap is a missing specimen")] = (
        10.0
    )
    """Longest way from the piston's own zero [mm]."""
    stroke_max_mm: WireReading = 10.0
    """A larger draw-wire reading at first contact, or at rest before it, is refused [mm]."""
    stroke_untouched_max_mm: Annotated[
        float, Field(gt=0), Within(0.05, 10.0, "0.05 mm is noise, and 10 mm is no first contact")
    ] = 1.0
    """With ``touch = false``: greatest draw-wire reading at rest [mm]."""
    wires_apart_max_mm: Annotated[float, Field(gt=0)] | None = None
    """Greatest difference of the two draw wires at first contact; from a fifth on there is a message [mm].
    Default: the tilt limit (5).
    """
    on_resume: Literal["touch", "take-over"] = "touch"
    """``"take-over"``: a resumed campaign keeps its zero."""
    stored_max_age_h: Annotated[
        float,
        Field(gt=0),
        Within(0.1, 168.0, "in a week load cell and wires have drifted, and hands were at it"),
    ] = 24.0
    """With ``touch = false``: an older zero of ``bufferstand stand zero`` is refused [h]."""
