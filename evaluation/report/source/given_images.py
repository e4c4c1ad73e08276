"""The laboratory's mark and the photo of the specimen, as report.toml names them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Literal

from matplotlib.image import imread

from bufferstand.evaluation.report.content import Image
from bufferstand.evaluation.report.source.given_drawings import check_drawing
from bufferstand.foundation import BadInput

MOST_BYTES = 5_000_000
"""A larger picture makes a report that nobody can send."""
_BEGINS: dict[Literal["png", "jpg"], bytes] = {"png": b"\x89PNG\r\n\x1a\n", "jpg": b"\xff\xd8\xff"}


def read_image(path: str, key: str, alt: str) -> Image | None:
    """Read a picture that ``report.toml`` names.

    Parameters
    ----------
    path : str
        The file, PNG, JPEG or SVG; empty where none is given.
    key : str
        Its key in ``report.toml``, for messages.
    alt : str
        What a person who cannot see it is told.

    Returns
    -------
    Image or None
        None where none is given.

    Raises
    ------
    BadInput
        If it cannot be read, is none of these, is damaged, larger than 5 MB or in CMYK, or is a drawing that
        HTML and PDF would not show alike.
    """
    if not path:
        return None
    file = Path(path)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise BadInput(
            f"the picture cannot be read: {error.strerror or error}",
            file=file,
            place=key,
            remedy=f"correct {key} in report.toml (relative to that file)",
        ) from None
    if len(data) > MOST_BYTES:
        raise BadInput(
            f"the picture has {len(data) / 1e6:.1f} MB, more than 5 MB",
            file=file,
            place=key,
            remedy="save it smaller; a side of 1500 pixels is enough",
        )
    if file.suffix.lower() == ".svg":
        check_drawing(file, key)
        return Image(alt, "svg", data)
    kind = next((name for name, begin in _BEGINS.items() if data.startswith(begin)), None)
    if kind is None:
        raise BadInput(
            "the picture is neither PNG, JPEG nor SVG", file=file, place=key, remedy="save it as one of these"
        )
    try:
        pixels = imread(io.BytesIO(data), format=kind)
    except Exception as error:  # noqa: BLE001 - each decoder has exceptions of its own
        raise BadInput(
            f"the picture is damaged: {error}", file=file, place=key, remedy="save it anew"
        ) from None
    if kind == "jpg" and pixels.shape[2:] == (4,):
        raise BadInput(
            "the picture is in the colours of print (CMYK), which PDF/A does not take without their profile",
            file=file,
            place=key,
            remedy="save it in RGB",
        )
    return Image(alt, kind, data)
