"""Signals of a stand by closed forms, right or wrongly wired, and what the judges of the wiring say of them.

No simulated stand is in it: the piston is its command behind a lag of first order, the specimen's stroke
solves ``stroke + F / k = position`` with the forces of a spring model times a factor, and sensors add what
they add. So a campaign of a minute takes some hundredths of a second, and a study of hundreds is possible.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.guards.wiring.settings import ForceCurve, WiringGuard
from bufferstand.daq.guards.wiring.wiring_watch import WiringWatch
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.model.file import load_model
from bufferstand.model.prediction import predict_forces
from bufferstand.model.spring import SpringModel
from bufferstand.protocols.prediction.machine_stroke import strokes_behind

MODELS = Path(__file__).parents[2] / "sample_runs" / "models"
Floats = np.ndarray
RATE_HZ = 200.0
FORCE_2_HZ = 50.0
BLOCK_S = 0.05
STALLED_S = 7.0
COARSE_S = 0.01


@dataclass(frozen=True)
class Case:
    """A campaign on a stand: what is true, and what its files state."""

    model: str = "category-a-elastomer"
    factor: float = 1.0
    """True force over the model's."""
    static_mm_per_s: float = 5.0
    static_mm: float = 60.0
    sines: tuple[tuple[float, float, float, int], ...] = ((30.0, 15.0, 1.0, 5),)
    """Mean, amplitude, frequency, cycles."""
    static_first: bool = True
    counted: bool = True
    contact_mm: float = 1.5
    """Of the piston; taken off where strokes are counted from there."""
    wire_zero_mm: tuple[float, float] = (0.3, -0.3)
    force_zero_kN: float = 0.0
    frame_kN_per_mm: float = 120.0
    stated_frame_kN_per_mm: float | None = 150.0
    lag_s: float = 0.02
    reversal_s: float = 0.0
    force_noise_kN: float = 0.15
    stroke_noise_mm: float = 0.01
    tilt: float = 0.001
    latency_s: float = 0.002
    force_2_Hz: float = FORCE_2_HZ
    lost: float = 0.0
    """Share of the blocks that are lost."""
    second_lost: float = 0.0
    """Share of the second force's blocks that are lost."""
    stalls_s: float = 0.0
    """Every 7 s the program stands still for so long, and gets all blocks at once."""
    read_late: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """From, until: all of the controller's blocks are read late, by so much [s]; the amplifier's are not."""
    hum_kN: float = 0.0
    """Of 50 Hz, in both forces."""
    drift_kN_per_min: float = 0.0
    """Of the second force's zero: its amplifier warms up."""
    force_late_s: float = 0.0
    force_low_pass_Hz: float | None = None
    second_late_s: float = 0.0
    second_low_pass_Hz: float | None = None
    """Of first order. A conditioner's delay and filter, which no file states, within what is allowed."""
    wires: int = 2
    second: bool = True
    start_C: float = 21.0
    air_C: float = 21.0
    sensor_s: float = 20.0
    capacity_times: float = 1.0
    friction_kN: float = 0.0
    knows_model: bool = True
    speed: float = 1.0
    """Of a simulated stand, in multiples of the wall's."""
    seed: int = 1
    block_s: float = BLOCK_S


@dataclass(frozen=True)
class Signals:
    """All that the stand's transducers give: the controller at ``RATE_HZ``, others on their own instants."""

    case: Case
    time_s: Floats
    values: Mapping[str, Floats]
    second_s: Floats
    second_kN: Floats
    reading_s: Floats
    readings_C: Mapping[str, Floats]
    true_mm: Floats
    first_full_mm: float
    roles: tuple[tuple[str, ...], tuple[str, ...]] = (("temperature_1", "temperature_2"), ("temperature_3",))
    delays_s: Mapping[str, float] = field(default_factory=dict)


@cache
def model_named(name: str) -> SpringModel:
    return load_model(MODELS / f"{name}.toml")


def command_of(case: Case) -> tuple[Floats, Floats]:
    """Return time and command from first contact, at ``RATE_HZ``; it begins and ends before contact."""
    before = -case.contact_mm
    at, parts = before, [np.full(int(1.0 * RATE_HZ), before)]

    def ramp(to: float, speed: float) -> None:
        nonlocal at
        count = max(2, round(abs(to - at) / speed * RATE_HZ))
        parts.append(np.linspace(at, to, count, endpoint=False))
        at = to

    def static() -> None:
        ramp(case.static_mm, case.static_mm_per_s)
        ramp(before, case.static_mm_per_s)
        parts.append(np.full(int(1.0 * RATE_HZ), before))

    if case.static_first:
        static()
    for mean, amplitude, frequency, cycles in case.sines:
        ramp(mean, 20.0)
        count = round((cycles + 2) / frequency * RATE_HZ)
        cycle = np.arange(count) / RATE_HZ * frequency
        grow = np.minimum(1.0, np.minimum(cycle, cycles + 2 - cycle))
        parts.append(mean + amplitude * grow * np.sin(2.0 * np.pi * cycle))
        ramp(before, 20.0)
        parts.append(np.full(int(1.0 * RATE_HZ), before))
    if not case.static_first:
        static()
    command = np.concatenate(parts)
    return np.arange(len(command)) / RATE_HZ, command


def _stands_at_turns(position: Floats, stands: int) -> Floats:
    """Let the piston stand for some samples where it turns, as a valve's overlap makes it."""
    if not stands:
        return position
    turns = np.flatnonzero(np.diff(np.sign(np.diff(position))) != 0) + 1
    held = position.copy()
    for turn in turns:
        held[turn : turn + stands] = position[turn]
    return held


def signals_of(case: Case) -> Signals:
    """Return the signals of a right stand."""
    model, random = model_named(case.model), np.random.default_rng(case.seed)
    time, command = command_of(case)
    alpha = 1.0 - np.exp(-1.0 / RATE_HZ / max(case.lag_s, 1e-4))
    late = lfilter([alpha], [1.0, alpha - 1.0], command - command[0]) + command[0]
    position = _stands_at_turns(late, round(case.reversal_s * RATE_HZ))

    def forces(strokes: Floats) -> Floats:
        return case.factor * predict_forces(model, time, strokes, case.start_C)

    stroke, force = strokes_behind(position, forces, 1.0 / case.frame_kN_per_mm)
    force = force + case.friction_kN * np.sign(np.gradient(position)) * (stroke > 0.05)
    # Below its preload a specimen is rigid: the frame alone gives way.
    force = np.where(position > 0.0, np.minimum(force, case.frame_kN_per_mm * np.maximum(position, 0.0)), 0.0)
    shift = 0.0 if case.counted else case.contact_mm
    zeros = (0.0, 0.0) if case.counted else case.wire_zero_mm

    felt = _conditioned(time, force, case.force_late_s, case.force_low_pass_Hz)
    felt_2 = _conditioned(time, force, case.second_late_s, case.second_low_pass_Hz)

    def noise(size: float, count: int | None = None) -> Floats:
        return np.asarray(size * random.standard_normal(len(time) if count is None else count))

    values = {
        "command": command + shift,
        "position": position + shift + noise(case.stroke_noise_mm),
        "stroke_1": stroke * (1.0 + case.tilt) + zeros[0] + noise(case.stroke_noise_mm),
        "stroke_2": stroke * (1.0 - case.tilt) + zeros[1] + noise(case.stroke_noise_mm),
        "force": felt + (0.0 if case.counted else case.force_zero_kN) + noise(case.force_noise_kN),
    }
    if case.wires == 1:
        del values["stroke_2"]
    second_s = np.arange(0.0, time[-1], 1.0 / case.force_2_Hz)
    second = np.interp(second_s, time, felt_2) + (0.0 if case.counted else case.force_zero_kN)
    second = second + noise(case.force_noise_kN, len(second_s))
    second += case.hum_kN * np.sin(100.0 * np.pi * second_s) + case.drift_kN_per_min / 60.0 * second_s
    values["force"] += case.hum_kN * np.sin(100.0 * np.pi * time)
    reading_s, sensor, air = _heat(case, model, time, stroke, force)
    tick = lambda values: np.round((values + noise(0.03, len(values))) * 16.0) / 16.0  # noqa: E731
    readings = {
        "temperature_1": tick(sensor),
        "temperature_2": tick(sensor),
        "temperature_3": tick(air),
    }
    first = case.static_mm if case.static_first else case.sines[0][0] + case.sines[0][1]
    return Signals(case, time, values, second_s, second, reading_s, readings, stroke, first)


def _conditioned(time: Floats, value: Floats, late_s: float, low_pass_Hz: float | None) -> Floats:
    """Return a signal behind a delay and a low pass of first order; each where there is one."""
    moved = np.interp(time - late_s, time, value) if late_s else value
    if low_pass_Hz is None:
        return moved
    alpha = 1.0 - np.exp(-2.0 * np.pi * low_pass_Hz * float(time[1] - time[0]))
    return np.asarray(lfilter([alpha], [1.0, alpha - 1.0], moved))


def _heat(
    case: Case, model: SpringModel, time: Floats, stroke: Floats, force: Floats
) -> tuple[Floats, Floats, Floats]:
    """Return instants, and temperatures of a sensor on the specimen and of the air there."""
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(stroke))])
    absorbed = np.minimum.accumulate(work[::-1])[::-1]  # what never comes back
    reading_s = np.arange(0.0, time[-1], 1.0)
    heat = np.diff(np.interp(reading_s, time, absorbed), prepend=0.0)
    capacity = case.capacity_times * model.heat.capacity_J_per_K
    cools = model.heat.loss_W_per_K / capacity
    body, sensor = case.start_C, case.start_C
    felt = []
    for joule in heat:
        body += joule / capacity - cools * (body - case.air_C)
        sensor += (1.0 - np.exp(-1.0 / case.sensor_s)) * (body - sensor)
        felt.append(sensor)
    return reading_s, np.array(felt), np.full(len(reading_s), case.air_C)


def curve_of(case: Case, planned_C: float = 21.0) -> ForceCurve | None:
    """Return what a plan expects, which knows the model and no factor."""
    if not case.knows_model:
        return None
    model = model_named(case.model)
    stroke = np.linspace(0.0, 105.0 if "category" in case.model else 45.0, 43)
    cold, warm = (
        tuple(predict_forces(model, stroke / 5.0, stroke, t)) for t in (planned_C, planned_C + 20.0)
    )
    return ForceCurve(tuple(stroke), cold, warm, planned_C, planned_C + 20.0, 1.1, "spring model")


def guard_of(signals: Signals) -> WiringGuard:
    """Return what the judges expect of a case."""
    heat = model_named(signals.case.model).heat
    return WiringGuard(
        curve=curve_of(signals.case),
        frame_kN_per_mm=signals.case.stated_frame_kN_per_mm,
        delays_s=signals.delays_s,
        specimen=signals.roles[0],
        ambient=signals.roles[1],
        capacity_J_per_K=heat.capacity_J_per_K if signals.case.knows_model else None,
        sensor_lag_s=heat.sensor_lag_s if signals.case.knows_model else None,
        speed=signals.case.speed,
    )


@dataclass(frozen=True)
class Verdict:
    """The first doubt, and where the specimen was: as a share of the first full stroke, and its force."""

    trip: Trip | None
    at_s: float
    share: float
    force_kN: float


def judge(signals: Signals) -> Verdict:
    """Hand signals to the judges in blocks, as an acquisition does."""
    case, random = signals.case, np.random.default_rng(case_seed(signals.case))
    watch, guard = WiringWatch(), guard_of(signals)
    if case.counted:
        watch.rebase(counted=True)
    true_C: dict[str, float] = {}
    count = round(case.block_s * RATE_HZ)
    read_s = 0.0
    for first in range(0, len(signals.time_s), count):
        rows = slice(first, first + count)
        time = signals.time_s[rows]
        if random.uniform() < case.lost:
            continue
        at_s = float(time[-1]) + case.latency_s * random.uniform(0.5, 2.0)
        at_s = max(at_s, at_s - at_s % STALLED_S + case.stalls_s if at_s > STALLED_S else 0.0)
        from_s, until_s, by_s = case.read_late
        read_s = max(read_s, at_s + (by_s if from_s <= at_s < until_s else 0.0))
        block = ScaledBlock(
            "controller", first, np.rint(time * 1e6).astype(np.int64) + 5_000_000,
            {name: value[rows] for name, value in signals.values.items()}, 0, read_s,
        )  # fmt: skip
        trips = watch.observe(guard, block, true_C, controller=True, device_clock=True)
        between = (float(time[0]), float(time[-1]) + 1.0 / RATE_HZ)
        if case.second:
            inside = (signals.second_s >= between[0]) & (signals.second_s < between[1])
            if inside.any() and not (case.second_lost and random.uniform() < case.second_lost):
                part = ScaledBlock(
                    "amplifier", 0, np.rint(signals.second_s[inside] * 1e6).astype(np.int64),
                    {"force_2": signals.second_kN[inside]}, 0, at_s,
                )  # fmt: skip
                trips += watch.observe(guard, part, true_C, controller=False, device_clock=True)
        for row in np.flatnonzero((signals.reading_s >= between[0]) & (signals.reading_s < between[1])):
            for name, values in signals.readings_C.items():
                true_C[name] = float(values[row])
                one = ScaledBlock(
                    name, int(row), np.array([round(float(signals.reading_s[row]) * 1e6)]),
                    {name: values[row : row + 1]}, 0, at_s,
                )  # fmt: skip
                trips += watch.observe(guard, one, true_C, controller=False, device_clock=True)
        trips = [trip for trip in trips if trip.action > Action.NOTE]
        if trips:
            mm = float(signals.true_mm[: first + count].max())
            return Verdict(
                trips[0], at_s, mm / signals.first_full_mm, float(signals.values["force"][rows][-1])
            )
    return Verdict(None, float(signals.time_s[-1]), 0.0, 0.0)


def case_seed(case: Case) -> int:
    return case.seed + 1000


# --- wrong wiring ------------------------------------------------------------------------------------

Wrong = Callable[[Signals], Signals]


def changed(signals: Signals, **values: Floats) -> Signals:
    """Return signals with some of the controller's channels replaced."""
    return replace(signals, values={**signals.values, **values})


def scaled(*names: str, by: float = 1.0, plus: float = 0.0, from_s: float = 0.0) -> Wrong:
    """Multiply channels, and add to them, from a moment on."""

    def wrong(signals: Signals) -> Signals:
        values, second = dict(signals.values), signals.second_kN
        for name in names:
            if name == "force_2":
                second = np.where(signals.second_s >= from_s, by * second + plus, second)
            elif name in values:
                values[name] = np.where(signals.time_s >= from_s, by * values[name] + plus, values[name])
        return replace(signals, values=values, second_kN=second)

    return wrong


def late(*names: str, by_s: float = 0.0, low_pass_Hz: float | None = None) -> Wrong:
    """Delay channels, and let a low pass of first order smooth them."""

    def wrong(signals: Signals) -> Signals:
        values, second = dict(signals.values), signals.second_kN
        for name in names:
            track = second if name == "force_2" else values[name]
            time = signals.second_s if name == "force_2" else signals.time_s
            moved = _conditioned(time, track, by_s, low_pass_Hz)
            if name == "force_2":
                second = moved
            else:
                values[name] = moved
        return replace(signals, values=values, second_kN=second)

    return wrong


def unhooked(name: str, from_mm: float = 0.0) -> Wrong:
    """Let a wire stand still from a stroke on."""

    def wrong(signals: Signals) -> Signals:
        value = signals.values[name].copy()
        at = int(np.argmax(signals.true_mm > from_mm))
        value[at:] = value[at]
        return changed(signals, **{name: value})

    return wrong


def slips(name: str, by_mm: float, at_share: float = 0.5) -> Wrong:
    """Let a wire slip once the first full stroke is half done."""

    def wrong(signals: Signals) -> Signals:
        at = int(np.argmax(signals.true_mm > at_share * signals.first_full_mm))
        value = signals.values[name].copy()
        value[at:] -= by_mm
        return changed(signals, **{name: value})

    return wrong


def exchanged(one: str, other: str) -> Wrong:
    """Let two channels have each other's values."""

    def wrong(signals: Signals) -> Signals:
        return changed(signals, **{one: signals.values[other], other: signals.values[one]})

    return wrong


def thermometers(**values: Callable[[Signals], Floats]) -> Wrong:
    """Replace readings."""

    def wrong(signals: Signals) -> Signals:
        own = {name: make(signals) for name, make in values.items()}
        return replace(signals, readings_C={**signals.readings_C, **own})

    return wrong


def both(*wrongs: Wrong) -> Wrong:
    """Let several things be wrong."""

    def wrong(signals: Signals) -> Signals:
        for one in wrongs:
            signals = one(signals)
        return signals

    return wrong
