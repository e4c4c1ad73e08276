"""Is this installation's evaluation right? Standard data sets with agreed values, and the record of it.

ISO/IEC 17025:2017, 7.11.2 asks that software is validated before it is used. The sets are a folder of records
and truth files that any other program can be judged by, too (docs/validation.md).
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.validation.evaluate_sets import (
        SetResult,
    )
    from bufferstand.evaluation.validation.judge import (
        Check,
    )
    from bufferstand.evaluation.validation.standard_sets import (
        load_sets,
        shipped_sets,
    )
    from bufferstand.evaluation.validation.validation_record import (
        Validation,
        load_validation,
        validate,
    )

__all__ = [
    "Check",
    "SetResult",
    "Validation",
    "load_sets",
    "load_validation",
    "shipped_sets",
    "validate",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
