"""How far a runaway gets: peak force above the trip and time until it stands, at several round trips.

    .venv/bin/python -m benchmarks.runaway [--trips 40] [KIND…]

The piston moves at 50 mm/s and, half a second after its start, runs into a spring of 20 kN/mm: 1 kN a
millisecond, until a guard of the force trips at a random force. The controller is reached by its driver over
a wire that takes so long for each round trip; all of it is in virtual time: the figures are those of
protocol, loop and actuator, not of the computer.

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

import argparse
import math
import random
import struct
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from daq.acquisition import Acquisition
from daq.controller_guard import ControllerGuard
from daq.driving import Driver, Halt
from daq.guards import Action, ChannelGuard
from daq.panel import GuardPanel, GuardSet
from daq.safe_stop import SafeStop, SafeStopSettings
from daq.scaling import ScaledBlock
from daq.signals import StopRequest
from daq.stop_eyes import StopEyes
from drivers.interfaces import Stand
from drivers.profile import Profile, load_profile
from drivers.simulated.commands import Code, Command
from drivers.simulated.controller import Controller
from drivers.simulated.device import RATE_HZ
from drivers.simulated.inprocess import InProcessStand, open_in_process
from drivers.simulated.modbus_pdu import WRITE_SEVERAL
from drivers.simulated.motions import Motion, Ramp
from drivers.simulated.physics import ActuatorFacts
from drivers.simulated.virtual_link import Lost, behind_a_wire
from drivers.simulated.virtual_polling import polled_behind_a_wire
from drivers.stand_file import StandFile, load_stand
from foundation.clock import Clock
from protocols.steps import RampTo, Release

SAMPLE_STAND = Path(__file__).parents[1] / "sample_runs" / "stand.toml"
ROUND_TRIPS_S = (0.00004, 0.001, 0.002, 0.005, 0.01)
STIFFNESS_KN_PER_MM = 20.0
SPEED_MM_PER_S = 50.0
GAP_MM = 25.0
TOP_MM = 50.0
RELEASE_MM_PER_S = 20.0


class Stiff:
    """A spring without loss that warms by nothing, behind a gap: F = k (x - gap) in contact."""

    def __init__(self) -> None:
        self.force_kN = 0.0
        self.temperature_C = self.sensor_temperature_C = 21.0
        self.heat_J = 0.0

    def step(self, stroke_mm: float, dt_s: float) -> float:  # noqa: ARG002 - the interface's
        """Return the force at a stroke [kN]."""
        self.force_kN = STIFFNESS_KN_PER_MM * max(0.0, stroke_mm - GAP_MM)
        return self.force_kN

    def tangent_kN_per_mm(self, loading: bool) -> float:  # noqa: N802, ARG002 - the interface's
        """Return the stiffness [kN/mm]."""
        return STIFFNESS_KN_PER_MM


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
        if profile.poll is None:
            return behind_a_wire(opened, stand_file, lambda: round_trip_s, profile, lost), opened.clock
        return polled_behind_a_wire(opened, stand_file, lambda: round_trip_s, profile, lost)


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


class Spoiled:
    """What fails in a stop: which commands the controller takes and does not follow, what the wire loses.

    Parameters
    ----------
    deaf_to : collection of int
        Commands (:class:`drivers.simulated.commands.Code`) that it acknowledges while it goes on as before.
    loses : str
        What is lost of the first request with a hold that goes over the wire in each run: its ``request`` or
        ``reply``; empty for neither.
    """

    def __init__(self, deaf_to: Collection[int] = (), loses: Lost = "") -> None:
        self._deaf_to, self._loses = deaf_to, loses
        self._on = self._armed = False

    def spoil(self, controller: Controller) -> None:
        """Make the simulated controller deaf."""
        made = controller._motion_of

        def motion_of(command: Command) -> Motion:
            motion = made(command)
            runs = self._on and isinstance(controller._motion, Ramp)
            if command.code not in self._deaf_to or not runs:
                return motion
            going_on = Ramp(command.sequence, controller.command_mm, TOP_MM, SPEED_MM_PER_S / RATE_HZ)
            going_on.state = motion.state
            return going_on

        controller._motion_of = motion_of  # type: ignore[method-assign]

    def begin(self) -> None:
        """Let it fail from now on."""
        self._on = self._armed = True

    def end(self) -> None:
        """Let all be well again."""
        self._on = self._armed = False

    def lost(self, request: bytes) -> Lost:
        """Return what is lost of a request (function code and data)."""
        is_hold = request[0] == WRITE_SEVERAL and struct.unpack_from(">H", request, 8)[0] == Code.HOLD
        if not (self._armed and is_hold):
            return ""
        self._armed = False
        return self._loses


FAULTS = {
    "none": Spoiled(),
    "the request with the hold is lost": Spoiled(loses="request"),
    "the reply to the hold is lost": Spoiled(loses="reply"),
    "it acknowledges the hold and goes on": Spoiled((Code.HOLD,)),
    "it acknowledges hold and release and goes on": Spoiled((Code.HOLD, Code.RELEASE)),
}
"""What can fail in a stop, by its name."""


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
        """Worst peak above the trip, and how long it took at most, as two columns."""
        return f"{self.above_kN.max():.1f} kN | {self.until_s.max() * 1e3:.0f} ms"


def run_away(
    round_trip_s: float,
    action: Action,
    trips: int,
    seed: int = 1,
    kind: str = "ring",
    fault: str = "none",
) -> Runaways:
    """Let the piston run away ``trips`` times; the record of each tells how far it got."""
    random_, stand_file, spoiled = random.Random(seed), load_stand(SAMPLE_STAND), FAULTS[fault]
    opened = open_in_process(stand_file, spring=Stiff(), log_truth=False)
    stand, clock = KINDS[kind].reached(opened, stand_file, round_trip_s, spoiled.lost)
    spoiled.spoil(opened.device.controller)
    stand.controller.connect()
    rate_Hz = stand.controller.facts.rate_Hz
    own_clock = stand.controller.facts.clock == "device"
    quiet = GuardSet((), (), ControllerGuard(5.0, 5.0, rate_Hz, own_clock))
    panel = GuardPanel(quiet, wall_s=clock.wall_s())
    acquisition = Acquisition(stand, clock, panel)
    seen: list[ScaledBlock] = []
    acquisition.listeners.append(seen.append)
    driver = Driver(acquisition, StopRequest(), acquisition.tick, release_speed_mm_per_s=RELEASE_MM_PER_S)
    safe_stop = SafeStop(
        stand.controller,
        clock,
        SafeStopSettings(RELEASE_MM_PER_S, 2.0),
        pump=acquisition.tick,
        eyes=StopEyes(acquisition, stand_file.limits.force_max_kN),
    )
    found: list[tuple[float, float]] = []
    problems: list[str] = []
    safe: list[bool] = []
    for _ in range(trips):
        limit_kN = random_.uniform(100.0, 200.0)
        panel.change(quiet)
        panel.reset()
        stand.controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=2000)
        safe_stop.arm()
        driver.wait(0.3 + random_.uniform(0.0, 0.05))
        while not acquisition.up_to_date:
            acquisition.tick()
        guard = ChannelGuard("force", "force", limit_kN, None, "kN", "force", action)
        panel.change(GuardSet((guard,), (), quiet.controller))
        seen.clear()
        spoiled.begin()
        try:
            driver.perform(RampTo(TOP_MM, SPEED_MM_PER_S), TOP_MM / SPEED_MM_PER_S)
        except Halt:
            report = safe_stop.run(emergency=action is Action.EMERGENCY, seen=acquisition.latest.status)
            problems += report.problems
            safe.append(report.safe)
        found.append(_reached(seen, limit_kN))
        spoiled.end()
        if not safe[-1]:  # force is left behind the closed valve
            panel.change(quiet)
            panel.reset()
            stand.controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=2000)
            driver.perform(Release(RELEASE_MM_PER_S), TOP_MM / RELEASE_MM_PER_S)
            stand.controller.disable()
    stand.close()
    above_kN, until_s = np.array(found).T
    explained_s = KINDS[kind].explained_s(round_trip_s, rate_Hz, _lag_s(stand_file))
    bound_kN = STIFFNESS_KN_PER_MM * SPEED_MM_PER_S * explained_s
    return Runaways(round_trip_s, above_kN, until_s, bound_kN, tuple(problems), all(safe))


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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--trips", type=int, default=40)
    parser.add_argument("kind", nargs="*", default=list(KINDS), help=f"of {', '.join(KINDS)}; all without")
    given = parser.parse_args()
    print_kinds(given.kind, given.trips)
    print()
    print_faults(given.trips)


def print_kinds(kinds: Sequence[str], trips: int) -> None:
    """Print how far a runaway gets with each kind of controller, at each round trip."""
    heads = ("controller", "round trip", "bound", "emergency: above the trip", "stands after")
    print(f"| {' | '.join((*heads, 'stop: above the trip', 'stands after'))} |")
    print("|---" * 7 + "|")
    for kind in kinds:
        for round_trip_s in ROUND_TRIPS_S:
            row = f"| {kind} | {round_trip_s * 1e3:g} ms "
            if not KINDS[kind].keeps_up(round_trip_s):
                print(f"{row}| does not keep up: refused before anything moves | | | | |")
                continue
            first, second = (
                run_away(round_trip_s, action, trips, kind=kind) for action in (Action.EMERGENCY, Action.STOP)
            )
            print(f"{row}| {first.bound_kN:.1f} kN | {first.text} | {second.text} |", flush=True)


def print_faults(trips: int) -> None:
    """Print how far a runaway gets when the hold of a stop fails, at each round trip."""
    print(f"| stop | {' | '.join(f'{1e3 * round_trip_s:g} ms' for round_trip_s in ROUND_TRIPS_S)} |")
    print("|---" * (1 + len(ROUND_TRIPS_S)) + "|")
    for fault in FAULTS:
        found = (run_away(one, Action.STOP, trips, fault=fault) for one in ROUND_TRIPS_S)
        print(f"| {fault} | {' | '.join(f'{one.above_kN.max():.0f} kN' for one in found)} |", flush=True)


if __name__ == "__main__":
    main()
