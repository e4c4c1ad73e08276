"""Reading XML that others wrote: bounded, without document types and entities; nothing is fetched."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree as ET

from bufferstand.foundation.errors import BadInput

LARGEST = 16 << 20
"""Bytes of an XML file; a certificate with its report inside has one or two million."""
DEEPEST = 64
"""Elements within one another; a calibration certificate has some twenty."""
MOST_ELEMENTS = 200_000


class _RefusedError(Exception):
    """What a file holds that none of its kind needs."""


class _Bounded(ET.TreeBuilder):
    """Builds the tree, and stops at the first thing that is out of bounds."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = self._count = 0

    def doctype(self, *_: object) -> None:
        """Refuse a document type before anything that it declares is read."""
        raise _RefusedError("it has a document type (<!DOCTYPE …>), which could name other files")

    def start(self, tag: str, attrs: dict[str, str]) -> ET.Element:
        """Begin an element."""
        self._depth += 1
        self._count += 1
        if self._depth > DEEPEST:
            raise _RefusedError(f"more than {DEEPEST} elements lie within one another")
        if self._count > MOST_ELEMENTS:
            raise _RefusedError(f"it has more than {MOST_ELEMENTS} elements")
        return super().start(tag, attrs)

    def end(self, tag: str) -> ET.Element:
        """End an element."""
        self._depth -= 1
        return super().end(tag)


def xml_tree(path: Path) -> ET.Element:
    """Return the root element of an XML file.

    Raises
    ------
    BadInput
        If it cannot be read, is no XML, has a document type, or is larger or deeper than any that is wanted.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(LARGEST + 1)
    except OSError as error:
        raise BadInput(
            f"it cannot be read: {error.strerror}", file=path, remedy="check the path, and who may read it"
        ) from None
    if len(data) > LARGEST:
        raise BadInput(f"longer than {LARGEST >> 20} MiB", file=path, remedy="this is none: check the path")
    parser = ET.XMLParser(target=_Bounded())
    try:
        parser.feed(data)
        root: ET.Element = parser.close()
    except _RefusedError as refused:
        raise BadInput(str(refused), file=path, remedy="ask for the plain XML file") from None
    except ET.ParseError as error:
        line, column = error.position
        raise BadInput(
            "it is no XML",
            file=path,
            place=f"line {line}, column {column + 1}",
            remedy="give the certificate’s XML file, not its PDF, and as it came",
        ) from None
    except (LookupError, ValueError) as error:
        raise BadInput(f"it is no XML: {error}", file=path, remedy="ask for it in UTF-8") from None
    return root
