"""What a signature shows on the page: by whom, above the line of who authorises.

The letters are outlines: a signature appended to a PDF/A may not bring a font that is not embedded.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.font_manager import FontProperties
from matplotlib.ft2font import FT2Font
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextPath

from bufferstand.evaluation.wording import ENGLISH, Language, said

_FONT = Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
_SIGNED_BY = said("Signed digitally by")
_LINES = ((17.0, 6.0), (5.0, 10.0))
"""Baseline and size of each line [pt]: that it is signed, and the name."""
_INK = "0.09 0.095 0.11 rg"


def drawing(name: str, width_pt: float, language: Language = ENGLISH) -> bytes:
    """Return what is drawn into the box of a signature, as operators of a PDF's content.

    Parameters
    ----------
    name : str
        Whose signature it is; a name with letters that the font lacks is left out.
    width_pt : float
        Width of the box [pt]; a longer name is set smaller.
    language : Language
        That of the report.
    """
    known = FT2Font(str(_FONT)).get_charmap()
    parts = [_INK]
    for (base_pt, size_pt), text in zip(_LINES, (language.say(_SIGNED_BY), name), strict=True):
        if all(ord(letter) in known for letter in text) and text.strip():
            outline = TextPath((0.0, 0.0), text, size=size_pt, prop=FontProperties(fname=_FONT))
            wide = float(outline.get_extents().x1)
            parts += _operators(outline, base_pt, min(1.0, width_pt / wide))
    return "\n".join(parts).encode()


def _operators(outline: Outline, base_pt: float, scale: float) -> list[str]:
    """Return an outline as filled curves; TrueType's quadratic ones become cubic ones."""
    out: list[str] = []
    at = (0.0, 0.0)
    for numbers, code in outline.iter_segments(simplify=False):
        points = [
            (float(x) * scale, float(y) * scale + base_pt)
            for x, y in zip(numbers[::2], numbers[1::2], strict=True)
        ]
        if code == Outline.CLOSEPOLY:
            out.append("h")
            continue
        if code == Outline.CURVE3:
            control, end = points
            points = [_third(at, control), _third(end, control), end]
        operator = {Outline.MOVETO: "m", Outline.LINETO: "l"}.get(code, "c")
        out.append(" ".join(f"{x:.2f} {y:.2f}" for x, y in points) + f" {operator}")
        at = points[-1]
    return [*out, "f"]


def _third(end: tuple[float, float], control: tuple[float, float]) -> tuple[float, float]:
    """Return a control point of the cubic curve that is a quadratic one."""
    return tuple(e + 2.0 / 3.0 * (c - e) for e, c in zip(end, control, strict=True))  # type: ignore[return-value]
