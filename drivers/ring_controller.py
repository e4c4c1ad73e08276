"""The actuator controller with a sample ring: blocks of samples by absolute sequence number."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from drivers.interfaces import Identity, SampleBlock, StreamFacts
from drivers.modbus_link import ModbusLink
from drivers.packed_exchange import Exchange
from drivers.profile import Profile
from drivers.register_controller import RegisterController
from drivers.registers import pack
from drivers.ring_reader import DoubtfulBlock, RingReader, RingRows
from foundation.channel import Channel
from foundation.clock import Clock

STREAM = "controller"
KEEP_S = 0.2
"""So much of what the ring held before is read nevertheless [s]."""
TICK_WRAP_US = 1 << 32


class RingController(RegisterController):
    """Controller of :mod:`drivers.interfaces` over one Modbus link; all methods from one thread.

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
    ) -> None:
        super().__init__(link, profile, timeout_s=timeout_s)
        self._clock = clock
        by_name = {channel.name: channel for channel in channels}
        order = [name for name, _ in profile.ring.sample if name != "tick"]
        self._channels = tuple(by_name[name] for name in order)
        self._acknowledge_at = profile.find("ring_acknowledge").address
        self._reader: RingReader | None = None
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
        self.facts = StreamFacts(STREAM, "device", self._channels, rate_Hz, device)
        return identity

    def _look_at_line(self, rate_Hz: float) -> None:
        """Say if the wire cannot carry what the controller samples."""
        ring = self._profile.ring
        request, reply = 17, 5 + 2 * ring.registers  # bytes of function 23 on a serial line
        most_Hz = ring.samples_per_block * self._link.bytes_per_s / (request + reply)
        if rate_Hz > most_Hz:
            self._link.note(
                f"SAMPLES WILL BE LOST: the line carries {most_Hz:.0f} samples/s at most, the controller "
                f"takes {rate_Hz:g}; set a higher baud rate or a lower sample rate"
            )

    def skip_backlog(self) -> None:
        """Go on near the newest sample, by the device's clock: a ring of a minute takes seconds to read.

        What is left out is not counted as lost. A controller that shows no clock is read from its oldest
        sample on.

        Raises
        ------
        DeviceFault
            As :meth:`read_block` and :meth:`status`.
        """
        block = self.read_block()
        if block is None or self._reader is None:
            return
        tick_us = self.status().tick_us
        if tick_us is None:
            return
        behind_us = (tick_us - int(block.time_us[-1])) % TICK_WRAP_US
        samples = int((behind_us * 1e-6 - KEEP_S) * self.facts.rate_Hz)
        if samples > 0:
            self._reader.skip(samples)

    def read_block(self) -> SampleBlock | None:
        """Get the next samples from the ring (None where there are none yet) and acknowledge the last.

        One transaction; a doubtful block is asked for once more, on a new connection. Behind a full block
        the next one is asked for at once, for the next call; None is always of this call.

        Raises
        ------
        DeviceFault
            If the wire fails, or two blocks running cannot be true.
        """
        reader = self._reader
        if reader is None:
            raise self._panel.fault("samples were asked for before connecting; call connect() first")
        early = self._link.has_asked_ahead
        rows = self._read_rows(reader)
        if rows is None and early:  # there were none when it was asked ahead; is that so still?
            rows = self._read_rows(reader)
        for event in reader.events:
            self._link.note(event)
        reader.events.clear()
        if rows is None:
            return None
        return SampleBlock(
            STREAM, rows.first_sequence, rows.time_us, rows.counts, rows.lost, self._clock.now_s()
        )

    def _read_rows(self, reader: RingReader) -> RingRows | None:
        """Return the samples of the next window that is true, None where it is empty."""
        doubt = ""
        for _ in range(2):
            wanted = self._window(reader.acknowledge)
            packed = self._panel.ask_again(partial(self._link.exchange_packed, wanted))
            try:
                window = reader.look(packed)
                if reader.is_worth_asking_ahead(window):  # the controller answers while this is unpacked
                    self._link.ask_ahead(self._window(window.behind))
                return reader.unpack(window)
            except DoubtfulBlock as found:
                doubt = str(found)
                self._link.distrust(f"block of samples refused: {doubt}; connection closed")
        raise self._panel.fault(
            f"two blocks of samples running cannot be true: {doubt}; "
            "look at the controller's event log, and whether a second program talks to it"
        )

    def _window(self, acknowledge: int) -> Exchange:
        """Return the transaction that acknowledges by sequence and reads the window from there on."""
        ring = self._profile.ring
        return Exchange(
            read_address=ring.address,
            read_count=ring.registers,
            write_address=self._acknowledge_at,
            written=pack(self._profile.encode("ring_acknowledge", acknowledge)),
            what="the sample ring",
        )
