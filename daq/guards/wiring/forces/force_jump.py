"""A force that jumps by more than the machine allows: no specimen does that, however stiff.

Piston, frame and specimen are in series, so that the force rises by no more than the frame's stiffness times
the piston's way, ``dF <= k_frame · dx``. This needs neither a second force nor a model of the specimen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.wiring.doubt import Kind, SignalDoubt, channel_setting
from bufferstand.daq.guards.wiring.sample_stretch import Floats, SampleStretch
from bufferstand.daq.guards.wiring.settings import WiringGuard
from bufferstand.foundation.numbers import likeness

WITHIN_S = (0.02, 0.05)
"""A leap comes within one of these: two points of 10 ms, or a conditioner's filter of some hertz."""
BEFORE_S = 0.3
"""The piston may have gone its way so long before the force shows it, and before it is told to [s]."""
NOISE_MM, NOISE_KN = 0.1, 6.0
"""What position and force show of themselves within so short a time."""
RATIO_KN = 3.0
"""From a force of less no ratio is made."""


@dataclass(frozen=True)
class ForceJump:
    """From which force to which [kN], within how long [s], and how far the piston went in that [mm]."""

    from_kN: float
    to_kN: float
    in_s: float
    way_mm: float

    @property
    def ratio(self) -> float:
        """Return the one over the other; 0 where the first is next to nothing."""
        return self.to_kN / self.from_kN if abs(self.from_kN) > RATIO_KN else 0.0


def leapt(guard: WiringGuard, stretch: SampleStretch) -> SignalDoubt | None:
    """Return a doubt of a force that leaps away from nothing or through it, None where it may be true.

    Parameters
    ----------
    guard, stretch
        As of :func:`leap_of`.
    """
    leap = leap_of(guard, stretch)
    if leap is None:
        return None
    turned, look = leap.ratio < 0.0, likeness(leap.ratio) if leap.ratio > 0.0 else ""
    text = (
        f"force leaps from {leap.from_kN:+.1f} to {leap.to_kN:+.1f} kN within {leap.in_s:.2f} s, in which "
        f"the piston goes {leap.way_mm:.2f} mm: that is more than the machine's own stiffness allows, its "
        + ("sign" if turned else "scale" if look else "scale, zero or wire")
        + " is wrong, or has changed"
        + (f" ({look})" if look else "")
    )
    kind: Kind = "sign" if turned else "scale" if look else "disagrees"
    setting = channel_setting("force", "calibration")
    return SignalDoubt(kind, "force", "controller", setting, text, leap.to_kN - leap.from_kN, None, "kN")


def leap_of(guard: WiringGuard, stretch: SampleStretch) -> ForceJump | None:
    """Return how a force leaps away from nothing or through it by more than the machine allows, else None.

    A force that falls to nothing is none: a specimen may break.

    Parameters
    ----------
    guard : WiringGuard
        What is known of the machine's stiffness.
    stretch : Stretch
        Up to where the force is greatest.
    """
    force = stretch.values.get("force")
    ways = [way for way in (stretch.values.get("position"), stretch.told) if way is not None]
    if force is None or not ways or len(stretch) < 3:
        return None
    for span_s in WITHIN_S:
        starts = np.searchsorted(stretch.time_s, stretch.time_s - span_s)
        rises = np.abs(force - force[starts]) * (np.abs(force) > np.abs(force[starts]) - NOISE_KN)
        end = int(np.argmax(rises))
        start = int(starts[end])
        way_mm = max(_farthest_mm(stretch.time_s, way, starts, end) for way in ways)
        if float(rises[end]) > guard.stiffest_kN_per_mm * (way_mm + NOISE_MM) + NOISE_KN:
            in_s = float(stretch.time_s[end] - stretch.time_s[start])
            return ForceJump(float(force[start]), float(force[end]), in_s, way_mm)
    return None


def _farthest_mm(time: Floats, way: Floats, starts: NDArray[np.intp], end: int) -> float:
    """Return how far the piston goes in a span that ends in the time before a leap [mm]."""
    first = int(np.searchsorted(time, time[end] - BEFORE_S))
    return float(np.max(np.abs(way - way[starts])[first : end + 1]))
