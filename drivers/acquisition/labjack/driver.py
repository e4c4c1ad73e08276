"""A LabJack as an acquisition device: its stream read in a thread of its own, every hole counted.

Stamps are the device's own clock: the number of a scan times the period, from the stream's first scan on. A
stream that had to be started anew goes on by CORE_TIMER where the device has it, else by this computer's
clock.
"""

from __future__ import annotations

import socket
import threading
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from bufferstand.drivers.acquisition.claim import claim
from bufferstand.drivers.acquisition.labjack import packets as pk
from bufferstand.drivers.acquisition.labjack.device import LabJack
from bufferstand.drivers.acquisition.labjack.registers import TICKS_PER_S
from bufferstand.drivers.acquisition.labjack.scans import ScanAssembly, Scans
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.amplifiers import with_saturation
from bufferstand.drivers.interfaces import ClockReading, SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.modbus import ModbusLink, TcpWire
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import PlausibilityWatch

SILENCE_S = 1.0
"""Wall time without samples after which the stream is started anew [s]; longer where scans are rarer."""
BLOCK_S = 0.02
"""Samples are handed over when so much has come in [s], or nothing more waits."""
_WAIT_S = 0.05
_RETRY_S = 0.5
_IDLE_S = 0.002
WAITING_BYTES = 1 << 22
"""Bytes that may wait unread here: 50 s of eight inputs at 5 kHz, as far as the kernel allows it."""
_MAILBOX = 50_000
CLOCK_EVERY_S = 1.0
"""The clock is read as often as that [s of the wall]; …"""
CLOCK_FIRST = 20
"""… so many times at once where the stream has begun, for a short round trip among them."""
_KEPT_READINGS = 600
_TURN = 1 << 32


class LabJackDriver:
    """:class:`bufferstand.drivers.acquisition.AcquisitionDevice`: the inputs of a LabJack in one stream.

    Parameters
    ----------
    settings : LabJackSettings
    clock : Clock
        Stand time for when samples were received, wall time for the judgement of silence.
    stream : str
        What its samples are called.
    """

    facts: StreamFacts

    def __init__(self, settings: LabJackSettings, clock: Clock, stream: str) -> None:
        self._settings, self._clock = settings, clock
        device = f"LabJack {settings.model}"
        self.facts = StreamFacts(
            stream, "device", settings.channels, settings.rate_Hz, device, raw_units=settings.raw_units
        )
        link = ModbusLink(TcpWire(settings.host, settings.port), timeout_s=settings.timeout_s, name=stream)
        self._device = LabJack(link, settings, stream)
        self._mailbox = Mailbox(_MAILBOX)
        self._end = threading.Event()
        self._stop_wanted = threading.Event()
        self._stop_taken = threading.Event()
        self._thread: threading.Thread | None = None
        self._packets: socket.socket | None = None
        self._claim: socket.socket | None = None
        self._assembly = self._new_assembly()
        self._watches: list[PlausibilityWatch] = []
        self._wrong: set[str] = set()
        self._heard_s = self._clock.wall_s()
        self._ticks: int | None = None
        self._ticks_at_scan = 0
        self._overflowing = False
        self._clock_wanted = threading.Event()
        """Set once somebody has asked for readings: else nothing is sent for them."""
        self._clock_due_s: float | None = None
        self._readings: deque[ClockReading] = deque(maxlen=_KEPT_READINGS)

    def _new_assembly(self) -> ScanAssembly:
        settings = self._settings
        return ScanAssembly(
            len(settings.input), self._device.samples_per_packet, separator_counted=settings.separator_counted
        )

    @property
    def identity(self) -> str:
        """Who answered."""
        return self._device.identity

    @property
    def can_ask_for_stop(self) -> bool:
        """Whether the stand file names an output."""
        return bool(self._settings.stop_output)

    @property
    def stop_asked(self) -> bool:
        """Whether the output was set."""
        return self._stop_taken.is_set()

    def ask_for_stop(self, reason: str) -> None:
        """Have the output set as soon as the wire is free."""
        del reason
        if self.can_ask_for_stop:
            self._stop_wanted.set()

    def start(self) -> None:
        """Connect, see who it is, set up the stream and begin to read; does nothing if it reads already.

        Raises
        ------
        DeviceFault
            If it does not answer, is another one, or refuses a setting.
        """
        if self._thread is not None:
            return
        self._claim = claim(f"labjack {self._settings.host}:{self._settings.port}", self._name)
        try:
            self._device.identify()
            self.facts = replace(self.facts, simulated=self._device.simulated)
            if self.can_ask_for_stop:
                self._set_output(stop=False)
            self._begin_stream()
        except DeviceFault:
            self._let_go()
            raise
        finally:
            self._tell_events()
        self._watches = [
            PlausibilityWatch(with_saturation(channel, scale.ends), self.facts.raw_unit(channel.name))
            for channel, scale in zip(self.facts.channels, self._device.scales, strict=True)
        ]
        self._end.clear()
        self._thread = threading.Thread(target=self._run, name=self.facts.name, daemon=True)
        self._thread.start()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        return self._mailbox.take()

    def clock_readings(self) -> Sequence[ClockReading]:
        """Get (and forget) the readings of its clock since the last call; the first call has it read."""
        self._clock_wanted.set()
        found = []
        while self._readings:
            found.append(self._readings.popleft())
        return found

    def close(self) -> None:
        """Stop the stream and let go of the wire; never raises."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(timeout=5.0)
            self._thread = None
            with suppress(DeviceFault):
                self._device.stop_stream()
        self._let_go()

    # --- the thread ----------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._end.is_set():
            try:
                self._obey()
                packet = self._next_packet()
                self._tell_events()
                self._read_clock_if_due()
                if packet is not None:
                    self._take(packet)
                elif self._clock.wall_s() - self._heard_s > self._patience_s:
                    self._begin_anew("no samples came")
            except DeviceFault as fault:
                self._fault(str(fault))
                self._recover()

    @property
    def _patience_s(self) -> float:
        return max(
            SILENCE_S,
            5.0 * self._device.samples_per_packet / len(self._settings.input) / self._device.rate_Hz,
        )

    def _recover(self) -> None:
        """Start the stream anew until that succeeds."""
        while not self._end.wait(_RETRY_S):
            try:
                self._obey()
                self._begin_anew("the wire was lost")
            except DeviceFault:
                continue
            return

    def _obey(self) -> None:
        if self._stop_wanted.is_set() and not self._stop_taken.is_set():
            self._set_output(stop=True)
            self._stop_taken.set()

    def _read_clock_if_due(self) -> None:
        due_s = self._clock_due_s
        if self._clock_wanted.is_set() and (due_s is None or self._clock.wall_s() >= due_s):
            self._clock_due_s = self._clock.wall_s() + CLOCK_EVERY_S
            for _ in range(CLOCK_FIRST if due_s is None else 1):
                self._read_clock()

    def _read_clock(self) -> None:
        """Read CORE_TIMER beside the samples: its scans are stamped by the same crystal.

        Raises
        ------
        DeviceFault
            If the device does not answer.
        """
        ticks_per_s = TICKS_PER_S.get(int(self._settings.model[1:]))
        if self._ticks is None or ticks_per_s is None:
            return
        asked_s = self._clock.now_s()
        ticks = self._device.core_timer()
        told_s = self._clock.now_s()
        if self._device.link.events():  # asked twice: it may be the answer to either
            return
        # CORE_TIMER turns over every 107 s; how often is told by the scans that have come.
        rate_Hz, turn_us = self._device.rate_Hz, _TURN / ticks_per_s * 1e6
        since_us = (ticks - self._ticks) % _TURN / ticks_per_s * 1e6
        begun_us = self._ticks_at_scan * 1e6 / rate_Hz
        about_us = self._assembly.next * 1e6 / rate_Hz - begun_us
        since_us += turn_us * round((about_us - since_us) / turn_us)
        self._readings.append(
            ClockReading(round(begun_us + since_us), 0.5 * (asked_s + told_s), 0.5 * (told_s - asked_s))
        )

    def _set_output(self, *, stop: bool) -> None:
        high = (self._settings.stop_level == "high") is stop
        self._device.set_line(self._settings.stop_output, high=high)

    def _next_packet(self) -> pk.StreamPacket | None:
        if self._packets is not None:
            return self._received(self._packets)
        self._tell_events()  # of what was written before: not of the samples
        packet = self._device.request()
        if repeated := self._device.link.events():
            # Whether a reply that was lost took its samples with it is not said: what may be missing is not
            # guessed, the stream begins anew and the hole is measured by the clocks.
            for text in repeated:
                self._fault(f"{self._name}: {text}")
            self._begin_anew("a request had to be repeated")
            return None
        if not packet.samples.size and not packet.status:
            self._end.wait(_IDLE_S)
            return None
        return packet

    def _received(self, wire: socket.socket) -> pk.StreamPacket | None:
        """Return the next packet of the stream port; None where none has begun to come."""
        try:
            head = _exactly(wire, pk.HEAD_BYTES, self._settings.timeout_s)
            if head is None:
                return None
            body = _exactly(wire, pk.body_bytes(head), self._settings.timeout_s) or b""
        except (OSError, pk.NotAPacketError) as error:
            raise DeviceFault(f"{self._name}: its stream broke: {error or 'closed by the device'}") from None
        return pk.packet_of(head, body)

    def _take(self, packet: pk.StreamPacket) -> None:
        self._say_status(packet)
        stretches, missing = self._assembly.take(packet)
        if missing:
            self._fault(f"{self._name}: {missing} packets of its stream are missing; the hole is counted")
        received_s = self._clock.now_s()
        for scans in stretches:
            self._post(scans, received_s)
        if packet.samples.size:
            self._heard_s = self._clock.wall_s()
        if packet.status in pk.ENDS:
            self._begin_anew("its stream has ended")

    def _say_status(self, packet: pk.StreamPacket) -> None:
        status, name = packet.status, self._name
        if status == pk.RECOVERING and not self._overflowing:
            self._fault(
                f"{name}: its buffer is full and scans are skipped (status {status}): this computer or the "
                "network is too slow; look at what else runs, or write a smaller rate_Hz"
            )
        elif status == pk.RECOVERED:
            self._fault(f"{name}: {packet.additional} scans were skipped while its buffer was full")
        elif status == pk.OVERLAP:
            self._fault(
                f"{name}: a scan began before the last one had ended (status {status}): its stamps cannot be "
                "relied on; write a smaller rate_Hz, settling_us or resolution_index"
            )
        elif status in pk.ENDS or status not in (0, pk.RECOVERING):
            self._fault(f"{name}: its stream reports status {status}")
        self._overflowing = status == pk.RECOVERING

    def _post(self, scans: Scans, received_s: float) -> None:
        count = len(scans.samples)
        number = scans.first + np.arange(count, dtype=np.int64)
        time_us = np.rint(number * (1e6 / self._device.rate_Hz)).astype(np.int64)
        columns: dict[str, np.ndarray[tuple[int], np.dtype[np.float32]]] = {}
        wrong: dict[str, str] = {}
        for place, (channel, scale) in enumerate(zip(self.facts.channels, self._device.scales, strict=True)):
            volts = scale.volts(np.ascontiguousarray(scans.samples[:, place]))
            columns[channel.name] = volts
            for found in self._watches[place].look(time_us, volts, channel.calibration.apply(volts)):
                wrong.setdefault(f"{channel.name} {found.kind}", found.what)
        for key, text in wrong.items():
            if key not in self._wrong:
                self._fault(f"{self._name}: {text}")
        self._wrong = set(wrong)
        self._mailbox.put(SampleBlock(self.facts.name, scans.first, time_us, columns, scans.lost, received_s))

    # --- begin, and begin anew -----------------------------------------------------------------------

    def _begin_stream(self) -> None:
        self._close_packets()
        # Before there is a connection again: what an old stream still holds would come as the new one's.
        self._device.stop_stream()
        if self._settings.delivery == "packets":
            where = (self._settings.host, self._settings.stream_port)
            self._packets = wire = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            # What this computer is late for waits here, and not in the device, whose buffer holds little.
            wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, WAITING_BYTES)
            wire.settimeout(self._settings.timeout_s)
            try:
                wire.connect(where)
            except OSError as error:
                raise DeviceFault(
                    f"{self._name}: no connection to its stream port {where[0]}:{where[1]}: "
                    f"{error.strerror or error}; is stream_port right, and does no firewall close it?"
                ) from None
            wire.settimeout(_WAIT_S)
        self._ticks = self._device.start_stream()
        self._ticks_at_scan = self._assembly.next
        self._heard_s = self._clock.wall_s()
        self._overflowing = False

    def _begin_anew(self, why: str) -> None:
        """Start the stream anew, and count the scans that passed meanwhile.

        Raises
        ------
        DeviceFault
            If it cannot be started.
        """
        before, scan_before, heard_s = self._ticks, self._ticks_at_scan, self._heard_s
        self._begin_stream()
        since_s = self._clock.wall_s() - heard_s
        rate_Hz, done = self._device.rate_Hz, self._assembly.next
        ticks_per_s = TICKS_PER_S.get(int(self._settings.model[1:]))
        how = "this computer's clock"
        missing = max(0, round(since_s * rate_Hz))
        if None not in (before, self._ticks, ticks_per_s):
            assert before is not None
            assert self._ticks is not None
            assert ticks_per_s is not None
            rough = scan_before + (self._ticks - before) / ticks_per_s * rate_Hz
            turn = 2**32 / ticks_per_s * rate_Hz
            wanted = done + missing
            number = rough + turn * round((wanted - rough) / turn)
            missing, how = max(0, round(number) - done), "its own clock"
        self._assembly.miss(missing)
        self._ticks_at_scan = self._assembly.next
        self._clock_due_s = None
        self._fault(f"{self._name}: {why}; its stream was started anew, {missing} scans are missing by {how}")

    def _close_packets(self) -> None:
        if self._packets is not None:
            self._packets.close()
            self._packets = None

    def _let_go(self) -> None:
        self._close_packets()
        self._device.link.close()
        if self._claim is not None:
            self._claim.close()
            self._claim = None

    @property
    def _name(self) -> str:
        return f"{self.facts.name} at {self._device.link.address}"

    def _tell_events(self) -> None:
        for text in self._device.link.events():
            self._fault(f"{self._name}: {text}")

    def _fault(self, what: str) -> None:
        self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), what))


def _exactly(wire: socket.socket, count: int, patience_s: float) -> bytes | None:
    """Return so many bytes; None where nothing came within the socket's time.

    Raises
    ------
    OSError
        If the other end has closed, or stopped amidst.
    """
    data = b""
    waited = 0.0
    while len(data) < count:
        try:
            more = wire.recv(count - len(data))
        except TimeoutError:
            waited += _WAIT_S
            if not data and waited <= _WAIT_S:
                return None
            if waited > patience_s:
                raise OSError("it stopped amidst a packet") from None
            continue
        if not more:
            raise OSError("closed by the device")
        data += more
    return data
