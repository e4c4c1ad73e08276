"""A figure of the report before it has its number."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.evaluation.figures import Plot
from bufferstand.evaluation.report.content import Table


@dataclass(frozen=True)
class DraftPicture:
    """A figure with its caption, what it shows in words, and the numbers behind it."""

    caption: str
    alt: str
    plot: Plot
    numbers: Table
