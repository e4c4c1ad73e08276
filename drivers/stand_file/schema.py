"""STAND.toml: what a test stand is made of, as its users write it down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    create_model,
    model_serializer,
    model_validator,
)

from bufferstand.drivers.acquisition import acquisition_kind_of
from bufferstand.drivers.controllers import REGISTERS, ControllerKind, controller_kind, controller_kinds
from bufferstand.drivers.instruments import (
    STAND_FORCE_KN,
    TAGS,
    Baud,
    Instrument,
    MassAccuracy,
    MovingMass,
    Place,
    ReplyTime,
    SensorEntry,
    StandForce,
    StandFrequency,
    StandSpeed,
    Stiffness,
    TcpAddress,
    Thermometers,
    Travel,
    Watchdog,
    demand_channel,
    kind_of,
    stream_name,
)
from bufferstand.drivers.register_maps import (
    REQUIRED_CHANNELS,
    Profile,
    hole_in_strokes,
    load_profile,
    missing_channels,
    quantity_of,
    unknown_name,
)
from bufferstand.drivers.stand_file.figures import FigureChannels, demand_beside
from bufferstand.drivers.stand_file.instrument_lists import (
    AcquisitionEntry,
    AmplifierEntry,
    OneOrMore,
    OtherEntry,
    TemperatureEntry,
    acquisition_stream,
    instruments_in,
    thermometers_in,
)
from bufferstand.foundation import BadInput, curve_problem
from bufferstand.foundation.channels import CHANNEL_UNITS, Channel
from bufferstand.foundation.settings import Settings, Within, WrongKeyError

LONGEST_RTU_BITS = (17 + 255) * 11
"""Bits on a line of the largest exchange: a request of function 23 and a reply of 125 registers."""


def _as_tuple(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def _as_pairs(value: object) -> object:
    """Take a TOML array of arrays for a tuple of pairs."""
    return tuple(_as_tuple(pair) for pair in value) if isinstance(value, list | tuple) else value


class StandFacts(Settings):
    """Which stand it is."""

    id: str = Field(min_length=1)
    """Short name; the operator types it before a stand moves by hand."""
    name: str = ""
    """Name for reports."""
    laboratory: str = ""
    """Laboratory, for reports."""
    moving_mass_kg: MovingMass | None = None
    """Mass between load cell and specimen that moves with the stroke; the evaluation corrects for it [kg]."""
    moving_mass_accuracy_percent: MassAccuracy | None = None
    """Limit of the error of that mass, in per cent of it; 5 % where it is not stated."""
    force_cell: Literal["moving-side", "fixed-side"] | None = None
    """Where the load cell is: it pushes the mass (``moving-side``, as where nothing is stated), or stands
    behind the specimen (``fixed-side``)."""
    tilt_max_mm: Annotated[float, Field(gt=0)] | None = None
    """Largest difference of any two draw wires; a larger one is tilt, or a slack or snagged wire [mm]."""


class StandFileLimits(Settings):
    """What the stand can stand; the controller gets force and stroke too."""

    force_max_kN: StandForce
    """Greatest force of the stand [kN]."""
    stroke_max_mm: Travel
    """Travel of the piston [mm]."""
    frequency_max_Hz: StandFrequency
    """Greatest frequency [Hz]."""
    speed_max_mm_per_s: StandSpeed
    """Greatest speed of the piston [mm/s]."""
    machine_stiffness_kN_per_mm: Stiffness | None = None
    """Frame, load cell and fixture in series: piston against specimen. None: not known, taken for rigid."""
    force_speed: (
        Annotated[
            tuple[tuple[float, float], ...],
            BeforeValidator(_as_pairs),
            Within(0.0, 10_000.0, "no stand for buffers has more kN or mm/s"),
        ]
        | None
    ) = None
    """Pairs of force [kN] and the greatest speed there [mm/s]; None: ``speed_max_mm_per_s`` at any force."""

    @model_validator(mode="after")
    def _a_curve(self) -> StandFileLimits:
        if self.force_speed is None:
            return self
        if problem := curve_problem(self.force_speed):
            raise WrongKeyError(f"force_speed: {problem}", "force_speed")
        last_kN, most_kN = self.force_speed[-1][0], self.force_max_kN
        # A force that no stand has is refused by its own bound, which says more: newtons taken for kN.
        if last_kN < most_kN <= STAND_FORCE_KN.high:
            raise WrongKeyError(
                f"force_max_kN = {most_kN:g} is more than force_speed knows of, which ends at "
                f"{last_kN:g} kN; write force_max_kN = {last_kN:g} or less, or add to force_speed the speed "
                f"that is left at {most_kN:g} kN",
                "force_max_kN",
            )
        return self

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what the stand file does not state."""
        content: dict[str, Any] = handler(self)
        return {key: value for key, value in content.items() if value is not None}


class _ControllerTable(Settings):
    """The actuator controller behind Modbus TCP."""

    kind: str = REGISTERS
    """Which kind of controller; each but the first has a table of its own, ``[controller.KIND]``."""
    profile: str = "ring"
    """Register profile: ``ring``, ``polling``, ``rmc``, or a path ending in ``.toml``."""
    host: str = ""
    """Address, for Modbus TCP."""
    port: int = Field(default=502, ge=1, le=65535)
    """Port of Modbus TCP."""
    serial: str = ""
    """Serial device of a controller on Modbus RTU, instead of ``host``."""
    baud: Baud = 19200
    """Speed of the serial line."""
    parity: Literal["none", "even", "odd"] = "even"
    """Parity of the serial line."""
    stop_bits: Literal[1, 2] = 1
    """Stop bits of the serial line."""
    device_id: int = Field(default=1, ge=0, le=255)
    """Unit number."""
    timeout_s: ReplyTime = 0.5
    """Longest wait for one reply [s]."""
    watchdog_s: Watchdog = 2.0
    """The controller ramps to zero force by itself after this long without a heartbeat [s]."""
    channel: Annotated[tuple[Channel, ...], BeforeValidator(_as_tuple)]
    """``[[controller.channel]]``: what it samples."""

    @model_validator(mode="before")
    @classmethod
    def _profile_of_its_kind(cls, value: Any) -> Any:
        """Name the profile of the kind where the file names none."""
        if isinstance(value, dict) and "profile" not in value:
            for kind in controller_kinds():
                if kind.name == value.get("kind"):
                    return {**value, "profile": kind.profile}
        return value

    @model_validator(mode="after")
    def _its_table(self) -> _ControllerTable:
        names = [kind.name for kind in controller_kinds()]
        if self.kind not in names:
            raise WrongKeyError(f"kind = “{self.kind}” is none; there are {', '.join(names)}", "kind")
        for kind in controller_kinds():
            if kind.settings is None:
                continue
            there = getattr(self, kind.name) is not None
            if there and self.kind != kind.name:
                raise WrongKeyError(
                    f"a table [controller.{kind.name}] is of kind = “{kind.name}”; write that, "
                    "or leave it out",
                    kind.name,
                )
            if self.kind == kind.name and not there:
                raise WrongKeyError(f"kind = “{kind.name}” needs a table [controller.{kind.name}]", "kind")
        return self

    @property
    def of_kind(self) -> ControllerKind:
        """What it is."""
        return controller_kind(self.kind)

    @property
    def kind_settings(self) -> Settings | None:
        """The table of its kind."""
        return getattr(self, self.kind, None)

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only other kinds have, so that a stand file of before reads as it did."""
        content: dict[str, Any] = handler(self)
        if content["kind"] == REGISTERS:
            del content["kind"]
        for kind in controller_kinds():
            if kind.settings is not None and content.get(kind.name) is None:
                content.pop(kind.name, None)
        return content

    @model_validator(mode="after")
    def _one_wire(self) -> _ControllerTable:
        if bool(self.host) == bool(self.serial):
            raise WrongKeyError("give either host (Modbus TCP) or serial (Modbus RTU)", "host", "serial")
        longest_s = LONGEST_RTU_BITS / self.baud
        if self.serial and self.timeout_s < longest_s:
            raise WrongKeyError(
                f"timeout_s = {self.timeout_s:g} is too short: at {self.baud} baud the longest request and "
                f"its reply take {longest_s:.2g} s on the line",
                "timeout_s",
                "baud",
            )
        return self

    @model_validator(mode="after")
    def _channels_complete(self) -> _ControllerTable:
        names = [channel.name for channel in self.channel]
        for number, channel in enumerate(self.channel):
            if channel.name in names[:number]:
                raise WrongKeyError(
                    f"channel “{channel.name}” is there twice; leave one out", ("channel", number, "name")
                )
            quantity = quantity_of(channel.name)
            if quantity is None:
                raise WrongKeyError(unknown_name(channel.name), ("channel", number, "name"))
            units = CHANNEL_UNITS[quantity]
            unit = channel.unit if channel.unit in units else units[0]
            demand_channel(channel, quantity, unit, place=("channel", number))
        if missing := missing_channels(names):
            why = "; ".join(f"{name}: {REQUIRED_CHANNELS[name]}" for name in missing)
            raise ValueError(f"the controller's channels are incomplete; add {', '.join(missing)} ({why})")
        if problem := hole_in_strokes(names):
            raise WrongKeyError(problem, "channel")
        if self.watchdog_s < 2 * self.timeout_s:
            raise WrongKeyError(
                f"watchdog_s = {self.watchdog_s:g} must be at least twice timeout_s = {self.timeout_s:g}, "
                f"or one slow reply stops the stand; write timeout_s = {0.5 * self.watchdog_s:g} or less, or "
                "a longer watchdog_s",
                "watchdog_s",
                "timeout_s",
            )
        return self


if TYPE_CHECKING:

    class ControllerSettings(_ControllerTable):
        """The actuator controller, with a table of each kind."""

else:
    ControllerSettings = create_model(
        "ControllerSettings",
        __base__=_ControllerTable,
        __module__=__name__,
        __doc__=_ControllerTable.__doc__,
        **{one.name: (one.settings | None, None) for one in controller_kinds() if one.settings is not None},
    )


class StandFile(Settings):
    """A checked STAND.toml. ``model_dump`` gives it back as written, without this machine's folders."""

    stand: StandFacts
    limits: StandFileLimits
    controller: ControllerSettings
    amplifier: Annotated[tuple[AmplifierEntry, ...], OneOrMore()] = ()
    """Measuring amplifiers on load cells, beside the controller: a table, or a list of them."""
    temperature: Annotated[tuple[TemperatureEntry, ...], OneOrMore()] = ()
    """Devices of thermometers: a table, or a list of them."""
    sensor: Annotated[tuple[OtherEntry, ...], OneOrMore()] = ()
    """Instruments of any other quantity: a table, or a list of them."""
    acquisition: Annotated[tuple[AcquisitionEntry, ...], OneOrMore()] = ()
    """Devices of many channels with a clock of their own, beside the controller: a table, or a list."""
    figures: FigureChannels = FigureChannels()
    """Of which channels the figures are made."""
    simulation: dict[str, Any] | None = None
    """Only the simulated stand reads it, and checks it."""
    _path: Path = PrivateAttr(default=Path("stand.toml"))

    @model_validator(mode="after")
    def _names_differ(self) -> StandFile:
        for number, device in enumerate(self.acquisition):
            demand_beside(device.channels, ("acquisition", number))
        names = [channel.name for channel in self.controller.channel]
        names += [one.channel.name for one in self.instruments]
        names += [channel.name for device in self.acquisition for channel in device.channels]
        names += [sensor.name for sensor in self.temperature_sensors]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two channels of the stand have the name “{name}”; give each its own")
        places = [sensor.place for sensor in self.temperature_sensors]
        for place in places:
            if places.count(place) > 1:
                raise ValueError(f"two sensors have the place “{place}”; give each its own")
        return self

    @model_validator(mode="after")
    def _two_clocks(self) -> StandFile:
        streams = {"controller": self.controller.channel}
        for number, device in enumerate(self.acquisition):
            if not device.own_clock:
                raise WrongKeyError(
                    f"a device of kind “{device.kind}” is polled, and stamped by this computer: nothing "
                    "aligns it with the controller's samples well enough for a figure; use it in record-only "
                    "mode (a stand file without [controller]), or list its quantity in [[sensor]]",
                    ("acquisition", number, "kind"),
                )
            if not device.clock_is_readable:
                raise WrongKeyError(
                    "the clock of this device cannot be read, so that nothing says how it lies to the "
                    "controller's; use it in record-only mode, or another device",
                    ("acquisition", number, "kind"),
                )
            streams[acquisition_stream(number)] = device.channels
        self.figures.demand(streams)
        return self

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write one amplifier, and one device of thermometers, as a table, as ever; none as null."""
        content: dict[str, Any] = handler(self)
        for table in ("amplifier", "temperature"):
            if len(content[table]) < 2:
                content[table] = content[table][0] if content[table] else None
        for table in ("sensor", "acquisition"):
            if not content[table]:
                del content[table]
        if self.figures == FigureChannels():
            del content["figures"]
        return content

    @property
    def instruments(self) -> tuple[Instrument, ...]:
        """The instruments beside the controller, without thermometers: amplifiers, then sensors."""
        return instruments_in(self.amplifier, self.sensor, self.folder)

    @property
    def thermometers(self) -> tuple[Thermometers, ...]:
        """The devices of thermometers."""
        return thermometers_in(self.temperature, self.folder)

    @property
    def temperature_sensors(self) -> tuple[SensorEntry, ...]:
        """The sensors of all of them."""
        return tuple(sensor for device in self.thermometers for sensor in device.sensors)

    @property
    def path(self) -> Path:
        """The file it was read from."""
        return self._path

    @property
    def folder(self) -> Path:
        """Folder that relative paths in it start from."""
        return self._path.parent

    def profile(self) -> Profile:
        """Return the controller's register profile.

        Raises
        ------
        BadInput
            If there is none of that name, or it breaks its schema.
        """
        try:
            return load_profile(self.controller.profile, self.folder)
        except BadInput as error:
            if error.file is not None:
                raise
            raise BadInput(
                error.problem, file=self._path, place="controller.profile", remedy=error.remedy
            ) from None

    def controller_serial(self) -> Path | None:
        """Return the controller's serial device, if it is on Modbus RTU."""
        return self.folder / self.controller.serial if self.controller.serial else None


@dataclass(frozen=True)
class Endpoints:
    """Where a simulated stand serves its wires; ``None`` keeps what the stand file says.

    Parameters
    ----------
    host, port
        Of the controller's Modbus TCP server.
    instruments : mapping of str to Path or TcpAddress
        By stream, of thermometers by the name of their wire: serial device, folder, or port of a host. Those
        that are not there stay where they are.
    acquisition : mapping of str to (str, sequence of int)
        Of acquisition devices by stream: host and ports.
    controller_serial : Path
        The controller's serial device, where it is on Modbus RTU.
    timeout_s : float
        Longest wait for a reply over TCP [s]: a served stand shares a computer, and may be starved.
    """

    host: str | None = None
    port: int | None = None
    instruments: Mapping[str, Place] = field(default_factory=dict)
    controller_serial: Path | None = None
    timeout_s: float | None = None
    acquisition: Mapping[str, tuple[str, Sequence[int]]] = field(default_factory=dict)


def wires_from(stand_file: StandFile, folder: Path) -> StandFile:
    """Return the same stand with the relative paths of its devices starting from another folder.

    For a copy of a stand file: its devices lie where they lay for the original.
    """
    entries = (*stand_file.instruments, *stand_file.thermometers)
    wires = {one.stream: one.wire(folder) for one in entries}
    return with_endpoints(
        stand_file,
        Endpoints(
            instruments={
                stream: wire.path for stream, wire in wires.items() if not isinstance(wire, TcpAddress)
            },
            controller_serial=folder / stand_file.controller.serial if stand_file.controller.serial else None,
        ),
    )


def with_endpoints(stand_file: StandFile, endpoints: Endpoints) -> StandFile:
    """Return the same stand on other wires: those of a simulated stand.

    For the run file keep the original: its paths belong to no machine.
    """
    controller = stand_file.controller.model_copy(
        update={
            key: value
            for key, value in (("host", endpoints.host), ("port", endpoints.port))
            if value is not None
        }
    )
    if controller.serial and endpoints.controller_serial is not None:
        controller = controller.model_copy(update={"serial": str(endpoints.controller_serial.absolute())})
    elif not controller.serial and endpoints.timeout_s is not None:
        controller = controller.model_copy(update={"timeout_s": endpoints.timeout_s})
    changes: dict[str, Any] = {"controller": controller}
    for table in TAGS:
        changes[table] = tuple(
            _moved(entry, endpoints.instruments.get(stream_name(table, number)), endpoints.timeout_s)
            for number, entry in enumerate(getattr(stand_file, table))
        )
    changes["acquisition"] = tuple(
        acquisition_kind_of(entry).moved(entry, *endpoints.acquisition[stream])
        if (stream := acquisition_stream(number)) in endpoints.acquisition
        else entry
        for number, entry in enumerate(stand_file.acquisition)
    )
    return stand_file.model_copy(update=changes)


def _moved(entry: Settings, place: Place | None, timeout_s: float | None) -> Settings:
    if place is None:
        return entry
    moved: Settings = kind_of(entry).moved(entry, place, timeout_s)
    return moved
