"""The look of every figure: readable in colour, in black and white, and by the colour-blind.

Colours are those of Okabe and Ito (2008), "Color Universal Design"; yellow is left out because it vanishes on
paper. Each colour comes with a line style and a symbol of its own.
"""

from __future__ import annotations

from typing import Any

INK = "#000000"
SHADE = "#ececec"
LIGHT_SHADE = "#f8f8f8"
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Blue, vermilion, bluish green, reddish purple, orange, sky blue."""

DASHES: tuple[Any, ...] = (
    "solid",
    (0, (5.0, 1.6)),
    (0, (6.0, 1.5, 1.0, 1.5)),
    (0, (2.2, 1.2)),
    (0, (9.0, 2.0)),
    (0, (6.0, 1.3, 1.0, 1.3, 1.0, 1.3)),
)
DOTTED = (0, (1.0, 1.5))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

VERDICT_MARKERS = {
    "pass": ("o", "#009E73", "full"),
    "conditional-pass": ("o", "#009E73", "none"),
    "conditional-fail": ("X", "#D55E00", "none"),
    "fail": ("X", "#D55E00", "full"),
    "inconclusive": ("D", "#6b6b6b", "none"),
    "not-tested": ("D", "#6b6b6b", "none"),
    "invalid": ("X", "#6b6b6b", "full"),
}
"""Symbol, colour and fill of a verdict: round is pass, a cross is fail, a diamond is neither."""

WIDTH_MM = 170.0
MM = 1.0 / 25.4

RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.7,
    "axes.edgecolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#d9d9d9",
    "grid.linewidth": 0.5,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "lines.linewidth": 1.2,
    "lines.markersize": 5.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "bufferstand",
    "path.simplify": True,
}


def colour(tone: int) -> str:
    """Return the colour of a tone; negative tones are black."""
    return INK if tone < 0 else COLOURS[tone % len(COLOURS)]


def dash(index: int) -> Any:
    """Return matplotlib's line style of an index; negative ones are dotted."""
    return DOTTED if index < 0 else DASHES[index % len(DASHES)]


def marker(index: int) -> str:
    """Return matplotlib's symbol of an index."""
    return MARKERS[index % len(MARKERS)]
