"""FAULTS.toml: a schedule of faults for the simulated stand, by stand time or by sample number."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.drivers.simulated.faults.schedule import FOREVER_S, ScheduledFault, Setting
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import Settings, WrongKeyError, load_settings

SAMPLE_S = 1e-3
"""Period of the simulated controller's samples, in its own time [s]."""


class FaultEntry(Settings):
    """One ``[[fault]]``: either ``at_s`` and ``for_s``, or ``at_sample`` and ``for_samples``."""

    target: str
    kind: str
    at_s: float | None = Field(default=None, ge=0.0)
    for_s: float | None = Field(default=None, gt=0.0)
    at_sample: int | None = Field(default=None, ge=0)
    for_samples: int | None = Field(default=None, gt=0)
    every_s: float | None = Field(default=None, gt=0.0)
    """It comes again each time so much stand time has passed; ``times`` says how often."""
    times: int = Field(default=1, ge=1, le=100_000)
    share: float | None = None
    delay_s: float | None = None
    code: float | None = None
    register_name: str | None = Field(default=None, alias="register")
    side: str | None = None
    jump_s: float | None = None
    keep: float | None = None
    bytes_lost: float | None = Field(default=None, alias="bytes")

    @model_validator(mode="after")
    def _one_time(self) -> FaultEntry:
        by_time = self.at_s is not None or self.for_s is not None
        by_sample = self.at_sample is not None or self.for_samples is not None
        if by_time and by_sample:
            raise WrongKeyError(
                "give its time either in seconds (at_s, for_s) or in samples, not both", "at_s", "for_s"
            )
        if (self.times > 1) != (self.every_s is not None):
            raise WrongKeyError("every_s and times belong together", "every_s", "times")
        return self

    def settings(self) -> dict[str, Setting]:
        """Return the parameters that are given, by their names."""
        given: dict[str, Setting | None] = {
            "share": self.share,
            "delay_s": self.delay_s,
            "code": self.code,
            "register": self.register_name,
            "side": self.side,
            "jump_s": self.jump_s,
            "keep": self.keep,
            "bytes": self.bytes_lost,
        }
        return {key: value for key, value in given.items() if value is not None}

    def faults(self) -> list[ScheduledFault]:
        """Return the fault, as often as it comes."""
        start_s, length_s = self.at_s or 0.0, self.for_s
        if self.at_sample is not None or self.for_samples is not None:
            start_s = (self.at_sample or 0) * SAMPLE_S
            length_s = None if self.for_samples is None else self.for_samples * SAMPLE_S
        starts_s = [start_s + number * (self.every_s or 0.0) for number in range(self.times)]
        return [
            ScheduledFault(
                self.target,
                self.kind,
                start_s,
                FOREVER_S if length_s is None else start_s + length_s,
                self.settings(),
            )
            for start_s in starts_s
        ]


class FaultFile(Settings):
    """A checked FAULTS.toml."""

    seed: int = Field(default=0, ge=0)
    """By which the frames are picked that a fault with a ``share`` strikes."""
    fault: Annotated[
        tuple[FaultEntry, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
    ]

    def faults(self, file: Path | None = None) -> tuple[ScheduledFault, ...]:
        """Return all faults.

        Raises
        ------
        BadInput
            If one is none; names the entry.
        """
        found: list[ScheduledFault] = []
        for number, entry in enumerate(self.fault, start=1):
            try:
                found += entry.faults()
            except BadInput as error:
                raise BadInput(
                    error.problem, file=file, place=f"[[fault]] {number} ({error.place})", remedy=error.remedy
                ) from None
        return tuple(found)


def load_faults(path: Path) -> tuple[tuple[ScheduledFault, ...], int]:
    """Return the faults of a file, and its seed.

    Raises
    ------
    BadInput
        If it cannot be read, breaks the schema, or names a fault that there is not.
    """
    content = load_settings(path, FaultFile)
    return content.faults(path), content.seed
