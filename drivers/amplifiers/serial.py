"""A measuring amplifier on a serial line, read in a thread of its own, whatever its protocol."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np
import serial

from bufferstand.drivers.amplifiers.host_stamps import HostStamps, RateWatch
from bufferstand.drivers.instruments import SerialSettings
from bufferstand.drivers.interfaces import SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.serial_line import QUIET_S, READ_S, SerialLine, cannot_be_opened, parity_of
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import Channel, Plausibility, PlausibilityWatch

STREAM = "amplifier"
"""What the samples of the only amplifier are called."""

ANSWER_S = 0.1
"""An answer is waited for so long before the next question [s of the wall]."""
SILENCE_S = 1.0
"""Wall time without a value after which the amplifier counts as silent [s]."""
_POLL_S = 0.01
_RETRY_S = 1.0


class StreamValue(Protocol):
    """One value of a stream."""

    @property
    def count(self) -> int:
        """Raw counts about zero."""
        ...

    @property
    def lost(self) -> int:
        """Values missing before it."""
        ...


class Decoder(Protocol):
    """Finds values in a stream of bytes that comes in pieces."""

    resyncs: int
    """How often the form of the stream was lost since somebody set this to 0."""

    @property
    def pending_frames(self) -> int:
        """Values that have begun to come in and are not delivered yet."""
        ...

    @property
    def undecided(self) -> bool:
        """Whether only stopping and starting the stream helps."""
        ...

    def feed(self, data: bytes) -> Sequence[StreamValue]:
        """Return the values that are certain by now."""
        ...


@runtime_checkable
class TellingDecoder(Protocol):
    """A decoder that also finds what the device says instead of a value: an overload, a refusal."""

    def take_said(self) -> Sequence[str]:
        """Get (and forget) what it has said since the last call, in words; it was heard, at any rate."""
        ...


Complain = Callable[[str], None]


class AmplifierDialect(Protocol):
    """What one protocol says on an open line."""

    @property
    def saturation(self) -> tuple[float, float] | None:
        """Counts at which its converter is at an end."""
        ...

    request: bytes
    """Asks for one value; empty where values come by themselves."""
    form: str
    """What its stream looks like, for messages."""

    def begin(self, line: SerialLine, complain: Complain) -> Decoder:
        """Stop it, set it up, check what it is set to, and start it.

        Raises
        ------
        DeviceFault
            If it is set to something that would falsify the record.
        """
        ...

    def restart(self, line: SerialLine) -> Decoder:
        """Stop and start the stream, so that its first byte begins a value."""
        ...

    def zero(self, line: SerialLine) -> Decoder | None:
        """Set the present value as zero (or tare) in the amplifier.

        Returns the decoder of the new stream where it had to be stopped for it.

        Raises
        ------
        DeviceFault
            If the amplifier refuses.
        """
        ...

    def judge(self, values: Sequence[StreamValue]) -> Iterable[tuple[str, str]]:
        """Yield what the amplifier itself says is wrong: a key for each state, and its words."""
        ...

    @property
    def identity(self) -> str:
        """Who answered, as far as it says; empty before :meth:`begin`."""
        ...


class SerialAmplifier:
    """Sensor of :mod:`bufferstand.drivers.interfaces`: force through an amplifier, stamped with host time.

    Parameters
    ----------
    port : Path
        Serial device.
    settings : SerialSettings
        Baud rate, data rate, channel.
    clock : Clock
        Stand time for the stamps, wall time for the judgement of silence.
    dialect : Dialect
        The protocol.
    device : str
        What the run file calls it.
    even_parity : bool
        Whether the line has an even parity bit.
    stream : str
        What its samples are called; messages call it so, too.
    """

    facts: StreamFacts

    def __init__(
        self,
        port: Path,
        settings: SerialSettings,
        clock: Clock,
        dialect: AmplifierDialect,
        device: str,
        *,
        even_parity: bool = False,
        stream: str = STREAM,
    ) -> None:
        self.facts = StreamFacts(stream, "host", (settings.channel,), settings.rate_Hz, device)
        self._path = port
        self._name = f"{stream} at {port}"
        self._baud = settings.baud
        self._even_parity = even_parity
        self._rate_Hz = settings.rate_Hz
        self._clock = clock
        self._dialect = dialect
        self._mailbox = Mailbox()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._line: SerialLine | None = None
        self._zero_wanted = threading.Event()
        self._decoder: Decoder | None = None
        self._stamps = HostStamps(settings.rate_Hz)
        self._rate = RateWatch(settings.rate_Hz)
        self._watch = PlausibilityWatch(with_saturation(settings.channel, dialect.saturation))
        self._wrong: set[str] = set()
        self._sequence = 0
        self._resyncs = 0
        self._asked_s = float("-inf")
        self._unanswered = 0
        self._asked_wall_s = 0.0
        self._last_frame_s = 0.0
        self._silent = False
        self._failing = False
        self._bytes_since_frame = 0

    @property
    def resyncs(self) -> int:
        """How often the form of the stream was lost since the start."""
        return self._resyncs

    @property
    def identity(self) -> str:
        """Who answered at the last opening; empty if it did not say."""
        return self._dialect.identity

    def start(self) -> None:
        """Open the port, set up and check the amplifier, begin to read; does nothing if it reads already.

        Raises
        ------
        DeviceFault
            If the port cannot be opened, or the amplifier is set to something else than the stand file says.
        """
        if self._thread is not None:
            return
        try:
            self._open_patiently()
        except serial.SerialTimeoutException:
            self._let_go()
            raise DeviceFault(
                f"{self._name}: its line took nothing for {QUIET_S:g} s, twice; look at plug, "
                "adapter and handshake, and whether this computer is overloaded"
            ) from None
        except (OSError, serial.SerialException) as error:
            self._let_go()
            raise DeviceFault(cannot_be_opened(self._name, _reason(error))) from None
        except DeviceFault:
            self._let_go()
            raise
        self._stop.clear()
        self._thread = threading.Thread(target=self._run, name=self.facts.name, daemon=True)
        self._thread.start()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        return self._mailbox.take()

    def zero(self) -> None:
        """Set the present value as zero in the amplifier; only with nothing on the transducer.

        The reading thread does it with its next look; a refusal comes as a fault of the stream.

        Raises
        ------
        DeviceFault
            If the port is not open.
        """
        if self._line is None:
            raise DeviceFault(f"{self._name}: zero was not set, its port is not open")
        self._zero_wanted.set()

    def close(self) -> None:
        """Stop reading and let go of the port; never raises. The amplifier goes on sending, as it came."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._thread = None
        self._let_go()

    def _open_patiently(self) -> None:
        """Open it; once more where the line takes nothing: an adapter, or a busy computer, may be late."""
        try:
            self._open()
        except serial.SerialTimeoutException:
            self._let_go()
            self._stop.wait(QUIET_S)
            self._open()

    def _open(self) -> SerialLine:
        """Open the port and restart the stream, so that its first byte begins a value."""
        port = serial.Serial(
            str(self._path),
            self._baud,
            parity=parity_of(self._path, self._even_parity),
            timeout=READ_S,
            write_timeout=QUIET_S,
            exclusive=True,
        )
        self._line = line = SerialLine(port, self._clock, self._name)
        self._decoder = self._dialect.begin(line, self._fault)
        self._begin_anew()
        return line

    def _begin_anew(self) -> None:
        self._last_frame_s = self._clock.wall_s()
        self._bytes_since_frame = 0
        self._silent = False
        self._unanswered = 0
        self._rate.reset()
        self._stamps.interrupt()

    def _let_go(self) -> None:
        line, self._line = self._line, None
        if line is not None:
            try:
                line.port.close()
            except (OSError, serial.SerialException) as error:
                self._fault(f"its port did not close ({_reason(error)})")

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                line = self._line or self._open()
                if self._zero_wanted.is_set():
                    self._set_zero(line)
                self._read_once(line)
            except (OSError, serial.SerialException, DeviceFault) as error:
                self._let_go()
                if not self._failing:  # told once, not every second of an outage
                    self._fault(f"its line failed ({_reason(error)}); look at plug and power; tried again")
                self._failing = True
                self._stop.wait(_RETRY_S)

    def _set_zero(self, line: SerialLine) -> None:
        self._zero_wanted.clear()
        try:
            decoder = self._dialect.zero(line)
        except DeviceFault as refusal:
            self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), str(refusal)))
            decoder = self._dialect.restart(line)
        if decoder is not None:
            self._decoder = decoder
            self._begin_anew()

    def _read_once(self, line: SerialLine) -> None:
        decoder = self._decoder
        assert decoder is not None
        self._ask(line)
        # While nothing is owed a wait for bytes would only make the next question late.
        owed = not self._dialect.request or self._unanswered or line.port.in_waiting
        data = line.port.read(max(1, line.port.in_waiting)) if owed else b""
        received_s = self._clock.now_s()
        self._bytes_since_frame += len(data)
        values = decoder.feed(data)
        self._report_resyncs(decoder)
        if isinstance(decoder, TellingDecoder):
            self._tell_said(decoder)
        if values:
            self._last_frame_s = self._clock.wall_s()
            self._bytes_since_frame = 0
            self._silent = self._failing = False
            if not self._dialect.request:
                received_s -= decoder.pending_frames / self._rate_Hz
            self._take(values, received_s)
        elif decoder.undecided:
            self._fault("its stream can be read in two ways; it is stopped and started again")
            self._decoder = self._dialect.restart(line)
            self._begin_anew()
        else:
            self._watch_silence()
        self._stop.wait(_POLL_S)

    def _ask(self, line: SerialLine) -> None:
        """Ask for the next value when it is due, where the amplifier does not send by itself."""
        now_s, period_s = self._clock.now_s(), 1.0 / self._rate_Hz
        if not self._dialect.request or now_s - self._asked_s < period_s:
            return
        begun = self._decoder is not None and self._decoder.pending_frames > 0
        if self._unanswered and (begun or self._clock.wall_s() - self._asked_wall_s < ANSWER_S):
            return  # one question at a time: answers do not say which one they answer
        first = math.isinf(self._asked_s)
        turns = 1 if first else math.floor((now_s - self._asked_s) / period_s)
        self._unanswered += turns  # those whose turn passed meanwhile are missing, too
        self._asked_s = now_s if first else self._asked_s + turns * period_s
        self._asked_wall_s = self._clock.wall_s()
        line.port.write(self._dialect.request)

    def _take(self, values: Sequence[StreamValue], received_s: float) -> None:
        """Leave values as blocks, a new one behind each loss, and say what is wrong with them."""
        counts, losses = [value.count for value in values], [value.lost for value in values]
        if self._dialect.request:  # questions that were not answered, and those whose answers were none
            losses[0] = max(losses[0], (self._unanswered - len(values)) * bool(self._sequence))
            self._unanswered = 0
        starts = [0] + [i for i in range(1, len(counts)) if losses[i]] + [len(counts)]
        behind = len(counts)
        wrong = dict(self._dialect.judge(values))
        for start, end in pairwise(starts):
            behind -= end - start
            block = self._block(counts[start:end], losses[start], received_s - behind / self._rate_Hz)
            raw = block.counts[self.facts.channels[0].name]
            value = self.facts.channels[0].calibration.apply(raw)
            for found in self._watch.look(block.time_us, raw, value):
                wrong.setdefault(found.kind, found.what)
            self._mailbox.put(block)
        self._tell(wrong)
        if not self._dialect.request:
            text = self._rate.look(len(counts) + sum(losses), received_s, self._clock.wall_s())
            if text:
                self._fault(text)

    def _block(self, counts: list[int], lost: int, received_s: float) -> SampleBlock:
        time_us = self._stamps.stamp(len(counts), received_s, lost)
        lost += self._stamps.passed
        self._sequence += lost
        name = self.facts.channels[0].name
        columns = {name: np.array(counts, dtype=np.int32)}
        block = SampleBlock(self.facts.name, self._sequence, time_us, columns, lost, received_s)
        self._sequence += len(counts)
        return block

    def _tell(self, wrong: dict[str, str]) -> None:
        """Say each state once when it begins; it may be said again when it has ended."""
        for key, text in wrong.items():
            if key not in self._wrong:
                self._fault(text)
        self._wrong = set(wrong)

    def _report_resyncs(self, decoder: Decoder) -> None:
        new = decoder.resyncs
        if new:
            decoder.resyncs = 0
            self._resyncs += new
            self._fault(resync_text(self._resyncs))

    def _tell_said(self, decoder: TellingDecoder) -> None:
        said = decoder.take_said()
        if said:  # it is there, whatever it says
            self._last_frame_s = self._clock.wall_s()
            self._bytes_since_frame = 0
            self._tell({**dict.fromkeys(self._wrong, ""), **{text: text for text in said}})

    def _watch_silence(self) -> None:
        silent_s = self._clock.wall_s() - self._last_frame_s
        if silent_s < SILENCE_S or self._silent:
            return
        self._silent = True
        self._rate.reset()
        if self._bytes_since_frame:
            self._fault(
                f"{self._bytes_since_frame} bytes but no frame for {silent_s:.1f} s; "
                f"look at the baud rate and whether it sends {self._dialect.form}"
            )
        else:
            self._fault(f"silent for {silent_s:.1f} s; look at cable, power and port")

    def _fault(self, what: str) -> None:
        text = f"{self._name}: {what}"
        self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), text))


def resync_text(times: int) -> str:
    """Return how it is said that the form of the stream was lost, so often since the start."""
    return (
        f"the spacing of its frames was lost (count since the start: {times}); "
        "look at cable, shield and baud rate"
    )


def with_saturation(channel: Channel, saturation: tuple[float, float] | None) -> Channel:
    """Return a channel that knows the ends of its converter, where it does not state its own."""
    limits = channel.plausible or Plausibility()
    if saturation is None or limits.counts is not None:
        return channel
    return channel.model_copy(update={"plausible": limits.model_copy(update={"counts": saturation})})


def _reason(error: BaseException) -> str:
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
