"""The figures of a train's motion, the balances that show whether they hold, and warnings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bufferstand.model.spring import SpringModel
from bufferstand.model.train.motion import TrainMotion
from bufferstand.model.train.scene import Train

SCHEMA = "bufferstand/train/1"
LEDGER_TOLERANCE = 0.005
"""Share of the kinetic energy that may be missing before the step is called too long."""


@dataclass(frozen=True)
class TrainFigures:
    """What a train went through.

    Parameters
    ----------
    largest_push_kN, largest_pull_kN : float
        Largest force of any gap, both positive.
    kinetic_before_J, kinetic_after_J, stored_after_J, lost_J : float
        The ledger at the beginning and at the end.
    ledger_gap : float
        Largest difference of kinetic + stored + lost from that at the beginning, over the kinetic energy that
        the vehicles have in the frame of their centre of mass: what an impact can turn over.
    momentum_change : float
        Largest change of the momentum over the sum of the vehicles' momenta without their signs.
    energy_of_impact_J : float
        Kinetic energy in the frame of the centre of mass before: what a plastic impact would lose.
    warnings : tuple of str
        What must be known of these figures.
    """

    largest_push_kN: float
    largest_pull_kN: float
    kinetic_before_J: float
    kinetic_after_J: float
    stored_after_J: float
    lost_J: float
    ledger_gap: float
    momentum_change: float
    energy_of_impact_J: float
    warnings: tuple[str, ...]

    def document(self, train: Train, motion: TrainMotion) -> dict[str, Any]:
        """Return all figures as one JSON object, units in the names."""
        return {
            "schema": SCHEMA,
            "name": train.name,
            "temperature_C": train.temperature_C,
            "duration_s": train.duration_s,
            "step_s": train.step_s,
            "vehicles": [
                {
                    "name": vehicle.name,
                    "mass_t": vehicle.mass_t,
                    "speed_before_m_per_s": vehicle.speed_m_per_s,
                    "speed_after_m_per_s": float(motion.speed_m_per_s[-1, k]),
                    "largest_acceleration_m_per_s2": float(motion.largest_acceleration_m_per_s2[k]),
                }
                for k, vehicle in enumerate(train.vehicles)
            ],
            "gaps": [_gap(train, motion, k) for k in range(len(train.gaps))],
            "largest_push_kN": self.largest_push_kN,
            "largest_pull_kN": self.largest_pull_kN,
            "kinetic_energy_before_J": self.kinetic_before_J,
            "kinetic_energy_after_J": self.kinetic_after_J,
            "stored_energy_after_J": self.stored_after_J,
            "lost_energy_J": self.lost_J,
            "energy_of_impact_J": self.energy_of_impact_J,
            "ledger_gap": self.ledger_gap,
            "momentum_change": self.momentum_change,
            "warnings": list(self.warnings),
        }


def figures_of(train: Train, motion: TrainMotion) -> TrainFigures:
    """Return the figures of a motion.

    Parameters
    ----------
    train : Train
        What moved.
    motion : TrainMotion
        How it did.
    """
    mass = 1e3 * np.array([vehicle.mass_t for vehicle in train.vehicles])
    speed = motion.speed_m_per_s[0]
    centre = float(mass @ speed / mass.sum())
    impact = 0.5 * float(mass @ (speed - centre) ** 2)
    total = motion.kinetic_J + motion.stored_J + motion.lost_J
    missing = float(np.abs(total - total[0]).max())
    ledger = missing / impact if impact > 0.0 else 0.0
    momenta = float(mass @ np.abs(speed))
    change = float(np.ptp(motion.momentum_Ns)) / momenta if momenta > 0.0 else 0.0
    return TrainFigures(
        float(motion.largest_push_kN.max()),
        float(motion.largest_pull_kN.max()),
        float(motion.kinetic_J[0]),
        float(motion.kinetic_J[-1]),
        float(motion.stored_J[-1]),
        float(motion.lost_J[-1]),
        ledger,
        change,
        impact,
        _warnings(train, motion, ledger),
    )


def _gap(train: Train, motion: TrainMotion, k: int) -> dict[str, Any]:
    pushed, pulled = motion.largest_push_kN[k] > 0.0, motion.largest_pull_kN[k] > 0.0
    return {
        "between": [train.vehicles[k].name, train.vehicles[k + 1].name],
        "coupled": train.gaps[k].pull is not None,
        "largest_push_kN": float(motion.largest_push_kN[k]),
        "largest_push_at_s": float(motion.time_of_push_s[k]) if pushed else None,
        "largest_pull_kN": float(motion.largest_pull_kN[k]),
        "largest_pull_at_s": float(motion.time_of_pull_s[k]) if pulled else None,
        "buffer_stroke_mm": motion.buffer_stroke_mm[k].tolist(),
        "draw_gear_stroke_mm": motion.draw_gear_stroke_mm[k].tolist()
        if train.gaps[k].pull is not None
        else None,
        "lost_energy_J": float(motion.gap_lost_J[k]),
        "warming_K": float(motion.warming_K[k]),
    }


def _warnings(train: Train, motion: TrainMotion, ledger: float) -> tuple[str, ...]:
    """Return what must be known: a ledger that does not close, and springs beyond what was identified."""
    found = []
    if ledger > LEDGER_TOLERANCE:
        hottest = float(motion.warming_K.max())
        found.append(
            f"the energy ledger misses {100.0 * ledger:.2g} % of what the impact can turn over: the step of "
            f"{train.step_s:g} s may be too long for these springs (or they soften: {hottest:.1f} K warmer)"
        )
    farthest: dict[int, tuple[SpringModel, float, float, float]] = {}
    for k, gap in enumerate(train.gaps):
        for springs, strokes, column in (
            (gap.push, motion.buffer_stroke_mm[k], 0),
            (gap.pull, motion.draw_gear_stroke_mm[k], 1),
        ):
            if springs is None:
                continue
            speed, warmer = float(motion.spring_speed_mm_per_s[k, column]), float(motion.warming_K[k])
            for model, stroke in ((springs.left, strokes[0]), (springs.right, strokes[1])):
                _, known, fast, warm = farthest.get(id(model), (model, 0.0, 0.0, 0.0))
                new = (model, max(known, float(stroke)), max(fast, speed), max(warm, warmer))
                farthest[id(model)] = new
    for model, stroke, speed, warmer in farthest.values():
        end, range_ = model.curves.end_mm, model.identified
        if range_ is None and stroke > end:
            found.append(
                f"{model.name}: {stroke:.1f} mm, {stroke - end:.2f} mm into the stop of "
                f"{model.curves.stop_stiffness_kN_per_mm:g} kN/mm"
            )
        if range_ is not None:
            history = np.array([0.0, stroke])
            about = range_.warnings(
                model.curves, np.array([0.0, max(stroke, 1e-9) / max(speed, 1e-9)]), history
            )
            found += [f"{model.name}: {sentence}" for sentence in about]
        law = model.temperature.warning(train.temperature_C, train.temperature_C + warmer)
        if law is not None:
            found.append(f"{model.name}: {law}")
    return tuple(dict.fromkeys(found))
