"""Introduction and appendices of the laboratory: Markdown (CommonMark, tables) becomes prose of the report.

What HTML and PDF cannot show the same way is refused with its line: HTML, pictures from elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NoReturn
from urllib.parse import unquote, urlsplit

from markdown_it import MarkdownIt
from markdown_it.tree import SyntaxTreeNode

from bufferstand.evaluation.report.content import Mark, Prose, ProsePart, Words
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import read_text

LONGEST_BYTES = 1_000_000
_DEEPEST = 8
"""Lists in lists, quotes in quotes: beyond, no page has room for the text."""
_DEEPEST_HEADING = 3
_BREAKS = {"softbreak": " ", "hardbreak": "\n"}
_LINKS = ("http", "https", "mailto")
_MARKS: dict[str, Mark] = {"strong": "strong", "em": "emphasis", "code_inline": "code"}


@dataclass(frozen=True)
class OwnText:
    """A text of the laboratory's own with its title (empty where it has none)."""

    title: str
    prose: Prose


def read_own_text(path: str) -> OwnText:
    """Read a text in Markdown.

    Parameters
    ----------
    path : str
        The file, UTF-8. A first heading ``# …`` is its title; those below are ``##`` and ``###``. Pictures
        are PNG, JPEG or SVG files, beside it, on a line of their own.

    Returns
    -------
    OwnText
        Title and text, without markup.

    Raises
    ------
    BadInput
        If it cannot be read, is empty, or has what a report does not take; with the line.
    """
    file = Path(path)
    text = read_text(file, LONGEST_BYTES)
    parser = MarkdownIt("commonmark", {"maxNesting": 2 * _DEEPEST + 4}).enable("table")
    reader = _Reader(file)
    # Each address is judged here; the parser would leave one that it does not like as text.
    parser.validateLink = _any_address  # type: ignore[method-assign]
    nodes = SyntaxTreeNode(parser.parse(text)).children
    title = ""
    if nodes and nodes[0].type == "heading" and nodes[0].tag == "h1":
        title = "".join(words.text for words in reader.line(nodes[0]))
        nodes = nodes[1:]
    parts = tuple(part for node in nodes for part in reader.parts(node, 1))
    if not parts:
        raise BadInput("there is no text in it", file=file, remedy="write it, or leave the key out")
    return OwnText(title, Prose(parts))


def _any_address(url: str) -> bool:  # noqa: ARG001 - the parser asks so
    return True


@dataclass(frozen=True)
class _Reader:
    """Reads the nodes of one file; says its name in every refusal."""

    file: Path

    def parts(self, node: SyntaxTreeNode, depth: int) -> Iterator[ProsePart]:
        """Yield what a node becomes."""
        if depth > _DEEPEST:
            self._refuse(node, f"lists and quotes are {depth} deep", f"at most {_DEEPEST} are taken")
        match node.type:
            case "paragraph":
                yield from self._paragraph(node)
            case "heading":
                yield self._heading(node)
            case "bullet_list" | "ordered_list":
                yield self._list(node, depth)
            case "blockquote":
                yield ProsePart("quote", parts=self._inner(node, depth))
            case "fence" | "code_block":
                yield ProsePart("code", (Words(node.content.rstrip("\n")),))
            case "table":
                yield self._table(node)
            case "hr":
                yield ProsePart("rule")
            case "html_block":
                self._refuse(node, "HTML is not taken", "write it in Markdown")
            case other:
                self._refuse(node, f"“{other}” is not taken", "write it in plain Markdown")

    def line(self, node: SyntaxTreeNode) -> tuple[Words, ...]:
        """Return the words of a heading, a paragraph or a cell."""
        return _joined([words for inline in node.children for words in self._inline(inline, (), "")])

    def _inner(self, node: SyntaxTreeNode, depth: int) -> tuple[ProsePart, ...]:
        return tuple(part for inner in node.children for part in self.parts(inner, depth + 1))

    def _heading(self, node: SyntaxTreeNode) -> ProsePart:
        level = int(node.tag[1:])
        if level == 1:
            self._refuse(
                node, "a heading “#” that is not the first line", "the text has one title; use ## or ###"
            )
        if level > _DEEPEST_HEADING:
            self._refuse(node, f"a heading “{'#' * level}”", "use ## or ###")
        return ProsePart("heading", self.line(node), level=level - 1)

    def _list(self, node: SyntaxTreeNode, depth: int) -> ProsePart:
        items = tuple(ProsePart("item", parts=self._inner(item, depth)) for item in node.children)
        if node.type == "bullet_list":
            return ProsePart("list", parts=items)
        return ProsePart("numbered", parts=items, level=int(node.attrs.get("start", 1)))

    def _table(self, node: SyntaxTreeNode) -> ProsePart:
        rows = [row for group in node.children for row in group.children]
        return ProsePart(
            "table",
            parts=tuple(
                ProsePart("row", parts=tuple(ProsePart("cell", self.line(cell)) for cell in row.children))
                for row in rows
            ),
        )

    def _paragraph(self, node: SyntaxTreeNode) -> Iterator[ProsePart]:
        pieces = [piece for inline in node.children for piece in inline.children if piece.type != "softbreak"]
        if pieces and all(piece.type == "image" for piece in pieces):
            yield from (self._picture(piece, node) for piece in pieces)
        else:
            yield ProsePart("paragraph", self.line(node))

    def _picture(self, node: SyntaxTreeNode, within: SyntaxTreeNode) -> ProsePart:
        caption = _joined([words for piece in node.children for words in self._inline(piece, (), "")])
        named = unquote(str(node.attrs.get("src") or ""))
        if not caption:
            self._refuse(within, "a picture without a caption", "write ![what it shows](file.png)")
        if urlsplit(named).scheme or named.startswith("//"):
            self._refuse(
                within, f"the picture {named} is elsewhere", "put the file beside the text, and name it"
            )
        alt = "".join(words.text for words in caption)
        if not named:
            self._refuse(within, "a picture without a file", "write ![what it shows](file.png)")
        try:
            image = read_image(str(self.file.parent / named), "", alt)
        except BadInput as error:
            self._refuse(
                within, f"{named}: {error.problem}", "name a PNG, JPEG or SVG file, relative to the text"
            )
        return ProsePart("picture", caption, image=image)

    def _inline(self, node: SyntaxTreeNode, marks: tuple[Mark, ...], link: str) -> Iterator[Words]:
        match node.type:
            case "inline":
                for piece in node.children:
                    yield from self._inline(piece, marks, link)
            case "text" | "softbreak" | "hardbreak":
                yield Words(_BREAKS.get(node.type, node.content), marks, link)
            case "code_inline":
                yield Words(node.content, (*marks, "code"), link)
            case "strong" | "em":
                for piece in node.children:
                    yield from self._inline(piece, tuple(dict.fromkeys((*marks, _MARKS[node.type]))), link)
            case "link":
                for piece in node.children:
                    yield from self._inline(piece, marks, self._address(node))
            case "image":
                self._refuse(
                    node, "a picture within a line", "put it on a line of its own, with an empty one around"
                )
            case "html_inline":
                self._refuse(node, f"HTML is not taken ({node.content[:30]})", "write it in Markdown")
            case other:
                self._refuse(node, f"“{other}” is not taken", "write it in plain Markdown")

    def _address(self, node: SyntaxTreeNode) -> str:
        address = str(node.attrs.get("href") or "")
        if urlsplit(address).scheme not in _LINKS:
            self._refuse(
                node,
                f"the link to “{address}” leads nowhere from a report",
                "give an https:// or mailto: address",
            )
        return address

    def _refuse(self, node: SyntaxTreeNode, problem: str, remedy: str) -> NoReturn:
        raise BadInput(problem, file=self.file, place=f"line {_line_of(node)}", remedy=remedy)


def _line_of(node: SyntaxTreeNode) -> int:
    """Return the line in which a node begins, from 1; of a piece of a line, that of its paragraph."""
    at: SyntaxTreeNode | None = node
    while at is not None and at.map is None:
        at = at.parent
    return 1 if at is None or at.map is None else at.map[0] + 1


def _joined(pieces: Sequence[Words]) -> tuple[Words, ...]:
    """Return words with neighbours of one kind joined, so that a number is not cut apart from its unit."""
    out: list[Words] = []
    for piece in pieces:
        if out and (out[-1].marks, out[-1].link) == (piece.marks, piece.link):
            out[-1] = replace(out[-1], text=out[-1].text + piece.text)
        elif piece.text:
            out.append(piece)
    return tuple(out)
