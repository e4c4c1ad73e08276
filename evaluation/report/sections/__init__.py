"""Sections of a report: each makes texts and tables of its source."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.sections.amendment import (
        amendment_notice,
        amendment_section,
    )
    from bufferstand.evaluation.report.sections.budgets import (
        budgets_section,
        further_budgets_section,
    )
    from bufferstand.evaluation.report.sections.certificate import (
        key_values,
        signatures,
        statement,
    )
    from bufferstand.evaluation.report.sections.comparison import (
        ComparedFigures,
        compared_of,
        comparison_sections,
        shown_loop,
        start_C,
    )
    from bufferstand.evaluation.report.sections.conditions import (
        conditions_section,
    )
    from bufferstand.evaluation.report.sections.conformity import (
        conformity_section,
        not_tested_section,
    )
    from bufferstand.evaluation.report.sections.evidence import (
        as_recorded,
        evidence_section,
        temperature_section,
    )
    from bufferstand.evaluation.report.sections.history import (
        contact_section,
        history_section,
    )
    from bufferstand.evaluation.report.sections.identity import (
        calibrations,
        customer,
        head,
        identification,
        laboratory,
        operator,
        overdue,
        simulated_notice,
    )
    from bufferstand.evaluation.report.sections.model import (
        model_section,
    )
    from bufferstand.evaluation.report.sections.own_texts import (
        appendix_sections,
        introduction_section,
        setup_section,
    )
    from bufferstand.evaluation.report.sections.plausibility import (
        plausibility_section,
        spoiled_notice,
    )
    from bufferstand.evaluation.report.sections.reevaluation import (
        reevaluation_notice,
        reevaluation_section,
    )
    from bufferstand.evaluation.report.sections.references import (
        is_draft,
        missing_references,
        reference_text,
    )
    from bufferstand.evaluation.report.sections.results import (
        columns,
        cycle_head,
        cycles_section,
        recorded_section,
        runs_section,
        value_cell,
    )
    from bufferstand.evaluation.report.sections.section_files import (
        BuildSection,
        with_added,
    )
    from bufferstand.evaluation.report.sections.software import (
        software_section,
    )
    from bufferstand.evaluation.report.sections.statements import (
        data_section,
        deviations_section,
        not_as_required,
        opinions_section,
        remarks_section,
        rule_section,
        targets_section,
        warnings_section,
    )
    from bufferstand.evaluation.report.sections.unmatched import (
        why_unmatched,
    )
    from bufferstand.evaluation.report.sections.verdicts import (
        name_of,
        requirements_section,
        severity,
        worst,
    )

__all__ = [
    "BuildSection",
    "ComparedFigures",
    "amendment_notice",
    "amendment_section",
    "appendix_sections",
    "as_recorded",
    "budgets_section",
    "calibrations",
    "columns",
    "compared_of",
    "comparison_sections",
    "conditions_section",
    "conformity_section",
    "contact_section",
    "customer",
    "cycle_head",
    "cycles_section",
    "data_section",
    "deviations_section",
    "evidence_section",
    "further_budgets_section",
    "head",
    "history_section",
    "identification",
    "introduction_section",
    "is_draft",
    "key_values",
    "laboratory",
    "missing_references",
    "model_section",
    "name_of",
    "not_as_required",
    "not_tested_section",
    "operator",
    "opinions_section",
    "overdue",
    "plausibility_section",
    "recorded_section",
    "reevaluation_notice",
    "reevaluation_section",
    "reference_text",
    "remarks_section",
    "requirements_section",
    "rule_section",
    "runs_section",
    "setup_section",
    "severity",
    "shown_loop",
    "signatures",
    "simulated_notice",
    "software_section",
    "spoiled_notice",
    "start_C",
    "statement",
    "targets_section",
    "temperature_section",
    "value_cell",
    "warnings_section",
    "why_unmatched",
    "with_added",
    "worst",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
