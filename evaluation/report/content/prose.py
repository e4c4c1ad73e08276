"""Text with structure that the laboratory wrote: headings, lists, tables, pictures. Data, never markup."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any, ClassVar, Literal

Mark = Literal["strong", "emphasis", "code"]
ProseKind = Literal[
    "heading",
    "paragraph",
    "list",
    "numbered",
    "item",
    "quote",
    "code",
    "table",
    "row",
    "cell",
    "rule",
    "picture",
]


@dataclass(frozen=True)
class Image:
    """A picture as it was given: the laboratory's mark, a photo of the specimen, one of an appendix."""

    alt: str
    suffix: Literal["png", "jpg", "svg"]
    data: bytes = field(repr=False)

    @property
    def name(self) -> str:
        """A name by its content, the same for the same picture."""
        return f"picture-{sha256(self.data).hexdigest()[:12]}"


@dataclass(frozen=True)
class Words:
    """A piece of a line, set one way; with ``link`` it leads there."""

    text: str
    marks: tuple[Mark, ...] = ()
    link: str = ""


@dataclass(frozen=True)
class ProsePart:
    """A part of a text: its words, or the parts that it is made of.

    Parameters
    ----------
    kind : str
        What it is; ``list``, ``numbered``, ``quote``, ``table`` and ``row`` are made of ``parts``.
    level : int
        Of a heading below the section's, from 1; the first number of a numbered list.
    image : Image or None
        Of a picture, with its caption in ``words``.
    """

    kind: ProseKind
    words: tuple[Words, ...] = ()
    parts: tuple[ProsePart, ...] = ()
    level: int = 0
    image: Image | None = None


@dataclass(frozen=True)
class Prose:
    """A text of the laboratory's own, part by part."""

    as_given: ClassVar[bool] = True
    """No language changes its words, but those that are the program's."""
    parts: tuple[ProsePart, ...]

    def images(self) -> Iterator[Image]:
        """Yield the pictures in it."""
        yield from _images(self.parts)

    def document(self) -> list[dict[str, Any]]:
        """Return it for the renderers; pictures by the name of their file."""
        return [_document(part) for part in self.parts]


def _images(parts: tuple[ProsePart, ...]) -> Iterator[Image]:
    for part in parts:
        if part.image is not None:
            yield part.image
        yield from _images(part.parts)


def _document(part: ProsePart) -> dict[str, Any]:
    said: Mapping[str, Any] = {
        "kind": part.kind,
        "level": part.level,
        "words": [{"text": w.text, "marks": list(w.marks), "link": w.link} for w in part.words],
        "parts": [_document(inner) for inner in part.parts],
    }
    image = part.image
    picture = {} if image is None else {"picture": image.name, "file": f"{image.name}.{image.suffix}"}
    return {**said, **picture, "alt": image.alt if image is not None else ""}
