"""The acquisition: one loop in one thread owns the controller, sees every sample and feeds the watchdog.

Sensors read in threads of their own; here they are only drained, so that no slow bus can stall a pass.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from daq.blocks import join_blocks
from daq.clock_guard import HostMemory, evaluate_host
from daq.guards import Action, Trip
from daq.panel import CONTROLLER_STREAM, GuardPanel
from daq.plausibility_guard import PlausibilityGuard
from daq.recorder_guard import RecorderGuard, Recording
from daq.scaling import ScaledBlock, scale
from drivers.interfaces import ControllerStatus, SampleBlock, SensorFault, Stand
from foundation.channel import Branch
from foundation.clock import Clock
from foundation.errors import DeviceFault


class Recorder(Recording, Protocol):
    """Where the raw blocks of a run go (:class:`recording.writer.RunRecorder`)."""

    def append(
        self,
        stream: str,
        sequence: int,
        time_us: NDArray[np.int64],
        counts: Mapping[str, NDArray[Any]],
        lost: int = 0,
    ) -> None:
        """Queue a block; never blocks on the disk."""
        ...

    def anchor(self, device_us: int, host_s: float, utc: str) -> None:
        """Queue a pair of the device's and the host's clock."""
        ...

    def event(self, at_s: float, kind: str, text: str, **data: Any) -> None:
        """Queue an event."""
        ...

    def close(self, status: str, reason: str = "") -> Path:
        """End and seal the run; return its file."""
        ...


@dataclass(frozen=True)
class Pace:
    """How the loop is paced.

    Parameters
    ----------
    tick_s : float
        From the beginning of a pass to that of the next [s of stand time].
    blocks_per_tick : int
        So many blocks at most in one pass, so that sensors, guards and watchdog always get their turn.
    feed_s : float
        The watchdog is fed this often [s of the wall].
    anchor_s : float
        A clock anchor is recorded this often [s of stand time].
    """

    tick_s: float = 0.02
    blocks_per_tick: int = 64
    feed_s: float = 0.25
    anchor_s: float = 1.0


@dataclass(frozen=True)
class Latest:
    """The newest values of everything, for progress and for waiting.

    Parameters
    ----------
    at_s : float
        Host stand time of the pass [s].
    device_s : float or None
        Newest time stamp of the controller [s of its clock].
    values : mapping of str to float
        Newest value of every channel and derived signal, in the unit of its name.
    status : ControllerStatus or None
        The last snapshot.
    samples, lost : int
        Samples of the controller seen and lost since the start.
    """

    at_s: float
    device_s: float | None
    values: Mapping[str, float]
    status: ControllerStatus | None
    samples: int
    lost: int


class Acquisition:
    """Reads everything a stand delivers, pass by pass, hands it to guards and recorder.

    Parameters
    ----------
    stand : Stand
        The opened stand; nobody else may talk to its controller meanwhile.
    clock : Clock
        Stand time.
    panel : GuardPanel
        Sees every block, fault, status and silence.
    pace : Pace
        How often.
    utc : callable
        Gives the civil time of an anchor (ISO 8601).
    civil_s : callable
        The civil time [s], to say when it was set.
    """

    def __init__(
        self,
        stand: Stand,
        clock: Clock,
        panel: GuardPanel,
        *,
        pace: Pace | None = None,
        utc: Callable[[], str] = lambda: datetime.now(UTC).isoformat(),
        civil_s: Callable[[], float] = time.time,
    ) -> None:
        self.stand = stand
        self.clock = clock
        self.panel = panel
        self.pace = pace or Pace()
        self._utc = utc
        self._facts = {stand.controller.facts.name: stand.controller.facts} | {
            sensor.facts.name: sensor.facts for sensor in stand.sensors
        }
        self._branches = {
            channel.name: Branch() for facts in self._facts.values() for channel in facts.channels
        }
        self._plausibility = PlausibilityGuard(stand.controller.facts)
        self._recorder: Recorder | None = None
        self._recording = RecorderGuard(panel.guards.disk_stop_s)
        self._civil_s = civil_s
        self._host = HostMemory(civil_s(), time.monotonic())
        self._values: dict[str, float] = {}
        self._status: ControllerStatus | None = None
        self._device_us: int | None = None
        self._samples = self._lost = 0
        self._drained = False
        self.feeding = True
        """Whether a pass feeds the controller's watchdog."""
        self._fed_s = -np.inf
        self._anchor: tuple[int, float] | None = None
        self._anchor_due_s = -np.inf
        self._pass_began_s = clock.now_s()
        self._aside: list[str] = []
        self.listeners: list[Callable[[ScaledBlock], object]] = []
        """Get every block of the controller, scaled; they must be quick."""
        self.observers: list[Callable[[ScaledBlock], object]] = []
        """Get every block of every stream, scaled, after it was judged; they must be quick."""
        self._last_aside = ""

    @property
    def latest(self) -> Latest:
        """Return the newest values."""
        device_s = None if self._device_us is None else self._device_us / 1e6
        return Latest(
            self.clock.now_s(), device_s, dict(self._values), self._status, self._samples, self._lost
        )

    def attach(self, recorder: Recorder) -> None:
        """Record from now on, beginning with a clock anchor."""
        self._recorder = recorder
        self._recording.begin()
        self._anchor, self._anchor_due_s = None, -np.inf

    def detach(self) -> Recorder | None:
        """Record no longer; return the recorder, which is not closed."""
        recorder, self._recorder = self._recorder, None
        return recorder

    @property
    def recorder(self) -> Recorder | None:
        """Return the recorder of the run under way."""
        return self._recorder

    @property
    def drained(self) -> bool:
        """Return whether the last pass came to the end of the ring: nothing sampled before it is unread."""
        return self._drained

    def say(self, kind: str, text: str, **data: object) -> None:
        """Put an event into the run under way; where there is none, devices' words are kept to be shown."""
        if self._recorder is not None:
            self._recorder.event(self.clock.now_s(), kind, text, **data)
        elif kind in ("wire", "sensor") and text != self._last_aside:
            self._last_aside = text
            self._aside.append(text)

    def unrecorded(self) -> list[str]:
        """Return (and forget) what devices said while nothing was recorded."""
        aside, self._aside = self._aside, []
        return aside

    def tick(self) -> list[Trip]:
        """Make one pass: feed, read, drain, record, judge.

        Returns
        -------
        list of Trip
            What guards said in this pass; the latch is in ``panel``.

        Notes
        -----
        A fault of the controller or its wire does not come out as an exception: it is latched as a trip
        of the guard ``controller``, like every other reason to stop.
        """
        self._pass_began_s = self.clock.now_s()
        try:
            self._feed()
            self._read_controller()
            self._judge_status()
        except DeviceFault as fault:
            self.panel.latch(
                Trip(
                    "controller",
                    Action.EMERGENCY,
                    f"the controller or its wire failed: {fault}",
                    self.clock.now_s(),
                    device_fault=True,
                )
            )
        self._drain_sensors()
        self._check_recorder()
        self._look_at_host()
        self.panel.listen(self.clock.now_s(), self.clock.wall_s())
        said = self.panel.said()
        for trip in said:
            self.say("note" if trip.action is Action.NOTE else "trip", trip.reason, **trip.facts())
        return said

    def rest(self) -> None:
        """Wait until the next pass is due: passes begin every ``tick_s``, however long they take.

        A quarter of it is waited in any case, for the threads that read sensors and write the journal.
        """
        passed_s = self.clock.now_s() - self._pass_began_s
        self.clock.sleep(max(0.25 * self.pace.tick_s, self.pace.tick_s - passed_s))

    def _feed(self) -> None:
        wall_s = self.clock.wall_s()  # the watchdog counts real seconds, however fast a simulated stand runs
        if self.feeding and wall_s - self._fed_s >= self.pace.feed_s:
            self.stand.controller.feed_watchdog()
            self._fed_s = wall_s

    def _read_controller(self) -> None:
        """Read until the ring is drained, with a bound, so that the rest gets its turn."""
        self._drained = False
        blocks: list[SampleBlock] = []
        try:
            for _ in range(self.pace.blocks_per_tick):
                block = self.stand.controller.read_block()
                if block is None:
                    self._drained = True
                    break
                blocks.append(block)
            self.panel.keep_up(drained=self._drained, at_s=self.clock.now_s(), wall_s=self.clock.wall_s())
        finally:
            for joined in join_blocks(blocks):  # what was read before a fault is kept, too
                self._take(joined)
        self._record_anchor()
        for text in self.stand.controller.events():
            self.say("wire", text)

    def _judge_status(self) -> None:
        self._status = self.stand.controller.status()
        self.panel.judge(self._status, self.clock.now_s(), self.clock.wall_s())

    def _drain_sensors(self) -> None:
        for sensor in self.stand.sensors:
            for item in sensor.drain():
                if isinstance(item, SensorFault):
                    self.panel.complain(item)
                    self.say("sensor", f"{item.stream}: {item.what}", stream=item.stream)
                else:
                    self._take(item)

    def _take(self, block: SampleBlock) -> None:
        """Record first, judge second: the sample that trips is in the run."""
        if self._recorder is not None:
            self._recorder.append(block.stream, block.first_sequence, block.time_us, block.counts, block.lost)
        scaled = scale(block, self._facts[block.stream], self._branches)
        if block.stream == CONTROLLER_STREAM:
            for trip in self._plausibility.look(block, scaled):
                self.panel.latch(trip)
            for listener in self.listeners:
                listener(scaled)
            self._samples += len(scaled)
            self._lost += block.lost
            self._keep_anchor(scaled)
        if len(scaled):
            self._values.update((name, float(value[-1])) for name, value in scaled.values.items())
        self.panel.observe(scaled, self.clock.wall_s())
        for observer in self.observers:
            observer(scaled)

    def _keep_anchor(self, block: ScaledBlock) -> None:
        """Keep the pair with the least delay on the wire."""
        if not len(block):
            return
        self._device_us = int(block.time_us[-1])
        pair = (self._device_us, block.received_s)
        if self._anchor is None or _delay_s(pair) < _delay_s(self._anchor):
            self._anchor = pair

    def _record_anchor(self) -> None:
        """Record the best pair of the interval that ends; called when the ring is drained."""
        now_s = self.clock.now_s()
        if self._recorder is not None and self._anchor is not None and now_s >= self._anchor_due_s:
            self._recorder.anchor(*self._anchor, self._utc())
            self._anchor, self._anchor_due_s = None, now_s + self.pace.anchor_s

    def _check_recorder(self) -> None:
        if self._recorder is None:
            return
        for trip in self._recording.look(self._recorder, self.clock.now_s()):
            self.panel.latch(trip)

    def _look_at_host(self) -> None:
        self._host, said = evaluate_host(self._host, self._civil_s(), time.monotonic(), self.clock.now_s())
        for trip in said:
            self.panel.latch(trip)


def _delay_s(pair: tuple[int, float]) -> float:
    """Return host minus device time of a pair [s]: smaller by less delay."""
    return pair[1] - pair[0] / 1e6
