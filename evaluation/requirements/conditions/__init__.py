"""Conditions of a test: strokes, speed, dwell, temperature and contact, and whether they were kept."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.requirements.conditions.block_detection import (
        block_contact,
    )
    from bufferstand.evaluation.requirements.conditions.static_test import (
        governing,
        static_conditions,
    )
    from bufferstand.evaluation.requirements.conditions.strokes import (
        judged_strokes,
        why_not,
    )

__all__ = [
    "block_contact",
    "governing",
    "judged_strokes",
    "static_conditions",
    "why_not",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
