"""Where a report is signed."""

from __future__ import annotations

from dataclasses import dataclass

SIGNATURE_HEIGHT_PT = 26.0
"""Height of what a digital signature shows, above the line [pt]; the pages leave 12 mm there."""


@dataclass(frozen=True)
class SigningLine:
    """Where the line to sign on lies.

    Attributes
    ----------
    page : int
        From 1.
    left_pt, right_pt : float
        Its ends, from the left edge of the page [pt].
    foot_pt : float
        How far it lies above the lower edge of the page [pt].
    """

    page: int
    left_pt: float
    right_pt: float
    foot_pt: float

    @property
    def box(self) -> tuple[int, int, int, int]:
        """The rectangle above the line, in the coordinates of a PDF [pt]: left, lower, right, upper."""
        foot = self.foot_pt + 1.0
        return round(self.left_pt), round(foot), round(self.right_pt), round(foot + SIGNATURE_HEIGHT_PT)
