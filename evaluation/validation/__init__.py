"""Is this installation's evaluation right? Standard data sets with agreed values, and the record of it.

ISO/IEC 17025:2017, 7.11.2 asks that software is validated before it is used. The sets are a folder of records
and truth files that any other program can be judged by, too (docs/validation.md).
"""

from bufferstand.evaluation.validation.judging import Check, judge_entry
from bufferstand.evaluation.validation.performing import SetResult, evaluate_set, judge_results
from bufferstand.evaluation.validation.proof import Validation, load_validation, validate
from bufferstand.evaluation.validation.standard_sets import StandardSet, load_sets, shipped_sets

__all__ = [
    "Check",
    "SetResult",
    "StandardSet",
    "Validation",
    "evaluate_set",
    "judge_entry",
    "judge_results",
    "load_sets",
    "load_validation",
    "shipped_sets",
    "validate",
]
