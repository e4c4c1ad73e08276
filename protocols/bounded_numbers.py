"""Numbers of a campaign file with the bounds that physics gives them, each declared once with its reason.

What a particular stand, specimen or campaign allows is narrower, and judged by the plan and by
:mod:`bufferstand.protocols.campaign_file.guard_bounds`. These bounds say what no stand for buffers can mean.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from bufferstand.foundation.settings import Within

POWER_ON_C = 85.0
"""What a DS18B20 shows after it has lost its supply [°C]: a stop above it would never see such a sensor."""

Force = Annotated[
    float,
    Field(gt=0),
    Within(0.5, 10_000.0, "below half a kN is the noise of a load cell, above 10 MN is no buffer stand"),
]
Stroke = Annotated[
    float,
    Field(gt=0),
    Within(0.01, 1000.0, "0.01 mm is what a draw wire resolves, and no buffer has a stroke of 1 m"),
]
StrokeFromZero = Annotated[
    float, Field(ge=0), Within(0.0, 1000.0, "stroke 0 is first contact, and no buffer has a stroke of 1 m")
]
Speed = Annotated[
    float,
    Field(gt=0),
    Within(0.001, 5000.0, "0.001 mm/s takes a day for 100 mm, and no servo valve delivers 5 m/s"),
]
Frequency = Annotated[
    float,
    Field(gt=0),
    Within(0.0001, 100.0, "a cycle of 0.0001 Hz takes hours, and no actuator of this kind follows 100 Hz"),
]
Duration = Annotated[
    float, Field(gt=0), Within(0.01, 604_800.0, "a motion needs 10 ms, and a week is longer than a campaign")
]
Pause = Annotated[float, Field(ge=0), Within(0.0, 604_800.0, "a week is longer than a campaign")]
Timeout = Annotated[
    float, Field(gt=0), Within(0.1, 604_800.0, "a thermometer is read once a second, and a week is no wait")
]
Temperature = Annotated[
    float,
    Within(
        -40.0,
        POWER_ON_C,
        f"a thermometer (DS18B20) that lost its supply shows {POWER_ON_C:g} °C, and is exact to 0.5 K only "
        "up to there; below −40 °C no laboratory tests buffers",
    ),
]
Cycles = Annotated[
    int, Field(gt=0), Within(1, 100_000, "more than 100 000 cycles are a slip of the pen: days at 1 Hz")
]
Percent = Annotated[
    float,
    Field(gt=0),
    Within(0.001, 100.0, "finer than 0.001 % is below the noise, and all of it is 100 %"),
]
Air = Annotated[float, Within(-40.0, 60.0, "in no test hall is it colder than −40 °C or hotter than 60 °C")]


def bounds_of(kind: Any) -> Within:
    """Return the bounds of one of these kinds of numbers, for a list of them."""
    return next(one for one in kind.__metadata__ if isinstance(one, Within))
