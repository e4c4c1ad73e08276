"""The kinds of ``[[step]]`` of a campaign file, as users write them (docs/campaign-file.md)."""

from __future__ import annotations

import math
from itertools import pairwise, product
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from foundation.purpose import Purpose
from foundation.settings import Numbers, Settings
from protocols.steps import Steadiness

Positive = Annotated[float, Field(gt=0)]


def as_tuple(value: object) -> object:
    """Take a TOML array for a tuple."""
    return tuple(value) if isinstance(value, list) else value


class StepSettings(Settings):
    """What every step has."""

    name: str = ""
    keep_order: bool | None = None
    """Whether ``order = "soonest"`` leaves it where it is; None: as its kind does (:meth:`stays`)."""

    def stays(self) -> bool:
        """Return whether the step must stay where it is written when the campaign is put in order.

        A sine may go anywhere; a static test, a proof load, conditioning, a hold or a user's own motion has
        its place for a reason.
        """
        return True if self.keep_order is None else self.keep_order


class UntilSteady(Settings):
    """``[step.until_steady]``: the step ends when its cycles have settled."""

    damping_percent: Positive = 1.0
    stiffness_percent: Positive = 1.0
    window: int = Field(default=3, ge=2)
    min_cycles: int = Field(default=5, ge=1)
    max_cycles: int = Field(default=30, ge=1)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.min_cycles < self.window:
            raise ValueError(
                f"min_cycles = {self.min_cycles} is fewer than window = {self.window}: "
                "so few cycles cannot be compared"
            )
        if self.max_cycles < self.min_cycles:
            raise ValueError(
                f"max_cycles = {self.max_cycles} must not be below min_cycles = {self.min_cycles}"
            )
        return self

    def criterion(self) -> Steadiness:
        """Return it as the plan carries it."""
        return Steadiness(**self.model_dump())


class StaticStep(StepSettings):
    """Compress at constant speed to a force or stroke, whichever comes first; unload at once; repeat."""

    kind: Literal["static"]
    speed_mm_per_s: Positive = 5.0
    force_limit_kN: Positive | None = None
    stroke_limit_mm: Positive | None = None
    cycles: int = Field(default=1, gt=0)
    pause_s: float = Field(default=0.0, ge=0)
    proof_load: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9]*$")] | None = None
    """Which proof load this step applies (F1 …); it is recorded and judged as a proof run."""
    purpose: Purpose | None = None
    """Whether the run is a conformity test of the specimen; None: the evaluation decides."""

    @model_validator(mode="after")
    def _proof_load_has_a_force(self) -> Self:
        if self.proof_load is not None and self.force_limit_kN is None:
            raise ValueError(
                f"a step with proof_load = “{self.proof_load}” needs the force: add force_limit_kN"
            )
        return self


class Rated(StepSettings):
    """How fast a harmonic motion is: one of frequency and peak speed, v = 2π f A."""

    @staticmethod
    def exactly_one(frequency: object, speed: object) -> None:
        """Refuse both, and neither."""
        if (frequency is None) == (speed is None):
            raise ValueError("give exactly one of frequency_Hz and peak_speed_mm_per_s")


def _cycles_or_steady(step: HarmonicStep | SweepStep) -> None:
    if step.until_steady is not None and "cycles" in step.model_fields_set:
        raise ValueError("give cycles or [step.until_steady] (with its min_cycles and max_cycles), not both")


class HarmonicStep(Rated):
    """A sine about ``prestress_mm`` with ``amplitude_mm`` (half the range)."""

    kind: Literal["harmonic"]
    prestress_mm: float = Field(ge=0)
    amplitude_mm: Positive
    frequency_Hz: Positive | None = None
    peak_speed_mm_per_s: Positive | None = None
    cycles: int = Field(default=5, gt=0)
    until_steady: UntilSteady | None = None

    @model_validator(mode="after")
    def _one_rate(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        _cycles_or_steady(self)
        return self

    def stays(self) -> bool:
        """Return whether it must stay where it is written; a sine need not."""
        return bool(self.keep_order)

    def most_cycles(self) -> int:
        """Return how many cycles it has, or can have at most where it ends when it is steady."""
        return self.cycles if self.until_steady is None else self.until_steady.max_cycles

    def rate(self) -> tuple[float, float]:
        """Return frequency [Hz] and peak speed [mm/s]; v = 2π f A."""
        per_Hz = 2.0 * math.pi * self.amplitude_mm
        if self.frequency_Hz is not None:
            return self.frequency_Hz, per_Hz * self.frequency_Hz
        speed = self.peak_speed_mm_per_s or 0.0
        return speed / per_Hz, speed


def _one_or_more(value: object) -> object:
    """Take a single number for a list of one."""
    return (value,) if isinstance(value, int | float) and not isinstance(value, bool) else value


SweepNumbers = Annotated[Numbers, Field(min_length=1), BeforeValidator(_one_or_more)]


class SweepStep(Rated):
    """Every combination of prestress, amplitude and frequency (or peak speed), as harmonic steps."""

    kind: Literal["sweep"]
    prestress_mm: SweepNumbers
    amplitude_mm: SweepNumbers
    frequency_Hz: SweepNumbers | None = None
    peak_speed_mm_per_s: SweepNumbers | None = None
    cycles: Annotated[int | tuple[int, ...], BeforeValidator(as_tuple)] = 5
    order: Literal["given", "heat", "random"] = "given"
    seed: int | None = None
    beyond_limits: Literal["refuse", "leave-out"] = "refuse"
    until_steady: UntilSteady | None = None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        for name in ("amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s"):
            if any(not value > 0.0 for value in getattr(self, name) or ()):
                raise ValueError(f"every value of {name} must be positive")
        if any(value < 0.0 for value in self.prestress_mm):
            raise ValueError("no value of prestress_mm may be below zero")
        if any(count < 1 for count in self.cycle_counts()):
            raise ValueError("every value of cycles must be at least 1")
        if len(self.cycle_counts()) != len(self.rates()):
            raise ValueError(
                f"cycles lists {len(self.cycle_counts())} values for {len(self.rates())} frequencies or "
                "peak speeds: give one number, or one for each of them"
            )
        if self.order == "random" and self.seed is None:
            raise ValueError("order = “random” needs a seed, so that the plan is the same each time")
        if self.order != "random" and self.seed is not None:
            raise ValueError("seed has a meaning with order = “random” only")
        _cycles_or_steady(self)
        return self

    def stays(self) -> bool:
        """Return whether its steps must stay in their order; one that was drawn at random must."""
        return self.order == "random" if self.keep_order is None else self.keep_order

    def rates(self) -> tuple[float, ...]:
        """Return the frequencies [Hz] or peak speeds [mm/s], whichever are given."""
        return self.frequency_Hz or self.peak_speed_mm_per_s or ()

    def cycle_counts(self) -> tuple[int, ...]:
        """Return the number of cycles at each frequency or peak speed."""
        return self.cycles if isinstance(self.cycles, tuple) else (self.cycles,) * len(self.rates())


class HoldStep(StepSettings):
    """Stand still: at a stroke, where a force is reached, or (without either) at zero force."""

    kind: Literal["hold"]
    stroke_mm: Positive | None = None
    force_kN: Positive | None = None
    duration_s: Positive
    approach_speed_mm_per_s: Positive = 1.0
    record: bool = False

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.stroke_mm is not None and self.force_kN is not None:
            raise ValueError("give stroke_mm or force_kN, not both: it stands still at one place")
        if self.force_kN is None and "approach_speed_mm_per_s" in self.model_fields_set:
            raise ValueError("approach_speed_mm_per_s has a meaning with force_kN only")
        return self


class ConditioningStep(Rated):
    """Cycles before a test, not judged: harmonic about a prestress, or at constant speed to a limit."""

    kind: Literal["conditioning"]
    prestress_mm: Annotated[float, Field(ge=0)] | None = None
    amplitude_mm: Positive | None = None
    frequency_Hz: Positive | None = None
    peak_speed_mm_per_s: Positive | None = None
    speed_mm_per_s: Positive | None = None
    force_limit_kN: Positive | None = None
    stroke_limit_mm: Positive | None = None
    cycles: int = Field(default=3, gt=0)
    record: bool = False

    @model_validator(mode="after")
    def _harmonic_or_static(self) -> Self:
        given = self.model_fields_set
        sine = sorted(given & {"prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s"})
        slow = sorted(given & {"speed_mm_per_s", "force_limit_kN", "stroke_limit_mm"})
        if sine and slow:
            raise ValueError(f"give the keys of a sine or of slow strokes, not both ({sine[0]}, {slow[0]})")
        if sine:
            for key in ("prestress_mm", "amplitude_mm"):
                if getattr(self, key) is None:
                    raise ValueError(f"a conditioning sine needs {key}")
            self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        return self

    def as_step(self) -> HarmonicStep | StaticStep:
        """Return the step whose motion it makes."""
        if self.prestress_mm is not None and self.amplitude_mm is not None:
            return HarmonicStep(
                kind="harmonic",
                prestress_mm=self.prestress_mm,
                amplitude_mm=self.amplitude_mm,
                frequency_Hz=self.frequency_Hz,
                peak_speed_mm_per_s=self.peak_speed_mm_per_s,
                cycles=self.cycles,
            )
        return StaticStep(
            kind="static",
            speed_mm_per_s=self.speed_mm_per_s or 5.0,
            force_limit_kN=self.force_limit_kN,
            stroke_limit_mm=self.stroke_limit_mm,
            cycles=self.cycles,
        )


class InnerLoopsStep(Rated):
    """Small loops of several amplitudes about several mean strokes, all in one compression.

    The ramps between them run up the loading branch: what the transition between the branches is
    identified from.
    """

    kind: Literal["inner-loops"]
    mean_mm: SweepNumbers
    amplitude_mm: SweepNumbers
    frequency_Hz: Positive | None = None
    peak_speed_mm_per_s: Positive | None = None
    cycles: int = Field(default=2, gt=0)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        if any(not value > 0.0 for value in (*self.mean_mm, *self.amplitude_mm)):
            raise ValueError("every value of mean_mm and amplitude_mm must be positive")
        for name in ("mean_mm", "amplitude_mm"):
            values = getattr(self, name)
            if any(after <= before for before, after in pairwise(values)):
                raise ValueError(
                    f"{name} must increase from value to value: the loops lie on the loading path"
                )
        return self

    def loops(self) -> tuple[HarmonicStep, ...]:
        """Return its loops in order: mean stroke outermost."""
        return tuple(
            HarmonicStep(
                kind="harmonic",
                prestress_mm=mean,
                amplitude_mm=amplitude,
                frequency_Hz=self.frequency_Hz,
                peak_speed_mm_per_s=self.peak_speed_mm_per_s,
                cycles=self.cycles,
            )
            for mean, amplitude in product(self.mean_mm, self.amplitude_mm)
        )


class RampPiece(Settings):
    """To a stroke, or until a force is reached, at constant speed."""

    do: Literal["ramp"]
    to_mm: Annotated[float, Field(ge=0)] | None = None
    to_kN: Positive | None = None
    speed_mm_per_s: Positive

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.to_mm is None) == (self.to_kN is None):
            raise ValueError("a ramp needs exactly one of to_mm and to_kN")
        return self


class HoldPiece(Settings):
    """Stand still."""

    do: Literal["hold"]
    duration_s: Positive


class HarmonicPiece(Settings):
    """A sine about the stroke at which the piece before it ended."""

    do: Literal["harmonic"]
    amplitude_mm: Positive
    frequency_Hz: Positive | None = None
    peak_speed_mm_per_s: Positive | None = None
    cycles: int = Field(default=1, gt=0)

    @model_validator(mode="after")
    def _one_rate(self) -> Self:
        Rated.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        return self

    def about(self, mean_mm: float) -> HarmonicStep:
        """Return it as a sine about a mean stroke."""
        return HarmonicStep(kind="harmonic", prestress_mm=mean_mm, **self.model_dump(exclude={"do"}))


class ReleasePiece(Settings):
    """Back to zero force."""

    do: Literal["release"]
    speed_mm_per_s: Positive | None = None


Piece = Annotated[RampPiece | HoldPiece | HarmonicPiece | ReleasePiece, Field(discriminator="do")]


class MotionStep(StepSettings):
    """A motion that the user composes of pieces; it is released at its end in any case."""

    kind: Literal["motion"]
    piece: Annotated[tuple[Piece, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    record: bool = True

    @model_validator(mode="after")
    def _sines_know_where_they_are(self) -> Self:
        after_force = False
        for number, piece in enumerate(self.piece, start=1):
            if isinstance(piece, RampPiece):
                after_force = piece.to_kN is not None
            elif isinstance(piece, ReleasePiece):
                after_force = False
            elif isinstance(piece, HarmonicPiece) and after_force:
                raise ValueError(
                    f"piece {number} is a sine after a ramp to a force, whose stroke is not known before: "
                    "ramp to a stroke (to_mm) first"
                )
        return self


class CoolDownStep(StepSettings):
    """Wait at zero force until every specimen sensor is at or below ``temperature_C``."""

    kind: Literal["cool-down"]
    temperature_C: float
    timeout_s: Positive = 7200.0

    def stays(self) -> bool:
        """Return whether it stays in place although the planner sets pauses of its own."""
        return bool(self.keep_order)


SingleStep = (
    StaticStep | HarmonicStep | HoldStep | ConditioningStep | InnerLoopsStep | MotionStep | CoolDownStep
)
"""What becomes one step of the plan."""
Step = SingleStep | SweepStep
"""What ``[[step]]`` can be."""
KINDS = (
    "static", "harmonic", "sweep", "hold", "conditioning", "inner-loops", "motion", "cool-down",
)  # fmt: skip
"""Kinds of ``[[step]]``."""
