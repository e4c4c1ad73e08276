"""A kind of instrument beside the controller: its settings, its driver and its simulated device."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Generic, Literal, Protocol, TypeVar

from bufferstand.drivers.instruments.wire_address import Place, SerialAddress, WireAddress
from bufferstand.drivers.instruments.wire_device import WireDevice
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.register_maps import AmplifierMap
from bufferstand.foundation import Clock
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings, WrongKeyError

Table = Literal["amplifier", "temperature", "sensor"]
"""Lists of a stand file in which instruments stand: ``[[amplifier]]`` on a load cell, ``[[temperature]]`` of
thermometers, ``[[sensor]]`` else."""
TAGS: dict[Table, str] = {"amplifier": "protocol", "temperature": "kind", "sensor": "kind"}
"""The key of an entry that names its kind."""


class SignalSettings(Protocol):
    """What an entry of an amplifier or sensor says, besides the keys of its kind."""

    @property
    def rate_Hz(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Values a second that the instrument is set to, or asked for."""
        ...

    @property
    def channel(self) -> Channel:
        """What it measures."""
        ...


class PortSettings(Protocol):
    """An entry of an instrument on a serial line."""

    @property
    def port(self) -> str:
        """Serial device; relative to the stand file's folder."""
        ...

    @property
    def baud(self) -> int:
        """Bits a second on the line."""
        ...


class SerialSettings(PortSettings, SignalSettings, Protocol):
    """An entry of an amplifier or sensor on a serial line."""


SettingsT = TypeVar("SettingsT")
SignalT = TypeVar("SignalT", bound=SignalSettings)
PortT = TypeVar("PortT", bound=PortSettings)
SerialT = TypeVar("SerialT", bound=SerialSettings)


@dataclass(frozen=True)
class InstrumentSite:
    """Where an instrument of a stand is used.

    Parameters
    ----------
    folder : Path
        From which relative paths start: that of the stand file.
    clock : Clock
        Stand time for its stamps, wall time for the judgement of silence.
    stream : str
        What its samples and faults are called: ``amplifier``, ``amplifier_2``, ``sensor`` …
    """

    folder: Path
    clock: Clock
    stream: str


@dataclass(frozen=True)
class NumberForm:
    """In which numbers an instrument measures.

    Parameters
    ----------
    low, high : float
        Ends of its converter, in raw counts.
    whole : bool
        Whether counts are whole numbers.
    dtype : str
        In which its driver records them.
    rate_Hz : float
        Measurements a second.
    every : int
        Each so many-th of them is recorded.
    """

    low: float
    high: float
    whole: bool
    dtype: str
    rate_Hz: float
    every: int = 1


class InstrumentKind(ABC, Generic[SettingsT]):
    """One kind of instrument. A stand file names it; everything else is asked of it.

    A kind lies in a folder of its own below ``drivers/amplifiers`` or ``drivers/thermometers``, whose
    ``kind.py`` has one as ``KIND``, or in another package that names it as an entry point of the group
    ``bufferstand.instruments``. It is a :class:`SignalKind` or a
    :class:`bufferstand.drivers.instruments.thermometer_kind.ThermometerKind`.
    """

    name: ClassVar[str]
    """What a stand file calls it."""
    table: ClassVar[Table]
    """In which list of a stand file it stands."""
    settings: ClassVar[type[Settings]]
    """Schema of its entry there: a subclass of :class:`Settings` that has the keys of :attr:`keys`, and the
    key :data:`TAGS` names as a ``Literal`` of :attr:`name`."""
    keys: ClassVar[tuple[str, ...]]
    """What every entry of this list must have."""
    stated: ClassVar[tuple[str, ...]] = ()
    """Class variables that such a kind states besides."""
    sources: ClassVar[tuple[str, ...]] = ()
    """Documents that it is made from, with edition and pages."""
    confirmed: ClassVar[bool] = False
    """Whether it was confirmed on hardware."""

    @abstractmethod
    def wire(self, settings: SettingsT, folder: Path) -> WireAddress:
        """Return where it is reached."""

    @abstractmethod
    def moved(self, settings: SettingsT, place: Place, timeout_s: float | None = None) -> SettingsT:
        """Return its settings with its wire ending elsewhere.

        Parameters
        ----------
        settings : Settings
        place : Path or TcpAddress
            A serial device, a folder or a port of a host, as :meth:`wire` is one.
        timeout_s : float, optional
            Longest wait for a reply there [s], where the kind has such a key.
        """


class SignalKind(InstrumentKind[SignalT]):
    """A kind of amplifier or sensor: it measures one channel."""

    keys: ClassVar = ("rate_Hz", "channel")

    @abstractmethod
    def driver(self, settings: SignalT, site: InstrumentSite) -> Sensor:
        """Return its driver, not started yet.

        Raises
        ------
        BadInput
            If a file that the settings name cannot be read.
        """

    @abstractmethod
    def form(self, settings: SignalT, folder: Path) -> NumberForm:
        """Return in which numbers it measures: for the simulated one."""

    def ends(self, settings: SignalT, folder: Path) -> tuple[float, float] | None:
        """Return the least and greatest count that it can deliver; None where nothing tells."""
        form = self.form(settings, folder)
        return (form.low, form.high) if form.whole else None

    def simulated(self, settings: SignalT) -> WireDevice | None:
        """Return the simulated instrument on its serial line; None where none is simulated."""
        del settings
        return None

    def simulated_in(self, settings: SignalT, folder: Path) -> WireDevice | None:
        """Return the same, where it is made by a file that lies relative to the stand file's folder."""
        del folder
        return self.simulated(settings)

    def unit(self, settings: SignalT) -> int:
        """Return the unit at which an instrument behind Modbus answers."""
        del settings
        return 1

    def registers(self, settings: SignalT, folder: Path) -> AmplifierMap | None:
        """Return the register map of an instrument behind Modbus, which is simulated by it; None of others.

        Raises
        ------
        BadInput
            If it cannot be read.
        """
        del settings, folder
        return None


class OnSerialLine(InstrumentKind[PortT]):
    """What is on a serial line of its own: key ``port`` of its settings."""

    def wire(self, settings: PortT, folder: Path) -> SerialAddress:
        """Return its serial device."""
        return SerialAddress(folder / settings.port, settings.baud)

    def moved(self, settings: PortT, place: Place, timeout_s: float | None = None) -> PortT:
        """Return its settings with another serial device."""
        del timeout_s
        assert isinstance(settings, Settings)
        assert isinstance(place, Path)
        return settings.model_copy(update={"port": str(place.absolute())})


class SerialKind(OnSerialLine[SerialT], SignalKind[SerialT]):
    """A kind of amplifier or sensor on a serial line of its own."""


def demand_port(settings: PortSettings) -> None:
    """Refuse an entry without its serial device.

    Raises
    ------
    WrongKeyError
        If ``port`` is empty.
    """
    if not settings.port:
        raise WrongKeyError("port must name the serial device", "port")


def demand_rate(settings: SerialSettings, bits: int, bytes_per_value: int) -> None:
    """Refuse a data rate that a serial line cannot carry.

    Parameters
    ----------
    settings : SerialSettings
    bits : int
        On the line for a byte: start, data, parity and stop bits.
    bytes_per_value : int

    Raises
    ------
    WrongKeyError
        With the rate that it carries.
    """
    most = settings.baud / (bits * bytes_per_value)
    if settings.rate_Hz > most:
        raise WrongKeyError(
            f"rate_Hz = {settings.rate_Hz:g} does not fit the line: {settings.baud} baud carries {most:g}; "
            f"write rate_Hz = {int(most):g} or less, or a larger baud",
            "rate_Hz",
            "baud",
        )
