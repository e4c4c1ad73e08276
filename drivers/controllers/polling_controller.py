"""A simple actuator controller without a ring: polled by an owner thread, stamped by the computer's clock.

Force and stroke of one sample are not of one instant. How far apart they are is measured, corrected by its
mean, and goes into the channels' delays and their uncertainty, into the stream's description and into events.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from bufferstand.drivers.controllers.bus_thread import Bus, BusThread
from bufferstand.drivers.controllers.poll_skew import PolledAt, SkewMeter
from bufferstand.drivers.controllers.register_controller import RegisterController
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
from bufferstand.drivers.delivery_rate import PollDelivery
from bufferstand.drivers.interfaces import ControllerStatus, Identity, SampleBlock, StreamFacts, WriterSeen
from bufferstand.drivers.modbus import ModbusLink
from bufferstand.drivers.register_maps import DTYPES, Layout, Profile, decode_value
from bufferstand.foundation import Clock, ControllerMotion, DeviceFault, Release, WireLost
from bufferstand.foundation.channels import Channel

STREAM = "controller"
STAMPING = "stroke_1"
"""Channel whose read gives a sample its time."""
TRIALS = 50
"""Polls at connect that the skew is measured by."""
SAID_S = 10.0
"""The skew is put into the run this often [s of stand time]."""
PAUSE = 5
"""A sample that comes more than this many periods after the last follows a gap; less is a late poll, whose
time stamp says so."""
KEPT = 100_000
"""Samples that wait for the reader at most."""
TIMED = 100
"""Polls by whose duration it is judged whether the wire allows the rate."""
QUICK_PERCENT = 25.0
"""Judged is by this percentile of them: a busy computer makes single ones long."""


class PollingController:
    """Controller of :mod:`bufferstand.drivers.interfaces` over one Modbus link, for a profile that polls.

    A thread of its own owns the link; the methods may be called from any one thread.

    Parameters
    ----------
    link : ModbusLink
        The wire; this object owns it.
    profile : Profile
        The register map, with a table ``[poll]``.
    channels : sequence of Channel
        Calibrations of the raw registers.
    clock : Clock
        Stand time, for the stamps.
    timeout_s : float
        Longest wait for the controller to judge a command or change its state [s].
    bus : callable
        Makes the owner of the link, of what makes one poll, the period [s] and the clock.
    board : NoticeBoard, optional
        Where it is posted on this computer who gives commands.

    Raises
    ------
    ValueError
        If the profile does not poll.
    """

    facts: StreamFacts

    def __init__(
        self,
        link: ModbusLink,
        profile: Profile,
        channels: Sequence[Channel],
        clock: Clock,
        *,
        timeout_s: float = 0.5,
        bus: Callable[[Callable[[int], None], float, Clock], Bus] = BusThread,
        board: NoticeBoard | None = None,
    ) -> None:
        if profile.poll is None:
            raise ValueError(f"profile “{profile.facts.id}” does not poll")
        self._poll = profile.poll
        self._link = link
        self._profile = profile
        self._clock = clock
        self._inner = RegisterController(link, profile, timeout_s=timeout_s, board=board)
        by_name = {channel.name: channel for channel in channels}
        self._channels = tuple(by_name[name] for read in self._poll.reads for name in read)
        self._blocks = [profile.span([f"raw_{name}" for name in read]) for read in self._poll.reads]
        self._meter = SkewMeter(self._poll.reads, STAMPING)
        self._bus = bus(self._poll_slot, 1.0 / self._poll.rate_Hz, clock)
        self._lock = threading.Lock()
        self._samples: deque[tuple[int, int, dict[str, float | int]]] = deque(maxlen=KEPT)
        self._fault: DeviceFault | None = None
        self._next: int | None = None
        self._took_s: deque[float] = deque(maxlen=TIMED)
        self._without = 0
        self._last_slot: int | None = None
        self._number = 0
        self._said_s = -math.inf
        device = f"{profile.facts.id} at {link.address}"
        self.facts = StreamFacts(STREAM, "host", self._channels, self._poll.rate_Hz, device)

    def connect(self) -> Identity:
        """Open the wire, check identity and test values, measure the skew, and begin to poll.

        Calling it again checks again; the skew is measured once.

        Raises
        ------
        DeviceFault
            If nobody answers, or what answers is not what the profile describes.
        """
        return self._bus.call(self._connect)

    def _connect(self) -> Identity:
        identity = self._inner.identify()
        if not len(self._meter):
            for _ in range(TRIALS):
                _, polled = self._read_all()
                self._meter.add(polled)
            self._state_skew(identity)
            self._said_s = self._clock.now_s()
            self._bus.begin()
        return identity

    def _state_skew(self, identity: Identity) -> None:
        """Put what was measured into the channels and the stream's description."""
        skews = self._meter.skews()
        channels = []
        for channel in self._channels:
            skew = skews[channel.name]
            declared = channel.uncertainty.u_delay_s or 0.0
            uncertainty = channel.uncertainty.model_copy(update={"u_delay_s": math.hypot(declared, skew.u_s)})
            # A value is true at its stamp minus its delay; this one was read by the mean after the stamp.
            delay_s = channel.delay_s - skew.mean_s
            channels.append(channel.model_copy(update={"delay_s": delay_s, "uncertainty": uncertainty}))
        self._channels = tuple(channels)
        text = self._meter.text(self._poll.rate_Hz)
        self._link.note(text)
        facts = self._profile.facts
        device = (
            f"{facts.id} edition {facts.edition} at {self._link.address}, serial {identity.serial}; {text}"
        )
        self.facts = StreamFacts(STREAM, "host", self._channels, self._poll.rate_Hz, device)

    def skip_backlog(self, *, anew: bool = False) -> None:
        """Do nothing: polling began with the connection."""

    def read_block(self) -> SampleBlock | None:
        """Get the samples that have been polled since the last call (None where there are none).

        Samples are stamped when they were polled, which may be late. A pause longer than ``PAUSE`` periods
        is a gap, and the polls that it lacks are counted as lost.

        Raises
        ------
        DeviceFault
            If polling failed since the last call; samples from before it come first.
        """
        with self._lock:
            rows: list[tuple[int, int, dict[str, float | int]]] = []
            while self._samples and (not rows or self._samples[0][0] == rows[-1][0] + 1):
                rows.append(self._samples.popleft())
            fault = None
            if not rows:
                fault, self._fault = self._fault, None
        if fault is not None:
            raise fault
        if not rows:
            return None
        first = rows[0][0]
        lost = 0 if self._next is None else first - self._next
        self._next = rows[-1][0] + 1
        counts = {
            place.name.removeprefix("raw_"): np.array(
                [row[2][place.name] for row in rows], dtype=DTYPES[place.kind]
            )
            for block in self._blocks
            for place in block.places
        }
        time_us = np.array([row[1] for row in rows], dtype=np.int64)
        return SampleBlock(STREAM, first, time_us, counts, lost, self._clock.now_s())

    def delivery(self) -> PollDelivery | None:
        """Return what was measured of the polls made last, at connect to begin with; None before that."""
        if not self._took_s:
            return None
        poll_s = float(np.percentile(self._took_s, QUICK_PERCENT))
        return PollDelivery(len(self._blocks), max(poll_s, 1e-6), self._poll.rate_Hz)

    def _poll_slot(self, slot: int) -> None:
        """Make one poll; called by the bus thread."""
        try:
            values, polled = self._read_all()
        except DeviceFault as fault:
            with self._lock:
                self._fault = fault
            return
        if max(polled.middle_s) - min(polled.middle_s) > 1.0 / self._poll.rate_Hz:
            return
        self._meter.add(polled)
        stamp_us = round(polled.middle_s[self._meter.stamp_index] * 1e6)
        with self._lock:
            self._samples.append((self._numbered(slot), stamp_us, values))
        now_s = self._clock.now_s()
        if now_s - self._said_s >= SAID_S:
            self._said_s = now_s
            without = f"; {self._without} of {slot + 1} periods without a sample since polling began"
            self._link.note(self._meter.text(self._poll.rate_Hz) + (without if self._without else ""))

    def _numbered(self, slot: int) -> int:
        """Return the sequence number of the sample of a slot."""
        last, self._last_slot = self._last_slot, slot
        if last is not None:
            missed = slot - last - 1
            self._without += missed
            self._number += 1 + (missed if missed >= PAUSE else 0)
        return self._number

    def _read_all(self) -> tuple[dict[str, float | int], PolledAt]:
        """Read each group of channels once.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        values: dict[str, float | int] = {}
        middles: list[float] = []
        trips: list[float] = []
        for block in self._blocks:
            sent_s = self._clock.now_s()
            registers = self._link.read(block.address, block.words, "momentary values", table=block.table)
            here_s = self._clock.now_s()
            values |= _counts(block, registers)
            middles.append(0.5 * (sent_s + here_s))
            trips.append(here_s - sent_s)
        self._took_s.append(sum(trips))
        return values, PolledAt(tuple(middles), tuple(trips))

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot.

        Raises
        ------
        DeviceFault
            If the wire fails, or the state is none that the profile knows.
        """
        return self._bus.call(self._inner.status)

    def says_simulated(self) -> bool:
        """Return whether the controller says of itself that it is a simulated one.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._bus.call(self._inner.says_simulated)

    def other_writer(self) -> int | None:
        """Return the number of another program that may give commands; 0 for none, None without a lock.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._bus.call(self._inner.other_writer)

    def seen_writer(self) -> WriterSeen:
        """Get who else may give commands, and what tells whether that program lives; nothing is written.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._bus.call(self._inner.seen_writer)

    @property
    def in_charge(self) -> bool:
        """Whether this program has the right to give commands, as far as it knows."""
        return self._inner.in_charge

    def look_at_lock(self) -> None:
        """See that the right to give commands is still this program's.

        Raises
        ------
        NotInCharge
            If it is not; DeviceFault if the wire fails.
        """
        self._bus.call(self._inner.look_at_lock)

    def take_charge(self) -> None:
        """Take the right to give commands as at a start, also where it was lost; nothing is switched.

        Raises
        ------
        DeviceFault
            If another program has it, or the wire fails.
        """
        self._bus.call(self._inner.take_charge)

    def changed_limits(self) -> str:
        """Return which limits are no longer those that were set; empty where all are kept.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        return self._bus.call(self._inner.changed_limits)

    def give_back(self) -> None:
        """Let another program give commands.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        self._bus.call(self._inner.give_back)

    def feed_watchdog(self) -> None:
        """Write the heartbeat.

        Raises
        ------
        NotInCharge
            If this program has not the right to give commands; DeviceFault if the wire fails.
        """
        self._bus.call(self._inner.feed_watchdog)

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog and switch the actuator on (it holds).

        Raises
        ------
        CommandRejected, DeviceFault
            As :meth:`bufferstand.drivers.controllers.register_controller.RegisterController.enable`.
        """
        self._bus.call(
            lambda: self._inner.enable(
                force_limit_kN=force_limit_kN, stroke_limit_mm=stroke_limit_mm, watchdog_ms=watchdog_ms
            )
        )

    @property
    def stops_at_once(self) -> bool:
        """Whether a hold takes a single request."""
        return self._inner.stops_at_once

    taken_us = None
    """Samples are stamped by the computer's clock."""

    def look_between(
        self,
        look: Callable[[], object],  # noqa: ARG002
        outlast: Callable[[WireLost], object] | None = None,  # noqa: ARG002
    ) -> AbstractContextManager[None]:
        """Do nothing: no polled sample waits for the wire."""
        return nullcontext()

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:
        """Begin a motion; get its sequence number.

        Raises
        ------
        CommandRejected, DeviceFault
            As :meth:`bufferstand.drivers.controllers.register_controller.RegisterController.start`.
        """
        return self._bus.call(lambda: self._inner.start(motion, hurry=hurry))

    @property
    def can_adjust(self) -> bool:
        """Whether it can change a running sine."""
        return self._inner.can_adjust

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        """Bring the running sine to another mean and amplitude over one cycle.

        Raises
        ------
        CommandRejected, DeviceFault
            As :meth:`bufferstand.drivers.controllers.register_controller.RegisterController.adjust_harmonic`.
        """
        self._bus.call(lambda: self._inner.adjust_harmonic(mean_mm=mean_mm, amplitude_mm=amplitude_mm))

    def prepare(self, release: Release) -> None:
        """Have a release armed, so that starting it takes a single request.

        Raises
        ------
        CommandRejected
            If the controller refuses; DeviceFault if the wire fails.
        """
        self._bus.call(lambda: self._inner.prepare(release))

    def reset_fault(self) -> None:
        """Reset a latched fault, where there is one; the valve stays off.

        Raises
        ------
        DeviceFault
            As :meth:`bufferstand.drivers.controllers.register_controller.RegisterController.reset_fault`.
        """
        self._bus.call(self._inner.reset_fault)

    def disable(self) -> None:
        """Switch the actuator's valve off, and see that it is; the right to give commands is kept.

        Raises
        ------
        NotInCharge
            If this program has not that right; DeviceFault if the wire fails or the actuator stays on.
        """
        self._bus.call(self._inner.disable)

    def events(self) -> Sequence[str]:
        """Get (and forget) what happened on the wire since the last call, and what the polling costs."""
        return self._link.events()

    def close(self) -> None:
        """Stop polling and let go of the wire; never raises."""
        self._bus.close()
        self._link.close()


def _counts(block: Layout, registers: Sequence[int]) -> dict[str, float | int]:
    return {
        place.name: decode_value(
            registers[place.offset : place.offset + place.words],
            place.kind,
            place.word_order or block.word_order,
        )
        for place in block.places
    }
