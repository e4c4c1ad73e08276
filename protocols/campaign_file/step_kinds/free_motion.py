"""A motion that the user composes of pieces."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.foundation.settings import Settings, WrongKeyError
from bufferstand.protocols.bounded_numbers import (
    Cycles,
    Duration,
    Force,
    Frequency,
    Speed,
    Stroke,
    StrokeFromZero,
)
from bufferstand.protocols.campaign_file.step_kinds.common import HarmonicRateStep, StepSettings, as_tuple
from bufferstand.protocols.campaign_file.step_kinds.cyclic import HarmonicStep


class RampPiece(Settings):
    """To a stroke, or until a force is reached, at constant speed."""

    do: Literal["ramp"]
    to_mm: StrokeFromZero | None = None
    """Ramp to this stroke [mm]; this or ``to_kN``."""
    to_kN: Force | None = None
    """Ramp until this force is reached [kN]."""
    speed_mm_per_s: Speed
    """Of the ramp [mm/s]."""

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.to_mm is None) == (self.to_kN is None):
            raise WrongKeyError("a ramp needs exactly one end; give to_mm or to_kN", "to_mm", "to_kN")
        return self


class HoldPiece(Settings):
    """Stand still."""

    do: Literal["hold"]
    duration_s: Duration
    """How long [s]."""


class HarmonicPiece(Settings):
    """A sine about the stroke at which the piece before it ended."""

    do: Literal["harmonic"]
    amplitude_mm: Stroke
    """Half the range [mm]."""
    frequency_Hz: Frequency | None = None
    """Either this or ``peak_speed_mm_per_s`` [Hz]."""
    peak_speed_mm_per_s: Speed | None = None
    """Instead of ``frequency_Hz``: v = 2π f A [mm/s]."""
    cycles: Cycles = 1
    """At full amplitude."""

    @model_validator(mode="after")
    def _one_rate(self) -> Self:
        HarmonicRateStep.exactly_one(self.frequency_Hz, self.peak_speed_mm_per_s)
        return self

    def about(self, mean_mm: float) -> HarmonicStep:
        """Return it as a sine about a mean stroke."""
        return HarmonicStep(kind="harmonic", prestress_mm=mean_mm, **self.model_dump(exclude={"do"}))


class ReleasePiece(Settings):
    """Back to zero force."""

    do: Literal["release"]
    speed_mm_per_s: Speed | None = None
    """Of the release [mm/s]. Default: ``release_speed_mm_per_s`` of ``[motion]``."""


Piece = Annotated[RampPiece | HoldPiece | HarmonicPiece | ReleasePiece, Field(discriminator="do")]


class MotionStep(StepSettings):
    """A motion that the user composes of pieces; it is released at its end in any case."""

    kind: Literal["motion"]
    piece: Annotated[tuple[Piece, ...], BeforeValidator(as_tuple), Field(min_length=1)]
    """``ramp`` to ``to_mm`` or until ``to_kN`` at ``speed_mm_per_s``; ``hold`` for ``duration_s``;
    ``harmonic`` about the present stroke, with ``amplitude_mm``, ``frequency_Hz`` or
    ``peak_speed_mm_per_s``, ``cycles`` (1); ``release``, optionally with ``speed_mm_per_s``.
    """
    record: bool = True
    """As ``harmonic`` if it contains a sine, else as ``static``."""

    @model_validator(mode="after")
    def _sines_know_where_they_are(self) -> Self:
        after_force = False
        for number, piece in enumerate(self.piece, start=1):
            if isinstance(piece, RampPiece):
                after_force = piece.to_kN is not None
            elif isinstance(piece, ReleasePiece):
                after_force = False
            elif isinstance(piece, HarmonicPiece) and after_force:
                raise WrongKeyError(
                    f"piece {number} is a sine after a ramp to a force, whose stroke is not known before: "
                    "ramp to a stroke (to_mm) first",
                    "piece",
                )
        return self
