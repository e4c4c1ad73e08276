"""Stands that reverse as real ones do, with a hysteretic specimen, sampled and noised; truth by fine steps.

Nothing of it is shared with the evaluation. The motion is a command (triangle with rests, or sine) that goes
through a rate limit, a lag of first or second order, or rests at the top and creeps. The specimen is a
progressive spring, Dahl's hysteresis (Bouc and Wen with n = 1) in closed form from step to step, and a
Maxwell element, which relaxes. Every figure of every cycle is integrated on the fine steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.signal import lfilter

from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.foundation.channels.channel import ChannelUncertainty
from tests.evaluation.signals import Floats

Reversal = Literal["sharp", "rounded", "lag", "second-order", "dwell", "creep"]
REVERSALS: tuple[Reversal, ...] = ("sharp", "rounded", "lag", "second-order", "dwell", "creep")
Disturbance = Literal["white", "coloured", "hum", "quantised", "held"]
DISTURBANCES: tuple[Disturbance, ...] = ("white", "coloured", "hum", "quantised", "held")
FINE = 40_000
"""Steps of a cycle."""
CHECKED = (
    "force_max_kN",
    "force_min_kN",
    "secant_stiffness_kN_per_mm",
    "stroke_max_mm",
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
    "tangent_stiffness_kN_per_mm",
)
FORCE_FACTS = ChannelUncertainty(accuracy_percent=0.1, reversibility_percent=0.0, zero=0.05, u_delay_s=0.0)
STROKE_FACTS = (ChannelUncertainty(accuracy_percent=0.01, linearity=0.005, zero=0.005, u_delay_s=0.0),)
"""Channels so good that what the turning points and the noise do is what is left."""


@dataclass(frozen=True)
class Specimen:
    """A progressive spring of ``stiff_kN_per_mm`` and more, hysteresis, and a Maxwell element."""

    preload_kN: float = 15.0
    stiff_kN_per_mm: float = 2.0
    quartic: float = 3.2e-6
    friction: float = 0.22
    length_mm: float = 4.0
    maxwell_kN_per_mm: float = 0.25
    relaxation_s: float = 1.5

    def force(self, stroke_mm: Floats, step_s: float) -> Floats:
        """Return the force along a motion in fine steps."""
        spring = self.preload_kN + self.stiff_kN_per_mm * stroke_mm + self.quartic * stroke_mm**4
        change = np.diff(stroke_mm, prepend=stroke_mm[0])
        leak = np.exp(-step_s / self.relaxation_s)
        maxwell = lfilter([0.5 * (1.0 + leak)], [1.0, -leak], change)
        return np.asarray(
            spring * (1.0 + self.friction * self._slip(stroke_mm)) + self.maxwell_kN_per_mm * maxwell
        )

    def _slip(self, stroke_mm: Floats) -> Floats:
        """Return Dahl's state: towards 1 on the way up, towards -1 on the way down, by exp(-way / length)."""
        way = np.sign(np.diff(stroke_mm))
        moving = np.flatnonzero(way)
        turns = moving[1:][np.diff(way[moving]) != 0.0]
        ends = np.concatenate(([0], turns, [stroke_mm.size - 1]))
        state = np.empty(stroke_mm.size)
        now = -1.0
        for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            part = stroke_mm[first : last + 1] - stroke_mm[first]
            to = 1.0 if part[-1] > 0.0 else -1.0
            state[first : last + 1] = to + (now - to) * np.exp(-np.abs(part) / self.length_mm)
            now = float(state[last])
        return state


@dataclass(frozen=True)
class Stand:
    """How a stand moves: ``static`` to ``top_mm`` at ``speed_mm_per_s`` with rests, or a sine.

    ``reversal_s`` is what it needs to turn (rounded), its lag, or how long it rests at the top.
    """

    kind: Literal["static", "harmonic"] = "static"
    reversal: Reversal = "sharp"
    reversal_s: float = 0.05
    low_mm: float = 5.0
    top_mm: float = 100.0
    speed_mm_per_s: float = 20.0
    frequency_Hz: float = 0.5
    rest_s: float = 2.0
    cycles: int = 3

    @property
    def _rises_s(self) -> float:
        return (self.top_mm - self.low_mm) / self.speed_mm_per_s

    @property
    def _dwell_s(self) -> float:
        return self.reversal_s if self.reversal in ("dwell", "creep") else 0.0

    @property
    def period_s(self) -> float:
        """Return the time of a cycle with its rest."""
        if self.kind == "harmonic":
            return 1.0 / self.frequency_Hz + self._dwell_s
        return 2.0 * self._rises_s + self._dwell_s + self.rest_s

    @property
    def begins_s(self) -> float:
        """Return how long before the first cycle the record begins, and after the last one it ends."""
        return 0.5 * self.rest_s if self.kind == "static" else 0.3 / self.frequency_Hz

    def motion(self) -> tuple[Floats, float]:
        """Return the stroke in fine steps, and the step."""
        step_s = self.period_s / FINE
        time = np.arange(-self.begins_s, self.cycles * self.period_s + self.begins_s, step_s)
        way = np.mod(time, self.period_s)
        command = self._static(time, way) if self.kind == "static" else self._sine(way)
        return self._followed(command, step_s), step_s

    def _static(self, time: Floats, way: Floats) -> Floats:
        rises, dwell = self._rises_s, self._dwell_s
        knots = np.cumsum([0.0, rises, dwell, rises])
        creep = 0.15 * (1.0 - np.exp(-3.0)) if self.reversal == "creep" else 0.0
        values = [self.low_mm, self.top_mm, self.top_mm + creep, self.low_mm]
        stroke = np.interp(way, knots, values)
        stroke[(time < 0.0) | (time > self.cycles * self.period_s)] = self.low_mm
        return self._crept(stroke, way, rises, dwell)

    def _sine(self, way: Floats) -> Floats:
        half = 0.5 / self.frequency_Hz
        dwell = self._dwell_s
        phase = np.where(way < half, way, np.where(way < half + dwell, half, way - dwell))
        mean, amplitude = 0.5 * (self.low_mm + self.top_mm), 0.5 * (self.top_mm - self.low_mm)
        stroke = mean - amplitude * np.cos(2.0 * np.pi * self.frequency_Hz * phase)
        return np.asarray(stroke)

    def _crept(self, stroke: Floats, way: Floats, rises: float, dwell: float) -> Floats:
        if self.reversal != "creep":
            return stroke
        inside = (way >= rises) & (way <= rises + dwell)
        share = (way[inside] - rises) / dwell
        stroke[inside] = self.top_mm + 0.15 * (1.0 - np.exp(-3.0 * share))
        return stroke

    def _followed(self, command: Floats, step_s: float) -> Floats:
        """Return what the stand makes of its command."""
        low = command[0]
        if self.reversal == "rounded":
            width = max(1, round(self.reversal_s / step_s))
            padded = np.concatenate((np.full(width, low), command))
            total = np.cumsum(padded)
            return np.asarray((total[width:] - total[:-width]) / width)
        if self.reversal == "lag":
            keep = np.exp(-step_s / self.reversal_s)
            return np.asarray(low + lfilter([1.0 - keep], [1.0, -keep], command - low))
        if self.reversal == "second-order":
            rate, damping = 2.0 / self.reversal_s, 0.7
            a, b = (rate * step_s) ** 2, 2.0 * damping * rate * step_s
            return np.asarray(low + lfilter([a], [1.0 + b + a, -2.0 - b, 1.0], command - low))
        return command


@dataclass(frozen=True)
class Sampling:
    """How it is recorded: ``noise_mm`` and ``noise_kN`` (one standard deviation), and of what kind."""

    samples_a_cycle: int = 1000
    noise_mm: float = 0.02
    noise_kN: float = 0.1
    disturbance: Disturbance = "white"


def truths(time: Floats, stroke: Floats, force: Floats, stand: Stand) -> list[dict[str, float]]:
    """Return the figures of every cycle from its fine steps."""
    area = np.concatenate(([0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke))))
    found = []
    # A lag comes late: of a sine, cycles are cut where its lowest stroke is.
    late = stand.reversal_s * {"lag": 1.0, "second-order": 0.7, "rounded": 0.5}.get(stand.reversal, 0.0)
    for number in range(stand.cycles):
        begin = int(np.searchsorted(time, number * stand.period_s + late))
        end = min(int(np.searchsorted(time, (number + 1) * stand.period_s + late)), time.size - 1)
        top = begin + int(np.argmax(stroke[begin:end]))
        back = round(0.05 * (end - begin))
        if stand.kind == "static":  # from leaving one rest to arriving at the next one
            half_rest = round(0.5 * stand.rest_s / (time[1] - time[0]))
            before, after = stroke[max(0, begin - half_rest // 2)], stroke[end - half_rest // 2]
            begin = top - 1 - int(np.argmax(stroke[top - 1 :: -1] <= before + 1e-4))
            end = top + int(np.argmax(stroke[top:end] <= after + 1e-4))
        else:
            begin = max(0, begin - back) + int(np.argmin(stroke[max(0, begin - back) : begin + back]))
            end = end - back + int(np.argmin(stroke[end - back : end + back]))
        stored = float(area[top] - area[begin])
        chord = 0.5 * float((force[end] + force[begin]) * (stroke[begin] - stroke[end]))
        absorbed = float(area[end] - area[begin]) + chord
        arrive = begin + int(np.argmax(stroke[begin : top + 1] >= stroke[top] - 0.15 - 1e-9))
        loading_end = arrive if stand.reversal == "creep" else top
        mean = 0.5 * (stroke[begin] + stroke[top])
        at = begin + int(np.searchsorted(stroke[begin : top + 1], mean))
        near = slice(at - 100, at + 101)
        found.append(
            {
                "force_max_kN": float(np.max(force[begin : end + 1])),
                "force_min_kN": float(np.min(force[begin : end + 1])),
                "secant_stiffness_kN_per_mm": float(
                    (force[loading_end] - force[begin]) / (stroke[top] - stroke[begin])
                ),
                "stroke_max_mm": float(stroke[top]),
                "stored_energy_J": stored,
                "absorbed_energy_J": absorbed,
                "damping": absorbed / stored,
                "tangent_stiffness_kN_per_mm": float(np.polyfit(stroke[near] - mean, force[near], 1)[0]),
            }
        )
    return found


def recorded(
    stand: Stand, sampling: Sampling, random: np.random.Generator, specimen: Specimen | None = None
) -> tuple[Record, list[dict[str, float]]]:
    """Return the record of a run, and the true figures of each cycle."""
    stroke, step_s = stand.motion()
    force = (specimen or Specimen()).force(stroke, step_s)
    time = np.arange(stroke.size) * step_s - (
        0.5 * stand.rest_s if stand.kind == "static" else 0.3 / stand.frequency_Hz
    )
    truth = truths(time, stroke, force, stand)
    every_s = stand.period_s / sampling.samples_a_cycle
    at = np.arange(time[0] + every_s * random.random(), time[-1], every_s)
    x, f = np.interp(at, time, stroke), np.interp(at, time, force)

    def within(limit: float | None) -> float:
        return float(random.uniform(-1.0, 1.0)) * (limit or 0.0)

    x = x * (1.0 + 0.01 * within(STROKE_FACTS[0].accuracy_percent)) + within(STROKE_FACTS[0].zero)
    f = f * (1.0 + 0.01 * within(FORCE_FACTS.accuracy_percent)) + within(FORCE_FACTS.zero)
    x, f = (
        _disturbed(x, sampling.noise_mm, sampling, every_s, random),
        _disturbed(f, sampling.noise_kN, sampling, every_s, random),
    )
    return make_record(at - at[0], x, f), truth


def _disturbed(
    value: Floats, size: float, sampling: Sampling, every_s: float, random: np.random.Generator
) -> Floats:
    noise = random.standard_normal(value.size)
    if sampling.disturbance == "coloured":
        keep = 0.8
        noise = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], noise)
    if sampling.disturbance == "hum":
        moments = np.arange(value.size) * every_s
        noise = 0.5 * noise + 1.2 * np.sin(2.0 * np.pi * 50.0 * moments + random.uniform(0.0, 6.0))
    found = value + size * noise
    if sampling.disturbance == "quantised" and size > 0.0:
        return np.round((value + 0.3 * size * noise) / (2.0 * size)) * 2.0 * size
    if sampling.disturbance == "held":
        return found[np.arange(value.size) // 3 * 3]
    return found
