"""Gaps of a record: which are rest, which can be bridged, and how far they may change a figure."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.gaps.bounded_readings import (
        BoundedReadings,
    )
    from bufferstand.evaluation.gaps.bridging import (
        ASTIR,
        RecordGap,
        alike_within,
    )
    from bufferstand.evaluation.gaps.cycles_with_gaps import (
        CyclesOfRecord,
        found_in,
    )
    from bufferstand.evaluation.gaps.stroke_numbers import (
        Numbering,
    )

__all__ = [
    "ASTIR",
    "BoundedReadings",
    "CyclesOfRecord",
    "Numbering",
    "RecordGap",
    "alike_within",
    "found_in",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
