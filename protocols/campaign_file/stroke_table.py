"""``[stroke]`` of a campaign file: specimen's or piston's strokes, and which deviation is a warning."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from bufferstand.foundation.settings import Settings, Within


class StrokeTable(Settings):
    """``[stroke]``; every key has a default."""

    compensate: bool = True
    """Whether asked strokes are the specimen's; False: the piston's, as the paper's. A step may say its own
    ``compensate``."""
    warn_percent: Annotated[
        float, Field(gt=0), Within(0.01, 10.0, "finer is noise, coarser warns of nothing")
    ] = 1.0
    """A sine whose amplitude is off by more than this is said aloud [% of what is asked]."""
    warn_mm: Annotated[float, Field(gt=0), Within(0.01, 5.0, "finer is noise, coarser warns of nothing")] = (
        0.2
    )
    """So is one whose mean, or a static stroke that, is off by more than this [mm]."""
