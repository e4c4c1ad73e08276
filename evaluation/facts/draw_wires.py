"""What the two draw wires of a run say of each other."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FailedWire:
    """A wire (``stroke_1``, ``stroke_2``) that stands still while the other moves: broken or stuck."""

    wire: str
    from_s: float


@dataclass(frozen=True)
class DrawWires:
    """Difference stroke_1 - stroke_2 over a run.

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
        Sum of the limits that both channels state; None where they state none.
    out : tuple of WireOut
        The wire that is out, if one is; the stroke is the other one alone then.
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
