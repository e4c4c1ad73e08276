"""What guards look at, and what changes what they have seen: everything that a pass of the loop brings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import ControllerStatus, SampleBlock, SensorFault, StreamFacts

# --- what there is to look at ------------------------------------------------------------------------


@dataclass(frozen=True)
class Samples:
    """A block of any stream in units; as it came, and what its stream is made of, where that is known."""

    block: ScaledBlock
    raw: SampleBlock | None = None
    facts: StreamFacts | None = None


@dataclass(frozen=True)
class Judged:
    """The same block of a sensor once more, after every guard has looked at it."""

    block: ScaledBlock


@dataclass(frozen=True)
class Complaint:
    """A reading that could not be had."""

    fault: SensorFault


@dataclass(frozen=True)
class Snapshot:
    """A look at the controller's status.

    Parameters
    ----------
    status : ControllerStatus
    sampled_kN : float or None
        Newest sample of the force, no zero taken off; None where none is fresh.
    age_s : float or None
        Age of the newest sample by the device's own clock [s of the wall]; None where it shows none.
    up_to_date : bool
        Whether all that the device had sampled was read.
    """

    status: ControllerStatus
    sampled_kN: float | None = None
    age_s: float | None = None
    up_to_date: bool = True


@dataclass(frozen=True)
class Computer:
    """This computer's civil time, a time that nobody sets [s], and whether guards were to look till now."""

    civil_s: float
    steady_s: float
    guarded: bool


class RecorderState(Protocol):
    """What is looked at of a recorder (:class:`bufferstand.recording.recorder.RunRecorder`)."""

    @property
    def written(self) -> int:
        """Samples of the controller handed to the file."""
        ...

    @property
    def durable(self) -> int:
        """Samples of the controller known to be on the disk."""
        ...

    @property
    def failure(self) -> Exception | None:
        """Why it can no longer record, None while it can."""
        ...

    @property
    def disk_warning(self) -> str | None:
        """Why the disk will soon be full, None while it will not."""
        ...

    @property
    def renewals(self) -> Sequence[str]:
        """Why a journal file was given up for a new one."""
        ...


@dataclass(frozen=True)
class Recorded:
    """The recorder of the run under way."""

    recorder: RecorderState


@dataclass(frozen=True)
class PassOver:
    """A pass is over: everything that came in was looked at."""

    computer: Computer | None = None


@dataclass(frozen=True)
class MotionOver:
    """A motion has ended: the next look may be too late."""


Sight = Samples | Judged | Complaint | Snapshot | Recorded | PassOver | MotionOver

# --- what changes what was seen ----------------------------------------------------------------------


@dataclass(frozen=True)
class NewZero:
    """The controller's channels count from another zero; from first contact, or as calibrated."""

    counted: bool


@dataclass(frozen=True)
class BegunAnew:
    """Everything is listened to as at a start [s of the wall]: nothing seen before is believed."""

    wall_s: float


@dataclass(frozen=True)
class CameBack:
    """An outage is over [s of the wall]."""

    wall_s: float


@dataclass(frozen=True)
class SwitchedOn:
    """The actuator was switched on: what the controller showed from before has been reset."""


@dataclass(frozen=True)
class ValveExpected:
    """The valve is to be on or off from now on; None while this program switches it."""

    on: bool | None


@dataclass(frozen=True)
class ClocksRead:
    """This computer's clocks count from these [s]: civil, steady, and stand time."""

    civil_s: float
    steady_s: float
    at_s: float


@dataclass(frozen=True)
class RunBegun:
    """Another run is recorded from now on."""


Happening = NewZero | BegunAnew | CameBack | SwitchedOn | ValveExpected | ClocksRead | RunBegun


class Phase(Enum):
    """A part of a campaign in which some guards see less, or nothing."""

    COOLING = "waiting at zero force"
    VALVE_OFF = "not switched on"
    FIRST_LOOK = "the look before anything moves"
    TOUCH = "first contact is touched off"
