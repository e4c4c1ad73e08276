"""The whole content of a report from its source."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Block, Content, Section, Texts
from bufferstand.evaluation.report.pictures import figures_section
from bufferstand.evaluation.report.sections import (
    amendment_notice,
    amendment_section,
    budgets_section,
    calibrations,
    changes_of,
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
    overdue,
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
    temperature_section,
    verdict_line,
    warnings_section,
)
from bufferstand.evaluation.report.source import ReportSource, missing_fields, purpose_warnings, runs_text


def build_content(source: ReportSource) -> Content:
    """Return the report's content.

    Parameters
    ----------
    source : Source
        Runs, their evaluation, and what the laboratory adds.

    Returns
    -------
    Content
        The same for the same source, whenever and wherever it is built.
    """
    version = (source.document.get("software") or {}).get("version")
    software = f"bufferstand {version}" if version else "bufferstand"
    calibration = calibrations(source)
    changes = changes_of(source)
    sections = [
        amendment_section(source),
        _summary(source),
        reevaluation_section(source, changes),
        identification(source),
        conditions_section(source),
        conformity_section(source),
        requirements_section(source),
        runs_section(source),
        cycles_section(source),
        contact_section(source),
        history_section(source),
        temperature_section(source),
        model_section(source.runs, source.modelled) if source.modelled else None,
        figures_section(source),
        deviations_section(source),
        not_tested_section(source),
        warnings_section(source, [*purpose_warnings(source), *overdue(calibration)]),
        rule_section(source),
        plausibility_section(source),
        evidence_section(source),
        budgets_section(source),
        calibration,
        data_section(source),
        software_section(source),
        opinions_section(source),
        statements_section(source),
    ]
    ends = [run.ended for run in source.runs if run.ended is not None]
    return Content(
        title="Test report: static and dynamic characteristics",
        subtitle=_subtitle(source),
        notices=(*reevaluation_notice(changes), *notices_of(source)),
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


def _summary(source: ReportSource) -> Section:
    judged = [run for run in source.runs if run.evaluated.get("verdict") is not None]
    others = len(source.runs) - len(judged)
    blocks: list[Block] = [verdict_line(run) for run in judged]
    runs = f"{len(source.runs)} run{'s' if len(source.runs) != 1 else ''}"
    sentence = f"{runs}, of which {len(judged)} judged against requirements."
    if apart := sum(run.characterises for run in judged):
        sentence += f" {apart} of these as characterisation, which no statement of conformity rests on."
    if others:
        sentence += f" Of the other {others} nothing is required: they state characteristics."
    damping = [value for run in source.runs if (value := run.result("damping")) is not None]
    forces = [
        (one.value, one.doubt) for run in source.runs if (one := run.extreme("force_max_kN")) and one.value
    ]
    if forces:
        greatest, doubt = max(forces)
        sentence += f" Greatest force {greatest:.1f} kN{' (in doubt, see Warnings)' if doubt else ''}."
    if damping:
        sentence += f" Damping from {min(damping):.3f} to {max(damping):.3f}."
    return Section("summary", "Summary", (*blocks, Texts((sentence,))))
