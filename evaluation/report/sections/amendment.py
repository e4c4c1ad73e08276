"""An amended report: which one it replaces, what it changes and why (ISO/IEC 17025, 7.8.8)."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Section, Sheet, Texts
from bufferstand.evaluation.report.sections.identity import given
from bufferstand.evaluation.report.source import ReportSource


def amendment_section(source: ReportSource) -> Section | None:
    """Return what a report that replaces another one must say of it; None where it replaces none."""
    fields = source.fields
    if not fields.amends:
        return None
    sheet = Sheet(
        "",
        (
            ("Issued", given(fields.amends_issued)),
            ("Reason", given(fields.amendment_reason)),
        ),
    )
    changes = fields.amendment_changes or ("Not stated: add amendment_changes to report.toml.",)
    return Section(
        "amendment",
        f"Amendment to report {fields.amends}",
        (sheet, Texts(("What is different from that report:",)), Texts(changes, listed=True)),
    )


def amendment_notice(source: ReportSource) -> tuple[str, ...]:
    """Return the line at the top of an amended report, if it is one."""
    fields = source.fields
    if not fields.amends:
        return ()
    return (f"Amendment: this report replaces report {fields.amends}, which is no longer valid.",)
