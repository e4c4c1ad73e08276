"""What a figure shows, as plain data: the painter draws it and computes nothing.

Labels carry their unit. A ``tone`` picks the colour, a ``dash`` the line style, a ``marker`` the symbol, each
from the palette of :mod:`bufferstand.evaluation.figures.style`, so that no two curves differ by colour alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BLACK = -1
"""The tone of reference curves."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A line; NaN interrupts it."""

    label: str
    x: Floats
    y: Floats
    tone: int = 0
    dash: int = 0
    marker: int | None = None
    filled: bool = False
    """Shade the area that the line encloses."""


@dataclass(frozen=True)
class Window:
    """A permitted range of ``y`` at one ``x``, and what was measured there."""

    at: float
    lower: float
    upper: float
    measured: tuple[float, ...]
    verdict: str
    label: str


@dataclass(frozen=True)
class Span:
    """A shaded part of the time axis: one step of a campaign."""

    start: float
    end: float
    label: str


@dataclass(frozen=True)
class Level:
    """A horizontal line: a limit."""

    at: float
    label: str


@dataclass(frozen=True)
class Stop:
    """An instant at which something ended early."""

    at: float
    label: str


@dataclass(frozen=True, eq=False)
class Points:
    """Measured values with their expanded uncertainty (0 where none is known)."""

    label: str
    x: Floats
    y: Floats
    error: Floats
    tone: int = 0


@dataclass(frozen=True, eq=False)
class Fit:
    """A fitted line over its range, with its confidence band if there is one."""

    label: str
    x: Floats
    y: Floats
    lower: Floats | None = None
    upper: Floats | None = None
    tone: int = 0
    dash: int = 1


@dataclass(frozen=True)
class Plot:
    """A whole figure: axes and what is drawn in them."""

    x_label: str
    y_label: str
    kind: Literal["loops", "trend", "timeline"] = "loops"
    curves: tuple[Curve, ...] = ()
    windows: tuple[Window, ...] = ()
    windows_of: str = ""
    """Standard and clause of the windows, for the legend."""
    spans: tuple[Span, ...] = ()
    levels: tuple[Level, ...] = ()
    stops: tuple[Stop, ...] = ()
    points: tuple[Points, ...] = ()
    fits: tuple[Fit, ...] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    height_mm: float = field(default=95.0)
    whole_x: bool = field(default=False, metadata={"said": False})
    """Whether x is a number of something: its axis has whole numbers only."""
    below: Plot | None = None
    """A further panel under this one, over the same x axis."""

    def panels(self) -> tuple[Plot, ...]:
        """Return this panel and those below it, from the top."""
        return (self,) if self.below is None else (self, *self.below.panels())

    def facts(self) -> dict[str, Any]:
        """Return what is drawn as a JSON object (breaks are null): the figure's part of the report's hash."""
        plain = _plain(self)
        assert isinstance(plain, dict)
        return plain


def _plain(value: object) -> object:
    if isinstance(value, np.ndarray):
        # Six significant digits: finer than any printed line, coarser than a last-bit difference.
        return [None if np.isnan(v) else float(f"{v:.6g}") for v in value]
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if hasattr(value, "__dataclass_fields__"):
        parts = value.__dataclass_fields__.values()
        return {one.name: _plain(getattr(value, one.name)) for one in parts if one.metadata.get("said", True)}
    return value
