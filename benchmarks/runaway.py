"""How far a runaway gets: peak force above the trip and time until it stands, at several round trips.

The piston moves at 50 mm/s and runs into a spring of 20 kN/mm: 1 kN a millisecond, until a guard of the force
trips at a random force: ``late``, half a second after its start or more; ``early``, 0.05 to 0.5 s after it or
within half a second after a sine, which runs away meanwhile, was begun to be adjusted. The controller is
reached by its driver over a wire that takes so long for each round trip; all of it is in virtual time: the
figures are those of protocol, loop and actuator, not of the computer.

``emergency`` is the trip of force, stroke and tilt (the release goes first), ``stop`` that of speed and
following error (the hold goes first). Kinds of controllers: a ring read by function 23; one without it, which
takes two round trips a block; one that takes a command and its execution only in two requests; one that is
polled.

The bound of a ring is what two round trips and two blocks explain: stiffness × speed × (2 × round trip +
2 × samples per block / sample rate); at 1 kHz two blocks of 14 samples are longer than actuator (18 ms) and
pass of the loop (10 ms) together. A polled controller has no blocks: the bound is what two polls (all of its
reads), two periods and the actuator's own lag explain. The actuator's lag is the time by which it follows a
ramp late: 2 × damping / natural frequency + servo lag.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.common import SAMPLE_STAND, Benchmark, tell
from benchmarks.common.runaway_causes import (
    FAULTS,
    SINE,
    SPEED_MM_PER_S,
    STIFFNESS_KN_PER_MM,
    TOP_MM,
    Adjusting,
    AmokSine,
    Stiff,
)
from bufferstand.daq.acquisition.loop import Acquisition
from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.daq.guards.kinds.controller import ControllerGuard
from bufferstand.daq.guards.panel import GuardPanel, GuardSet
from bufferstand.daq.guards.trips import Action
from bufferstand.daq.motions.motion_runner import Halt, MotionRunner
from bufferstand.daq.motions.safe_stop import SafeStop, SafeStopReport, SafeStopSettings
from bufferstand.daq.motions.stop_observer import SampleObserver
from bufferstand.daq.operator.stop_request import StopRequest
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.drivers.simulated.inprocess.register_wire import Lost
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, behind_a_wire, open_in_process
from bufferstand.drivers.simulated.machine.physics import ActuatorFacts
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.clock import Clock
from bufferstand.foundation.motions import RampTo, Release
from bufferstand.protocols.steps.motions import Motion

ROUND_TRIPS_S = (0.00004, 0.001, 0.002, 0.005, 0.01)
When = Literal["late", "start", "adjust"]
"""When the guard trips: half a second after a start or later, soon after it, soon after an adjust."""
WHEN: tuple[When, ...] = ("late", "start", "adjust")
GAP_MM: dict[When, float] = {"late": 25.0, "start": 0.0, "adjust": 23.0}
"""From the piston's zero to the spring: how soon it is met."""
LIMITS_KN: dict[When, tuple[float, float]] = {
    "late": (100.0, 200.0),
    "start": (50.0, 500.0),
    "adjust": (10.0, 60.0),
}
"""Where the guard trips, at random: 1 kN is a millisecond behind the contact."""
AMOK_AFTER_S = 0.4
"""A sine runs away so long at most after its adjust began [s]; it meets the spring 0.02 to 0.1 s later."""
RELEASE_MM_PER_S = 20.0


@dataclass(frozen=True)
class Kind:
    """A kind of controller.

    Parameters
    ----------
    name : str
        For the table.
    profile : Profile
        Its register map.
    reads : int
        Round trips that a block, or a poll, takes.
    """

    name: str
    profile: Profile
    reads: int = 1

    def at(self, round_trip_s: float) -> Profile:
        """Return its map for a wire: polls are to take half of the time at most."""
        poll = self.profile.poll
        if poll is None:
            return self.profile
        rate_Hz = min(poll.rate_Hz, 0.5 / (self.reads * round_trip_s))
        return replace(self.profile, poll=poll.model_copy(update={"rate_Hz": rate_Hz}))

    @property
    def adjusts(self) -> bool:
        """Whether it can change a running sine."""
        return self.profile.adjusts(int(self.profile.find("profile_version").expect or 0))

    def keeps_up(self, round_trip_s: float) -> bool:
        """Return whether its samples can be read at 1 kHz at all, with a fifth of the time for the rest."""
        window = self.profile.window
        return window is None or self.reads * round_trip_s < 0.8 * window.samples_per_block / 1000.0

    def explained_s(self, round_trip_s: float, rate_Hz: float, lag_s: float) -> float:
        """Return the time of two round trips and two blocks, or of two polls, two periods and the lag."""
        window = self.profile.window
        if window is not None:
            return 2.0 * (round_trip_s + window.samples_per_block / rate_Hz)
        return 2.0 * (self.reads * round_trip_s + 1.0 / rate_Hz) + lag_s

    def reached(
        self,
        opened: InProcessStand,
        stand_file: StandFile,
        round_trip_s: float,
        lost: Callable[[bytes], Lost],
    ) -> tuple[Stand, Clock]:
        """Return the stand behind the wire, and the clock to wait by."""
        profile = self.at(round_trip_s)
        return behind_a_wire(opened, stand_file, lambda: round_trip_s, profile, lost), opened.clock


def _apart(profile: Profile) -> Profile:
    """Return a map whose ``execute`` does not lie behind the command: no request can carry both."""
    execute = profile.registers["execute"]
    moved = execute.model_copy(update={"address": execute.address + 4})
    return replace(profile, registers={**profile.registers, "execute": moved})


_RING, _POLLED = load_profile("ring"), load_profile("polling")
KINDS = {
    kind.name: kind
    for kind in (
        Kind("ring", _RING),
        Kind("ring, FC16 + FC3", replace(_RING, read_write=False), reads=2),
        Kind("ring, command in two", _apart(_RING)),
        Kind("polled", _POLLED, reads=len(_POLLED.poll.reads) if _POLLED.poll else 1),
    )
}
"""Kinds of controllers, by name."""


@dataclass(frozen=True)
class Runaways:
    """What runaways did at one round trip.

    Parameters
    ----------
    round_trip_s : float
        Of each request [s].
    above_kN : NDArray
        Recorded peak force above the trip's limit, one each [kN].
    until_s : NDArray
        From the first sample beyond the limit to the piston's turn or stand, one each [s].
    bound_kN : float
        What the kind's bound explains [kN].
    problems : tuple of str
        What the safe stops had to say.
    safe : bool
        Whether each ended without force, valve off, as the safe stop saw it.
    """

    round_trip_s: float
    above_kN: np.ndarray
    until_s: np.ndarray
    bound_kN: float
    problems: tuple[str, ...]
    safe: bool

    @property
    def text(self) -> str:
        """Worst peak above the trip."""
        return f"{self.above_kN.max():.1f} kN"


class Trials:
    """One stand behind one wire, on which the piston runs away again and again.

    Parameters
    ----------
    round_trip_s : float
        Of each request [s].
    action : Action
        Of the guard of the force.
    kind, fault : str
        By name: of controller, of what fails in the stop.
    when : When
        When the guard trips.
    seed : int
        Of the random forces and times.
    """

    def __init__(
        self, round_trip_s: float, action: Action, kind: str, fault: str, when: When, seed: int
    ) -> None:
        self._action, self._when, self._random = action, when, random.Random(seed)
        stand_file, self._spoiled = load_stand(SAMPLE_STAND), FAULTS[fault]
        opened = open_in_process(stand_file, spring=Stiff(GAP_MM[when]), log_truth=False)
        self._amok = AmokSine(opened.device.controller, opened.clock.now_s)
        stand, clock = KINDS[kind].reached(opened, stand_file, round_trip_s, self._lost)
        self._spoiled.spoil(opened.device.controller)
        self._controller = stand.controller
        self._controller.connect()
        facts = self._controller.facts
        self._quiet = GuardSet((), (), ControllerGuard(5.0, 5.0, facts.rate_Hz, facts.clock == "device"))
        self._acquisition = Acquisition(stand, clock, GuardPanel(self._quiet, wall_s=clock.wall_s()))
        self._seen: list[ScaledBlock] = []
        self._acquisition.listeners.append(self._seen.append)
        pump = self._acquisition.tick
        self._driver = MotionRunner(
            self._acquisition, StopRequest(), pump, release_speed_mm_per_s=RELEASE_MM_PER_S
        )
        settings = SafeStopSettings(RELEASE_MM_PER_S, 2.0)
        eyes = SampleObserver(self._acquisition, stand_file.limits.force_max_kN)
        self._safe_stop = SafeStop(self._controller, clock, settings, pump=pump, eyes=eyes)
        explained_s = KINDS[kind].explained_s(round_trip_s, facts.rate_Hz, _lag_s(stand_file))
        self.bound_kN = STIFFNESS_KN_PER_MM * SPEED_MM_PER_S * explained_s
        self.close = stand.close

    def run_away(self) -> tuple[tuple[float, float], SafeStopReport]:
        """Let the piston run away once; return how far it got (:func:`_reached`) and how it was stopped."""
        driver, acquisition = self._driver, self._acquisition
        self._switch_on()
        self._safe_stop.arm()
        driver.wait(0.3 + self._random.uniform(0.0, 0.05))
        while not acquisition.up_to_date:
            acquisition.tick()
        motion: Motion = RampTo(TOP_MM, SPEED_MM_PER_S)
        if self._when == "adjust":
            driver.perform(RampTo(SINE.mean_mm, SPEED_MM_PER_S), 1.0)
            driver.commanding = Adjusting(self._controller)
            self._amok.begin(self._random.uniform(0.0, AMOK_AFTER_S))
            motion = SINE
        limit_kN = self._random.uniform(*LIMITS_KN[self._when])
        guard = ChannelGuard("force", "force", limit_kN, None, "kN", "force", self._action)
        acquisition.panel.change(GuardSet((guard,), (), self._quiet.of(ControllerGuard)))
        self._seen.clear()
        self._spoiled.begin()
        with suppress(Halt):
            driver.perform(motion, TOP_MM / SPEED_MM_PER_S)
        emergency = self._action is Action.EMERGENCY
        report = self._safe_stop.run(emergency=emergency, seen=acquisition.latest.status)
        reached = _reached(self._seen, limit_kN)
        self._spoiled.end()
        if not report.safe:  # force is left behind the closed valve
            self._switch_on()
            driver.perform(Release(RELEASE_MM_PER_S), TOP_MM / RELEASE_MM_PER_S)
            self._controller.disable()
        return reached, report

    def _switch_on(self) -> None:
        self._acquisition.panel.change(self._quiet)
        self._acquisition.panel.reset()
        self._controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=2000)

    def _lost(self, request: bytes) -> Lost:
        self._amok.look(request)
        return self._spoiled.lost(request)


def run_away(
    round_trip_s: float,
    action: Action,
    trips: int,
    seed: int = 1,
    kind: str = "ring",
    fault: str = "none",
    when: When = "late",
) -> Runaways:
    """Let the piston run away ``trips`` times; the record of each tells how far it got."""
    trials = Trials(round_trip_s, action, kind, fault, when, seed)
    found = [trials.run_away() for _ in range(trips)]
    trials.close()
    above_kN, until_s = np.array([reached for reached, _ in found]).T
    problems = tuple(problem for _, report in found for problem in report.problems)
    safe = all(report.safe for _, report in found)
    return Runaways(round_trip_s, above_kN, until_s, trials.bound_kN, problems, safe)


def _lag_s(stand_file: StandFile) -> float:
    """Return how late the simulated actuator follows a ramp [s]: 2 ζ / ω, and the servo's own lag.

    ω is the natural frequency of the second-order low pass whose amplitude has fallen by 3 dB at the
    actuator's bandwidth.
    """
    simulation = stand_file.simulation or {}
    damping = ActuatorFacts().damping
    ratio = math.sqrt(1.0 - 2.0 * damping**2 + math.sqrt(4.0 * damping**4 - 4.0 * damping**2 + 2.0))
    omega = 2.0 * math.pi * float(simulation["actuator_bandwidth_Hz"]) / ratio
    return 2.0 * damping / omega + float(simulation["servo_lag_s"])


def _reached(seen: list[ScaledBlock], limit_kN: float) -> tuple[float, float]:
    """Return peak force above the limit [kN], and how long the piston went on [s]."""
    time_us = np.concatenate([block.time_us for block in seen])
    force_kN = np.concatenate([block.values["force"] for block in seen])
    position_mm = np.concatenate([block.values["position"] for block in seen])
    first = int(np.flatnonzero(force_kN > limit_kN)[0])
    stands = int(np.flatnonzero(position_mm >= position_mm.max() - 0.05)[0])
    return float(force_kN.max()) - limit_kN, float(time_us[max(stands, first)] - time_us[first]) / 1e6


def tell_kinds(kinds: Sequence[str], round_trips_s: Sequence[float], trips: int) -> float:
    """Tell how far a runaway gets with each kind of controller; return the worst ratio to its bound."""
    columns = ("late", "early, start", "early, adjust", "stands after")
    heads = [f"{action}: {column}" for action in ("emergency", "stop") for column in columns]
    tell(f"| {' | '.join(('controller', 'round trip', 'bound', *heads))} |")
    tell("|---" * (3 + len(heads)) + "|")
    worst = 0.0
    for kind in kinds:
        for round_trip_s in round_trips_s:
            row = f"| {kind} | {round_trip_s * 1e3:g} ms "
            if not KINDS[kind].keeps_up(round_trip_s):
                tell(f"{row}| does not keep up: refused before anything moves {'| ' * len(heads)}|")
                continue
            cells: list[str] = []
            for action in (Action.EMERGENCY, Action.STOP):
                found = [
                    run_away(round_trip_s, action, trips, kind=kind, when=when)
                    for when in WHEN
                    if when != "adjust" or KINDS[kind].adjusts
                ]
                worst = max(worst, *(one.above_kN.max() / one.bound_kN for one in found))
                cells += [one.text for one in found] + ["–"] * (len(WHEN) - len(found))
                cells.append(f"{max(one.until_s.max() for one in found) * 1e3:.0f} ms")
            tell(f"{row}| {found[0].bound_kN:.1f} kN | {' | '.join(cells)} |")
    return worst


def tell_faults(round_trips_s: Sequence[float], trips: int) -> None:
    """Tell how far a runaway gets when the hold of a stop fails, at each round trip."""
    tell(f"\n| stop | {' | '.join(f'{1e3 * round_trip_s:g} ms' for round_trip_s in round_trips_s)} |")
    tell("|---" * (1 + len(round_trips_s)) + "|")
    for fault in FAULTS:
        found = (run_away(one, Action.STOP, trips, fault=fault) for one in round_trips_s)
        tell(f"| {fault} | {' | '.join(f'{one.above_kN.max():.0f} kN' for one in found)} |")


def measure(
    folder: Path,  # noqa: ARG001 - the form's
    *,
    kinds: Sequence[str],
    round_trips_s: Sequence[float],
    trips: int,
) -> Sequence[float]:
    """Let the piston run away in every way."""
    worst = tell_kinds(kinds, round_trips_s, trips)
    tell_faults(round_trips_s, trips)
    return [worst]


BENCHMARK = Benchmark(
    {"worst peak above the trip / its bound": 1.0},
    full=partial(measure, kinds=tuple(KINDS), round_trips_s=ROUND_TRIPS_S, trips=10),
    smoke=partial(measure, kinds=("polled",), round_trips_s=(0.005,), trips=1),
)
