"""Which step next: what a step of the stand would add to what is known of a spring (docs/next-step.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.next_step.candidate_steps import (
        candidates,
    )
    from bufferstand.model.next_step.choosing import (
        Choice,
        ChosenStep,
        EveryParameter,
        Figure,
        Goal,
        Intervals,
        choose,
        curve_deviation,
    )
    from bufferstand.model.next_step.knowledge import (
        Effect,
        Knowledge,
        Spring,
        effects_of,
        knowledge_of,
        known_by,
    )
    from bufferstand.model.next_step.pieces import (
        Candidate,
        Loops,
        Piece,
        Rest,
        RunNoise,
        SlowStroke,
        drive_of,
        seconds_of,
        text_of,
    )
    from bufferstand.model.next_step.question import (
        FORM,
        Question,
    )
    from bufferstand.model.next_step.shared_errors import (
        SharedErrors,
        limit,
    )

__all__ = [
    "FORM",
    "Candidate",
    "Choice",
    "ChosenStep",
    "Effect",
    "EveryParameter",
    "Figure",
    "Goal",
    "Intervals",
    "Knowledge",
    "Loops",
    "Piece",
    "Question",
    "Rest",
    "RunNoise",
    "SharedErrors",
    "SlowStroke",
    "Spring",
    "candidates",
    "choose",
    "curve_deviation",
    "drive_of",
    "effects_of",
    "knowledge_of",
    "known_by",
    "limit",
    "seconds_of",
    "text_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
