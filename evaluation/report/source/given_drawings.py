"""Drawings (SVG) of the laboratory: taken if they need nothing but themselves, alike in HTML and PDF."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

from bufferstand.foundation import BadInput
from bufferstand.foundation.files import xml_tree

_SVG = "{http://www.w3.org/2000/svg}"
_NOT_TAKEN = {
    "text": ("letters that need a font", "convert the text to paths, and save it anew"),
    "image": ("a picture in it", "draw it, or give the picture itself as PNG or JPEG"),
    "script": ("a script", "save it without"),
    "foreignObject": ("what is no drawing (foreignObject)", "save it as plain SVG"),
    "animate": ("an animation", "save it without"),
}
_ELSEWHERE = re.compile(r"url\(\s*['\"]?(?!#)|@import", re.IGNORECASE)
_PLAIN = "save it as plain SVG, in UTF-8"


def check_drawing(file: Path, key: str) -> None:
    """Refuse a drawing that the HTML and the PDF of a report would not show alike.

    Parameters
    ----------
    file : Path
        The SVG file.
    key : str
        Its key in ``report.toml``, for messages.

    Raises
    ------
    BadInput
        If it is no SVG, has no size, holds letters, pictures, scripts, animations, or names what is outside.
    """
    try:
        root = xml_tree(file)
    except BadInput as error:
        raise BadInput(
            f"the drawing is not taken: {error.problem}", file=file, place=key, remedy=_PLAIN
        ) from None
    if root.tag != f"{_SVG}svg":
        raise BadInput("the drawing is no SVG", file=file, place=key, remedy=_PLAIN)
    if "viewBox" not in root.attrib and not {"width", "height"} <= set(root.attrib):
        raise BadInput(
            "the drawing has no size", file=file, place=key, remedy="add viewBox, or width and height"
        )
    for problem, remedy in _problems(root):
        raise BadInput(f"the drawing has {problem}", file=file, place=key, remedy=remedy)


def _problems(root: ET.Element) -> Iterator[tuple[str, str]]:
    for element in root.iter():
        name = str(element.tag).removeprefix(_SVG)
        if name in _NOT_TAKEN:
            yield _NOT_TAKEN[name]
        outside = "something from elsewhere", "save it with all that it shows inside"
        if name == "style" and _ELSEWHERE.search("".join(element.itertext())):
            yield outside
        for key, value in element.attrib.items():
            local = key.rpartition("}")[2]
            if local.startswith("on"):
                yield _NOT_TAKEN["script"]
            if (local == "href" and not value.startswith("#")) or _ELSEWHERE.search(value):
                yield outside
