"""The languages of a report: their catalogues, and how they write numbers, days and times."""

from __future__ import annotations

import gettext
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, tzinfo
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Literal, get_args
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from bufferstand.evaluation.wording.texts import Worded, offset_text, said
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from babel.messages.catalog import Catalog

Code = Literal["en", "de", "cs", "fr"]
LANGUAGES: tuple[Code, ...] = get_args(Code)
"""Languages that a report can be written in, by their ISO 639-1 codes; its texts are written in the first."""
EVALUATION = "evaluation"
"""Context of the messages of an evaluation document: finished English texts, known by their form."""
_NUMBER = re.compile(r"(?<![\w.,])(\d+)(?:\.(\d+))?(?![\d.])")
_GROUPED_FROM = 5
_FACT = re.compile(r"\{(\w+)\}")
_WORDS = re.compile(r"[A-Za-z]{2}")
_BETWEEN = "; "
_FRENCH_BETWEEN = "\u00a0; "
_WRITTEN = frozenset({"address", "mounted", "register", "section", "sequence", "table", "wanted"})
"""Facts that look like numbers and are none."""
_TOLD = frozenset({"why", "text"})
"""Facts that are texts of the evaluation themselves: without a translation of theirs there is none at all."""
_LISTED = frozenset({"details", "problems", "source"})
"""Facts that are reasons in a row, some of which may be anybody's words: each is said on its own."""
_LONGEST = 6
"""So many parts of a row a message has at most."""
_LONGEST_TEXT = 1000
"""Characters of a text that is looked for among the messages: a longer one is told part by part, or stays."""
_NAMES = re.compile(r"[\w*.-]+(?:, [\w*.-]+)* and [\w*.-]+")
"""Names of files and documents in a row."""
_OF_FACT = {
    "address": r"[^ ]+(?: [(][^()]*[)])?(?: unit \d+)?",
    "device": r"[\w.-]+(?: [\w.-]+)?",
    "number": r"\d+",
    "numbers": r"\d+(?:(?:, | to )\d+)*",
    "register": r"[\w.-]+",
    "request": r"(?:(?:adjusting|arming|exchanging|reading|starting|writing) .+?|\d+)",
}
"""What some facts look like; others are any text."""
_FROM_TO = re.compile(r"(\d+) to (\d+)")
_LIST = re.compile(r"\d+(?:(?:, | to )\d+)+")
_THIN = "\u202f"


@dataclass(frozen=True)
class Language:
    """A language and the time zone in which it tells times.

    Parameters
    ----------
    code : str
        One of :data:`LANGUAGES`.
    zone : tzinfo or None
        The report's time zone; None: each time as it is on record.
    """

    code: Code = "en"
    zone: tzinfo | None = None

    @property
    def is_plain(self) -> bool:
        """Whether it leaves every text as it stands."""
        return self.code == "en" and self.zone is None

    @property
    def decimal(self) -> str:
        """The decimal sign."""
        if self.code == "en":
            return "."
        from babel.numbers import get_decimal_symbol  # noqa: PLC0415 - only for other languages

        return get_decimal_symbol(self.code)

    def say(self, text: str) -> str:
        """Return a text in this language.

        A plain one stays as it is, unless it is a message of the evaluation.
        """
        if isinstance(text, Worded):
            return text.in_language(self)
        return text if self.code == "en" else self._from_evaluation(text)

    def message(self, message: str) -> str:
        """Return the translation of a message; the message itself where the catalogue lacks it."""
        return message if self.code == "en" else self._catalogue.gettext(message)

    def counted(self, one: str, many: str, count: int) -> str:
        """Return the translation that goes with a number of things."""
        if self.code == "en":
            return one if count == 1 else many
        return self._catalogue.ngettext(one, many, count)

    def numeral(self, text: str) -> str:
        """Return numbers in this language's form: its decimal sign, thin spaces from five digits on."""
        if self.code == "en":
            return text
        return _NUMBER.sub(self._number, text)

    def plain(self, text: str) -> str:
        """Return a number in the form of programs: a decimal point, no spaces in it."""
        return text.replace(_THIN, "").replace(self.decimal, ".")

    def moment(self, at: datetime) -> str:
        """Return day and time with the offset; in the report's zone, if there is one."""
        local = self._local(at)
        return f"{self.day(local.date())} {local:%H:%M:%S} {offset_text(local)}"

    def span(self, first: datetime, last: datetime) -> str:
        """Return two moments with the offset, the day once where it is the same."""
        begin, end = self._local(first), self._local(last)
        if begin.date() != end.date() or begin.utcoffset() != end.utcoffset():
            return self.say(said("{first} to {last}", first=self.moment(first), last=self.moment(last)))
        clock = said("{first} to {last}", first=f"{begin:%H:%M:%S}", last=f"{end:%H:%M:%S}")
        return f"{self.day(begin.date())}, {self.say(clock)} {offset_text(end)}"

    def _local(self, at: datetime) -> datetime:
        aware = at if at.tzinfo is not None else at.replace(tzinfo=UTC)
        return aware if self.zone is None else aware.astimezone(self.zone)

    def day(self, at: date) -> str:
        """Return a day in this language's form."""
        if self.code == "en":
            return at.isoformat()
        from babel.dates import format_date  # noqa: PLC0415 - only for other languages

        return format_date(at, format="medium", locale=self.code)

    def _number(self, found: re.Match[str]) -> str:
        whole, part = found.groups()
        if len(whole) >= _GROUPED_FROM:
            first = len(whole) % 3
            groups = [whole[:first], *(whole[at : at + 3] for at in range(first, len(whole), 3))]
            whole = _THIN.join(filter(None, groups))
        return whole if part is None else f"{whole}{self.decimal}{part}"

    @property
    def _catalogue(self) -> gettext.GNUTranslations:
        return _compiled(self.code)

    def _from_evaluation(self, text: str) -> str:
        """Return a text of the evaluation by the message that has its form, or the text as it is.

        Several reasons in one are told apart by their semicolons.
        """
        if not _WORDS.search(text):
            return text
        whole = _in_parts(self, text)
        if whole is None and text.endswith(")"):
            whole = _with_remark(self, text)
        return text if whole is None else whole

    @property
    def between(self) -> str:
        """What stands between several reasons."""
        return _FRENCH_BETWEEN if self.code == "fr" else _BETWEEN


ENGLISH = Language()


def language_of(code: Code = "en", zone: str = "") -> Language:
    """Return a language with a time zone.

    Parameters
    ----------
    code : str
        One of :data:`LANGUAGES`.
    zone : str
        Name of the IANA data base, ``Europe/Berlin``; empty: each time as it is on record.

    Raises
    ------
    BadInput
        If there is no such time zone.
    """
    return Language(code, zone_named(zone) if zone else None)


def zone_named(name: str) -> ZoneInfo:
    """Return a time zone by its name.

    Raises
    ------
    BadInput
        If this machine knows no such zone.
    """
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        raise BadInput(
            f"there is no time zone “{name}”",
            place="time_zone",
            remedy="give a name of the IANA data base, as Europe/Berlin; if it is one, install the package "
            "tzdata",
        ) from None


@dataclass(frozen=True)
class _Form:
    """A message of the evaluation: how its texts look, and what they are in a language."""

    pattern: re.Pattern[str]
    translation: str


def _in_parts(language: Language, text: str, *, with_foreign: bool = False) -> str | None:
    """Return reasons in a row in a language, or None where one is not known.

    As many parts as a message has are taken together. ``with_foreign``: what is not known stays as it is.
    """
    parts, said_parts, at = text.split(_BETWEEN), [], 0
    while at < len(parts):
        for end in range(min(len(parts), at + _LONGEST), at, -1):
            known = _part(language, _BETWEEN.join(parts[at:end]))
            if known is not None:
                break
        else:
            if not with_foreign:
                return None
            end, known = at + 1, parts[at]
        said_parts.append(known)
        at = end
    return language.between.join(said_parts)


def _part(language: Language, text: str) -> str | None:
    return _known(language, text) if _WORDS.search(text) else language.numeral(text)


def _with_remark(language: Language, text: str) -> str | None:
    """Return a text with remarks in brackets behind it, or None where what is before them is not known."""
    for found in re.finditer(r" [(]", text):
        before = _in_parts(language, text[: found.start()])
        if before is not None:
            return f"{before} ({_details(language, text[found.end() : -1])})"
    return None


def _details(language: Language, text: str) -> str:
    """Return reasons in a row, those that are not known as they are."""
    whole = language.say(text)
    return whole if whole != text else _in_parts(language, text, with_foreign=True) or text


@lru_cache(maxsize=4096)
def _known(language: Language, text: str) -> str | None:
    """Return a text of the evaluation in a language, or None where no message has its form."""
    if len(text) > _LONGEST_TEXT:
        return None
    for form in _forms(language.code):
        found = form.pattern.fullmatch(text)
        if found is None:
            continue
        facts = {}
        for name, fact in found.groupdict().items():
            listed = name in _LISTED
            said = _details(language, fact) if listed else language.say(fact)
            if said == fact and not listed and (name in _TOLD or _BETWEEN in fact) and _WORDS.search(fact):
                break
            facts[name] = _numbers(language, fact) if said == fact and name not in _WRITTEN else said
        else:
            return form.translation.format_map(facts)
    return None


def _numbers(language: Language, fact: str) -> str:
    """Return a fact with its numbers as a language writes them, and lists (``1 to 3, 5``) in its words."""
    if _NAMES.fullmatch(fact):
        return language.say(said(" and ")).join(fact.rsplit(" and ", 1))
    if not _LIST.fullmatch(fact):
        return language.numeral(fact)
    return _FROM_TO.sub(
        lambda ends: language.say(said("{first} to {last}", first=ends[1], last=ends[2])), fact
    )


@lru_cache
def _compiled(code: Code) -> gettext.GNUTranslations:
    """Return a catalogue as the standard library's own: it knows plural forms."""
    from babel.messages.mofile import write_mo  # noqa: PLC0415 - only for other languages

    compiled = io.BytesIO()
    write_mo(compiled, read_catalogue(code))
    compiled.seek(0)
    return gettext.GNUTranslations(compiled)


def read_catalogue(code: Code) -> Catalog:
    """Return the catalogue of a language as Babel reads it."""
    from babel.messages.pofile import read_po  # noqa: PLC0415 - only for other languages

    text = files("bufferstand.evaluation.wording").joinpath("catalogues", f"{code}.po").read_bytes()
    return read_po(io.BytesIO(text), locale=code)


@lru_cache
def _forms(code: Code) -> Sequence[_Form]:
    """Return the messages of the evaluation, those with the most fixed letters first."""
    entries = [one for one in read_catalogue(code) if one.context == EVALUATION and one.id]
    entries.sort(key=lambda one: (-len(_FACT.sub("", str(one.id))), str(one.id)))
    return [_Form(_pattern(str(one.id)), str(one.string)) for one in entries]


def _pattern(message: str) -> re.Pattern[str]:
    """Return what texts of a message look like; a fact that stands twice is the same both times."""
    out, seen, end = "", set(), 0
    for found in _FACT.finditer(message):
        name = found[1]
        out += re.escape(message[end : found.start()])
        out += f"(?P={name})" if name in seen else f"(?P<{name}>{_OF_FACT.get(name, '.+?')})"
        seen.add(name)
        end = found.end()
    return re.compile(out + re.escape(message[end:]), re.DOTALL)
