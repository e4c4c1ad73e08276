"""A planned step: an ordered list of motions with what is expected of each and of all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from bufferstand.foundation import Harmonic, Kind, Purpose, StaticCycles
from bufferstand.protocols.steps.conditions import Heating, StartBand, Steadiness, Warmth
from bufferstand.protocols.steps.motions import ForceCycles, Motion, WaitUntilCool, motion_dict
from bufferstand.protocols.steps.turning import ExpectedTurns, MotionEstimate


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
        ``static``, ``harmonic``, ``hold``, ``conditioning``, ``inner-loops``, ``motion``, ``cool-down``,
        ``touch``, ``warm-up`` or ``force-cycles``.
    run_kind : Kind or None
        Kind of the recorded run; None for a step that is not recorded.
    place : str
        Where it comes from in the campaign file.
    motions : tuple of Motion
        In order; it begins at zero force and ends there.
    estimates : tuple of MotionEstimate
        One for each motion; their durations and ``wait_s`` add up to ``duration_s``.
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
        Of the wait before and of all motions, if nothing stops them.
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
    compensate : bool
        Whether the strokes asked for are the specimen's; False: the piston's.
    start_band : StartBand or None
        How warm the specimen is when the motions begin; None: as warm as it is.
    wait_s : float
        How long it is expected to wait for that [s]; part of ``duration_s``.
    temperature_stop_C, temperature_resume_C : float or None
        Its own thresholds [°C]; None: those of the campaign.
    warmth : Warmth or None
        It repeats its motions until the specimen is so warm; ``cycles`` are the most then.
    expected_cycles : float or None
        How many that should take by the model; None where ``cycles`` says it, or where nobody knows the
        specimen's heat (:attr:`is_open`).
    heating : Heating or None
        What the model says of warming up; None for any other step.
    asked : mapping
        What the campaign file asks for: the keys of its ``[[step]]`` that differ from their defaults, without
        names, waits and limits. By it a step is the same test though limits were edited.
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
    compensate: bool = True
    start_band: StartBand | None = None
    wait_s: float = 0.0
    temperature_stop_C: float | None = None
    temperature_resume_C: float | None = None
    warmth: Warmth | None = None
    expected_cycles: float | None = None
    heating: Heating | None = None
    asked: Mapping[str, Any] = field(default_factory=dict)

    @property
    def ends_early(self) -> bool:
        """Whether it may end before all of its cycles are done."""
        return self.steady is not None or self.warmth is not None

    @property
    def nobody_says_heat(self) -> bool:
        """Whether its heat of 0 stands for one that is not known, where heat cannot be predicted."""
        return not (self.expected_heat_J > 0.0 or self.only_waits)

    @property
    def is_open(self) -> bool:
        """Whether nobody can say how many cycles it takes: duration and disk are the most then, heat is 0."""
        return self.warmth is not None and self.expected_cycles is None

    @property
    def turns(self) -> ExpectedTurns | None:
        """Where its cycles are expected to turn; None where it has none."""
        for motion, estimate in zip(self.motions, self.estimates, strict=True):
            if isinstance(motion, Harmonic | StaticCycles | ForceCycles):
                return estimate.turns
        return None

    @property
    def only_waits(self) -> bool:
        """Whether nothing moves in it: a warm specimen does no harm meanwhile."""
        return all(isinstance(motion, WaitUntilCool) for motion in self.motions)

    def as_dict(self) -> dict[str, Any]:
        """Return the step as JSON-ready data, for run files and ``plan --json``."""
        content = asdict(self)
        content["motions"] = [motion_dict(motion) for motion in self.motions]
        content["estimates"] = [estimate.as_dict() for estimate in self.estimates]
        content["stops"] = [asdict(stop) for stop in self.stops]
        return content
