"""What a report says, as plain data: HTML and PDF are rendered from the same content and compute nothing.

Every number is already text, rounded and with its unit; a missing one is a dash, its reason in a footnote.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from hashlib import sha256
from itertools import count
from typing import Any, Literal

from bufferstand.evaluation.figures import Plot
from bufferstand.evaluation.report.content.own_template import OwnTemplate
from bufferstand.evaluation.report.content.prose import Image, Prose
from bufferstand.evaluation.wording import ENGLISH, Language, spoken
from bufferstand.foundation.files import content_hash

_JUDGED = frozenset({"good", "bad", "open"})
SCHEMA = "bufferstand/report/1"
DASH = "—"

Tone = Literal["text", "number", "missing", "good", "bad", "open", "code"]
"""How a cell is set: ``good`` passes, ``bad`` fails or is invalid, ``open`` is neither."""


@dataclass(frozen=True)
class Cell:
    """One entry of a table or fact sheet; ``why`` is the reason of a missing value."""

    text: str
    tone: Tone = "text"
    why: str = ""

    def __post_init__(self) -> None:
        if self.tone == "missing" and not self.why:
            raise ValueError("a missing value must say why it is missing")


@dataclass(frozen=True)
class Lack:
    """What a draft lacks and one place can give: a sentence that names the place, and what is missing."""

    where: str
    items: tuple[str, ...]


@dataclass(frozen=True)
class Column:
    """Heading and unit of a column."""

    title: str
    unit: str = ""


@dataclass(frozen=True)
class Table:
    """A table; missing values are explained below it, each reason once.

    Raises
    ------
    ValueError
        If a row has not as many cells as there are columns.
    """

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    concludes: bool = False
    """Whether the last column says what each row comes to: on a phone it must be seen, whatever it says."""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"table “{self.title}”: {len(row)} cells for {len(self.columns)} columns")


@dataclass(frozen=True)
class Sheet:
    """Facts with their names, one below the other."""

    title: str
    facts: tuple[tuple[str, Cell], ...]


@dataclass(frozen=True)
class Texts:
    """Paragraphs, or the entries of a list."""

    items: tuple[str, ...]
    listed: bool = False


@dataclass(frozen=True)
class VerdictLine:
    """A run's verdict, the sentence that says why, and the points that it rests on."""

    verdict: Cell
    subject: str
    sentence: str
    points: tuple[str, ...] = ()


@dataclass(frozen=True)
class Picture:
    """A figure: its caption, what a person who cannot see it is told, and the numbers behind it.

    It has its number when the report is whole (:func:`numbered`); 0 until then.
    """

    caption: str
    alt: str
    plot: Plot
    numbers: Table
    number: int = 0


@dataclass(frozen=True)
class Signature:
    """Who answers for what; an empty name is a line to sign on."""

    role: str
    name: str


@dataclass(frozen=True)
class Signatures:
    """The signatures at the end."""

    entries: tuple[Signature, ...]


Block = Table | Sheet | Texts | VerdictLine | Picture | Signatures | Prose
_KINDS: dict[type, str] = {
    Table: "table",
    Sheet: "sheet",
    Texts: "texts",
    VerdictLine: "verdict",
    Picture: "picture",
    Signatures: "signatures",
    Prose: "prose",
}


@dataclass(frozen=True)
class Section:
    """A headed part of the report; ``id`` is its anchor.

    One with ``annex`` stands behind the others, in the annex.
    """

    id: str
    title: str
    blocks: tuple[Block, ...]
    annex: bool = False


@dataclass(frozen=True)
class Content:
    """A whole report.

    Parameters
    ----------
    title, subtitle : str
        What is reported on.
    notices : tuple of str
        What must be seen before anything else: a simulated stand, stopped runs.
    lacks : tuple of Lack
        What the report still lacks to be one of ISO/IEC 17025; if there is anything, it is a draft.
    head : Sheet
        Identification.
    sections : tuple of Section
        In order.
    ended : str
        End of the last run, ISO 8601, the date of the document; empty if no run has one.
    software : str
        Name and version that made it.
    certificate : tuple of block
        What stands on the first page below the identification; the sections begin on the next one.
    detailed : bool
        Whether the numbers behind the figures are printed in the annex, too.
    mark, photo, accreditation : Image or None
        The laboratory's mark, the photo of the specimen and the mark of accreditation, where they are given.

    Raises
    ------
    ValueError
        If two sections have one anchor: a link would lead to the wrong one.
    """

    title: str
    subtitle: str
    notices: tuple[str, ...]
    lacks: tuple[Lack, ...]
    head: Sheet
    sections: tuple[Section, ...]
    ended: str
    software: str
    certificate: tuple[Block, ...] = ()
    detailed: bool = False
    mark: Image | None = None
    photo: Image | None = None
    accreditation: Image | None = None
    template: OwnTemplate | None = None
    """What the laboratory puts in the place of blocks of the shipped templates."""
    language: Language = field(default=ENGLISH, metadata={"said": False})
    """In which it is written; its texts are in the hash, and so this need not be."""

    def __post_init__(self) -> None:
        anchors = [section.id for section in self.sections]
        for section in self.sections:
            if anchors.count(section.id) > 1:
                raise ValueError(f"section “{section.title}”: its anchor “{section.id}” is another's, too")

    @property
    def missing(self) -> tuple[str, ...]:
        """All that a draft lacks, wherever it is to be given; empty in a report."""
        return tuple(item for lack in self.lacks for item in lack.items)

    @cached_property
    def report_id(self) -> str:
        """The report's name: a hash of all that it says and shows, so that another content has another id."""
        return "BR-" + content_hash(_plain(self))[:12]

    def blocks(self) -> tuple[Block, ...]:
        """Return all that stands below the identification, in its order."""
        return (*self.certificate, *(block for section in self.sections for block in section.blocks))

    def pictures(self) -> tuple[Picture, ...]:
        """Return the figures in the order of their numbers."""
        return tuple(block for block in self.blocks() if isinstance(block, Picture))

    def given(self) -> dict[str, Image]:
        """Return the pictures that the laboratory gave, by name."""
        named = {name: getattr(self, name) for name in ("mark", "photo", "accreditation")}
        within = [image for block in self.blocks() if isinstance(block, Prose) for image in block.images()]
        return {name: image for name, image in named.items() if image is not None} | {
            image.name: image for image in within
        }

    def document(self) -> dict[str, Any]:
        """Return the content as a JSON object for the renderers; figures by number, without their data.

        Returns
        -------
        dict
            The content with ``schema`` and ``report_id``; each block with its ``kind``; each missing value
            with the letter of its footnote, each table with its ``footnotes``.
        """
        return {
            "schema": SCHEMA,
            "report_id": self.report_id,
            "title": self.title,
            "subtitle": self.subtitle,
            "notices": list(self.notices),
            "missing": list(self.missing),
            "lacks": [{"where": lack.where, "items": list(lack.items)} for lack in self.lacks],
            "head": _block(self.head),
            "certificate": [_block(block) for block in self.certificate],
            "sections": [
                {
                    "id": section.id,
                    "title": section.title,
                    "annex": section.annex,
                    "blocks": [_block(block, section.title) for block in section.blocks],
                }
                for section in self.sections
            ],
            "detailed": self.detailed,
            "given": {
                name: {"alt": image.alt, "file": f"{name}.{image.suffix}"}
                for name, image in self.given().items()
            },
            "ended": self.ended,
            "software": self.software,
        }


def in_language(content: Content, language: Language) -> Content:
    """Return a report's content with every text, number and time as a language has them."""
    if language.is_plain:
        return content
    return replace(spoken(content, language), language=language)


def numbered(
    certificate: Sequence[Block], sections: Iterable[Section]
) -> tuple[tuple[Block, ...], tuple[Section, ...]]:
    """Return the first page and the sections, the annex last, with the figures numbered in their order."""
    ordered = sorted(sections, key=lambda section: section.annex)
    numbers = count(1)

    def with_numbers(blocks: Sequence[Block]) -> tuple[Block, ...]:
        return tuple(
            replace(block, number=next(numbers)) if isinstance(block, Picture) else block for block in blocks
        )

    first = with_numbers(certificate)
    return first, tuple(replace(section, blocks=with_numbers(section.blocks)) for section in ordered)


def _plain(value: object) -> object:
    """Return everything that the report says and shows as JSON, for its hash."""
    if isinstance(value, Plot):
        return value.facts()
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, bytes):
        return sha256(value).hexdigest()
    if hasattr(value, "__dataclass_fields__"):
        said = [one.name for one in fields(value) if one.metadata.get("said", True)]  # type: ignore[arg-type]
        inner = {name: _plain(getattr(value, name)) for name in said}
        return {"is": type(value).__name__, **inner}
    return value


def _block(block: Block, section: str = "") -> dict[str, Any]:
    """Return a block for the renderers; a title that only repeats the section's is no heading."""
    out: dict[str, Any] = {"kind": _KINDS[type(block)]}
    if isinstance(block, Table | Sheet):
        out["heading"] = "" if block.title == section else block.title
    match block:
        case Table():
            out |= _table(block)
        case Sheet():
            notes = _Footnotes()
            out |= {
                "title": block.title,
                "facts": [{"name": name, **notes.cell(cell)} for name, cell in block.facts],
                "footnotes": notes.entries(),
            }
        case Texts():
            out |= {"items": list(block.items), "listed": block.listed}
        case VerdictLine():
            out |= {
                "verdict": _Footnotes().cell(block.verdict),
                "subject": block.subject,
                "sentence": block.sentence,
                "points": list(block.points),
            }
        case Picture():
            out |= {
                "number": block.number,
                "caption": block.caption,
                "alt": block.alt,
                "numbers": _table(block.numbers),
            }
        case Prose():
            out |= {"parts": block.document()}
        case Signatures():
            out |= {"entries": [{"role": e.role, "name": e.name} for e in block.entries]}
    return out


def _table(table: Table) -> dict[str, Any]:
    notes = _Footnotes()
    return {
        "title": table.title,
        "columns": [
            {"title": column.title, "unit": column.unit, "numeric": _is_numeric(table, number)}
            for number, column in enumerate(table.columns)
        ],
        "rows": [[notes.cell(cell) for cell in row] for row in table.rows],
        "judged": table.concludes or any(cell.tone in _JUDGED for row in table.rows for cell in row),
        "note": table.note,
        "footnotes": notes.entries(),
    }


def _is_numeric(table: Table, number: int) -> bool:
    """Say whether a column holds numbers, so that its heading stands over them."""
    tones = {row[number].tone for row in table.rows if row[number].text}
    return "number" in tones and tones <= {"number", "missing"}


class _Footnotes:
    """Letters for reasons: the same reason has the same letter within one table."""

    def __init__(self) -> None:
        self._letters: dict[str, str] = {}

    def cell(self, cell: Cell) -> dict[str, str]:
        letter = ""
        if cell.why:
            letter = self._letters.setdefault(cell.why, _letter(len(self._letters)))
        return {"text": cell.text, "tone": cell.tone, "note": letter}

    def entries(self) -> list[dict[str, str]]:
        return [{"letter": letter, "why": why} for why, letter in self._letters.items()]


def _letter(number: int) -> str:
    first, second = divmod(number, 26)
    return (chr(ord("a") + first - 1) if first else "") + chr(ord("a") + second)
