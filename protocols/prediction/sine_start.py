"""The way into a sine, with its greatest forces: ramp, the growing cycle, and the first full cycle.

Which force must a limit allow? That of the *first* loading. The settled loop of a small amplitude lies far
below the loading branch, because each small unloading costs more force than the loading after it brings back;
the ramp to the prestress and the first cycles still run on that branch (94 ± 1 mm: 463 kN settled, 605 kN on
the way). So the path itself is followed with the model, rate and hysteresis included, instead of the settled
loop, which is less than what comes, or of a straight compression, which is more.

At which temperature? At the coldest at which the step can begin, because a spring is stiffest there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bufferstand.foundation import ForceSpeed
from bufferstand.protocols.prediction.machine_stroke import Sine, strokes_behind
from bufferstand.protocols.prediction.predictor import Floats, Predictor
from bufferstand.protocols.steps import ExpectedTurns

POINTS_PER_CYCLE = 80
RAMP_POINTS = 120
CYCLES = 2.25
"""The cycle in and one full one, and as far as its second upper turn: from there on the forces only fall."""
_TOUCH_MM = 1e-6
"""Stroke that stands for “in contact”: at none at all there is no force."""


@dataclass(frozen=True)
class ForcePath:
    """A path from rest and the forces on it, shape (n,).

    Parameters
    ----------
    time_s, stroke_mm, position_mm, force_kN : NDArray
        Instants [s], the specimen's stroke, the piston's position [mm], the force [kN].
    """

    time_s: Floats
    stroke_mm: Floats
    position_mm: Floats
    force_kN: Floats

    @property
    def peak_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Greatest force [kN]."""
        return float(self.force_kN.max())

    @property
    def speed_mm_per_s(self) -> Floats:
        """The piston's speed [mm/s], shape (n,)."""
        return np.asarray(np.gradient(self.position_mm, self.time_s), dtype=np.float64)

    def fastest(self, curve: ForceSpeed) -> tuple[float, float, float]:
        """Return where it comes closest to what the hydraulics deliver, or exceeds it most.

        Returns
        -------
        speed_mm_per_s, force_kN, allowed_mm_per_s : float
            The piston's speed at a force, and the greatest speed at that force. Loading and unloading count
            alike.
        """
        speed, allowed = np.abs(self.speed_mm_per_s), curve.speed_at(self.force_kN)
        worst = int(np.argmax(speed - allowed))
        share = np.divide(speed, allowed, out=np.full_like(speed, np.inf), where=allowed > 0.0)
        if speed[worst] <= allowed[worst]:
            worst = int(np.argmax(share))
        return float(speed[worst]), float(self.force_kN[worst]), float(allowed[worst])


def first_cycle(
    predictor: Predictor,
    asked: Sine,
    frequency_Hz: float,
    ramp_speed_mm_per_s: float,
    temperature_C: float,
    *,
    give_mm_per_kN: float = 0.0,
    compensated: bool = True,
) -> ForcePath:
    """Return the way into a sine at one temperature.

    Parameters
    ----------
    predictor : Predictor
        The specimen.
    asked : Sine
        As the step asks for it.
    frequency_Hz : float
        Of the sine.
    ramp_speed_mm_per_s : float
        Of the ramp to its mean.
    temperature_C : float
        Of the specimen all the while [°C].
    give_mm_per_kN : float
        1 / k of the machine.
    compensated : bool
        Whether the sine is the specimen's, so that the piston goes further; else it is the piston's.
    """
    time, path = _way(asked, frequency_Hz, ramp_speed_mm_per_s)

    def forces(stroke_mm: Floats) -> Floats:
        return predictor.forces(time, np.maximum(stroke_mm, _TOUCH_MM), temperature_C)

    if compensated or give_mm_per_kN == 0.0:
        force = forces(path)
        return ForcePath(time, path, path + force * give_mm_per_kN, force)
    stroke, force = strokes_behind(path, forces, give_mm_per_kN)
    return ForcePath(time, stroke, path, force)


def first_turns(
    predictor: Predictor,
    piston: Sine,
    frequency_Hz: float,
    ramp_speed_mm_per_s: float,
    temperature_C: float,
    cycles: int,
    give_mm_per_kN: float,
) -> list[ExpectedTurns]:
    """Return the turns of the first full cycles of a sine that the piston makes.

    Parameters
    ----------
    predictor : Predictor
        The specimen.
    piston : Sine
        Of the piston, from first contact.
    frequency_Hz, ramp_speed_mm_per_s, temperature_C, give_mm_per_kN
        As of :func:`first_cycle`.
    cycles : int
        How many.
    """
    time, path = _way(piston, frequency_Hz, ramp_speed_mm_per_s, cycles + 1.0)

    def forces(stroke_mm: Floats) -> Floats:
        return predictor.forces(time, np.maximum(stroke_mm, _TOUCH_MM), temperature_C)

    stroke, force = strokes_behind(path, forces, give_mm_per_kN)
    began = len(time) - (cycles + 1) * POINTS_PER_CYCLE - 1
    found = []
    for cycle in range(1, cycles + 1):
        upper, lower = (began + round((cycle + part) * POINTS_PER_CYCLE) for part in (0.25, 0.75))
        values = (series[at] for series in (stroke, force, path) for at in (lower, upper))
        found.append(ExpectedTurns(*(float(value) for value in values)))
    return found


@lru_cache(maxsize=256)
def _way(
    asked: Sine, frequency_Hz: float, ramp_speed_mm_per_s: float, cycles: float = CYCLES
) -> tuple[Floats, Floats]:
    """Return instants [s] and strokes [mm] of the ramp and the first cycles.

    The amplitude grows evenly over the cycle in. A controller may let it grow as half a cosine: it then goes
    down further before the first full upper turn, which brings less force there, not more.
    """
    rise = asked.mean_mm * np.linspace(0.0, 1.0, RAMP_POINTS + 1)[1:]
    phase = np.linspace(0.0, cycles, round(cycles * POINTS_PER_CYCLE) + 1)[1:]
    sine = asked.mean_mm + asked.amplitude_mm * np.minimum(phase, 1.0) * np.sin(2.0 * np.pi * phase)
    began_s = asked.mean_mm / ramp_speed_mm_per_s
    time = np.concatenate([rise / ramp_speed_mm_per_s, began_s + phase / frequency_Hz])
    path = np.concatenate([rise, np.maximum(sine, 0.0)])
    if asked.mean_mm == 0.0:
        time, path = time[RAMP_POINTS:], path[RAMP_POINTS:]
    for array in (time, path):
        array.flags.writeable = False
    return time, path


def peak_force(
    predictor: Predictor,
    prestress_mm: float,
    amplitude_mm: float,
    frequency_Hz: float,
    ramp_speed_mm_per_s: float,
    temperature_C: float,
    *,
    give_mm_per_kN: float = 0.0,
    compensated: bool = True,
) -> float:
    """Return the greatest force [kN] that a harmonic step can bring: on the way in, or settled."""
    course = first_cycle(
        predictor,
        Sine(prestress_mm, amplitude_mm),
        frequency_Hz,
        ramp_speed_mm_per_s,
        temperature_C,
        give_mm_per_kN=give_mm_per_kN,
        compensated=compensated,
    )
    give = 0.0 if compensated else give_mm_per_kN
    settled = predictor.harmonic(prestress_mm, amplitude_mm, frequency_Hz, temperature_C, give)
    return max(settled.peak_force_kN, course.peak_force_kN)
