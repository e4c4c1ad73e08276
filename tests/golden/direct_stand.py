"""The stand of the golden runs: its machine is asked directly, without registers, driver or wire.

The golden run files are older than the wire in memory behind which ``open_in_process`` puts the controller.
Over a wire a command takes several round trips and its figures have 32 bits: each sample after it differs.
So these runs stay on the machine itself, and show that nothing behind the drivers has changed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace

import numpy as np

from bufferstand.drivers.controllers.cycle_gaps import missed_cycles, parted
from bufferstand.drivers.interfaces import (
    ControllerStatus,
    Identity,
    SampleBlock,
    Stand,
    StreamFacts,
    WriterSeen,
)
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.machine.commands import Command, CommandCode, RejectReason
from bufferstand.drivers.simulated.machine.device import RATE_HZ
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.motions import (
    ControllerMotion,
    Harmonic,
    RampTo,
    Release,
    StandStill,
    StaticCycles,
)

BLOCK = 1000
CODES: dict[type[ControllerMotion], CommandCode] = {
    StandStill: CommandCode.HOLD,
    RampTo: CommandCode.RAMP,
    Harmonic: CommandCode.HARMONIC,
    StaticCycles: CommandCode.STATIC,
    Release: CommandCode.RELEASE,
}
IDENTITY = Identity("simulated controller", "in process", "1", "none (in process)", RATE_HZ)


class DirectController:
    """A controller that does what it is told, in one round trip; nothing ever fails."""

    in_charge = stops_at_once = True

    def __init__(self, opened: InProcessStand, stand_file: StandFile) -> None:
        self._device, self._clock = opened.device, opened.clock
        self._machine = opened.device.controller
        self._next = self._feeds = 0
        self._last_us: int | None = None
        self._parts: deque[SampleBlock] = deque()
        self.can_adjust = self._machine.capabilities.adjusts
        self.facts = StreamFacts(
            "controller", "device", stand_file.controller.channel, RATE_HZ,
            "simulated controller, in process", simulated=True,
        )  # fmt: skip

    @contextmanager
    def _asking(self) -> Iterator[None]:
        self._clock.sleep(self._device.latency.way_s())
        yield
        self._clock.sleep(self._device.latency.way_s())

    def connect(self) -> Identity:
        with self._asking():
            return IDENTITY

    def skip_backlog(self, *, anew: bool = False) -> None:  # noqa: ARG002
        self._next = max(self._next, self._device.ring.total - BLOCK)

    def read_block(self) -> SampleBlock | None:
        if self._parts:
            return self._parts.popleft()
        with self._asking():
            first, columns = self._device.ring.window(self._next, BLOCK)
        count = columns.pop("tick").size
        if count == 0:
            return None
        lost, self._next = first - self._next, first + count
        time_us = self._device.time_us(np.arange(first, self._next, dtype=np.int64))
        period_us = 1e6 / RATE_HZ
        last_us = int(time_us[0]) - period_us * (lost + 1) if self._last_us is None else self._last_us
        steps = np.diff(time_us, prepend=last_us + lost * period_us)
        self._last_us = int(time_us[-1])
        rows = np.flatnonzero(np.abs(steps - period_us) > 0.5 * period_us).tolist()
        missed = [(row, missed_cycles(float(steps[row]), period_us) or 0) for row in rows]
        now_s = self._clock.now_s()
        block = SampleBlock("controller", first, time_us, columns, lost, now_s, more=count == BLOCK)
        head, *rest = parted(block, missed)
        self._parts.extend(rest)
        return head

    def status(self) -> ControllerStatus:
        machine, device = self._machine, self._device
        with self._asking():
            return ControllerStatus(
                state=machine.state,
                fault_code=int(machine.fault),
                done_sequence=machine.done_sequence,
                end_reason=machine.end_reason,
                cycles_done=machine.cycles_done,
                heartbeat=device.heartbeat,
                watchdog_trips=machine.watchdog.trips,
                force_kN=device.measured_force_kN,
                stroke_mm=device.measured_stroke_mm,
                position_mm=device.actuator.position_mm,
                command_mm=machine.command_mm,
                tick_us=self.taken_us,
            )

    def feed_watchdog(self) -> None:
        with self._asking():
            self._feeds += 1
            self._machine.watchdog.feed(self._feeds & 0xFFFF)

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        with self._asking():
            assert self._machine.set_force_limit(force_limit_kN)
            assert self._machine.set_stroke_limit(stroke_limit_mm)
        self._machine.watchdog.set_time(watchdog_ms)
        self.feed_watchdog()
        self.reset_fault()
        self.status()
        self._machine.control(0x000F)

    def reset_fault(self) -> None:
        with self._asking():
            assert not self._machine.fault

    @property
    def taken_us(self) -> int:
        return self._device.tick_us(self._clock.now_s())

    @contextmanager
    def look_between(self, look: Callable[[], object], outlast: object = None) -> Iterator[None]:  # noqa: ARG002
        yield

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:  # noqa: ARG002
        figures = asdict(motion)
        if isinstance(motion, StaticCycles):
            figures["turning_force_kN"] = figures.pop("force_limit_kN")
            figures["turning_stroke_mm"] = figures.pop("stroke_limit_mm")
        return self._give(CODES[type(motion)], **figures)

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        self._give(CommandCode.ADJUST, mean_mm=mean_mm, amplitude_mm=amplitude_mm)

    def _give(self, code: CommandCode, **figures: float) -> int:
        sequence = self._machine.echo_sequence % 0xFFFF + 1
        command = Command(sequence, int(code), **figures)  # type: ignore[arg-type]
        with self._asking():
            assert self._machine.arm(command) is RejectReason.ACCEPTED
            assert self._machine.execute(sequence) is RejectReason.ACCEPTED
        return sequence

    def disable(self) -> None:
        with self._asking():
            self._machine.control(0x0000)

    def says_simulated(self) -> bool:
        return True

    def seen_writer(self) -> WriterSeen:
        return WriterSeen(None)

    def changed_limits(self) -> str:
        return ""

    def events(self) -> Sequence[str]:
        return []

    def prepare(self, release: Release) -> None:
        pass

    def delivery(self) -> None:
        pass

    other_writer = look_at_lock = take_charge = give_back = close = delivery


def open_direct(stand_file: StandFile) -> InProcessStand:
    """Return the simulated stand with its machine asked directly."""
    opened = open_in_process(stand_file)
    return replace(opened, stand=Stand(DirectController(opened, stand_file), opened.stand.sensors))
