"""What the laboratory adds in its own words and pictures: introduction, appendices, photo of the set-up."""

from __future__ import annotations

from bufferstand.evaluation.report.content import Prose, ProsePart, Section, Words
from bufferstand.evaluation.report.source import ReportSource
from bufferstand.evaluation.wording import said


def introduction_section(source: ReportSource) -> Section | None:
    """Return the introduction; None where there is none."""
    own = source.introduction
    return None if own is None else Section("introduction", own.title or said("Introduction"), (own.prose,))


def setup_section(source: ReportSource) -> Section | None:
    """Return the photo of the set-up; None where there is none."""
    image = source.setup_photo
    if image is None:
        return None
    picture = ProsePart("picture", (Words(said("The specimen in the stand.")),), image=image)
    return Section("set-up", said("Set-up"), (Prose((picture,)),))


def appendix_sections(source: ReportSource) -> tuple[Section, ...]:
    """Return the appendices in their order, lettered; they stand at the end of the annex."""
    return tuple(
        Section(
            f"appendix-{number}",
            said("Appendix {number}: {title}", number=number, title=own.title)
            if own.title
            else said("Appendix {number}", number=number),
            (own.prose,),
            annex=True,
        )
        for number, own in enumerate(source.appendices, start=1)
    )
