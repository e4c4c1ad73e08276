"""The whole content of a report from its source."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.pictures import figures_section
from bufferstand.evaluation.report.sections import (
    BuildSection,
    amendment_notice,
    amendment_section,
    budgets_section,
    calibrations,
    conditions_section,
    conformity_section,
    contact_section,
    customer,
    cycles_section,
    data_section,
    deviations_section,
    evidence_section,
    head,
    history_section,
    identification,
    laboratory,
    missing_references,
    model_section,
    not_as_required,
    not_tested_section,
    operator,
    opinions_section,
    plausibility_section,
    reevaluation_notice,
    reevaluation_section,
    requirements_section,
    rule_section,
    runs_section,
    simulated_notice,
    software_section,
    spoiled_notice,
    statements_section,
    summary_section,
    temperature_section,
    warnings_section,
    with_added,
)
from bufferstand.evaluation.report.source import ReportSource, missing_fields, runs_text

SECTIONS: tuple[BuildSection, ...] = with_added(
    (
        amendment_section,
        summary_section,
        reevaluation_section,
        identification,
        conditions_section,
        conformity_section,
        requirements_section,
        runs_section,
        cycles_section,
        contact_section,
        history_section,
        temperature_section,
        model_section,
        figures_section,
        deviations_section,
        not_tested_section,
        warnings_section,
        rule_section,
        plausibility_section,
        evidence_section,
        budgets_section,
        calibrations,
        data_section,
        software_section,
        opinions_section,
        statements_section,
    )
)
"""What a report consists of, in its order, with the sections that stand in files of their own."""


def build_content(source: ReportSource) -> Content:
    """Return the report's content.

    Parameters
    ----------
    source : ReportSource
        Runs, their evaluation, and what the laboratory adds.

    Returns
    -------
    Content
        The same for the same source, whenever and wherever it is built.
    """
    version = (source.document.get("software") or {}).get("version")
    software = f"bufferstand {version}" if version else "bufferstand"
    sections = [build(source) for build in SECTIONS]
    ends = [run.ended for run in source.runs if run.ended is not None]
    return Content(
        title="Test report: static and dynamic characteristics",
        subtitle=_subtitle(source),
        notices=(*reevaluation_notice(source), *notices_of(source)),
        missing=(
            *missing_fields(source.fields, laboratory(source), customer(source), operator(source)),
            *missing_references(source),
        ),
        head=head(source, software),
        sections=tuple(section for section in sections if section is not None),
        ended=max(ends).isoformat() if ends else "",
        software=software,
    )


def _subtitle(source: ReportSource) -> str:
    specimen = source.common("specimen", "id").text
    kind = source.common("specimen", "kind").text.replace("-", " ")
    known = [part for part in (kind, specimen) if part and part != "—"]
    return f"{' '.join(known) or 'specimen not recorded'} · {source.name}"


def notices_of(source: ReportSource) -> tuple[str, ...]:
    """Return what must be seen before anything else."""
    notices = list(amendment_notice(source))
    notices += simulated_notice(source)
    notices += spoiled_notice(source)
    notices += [f"Run {run.number} {run.status}: {run.reason}." for run in source.runs if run.ended_early]
    if others := [run.number for run in source.runs if not_as_required(run)]:
        named = runs_text(others)
        notices.append(
            f"{named[:1].upper()}{named[1:]}: not the motion that the step required; see Warnings before "
            "using any result of them."
        )
    return tuple(notices)
