"""A tiny stand in virtual time whose every fault can be ordered: an ideal actuator on a linear spring."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field

import numpy as np

from bufferstand.drivers.interfaces import (
    ControllerStatus,
    EndReason,
    Identity,
    MotionState,
    SampleBlock,
    SensorFault,
    Stand,
    StreamFacts,
    WriterSeen,
)
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.errors import CommandRejected, DeviceFault, NotInCharge, WireLost
from bufferstand.foundation.motions import (
    ControllerMotion,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
)

RATE_HZ = 1000.0
STIFFNESS_KN_PER_MM = 5.0
KN_PER_COUNT = 0.001
MM_PER_COUNT = 0.01
BLOCK = 40


class FakeClock:
    """Virtual time; the wall may run at another speed, or jump."""

    def __init__(self, wall_speed: float = 1.0) -> None:
        self._now_s = 0.0
        self._wall_speed = wall_speed

    def now_s(self) -> float:
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        self._now_s += duration_s

    def wall_s(self) -> float:
        return self._now_s * self._wall_speed


def channel(name: str, quantity: str, unit: str, factor: float) -> Channel:
    return Channel.model_validate(
        {
            "name": name,
            "quantity": quantity,
            "unit": unit,
            "place": "test",
            "calibration": Calibration(coefficients=(0.0, factor)),
        }
    )


CONTROLLER_FACTS = StreamFacts(
    "controller",
    "device",
    (
        channel("force", "force", "kN", KN_PER_COUNT),
        channel("stroke_1", "stroke", "mm", MM_PER_COUNT),
        channel("stroke_2", "stroke", "mm", MM_PER_COUNT),
        channel("position", "position", "mm", MM_PER_COUNT),
        channel("command", "command", "mm", MM_PER_COUNT),
    ),
    RATE_HZ,
    "fake",
)


@dataclass
class Orders:
    """What shall go wrong, by absolute sample number or stand time."""

    add: dict[str, Callable[[int], float]] = field(default_factory=dict)
    """Added to a channel, in its unit, by sample number."""
    lose_at: dict[int, int] = field(default_factory=dict)
    """Sample number → how many samples are lost before it."""
    wire_down: Callable[[float], bool] = lambda _: False
    lost: Callable[[float], bool] = lambda _: False
    """While this is so no reply comes, each for a tenth of a second; the stand goes on."""
    watchdog_counts_off: bool = False
    """The watchdog runs out with the valve off, too."""
    silent_from_s: float = math.inf
    heart_stops_at_s: float = math.inf
    fault_at_s: float = math.inf
    fault_code: int = 4
    reject: frozenset[str] = frozenset()
    round_trip_s: float = 0.0
    """So long each call takes."""
    writer: int | None = None
    """Who else may give commands; None: the controller has no lock."""
    lock_lost_at_s: float = math.inf
    """From then on another program gives commands."""
    explode_at_s: float = math.inf
    """An exception that nobody expects: a bug."""


class FakeController:
    """Follows its commands exactly; the force is the spring's."""

    def __init__(self, clock: FakeClock, orders: Orders | None = None, *, watchdog_s: float = 2.0) -> None:
        self.facts = CONTROLLER_FACTS
        self.clock = clock
        self.orders = orders or Orders()
        self.calls: list[str] = []
        self.state = MotionState.READY
        self.mm = 0.0
        self.watchdog_s = watchdog_s
        self.limits: tuple[float, float] | None = None
        self.watchdog_trips = 0
        self.fault_code = 0
        self.end = EndReason.NONE
        self.cycles_done = 0
        self.sequence = self.done = 0
        self._made = self._read = self._lost = 0
        self._rows: list[tuple[int, float]] = []
        self._motion: Callable[[float], tuple[float, bool]] | None = None
        self._motion_began_s = 0.0
        self._fed_s = 0.0

    # --- the device's own life ---------------------------------------------------------------------
    def _live(self) -> None:
        """Make the samples that are due."""
        due = round(self.clock.now_s() * RATE_HZ)
        while self._made < due:
            self._made += 1
            now_s = self._made / RATE_HZ
            self._fall_back(now_s)
            if self._motion is not None:
                self.mm, over = self._motion(now_s - self._motion_began_s)
                if over and self.fault_code:
                    self.state, self._motion = MotionState.FAULT, None  # valve off by its own fallback
                elif over:
                    self._end(EndReason.REACHED)
            self._rows.append((self._made, self.mm))

    def _end(self, reason: EndReason) -> None:
        self.end, self.done, self._motion = reason, self.sequence, None
        self.state = MotionState.HOLDING

    def _fall_back(self, now_s: float) -> None:
        if self.fault_code:
            return
        if self.state in (MotionState.READY, MotionState.OFF):
            if self.orders.watchdog_counts_off and now_s - self._fed_s > self.watchdog_s:
                self.watchdog_trips, self.fault_code = self.watchdog_trips + 1, 1
                self.state = MotionState.FAULT
            return
        if now_s >= self.orders.fault_at_s:
            self._fault(self.orders.fault_code, EndReason.DEVICE_LIMIT, now_s)
        elif now_s - self._fed_s > self.watchdog_s:
            self.watchdog_trips += 1
            self._fault(1, EndReason.WATCHDOG, now_s)

    def _fault(self, code: int, reason: EndReason, now_s: float) -> None:
        self.state, self.fault_code, self.end = MotionState.RELEASING, code, reason
        self._begin(self._to(0.0, 50.0), now_s)
        self.done = self.sequence

    def _to(self, target_mm: float, speed_mm_per_s: float) -> Callable[[float], tuple[float, bool]]:
        start_mm = self.mm

        def motion(t_s: float) -> tuple[float, bool]:
            way = min(abs(target_mm - start_mm), speed_mm_per_s * t_s)
            mm = start_mm + math.copysign(way, target_mm - start_mm)
            return mm, abs(mm - target_mm) < 1e-9

        return motion

    def _begin(self, motion: Callable[[float], tuple[float, bool]], now_s: float) -> None:
        self._motion, self._motion_began_s = motion, now_s

    def _command(self, name: str, state: MotionState, motion: Callable[[float], tuple[float, bool]]) -> int:
        self._wire(name)
        if name in self.orders.reject:
            raise CommandRejected(f"{name}: refused by order")
        if self.fault_code or self.state in (MotionState.OFF, MotionState.READY):
            raise CommandRejected(f"{name}: wrong state {self.state.name}")
        self.sequence += 1
        self.state, self.end = state, EndReason.NONE
        self._begin(motion, self.clock.now_s())
        return self.sequence

    def _wire(self, name: str) -> None:
        self.clock.sleep(self.orders.round_trip_s)
        self._live()
        self.calls.append(name)
        if self.orders.lost(self.clock.now_s()):
            self.clock.sleep(0.1)
            raise WireLost("127.0.0.1: no reply within 0.1 s")
        if self.orders.wire_down(self.clock.now_s()):
            raise DeviceFault("127.0.0.1: no answer within 0.5 s")
        if self.clock.now_s() >= self.orders.explode_at_s:
            raise ZeroDivisionError("a bug in the driver")

    # --- the interface -----------------------------------------------------------------------------
    def connect(self) -> Identity:
        self._wire("connect")
        return Identity("fake", "nowhere", "1", "ring", RATE_HZ)

    def skip_backlog(self, *, anew: bool = False) -> None:  # noqa: ARG002 - it counts on
        self._wire("skip_backlog")

    def read_block(self) -> SampleBlock | None:
        self._wire("read_block")
        if self.clock.now_s() >= self.orders.silent_from_s:
            return None
        rows = self._rows[self._read : self._read + BLOCK]
        lost = 0
        if rows and rows[0][0] in self.orders.lose_at:
            if len(self._rows) <= self._read + self.orders.lose_at[rows[0][0]]:
                return None
            lost = self.orders.lose_at.pop(rows[0][0])
            self._read += lost
            rows = self._rows[self._read : self._read + BLOCK]
        cut = next((i for i, row in enumerate(rows) if i and row[0] in self.orders.lose_at), len(rows))
        rows = rows[:cut]
        if not rows:
            return None
        self._read += len(rows)
        number = np.array([row[0] for row in rows], dtype=np.int64)
        mm = np.array([row[1] for row in rows])
        values = {
            "force": STIFFNESS_KN_PER_MM * mm / KN_PER_COUNT,
            "stroke_1": mm / MM_PER_COUNT,
            "stroke_2": mm / MM_PER_COUNT,
            "position": mm / MM_PER_COUNT,
            "command": mm / MM_PER_COUNT,
        }
        for name, extra in self.orders.add.items():
            factor = KN_PER_COUNT if name == "force" else MM_PER_COUNT
            values[name] = values[name] + np.array([extra(int(n)) for n in number]) / factor
        counts = {name: np.round(value).astype(np.int32) for name, value in values.items()}
        more = len(rows) == BLOCK
        now_s = self.clock.now_s()
        return SampleBlock("controller", int(number[0]), number * 1000, counts, lost, now_s, more=more)

    def delivery(self) -> None:
        """No wire bounds it."""

    def status(self) -> ControllerStatus:
        self._wire("status")
        beat_s = min(self.clock.now_s(), self.orders.heart_stops_at_s)
        return ControllerStatus(
            self.state,
            self.fault_code,
            self.done,
            self.end,
            self.cycles_done,
            int(beat_s * 100) & 0xFFFF,
            self.watchdog_trips,
            STIFFNESS_KN_PER_MM * self.mm,
            self.mm,
            self.mm,
            self.mm,
        )

    simulated = False

    def says_simulated(self) -> bool:
        return self.simulated

    def other_writer(self) -> int | None:
        self._wire("other_writer")
        return self.orders.writer

    def seen_writer(self) -> WriterSeen:
        self._wire("seen_writer")
        number = self.orders.writer
        return WriterSeen(
            number, f"a program that this computer knows nothing of (number {number})" if number else ""
        )

    @property
    def in_charge(self) -> bool:
        return self.clock.now_s() < self.orders.lock_lost_at_s

    def look_at_lock(self) -> None:
        if self.orders.writer is not None or not self.in_charge:  # without a lock nothing is asked
            self._wire("look_at_lock")
        if not self.in_charge:
            raise NotInCharge("fake: program 4711 has taken over; nothing more is sent to it")

    def take_charge(self) -> None:
        self._wire("take_charge")

    def changed_limits(self) -> str:
        self._wire("changed_limits")
        return ""

    def give_back(self) -> None:
        self._wire("give_back")

    def feed_watchdog(self) -> None:
        self._wire("feed_watchdog")
        if not self.in_charge:
            raise NotInCharge("fake: program 4711 has taken over; nothing more is sent to it")
        self._fed_s = self.clock.now_s()

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        self._wire("enable")
        self.limits = (force_limit_kN, stroke_limit_mm)
        self.watchdog_s = watchdog_ms / 1e3
        self.state, self.fault_code = MotionState.HOLDING, 0
        self._fed_s = self.clock.now_s()

    stops_at_once = True
    taken_us = None

    def look_between(
        self,
        look: Callable[[], object],  # noqa: ARG002
        outlast: Callable[[WireLost], object] | None = None,  # noqa: ARG002
    ) -> AbstractContextManager[None]:
        return nullcontext()

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:  # noqa: ARG002
        match motion:
            case StandStill():
                return self._command("hold", MotionState.HOLDING, self._to(self.mm, 1.0))
            case RampTo():
                way = self._to(motion.target_mm, motion.speed_mm_per_s)
                return self._command("ramp", MotionState.RAMPING, way)
            case Harmonic():
                return self._command("harmonic", MotionState.WAVEFORM, self._sine(motion))
            case StaticCycles():
                return self._command("static", MotionState.WAVEFORM, self._static(motion))
            case Release():
                return self._command("release", MotionState.RELEASING, self._to(0.0, motion.speed_mm_per_s))

    def _sine(self, sine: Harmonic) -> Callable[[float], tuple[float, bool]]:
        self.cycles_done, cycles = 0, sine.cycles

        def motion(t_s: float) -> tuple[float, bool]:
            phase = t_s * sine.frequency_Hz
            self.cycles_done = min(cycles, max(0, int(phase) - 1))
            fade = min(1.0, phase, max(0.0, cycles + 2 - phase))
            if phase >= cycles + 2:
                return sine.mean_mm, True
            return sine.mean_mm + sine.amplitude_mm * fade * math.sin(2 * math.pi * phase), False

        return motion

    can_adjust = False

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        raise CommandRejected(f"the fake stand cannot adjust a sine ({mean_mm:g} ± {amplitude_mm:g} mm)")

    def _static(self, static: StaticCycles) -> Callable[[float], tuple[float, bool]]:
        self.cycles_done = 0
        speed_mm_per_s, cycles = static.speed_mm_per_s, static.cycles
        top_mm = min(static.stroke_limit_mm, static.force_limit_kN / STIFFNESS_KN_PER_MM)
        cycle_s = 2 * top_mm / speed_mm_per_s

        def motion(t_s: float) -> tuple[float, bool]:
            number, rest_s = divmod(t_s, cycle_s + static.pause_s)
            self.cycles_done = min(cycles, int(number))
            if number >= cycles:
                return 0.0, True
            return max(0.0, top_mm - abs(top_mm - rest_s * speed_mm_per_s)), False

        return motion

    def prepare(self, release: Release) -> None:
        """One call starts it as it is."""

    def reset_fault(self) -> None:
        self._wire("reset_fault")
        self.state, self.fault_code = MotionState.OFF, 0

    def disable(self) -> None:
        self._wire("disable")
        self._motion = None
        self.state = MotionState.FAULT if self.fault_code else MotionState.OFF

    def events(self) -> Sequence[str]:
        return ()

    def close(self) -> None:
        self.calls.append("close")


class FakeThermometer:
    """A reading a second, by a function of time; None is silence, a text is a fault."""

    def __init__(
        self, clock: FakeClock, reading: Callable[[float], float | str | None], name: str = "temperature_1"
    ) -> None:
        self.facts = StreamFacts(name, "host", (channel(name, "temperature", "°C", 0.0625),), 1.0, "fake")
        self._clock, self._reading = clock, reading
        self._next_s, self._sequence = 0.0, 0

    def start(self) -> None:
        self._next_s = self._clock.now_s()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        items: list[SampleBlock | SensorFault] = []
        while self._next_s <= self._clock.now_s():
            value = self._reading(self._next_s)
            name = self.facts.name
            if isinstance(value, str):
                items.append(SensorFault(name, self._next_s, value))
            elif value is not None:
                counts = {name: np.array([round(value / 0.0625)], dtype=np.int16)}
                stamp = np.array([round(self._next_s * 1e6)], dtype=np.int64)
                items.append(SampleBlock(name, self._sequence, stamp, counts, 0, self._next_s))
                self._sequence += 1
            self._next_s += 1.0
        return items

    def close(self) -> None:
        pass


def fake_stand(
    clock: FakeClock,
    orders: Orders | None = None,
    *,
    reading: Callable[[float], float | str | None] = lambda _: 21.0,
) -> tuple[Stand, FakeController]:
    controller = FakeController(clock, orders)
    return Stand(controller, (FakeThermometer(clock, reading),)), controller
