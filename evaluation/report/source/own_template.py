"""The folder that ``template`` of ``report.toml`` names: read whole, checked for what it is."""

from __future__ import annotations

from pathlib import Path

from bufferstand.evaluation.report.content import OwnTemplate, TemplateFile
from bufferstand.evaluation.report.source.given_images import MOST_BYTES
from bufferstand.foundation import BadInput

TEMPLATE_FILES = ("report.html.j2", "report.css", "report.typ")
_PICTURES = {".png": b"\x89PNG\r\n\x1a\n", ".jpg": b"\xff\xd8\xff"}


def read_own_template(folder: str) -> OwnTemplate | None:
    """Read an own template.

    Parameters
    ----------
    folder : str
        The folder; empty where none is given. Of its files those named ``report.html.j2``, ``report.css``,
        ``report.typ`` and pictures (PNG, JPEG) are read.

    Returns
    -------
    OwnTemplate or None
        None where none is given.

    Raises
    ------
    BadInput
        If it is no folder, has none of the three files, or a file cannot be read, is no UTF-8 or no picture.
    """
    if not folder:
        return None
    place = Path(folder)
    if not place.is_dir():
        raise BadInput("the template is no folder", file=place, remedy="correct template in report.toml")
    names = sorted(
        file.name for file in place.iterdir() if file.name in TEMPLATE_FILES or file.suffix in _PICTURES
    )
    if not set(names) & set(TEMPLATE_FILES):
        raise BadInput(
            f"the template has none of {', '.join(TEMPLATE_FILES)}",
            file=place,
            remedy="see the page “A report template of your own” (docs/how-to/own-report-template.md)",
        )
    return OwnTemplate(tuple(TemplateFile(name, _data(place / name)) for name in names), place)


def _data(file: Path) -> bytes:
    try:
        with file.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=file) from None
    if len(data) > MOST_BYTES:
        raise BadInput(f"longer than {MOST_BYTES / 1e6:g} MB", file=file, remedy="make it smaller")
    if (begins := _PICTURES.get(file.suffix)) is not None:
        if not data.startswith(begins):
            raise BadInput("no picture of the kind that its name says", file=file, remedy="save it anew")
        return data
    try:
        data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadInput(f"not UTF-8 text (byte {error.start})", file=file, remedy="save it as UTF-8") from None
    return data
