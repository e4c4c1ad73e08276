"""Texts that are English as they stand and know what they were made of, so that they can be said otherwise.

Each is a ``str``: whoever prints, compares or hashes it has the English text. :class:`Language` asks it for
another one. ``+`` keeps that; an f-string, ``join`` or a slice gives a plain ``str``, which no language can
translate: use :func:`said` with named facts, :func:`joined` or :func:`capital`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import date, datetime
from typing import Any, Protocol, TypeVar


class Speaker(Protocol):
    """What a text needs to be put into a language."""

    def say(self, text: str) -> str:
        """Return any text in the language."""

    def message(self, message: str) -> str:
        """Return the translation of a message, its facts not yet filled in."""

    def counted(self, one: str, many: str, count: int) -> str:
        """Return the translation that goes with a number of things."""

    def numeral(self, text: str) -> str:
        """Return numbers as the language writes them."""

    def moment(self, at: datetime) -> str:
        """Return day and time with the offset, in the report's time zone."""

    def span(self, first: datetime, last: datetime) -> str:
        """Return two moments with the offset, in the report's time zone."""

    def day(self, at: date) -> str:
        """Return a day as the language writes it."""


_Text = TypeVar("_Text", bound="Worded")


class Worded(str):
    """A text that can be said in another language; as it stands it is English."""

    _made_of: Mapping[str, Any]

    @classmethod
    def _of(cls: type[_Text], english: str, **made_of: Any) -> _Text:
        text = super().__new__(cls, english)
        text._made_of = made_of
        return text

    def __reduce__(self) -> tuple[Any, ...]:
        """Keep what it was made of when it goes to another process."""
        return _restored, (type(self), self.plain(), dict(self._made_of))

    def __str__(self) -> str:
        """Return itself: ``str()`` of a text that can be said otherwise is one, too."""
        return self

    def __add__(self, other: str) -> str:
        """Return both in a row, each of which a language can say."""
        return joined("", (self, other))

    def __radd__(self, other: str) -> str:
        """Return both in a row, each of which a language can say."""
        return joined("", (other, self))

    def plain(self) -> str:
        """Return the English text alone."""
        return "".join(self)

    def in_language(self, speaker: Speaker) -> str:
        """Return it in a language."""
        raise NotImplementedError


def _restored(kind: type[_Text], english: str, made_of: Mapping[str, Any]) -> _Text:
    return kind._of(english, **made_of)


class Said(Worded):
    """A message with its facts."""

    def in_language(self, speaker: Speaker) -> str:
        """Return the message's translation with each fact in the language, too."""
        facts = {name: _fact(fact, speaker) for name, fact in self._made_of["facts"].items()}
        count = self._made_of["count"]
        message = self._made_of["message"]
        if count is None:
            template = speaker.message(message)
        else:
            template = speaker.counted(message, self._made_of["many"], count)
            facts["count"] = speaker.numeral(str(count))
        return template.format_map(facts)


class Label(Worded):
    """The name of a quantity."""

    def in_language(self, speaker: Speaker) -> str:
        """Return its translation."""
        return speaker.message(self._made_of["message"])


class Joined(Worded):
    """Texts in a row."""

    def in_language(self, speaker: Speaker) -> str:
        """Return each in the language."""
        return speaker.say(self._made_of["between"]).join(
            speaker.say(part) for part in self._made_of["parts"]
        )


class Capital(Worded):
    """A text as the beginning of a sentence."""

    def in_language(self, speaker: Speaker) -> str:
        """Return it in the language, with a capital."""
        return _capital(speaker.say(self._made_of["text"]))


class Numeral(Worded):
    """A text of numbers, signs and units alone."""

    def in_language(self, speaker: Speaker) -> str:
        """Return it with the language's decimal sign."""
        return speaker.numeral(self.plain())


class Moment(Worded):
    """Day and time."""

    def in_language(self, speaker: Speaker) -> str:
        """Return it in the report's time zone, with the offset."""
        return speaker.moment(self._made_of["at"])


class Span(Worded):
    """From one moment to another."""

    def in_language(self, speaker: Speaker) -> str:
        """Return it in the report's time zone, with the offset."""
        return speaker.span(self._made_of["first"], self._made_of["last"])


class Day(Worded):
    """A day."""

    def in_language(self, speaker: Speaker) -> str:
        """Return it as the language writes a day."""
        return speaker.day(self._made_of["at"])


def said(message: str, /, **facts: str | int) -> str:
    """Return a message in English; a language can say it otherwise.

    Parameters
    ----------
    message : str
        The whole sentence or heading in English, a literal: it is the key of the catalogues. Facts stand in
        it by name: ``"Run {number}: {reason}."``; a brace of the text itself is doubled.
    facts : str or int
        What to fill in. Those that are such texts themselves are said in the language, too; a plain text
        stays as it is.

    Returns
    -------
    str
        The English text.
    """
    return Said._of(message.format_map(facts), message=message, many="", count=None, facts=facts)


def said_count(one: str, many: str, count: int, /, **facts: str | int) -> str:
    """Return a message that depends on a number of things; ``{count}`` is that number.

    Parameters
    ----------
    one, many : str
        The English message of one thing and of several, literals.
    count : int
        How many.
    facts : str or int
        As of :func:`said`.
    """
    english = (one if count == 1 else many).format_map({**facts, "count": count})
    return Said._of(english, message=one, many=many, count=count, facts=facts)


def joined(between: str, parts: Iterable[str]) -> str:
    """Return texts in a row with ``between`` them, each of which a language can say."""
    kept = tuple(parts)
    return Joined._of(between.join(kept), between=between, parts=kept)


def capital(text: str) -> str:
    """Return a text as the beginning of a sentence."""
    return Capital._of(_capital(text), text=text)


def label(text: str, english: str | None = None) -> str:
    """Return the name of a quantity as its entry of the catalogue has it, a message of its own.

    ``english`` is what an English report says in its place.
    """
    return Label._of(text if english is None else english, message=text)


def numeral(text: str) -> str:
    """Return a text of numbers, signs and units alone; a language has its own decimal sign."""
    return Numeral._of(text)


def moment(at: datetime, english: str | None = None) -> str:
    """Return day and time with the offset: ``2026-03-05 14:02:11 UTC``; one without an offset is UTC.

    ``english`` is what an English report without a time zone says in its place.
    """
    return Moment._of(english or f"{at:%Y-%m-%d %H:%M:%S} {offset_text(at)}", at=at)


def span(first: datetime, last: datetime) -> str:
    """Return two moments, the day once where it is the same."""
    one, other = (f"{at:%Y-%m-%d}" for at in (first, last))
    if one == other and offset_text(first) == offset_text(last):
        english = f"{one}, {first:%H:%M:%S} to {last:%H:%M:%S} {offset_text(last)}"
    else:
        english = f"{moment(first)} to {moment(last)}"
    return Span._of(english, first=first, last=last)


def day(at: date) -> str:
    """Return a day; English has it in the form of ISO 8601."""
    return Day._of(at.isoformat(), at=at)


def offset_text(at: datetime) -> str:
    """Return the offset to UTC: ``UTC+01:00``, or ``UTC``."""
    zone = at.strftime("%z")
    return "UTC" if zone in {"", "+0000"} else f"UTC{zone[:3]}:{zone[3:5]}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _fact(fact: str | int, speaker: Speaker) -> str:
    return speaker.say(fact) if isinstance(fact, str) else speaker.numeral(str(fact))
