"""``[stroke]`` of a campaign file: specimen's or piston's strokes, and which deviation is a warning."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bufferstand.foundation.settings import Settings, Within


class StrokeTable(Settings):
    """``[stroke]``; every key has a default."""

    compensate: bool = True
    """Strokes belong to the specimen: the piston moves farther by the machine's deflection. ``false``:
    strokes belong to the piston (as in the paper).
    """
    warn_percent: Annotated[
        float, Field(gt=0), Within(0.01, 10.0, "finer is noise, coarser warns of nothing")
    ] = 1.0
    """A compensated sine with a larger amplitude error gives a warning [%]."""
    warn_mm: Annotated[float, Field(gt=0), Within(0.01, 5.0, "finer is noise, coarser warns of nothing")] = (
        0.2
    )
    """A larger error of the mean, or of the turn of a static stroke, gives a warning [mm]."""
