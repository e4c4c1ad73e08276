"""A kind of thermometers: its settings, its driver, what its sensors can show, and its simulated device."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Protocol, TypeVar

from bufferstand.drivers.instruments.kind import (
    InstrumentKind,
    InstrumentSite,
    NumberForm,
    OnSerialLine,
    PortSettings,
)
from bufferstand.drivers.interfaces import ReadingLimits, Sensor, StreamFacts
from bufferstand.foundation.channels import Calibration, Channel


class SensorEntry(Protocol):
    """What a stand file says of one sensor, whatever the kind of its device."""

    @property
    def name(self) -> str:
        """Of its stream and its channel: ``temperature_1`` …."""
        ...

    @property
    def place(self) -> str:
        """Where it sits."""
        ...

    @property
    def role(self) -> Literal["specimen", "ambient"]:
        """Whether it is on the specimen: such a one stops a campaign."""
        ...

    @property
    def calibration(self) -> Calibration:
        """What its counts mean."""
        ...

    @property
    def address(self) -> str:
        """By which its device knows it."""
        ...

    @property
    def device(self) -> str:
        """What it is, for the run file."""
        ...

    def channel(self) -> Channel:
        """Return the one channel of its stream."""
        ...


class TemperatureEntry(Protocol):
    """What an entry of ``[[temperature]]`` says, besides the keys of its kind."""

    @property
    def period_s(self) -> float:
        """Time between two readings of a sensor [s]."""
        ...

    @property
    def sensor(self) -> Sequence[SensorEntry]:
        """Its sensors, one or more."""
        ...


EntryT = TypeVar("EntryT", bound=TemperatureEntry)


class SerialTemperatureEntry(PortSettings, TemperatureEntry, Protocol):
    """An entry of thermometers on a serial line."""


SerialEntryT = TypeVar("SerialEntryT", bound=SerialTemperatureEntry)


class SimulatedSensor(Protocol):
    """A sensor of the simulated stand, as its simulated device sees it."""

    @property
    def settings(self) -> SensorEntry:
        """Its entry."""
        ...

    @property
    def conversions(self) -> int:
        """How often it has measured."""
        ...

    @property
    def count(self) -> int:
        """What it has measured last."""
        ...


class SensorFaults(Protocol):
    """What shall fail."""

    def at(self, target: str, time_s: float) -> str | None:
        """Return the fault that a sensor shows at stand time ``time_s`` [s], by its stream's name."""
        ...


class SimulatedThermometers(Protocol):
    """A simulated device of thermometers, on a serial line or as a folder that it keeps itself."""

    def update(self, now_s: float) -> bytes:
        """Take over what is there at stand time ``now_s`` [s]; return what goes onto the line by itself."""
        ...

    def obey(self, data: bytes) -> bytes:
        """Take bytes from the line; return the answers."""
        ...

    def close(self) -> None:
        """Take away what it has made."""
        ...


@dataclass(frozen=True)
class ThermometerNote:
    """What is remarkable about a device of thermometers, found without reading a temperature.

    Parameters
    ----------
    device, item, value : str
        First columns of the row of ``bufferstand check``.
    remark : str
        What is remarkable, and what to do.
    """

    device: str
    item: str
    value: str
    remark: str


@dataclass(frozen=True)
class SensorType:
    """A type of temperature sensor: what its counts mean, and which can be true.

    Parameters
    ----------
    nominal : Calibration
        What a count means without a certificate.
    form : NumberForm
        In which counts it measures, and how often it does [1/s].
    uncorrected : str
        What it is and how far off without a correction, for messages: “a Pt100 (…) is off by 0.3 K”.
    corrected_K : float
        By so much a certificate corrects it at most [K].
    faults : mapping of str to str or None
        Faults that the simulated stand can let it show, and what the driver says of each; None where it says
        nothing of that sensor.
    power_on : float or None
        Count of one that was reset and has not measured; None where there is none.
    """

    nominal: Calibration
    form: NumberForm
    uncorrected: str
    corrected_K: float
    faults: Mapping[str, str | None]
    power_on: float | None = None

    def stream_facts(self, sensor: SensorEntry, period_s: float, *, simulated: bool = False) -> StreamFacts:
        """Return what the stream of such a sensor is made of."""
        device = f"{sensor.device}, simulated" if simulated else sensor.device
        low_C, high_C = (float(self.nominal.apply(end)) for end in (self.form.low, self.form.high))
        power_on_C = None if self.power_on is None else float(self.nominal.apply(self.power_on))
        return StreamFacts(
            sensor.name,
            "host",
            (sensor.channel(),),
            1.0 / period_s,
            device,
            simulated,
            ReadingLimits(low_C, high_C, power_on_C),
        )


class ThermometerKind(InstrumentKind[EntryT]):
    """A kind of thermometers: a device (or bus) with one or more sensors, each a stream of its own."""

    table: ClassVar = "temperature"
    keys: ClassVar = ("period_s", "sensor")
    stated: ClassVar = ("sensor_type",)

    sensor_type: ClassVar[SensorType]
    """What its sensors are."""
    wire_name: ClassVar[str] = ""
    """Where the first such wire lies in the folder of a simulated stand's wires; empty: by its stream."""

    @abstractmethod
    def drivers(self, settings: EntryT, site: InstrumentSite) -> tuple[Sensor, ...]:
        """Return the driver of each sensor, in the order of the entry, not started yet.

        A driver leaves out every reading that cannot be true, and says why. Its stream has the sensor's name.
        """

    @abstractmethod
    def simulated(
        self, settings: EntryT, sensors: Sequence[SimulatedSensor], faults: SensorFaults, place: Path
    ) -> SimulatedThermometers:
        """Return the simulated device of the sensors.

        Parameters
        ----------
        settings : Settings
        sensors : sequence of SimulatedSensor
            In the order of the entry.
        faults : SensorFaults
            What they shall show.
        place : Path
            The folder that it is to keep, where its wire is one.

        Raises
        ------
        BadInput
            If that cannot be made.
        """

    def notes(self, settings: EntryT, folder: Path) -> Iterator[ThermometerNote]:
        """Yield what is remarkable about the device, for ``bufferstand check``."""
        del settings, folder
        yield from ()


class SerialThermometerKind(OnSerialLine[SerialEntryT], ThermometerKind[SerialEntryT]):
    """A kind of thermometers on a serial line of its own."""
