"""A Modbus device behind a description: polled in a thread of its own, every missed poll a counted gap.

A value is stamped with the middle between the first request and the last reply that its scan needed; it was
true at some instant between them, so that half of that time is how far the stamp may be off. A poll that took
longer than the stand file allows, was repeated, or was refused, is a gap: nothing is carried over or guessed.
"""

from __future__ import annotations

import math
import socket
import threading
from collections import deque
from collections.abc import Sequence

import numpy as np

from bufferstand.drivers.acquisition.claim import claim
from bufferstand.drivers.acquisition.modbus_io.description import Description, Expected, IoType
from bufferstand.drivers.acquisition.modbus_io.points import Place, Point
from bufferstand.drivers.acquisition.modbus_io.reads import Image, Read, planned_reads
from bufferstand.drivers.acquisition.modbus_io.settings import ModbusIoSettings
from bufferstand.drivers.interfaces import ClockReading, SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.modbus import ModbusLink, ModbusRefusal
from bufferstand.drivers.register_maps import decode_value
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import PlausibilityWatch

_POLL_S = 0.001
_RETRY_S = 0.1
"""So often a device is tried that does not answer, where polls come faster [s]."""
_AGAIN_S = 10.0
"""Late polls are told at most so often [s of the wall]; every one is a counted gap."""
_TIMED = 500
"""Polls whose duration is remembered."""


class ModbusIoDriver:
    """:class:`bufferstand.drivers.acquisition.AcquisitionDevice`: points of a description, polled.

    Parameters
    ----------
    link : ModbusLink
        This object owns it; nothing is ever written to it.
    settings : ModbusIoSettings
    found : Description
    points : sequence of Point
        Of the inputs, in their order.
    clock : Clock
        Stand time for stamps, wall time for waits.
    stream : str
        What its samples are called.
    """

    facts: StreamFacts
    can_ask_for_stop = False
    stop_asked = False

    def __init__(
        self,
        link: ModbusLink,
        settings: ModbusIoSettings,
        found: Description,
        points: Sequence[Point],
        clock: Clock,
        stream: str,
    ) -> None:
        self._settings, self._description, self._points = settings, found, tuple(points)
        self._clock, self._link = clock, link
        device = f"{found.title}, description {found.id} edition {found.edition}"
        units = {one.channel.name: point.unit for one, point in zip(settings.input, points, strict=True)}
        self.facts = StreamFacts(stream, "host", settings.channels, settings.rate_Hz, device, raw_units=units)
        self.identity = ""
        bounds = {"most_registers": found.most_registers, "bridge": found.bridge}
        self._value_reads, self._status_reads = scan_reads(self._points, **bounds)
        self._period_s = 1.0 / settings.rate_Hz
        self._mailbox = Mailbox()
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        self._claim: socket.socket | None = None
        self._watches = [
            PlausibilityWatch(channel, self.facts.raw_unit(channel.name)) for channel in self.facts.channels
        ]
        self._wrong: set[str] = set()
        self._half_s: deque[float] = deque(maxlen=_TIMED)
        self._sequence = self._missed = 0
        self._due_s = 0.0
        self._last_us = -1
        self._failing = False
        self._late_told_s = -math.inf

    def clock_readings(self) -> Sequence[ClockReading]:
        """Return none: its values are stamped by this computer."""
        return ()

    def ask_for_stop(self, reason: str) -> None:
        """Do nothing: nothing is ever written to such a device."""
        del reason

    @property
    def described(self) -> dict[str, object]:
        """The description that its values were made by, for the run file."""
        content: dict[str, object] = self._description.model_dump(mode="json", exclude_defaults=True)
        return content

    @property
    def stamp_note(self) -> str:
        """How far the stamps of late are off, in words; empty before the first poll."""
        if not self._half_s:
            return ""
        median_ms, most_ms = 1e3 * float(np.median(self._half_s)), 1e3 * max(self._half_s)
        return (
            f"each value is stamped with the middle of its poll: ± {median_ms:.2g} ms (median), "
            f"± {most_ms:.2g} ms at most; polls beyond ± {1e3 * self._settings.stamp_half_s:.3g} ms are gaps"
        )

    def start(self) -> None:
        """Connect, see that it is the described device, and begin to poll; does nothing if it polls already.

        Raises
        ------
        DeviceFault
            If it does not answer, is another one, or does not have a point.
        """
        if self._thread is not None:
            return
        self._claim = claim(f"modbus-io {self._link.address}", self._name)
        try:
            self._recognise()
            self._poll_all()  # a point that it does not have is said now, not as a gap
        except DeviceFault as fault:
            self._let_go()
            raise self._explained(fault) from None
        finally:
            self._tell_events()
        self.identity = f"{self._description.title} at {self._link.address}"
        self._failing = False
        self._half_s.clear()
        self._end.clear()
        self._due_s = self._clock.now_s()
        self._thread = threading.Thread(target=self._run, name=self.facts.name, daemon=True)
        self._thread.start()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        return self._mailbox.take()

    def close(self) -> None:
        """Stop polling and let go of the wire; never raises."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)
            self._thread = None
        self._let_go()

    # --- who it is -----------------------------------------------------------------------------------

    def _recognise(self) -> None:
        for expected in self._description.identity:
            got = expected_content(self._link, expected)
            if (what := mismatch(expected, got)) != "":
                raise DeviceFault(f"{self._name}: it is not “{self._description.id}”: {what}")

    def _explained(self, fault: DeviceFault) -> DeviceFault:
        if not isinstance(fault, ModbusRefusal):
            return fault
        return DeviceFault(
            f"{fault}; the description “{self._description.id}” has it there: is it this device, and is "
            "device_id right? bufferstand instruments --probe says what would fit"
        )

    # --- the thread ----------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._end.is_set():
            if self._clock.now_s() < self._due_s:
                self._end.wait(_POLL_S)
                continue
            try:
                self._poll_once()
            except DeviceFault as fault:
                self._missed += 1
                events = self._link.events()
                if self._failing:  # told once, not with every poll of an outage
                    self._end.wait(_RETRY_S)
                else:
                    for text in (*(f"{self._name}: {one}" for one in events), str(fault)):
                        self._fault(text)
                self._failing = True
            self._due_s += self._period_s
            self._skip_missed(self._clock.now_s())

    def _poll_once(self) -> None:
        """Poll, and hand a row over; or count a gap."""
        image, began_s, ended_s = self._poll_all()
        repeated = self._link.events()
        for text in repeated:
            self._fault(f"{self._name}: {text}")
        self._failing = False
        half_s = 0.5 * (ended_s - began_s)
        late = half_s > self._settings.stamp_half_s
        if late or repeated:
            self._missed += 1
        else:
            self._half_s.append(half_s)
            self._post(image, 0.5 * (began_s + ended_s))
        self._tell_late(half_s if late else None)

    def _skip_missed(self, now_s: float) -> None:
        """Count the polls whose turn has passed."""
        missed = max(0, math.floor((now_s - self._due_s) / self._period_s))
        self._missed += missed
        self._due_s += missed * self._period_s

    def _poll_all(self) -> tuple[Image, float, float]:
        """Return what every request brought, and when those of the values began and ended [s]."""
        image = Image()
        began_s = self._clock.now_s()
        for read in self._value_reads:
            image.take(read, read.ask(self._link, "values"))
        ended_s = self._clock.now_s()
        for read in self._status_reads:
            image.take(read, read.ask(self._link, "status"))
        return image, began_s, ended_s

    def _post(self, image: Image, at_s: float) -> None:
        time_us = np.array([max(round(at_s * 1e6), self._last_us + 1)], dtype=np.int64)
        columns: dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]] = {}
        wrong: dict[str, str] = {}
        for point, channel, watch in zip(self._points, self.facts.channels, self._watches, strict=True):
            reading = point.read(image.at((*point.value_places, *point.status_places)))
            column = np.array([reading.value])
            columns[channel.name] = column
            for text in reading.what:
                wrong[text] = f"{channel.name}: {text}"
            if math.isfinite(reading.value):
                for one in watch.look(time_us, column, channel.calibration.apply(column)):
                    wrong.setdefault(f"{channel.name} {one.kind}", one.what)
        lost, self._missed = (self._missed if self._sequence else 0), 0
        self._sequence += lost
        name = self.facts.name
        self._mailbox.put(SampleBlock(name, self._sequence, time_us, columns, lost, self._clock.now_s()))
        self._sequence += 1
        self._last_us = int(time_us[0])
        for key, text in wrong.items():
            if key not in self._wrong:
                self._fault(f"{self._name}: {text}")
        self._wrong = set(wrong)

    def _tell_late(self, half_s: float | None) -> None:
        """Say that replies come late, at most every so often."""
        now_s = self._clock.wall_s()
        if half_s is not None and now_s - self._late_told_s >= _AGAIN_S:
            self._late_told_s = now_s
            self._fault(
                f"{self._name}: a poll took {2e3 * half_s:.3g} ms, its values could be off by half of that "
                f"(stamp_within_s = {self._settings.stamp_half_s:g}): a gap; look at the network, the "
                "device's load, or write a smaller rate_Hz"
            )

    # --- the rest ------------------------------------------------------------------------------------

    def _let_go(self) -> None:
        self._link.close()
        if self._claim is not None:
            self._claim.close()
            self._claim = None

    @property
    def _name(self) -> str:
        return f"{self.facts.name} at {self._link.address}"

    def _tell_events(self) -> None:
        for text in self._link.events():
            self._fault(f"{self._name}: {text}")

    def _fault(self, what: str) -> None:
        self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), what))


def scan_reads(
    points: Sequence[Point], *, most_registers: int, bridge: int
) -> tuple[tuple[Read, ...], tuple[Read, ...]]:
    """Return the requests of a poll: those that bring values, then those that bring only what is left.

    Parameters
    ----------
    points : sequence of Point
    most_registers, bridge
        As of :func:`planned_reads`.
    """
    values = {place for point in points for place in point.value_places}
    whole = {place for point in points for place in (*point.value_places, *point.status_places)}
    reads = planned_reads(whole, most_registers=most_registers, bridge=bridge)
    wanted = tuple(read for read in reads if any(_holds(read, place) for place in values))
    return wanted, tuple(read for read in reads if read not in wanted)


def _holds(read: Read, place: Place) -> bool:
    inside = read.address <= place.address and place.address + place.words <= read.address + read.count
    return read.table == place.table and inside


_WHOLE: dict[IoType, int] = {"u16": 1, "i16": 1, "u32": 2, "i32": 2, "f32": 2}


def expected_content(link: ModbusLink, expected: Expected) -> float:
    """Return what the place holds by which a device is known.

    Raises
    ------
    DeviceFault
        If no true reply comes; ModbusRefusal if the device refuses.
    """
    words = Read(expected.table, expected.address, _WHOLE.get(expected.type, 1)).ask(link, expected.what)
    if expected.type not in _WHOLE:
        return float(words[0])
    return float(decode_value(words, expected.type, "big"))


def mismatch(expected: Expected, got: float) -> str:
    """Return why a device is not the described one; empty where it is."""
    if got == expected.expect:
        return ""
    if expected.swapped is not None and got == expected.swapped:
        return (
            f"{expected.what} (address {expected.address}) reads {got:g} instead of {expected.expect:g}: "
            "something on the way exchanges bytes; look at the gateway"
        )
    return f"{expected.what} (address {expected.address}) holds {got:g} instead of {expected.expect:g}"
