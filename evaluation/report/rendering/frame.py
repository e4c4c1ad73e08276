"""What the renderers say of their own around the content, in the report's language."""

from __future__ import annotations

from bufferstand.evaluation.wording import Language, said

_WORDS = {
    "report": said("Report"),
    "draft": said("DRAFT"),
    "draft_text": said("not a test report by ISO/IEC 17025 yet."),
    "page": said("Page {page} of {pages}", page="{page}", pages="{pages}"),
    "contents": said("Contents"),
    "annex": said("Annex"),
    "figure": said("Figure {number}", number="{number}"),
    "numbers": said("Numbers behind the figures"),
    "numbers_of": said("Numbers behind figure {number}", number="{number}"),
    "colon": said("{before}: {after}", before="{before}", after="{after}"),
    "end": said("End of report"),
}
"""By the names that the templates use; a name in braces is what a template puts there."""


def frame_words(language: Language) -> dict[str, str]:
    """Return the renderers' own words by name, in a language."""
    return {name: language.say(text) for name, text in _WORDS.items()}


def figure_title(language: Language, number: int, title: str) -> str:
    """Return the heading of the numbers behind a figure."""
    figure = said("Figure {number}", number=number)
    return language.say(said("{before}: {after}", before=figure, after=title))
