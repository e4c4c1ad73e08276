"""The stand as physics: position-controlled piston, elastic frame, specimen in contact.

Positions and strokes in mm, forces in kN, compression positive; position 0 is first contact. The piston
pushes the specimen through force transducer and frame, which give way: ``stroke = position − F / k_frame``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import expm

TOUCH_MM = 1e-6
"""Stroke that stands for “in contact, not yet compressed” [mm]: the spring's force there is its preload."""


class Spring(Protocol):
    """What the stand needs of a specimen (``model.stepper.SpringStepper``)."""

    @property
    def force_kN(self) -> float:  # noqa: N802
        """Present force [kN]."""
        ...

    @property
    def temperature_C(self) -> float:  # noqa: N802
        """Temperature of the elastic body [°C]."""
        ...

    @property
    def sensor_temperature_C(self) -> float:  # noqa: N802
        """What a sensor glued on a plate feels [°C]."""
        ...

    @property
    def heat_J(self) -> float:  # noqa: N802
        """Heat set free since the start [J]."""
        ...

    def step(self, stroke_mm: float, dt_s: float) -> float:
        """Move to a stroke within ``dt_s`` and return the force there [kN]."""
        ...

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802
        """Stiffness for the next small step in one direction [kN/mm]."""
        ...


@dataclass(frozen=True)
class ActuatorFacts:
    """Servo-hydraulic cylinder with its position loop.

    Parameters
    ----------
    bandwidth_Hz : float
        Frequency at which the closed loop's amplitude has fallen by 3 dB.
    damping : float
        Damping ratio of the loop.
    speed_max_mm_per_s : float
        What the valve lets through.
    leak_mm_per_s_kN : float
        Creep of the cylinder under load while the valve is off: internal leakage relieves the force.
    """

    bandwidth_Hz: float = 15.0
    damping: float = 0.8
    speed_max_mm_per_s: float = 800.0
    leak_mm_per_s_kN: float = 0.02


class Actuator:
    """Piston under a second-order position loop, exact for a command that is constant within a step.

    Parameters
    ----------
    facts : ActuatorFacts
    dt_s : float
        Step [s].
    """

    def __init__(self, facts: ActuatorFacts, dt_s: float) -> None:
        damping = facts.damping
        # −3 dB frequency of a second-order low pass, solved for the natural frequency
        ratio = math.sqrt(1.0 - 2.0 * damping**2 + math.sqrt(4.0 * damping**4 - 4.0 * damping**2 + 2.0))
        omega = 2.0 * math.pi * facts.bandwidth_Hz / ratio
        transition = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]]) * dt_s)
        # As native floats: they are multiplied a thousand times per simulated second.
        self._a: float = transition[0, 0].item()
        self._b: float = transition[0, 1].item()
        self._c: float = transition[1, 0].item()
        self._d: float = transition[1, 1].item()
        self._dt_s = dt_s
        self._reach_mm = facts.speed_max_mm_per_s * dt_s
        self._leak_mm = facts.leak_mm_per_s_kN * dt_s
        self.position_mm = 0.0
        self.speed_mm_per_s = 0.0

    def follow(self, command_mm: float) -> float:
        """Move for one step towards the command; return the new position [mm]."""
        error = self.position_mm - command_mm
        speed = self.speed_mm_per_s
        position = command_mm + self._a * error + self._b * speed
        move = position - self.position_mm
        if -self._reach_mm <= move <= self._reach_mm:
            self.speed_mm_per_s = self._c * error + self._d * speed
        else:
            move = math.copysign(self._reach_mm, move)
            position = self.position_mm + move
            self.speed_mm_per_s = move / self._dt_s
        self.position_mm = position
        return position

    def leak(self, force_kN: float, steps: int = 1) -> float:
        """Creep back for ``steps`` steps with the valve off; return the new position [mm]."""
        self.speed_mm_per_s = 0.0
        self.position_mm -= self._leak_mm * steps * force_kN
        return self.position_mm

    def rests_at(self, command_mm: float) -> bool:
        """Return whether the piston stands on the command, to within what no sensor could tell."""
        return abs(self.position_mm - command_mm) < 1e-6 and abs(self.speed_mm_per_s) < 1e-4


class Contact:
    """Specimen and elastic frame in series, with the ledger of the work done.

    One Newton step a sample, whose residual the next sample takes up. It contracts whenever
    ``k_spring < k_frame + 2 k_estimate``, so for every spring softer than the frame, whatever the
    estimate; and it moves the spring once a sample only: no trial step leaves a trace in the hysteresis.

    Parameters
    ----------
    spring : Spring
        The specimen.
    frame_stiffness_kN_per_mm : float
        Stiffness of frame, transducer and fixture [kN/mm].
    dt_s : float
        Sample period [s].
    """

    def __init__(self, spring: Spring, frame_stiffness_kN_per_mm: float, dt_s: float) -> None:
        if not frame_stiffness_kN_per_mm > 0.0:
            raise ValueError(f"the frame's stiffness must be positive, got {frame_stiffness_kN_per_mm}")
        self.spring = spring
        self._frame = frame_stiffness_kN_per_mm
        self._dt_s = dt_s
        self._spring_stroke_mm = 0.0
        self._spring_force_kN = 0.0
        self.stroke_mm = 0.0
        self.force_kN = 0.0
        self.work_J = 0.0

    def push(self, position_mm: float, steps: int = 1) -> float:
        """Move the piston to a position within ``steps`` sample periods; return the force [kN]."""
        if position_mm <= 0.0:
            target = 0.0
        elif self._spring_stroke_mm == 0.0:
            target = TOUCH_MM  # learn the preload before it is compared with the frame's force
        else:
            spring_stroke = self._spring_stroke_mm
            gap = position_mm - spring_stroke - self._spring_force_kN / self._frame
            tangent = self.spring.tangent_kN_per_mm(gap > 0.0)
            target = max(TOUCH_MM, spring_stroke + gap / (1.0 + tangent / self._frame))
        force = self.spring.step(target, self._dt_s * steps)
        self._spring_stroke_mm = target
        self._spring_force_kN = force
        if target <= TOUCH_MM:
            # The preloaded specimen is rigid until its preload is overcome; the frame alone gives way.
            force = min(force, self._frame * position_mm) if position_mm > 0.0 else 0.0
            target = 0.0
        self.work_J += 0.5 * (force + self.force_kN) * (target - self.stroke_mm)
        self.stroke_mm = target
        self.force_kN = force
        return force
