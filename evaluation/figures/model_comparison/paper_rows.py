"""One published figure beside ours."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperRow:
    """A published figure beside ours; ``paper`` is None where the paper prints no number."""

    figure: str
    quantity: str
    unit: str
    paper: float | None
    ours: float
    remark: str

    @property
    def difference(self) -> float | None:
        """Ours less the paper's."""
        return None if self.paper is None else self.ours - self.paper
