"""A kind of acquisition device: its settings and its driver."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from bufferstand.drivers.instruments import InstrumentSite, SampleRate, SerialAddress, TcpAddress
from bufferstand.drivers.interfaces import ClockReading, Sensor
from bufferstand.drivers.modbus import Candidate
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings


class AcquisitionDevice(Sensor, Protocol):
    """A device of many channels, read in a thread of its own: sampled by its own clock, or polled."""

    @property
    def identity(self) -> str:
        """Who answered; empty before it was started."""
        ...

    def clock_readings(self) -> Sequence[ClockReading]:
        """Get (and forget) the readings of its clock since the last call; never blocks.

        The clock is read from the first call on: who does not ask puts nothing on the wire.
        """
        ...

    @property
    def can_ask_for_stop(self) -> bool:
        """Whether it has an output by which the stand that moves is asked to stop."""
        ...

    def ask_for_stop(self, reason: str) -> None:
        """Set that output as soon as the wire is free; returns at once, and only the first time counts.

        That it was set, or could not be, comes with :meth:`drain` as a fault or shows in ``stop_asked``.
        """
        ...

    @property
    def stop_asked(self) -> bool:
        """Whether the device has taken the request."""
        ...


class AcquisitionSettings(Settings):
    """An entry ``[[acquisition]]`` of a stand file; a kind adds its own keys and narrows ``kind``."""

    own_clock: ClassVar[bool] = True
    """Whether the device stamps its samples by a clock of its own; else they are stamped by this computer."""

    kind: str
    """The kind."""
    rate_Hz: SampleRate
    """Scans a second: every channel is sampled once in each."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, in the order in which they are sampled."""
        raise NotImplementedError

    @property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest number that each channel can show, for a simulated one."""
        return ((-1e9, 1e9),) * len(self.channels)

    @property
    def raw_units(self) -> dict[str, str]:
        """Unit in which each channel is delivered, by its name; counts where none is said."""
        return {}

    @property
    def clock_is_readable(self) -> bool:
        """Whether its clock can be read beside its samples: without that it is for record-only mode."""
        return False


SettingsT = TypeVar("SettingsT", bound=AcquisitionSettings)


class AcquisitionKind(ABC, Generic[SettingsT]):
    """One kind of acquisition device. A stand file names it; everything else is asked of it.

    A kind lies in a folder of its own below ``drivers/acquisition``, whose ``kind.py`` has one as ``KIND``,
    or in another package that names it as an entry point of the group ``bufferstand.acquisition``.
    """

    name: ClassVar[str]
    """What a stand file calls it."""
    settings: ClassVar[type[AcquisitionSettings]]
    """Schema of its entry, whose ``kind`` is a ``Literal`` of :attr:`name`."""
    sources: ClassVar[tuple[str, ...]]
    """Documents it was made from, with edition or date."""
    confirmed: ClassVar[bool] = False
    """Whether it was tried on hardware."""

    @abstractmethod
    def driver(self, settings: SettingsT, site: InstrumentSite) -> AcquisitionDevice:
        """Return its driver, not started yet."""

    def moved(self, settings: SettingsT, host: str, ports: Sequence[int]) -> SettingsT:
        """Return the entry on other ports of a host: those of a simulated device; unchanged without one."""
        del host, ports
        return settings

    @abstractmethod
    def wire(self, settings: SettingsT, folder: Path) -> TcpAddress | SerialAddress:
        """Return where it is reached, relative paths from the stand file's folder."""

    def candidates(self) -> Iterable[Candidate]:
        """Return the devices of this kind that a foreign one on Modbus could be; none by default."""
        return ()

    def demand(self, settings: SettingsT, folder: Path) -> None:
        """Refuse an entry that is in order by itself, but not with the files that it names.

        Parameters
        ----------
        settings : AcquisitionSettings
        folder : Path
            Of the stand file.

        Raises
        ------
        BadInput
            Without a file: its place is a key of the entry, ``input.0.point``. With one: it is that file's.
        """


Kind = AcquisitionKind[Any]
