"""Steps that are cycles: static tests, sines, sweeps, inner loops, conditioning."""

from __future__ import annotations

import math
from itertools import pairwise, product
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.foundation import Purpose
from bufferstand.foundation.settings import Within, WrongKeyError
from bufferstand.protocols.bounded_numbers import (  # fmt: skip
    Cycles,
    Force,
    Frequency,
    Pause,
    Speed,
    Stroke,
    StrokeFromZero,
    bounds_of,
)
from bufferstand.protocols.campaign_file.step_kinds.common import (
    HarmonicRateStep,
    StepSettings,
    SweepNumbers,
    UntilSteady,
    as_tuple,
)


class StaticStep(StepSettings):
    """Compress at constant speed to a force or stroke, whichever comes first; unload at once; repeat."""

    kind: Literal["static"]
    speed_mm_per_s: Speed = 5.0
    """Both ways (EN 15551: at most 50) [mm/s]."""
    force_limit_kN: Force | None = None
    """It turns at this force, or at ``stroke_limit_mm``, whichever comes first [kN]. Default:
    ``force_max_kN`` that applies.
    """
    stroke_limit_mm: Stroke | None = None
    """It turns at this stroke, or at ``force_limit_kN`` [mm]. Default: ``stroke_max_mm`` that applies.
    """
    cycles: Cycles = 1
    """Three allow the EN 15551 verdicts."""
    pause_s: Pause = 0.0
    """At zero between two cycles (EN 15551: at most 600) [s]."""
    proof_load: (
        Annotated[
            str,
            Field(
                pattern=r"^[A-Z][A-Z0-9]*$",
                description="a capital letter, then capitals or digits, e.g. “F1”",
            ),
        ]
        | None
    ) = None
    """``"F1"`` … ``"F6"``: apply that proof load, up to ``force_limit_kN``, which is then required."""
    purpose: Purpose | None = None
    """``"conformity"``: the conformity test of this specimen. ``"characterisation"``: no conformity
    statement. Not given: the evaluation takes the first static run that meets the conditions. Not part of
    the plan hash.
    """

    @model_validator(mode="after")
    def _proof_load_has_a_force(self) -> Self:
        if self.proof_load is not None and self.force_limit_kN is None:
            raise WrongKeyError(
                f"a step with proof_load = “{self.proof_load}” needs the force: add force_limit_kN",
                "proof_load",
                "force_limit_kN",
            )
        return self


def _cycles_or_steady(step: HarmonicStep | SweepStep) -> None:
    if step.until_steady is not None and "cycles" in step.model_fields_set:
        raise WrongKeyError(
            "give cycles or [step.until_steady] (with its min_cycles and max_cycles), not both", "cycles"
        )


class HarmonicStep(HarmonicRateStep):
    """A sine about ``prestress_mm`` with ``amplitude_mm`` (half the range)."""

    kind: Literal["harmonic"]
    prestress_mm: StrokeFromZero
    """Mean stroke [mm]."""
    amplitude_mm: Stroke
    """Half the range; at most the prestress, so that contact is never lost [mm]."""
    frequency_Hz: Frequency | None = None
    """Either this or ``peak_speed_mm_per_s`` [Hz]."""
    peak_speed_mm_per_s: Speed | None = None
    """Instead of ``frequency_Hz``: v = 2π f A [mm/s]."""
    cycles: Cycles = 5
    """At full amplitude."""
    until_steady: UntilSteady | None = None
    """Instead of ``cycles``: end when settled."""

    @model_validator(mode="after")
    def _one_rate(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        _cycles_or_steady(self)
        return self

    def has_its_place(self) -> bool:
        """Return whether it stays where it is written unless it says otherwise; a sine need not."""
        return False

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


class SweepStep(HarmonicRateStep):
    """Every combination of prestress, amplitude and frequency (or peak speed), as harmonic steps."""

    kind: Literal["sweep"]
    prestress_mm: Annotated[SweepNumbers, bounds_of(StrokeFromZero)]
    """List, or one number [mm]."""
    amplitude_mm: Annotated[SweepNumbers, bounds_of(Stroke)]
    """List [mm]."""
    frequency_Hz: Annotated[SweepNumbers, bounds_of(Frequency)] | None = None
    """List; either this or ``peak_speed_mm_per_s`` [Hz]."""
    peak_speed_mm_per_s: Annotated[SweepNumbers, bounds_of(Speed)] | None = None
    """List, instead of ``frequency_Hz`` [mm/s]."""
    cycles: Annotated[int | tuple[int, ...], BeforeValidator(as_tuple), bounds_of(Cycles)] = 5
    """One number, or one per frequency or peak speed."""
    order: Literal["given", "heat", "random"] = "given"
    """``"given"``: prestress outermost, frequency innermost. ``"heat"``: least heating first. ``"random"``:
    by ``seed``, so that warming is not taken for an effect of frequency.
    """
    seed: Annotated[int, Within(-(2**63), 2**63 - 1, "a seed is a number of 64 bits")] | None = None
    """Required with ``order = "random"``; the same seed always gives the same order."""
    beyond_limits: Literal["refuse", "leave-out"] = "refuse"
    """``"leave-out"``: skip combinations that break a limit; the plan lists them."""
    until_steady: UntilSteady | None = None
    """Instead of ``cycles``: end when settled."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        for name in ("amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s"):
            if any(not value > 0.0 for value in getattr(self, name) or ()):
                raise WrongKeyError(f"every value of {name} must be positive", name)
        if any(value < 0.0 for value in self.prestress_mm):
            raise WrongKeyError("no value of prestress_mm may be below zero", "prestress_mm")
        if any(count < 1 for count in self.cycle_counts()):
            raise WrongKeyError("every value of cycles must be at least 1", "cycles")
        if len(self.cycle_counts()) != len(self.rates()):
            raise WrongKeyError(
                f"cycles lists {len(self.cycle_counts())} values for {len(self.rates())} frequencies or "
                "peak speeds: give one number, or one for each of them",
                "cycles",
            )
        if self.order == "random" and self.seed is None:
            raise WrongKeyError(
                "order = “random” needs a seed, so that the plan is the same each time", "order", "seed"
            )
        if self.order != "random" and self.seed is not None:
            raise WrongKeyError(
                "seed has a meaning with order = “random” only; leave it out, or write that order",
                "seed",
                "order",
            )
        _cycles_or_steady(self)
        return self

    def has_its_place(self) -> bool:
        """Return whether its steps stay in their order unless it says otherwise; one drawn at random does."""
        return self.order == "random"

    def rates(self) -> tuple[float, ...]:
        """Return the frequencies [Hz] or peak speeds [mm/s], whichever are given."""
        return self.frequency_Hz or self.peak_speed_mm_per_s or ()

    def cycle_counts(self) -> tuple[int, ...]:
        """Return the number of cycles at each frequency or peak speed."""
        return self.cycles if isinstance(self.cycles, tuple) else (self.cycles,) * len(self.rates())


class SineOrSlow(HarmonicRateStep):
    """Cycles that are harmonic about a prestress, or at constant speed to a limit."""

    prestress_mm: StrokeFromZero | None = None
    """Of a sine: mean stroke [mm]."""
    amplitude_mm: Stroke | None = None
    """Of a sine: half the range [mm]."""
    frequency_Hz: Frequency | None = None
    """Of a sine: this or ``peak_speed_mm_per_s`` [Hz]."""
    peak_speed_mm_per_s: Speed | None = None
    """Of a sine, instead of ``frequency_Hz`` [mm/s]."""
    speed_mm_per_s: Speed | None = None
    """Of slow strokes, instead of a sine [mm/s]. Default: 5."""
    force_limit_kN: Force | None = None
    """Of slow strokes: they turn at this force [kN]. Default: the limit that applies."""
    stroke_limit_mm: Stroke | None = None
    """Of slow strokes: they turn at this stroke [mm]. Default: the limit that applies."""
    record: bool = False
    """True: record as a ``harmonic`` or ``static`` run; conditioning is marked as such."""

    def most_cycles(self) -> int:
        """Return how many cycles it can have."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _harmonic_or_static(self) -> Self:
        given = self.model_fields_set
        sine = sorted(given & {"prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s"})
        slow = sorted(given & {"speed_mm_per_s", "force_limit_kN", "stroke_limit_mm"})
        if sine and slow:
            raise WrongKeyError(
                f"give the keys of a sine or of slow strokes, not both ({sine[0]}, {slow[0]})",
                sine[0],
                slow[0],
            )
        if sine:
            for key in ("prestress_mm", "amplitude_mm"):
                if getattr(self, key) is None:
                    raise WrongKeyError(f"a {self.what()} sine needs {key}", *sine)
            self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        return self

    def what(self) -> str:
        """Return what a person calls it."""
        return "conditioning"

    def as_step(self) -> HarmonicStep | StaticStep:
        """Return the step whose motion it makes."""
        if self.prestress_mm is not None and self.amplitude_mm is not None:
            return HarmonicStep(
                kind="harmonic",
                prestress_mm=self.prestress_mm,
                amplitude_mm=self.amplitude_mm,
                frequency_Hz=self.frequency_Hz,
                peak_speed_mm_per_s=self.peak_speed_mm_per_s,
                cycles=self.most_cycles(),
            )
        return StaticStep(
            kind="static",
            speed_mm_per_s=self.speed_mm_per_s or 5.0,
            force_limit_kN=self.force_limit_kN,
            stroke_limit_mm=self.stroke_limit_mm,
            cycles=self.most_cycles(),
        )


class ConditioningStep(SineOrSlow):
    """Cycles before a test, not judged."""

    kind: Literal["conditioning"]
    cycles: Cycles = 3
    """Number of cycles."""

    def most_cycles(self) -> int:
        """Return how many cycles it has."""
        return self.cycles


class InnerLoopsStep(HarmonicRateStep):
    """Small loops of several amplitudes about several mean strokes, all in one compression.

    The ramps between them run up the loading branch: what the transition between the branches is
    identified from.
    """

    kind: Literal["inner-loops"]
    mean_mm: Annotated[SweepNumbers, bounds_of(Stroke)]
    """List, increasing [mm]."""
    amplitude_mm: Annotated[SweepNumbers, bounds_of(Stroke)]
    """List, increasing [mm]."""
    frequency_Hz: Frequency | None = None
    """Of every loop: this or ``peak_speed_mm_per_s`` [Hz]."""
    peak_speed_mm_per_s: Speed | None = None
    """Of every loop, instead of ``frequency_Hz`` [mm/s]."""
    cycles: Cycles = 2
    """Of every loop, at full amplitude."""

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        if any(not value > 0.0 for value in (*self.mean_mm, *self.amplitude_mm)):
            raise WrongKeyError(
                "every value of mean_mm and amplitude_mm must be positive", "mean_mm", "amplitude_mm"
            )
        for name in ("mean_mm", "amplitude_mm"):
            values = getattr(self, name)
            if any(after <= before for before, after in pairwise(values)):
                raise WrongKeyError(
                    f"{name} must increase from value to value: the loops lie on the loading path", name
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
