"""What the acquisition sees of a stand, whichever wires (or none) lie behind it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.delivery_rate import Delivery, PollDelivery
from bufferstand.foundation import (
    ControllerMotion,
    Release,
    WireLost,
)
from bufferstand.foundation.channels import Channel

NO_REPLY = "no reply within"
"""Words of an event of the wire: a request was waited for in vain, and sent again."""


class MotionState(IntEnum):
    """What the controller does at present (register ``state``)."""

    OFF = 0
    READY = 1
    HOLDING = 2
    RAMPING = 3
    WAVEFORM = 4
    RELEASING = 5
    FAULT = 6


class EndReason(IntEnum):
    """How the controller's last motion ended (register ``end_reason``)."""

    NONE = 0
    REACHED = 1
    FORCE_LIMIT = 2
    COMMANDED = 3
    WATCHDOG = 4
    DEVICE_LIMIT = 5


@dataclass(frozen=True)
class Identity:
    """Who answers: for the run file and for ``bufferstand check``."""

    device: str
    address: str
    serial: str
    profile: str
    sample_rate_Hz: float


@dataclass(frozen=True)
class ControllerStatus:
    """One consistent snapshot of the controller.

    ``force_kN``, ``stroke_mm`` and ``command_mm`` are the controller's own values, for display and
    interlocks; figures are computed from samples only.
    """

    state: MotionState
    fault_code: int
    done_sequence: int
    end_reason: EndReason
    cycles_done: int
    heartbeat: int
    watchdog_trips: int
    force_kN: float
    stroke_mm: float
    position_mm: float
    command_mm: float
    tick_us: int | None = None
    """The device's clock when it made the snapshot [µs, modulo 2³²]; None where it shows none."""
    foreign_sequence: int | None = None
    """Number of a command that it took and that this program has not given; None where there is none."""


@dataclass(frozen=True)
class WriterSeen:
    """Who may give a controller commands, and what tells whether that program lives; only read.

    Parameters
    ----------
    number : int or None
        Another program's number; 0 where none may; None where the controller has no lock.
    who : str
        That program in words; empty where there is none.
    process_lives : bool or None
        Whether its process on this computer lives; None where nothing is known of it.
    feed : int or None
        The heartbeat that was written last; None where it was not read.
    watchdog_s : float
        Time of the watchdog that is set [s]; 0 for none.
    left_s : float or None
        What is left of that [s]; None where it is not shown.
    """

    number: int | None
    who: str = ""
    process_lives: bool | None = None
    feed: int | None = None
    watchdog_s: float = 0.0
    left_s: float | None = None


@dataclass(frozen=True)
class SampleBlock:
    """Consecutive samples of one device: all channels of one instant in one row.

    Parameters
    ----------
    stream : str
        Name of the stream (``controller``, ``amplifier``, ``temperature_1`` …).
    first_sequence : int
        Absolute sequence number of row 0; rows are consecutive.
    time_us : NDArray[int64]
        The device's own time stamps [µs], unwrapped, shape (n,); for devices without a clock the host's
        stand time at reception.
    counts : mapping of str to NDArray
        Raw counts as delivered, shape (n,) each, by channel name (without the stream).
    lost : int
        Samples known to be lost between the previous block and this one (counted gap).
    received_s : float
        Host stand time at reception [s].
    missed : int
        Those of ``lost`` that the device never took: cycles that it missed, by its own clock.
    more : bool
        Whether the device may have held further samples when it was asked for these. Where this is false,
        everything that was sampled until then has been delivered.
    """

    stream: str
    first_sequence: int
    time_us: NDArray[np.int64]
    counts: Mapping[str, NDArray[np.generic]]
    lost: int
    received_s: float
    missed: int = 0
    more: bool = False


@dataclass(frozen=True)
class ClockReading:
    """A device's clock, read over a wire: the instant of the reading lies between request and reply.

    Parameters
    ----------
    device_us : int
        What it showed, as its samples are stamped [µs].
    host_s : float
        Stand time of the host midway between request and reply [s].
    half_trip_s : float
        Half the round trip: by so much at most the two differ from having been simultaneous [s].
    """

    device_us: int
    host_s: float
    half_trip_s: float


@runtime_checkable
class OwnClock(Protocol):
    """A sensor with a clock of its own, which is read beside its samples."""

    def clock_readings(self) -> Sequence[ClockReading]:
        """Get (and forget) the readings since the last call; never blocks."""
        ...


@dataclass(frozen=True)
class SensorFault:
    """A reading that could not be had or cannot be true: what it is and where to look."""

    stream: str
    at_s: float
    what: str


@dataclass(frozen=True)
class ReadingLimits:
    """Which readings of a thermometer can be true.

    Parameters
    ----------
    low_C, high_C : float
        What it can show [°C].
    power_on_C : float or None
        What it shows when it was reset and has not measured [°C]; it may occur as a true reading, too.
    """

    low_C: float
    high_C: float
    power_on_C: float | None = None


@dataclass(frozen=True)
class StreamFacts:
    """What a stream is made of, for scaling now and for the run file.

    ``clock`` is ``device`` (own time stamps) or ``host`` (stamped at reception). ``simulated`` where the
    device is known to be a simulated one: over a wire a sensor cannot say so. ``readings`` of a thermometer
    whose kind says which can be true.
    """

    name: str
    clock: str
    channels: tuple[Channel, ...]
    rate_Hz: float
    device: str
    simulated: bool = False
    readings: ReadingLimits | None = None
    clock_doubt_s: float = 0.0
    """By so much at most the clock that its status shows is off from that of its samples [s]."""
    raw_units: Mapping[str, str] = field(default_factory=dict)
    """Unit in which a channel is delivered, and its calibration takes it, where that is not counts."""

    def raw_unit(self, channel: str) -> str:
        """Return the unit in which a channel is delivered."""
        return self.raw_units.get(channel, "counts")


@dataclass(frozen=True)
class Finding:
    """What only the hardware could tell, and what it told.

    Parameters
    ----------
    item, value : str
        What was found out, and what was found, with its unit.
    remark : str
        What is to be written into the stand file; empty where all is as it says.
    figures : mapping of str to float
        The same as numbers; names carry their units.
    is_wrong : bool
        Whether the device cannot be used as the stand file says.
    """

    item: str
    value: str
    remark: str = ""
    figures: Mapping[str, float] = field(default_factory=dict)
    is_wrong: bool = False


@runtime_checkable
class FindsOut(Protocol):
    """What can find out by reading alone what its documents do not say."""

    def findings(self) -> Sequence[Finding]:
        """Get what was found out; may raise DeviceFault."""
        ...


class Controller(Protocol):
    """The actuator controller. Every method may raise DeviceFault; none blocks longer than its timeout.

    A motion is started by :meth:`start`, which returns its sequence number; it has ended when
    ``status().done_sequence`` equals it.
    """

    facts: StreamFacts

    def connect(self) -> Identity:
        """Open the wire, check identity and test-value registers; get who answers."""
        ...

    def skip_backlog(self, *, anew: bool = False) -> None:
        """Go on near the newest sample: what the ring holds from before concerns nobody, and is not lost."""
        ...

    def read_block(self) -> SampleBlock | None:
        """Get the next samples from the ring (None where there are none yet) and acknowledge the last."""
        ...

    def delivery(self) -> Delivery | PollDelivery | None:
        """Return how many samples a second can be read; None where no round trip bounds that."""
        ...

    def status(self) -> ControllerStatus:
        """Get one consistent snapshot."""
        ...

    def says_simulated(self) -> bool:
        """Return whether the controller says of itself that it is a simulated one; nothing is written."""
        ...

    def other_writer(self) -> int | None:
        """Return which other program may give commands; 0 for none, None where the controller has no lock."""
        ...

    def seen_writer(self) -> WriterSeen:
        """Get who else may give commands, and what tells whether that program lives; nothing is written."""
        ...

    @property
    def in_charge(self) -> bool:
        """Whether this program has the right to give commands, as far as it knows; asks nobody.

        It is taken when the actuator is first switched on (or by a first command), and kept with the valve
        off until it is given back or lost. Without it nothing is sent: :class:`NotInCharge`.
        """
        ...

    def look_at_lock(self) -> None:
        """See that the right to give commands is still this program's; raise NotInCharge if it is not."""
        ...

    def take_charge(self) -> None:
        """Take the right to give commands as at a start, also where it was lost; nothing is switched."""
        ...

    def changed_limits(self) -> str:
        """Return which limits are no longer those that :meth:`enable` set; empty where all are kept."""
        ...

    def give_back(self) -> None:
        """Let another program give commands; the valve is off. One that was lost is let go of silently."""
        ...

    def feed_watchdog(self) -> None:
        """Write the heartbeat; without it the controller falls back to zero force by itself."""
        ...

    def enable(self, *, force_limit_kN: float, stroke_limit_mm: float, watchdog_ms: int) -> None:
        """Set the device's own limits and watchdog and switch the actuator on (it holds)."""
        ...

    @property
    def stops_at_once(self) -> bool:
        """Whether standing still takes a single request; where not, a release made ready is quicker."""
        ...

    @property
    def taken_us(self) -> int | None:
        """The device's clock when it had taken the last command [µs, modulo 2³²]; None where it shows none.

        What was sampled before tells nothing of that command.
        """
        ...

    def look_between(
        self, look: Callable[[], object], outlast: Callable[[WireLost], object] | None = None
    ) -> AbstractContextManager[None]:
        """Inside, ``look`` is called before each request of a command, where samples wait for the wire.

        It may read blocks, and feed. What it raises ends the command, wherever that is. ``outlast`` is called
        where the wire is lost within a command, and the request is repeated when it returns.
        """
        ...

    def start(self, motion: ControllerMotion, *, hurry: bool = False) -> int:
        """Begin a motion on the controller's own scale; get its sequence number.

        A sine must stand at its mean already, static cycles begin at zero. To stand still is begun with the
        first request, and what became of it is seen afterwards; so is a release in a ``hurry``.
        """
        ...

    @property
    def can_adjust(self) -> bool:
        """Whether it can change a running sine; known once it is connected."""
        ...

    def adjust_harmonic(self, *, mean_mm: float, amplitude_mm: float) -> None:
        """Bring the sine that runs at full amplitude to another mean and amplitude, over one cycle.

        It stays the same motion, with the number, the phase and the count of cycles that it has. Taken only
        by a controller that ``can_adjust``, while nothing else is being adjusted and at least one cycle at
        full amplitude is left.
        """
        ...

    def prepare(self, release: Release) -> None:
        """Have a release ready, so that starting it takes the least time."""
        ...

    def reset_fault(self) -> None:
        """Reset a latched fault, where there is one; the valve stays off. Never while force is left."""
        ...

    def disable(self) -> None:
        """Switch the actuator's valve off; the right to give commands is kept."""
        ...

    def events(self) -> Sequence[str]:
        """Get (and forget) what happened on the wire since the last call: retries, reopenings, resyncs."""
        ...

    def close(self) -> None:
        """Let go of the wire; never raises."""
        ...


class Sensor(Protocol):
    """A device that delivers samples by itself, read in a thread of its own."""

    facts: StreamFacts

    def start(self) -> None:
        """Open the wire and begin to read."""
        ...

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        ...

    def close(self) -> None:
        """Stop reading and let go of the wire; never raises."""
        ...


@dataclass(frozen=True)
class Stand:
    """An opened stand: one controller and the sensors beside it."""

    controller: Controller
    sensors: tuple[Sensor, ...]

    def close(self) -> None:
        """Let go of every wire; never raises."""
        for sensor in self.sensors:
            sensor.close()
        self.controller.close()
