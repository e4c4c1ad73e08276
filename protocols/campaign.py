"""The campaign file: what is to be done, as users write it (docs/campaign-file.md)."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from foundation.canonical import file_hash
from foundation.settings import Numbers, Settings, parse_settings, read_text
from protocols.guard_table import GuardTable
from protocols.limits import TestLimits

Positive = Annotated[float, Field(gt=0)]
KINDS = ("static", "harmonic", "sweep", "hold", "cool-down")
"""Kinds of ``[[step]]``."""


def _tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


class StaticStep(Settings):
    """Compress at constant speed to a force or stroke, whichever comes first; unload at once; repeat."""

    kind: Literal["static"]
    name: str = ""
    speed_mm_per_s: Positive = 5.0
    force_limit_kN: Positive | None = None
    stroke_limit_mm: Positive | None = None
    cycles: int = Field(default=1, gt=0)
    pause_s: float = Field(default=0.0, ge=0)
    proof_load: Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9]*$")] | None = None
    """Which proof load this step applies (F1 …); it is recorded and judged as a proof run."""

    @model_validator(mode="after")
    def _proof_load_has_a_force(self) -> Self:
        if self.proof_load is not None and self.force_limit_kN is None:
            raise ValueError(
                f"a step with proof_load = “{self.proof_load}” needs the force: add force_limit_kN"
            )
        return self


class _Rated(Settings):
    """How fast a harmonic motion is: one of frequency and peak speed, v = 2π f A."""

    @staticmethod
    def exactly_one(frequency: object, speed: object) -> None:
        if (frequency is None) == (speed is None):
            raise ValueError("give exactly one of frequency_Hz and peak_speed_mm_per_s")


class HarmonicStep(_Rated):
    """A sine about ``prestress_mm`` with ``amplitude_mm`` (half the range)."""

    kind: Literal["harmonic"]
    name: str = ""
    prestress_mm: float = Field(ge=0)
    amplitude_mm: Positive
    frequency_Hz: Positive | None = None
    peak_speed_mm_per_s: Positive | None = None
    cycles: int = Field(default=5, gt=0)

    @model_validator(mode="after")
    def _one_rate(self) -> Self:
        self.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        return self

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


class SweepStep(_Rated):
    """Every combination of prestress, amplitude and frequency (or peak speed), as harmonic steps."""

    kind: Literal["sweep"]
    name: str = ""
    prestress_mm: SweepNumbers
    amplitude_mm: SweepNumbers
    frequency_Hz: SweepNumbers | None = None
    peak_speed_mm_per_s: SweepNumbers | None = None
    cycles: Annotated[int | tuple[int, ...], BeforeValidator(_tuple)] = 5
    order: Literal["given", "heat", "random"] = "given"
    seed: int | None = None
    beyond_limits: Literal["refuse", "leave-out"] = "refuse"

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
        return self

    def rates(self) -> tuple[float, ...]:
        """Return the frequencies [Hz] or peak speeds [mm/s], whichever are given."""
        return self.frequency_Hz or self.peak_speed_mm_per_s or ()

    def cycle_counts(self) -> tuple[int, ...]:
        """Return the number of cycles at each frequency or peak speed."""
        return self.cycles if isinstance(self.cycles, tuple) else (self.cycles,) * len(self.rates())


class HoldStep(Settings):
    """Stand still: at a stroke, or (without ``stroke_mm``) at zero force."""

    kind: Literal["hold"]
    name: str = ""
    stroke_mm: Positive | None = None
    duration_s: Positive


class CoolDownStep(Settings):
    """Wait at zero force until every specimen sensor is at or below ``temperature_C``."""

    kind: Literal["cool-down"]
    name: str = ""
    temperature_C: float
    timeout_s: Positive = 7200.0


def _known_kind(value: object) -> object:
    """Refuse a step without kind, or with an unknown one, before its keys are looked at."""
    if isinstance(value, dict):
        if "kind" not in value:
            raise ValueError(f"this step has no kind; give kind = one of {', '.join(KINDS)}")
        if value["kind"] not in KINDS:
            near = difflib.get_close_matches(str(value["kind"]), KINDS, n=1, cutoff=0.4)
            hint = f"did you mean “{near[0]}”?" if near else f"use one of {', '.join(KINDS)}"
            raise ValueError(f"unknown kind of step “{value['kind']}”; {hint}")
    return value


Step = StaticStep | HarmonicStep | SweepStep | HoldStep | CoolDownStep
_TaggedStep = Annotated[Annotated[Step, Field(discriminator="kind")], BeforeValidator(_known_kind)]


class CampaignFacts(Settings):
    """``[campaign]``: what it is, where it runs and on what. Paths are relative to the campaign file."""

    id: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")
    title: str = ""
    stand: str = Field(min_length=1)
    specimen: str = Field(min_length=1)
    operator: str = ""
    customer: str = ""
    note: str = ""


class Conditions(Settings):
    """``[conditions]``: what the planner assumes; the run itself measures."""

    ambient_C: float = 21.0
    specimen_C: float | None = None

    def start_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the specimen's assumed temperature at the start [°C]: that of the air unless given."""
        return self.ambient_C if self.specimen_C is None else self.specimen_C


class MotionSettings(Settings):
    """``[motion]``: how the actuator moves to and from the motion proper."""

    ramp_speed_mm_per_s: Positive = 20.0
    release_speed_mm_per_s: Positive = 20.0


class CampaignFile(Settings):
    """A campaign file."""

    campaign: CampaignFacts
    limits: TestLimits = TestLimits()
    guards: GuardTable = GuardTable()
    conditions: Conditions = Conditions()
    motion: MotionSettings = MotionSettings()
    step: Annotated[tuple[_TaggedStep, ...], BeforeValidator(_tuple), Field(min_length=1)]


@dataclass(frozen=True)
class Campaign:
    """A campaign file as read: its content, its place, and the lines at which its steps begin."""

    path: Path
    content: CampaignFile
    sha256: str
    step_lines: tuple[int | None, ...]

    @property
    def id(self) -> str:
        """The campaign's id."""
        return self.content.campaign.id

    @property
    def limits(self) -> TestLimits:
        """``[limits]``."""
        return self.content.limits

    @property
    def stand_path(self) -> Path:
        """Path of the stand file."""
        return self.path.parent / self.content.campaign.stand

    @property
    def specimen_path(self) -> Path:
        """Path of the specimen file."""
        return self.path.parent / self.content.campaign.specimen

    def place(self, number: int) -> str:
        """Return where ``[[step]]`` ``number`` (from 1) stands in the file, for messages."""
        line = self.step_lines[number - 1]
        return f"[[step]] {number}" if line is None else f"line {line}: [[step]] {number}"

    def as_dict(self) -> dict[str, Any]:
        """Return the campaign's facts for run files and ``plan --json``."""
        return self.content.campaign.model_dump(mode="json") | {"file": self.path.name, "sha256": self.sha256}


_STEP_HEADER = re.compile(r"^\s*\[\[\s*step\s*\]\]")


def _step_lines(text: str, count: int) -> tuple[int | None, ...]:
    """Return the line of each ``[[step]]``, or None for all where they are written some other way."""
    lines = [number for number, line in enumerate(text.splitlines(), start=1) if _STEP_HEADER.match(line)]
    return tuple(lines) if len(lines) == count else (None,) * count


def load_campaign(path: Path) -> Campaign:
    """Read a campaign file.

    Raises
    ------
    BadInput
        If it cannot be read, is no TOML, or a key is unknown, missing or has a value that cannot be.
    """
    text = read_text(path)
    content = parse_settings(text, CampaignFile, path)
    return Campaign(path, content, file_hash(path), _step_lines(text, len(content.step)))
