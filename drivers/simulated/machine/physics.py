"""The stand as physics: position-controlled piston, elastic frame, specimen in contact.

Positions and strokes in mm, forces in kN, compression positive; position 0 is first contact. The piston
pushes the specimen through force transducer and frame, which give way: ``stroke = position − F / k_frame``.

The valve: its flow, and with it the speed against a load, falls as the load takes the pressure
(``force_speed``; a load that pushes back does not slow the way out). Its spool crosses an overlap at every
reversal, in which the piston stands (``reversal_s``), and the loop follows a moving command late
(``servo_lag_s``, first order: at a frequency ``f`` the amplitude falls by ``1 / √(1 + (2π f T)²)`` and lags
by ``atan 2π f T``).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import expm

TOUCH_MM = 1e-6
"""Stroke that stands for “in contact, not yet compressed” [mm]: the spring's force there is its preload."""
STILL_MM = 1e-9
"""A move within a step that needs no flow [mm]."""


class Spring(Protocol):
    """What the stand needs of a specimen (``bufferstand.model.stepper.SpringStepper``)."""

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
    servo_lag_s : float
        How much later the loop follows a command that moves evenly, beside its own second order.
    reversal_s : float
        Time for which the piston stands when it turns: the spool crosses its overlap.
    force_speed : tuple of (float, float)
        Pairs of force [kN] and greatest speed against it [mm/s], straight between; empty for no such limit.
    """

    bandwidth_Hz: float = 15.0
    damping: float = 0.8
    speed_max_mm_per_s: float = 800.0
    leak_mm_per_s_kN: float = 0.02
    servo_lag_s: float = 0.0
    reversal_s: float = 0.0
    force_speed: tuple[tuple[float, float], ...] = ()


class Actuator:
    """Piston under a second-order position loop, exact for a command that is constant within a step.

    Parameters
    ----------
    facts : ActuatorFacts
    dt_s : float
        Step [s].
    start_mm : float
        Where it stands at first [mm].
    """

    def __init__(self, facts: ActuatorFacts, dt_s: float, start_mm: float = 0.0) -> None:
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
        self._lag_gain = 1.0 if facts.servo_lag_s <= 0.0 else -math.expm1(-dt_s / facts.servo_lag_s)
        self._followed_mm = start_mm
        self._overlap = round(facts.reversal_s / dt_s)
        self._crossed = 0
        self._direction = 0.0
        self._curve = _Reach(facts.force_speed, dt_s) if facts.force_speed else None
        self.position_mm = start_mm
        self.speed_mm_per_s = 0.0

    def follow(self, command_mm: float, force_kN: float = 0.0) -> float:
        """Move for one step towards the command, against a force [kN]; return the new position [mm]."""
        if self._lag_gain < 1.0:
            self._followed_mm += self._lag_gain * (command_mm - self._followed_mm)
            command_mm = self._followed_mm
        error = self.position_mm - command_mm
        speed = self.speed_mm_per_s
        position = command_mm + self._a * error + self._b * speed
        move = position - self.position_mm
        if self._overlap and self._crosses(move):
            self.speed_mm_per_s = 0.0
            return self.position_mm
        reach = self._reach_mm
        if move > 0.0 and self._curve is not None:
            reach = min(reach, self._curve.at(force_kN))
        if -self._reach_mm <= move <= reach:
            self.speed_mm_per_s = self._c * error + self._d * speed
        else:
            move = reach if move > 0.0 else -self._reach_mm
            position = self.position_mm + move
            self.speed_mm_per_s = move / self._dt_s
        self.position_mm = position
        return position

    def _crosses(self, move: float) -> bool:
        """Return whether the spool is still in its overlap on the way to a move in the other direction."""
        if move * self._direction > 0.0 or abs(move) < STILL_MM:
            self._crossed = 0
            return False
        self._crossed += 1
        if self._crossed <= self._overlap:
            return True
        self._direction, self._crossed = math.copysign(1.0, move), 0
        return False

    def leak(self, force_kN: float, steps: int = 1) -> float:
        """Creep back for ``steps`` steps with the valve off; return the new position [mm]."""
        self.speed_mm_per_s = 0.0
        self.position_mm -= self._leak_mm * steps * force_kN
        self._followed_mm = self.position_mm
        return self.position_mm

    def rests_at(self, command_mm: float) -> bool:
        """Return whether the piston stands on the command, to within what no sensor could tell."""
        followed = self._lag_gain == 1.0 or abs(self._followed_mm - command_mm) < 1e-6
        return followed and abs(self.position_mm - command_mm) < 1e-6 and abs(self.speed_mm_per_s) < 1e-4


class _Reach:
    """The way that the piston can go against a force within one step.

    Parameters
    ----------
    force_speed : sequence of (float, float)
        Force [kN], rising, and greatest speed there [mm/s].
    dt_s : float
        Step [s].
    """

    def __init__(self, force_speed: Sequence[tuple[float, float]], dt_s: float) -> None:
        self._forces = [force for force, _ in force_speed]
        self._ways = [speed * dt_s for _, speed in force_speed]

    def at(self, force_kN: float) -> float:
        """Return the greatest way [mm] against a force; beyond the curve its ends hold."""
        after = bisect_right(self._forces, force_kN)
        if after == 0 or after == len(self._forces):
            return self._ways[min(after, len(self._forces) - 1)]
        low, high = self._forces[after - 1], self._forces[after]
        share = (force_kN - low) / (high - low)
        return self._ways[after - 1] + share * (self._ways[after] - self._ways[after - 1])


class SpecimenAndFrame:
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
