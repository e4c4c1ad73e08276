"""A search in the documentation that needs nothing but its pages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from bufferstand.cli.documentation.pages import Page, Section, words_of

_WORD = re.compile(r"\w+")
_IN_TITLE, _IN_HEADING, _WHOLE = 12, 8, 2
"""What a word counts in the title of the page and in a heading beside one in the text; and one that is not
only begun by the word that is looked for."""
_MOST_IN_TEXT = 5
"""A word counts so often at most, or the longest sections would always come first."""
_FOR_DEVELOPERS = ("decisions/", "facts/")
"""What most readers do not look for counts half."""
_AROUND = 70
"""Characters shown on both sides of what was found."""


@dataclass(frozen=True)
class Hit:
    """A section in which all words were found.

    Attributes
    ----------
    page, section
        Where.
    score : int
        How well it fits.
    excerpt : str
        Text around the first word found.
    """

    page: Page
    section: Section
    score: int
    excerpt: str


def find(pages: Iterable[Page], query: str) -> Sequence[Hit]:
    """Return the sections in which all words of a query occur, the best first.

    A word is found where another begins with it: ``calib`` finds calibration.

    Parameters
    ----------
    pages : iterable of Page
    query : str
        Words.
    """
    words = words_of(query)
    if not words:
        return []
    hits = [
        hit for page in pages for section in page.sections if (hit := _hit(page, section, words)) is not None
    ]
    return sorted(hits, key=lambda hit: (-hit.score, hit.page.name, hit.section.heading))


def _hit(page: Page, section: Section, words: Sequence[str]) -> Hit | None:
    title, heading = words_of(page.title), words_of(section.heading)
    places = [
        (_counted(title, word), _counted(heading, word), _counted(section.words, word)) for word in words
    ]
    # The title alone would bring up every section of the page.
    if not all(above or inside for _, above, inside in places):
        return None
    score = sum(
        _IN_TITLE * bool(named) + _IN_HEADING * bool(above) + min(inside, _MOST_IN_TEXT)
        for named, above, inside in places
    )
    if page.name.startswith(_FOR_DEVELOPERS):
        score //= 2
    return Hit(page, section, score, _excerpt(section.plain, words))


def _counted(text: Sequence[str], word: str) -> int:
    """Return how often a word begins in a text; a whole one counts more."""
    begun = [found for found in text if found.startswith(word)]
    return len(begun) + (_WHOLE - 1) * begun.count(word)


def _excerpt(text: str, words: Sequence[str]) -> str:
    begun = tuple(words)
    places = (found.start() for found in _WORD.finditer(text) if found.group().casefold().startswith(begun))
    at = next(places, 0)
    begin, end = max(0, at - _AROUND), min(len(text), at + _AROUND)
    return f"{'…' if begin else ''}{text[begin:end]}{'…' if end < len(text) else ''}"
