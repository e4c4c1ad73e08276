"""What a report is made from.

Runs with their evaluation, the laboratory's fields, specimens, curves, and a model's answers.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.source.curves import (
        CampaignClock,
        at_strokes,
        campaign_clock,
        energy_trace,
        loop_of,
        steps_of,
        stroke_trace,
        temperature_traces,
    )
    from bufferstand.evaluation.report.source.fields import (
        ReportFields,
        language_for,
        missing_fields,
        read_fields,
    )
    from bufferstand.evaluation.report.source.hash_of_findings import (
        evaluation_hash,
        without_paths,
    )
    from bufferstand.evaluation.report.source.model_answer import (
        ModelAnswer,
    )
    from bufferstand.evaluation.report.source.number_range import (
        is_pattern,
        number_of_range,
    )
    from bufferstand.evaluation.report.source.purposes import (
        check_chosen,
        purpose_texts,
        purpose_warnings,
    )
    from bufferstand.evaluation.report.source.reading import (
        Given,
        read_source,
    )
    from bufferstand.evaluation.report.source.source import (
        EVALUATION_NAME,
        NOT_RECORDED,
        ReportRun,
        ReportSource,
        numbers_text,
        runs_text,
    )
    from bufferstand.evaluation.report.source.specimens import (
        MOST_SIDES,
        ComparedSpecimen,
        ComparedSpecimens,
        Condition,
        alone,
        conditions_of,
        side_by_side,
        step_words,
    )
    from bufferstand.evaluation.report.source.step_matching import (
        nearest_step,
        step_differences,
    )

__all__ = [
    "EVALUATION_NAME",
    "MOST_SIDES",
    "NOT_RECORDED",
    "CampaignClock",
    "ComparedSpecimen",
    "ComparedSpecimens",
    "Condition",
    "Given",
    "ModelAnswer",
    "ReportFields",
    "ReportRun",
    "ReportSource",
    "alone",
    "at_strokes",
    "campaign_clock",
    "check_chosen",
    "conditions_of",
    "energy_trace",
    "evaluation_hash",
    "is_pattern",
    "language_for",
    "loop_of",
    "missing_fields",
    "nearest_step",
    "number_of_range",
    "numbers_text",
    "purpose_texts",
    "purpose_warnings",
    "read_fields",
    "read_source",
    "runs_text",
    "side_by_side",
    "step_differences",
    "step_words",
    "steps_of",
    "stroke_trace",
    "temperature_traces",
    "without_paths",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
