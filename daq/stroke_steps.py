"""How the command of a running sine is changed: a small step towards what was asked, never beyond a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass

from daq.sine_watch import CycleSeen
from protocols.commanded import Sine

SHARE = 0.8
"""So much of what is missing is made up for at once."""
LARGEST_SHARE, LARGEST_MM = 0.05, 1.0
"""A step changes the amplitude by no more than this share of what is asked, and neither by more [mm]."""
LEAST_MM = 0.01
"""Less than this, or than the u of the turns, is left as it is [mm]: the wires show no more."""
BEYOND_SHARE = 0.005
"""So far above the asked turn a correction may be expected to lead at most, as a share of the amplitude."""


@dataclass(frozen=True)
class Bounds:
    """What a command must keep.

    Parameters
    ----------
    piston_max_mm : float
        The controller's own stroke limit, from first contact.
    stroke_max_mm : float
        The specimen's, in force.
    force_max_kN : float
        In force.
    speed_max_mm_per_s : float
        Of the stand.
    """

    piston_max_mm: float
    stroke_max_mm: float
    force_max_kN: float
    speed_max_mm_per_s: float

    def kept(self, piston: Sine, frequency_Hz: float) -> Sine:
        """Return the piston's sine, made smaller where it would leave travel, contact or speed.

        The mean stays where it can, because the step's other motions lead there.
        """
        mean = min(piston.mean_mm, self.piston_max_mm)
        most_mm, _ = self._most(mean, frequency_Hz)
        return Sine(mean, max(0.0, min(piston.amplitude_mm, most_mm)))

    def holding(self, piston: Sine, frequency_Hz: float) -> str:
        """Return which of them keeps the amplitude of a piston's sine from being greater."""
        return self._most(min(piston.mean_mm, self.piston_max_mm), frequency_Hz)[1]

    def _most(self, mean_mm: float, frequency_Hz: float) -> tuple[float, str]:
        """Return the greatest amplitude [mm] about a mean, and what it is that leaves no more."""
        return min(
            (
                self.speed_max_mm_per_s / (2.0 * math.pi * frequency_Hz),
                f"speed of the piston, at most {self.speed_max_mm_per_s:g} mm/s",
            ),
            (mean_mm, f"contact: the piston's amplitude is its mean of {mean_mm:.2f} mm at most"),
            (
                self.piston_max_mm - mean_mm,
                f"travel of the piston, to {self.piston_max_mm:.2f} mm from first contact",
            ),
        )


def within_force(asked: Sine, lower_kN: float, upper_kN: float, most_kN: float) -> Sine:
    """Return a sine whose expected upper force keeps the limit: as asked where it does, else turning earlier.

    The stiffness between the turns is less than that at the upper one, so that the force falls by more than
    is needed.
    """
    if upper_kN <= most_kN or upper_kN <= lower_kN:
        return asked
    short = min(1.0, (upper_kN - most_kN) / (upper_kN - lower_kN))
    return Sine.between(asked.lower_mm, asked.upper_mm - short * 2.0 * asked.amplitude_mm)


def corrected(
    asked: Sine, command: Sine, seen: CycleSeen, gain: float, give_mm_per_kN: float, bounds: Bounds
) -> tuple[Sine, str]:
    """Return the next command [mm, from first contact], and in words what kept it from being a better one.

    The command is the present one where nothing is to be changed.

    Parameters
    ----------
    asked : Sine
        Of the specimen.
    command : Sine
        The present one.
    seen : CycleSeen
        What the last cycle did.
    gain : float
        Of the actuator at this frequency.
    give_mm_per_kN : float
        1 / k of the machine.
    bounds : Bounds
        What it must keep.

    Notes
    -----
    The specimen follows the piston by 1 / (1 + k_s / k), with its own stiffness k_s. A step is cut back as a
    whole until the turn and the force that are expected after it keep the limits: the stroke may lead at most
    to what is asked (and not beyond the limit in force), the force not above the limit, by the stiffness of
    the loading branch at its top.
    """
    stroke = seen.stroke
    reach = 2.0 * stroke.amplitude_mm
    stiffness = max(0.0, (seen.upper_kN - seen.lower_kN) / reach) if reach > 0.0 else 0.0
    soft = 1.0 + stiffness * give_mm_per_kN
    mean = SHARE * (asked.mean_mm - stroke.mean_mm) * soft
    amplitude = SHARE * (asked.amplitude_mm - stroke.amplitude_mm) * soft / gain
    most = min(LARGEST_MM, LARGEST_SHARE * asked.amplitude_mm)
    mean, amplitude = min(max(mean, -LARGEST_MM), LARGEST_MM), min(max(amplitude, -most), most)
    up = max(0.0, mean + gain * amplitude)  # the specimen's upper turn moves by no more than the piston's
    room, why = min(
        (max(asked.upper_mm + BEYOND_SHARE * asked.amplitude_mm - stroke.upper_mm, 0.0) * soft, ""),
        (max(bounds.stroke_max_mm - stroke.upper_mm, 0.0), f"stroke_max_mm = {bounds.stroke_max_mm:g}"),
        (
            max(bounds.force_max_kN - seen.upper_kN, 0.0) / max(seen.top_kN_per_mm, 1e-9),
            f"force_max_kN = {bounds.force_max_kN:g}",
        ),
    )
    share, held = (1.0, "") if up <= room else (room / up, why)
    wanted = Sine(command.mean_mm + share * mean, command.amplitude_mm + share * amplitude)
    kept = bounds.kept(wanted, seen.frequency_Hz)
    if kept.amplitude_mm < wanted.amplitude_mm:
        held = bounds.holding(wanted, seen.frequency_Hz)
    least_mm = max(LEAST_MM, seen.u_mm)
    if (
        kept.amplitude_mm <= 0.0
        or max(abs(kept.mean_mm - command.mean_mm), abs(kept.amplitude_mm - command.amplitude_mm)) < least_mm
    ):
        return command, held
    return kept, held
