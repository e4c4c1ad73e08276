"""What description files of devices have in common: their sources, and questions to the laboratory."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.descriptions.questions import (
        Answer,
        Asked,
        GivenAnswers,
        Question,
        Source,
        Texts,
        as_entries,
        checked_answers,
    )

__all__ = [
    "Answer",
    "Asked",
    "GivenAnswers",
    "Question",
    "Source",
    "Texts",
    "as_entries",
    "checked_answers",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
