"""The actuator controller with a sample ring: blocks of samples by absolute sequence number."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from functools import lru_cache, partial

import numpy as np

from bufferstand.drivers.controllers.cycle_gaps import parted
from bufferstand.drivers.controllers.register_controller import RegisterController
from bufferstand.drivers.controllers.ring_reader import AlteredBlock, DoubtfulBlock, RingReader, RingRows
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
from bufferstand.drivers.delivery_rate import WORK_S, Delivery
from bufferstand.drivers.interfaces import ControllerStatus, Identity, SampleBlock, StreamFacts
from bufferstand.drivers.modbus import Exchange, ModbusLink
from bufferstand.drivers.register_maps import STATUS, Profile, pack
from bufferstand.foundation import Clock
from bufferstand.foundation.channels import Channel

STREAM = "controller"
KEEP_S = 0.2
"""So much of what the ring held before is read nevertheless [s]."""
TICK_WRAP_US = 1 << 32
AHEAD_S = 0.001
"""Blocks are asked ahead where a round trip is shorter [s]: behind a longer one a command would have to wait
for the reply."""
BEHIND_BLOCKS = 8
"""After so many full blocks running they are asked ahead in any case: the reader is behind by more than one
or two other requests cost, and catches up the quicker."""
SCAN_REST_S = 0.0005
"""Between two looks at a window that the controller has not made anew yet [s]: half of a quick PLC's scan."""
TRIPS_KEPT = 100
"""Round trips of blocks, and of the status, by which it is judged whether the reader can keep up."""
LINE_EXCHANGE, LINE_WRITE = 18, 16
"""Bytes of an FC23 on a serial line besides the registers both ways, and of an FC6: request and reply, each
with unit and CRC."""
QUICK_PERCENT = 25.0
"""Judged is by this percentile of them: a busy computer makes single ones long."""


class RingController(RegisterController):
    """Controller of :mod:`bufferstand.drivers.interfaces` over one Modbus link; all methods from one thread.

    Parameters
    ----------
    link : ModbusLink
        The wire; this object owns it.
    profile : Profile
        The register map.
    channels : sequence of Channel
        One for each value of a ring sample.
    clock : Clock
        Stand time, for the stamps of reception.
    timeout_s : float
        Longest wait for the controller to judge a command or change its state [s].
    board : NoticeBoard, optional
        Where it is posted on this computer who gives commands.
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
        board: NoticeBoard | None = None,
    ) -> None:
        super().__init__(link, profile, timeout_s=timeout_s, board=board)
        self._clock = clock
        by_name = {channel.name: channel for channel in channels}
        order = [name for name, _ in profile.ring.sample if name != "tick"]
        self._channels = tuple(by_name[name] for name in order)
        self._acknowledge_at = profile.find("ring_acknowledge").address
        self._window = lru_cache(maxsize=1)(self._make_window)  # asked ahead, then asked for
        self._reader: RingReader | None = None
        self._trip_s = math.inf
        self._trips: deque[float] = deque(maxlen=TRIPS_KEPT)
        self._status_trips: deque[float] = deque(maxlen=TRIPS_KEPT)
        self._full_blocks = 0
        self._parts: deque[SampleBlock] = deque()
        self.facts = StreamFacts(
            STREAM, "device", self._channels, 0.0, f"{profile.facts.id} at {link.address}"
        )

    def connect(self) -> Identity:
        """Open the wire, check identity and test-value registers; get who answers.

        Calling it again checks again and forgets nothing.

        Raises
        ------
        DeviceFault
            If nobody answers, or what answers is not what the profile describes.
        """
        identity = self.identify()
        rate_Hz = identity.sample_rate_Hz
        if self._reader is None:
            self._reader = RingReader(self._profile, rate_Hz)
            self._look_at_line(rate_Hz)
        elif rate_Hz != self.facts.rate_Hz:
            raise self._panel.fault(f"its sample rate changed from {self.facts.rate_Hz:g} to {rate_Hz:g} Hz")
        facts = self._profile.facts
        device = f"{facts.id} edition {facts.edition} at {self._link.address}, serial {identity.serial}"
        doubt_s = self._link.clock_doubt_s
        self.facts = StreamFacts(STREAM, "device", self._channels, rate_Hz, device, clock_doubt_s=doubt_s)
        return identity

    def _look_at_line(self, rate_Hz: float) -> None:
        """Say if the wire cannot carry what the controller samples."""
        samples, block_s = self._profile.ring.samples_per_block, self._block_bytes * self._byte_s
        if rate_Hz * block_s > samples:
            self._link.note(
                f"SAMPLES WILL BE LOST: the line carries {samples / block_s:.0f} samples/s at most "
                f"({samples} in {self._block_bytes} bytes, {block_s * 1e3:.1f} ms), the controller "
                f"takes {rate_Hz:g}; set a higher baud rate or a lower sample rate"
            )

    def skip_backlog(self, *, anew: bool = False) -> None:
        """Go on near the newest sample, by the device's clock: a ring of a minute takes seconds to read.

        What is left out is not counted as lost. A controller that shows no clock is read from its oldest
        sample on. One that was started ``anew`` counts from anywhere: that is no reason to doubt it then.

        Raises
        ------
        DeviceFault
            As :meth:`read_block` and :meth:`status`.
        """
        if anew and self._reader is not None:
            self._parts.clear()
            self._reader.begin_anew()
        block = self.read_block()
        if block is None or self._reader is None:
            return
        tick_us = self.status().tick_us
        if tick_us is None:
            return
        half = TICK_WRAP_US // 2  # a clock that reads less than the sample's stamp is behind nothing
        behind_us = (tick_us - int(block.time_us[-1]) + half) % TICK_WRAP_US - half
        samples = int((behind_us * 1e-6 - KEEP_S) * self.facts.rate_Hz)
        if samples > 0:
            self._parts.clear()
            self._reader.skip(samples)

    def read_block(self) -> SampleBlock | None:
        """Get the next samples from the ring (None where there are none yet) and acknowledge the last.

        One transaction; a doubtful block is asked for once more, on a new connection. Behind a full block
        the next one is asked for at once, for the next call, where the controller answers quickly; None, and
        a block without ``more``, are always of this call. A block in which the controller missed cycles
        comes in parts, one a call.

        Raises
        ------
        DeviceFault
            If two blocks running cannot be true; WireLost if the wire fails or has altered both; NotInCharge
            if this program had the right to give commands and has lost it: nothing was acknowledged then.
        """
        reader = self._reader
        if reader is None:
            raise self._panel.fault("samples were asked for before connecting; call connect() first")
        if self._lock.held:  # behind a pause of this program the ring may be another's: to read is to take
            self._lock.demand_recent()
        if self._parts:
            return self._parts.popleft()
        early = self._link.has_asked_ahead
        rows = self._read_rows(reader)
        if rows is None and early:  # there were none when it was asked ahead; is that so still?
            early, rows = False, self._read_rows(reader)
        for event in reader.events:
            self._link.note(event)
        reader.events.clear()
        if rows is None:
            return None
        count = len(rows.time_us)
        more = early or count == self._profile.ring.samples_per_block
        block = SampleBlock(
            STREAM, rows.first_sequence, rows.time_us, rows.counts, rows.lost, self._clock.now_s(), more=more
        )
        if not rows.missed:
            return block
        first, *rest = parted(block, rows.missed)
        self._parts.extend(rest)
        return first

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot; see :meth:`RegisterController.status`."""
        alone, asked_s = not self._link.has_asked_ahead, self._clock.wall_s()
        status = super().status()
        if alone:  # else it had to wait for a block's reply
            self._status_trips.append(self._clock.wall_s() - asked_s)
        return status

    def delivery(self) -> Delivery | None:
        """Return what was measured of the blocks and snapshots read last; None before the first.

        Feeding is not tried for it: one write takes as long as a status, less its bytes on a serial line,
        half of that where a status is written, then read.
        """
        if self._reader is None or not self._trips:
            return None
        ahead = self._link.can_ask_ahead and self._reader.is_checked
        block_s = max(float(np.percentile(self._trips, QUICK_PERCENT)), 1e-6)
        trips = self._status_trips
        status_s = float(np.percentile(trips, QUICK_PERCENT)) if trips else block_s
        less_s = (LINE_EXCHANGE + 2 * (self._profile.span(STATUS).words + 1) - LINE_WRITE) * self._byte_s
        return Delivery(
            self._profile.ring.samples_per_block,
            block_s,
            self.facts.rate_Hz,
            status_s,
            max(status_s - less_s, 0.0) / self._panel.trips_of_status,
            gap_s=0.0 if ahead else WORK_S,
            line_s=self._block_bytes * self._byte_s,
            median_trip_s=float(np.median(self._trips)),
        )

    @property
    def _byte_s(self) -> float:
        """What a byte takes on a serial line [s]; 0 on a network."""
        return 1.0 / self._link.bytes_per_s

    @property
    def _block_bytes(self) -> int:
        """Bytes of asking for a block and of the block, on a serial line."""
        return LINE_EXCHANGE + 2 * (self._profile.ring.registers + 2)

    def _read_rows(self, reader: RingReader) -> RingRows | None:
        """Return the samples of the next window that is true, None where it is empty."""
        doubt, altered = "", False
        for _ in range(2):
            wanted = self._window(reader.acknowledge)
            early, asked_s = self._link.has_asked_ahead, self._clock.wall_s()
            registers = self._panel.ask_again(partial(self._link.exchange, wanted))
            registers = self._seen_by_its_scan(reader, registers)
            if not early:
                self._trip_s = self._clock.wall_s() - asked_s
                self._trips.append(self._trip_s)
            try:
                window = reader.look(pack(registers))
                self._full_blocks = self._full_blocks + 1 if reader.is_full(window) else 0
                soon = self._trip_s < AHEAD_S or self._full_blocks >= BEHIND_BLOCKS
                if soon and self._full_blocks and reader.is_checked:
                    self._link.ask_ahead(self._window(window.behind))  # answered while this is unpacked
                return reader.unpack(window)
            except DoubtfulBlock as found:
                doubt, altered = str(found), isinstance(found, AlteredBlock)
                self._link.distrust(f"block of samples refused: {doubt}; connection closed")
        problem = (
            f"two blocks of samples running cannot be true: {doubt}; "
            "look at the controller's event log, and whether a second program talks to it"
        )
        raise self._panel.lost(problem) if altered else self._panel.fault(problem)

    def _seen_by_its_scan(self, reader: RingReader, registers: list[int]) -> list[int]:
        """Return the window once it repeats what was asked; a PLC's own server answers before the next scan.

        Only where a reply is no other's by its number, and not behind function 23, which is answered at once.
        One that never answers what was asked is given back as it is, to be doubted.
        """
        link, ring = self._link, self._profile.ring
        if not link.may_answer_early:
            return registers
        end_s = self._clock.wall_s() + self._panel.timeout_s
        while not reader.is_answered(pack(registers)) and self._clock.wall_s() < end_s:
            link.sleep(SCAN_REST_S)
            registers = self._panel.ask_again(
                lambda: link.read(ring.address, ring.registers, "the sample ring")
            )
        return registers

    def _make_window(self, acknowledge: int) -> Exchange:
        """Return the transaction that acknowledges by sequence and reads the window from there on."""
        ring = self._profile.ring
        return Exchange(
            read_address=ring.address,
            read_count=ring.registers,
            write_address=self._acknowledge_at,
            values=tuple(self._profile.encode("ring_acknowledge", acknowledge)),
            what="the sample ring",
        )
