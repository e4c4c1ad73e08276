"""The pages of the documentation: beside the rooms in a checkout, inside ``cli`` in an installed wheel."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from bufferstand.foundation import BadInput

FIRST = "index"
"""The page on which everything begins, and which lists the others."""
_FENCE = re.compile(r"^(```+|~~~+)")
_HEADING = re.compile(r"^(#{1,4}) +(.+?) *#*$")
_TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)
_CAPTION = re.compile(r"^:caption: *(.+)$", re.MULTILINE)
_LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
_MARKS = re.compile(r"^```.*$|^\|[-|: ]+\|$|[`*]", re.MULTILINE)
_CELLS = re.compile(r" *\| *")
_WORD = re.compile(r"\w+")
_NO_PART_OF_AN_ANCHOR = re.compile(r"[^\w\- ]")


@dataclass(frozen=True)
class Section:
    """What stands below one heading.

    Attributes
    ----------
    heading : str
        Plain text.
    anchor : str
        Its name in a link, as GitHub and MyST make it.
    text : str
        Markdown without the heading.
    """

    heading: str
    anchor: str
    text: str

    @cached_property
    def plain(self) -> str:
        """Its text as one reads it."""
        return " ".join(plain_text(self.text).split())

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Words of its text, in small letters."""
        return words_of(self.plain)


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes
    ----------
    name : str
        ``how-to/zero``: its path without ``.md``.
    text : str
        Markdown.
    """

    name: str
    text: str

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Its sections; the first is that of the title."""
        return tuple(_sections(self.text))

    @property
    def title(self) -> str:
        """Its title."""
        return next((section.heading for section in self.sections if section.heading), self.name)

    @property
    def body(self) -> str:
        """Markdown without the lists of pages that Sphinx reads."""
        return _TOCTREE.sub("", self.text)

    @property
    def listed(self) -> dict[str, tuple[str, ...]]:
        """Names of the pages that it lists, by caption; ``*`` in one stands for any."""
        found = {}
        for block in _TOCTREE.findall(self.text):
            caption = _CAPTION.search(block)
            lines = (line.strip() for line in block.splitlines())
            found[caption.group(1) if caption else ""] = tuple(
                line for line in lines if line and not line.startswith(":")
            )
        return found


def read_pages(folder: Path | None = None) -> Mapping[str, Page]:
    """Return the pages by name.

    Parameters
    ----------
    folder : Path, optional
        Where they lie; None: those of this installation.

    Raises
    ------
    BadInput
        If this installation has none.
    """
    folder = folder or documentation_folder()
    return {
        (name := path.relative_to(folder).with_suffix("").as_posix()): Page(
            name, path.read_text(encoding="utf-8")
        )
        for path in sorted(folder.rglob("*.md"))
    }


def documentation_folder() -> Path:
    """Return the folder of the pages.

    Raises
    ------
    BadInput
        If this installation has none.
    """
    here = Path(__file__).resolve().parent.parent
    for folder in (here.parent / "docs", here / "docs"):
        if (folder / f"{FIRST}.md").is_file():
            return folder
    raise BadInput(
        "this installation has no documentation", remedy="install bufferstand from a checkout or its wheel"
    )


def plain_text(markdown: str) -> str:
    """Return Markdown without its marks, as one reads it."""
    return _CELLS.sub(" ", _MARKS.sub("", _LINK.sub(r"\1", markdown)))


def words_of(text: str) -> tuple[str, ...]:
    """Return the words of a text in small letters."""
    return tuple(_WORD.findall(text.casefold()))


def anchor_of(heading: str) -> str:
    """Return the anchor of a heading (plain text), as GitHub and MyST make it."""
    return _NO_PART_OF_AN_ANCHOR.sub("", heading.lower()).strip().replace(" ", "-")


def _sections(text: str) -> Iterator[Section]:
    heading, lines, fence = "", [], ""
    for line in text.splitlines():
        if mark := _FENCE.match(line):
            fence = "" if fence and line.startswith(fence) else fence or mark.group(1)
        found = None if fence else _HEADING.match(line)
        if found is None:
            lines.append(line)
            continue
        if heading or any(lines):
            yield Section(heading, anchor_of(heading), "\n".join(lines))
        heading, lines = plain_text(found.group(2)), []
    yield Section(heading, anchor_of(heading), "\n".join(lines))
