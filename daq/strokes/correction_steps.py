"""How the command of a running sine is changed: a small step towards what was asked, never beyond a limit."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bufferstand.daq.strokes.sine_watch import CycleSeen
from bufferstand.protocols.prediction import Sine

SHARE = 0.8
"""So much of what is missing is made up for at once."""
LARGEST_SHARE, LARGEST_MM = 0.05, 1.0
"""A step changes the amplitude by no more than this share of what is asked, and neither by more [mm]."""
LEAST_MM = 0.01
"""Less than this, or than the u of the turns, is left as it is [mm]: the wires show no more."""
BEYOND_SHARE = 0.005
"""So far above the asked turn a correction may be expected to lead at most, as a share of the amplitude."""

BELOW_SHARE = 0.002
"""A force limit is aimed at from so far below: a turn's force and stiffness are known no better."""


@dataclass(frozen=True)
class StrokeBounds:
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


def within_force(
    asked: Sine, lower_kN: float, upper_kN: float, most_kN: float, top_kN_per_mm: float | None = None
) -> Sine:
    """Return a sine whose expected upper force keeps the limit: as asked where it does, else turning earlier.

    The stiffness is that at the upper turn, or that between the turns where it is not known or greater: the
    lower turn lies on the unloading branch, so that either may be.
    """
    if upper_kN <= most_kN or upper_kN <= lower_kN:
        return asked
    between = (upper_kN - lower_kN) / (2.0 * asked.amplitude_mm)
    stiffness = between if top_kN_per_mm is None or top_kN_per_mm <= 0.0 else min(between, top_kN_per_mm)
    short_mm = min(2.0 * asked.amplitude_mm, (upper_kN - most_kN) / stiffness)
    return Sine.between(asked.lower_mm, asked.upper_mm - short_mm)


def corrected(
    asked: Sine,
    command: Sine,
    seen: CycleSeen,
    gain: float,
    give_mm_per_kN: float,
    bounds: StrokeBounds,
    coming_kN: tuple[float, float] = (0.0, 0.0),
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
    coming_kN : (float, float)
        By how much the forces at the lower and at the upper turn change by themselves under the present
        command, as the specimen settles and warms, until another has gone over.

    Notes
    -----
    The specimen follows the piston by 1 / (1 + k_s / k), with its own stiffness k_s. A step is cut back as a
    whole until the turn and the force that are expected after it keep the limits: the stroke may lead at most
    to what is asked (and not beyond the limit in force), the force not above the limit, by the stiffness of
    the loading branch at its top. Where the force is above its limit already, the upper turn is lowered.
    """
    stroke = seen.stroke
    reach = 2.0 * stroke.amplitude_mm
    stiffness = max(0.0, (seen.upper_kN - seen.lower_kN) / reach) if reach > 0.0 else 0.0
    soft = 1.0 + stiffness * give_mm_per_kN
    below_kN, above_kN = coming_kN
    coming = Sine.between(
        stroke.lower_mm - below_kN * give_mm_per_kN, stroke.upper_mm - above_kN * give_mm_per_kN
    )
    mean = SHARE * (asked.mean_mm - coming.mean_mm) * soft
    amplitude = SHARE * (asked.amplitude_mm - coming.amplitude_mm) * soft / gain
    most = min(LARGEST_MM, LARGEST_SHARE * asked.amplitude_mm)
    mean, amplitude = _limited(mean, LARGEST_MM), _limited(amplitude, most)
    up = max(0.0, mean + gain * amplitude)  # the specimen's upper turn moves by no more than the piston's
    top = max(seen.top_kN_per_mm, 1e-9)
    highest_mm = max(stroke.upper_mm, coming.upper_mm)
    room, why = min(
        (max(asked.upper_mm + BEYOND_SHARE * asked.amplitude_mm - highest_mm, 0.0) * soft, ""),
        (max(bounds.stroke_max_mm - highest_mm, 0.0), f"stroke_max_mm = {bounds.stroke_max_mm:g}"),
        (
            max((1.0 - BELOW_SHARE) * bounds.force_max_kN - seen.upper_kN, 0.0) / top,
            f"force_max_kN = {bounds.force_max_kN:g}",
        ),
    )
    share, held = (1.0, "") if up <= room else (room / up, why)
    lower_mm = mean - gain * amplitude  # of the piston's lower turn, whatever becomes of the upper one
    mean, amplitude = share * mean, share * amplitude
    above_mm = (
        (seen.upper_kN - (1.0 - BELOW_SHARE) * bounds.force_max_kN) / top * (1.0 + top * give_mm_per_kN)
    )
    if seen.upper_kN > bounds.force_max_kN and mean + gain * amplitude > -above_mm:
        held = f"force_max_kN = {bounds.force_max_kN:g}"
        down_mm = min(above_mm, LARGEST_MM)
        amplitude = _limited(0.5 * (-down_mm - lower_mm) / gain, most)
        mean = _limited(-down_mm - gain * amplitude, LARGEST_MM)
        amplitude = min(amplitude, (-down_mm - mean) / gain)
    wanted = Sine(command.mean_mm + mean, command.amplitude_mm + amplitude)
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


def _limited(value: float, most: float) -> float:
    return min(max(value, -most), most)
