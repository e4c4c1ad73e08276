"""Recognises a wrong factor: a sign, a decimal place, or a unit taken for another."""

from __future__ import annotations

NEAR = 0.08
"""A ratio is like a known one within this share of it."""
KNOWN = (
    (0.1, "a tenth: look for a decimal place in the calibration"),
    (10.0, "ten times too much: look for a decimal place in the calibration"),
    (0.01, "a hundredth: look for a decimal place in the calibration"),
    (100.0, "a hundred times too much: look for a decimal place in the calibration"),
    (0.001, "a thousandth: look for another unit (N and kN, µm and mm)"),
    (1000.0, "a thousand times too much: look for another unit (N and kN, µm and mm)"),
    (1.0 / 9.80665, "as tonnes that pass for kN (1 t weighs 9.81 kN)"),
    (9.80665, "as kN that were taken for tonnes (1 t weighs 9.81 kN)"),
    (1.0 / 4.4482216, "as kip that pass for kN (1 kip is 4.45 kN)"),
    (4.4482216, "as kN that were taken for kip (1 kip is 4.45 kN)"),
    (1.0 / 25.4, "as inches that pass for mm"),
    (25.4, "as mm that were taken for inches"),
    (0.5, "half: look at the range of transducer and amplifier"),
    (2.0, "twice too much: look at the range of transducer and amplifier"),
)
"""Ratios of what is read to what is true, and what each looks like."""


def likeness(ratio: float) -> str:
    """Return what a wrong factor looks like, empty where it is like none that is known.

    Parameters
    ----------
    ratio : float
        What is read over what is true; its sign is not looked at.
    """
    size = abs(ratio)
    near = [(abs(size / known - 1.0), text) for known, text in KNOWN if abs(size / known - 1.0) <= NEAR]
    return min(near)[1] if near else ""
