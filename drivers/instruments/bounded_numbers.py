"""Numbers of a stand file with the bounds that physics gives them, each declared once with its reason."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bufferstand.foundation.numbers import MASS_ACCURACY_MOST_PERCENT, MOVING_MASS_MOST_KG
from bufferstand.foundation.settings import Within

Baud = Annotated[
    int, Field(gt=0, le=4_000_000), Within(300, 4_000_000, "no serial line here is slower or faster")
]
MovingMass = Annotated[
    float, Field(ge=0), Within(0.0, MOVING_MASS_MOST_KG, "no stand moves 10 t between load cell and specimen")
]
MassAccuracy = Annotated[
    float, Field(ge=0), Within(0.0, MASS_ACCURACY_MOST_PERCENT, "known no better it is not known")
]
STAND_FORCE_KN = Within(1.0, 10_000.0, "no stand for buffers presses with less than 1 kN or over 10 MN")
StandForce = Annotated[float, Field(gt=0), STAND_FORCE_KN]
Travel = Annotated[float, Field(gt=0), Within(1.0, 1000.0, "no buffer needs less than 1 mm of travel or 1 m")]
StandFrequency = Annotated[
    float, Field(gt=0), Within(0.01, 100.0, "no servo-hydraulic stand for buffers is slower or faster")
]
StandSpeed = Annotated[
    float, Field(gt=0), Within(1.0, 5000.0, "no servo valve delivers 5 m/s; below 1 mm/s nothing is tested")
]
Stiffness = Annotated[
    float,
    Field(gt=0),
    Within(1.0, 100_000.0, "a softer machine is softer than its specimen, a stiffer one is rigid"),
]
Watchdog = Annotated[
    float,
    Field(gt=0, le=65.535),
    Within(0.1, 10.0, "so long an actuator goes on without its computer: 10 s are 25 cycles at 2.5 Hz"),
]
ReplyTime = Annotated[
    float,
    Field(gt=0, le=10),
    Within(0.005, 5.0, "no reply is sure to come within 5 ms; after 5 s none comes"),
]
SampleRate = Annotated[
    float, Field(gt=0), Within(0.1, 100_000.0, "slower shows no cycle, and no amplifier here is faster")
]
CellRange = Annotated[
    float, Field(gt=0), Within(1.0, 20_000.0, "no load cell of a stand for buffers has less or more")
]
SensorDelay = Annotated[float, Within(-1.0, 60.0, "a sensor that comes a minute late guards nothing")]
SensorPeriod = Annotated[
    float, Field(gt=0), Within(0.01, 10.0, "no bus is asked faster; in 10 s a specimen may warm by 3 K")
]
