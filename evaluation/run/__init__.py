"""One run from its record to its results."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.run.evaluate import (
        evaluate_run,
    )
    from bufferstand.evaluation.run.garbage_collection import (
        collecting_later,
    )

__all__ = [
    "collecting_later",
    "evaluate_run",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
