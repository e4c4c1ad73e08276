"""Records with known answers: closed forms, and static tests made to order."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.evaluation.facts.channel_identity import ChannelIdentity
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Ellipse:
    """x = m + A sin(ωt + φ), F = F_m + K′(x - m) + K″ A cos(ωt + φ): every figure in closed form."""

    mean_mm: float = 50.0
    amplitude_mm: float = 20.0
    mean_kN: float = 100.0
    storage: float = 4.0
    loss: float = 0.6

    @property
    def absorbed(self) -> float:
        return float(np.pi) * self.loss * self.amplitude_mm**2

    @property
    def stored(self) -> float:
        return 2.0 * self.amplitude_mm * self.mean_kN + 0.5 * self.absorbed

    def columns(
        self,
        frequency_Hz: float,
        rate_Hz: float,
        cycles: float,
        *,
        phase: float = 1.0,
        noise: float = 0.0,
        seed: int = 1,
    ) -> tuple[Floats, Floats, Floats]:
        """Return time, stroke, force; ``noise`` is a share of the range of either signal."""
        samples = round(cycles * rate_Hz / frequency_Hz) + 1
        time = np.arange(samples) / rate_Hz
        angle = 2.0 * np.pi * frequency_Hz * time + phase
        stroke = self.mean_mm + self.amplitude_mm * np.sin(angle)
        force = self.mean_kN + self.storage * (stroke - self.mean_mm)
        force = force + self.loss * self.amplitude_mm * np.cos(angle)
        random = np.random.default_rng(seed)
        stroke = stroke + noise * 2.0 * self.amplitude_mm * random.standard_normal(samples)
        force = force + noise * float(np.ptp(force)) * random.standard_normal(samples)
        return time, stroke, force


STATED = {
    "force_uncertainty": ChannelUncertainty(
        accuracy_percent=0.5, reversibility_percent=0.5, zero=0.3, u_delay_s=2e-5
    ),
    "stroke_uncertainty": (ChannelUncertainty(linearity=0.25, zero=0.05, u_delay_s=2e-5),) * 2,
}
CERTIFIED = {
    "force_identity": ChannelIdentity("cell", "cell, zeroed", "cell, filtered", "certificate"),
    "stroke_identities": tuple(
        ChannelIdentity(wire, f"{wire}, zeroed", f"{wire}, filtered", "certificate") for wire in ("w1", "w2")
    ),
}
"""Whose errors those of the channels are."""
BUFFER = {
    "id": "B1",
    "kind": "buffer",
    "category": "A",
    "max_stroke_mm": 105.0,
    "elastic_system": "elastomer",
    "assembled": "2026-01-05T08:00:00Z",
}
STARTED = datetime(2026, 1, 12, 8, tzinfo=UTC)


def loading_branch(stroke_mm: Floats, preload_kN: float, cubic: float) -> Floats:
    """Return a progressive loading branch."""
    return preload_kN + 2.0 * stroke_mm + cubic * stroke_mm**4


@dataclass(frozen=True)
class StaticTest:
    """A static test that meets every requirement and condition; change one thing to break one."""

    top_mm: float = 102.0
    speed_mm_per_s: float = 5.0
    unloading_speed_mm_per_s: float | None = None
    cycles: int = 3
    pause_s: float = 5.0
    dwell_s: float = 0.0
    residual_mm: float = 0.0
    preload_kN: float = 15.0
    cubic: float = 3.8e-6
    loss: float = 0.56
    """Share of the loading force that is lost on unloading (the absorbed energy ratio)."""
    temperature_C: float | None = 20.0
    temperature_rise_C: float = 0.0
    rate_Hz: float = 100.0
    noise_mm: float = 0.01
    noise_kN: float = 0.1
    specimen: dict[str, Any] = field(default_factory=lambda: dict(BUFFER))
    started: datetime | None = STARTED
    stated: bool = True

    def columns(self) -> tuple[Floats, Floats, Floats]:
        """Return time, stroke, force."""
        down = self.unloading_speed_mm_per_s or self.speed_mm_per_s
        points = [(0.0, 0.0), (2.0, 0.0)]
        now = 2.0
        for number in range(self.cycles):
            low = self.residual_mm if number else 0.0
            for step_s, stroke in (
                ((self.top_mm - low) / self.speed_mm_per_s, self.top_mm),
                (self.dwell_s, self.top_mm),
                ((self.top_mm - self.residual_mm) / down, self.residual_mm),
                (self.pause_s, self.residual_mm),
            ):
                now += step_s
                points.append((now, stroke))
        knots = np.array(points)
        time = np.arange(round(now * self.rate_Hz) + 1) / self.rate_Hz
        stroke = np.interp(time, knots[:, 0], knots[:, 1])
        rising = np.diff(stroke, prepend=stroke[0] - 1e-9) >= 0.0
        full = loading_branch(stroke, self.preload_kN, self.cubic)
        from_top = np.maximum(self.top_mm - stroke, 0.0)
        force = np.where(rising, full, full * (1.0 - self.loss * (1.0 - np.exp(-from_top))))
        random = np.random.default_rng(3)
        stroke = stroke + self.noise_mm * random.standard_normal(time.size)
        return time, stroke, force + self.noise_kN * random.standard_normal(time.size)

    def record(self) -> Record:
        """Return the record."""
        time, stroke, force = self.columns()
        sensors = []
        if self.temperature_C is not None:
            at = np.arange(0.0, time[-1], 1.0)
            warm = self.temperature_C + self.temperature_rise_C * at / at[-1]
            sensors = [Temperature("temperature_1", at, warm, accuracy_C=0.5)]
        return make_record(time, stroke, force, temperatures=sensors)

    def facts(self) -> RunFacts:
        """Return the facts of the run."""
        facts = RunFacts("static-1", "static", specimen=self.specimen, started=self.started)
        return replace(facts, **STATED) if self.stated else facts

    def evaluate(self, **options: Any) -> RunEvaluation:
        """Evaluate the test with few draws."""
        return evaluate_run(self.record(), self.facts(), Options(**({"draws": 400} | options)))


def later(hours: float) -> datetime:
    """Return a moment so many hours after the buffer's assembly."""
    return datetime(2026, 1, 5, 8, tzinfo=UTC) + timedelta(hours=hours)
