"""The measuring chain: what certificates state, errors drawn within it, samples of the truth through it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from .applied import Applied
from .motions import Motion
from .specimens import branches
from .truth import TrueCycle

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stated:
    """What the laboratory states of a channel, as in a mapping file."""

    accuracy_percent: float = 0.0
    zero: float = 0.0
    reversibility_percent: float = 0.0
    linearity: float = 0.0
    u_delay_s: float = 0.0
    delay_s: float = 0.0


@dataclass
class Scene:
    """A record in the making: what is true, what is stated, what the logger has."""

    number: int
    motion: Motion
    force_kN: Array  # fine grid
    temperature_C: Array  # fine grid
    cycles: list[TrueCycle]
    facts: dict[str, object]
    stated: dict[str, Stated]  # by channel; empty: the laboratory states nothing
    time_s: Array  # stamps
    true_time_s: Array
    strokes_mm: list[Array]
    force_read_kN: Array
    temperatures_C: list[Array]
    faulty_C: list[NDArray[np.bool_]] = field(default_factory=list)  # readings that are codes, by sensor
    decimals: dict[str, int] = field(
        default_factory=lambda: {"time": 5, "stroke": 4, "force": 3, "temperature": 4}
    )
    applied: list[Applied] = field(default_factory=list)
    factor: dict[str, float] = field(default_factory=dict)  # what is wrong with the units written

    @property
    def dt_s(self) -> float:
        return 1.0 / self.motion.sample_rate_Hz

    @property
    def span_mm(self) -> float:
        return float(np.ptp(self.motion.stroke_mm))

    @property
    def force_span(self) -> float:
        return float(np.ptp(self.force_kN))

    def true_stroke(self) -> Array:
        return np.interp(self.true_time_s, self.motion.time_s, self.motion.stroke_mm)

    def moving(self) -> NDArray[np.bool_]:
        """Rows at which the specimen moves."""
        still = np.zeros(len(self.true_time_s), dtype=bool)
        for a, b in self.motion.rests:
            still |= (self.true_time_s > a + 0.3) & (self.true_time_s < b - 0.05)
        return ~still

    def keep(self, rows: NDArray[np.bool_] | NDArray[np.intp]) -> None:
        """Keep rows (mask), or take rows in this order (indices)."""
        self.time_s, self.true_time_s = self.time_s[rows], self.true_time_s[rows]
        self.strokes_mm = [x[rows] for x in self.strokes_mm]
        self.force_read_kN = self.force_read_kN[rows]
        self.temperatures_C = [x[rows] for x in self.temperatures_C]
        self.faulty_C = [x[rows] for x in self.faulty_C]


def state(rng: np.random.Generator, strokes: int, temperatures: int) -> dict[str, Stated]:
    """Draw what is stated; one laboratory in twelve states nothing."""
    if rng.random() < 1.0 / 12.0:
        return {}
    delay, u = float(rng.choice([0.0, 0.0, 0.0008, 0.002])), float(rng.choice([2e-5, 1e-4, 3e-4]))
    stated = {
        "force": Stated(
            accuracy_percent=float(rng.choice([0.2, 0.5, 1.0])),
            zero=float(rng.choice([0.2, 0.5, 1.0])),
            reversibility_percent=float(rng.choice([0.0, 0.3, 0.75])),
            u_delay_s=u,
            delay_s=delay,
        )
    }
    wire = Stated(
        accuracy_percent=float(rng.choice([0.0, 0.05, 0.1])),
        zero=float(rng.choice([0.05, 0.1, 0.3])),
        linearity=float(rng.choice([0.05, 0.1, 0.25, 0.5])),
        u_delay_s=float(rng.choice([0.0, 2e-5, 1e-4])),
    )
    stated |= {f"stroke_{i + 1}": wire for i in range(strokes)}
    return stated | {f"temperature_{i + 1}": Stated(zero=0.5) for i in range(temperatures)}


def rectangular(rng: np.random.Generator, limit: float) -> float:
    """Return an error within a limit."""
    return float(rng.uniform(-limit, limit))


def reversing(t: Array, x: Array, force: Array) -> Array:
    """Return the shape of a force chain's reversibility: falling force times (1 - F / F at the last top).

    It grows from nothing at the top; after the lower turn it fades over the first 3 % of the way up.
    """
    out = np.zeros_like(force)
    start, way, left = 0, 0.03 * float(np.ptp(x)), 0.0
    for end, direction in branches(x):
        part = slice(start, end + 1)
        if direction < 0:
            peak = max(float(force[start]), 1e-6)
            out[part] = left * np.exp(-np.abs(x[part] - x[start]) / way) + force[part] * np.clip(
                1.0 - force[part] / peak, 0.0, 1.0
            )
        else:
            out[part] = left * np.exp(-np.abs(x[part] - x[start]) / way)
        left, start = float(out[end]), end
    return out


def unstraight(rng: np.random.Generator, x: Array, limit_mm: float) -> Array:
    """Return a wire's deviation from its line, as decisions/0005 has it: slow waves, counted from contact.

    Their standard deviation about the wire's own line is 0.46 of the limit, which 97 % of the deviations at a
    stroke keep; from contact, where the stroke is set to nothing, it is up to 0.75 of it.
    """
    places = np.linspace(-60.0, 120.0, 361)
    wave = np.zeros_like(places)
    for k in (1, 2, 3):
        wave += rng.normal() * np.cos(np.pi * k * places / 120.0) + rng.normal() * np.sin(
            np.pi * k * places / 120.0
        )
    wave -= np.interp(0.0, places, wave)
    wave *= 0.46 * limit_mm / np.sqrt(3.0)
    smooth = CubicSpline(places, wave)
    return np.asarray(smooth(np.clip(x, -60.0, 120.0)))


def sample(
    rng: np.random.Generator,
    motion: Motion,
    stamps: Array,
    force: Array,
    temperature: Array,
    stated: dict[str, Stated],
    strokes: int,
    sensors: int,
) -> tuple[list[Array], Array, list[Array], dict[str, float]]:
    """Return strokes, force, temperatures as a good logger has them; errors as stated."""
    t, x = motion.time_s, motion.stroke_mm
    none = Stated()
    of = stated.get("force", none)
    late = of.delay_s + rng.normal() * of.u_delay_s
    seen = force * (1.0 + rectangular(rng, of.accuracy_percent / 100.0)) + rectangular(rng, of.zero)
    if of.reversibility_percent:
        seen = seen + rectangular(rng, of.reversibility_percent / 100.0) * reversing(t, x, force)
    noise_kN = float(np.exp(rng.uniform(np.log(0.02), np.log(0.8)))) * (0.1 + np.ptp(force) / 600.0)
    read = np.interp(stamps - late, t, seen) + rng.normal(0.0, noise_kN, len(stamps))
    noise_mm = float(np.exp(rng.uniform(np.log(0.002), np.log(0.1))))
    wires, zeros = [], []
    for i in range(strokes):
        of = stated.get(f"stroke_{i + 1}", none)
        late_x = of.delay_s + rng.normal() * of.u_delay_s
        zeros.append(rectangular(rng, of.zero))
        error = x * rectangular(rng, of.accuracy_percent / 100.0) + zeros[-1]
        error += unstraight(rng, x, of.linearity)
        wires.append(np.interp(stamps - late_x, t, x + error) + rng.normal(0.0, noise_mm, len(stamps)))
    thermometers = []
    every = float(rng.uniform(0.5, 4.0))
    for _ in range(sensors):
        of = stated.get("temperature_1", none)
        held = np.floor(stamps / every) * every
        value = np.interp(held, t, temperature) + rectangular(rng, of.zero)
        thermometers.append(np.round(value / 0.0625) * 0.0625)
    facts = {
        "zero_mm": float(np.mean(zeros)),
        "noise_kN": noise_kN,
        "noise_mm": noise_mm,
        "thermometer_every_s": every,
    }
    return wires, read, thermometers, facts
