"""What the draw wires of a run say of each other."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FailedWire:
    """A wire (``stroke_1`` …) that stands still while the others move: broken or stuck."""

    wire: str
    from_s: float


@dataclass(frozen=True)
class DrawWires:
    """Difference of the draw wires over a run: stroke_1 - stroke_2, of more the largest of any two.

    Attributes
    ----------
    largest_difference_mm, at_s : float
        Largest absolute difference, and when.
    offset_mm, scale_mismatch : float or None
        Straight line of the difference over the stroke: difference = offset + scale_mismatch · stroke.
        None where the stroke does not move, or a wire is out.
    remaining_mm : float or None
        Largest difference from that line: tilt, and what is not linear.
    limit_mm : float or None
        Sum of the limits that both channels state, of more the two largest; None where they state none.
    out : tuple of FailedWire
        The wires that are out; the stroke is the mean of the others then.
    warnings : tuple of str
    """

    largest_difference_mm: float
    at_s: float
    offset_mm: float | None
    scale_mismatch: float | None
    remaining_mm: float | None
    limit_mm: float | None
    out: tuple[FailedWire, ...] = ()
    warnings: tuple[str, ...] = ()
