"""Motions as data, and a planned step: an ordered list of them with what is expected of it.

Strokes are required ones [mm], from first contact, compression positive; amplitude is half the range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

from foundation.kind import Kind
from foundation.purpose import Purpose


@dataclass(frozen=True)
class RampTo:
    """Move to a stroke at constant speed."""

    name: ClassVar[str] = "ramp"
    target_mm: float
    speed_mm_per_s: float

    def duration_s(self, from_mm: float) -> float:
        """Return how long it takes from stroke ``from_mm`` [s]."""
        return abs(self.target_mm - from_mm) / self.speed_mm_per_s

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002 - every motion answers alike
        """Return the stroke at its end [mm]."""
        return self.target_mm


@dataclass(frozen=True)
class Release:
    """Ramp to zero force."""

    name: ClassVar[str] = "release"
    speed_mm_per_s: float

    def duration_s(self, from_mm: float) -> float:
        """Return how long it takes from stroke ``from_mm`` [s]; zero force is at first contact."""
        return max(0.0, from_mm) / self.speed_mm_per_s

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return 0.0


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
class Harmonic:
    """Sine about ``mean_mm``, where it must stand already: one cycle in, ``cycles`` full ones, one out."""

    name: ClassVar[str] = "harmonic"
    FADE_CYCLES: ClassVar[int] = 2
    mean_mm: float
    amplitude_mm: float
    frequency_Hz: float
    cycles: int

    def duration_s(self, from_mm: float) -> float:  # noqa: ARG002
        """Return how long it takes [s], the cycle in and the cycle out included."""
        return (self.cycles + self.FADE_CYCLES) / self.frequency_Hz

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return self.mean_mm

    @property
    def peak_speed_mm_per_s(self) -> float:
        """The greatest speed [mm/s]: 2π f A."""
        return 2.0 * math.pi * self.frequency_Hz * self.amplitude_mm


@dataclass(frozen=True)
class StaticCycles:
    """Compress from zero at constant speed to a limit, unload at once to zero; ``cycles`` times."""

    name: ClassVar[str] = "static"
    speed_mm_per_s: float
    force_limit_kN: float
    stroke_limit_mm: float
    cycles: int
    pause_s: float

    def end_mm(self, from_mm: float) -> float:  # noqa: ARG002
        """Return the stroke at its end [mm]."""
        return 0.0


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


Motion = RampTo | RampToForce | Release | Hold | WaitUntilCool | Harmonic | StaticCycles
"""What the runner executes. How long a wait for cooling, a static cycle or a ramp to a force takes only the
model can say."""


def motion_dict(motion: Motion) -> dict[str, Any]:
    """Return a motion as data: its name under ``motion``, and its parameters."""
    return {"motion": motion.name, **asdict(motion)}


@dataclass(frozen=True)
class Steadiness:
    """When a harmonic step has settled: damping and stiffness of its last cycles hardly differ.

    Parameters
    ----------
    damping_percent, stiffness_percent : float
        Greatest spread (largest less smallest, relative to their mean) over the window [%].
    window : int
        Over how many cycles, at least 2.
    min_cycles, max_cycles : int
        Not before the first; at the second it ends in any case.
    """

    damping_percent: float
    stiffness_percent: float
    window: int
    min_cycles: int
    max_cycles: int

    def reached(self, damping: Sequence[float], stiffness: Sequence[float]) -> bool:
        """Return whether the cycles so far have settled.

        Parameters
        ----------
        damping, stiffness : sequence of float
            Of every full-amplitude cycle so far, in order; a value that is not finite is not steady.

        Raises
        ------
        ValueError
            If they are not equally many.
        """
        if len(damping) != len(stiffness):
            raise ValueError(f"{len(damping)} values of damping for {len(stiffness)} of stiffness")
        if len(damping) < self.min_cycles:
            return False
        return (
            _spread(damping[-self.window :]) * 100.0 <= self.damping_percent
            and _spread(stiffness[-self.window :]) * 100.0 <= self.stiffness_percent
        )


def _spread(values: Sequence[float]) -> float:
    """Return largest less smallest, relative to the mean's size; infinite where that says nothing."""
    mean = abs(sum(values)) / len(values)
    spread = max(values) - min(values)
    if not math.isfinite(mean) or not math.isfinite(spread):
        return math.inf
    if spread == 0.0:
        return 0.0
    return spread / mean if mean > 0.0 else math.inf


@dataclass(frozen=True)
class MotionEstimate:
    """What is expected of one motion: duration, heat, and the specimen's temperature at its end."""

    duration_s: float
    heat_J: float
    end_temperature_C: float


@dataclass(frozen=True)
class ExpectedStop:
    """Where the temperature stop is expected within a step.

    Parameters
    ----------
    at_s : float
        Time from the step's start, waits included [s].
    cycles_done : float
        Full-amplitude cycles done by then.
    wait_s : float or None
        How long cooling to the resume temperature takes; None if the air is too warm for it.
    """

    at_s: float
    cycles_done: float
    wait_s: float | None


@dataclass(frozen=True)
class PlannedStep:
    """One step of the plan: what the runner executes, what is expected of it, and its hash.

    Parameters
    ----------
    index : int
        Position in the plan, from 1.
    name : str
        What the user calls it, or what it does.
    kind : str
        ``static``, ``harmonic``, ``hold``, ``conditioning``, ``inner-loops``, ``motion`` or ``cool-down``.
    run_kind : Kind or None
        Kind of the recorded run; None for a step that is not recorded.
    place : str
        Where it comes from in the campaign file.
    motions : tuple of Motion
        In order; it begins at zero force and ends there.
    estimates : tuple of MotionEstimate
        One for each motion; their durations add up to ``duration_s``.
    prestress_mm, amplitude_mm, frequency_Hz, peak_speed_mm_per_s : float or None
        Parameters of the motion, where it has them.
    cycles : int or None
        Full cycles required, of all motions together; at most so many where it ends when ``steady``.
    expected_peak_force_kN : float or None
        By the model, at the temperature at the step's start; of the first loading, where that is more than
        the settled loop.
    expected_heat_J : float
        Absorbed until the step's end, or the temperature stop that ends it.
    start_temperature_C, end_temperature_C, max_temperature_C : float
        Of the specimen's mass, by the model's heat law.
    sensor_end_temperature_C, sensor_max_temperature_C : float
        Of the sensor on it, which decides the temperature stop.
    duration_s : float
        Of all motions, if nothing stops them.
    expected_duration_s : float
        With the expected temperature stops: cut short, or with the waits.
    disk_bytes : int
        At most, before compression; 0 for a step that is not recorded.
    stops : tuple of ExpectedStop
        Where the temperature stop is expected.
    plan_hash : str
        SHA-256 of motions, specimen and limits, and of how many like it came before (for ``resume``).
    proof_load : str or None
        Which proof load the step applies (F1 …); None for any other step.
    steady : Steadiness or None
        When it ends before ``cycles``; None: never.
    pause : bool
        Whether the planner has put it in: it belongs to the order, not to the test, and is set anew while the
        campaign runs.
    purpose : str or None
        ``conformity`` or ``characterisation``, where the campaign says so; part of the run file, and not of
        ``plan_hash``: it moves nothing.
    """

    index: int
    name: str
    kind: str
    run_kind: Kind | None
    place: str
    motions: tuple[Motion, ...]
    estimates: tuple[MotionEstimate, ...]
    prestress_mm: float | None
    amplitude_mm: float | None
    frequency_Hz: float | None
    peak_speed_mm_per_s: float | None
    cycles: int | None
    expected_peak_force_kN: float | None
    expected_heat_J: float
    start_temperature_C: float
    end_temperature_C: float
    max_temperature_C: float
    sensor_end_temperature_C: float
    sensor_max_temperature_C: float
    duration_s: float
    expected_duration_s: float
    disk_bytes: int
    stops: tuple[ExpectedStop, ...]
    plan_hash: str
    proof_load: str | None = None
    steady: Steadiness | None = None
    pause: bool = False
    purpose: Purpose | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the step as JSON-ready data, for run files and ``plan --json``."""
        content = asdict(self)
        content["motions"] = [motion_dict(motion) for motion in self.motions]
        content["estimates"] = [asdict(estimate) for estimate in self.estimates]
        content["stops"] = [asdict(stop) for stop in self.stops]
        return content


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
        if isinstance(motion, Harmonic | StaticCycles):
            left = motion.cycles - max(0, cycles_done - total)
            total += motion.cycles
            rest.append(replace(motion, cycles=left) if left > 0 else Hold(0.0))
        else:
            rest.append(motion)
    return () if 0 < total <= cycles_done else tuple(rest)
