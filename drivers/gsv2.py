"""ME GSV-2 measuring amplifier on a serial line: a stream of values, read in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import serial

from drivers.gsv2_frames import FrameDecoder
from drivers.host_stamps import HostStamps
from drivers.interfaces import DeviceFault, SampleBlock, SensorFault, StreamFacts
from drivers.mailbox import Mailbox
from drivers.stand_file import AmplifierSettings
from foundation.clock import Clock

STREAM = "amplifier"

SET_ZERO = b"\x0c"
READ_FREQUENCY = b"\x16"
STOP = b"\x23"
START = b"\x24"

SILENCE_S = 1.0
"""Wall time without a frame after which the amplifier counts as silent [s]."""
_POLL_S = 0.01
_READ_S = 0.05
_QUIET_S = 0.5
_RETRY_S = 1.0
_RATE_TOLERANCE = 0.01


def frequency_of(register: int) -> float:
    """Return the data rate [Hz] that a frequency register stands for: 5·10⁶ / (2²⁴ − register).

    Raises
    ------
    ValueError
        If the register is not 0 … 2²⁴ − 1.
    """
    if not 0 <= register < 1 << 24:
        raise ValueError(f"{register} is no 24-bit register")
    return 5e6 / ((1 << 24) - register)


def register_of(rate_Hz: float) -> int:
    """Return the frequency register of a data rate: the inverse of :func:`frequency_of`, rounded.

    Raises
    ------
    ValueError
        If no register stands for that rate.
    """
    register = (1 << 24) - round(5e6 / rate_Hz)
    frequency_of(register)
    return register


class Gsv2Amplifier:
    """Sensor of :mod:`drivers.interfaces`: force through a second amplifier, stamped with host time.

    Parameters
    ----------
    port : Path
        Serial device.
    settings : AmplifierSettings
        Baud rate, data rate, channel.
    clock : Clock
        Stand time for the stamps, wall time for the judgement of silence.
    """

    facts: StreamFacts

    def __init__(self, port: Path, settings: AmplifierSettings, clock: Clock) -> None:
        self.facts = StreamFacts(
            STREAM, "host", (settings.channel,), settings.rate_Hz, f"GSV-2 at {Path(settings.port).name}"
        )
        self._path = port
        self._baud = settings.baud
        self._rate_Hz = settings.rate_Hz
        self._clock = clock
        self._mailbox = Mailbox()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._port: serial.Serial | None = None
        self._decoder = FrameDecoder()
        self._stamps = HostStamps(settings.rate_Hz)
        self._sequence = 0
        self._resyncs = 0
        self._last_frame_s = 0.0
        self._silent = False
        self._failing = False
        self._bytes_since_frame = 0

    @property
    def resyncs(self) -> int:
        """How often the frames' spacing was lost since the start."""
        return self._resyncs

    def start(self) -> None:
        """Open the port, check the data rate, begin to read; does nothing if it reads already.

        Raises
        ------
        DeviceFault
            If the port cannot be opened, or the amplifier is set to another rate than the stand file says.
        """
        if self._thread is not None:
            return
        try:
            self._open()
        except (OSError, serial.SerialException) as error:
            self._let_go()
            raise DeviceFault(
                f"amplifier at {self._path}: cannot be opened ({_reason(error)}); "
                "look whether the device is there, plugged in, free, and readable by you"
            ) from None
        except DeviceFault:
            self._let_go()
            raise
        self._stop.clear()
        self._thread = threading.Thread(target=self._run, name="amplifier", daemon=True)
        self._thread.start()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        return self._mailbox.take()

    def zero(self) -> None:
        """Set the present value as zero in the amplifier (command 0x0C); only with nothing on the transducer.

        Raises
        ------
        DeviceFault
            If the port is not open or fails.
        """
        port = self._port
        if port is None:
            raise DeviceFault(f"amplifier at {self._path}: zero was not set, its port is not open")
        try:
            port.write(SET_ZERO)
        except (OSError, serial.SerialException) as error:
            raise DeviceFault(f"amplifier at {self._path}: zero was not set ({_reason(error)})") from None

    def close(self) -> None:
        """Stop reading and let go of the port; never raises. The amplifier goes on sending, as it came."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._thread = None
        self._let_go()

    def _open(self) -> serial.Serial:
        """Open the port and restart the stream, so that its first byte begins a frame."""
        port = serial.Serial(
            str(self._path), self._baud, timeout=_READ_S, write_timeout=_QUIET_S, exclusive=True
        )
        self._port = port
        port.write(STOP)
        quiet = self._wait_quiet(port)
        if quiet:
            self._check_rate(port)
        port.write(START)
        self._decoder = FrameDecoder(aligned=quiet)
        self._last_frame_s = self._clock.wall_s()
        self._bytes_since_frame = 0
        self._silent = False
        return port

    def _wait_quiet(self, port: serial.Serial) -> bool:
        """Read away what was under way; return whether it became quiet."""
        deadline_s = self._clock.wall_s() + _QUIET_S
        while port.read(4096):
            if self._clock.wall_s() >= deadline_s:
                self._fault("it does not stop sending on command 0x23; its data rate could not be checked")
                return False
        return True

    def _check_rate(self, port: serial.Serial) -> None:
        """Ask for the frequency register; a rate that is not the stated one would falsify the time base."""
        port.write(READ_FREQUENCY)
        answer = b""
        deadline_s = self._clock.wall_s() + _QUIET_S
        while len(answer) < 3 and self._clock.wall_s() < deadline_s:
            answer += port.read(3 - len(answer))
        if len(answer) < 3:
            self._fault("no answer to “read frequency” (0x16); its data rate could not be checked")
            return
        rate_Hz = frequency_of(int.from_bytes(answer, "big"))
        if abs(rate_Hz - self._rate_Hz) > _RATE_TOLERANCE * self._rate_Hz:
            raise DeviceFault(
                f"amplifier at {self._path}: it is set to {rate_Hz:.4g} values a second, the stand file says "
                f"{self._rate_Hz:.4g}; set the one or the other (amplifier.rate_Hz)"
            )

    def _let_go(self) -> None:
        port, self._port = self._port, None
        if port is not None:
            try:
                port.close()
            except (OSError, serial.SerialException) as error:
                self._fault(f"its port did not close ({_reason(error)})")

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._read_once(self._port or self._open())
            except (OSError, serial.SerialException, DeviceFault) as error:
                self._let_go()
                if not self._failing:  # told once, not every second of an outage
                    self._fault(f"its line failed ({_reason(error)}); look at plug and power; tried again")
                self._failing = True
                self._stop.wait(_RETRY_S)

    def _read_once(self, port: serial.Serial) -> None:
        data = port.read(max(1, port.in_waiting))
        received_s = self._clock.now_s()
        self._bytes_since_frame += len(data)
        frames = self._decoder.feed(data)
        self._report_resyncs()
        if frames:
            self._last_frame_s = self._clock.wall_s()
            self._bytes_since_frame = 0
            self._silent = self._failing = False
            received_s -= self._decoder.pending_frames / self._rate_Hz
            self._post([frame.count for frame in frames], [frame.lost for frame in frames], received_s)
        elif self._decoder.undecided:
            self._fault("its stream can be read in two ways; it is stopped and started again")
            self._restart(port)
        else:
            self._watch_silence()
        self._stop.wait(_POLL_S)

    def _restart(self, port: serial.Serial) -> None:
        port.write(STOP)
        self._decoder = FrameDecoder(aligned=self._wait_quiet(port))
        port.write(START)

    def _post(self, counts: list[int], losses: list[int], received_s: float) -> None:
        """Leave the frames as blocks, a new one behind each loss."""
        starts = [0] + [i for i in range(1, len(counts)) if losses[i]] + [len(counts)]
        behind = len(counts)
        for start, end in pairwise(starts):
            lost = losses[start]
            behind -= end - start
            time_us = self._stamps.stamp(end - start, received_s - behind / self._rate_Hz, lost)
            self._sequence += lost
            values = np.array(counts[start:end], dtype=np.int32)
            name = self.facts.channels[0].name
            self._mailbox.put(SampleBlock(STREAM, self._sequence, time_us, {name: values}, lost, received_s))
            self._sequence += end - start

    def _report_resyncs(self) -> None:
        new = self._decoder.resyncs
        if new:
            self._decoder.resyncs = 0
            self._resyncs += new
            self._fault(
                f"the spacing of its frames was lost ({self._resyncs} times since the start); "
                "look at cable, shield and baud rate"
            )

    def _watch_silence(self) -> None:
        silent_s = self._clock.wall_s() - self._last_frame_s
        if silent_s < SILENCE_S or self._silent:
            return
        self._silent = True
        if self._bytes_since_frame:
            self._fault(
                f"{self._bytes_since_frame} bytes but no frame for {silent_s:.1f} s; "
                "look at the baud rate and whether it sends 5-byte binary frames"
            )
        else:
            self._fault(f"silent for {silent_s:.1f} s; look at cable, power and port")

    def _fault(self, what: str) -> None:
        text = f"amplifier at {self._path}: {what}"
        self._mailbox.put(SensorFault(STREAM, self._clock.now_s(), text))


def _reason(error: BaseException) -> str:
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
