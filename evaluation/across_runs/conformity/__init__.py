"""Which run of a specimen is its conformity test, and which only state characteristics."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.across_runs.conformity.candidates import (
        candidate_of,
        standing_of,
    )
    from bufferstand.evaluation.across_runs.conformity.purposes import (
        Candidate,
        Decided,
        Purpose,
        decide_purposes,
    )

__all__ = [
    "Candidate",
    "Decided",
    "Purpose",
    "candidate_of",
    "decide_purposes",
    "standing_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
