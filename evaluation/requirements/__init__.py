"""Requirements of standards.

Limit sets, decision rule, and the judgement of static, impact, proof and maintenance tests.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.requirements.checklist import (
        asked_items,
    )
    from bufferstand.evaluation.requirements.contact_zero import (
        COUNTED,
    )
    from bufferstand.evaluation.requirements.decision import (
        run_verdict,
    )
    from bufferstand.evaluation.requirements.inspection import (
        inspection_of,
        load_inspection,
        unused,
    )
    from bufferstand.evaluation.requirements.judgement import (
        assumptions,
        has_limits_of_its_own,
        is_judged,
        judge_with_contact,
        why_not_judged,
    )
    from bufferstand.evaluation.requirements.limit_set import (
        LimitSet,
        find_limit_set,
        shipped_files,
        shipped_limit_set,
        shipped_names,
    )
    from bufferstand.evaluation.requirements.quantity_limits import (
        JudgedPart,
        judge_quantities,
    )
    from bufferstand.evaluation.requirements.rows import (
        Case,
    )

__all__ = [
    "COUNTED",
    "Case",
    "JudgedPart",
    "LimitSet",
    "asked_items",
    "assumptions",
    "find_limit_set",
    "has_limits_of_its_own",
    "inspection_of",
    "is_judged",
    "judge_quantities",
    "judge_with_contact",
    "load_inspection",
    "run_verdict",
    "shipped_files",
    "shipped_limit_set",
    "shipped_names",
    "unused",
    "why_not_judged",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
