"""The whole content of a report from its source."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Block, Content, Lack, in_language, numbered
from bufferstand.evaluation.report.pictures import (
    certificate_picture,
    course_section,
    figures_section,
    model_comparison_section,
)
from bufferstand.evaluation.report.sections import (
    BuildSection,
    amendment_notice,
    amendment_section,
    appendix_sections,
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
    further_budgets_section,
    head,
    history_section,
    introduction_section,
    key_values,
    laboratory,
    missing_references,
    not_as_required,
    not_tested_section,
    operator,
    opinions_section,
    plausibility_section,
    recorded_section,
    reevaluation_notice,
    reevaluation_section,
    remarks_section,
    requirements_section,
    rule_section,
    runs_section,
    setup_section,
    signatures,
    simulated_notice,
    software_section,
    spoiled_notice,
    statement,
    targets_section,
    temperature_section,
    warnings_section,
    with_added,
)
from bufferstand.evaluation.report.source import ReportSource, missing_fields, runs_text
from bufferstand.evaluation.wording import capital, joined, said, specimen_words

SECTIONS: tuple[BuildSection, ...] = with_added(
    (
        amendment_section,
        introduction_section,
        reevaluation_section,
        conformity_section,
        runs_section,
        figures_section,
        temperature_section,
        model_comparison_section,
        setup_section,
        conditions_section,
        deviations_section,
        not_tested_section,
        warnings_section,
        rule_section,
        budgets_section,
        calibrations,
        opinions_section,
        remarks_section,
        requirements_section,
        recorded_section,
        cycles_section,
        targets_section,
        contact_section,
        history_section,
        course_section,
        plausibility_section,
        evidence_section,
        further_budgets_section,
        data_section,
        software_section,
    )
)
"""What a report consists of behind its first page, in its order; those of the annex come last."""

GIVEN_IN_A_FILE = said("Missing, to be given in report.toml beside the runs:")
_IN_A_LIMIT_SET = said(
    "Missing in the limit set, to be stated in one of the laboratory’s own (--limits; “bufferstand samples” "
    "brings the shipped ones to copy):"
)


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
    built = [*(build(source) for build in SECTIONS), *appendix_sections(source)]
    certificate, sections = numbered(certificate_of(source), [one for one in built if one is not None])
    ends = [run.ended for run in source.runs if run.ended is not None]
    content = Content(
        title=said("Test report: static and dynamic characteristics"),
        subtitle=_subtitle(source),
        notices=every_notice(source),
        lacks=lacks_of(source, GIVEN_IN_A_FILE),
        head=head(source),
        sections=sections,
        ended=max(ends).isoformat() if ends else "",
        software=said("bufferstand {version}", version=version) if version else "bufferstand",
        certificate=certificate,
        detailed=source.detailed,
        mark=source.mark,
        photo=source.photo,
        accreditation=source.accreditation,
        template=source.template,
    )
    return in_language(content, source.language)


def lacks_of(source: ReportSource, given_in: str) -> tuple[Lack, ...]:
    """Return what makes a report a draft: what the laboratory, then what its limit set does not state.

    Parameters
    ----------
    source : ReportSource
        Runs, their evaluation, and what the laboratory adds.
    given_in : str
        The sentence that says where the laboratory gives what is its own.
    """
    own = missing_fields(source.fields, laboratory(source), customer(source), operator(source))
    lacks = (Lack(given_in, own), Lack(_IN_A_LIMIT_SET, missing_references(source)))
    return tuple(lack for lack in lacks if lack.items)


def missing_of(source: ReportSource) -> tuple[str, ...]:
    """Return in words what makes a report a draft, wherever it is to be given."""
    return tuple(item for lack in lacks_of(source, GIVEN_IN_A_FILE) for item in lack.items)


def certificate_of(source: ReportSource) -> tuple[Block, ...]:
    """Return what stands on the first page: statement, key values, the curve, signatures."""
    picture = certificate_picture(source)
    shown = () if picture is None else (picture,)
    return (statement(source), key_values(source), *shown, *signatures(source))


def _subtitle(source: ReportSource) -> str:
    specimen = source.common("specimen", "id").text
    kind = specimen_words(source.common("specimen", "kind").text)
    known = [part for part in (kind, specimen) if part and part != "—"]
    return said("{what} · {name}", what=joined(" ", known) or said("specimen not recorded"), name=source.name)


def every_notice(source: ReportSource) -> tuple[str, ...]:
    """Return the lines at the top of a report, in English."""
    return (*reevaluation_notice(source), *notices_of(source))


def notices_of(source: ReportSource) -> tuple[str, ...]:
    """Return what must be seen before anything else."""
    notices = list(amendment_notice(source))
    notices += simulated_notice(source)
    notices += spoiled_notice(source)
    if early := [run.number for run in source.runs if run.ended_early]:
        named = runs_text(early)
        notices.append(
            said(
                "{named} ended early; see Deviations and stopped runs.",
                named=capital(named),
            )
        )
    if others := [run.number for run in source.runs if not_as_required(run)]:
        named = runs_text(others)
        notices.append(
            said(
                "{named}: not the motion that the step required; see Warnings before using any result "
                "of them.",
                named=capital(named),
            )
        )
    return tuple(notices)
