"""Limits as data: the stand's, the campaign's and the specimen's, and the narrowest of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from bufferstand.foundation import ForceSpeed, curve_problem
from bufferstand.foundation.settings import Settings, Within, WrongKeyError
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols.bounded_numbers import Force, Frequency, Speed, Stroke, Temperature

TemperaturePolicy = Literal["stop", "wait-and-continue", "skip"]
"""What happens at the temperature stop (docs/campaign-file.md)."""

FORCE_TRIP_FACTOR = 1.03
"""Default trip of the force guard over the planned maximum: 618 kN for 600 kN, below the 630 kN actuator."""
STROKE_TRIP_MARGIN_MM = 2.0
"""Default trip of the stroke guard over the planned maximum [mm]: overshoot of a harmonic motion."""

TOLERANCE = 1e-9
"""Relative slack of every comparison with a limit: v = 2π f A and back must not break it by rounding."""


@dataclass(frozen=True)
class Machine:
    """What the machine takes of a motion: it gives way under force, and is slower under force.

    Parameters
    ----------
    stiffness_kN_per_mm : float or None
        Frame, load cell and fixture in series; None: not known, taken for rigid.
    force_speed : ForceSpeed or None
        Greatest speed at a force; None: not known, the speed limit holds at any force.
    """

    stiffness_kN_per_mm: float | None = None
    force_speed: ForceSpeed | None = None

    @property
    def give_mm_per_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """By how much it gives way under 1 kN [mm/kN]; 0 where it is taken for rigid."""
        return 0.0 if self.stiffness_kN_per_mm is None else 1.0 / self.stiffness_kN_per_mm

    def as_dict(self) -> dict[str, Any]:
        """Return what is known of it by the stand file's names, as JSON-ready data."""
        known: dict[str, Any] = {}
        if self.stiffness_kN_per_mm is not None:
            known["machine_stiffness_kN_per_mm"] = self.stiffness_kN_per_mm
        if self.force_speed is not None:
            known["force_speed"] = [list(pair) for pair in self.force_speed.points]
        return known


RIGID = Machine()
"""A machine of which nothing is known."""


@dataclass(frozen=True)
class StandLimits:
    """What the stand can do, from its stand file; all positive.

    Parameters
    ----------
    force_max_kN, stroke_max_mm, frequency_max_Hz, speed_max_mm_per_s : float
        Its limits; the stroke is the piston's travel.
    machine_stiffness_kN_per_mm : float or None
        As :class:`Machine`.
    force_speed : sequence of (float, float) or None
        Pairs of force [kN] and greatest speed there [mm/s].

    Raises
    ------
    ValueError
        If a limit is not positive, or the pairs are no curve.
    """

    force_max_kN: float
    stroke_max_mm: float
    frequency_max_Hz: float
    speed_max_mm_per_s: float
    machine_stiffness_kN_per_mm: float | None = None
    force_speed: tuple[tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        for name, value in (self.hashed() | self._stiffness()).items():
            if not value > 0.0:
                raise ValueError(f"{name} of the stand must be positive, got {value}")
        if self.force_speed is not None and (problem := curve_problem(self.force_speed)):
            raise ValueError(f"force_speed of the stand: {problem}")

    def _stiffness(self) -> dict[str, float]:
        stiffness = self.machine_stiffness_kN_per_mm
        return {} if stiffness is None else {"machine_stiffness_kN_per_mm": float(stiffness)}

    @property
    def machine(self) -> Machine:
        """What the machine takes of a motion."""
        curve = None if self.force_speed is None else ForceSpeed(self.force_speed)
        return Machine(self.machine_stiffness_kN_per_mm, curve)

    def hashed(self) -> dict[str, float]:
        """Return what bears on a recorded result, as floats (so that 600 and 600.0 hash alike).

        What the machine takes of a motion does not: it is what a plan reckons with, and a better value of it
        makes no other test of a step that was run.
        """
        names = ("force_max_kN", "stroke_max_mm", "frequency_max_Hz", "speed_max_mm_per_s")
        return {name: float(getattr(self, name)) for name in names}

    def as_dict(self) -> dict[str, Any]:
        """Return the limits by name, and what is known of the machine."""
        return {**self.hashed(), **self.machine.as_dict()}


OF_CAMPAIGN = "[limits] of the campaign"
"""Who sets a limit that stands there."""
_NOT_OF_A_RESULT = ("on_temperature_stop", "temperature_resume_C", "no_temperature_stop")
"""Keys that say how a campaign goes on, or why it may be run, and make no other test of a step."""


class TestLimits(Settings):
    """``[limits]`` of a campaign: what this test may use of the stand, and when its guards trip."""

    __test__: ClassVar[bool] = False  # pytest takes every class named Test… for a test

    force_max_kN: Force = 600.0
    """No step may be expected to exceed it [kN]."""
    stroke_max_mm: Stroke | None = None
    """Greatest prestress + amplitude [mm]. Default: specimen's, else stand's."""
    frequency_max_Hz: Frequency = 2.55
    """The paper's highest [Hz]."""
    speed_max_mm_per_s: Speed | None = None
    """For every motion, ramps included [mm/s]. Default: the stand's."""
    force_trip_kN: Annotated[float, Field(gt=0)] | None = None
    """The guard stops here. It lies above ``force_max_kN``, because a static step turns at its limit [kN].
    Default: 1.03 × the force limit that applies.
    """
    stroke_trip_mm: Annotated[float, Field(gt=0)] | None = None
    """The stroke guard stops here [mm]. Default: the stroke limit that applies + 2. If given, no step may
    exceed it.
    """
    temperature_stop_C: Temperature = 40.0
    """The guard stops when any specimen sensor reaches it (paper § 3.1) [°C]."""
    temperature_resume_C: Temperature = 30.0
    """Testing continues when all of them are at or below it [°C]."""
    temperature_stale_s: Annotated[
        float,
        Field(gt=0),
        Within(
            1.0,
            30.0,
            "a DS18B20 converts for 0.75 s; in 30 s a specimen that heats as fast as the guard of heating "
            "lets it by default (20 K/min) becomes 10 K warmer, unseen",
        ),
    ] = 5.0
    """A sensor without a valid reading for this time stops, too; at most 30, and at most the time for 5 K
    at the largest planned heating rate [s].
    """
    on_temperature_stop: TemperaturePolicy = "stop"
    """After the stand was unloaded. ``"stop"``: the campaign ends (exit status 3); ``bufferstand resume``
    continues it. ``"wait-and-continue"``: wait at zero force until ``temperature_resume_C``, then run the
    remaining cycles. ``"skip"``: leave out the rest of the step, wait, continue with the next step.
    """
    no_temperature_stop: Annotated[str, Field(max_length=400)] = ""
    """The reason to test rubber or elastomer without a thermometer; at least three words and ten letters.
    """
    following_error_max_mm: Annotated[float, Field(gt=0)] = 10.0
    """Greatest distance between piston and command [mm]."""
    following_error_grace_s: Annotated[
        float,
        Field(ge=0),
        Within(0.0, 1.0, "in 1 s a piston that runs away at 50 mm/s goes 50 mm beside its command"),
    ] = 0.25
    """How long it must last to trip [s]."""

    @model_validator(mode="after")
    def _thresholds_are_apart(self) -> Self:
        if not self.temperature_resume_C < self.temperature_stop_C:
            raise WrongKeyError(
                f"temperature_resume_C = {self.temperature_resume_C} must be below "
                f"temperature_stop_C = {self.temperature_stop_C}; write temperature_resume_C below "
                f"{self.temperature_stop_C:g}, or a higher temperature_stop_C",
                "temperature_resume_C",
                "temperature_stop_C",
            )
        if self.force_trip_kN is not None and self.force_trip_kN < self.force_max_kN:
            raise WrongKeyError(
                f"force_trip_kN = {self.force_trip_kN} must not be below force_max_kN = {self.force_max_kN}; "
                f"write force_trip_kN = {self.force_max_kN:g} or more, or a smaller force_max_kN",
                "force_trip_kN",
                "force_max_kN",
            )
        trip, top = self.stroke_trip_mm, self.stroke_max_mm
        if trip is not None and top is not None and trip < top:
            raise WrongKeyError(
                f"stroke_trip_mm = {trip} must not be below stroke_max_mm = {top}; "
                f"write stroke_trip_mm = {top:g} or more, or a smaller stroke_max_mm",
                "stroke_trip_mm",
                "stroke_max_mm",
            )
        return self

    def hashed(self) -> dict[str, Any]:
        """Return what bears on a recorded result; how a campaign goes on after a stop does not."""
        return self.model_dump(mode="json", exclude=set(_NOT_OF_A_RESULT))


@dataclass(frozen=True)
class Bound:
    """One upper limit in force: its name, value and unit, and who sets it."""

    name: str
    value: float
    unit: str
    source: str

    def allows(self, value: float) -> bool:
        """Return whether ``value`` (in the bound's unit) keeps the limit, rounding errors aside."""
        return value <= self.value * (1.0 + TOLERANCE)

    def text(self) -> str:
        """Return e.g. ``stroke_max_mm = 105 mm (max_stroke_mm of the specimen)``."""
        return f"{self.name} = {self.value:g} {self.unit} ({self.source})"


@dataclass(frozen=True)
class Envelope:
    """The narrowest limits of stand, campaign and specimen, and the guards' trips that follow from them.

    ``stroke`` bounds the specimen's, ``travel`` the piston's.
    """

    force: Bound
    stroke: Bound
    frequency: Bound
    speed: Bound
    force_trip_kN: float
    stroke_trip_mm: float
    travel: Bound
    machine: Machine = RIGID

    def as_dict(self) -> dict[str, Any]:
        """Return the limits by name, each with value and source, for ``plan --json``."""
        bounds = (self.force, self.stroke, self.frequency, self.speed)
        facts: dict[str, Any] = {
            bound.name: {"value": bound.value, "source": bound.source} for bound in bounds
        }
        trips = {"force_trip_kN": self.force_trip_kN, "stroke_trip_mm": self.stroke_trip_mm}
        return facts | trips | self.machine.as_dict()


def _narrowest(name: str, unit: str, candidates: list[tuple[float | None, str]]) -> Bound:
    known = [(value, source) for value, source in candidates if value is not None]
    value, source = min(known, key=lambda entry: entry[0])
    return Bound(name, float(value), unit, source)


def envelope(stand: StandLimits, test: TestLimits, specimen: Specimen) -> Envelope:
    """Return the narrowest of the stand's, the campaign's and the specimen's limits.

    Parameters
    ----------
    stand : StandLimits
        From the stand file.
    test : TestLimits
        ``[limits]`` of the campaign.
    specimen : Specimen
        Its ``max_stroke_mm``, where known, bounds the stroke.
    """
    stand_text, test_text = "the stand", OF_CAMPAIGN
    force = _narrowest(
        "force_max_kN", "kN", [(test.force_max_kN, test_text), (stand.force_max_kN, stand_text)]
    )
    stroke = _narrowest(
        "stroke_max_mm",
        "mm",
        [
            (test.stroke_max_mm, test_text),
            (specimen.max_stroke_mm, "max_stroke_mm of the specimen"),
            (test.stroke_trip_mm, f"stroke_trip_mm in {test_text}"),
            (stand.stroke_max_mm, stand_text),
        ],
    )
    return Envelope(
        force=force,
        stroke=stroke,
        frequency=_narrowest(
            "frequency_max_Hz",
            "Hz",
            [(test.frequency_max_Hz, test_text), (stand.frequency_max_Hz, stand_text)],
        ),
        speed=_narrowest(
            "speed_max_mm_per_s",
            "mm/s",
            [(test.speed_max_mm_per_s, test_text), (stand.speed_max_mm_per_s, stand_text)],
        ),
        force_trip_kN=test.force_trip_kN or FORCE_TRIP_FACTOR * force.value,
        stroke_trip_mm=test.stroke_trip_mm or stroke.value + STROKE_TRIP_MARGIN_MM,
        travel=Bound("stroke_max_mm", float(stand.stroke_max_mm), "mm", stand_text),
        machine=stand.machine,
    )
