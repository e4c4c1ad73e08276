"""Tolerances that are a share of what a stand can do: one place for stand file and campaign file."""

from __future__ import annotations

TRIP_SHARE = 0.05
"""So far above a limit its trip may lie: a guard further away lets the whole reserve of a stand be used up
(600 kN of a 630 kN actuator) before it acts."""
TILT_SHARE = 0.05
"""Of the piston's travel: so far apart a straight specimen never brings the two draw wires."""
TILT_LEAST_MM = 5.0
"""So much may be allowed on any stand [mm]: the default."""


def tilt_bound_mm(travel_mm: float) -> float:
    """Return the largest tilt that may be allowed [mm], on a stand whose piston travels so far [mm]."""
    return max(TILT_LEAST_MM, TILT_SHARE * travel_mm)


MOVING_MASS_MOST_KG = 10_000.0
"""No stand moves more between load cell and specimen [kg]."""
MASS_ACCURACY_MOST_PERCENT = 100.0
"""Known no better than to this a moving mass is not known [%]."""
