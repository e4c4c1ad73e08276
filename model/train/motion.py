"""How a train moves: velocity Verlet over rigid masses, each spring by its own exact step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.energy import stored_energy
from bufferstand.model.stepper import SpringStepper
from bufferstand.model.train.in_series import SpringsInSeries
from bufferstand.model.train.scene import Springs, Train

Floats = NDArray[np.float64]
MOST_ROWS = 4000
"""Instants that are kept of a motion; extremes are those of every step."""


@dataclass(frozen=True)
class TrainMotion:
    """History of a train; m instants that were kept, n vehicles, n - 1 gaps.

    Parameters
    ----------
    time_s : NDArray, shape (m,)
    speed_m_per_s : NDArray, shape (m, n)
    gap_force_kN : NDArray, shape (m, n - 1)
        Force between neighbours, compressive positive: all buffers less the draw gear.
    closing_mm : NDArray, shape (m, n - 1)
        How far the vehicles have come nearer since their buffers touched, or would.
    kinetic_J, stored_J, lost_J : NDArray, shape (m,)
        The energy ledger: of the masses, in the springs by their state alone, gone in them.
    momentum_Ns : NDArray, shape (m,)
    largest_push_kN, largest_pull_kN : NDArray, shape (n - 1,)
        Over every step, both positive.
    time_of_push_s, time_of_pull_s : NDArray, shape (n - 1,)
        When; the beginning where there was none.
    buffer_stroke_mm, draw_gear_stroke_mm : NDArray, shape (n - 1, 2)
        Largest, of the spring on the left and on the right of the gap.
    spring_speed_mm_per_s : NDArray, shape (n - 1, 2)
        Largest speed at which the buffers, the draw gears of a gap were loaded.
    gap_lost_J : NDArray, shape (n - 1,)
        Energy lost in the springs of each gap.
    warming_K : NDArray, shape (n - 1,)
        Of the warmest spring of each gap at the end.
    largest_acceleration_m_per_s2 : NDArray, shape (n,)
        Of each vehicle, without its sign.
    """

    time_s: Floats
    speed_m_per_s: Floats
    gap_force_kN: Floats
    closing_mm: Floats
    kinetic_J: Floats
    stored_J: Floats
    lost_J: Floats
    momentum_Ns: Floats
    largest_push_kN: Floats
    largest_pull_kN: Floats
    time_of_push_s: Floats
    time_of_pull_s: Floats
    buffer_stroke_mm: Floats
    draw_gear_stroke_mm: Floats
    spring_speed_mm_per_s: Floats
    gap_lost_J: Floats
    warming_K: Floats
    largest_acceleration_m_per_s2: Floats


class _Links:
    """The springs of one kind of place, buffers or draw gears, over all gaps."""

    def __init__(self, springs: list[Springs | None], temperature_C: float) -> None:
        self.abreast = [0 if one is None else one.abreast for one in springs]
        self.rows = [
            None if one is None else SpringsInSeries(one.left, one.right, temperature_C) for one in springs
        ]
        self.stroke_mm = np.zeros((len(springs), 2))
        self.speed_mm_per_s = np.zeros(len(springs))

    def step(self, closing_mm: Floats, dt_s: float) -> Floats:
        """Step each row to its closing; return the forces of all rows of each gap [kN]."""
        forces = np.zeros(len(self.rows))
        for k, (row, closing) in enumerate(zip(self.rows, closing_mm.tolist(), strict=True)):
            if row is None:
                continue
            before = (row.left.stroke_mm, row.right.stroke_mm)
            forces[k] = self.abreast[k] * row.step(closing, dt_s)
            now = (row.left.stroke_mm, row.right.stroke_mm)
            for side in (0, 1):
                self.stroke_mm[k, side] = max(self.stroke_mm[k, side], now[side])
                if now[side] > 0.0 and dt_s > 0.0:
                    speed = abs(now[side] - max(before[side], 0.0)) / dt_s
                    self.speed_mm_per_s[k] = max(self.speed_mm_per_s[k], speed)
        return forces

    def lost_J(self) -> Floats:  # noqa: N802 - the unit's own letter
        """Return the energy [J] lost in each gap."""
        return np.array(
            [
                0.0 if row is None else count * (row.left.heat_J + row.right.heat_J)
                for row, count in zip(self.rows, self.abreast, strict=True)
            ]
        )

    def stored_J(self) -> float:  # noqa: N802
        """Return the energy [J] that all springs hold by their state alone: no sum of work less heat."""
        of: dict[int, list[tuple[SpringStepper, int]]] = {}
        for row, count in zip(self.rows, self.abreast, strict=True):
            for spring in () if row is None else row.both:
                of.setdefault(id(spring.model), []).append((spring, count))
        total = 0.0
        for same in of.values():
            state = np.array([(s.stroke_mm, s.band, s.temperature_C, *s.lags_mm) for s, _ in same]).T
            held = stored_energy(same[0][0].model, state[0], state[1], state[3:], state[2])
            total += float(held @ np.array([count for _, count in same], dtype=np.float64))
        return total

    def warming_K(self, start_C: float) -> Floats:  # noqa: N802
        """Return how much the warmer spring of each gap has warmed up [K]."""
        return np.array(
            [
                0.0 if row is None else max(spring.temperature_C for spring in row.both) - start_C
                for row in self.rows
            ]
        )


def move_train(train: Train) -> TrainMotion:
    """Return what happens to a train.

    Velocity Verlet: positions by the forces of now, forces there, speeds by the mean of both forces. Momentum
    is kept to rounding; the ledger closes to the square of the step.

    Parameters
    ----------
    train : Train
        The vehicles and what is between them.
    """
    mass = 1e3 * np.array([vehicle.mass_t for vehicle in train.vehicles])
    speed = np.array([vehicle.speed_m_per_s for vehicle in train.vehicles])
    distance = np.array([gap.distance_mm for gap in train.gaps])
    play = np.array([gap.play_mm for gap in train.gaps])
    push = _Links([gap.push for gap in train.gaps], train.temperature_C)
    pull = _Links([gap.pull for gap in train.gaps], train.temperature_C)
    place, force, half = np.zeros(mass.size), np.zeros(mass.size), speed
    dt, steps = train.step_s, round(train.duration_s / train.step_s)
    every = max(1, -(-steps // MOST_ROWS))
    largest, when = np.zeros((2, mass.size - 1)), np.zeros((2, mass.size - 1))
    sharpest = np.zeros(mass.size)
    rows = []
    for step in range(steps + 1):
        if step:
            half = speed + 0.5 * dt * force / mass
            place = place + 1e3 * dt * half
        nearer = place[:-1] - place[1:]
        last = dt if step else 0.0
        between = push.step(nearer - distance, last) - pull.step(-nearer - play, last)
        force = 1e3 * (np.append(0.0, between) - np.append(between, 0.0))
        if step:
            speed = half + 0.5 * dt * force / mass
        sharpest = np.maximum(sharpest, np.abs(force) / mass)
        for k, now in enumerate((between, -between)):
            above = now > largest[k]
            largest[k] = np.where(above, now, largest[k])
            when[k] = np.where(above, step * dt, when[k])
        if step % every == 0 or step == steps:
            energies = (
                0.5 * float(mass @ (speed * speed)),
                push.stored_J() + pull.stored_J(),
                float((push.lost_J() + pull.lost_J()).sum()),
            )
            rows.append((step * dt, speed, between, nearer - distance, *energies, float(mass @ speed)))
    time, speeds, forces, closing, kinetic, stored, lost, momentum = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    return TrainMotion(
        time_s=time,
        speed_m_per_s=speeds,
        gap_force_kN=forces,
        closing_mm=closing,
        kinetic_J=kinetic,
        stored_J=stored,
        lost_J=lost,
        momentum_Ns=momentum,
        largest_push_kN=largest[0],
        largest_pull_kN=largest[1],
        time_of_push_s=when[0],
        time_of_pull_s=when[1],
        buffer_stroke_mm=push.stroke_mm,
        draw_gear_stroke_mm=pull.stroke_mm,
        spring_speed_mm_per_s=np.column_stack([push.speed_mm_per_s, pull.speed_mm_per_s]),
        gap_lost_J=push.lost_J() + pull.lost_J(),
        warming_K=np.maximum(push.warming_K(train.temperature_C), pull.warming_K(train.temperature_C)),
        largest_acceleration_m_per_s2=sharpest,
    )
