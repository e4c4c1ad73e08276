"""Schema of a description file: what an amplifier that speaks lines is asked, and what it answers.

``{key}`` in what is sent, and ``"?key"`` in place of a number, stand for what a stand file answers to the
``[[ask]]`` of that key: what the document does not say, or what is set in the device.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from bufferstand.drivers.descriptions import (
    Answer,
    Asked,
    Question,
    Source,
    Texts,
    as_entries,
    checked_answers,
)
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import (
    Settings,
    Within,
    WrongKeyError,
    load_shipped_or_own,
    shipped_names,
)

SHIPPED = Path(__file__).parent / "descriptions"
"""Folder of the descriptions that come with the software."""
MOST_DIGITS = 9
"""Digits that a value may have: it is kept as a whole number of 32 bits."""
_BLANK = re.compile(r"\{([a-z][a-z0-9_]*)\}")
_ENDS = ("\r", "\n", "\r\n")


class Exchange(Settings):
    """A command that is answered."""

    send: str = Field(min_length=1)
    expect: str = Field(min_length=1)
    """The answer, without its end."""


class Overload(Settings):
    """A line that is sent instead of a value."""

    text: str = Field(min_length=1)
    what: str = Field(min_length=1)


class LineDescription(Settings):
    """What an amplifier that speaks lines is asked, and what it answers."""

    id: str = Field(min_length=1)
    edition: int = Field(ge=1, le=10_000)
    title: str = Field(min_length=1)
    confirmed: bool = False
    """Whether it was tried on the device itself."""
    source: Annotated[tuple[Source, ...], as_entries] = Field(min_length=1)
    end: str = "\n"
    """End of a line that it sends."""
    command_end: str = "\r"
    """End of a command that it is sent."""
    begin: Annotated[tuple[Exchange, ...], as_entries] = ()
    """Commands before anything else, each with its answer."""
    request: str = ""
    """Asks for one value; without it values come by themselves."""
    start: str = ""
    """Lets values come by themselves, where it has to be told to."""
    stop: str = ""
    """Ends that; whatever comes of it is passed over."""
    zero: Exchange | None = None
    """Sets the present value as zero."""
    reply: str = Field(min_length=1)
    """Regular expression of a whole line with a value: its group ``value`` is a decimal number, its group
    ``unit``, where it has one, must be ``unit``."""
    example: str = Field(min_length=1)
    """A line with a value as the document prints it."""
    decimals: Annotated[int, Field(ge=0, le=MOST_DIGITS)] | Asked
    """Digits behind the point: a line with another number of them is not read, it would be ten times off."""
    unit: str | Asked = ""
    digits: int = Field(default=6, ge=1, le=MOST_DIGITS)
    """Digits of the greatest value that it can show."""
    refusals: Texts = ()
    """Lines that refuse a command."""
    overload: Annotated[tuple[Overload, ...], as_entries] = ()
    fastest_Hz: Annotated[float, Field(gt=0), Within(0.001, 100_000.0, "of a serial line")] | None = None
    """Values a second at most, where the document says it."""
    ask: Annotated[tuple[Question, ...], as_entries] = ()

    @model_validator(mode="after")
    def _makes_sense(self) -> LineDescription:
        for key in ("end", "command_end"):
            if getattr(self, key) not in _ENDS:
                raise WrongKeyError(f'{key} must be "\\r", "\\n" or "\\r\\n"', key)
        if self.request and (self.start or self.stop):
            raise WrongKeyError(
                "it is either asked for each value (request) or sends them by itself (start, stop)", "request"
            )
        try:
            pattern = re.compile(self.reply)
        except re.error as error:
            raise WrongKeyError(f"reply is no regular expression: {error}", "reply") from None
        if "value" not in pattern.groupindex:
            raise WrongKeyError("reply has no group (?P<value>…) for the number", "reply")
        if pattern.fullmatch(self.example) is None:
            raise WrongKeyError(f"reply does not match the example “{self.example}”", "reply", "example")
        if bool(self.unit) != ("unit" in pattern.groupindex):
            raise WrongKeyError("reply has a group (?P<unit>…) where unit is stated, and only there", "unit")
        asked = {one.key for one in self.ask}
        used = {value[1:] for value in (self.decimals, self.unit) if str(value).startswith("?")}  # type: ignore[index]
        sent = [self.request, self.start, self.stop, *(one.send for one in self.begin)]
        sent += [self.zero.send] if self.zero is not None else []
        used |= {key for text in sent for key in _BLANK.findall(text)}
        if used != asked:
            wrong = ", ".join(sorted(used ^ asked))
            raise WrongKeyError(f"what is asked is not what is used: {wrong}", "ask")
        return self


@dataclass(frozen=True)
class SpokenLines:
    """A description with the answers of a stand file in their places."""

    found: LineDescription
    answers: Mapping[str, Answer]

    def sent(self, text: str) -> bytes:
        """Return a command as it goes over the line; nothing of none."""
        if not text:
            return b""
        filled = _BLANK.sub(lambda one: str(self.answers[one[1]]), text)
        return (filled + self.found.command_end).encode("ascii", errors="replace")

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        value = self.found.decimals
        return int(self.answers[value[1:]] if isinstance(value, str) else value)

    @property
    def unit(self) -> str:
        """Text of the unit in a line; empty where it has none."""
        unit = self.found.unit
        return str(self.answers[unit[1:]]) if unit.startswith("?") else unit

    @property
    def end(self) -> bytes:
        """Last byte of a line."""
        return self.found.end[-1:].encode()

    @property
    def ends(self) -> tuple[int, int]:
        """Least and greatest count."""
        most = 10**self.found.digits - 1
        return -most, most

    @property
    def characters(self) -> int:
        """Bytes of a question and its answer on the line."""
        return len(self.sent(self.found.request)) + len(self.found.example) + len(self.found.end)


def load_line_description(name: str, folder: Path) -> LineDescription:
    """Return a description by the name of a shipped one, or from a TOML file.

    Parameters
    ----------
    name : str
        A name without ending, or a path that ends in ``.toml``.
    folder : Path
        Where a relative path starts from.

    Raises
    ------
    BadInput
        If there is none, or it breaks its schema.
    """
    return load_shipped_or_own(
        name,
        LineDescription,
        folder=folder,
        shipped=SHIPPED,
        what="there is no description “{name}” of an amplifier that speaks lines",
        place="line.description",
    )


def shipped_line_descriptions() -> tuple[str, ...]:
    """Return the names of the descriptions that come with the software."""
    return shipped_names(SHIPPED)


def spoken(name: str, answers: Mapping[str, Answer], folder: Path) -> SpokenLines:
    """Return a description with the answers in their places.

    Raises
    ------
    BadInput
        If it cannot be read, or an answer is missing or wrong.
    """
    found = load_line_description(name, folder)
    given = checked_answers(found.id, found.ask, answers)
    made = SpokenLines(found, given)
    if not 0 <= made.decimals <= MOST_DIGITS:
        raise BadInput(
            f"decimals = {made.decimals} cannot be", place="answers", remedy=f"write 0 to {MOST_DIGITS}"
        )
    return made
