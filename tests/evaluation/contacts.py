"""Static tests with an approach before first contact, whose place on the recorded stroke is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bufferstand.evaluation.facts.first_contact import FirstContact
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.loops.first_contact import find_first_contact
from bufferstand.evaluation.record.record import Record, Temperature, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.signals import BUFFER, STARTED, STATED, Floats

WIRE = ChannelUncertainty(linearity=0.05, zero=0.05, u_delay_s=2e-5)
TIGHT = STATED | {"stroke_uncertainty": (WIRE, WIRE)}


@dataclass(frozen=True)
class Approach:
    """Three cycles from ``approach_mm`` before contact to 102 mm behind it; the recorded zero is off."""

    contact_mm: float = 0.0
    """Place of the contact on the recorded stroke: the zero lies so far before it."""
    approach_mm: float = 6.0
    preload_kN: float = 20.0
    slope: float = 2.6
    frame_kN_per_mm: float = 185.0
    offset_kN: float = 0.1
    friction_kN: float = 0.0
    noise_kN: float = 0.1
    noise_mm: float = 0.01
    speed_mm_per_s: float = 5.0
    rate_Hz: float = 100.0
    loss: float = 0.56
    seed: int = 3

    def columns(self) -> tuple[Floats, Floats, Floats]:
        """Return time, recorded stroke, force."""
        low, top = -self.approach_mm, 102.0
        moving_s = (top - low) / self.speed_mm_per_s
        knots = [(0.0, low), (1.0, low)]
        for _ in range(3):
            now = knots[-1][0]
            knots += [(now + moving_s, top), (now + 2.0 * moving_s, low), (now + 2.0 * moving_s + 2.0, low)]
        points = np.array(knots)
        time = np.arange(round(points[-1, 0] * self.rate_Hz) + 1) / self.rate_Hz
        true = np.interp(time, points[:, 0], points[:, 1])
        velocity = np.gradient(true, time)
        # The frame and the preloaded spring in a row: up to the preload only the frame gives way.
        ramp_mm = self.preload_kN / self.frame_kN_per_mm
        branch = (
            self.preload_kN + self.slope * (true - ramp_mm) + 3.2e-6 * np.maximum(true - ramp_mm, 0.0) ** 4
        )
        full = np.where(true < ramp_mm, self.frame_kN_per_mm * true, branch)
        full = np.where(true <= 0.0, 0.0, full)
        down = np.gradient(true) < 0.0
        force = np.where(down, full * (1.0 - self.loss * (1.0 - np.exp(-(top - true)))), full)
        force = force + self.offset_kN + self.friction_kN * np.sign(velocity)
        random = np.random.default_rng(self.seed)
        force = force + self.noise_kN * random.standard_normal(time.size)
        stroke = true + self.contact_mm + self.noise_mm * random.standard_normal(time.size)
        return time, stroke, force

    def record(self) -> Record:
        """Return the record, with a temperature of 20 °C."""
        time, stroke, force = self.columns()
        at = np.arange(0.0, time[-1] + 1.0)
        return make_record(
            time, stroke, force, temperatures=[Temperature("t", at, np.full(at.size, 20.0), accuracy_C=0.5)]
        )

    def found(self) -> FirstContact:
        """Return what is found, without an evaluation."""
        record = self.record()
        top_s = 1.0 + (102.0 + self.approach_mm) / self.speed_mm_per_s
        return find_first_contact(record, top_s, 0.05)

    def evaluate(self, *, stated: bool = True, **options: Any) -> RunEvaluation:
        """Evaluate it with few draws; channels that are not ``stated`` state no error."""
        known: dict[str, Any] = TIGHT if stated else {}
        facts = RunFacts("static-1", "static", specimen=BUFFER, started=STARTED, **known)
        return evaluate_run(self.record(), facts, Options(**({"draws": 200} | options)))


def shifted(test: Approach, contact_mm: float) -> Approach:
    """Return the same test with another zero."""
    return replace(test, contact_mm=contact_mm)
