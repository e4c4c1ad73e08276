"""An amended report: which one it replaces, what it changes and why (ISO/IEC 17025, 7.8.8)."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Cell, Section, Sheet, Texts
from bufferstand.evaluation.report.sections.identity import given
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import said


def amendment_section(source: ReportSource) -> Section | None:
    """Return what a report that replaces another one must say of it; None where it replaces none."""
    fields = source.fields
    if not fields.amends:
        return None
    facts = [
        (said("Issued"), given(fields.amends_issued)),
        (said("Reason"), given(fields.amendment_reason)),
    ]
    if source.predecessor is not None:
        facts.append((said("SHA-256 of its PDF"), Cell(source.predecessor.sha256, "code")))
    sheet = Sheet("", tuple(facts))
    changes = fields.amendment_changes or (said("Not stated: add amendment_changes to report.toml."),)
    return Section(
        "amendment",
        said("Amendment to report {amends}", amends=fields.amends),
        (
            sheet,
            Texts((said("Changes from that report:"),)),
            Texts((*changes, *_figures(source)), listed=True),
        ),
    )


def _figures(source: ReportSource) -> tuple[str, ...]:
    """Return whether results are others than in the report that is replaced, where that is known."""
    predecessor = source.predecessor
    if predecessor is None or predecessor.evaluation is None:
        return ()
    if not predecessor.moved(source.document):
        return (said("No result and no verdict is another than in that report."),)
    return (said("Results, verdicts or runs are others: see Comparison with the earlier evaluation."),)


def amendment_notice(source: ReportSource) -> tuple[str, ...]:
    """Return the line at the top of an amended report, if it is one."""
    fields = source.fields
    if not fields.amends:
        return ()
    return (
        said(
            "Amendment: this report replaces report {amends}, which is no longer valid.", amends=fields.amends
        ),
    )
