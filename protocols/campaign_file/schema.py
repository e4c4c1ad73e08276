"""The campaign file: what is to be done, as users write it (docs/campaign-file.md)."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from bufferstand.foundation import BadInput, PublishedCampaign
from bufferstand.foundation.files import file_hash
from bufferstand.foundation.settings import Settings, Within, parse_settings, read_text
from bufferstand.protocols.bounded_numbers import Air, Speed, Temperature
from bufferstand.protocols.campaign_file.guard_table import GuardTable
from bufferstand.protocols.campaign_file.step_kinds import (
    KINDS,
    RepeatStep,
    Step,
    as_tuple,
    checked_kind,
)
from bufferstand.protocols.campaign_file.stroke_table import StrokeTable
from bufferstand.protocols.campaign_file.zero_table import ZeroTable
from bufferstand.protocols.limits import TestLimits

_TaggedStep = Annotated[Annotated[Step, Field(discriminator="kind")], BeforeValidator(checked_kind(KINDS))]


class CampaignFacts(Settings):
    """``[campaign]``: what it is, where it runs and on what. Paths are relative to the campaign file."""

    id: str = Field(
        pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$",
        description="letters, digits and . _ - without spaces, a letter or digit first",
    )
    """Short name for folders and run files: letters, digits, ``.`` ``_`` ``-``."""
    title: str = ""
    """Title for the report."""
    stand: str = Field(min_length=1)
    """Path of the stand file, relative to the campaign file."""
    specimen: str = Field(min_length=1)
    """Path of the specimen file, relative to the campaign file."""
    operator: str = ""
    """Responsible person."""
    customer: str = ""
    """Customer for the report."""
    note: str = ""
    """Free text."""
    reproduces: Literal[""] | PublishedCampaign = Field(
        default="",
        description="the published campaign that this one is; the report sets both side by side",
    )
    """``stiffness-characteristics-of-railway-buffers``: the paper's campaign. The report shows its numbers
    beside the measured ones.
    """


class PlanConditions(Settings):
    """``[conditions]``: what the planner assumes; the run itself measures."""

    ambient_C: Air = 21.0
    """Air temperature [°C]."""
    specimen_C: Temperature | None = None
    """Specimen temperature at the start [°C]. Default: ``ambient_C``."""

    def start_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the specimen's assumed temperature at the start [°C]: that of the air unless given."""
        return self.ambient_C if self.specimen_C is None else self.specimen_C


class MotionSettings(Settings):
    """``[motion]``: how the actuator moves to and from the motion proper."""

    ramp_speed_mm_per_s: Speed = 20.0
    """To the prestress and to a hold [mm/s]."""
    release_speed_mm_per_s: Speed = 20.0
    """Back to zero force at the end of a step [mm/s]."""


class PlanSettings(Settings):
    """``[plan]``: in which order the steps are run, and how warm they may begin."""

    order: Literal["given", "soonest"] = "given"
    """``"soonest"``: reorder the steps for the earliest end below the temperature limit."""
    margin_C: Annotated[
        float, Field(ge=0), Within(0.0, 20.0, "the stop itself is some 20 K above the air")
    ] = 1.0
    """Distance to ``temperature_stop_C`` that planned pauses keep [K]."""
    start_max_C: Temperature | None = None
    """No movable step begins warmer than this [°C]."""


class CampaignFile(Settings):
    """A campaign file."""

    campaign: CampaignFacts
    limits: TestLimits = TestLimits()
    guards: GuardTable = GuardTable()
    zero: ZeroTable = ZeroTable()
    conditions: PlanConditions = PlanConditions()
    motion: MotionSettings = MotionSettings()
    stroke: StrokeTable = StrokeTable()
    plan: PlanSettings = PlanSettings()
    step: Annotated[tuple[_TaggedStep, ...], BeforeValidator(as_tuple), Field(min_length=1)]


@dataclass(frozen=True)
class Campaign:
    """A campaign file as read: its content, its place, and the lines at which its steps begin."""

    path: Path
    content: CampaignFile
    sha256: str
    step_lines: tuple[int | None, ...]
    nested_lines: tuple[tuple[int | None, ...], ...] = ()
    """Lines of each step's ``[[step.step]]``."""

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

    def place(self, number: int, nested: int | None = None) -> str:
        """Return where ``[[step]]`` ``number`` (from 1) stands in the file, for messages.

        Parameters
        ----------
        number : int
            From 1.
        nested : int, optional
            Which of its ``[[step.step]]`` is meant, from 1.
        """
        line, name = self.step_lines[number - 1], f"[[step]] {number}"
        if nested is not None:
            line, name = self.nested_lines[number - 1][nested - 1], f"{name}, [[step.step]] {nested}"
        return name if line is None else f"line {line}: {name}"

    def in_rounds(self, rounds: int) -> Campaign:
        """Return the campaign with all of its steps so many times over.

        Raises
        ------
        BadInput
            If the planner may mix the rounds.
        """
        if rounds == 1:
            return self
        if self.content.plan.order != "given":
            raise BadInput(
                f"rounds are run one after another, and order = “{self.content.plan.order}” would mix them",
                file=self.path,
                place="plan.order",
                remedy="write order = “given”, or run it without --until",
            )
        content = self.content.model_copy(update={"step": self.content.step * rounds})
        return replace(
            self,
            content=content,
            step_lines=self.step_lines * rounds,
            nested_lines=self.nested_lines * rounds,
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the campaign's facts for run files and ``plan --json``."""
        facts = self.content.campaign.model_dump(mode="json")
        if not facts["reproduces"]:
            del facts["reproduces"]
        return facts | {"file": self.path.name, "sha256": self.sha256}


_STEP_HEADER = re.compile(r"^\s*\[\[\s*step\s*(\.\s*step\s*)?\]\]")


def _step_lines(
    text: str, steps: Sequence[Step]
) -> tuple[tuple[int | None, ...], tuple[tuple[int | None, ...], ...]]:
    """Return the line of each step and of each one in it; None where they are written some other way."""
    lines: list[int] = []
    inner: list[list[int]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not (header := _STEP_HEADER.match(line)):
            continue
        if header[1] is None:
            lines.append(number)
            inner.append([])
        elif inner:
            inner[-1].append(number)
    counts = [len(step.step) if isinstance(step, RepeatStep) else 0 for step in steps]
    if len(lines) != len(steps):
        return (None,) * len(steps), tuple((None,) * count for count in counts)
    nested = tuple(
        tuple(found) if len(found) == count else (None,) * count
        for found, count in zip(inner, counts, strict=True)
    )
    return tuple(lines), nested


def load_campaign(path: Path) -> Campaign:
    """Read a campaign file.

    Raises
    ------
    BadInput
        If it cannot be read, is no TOML, or a key is unknown, missing or has a value that cannot be.
    """
    text = read_text(path)
    content = parse_settings(text, CampaignFile, path)
    return Campaign(path, content, file_hash(path), *_step_lines(text, content.step))
