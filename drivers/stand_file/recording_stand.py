"""A stand file without a controller: what a stand that others move is measured with, and its limits."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, SerializerFunctionWrapHandler, model_serializer, model_validator

from bufferstand.drivers.acquisition import acquisition_kind_of
from bufferstand.drivers.instruments import (
    Instrument,
    SensorEntry,
    StandForce,
    Thermometers,
    Travel,
)
from bufferstand.drivers.stand_file.instrument_lists import (
    ACQUISITION,
    AcquisitionEntry,
    AmplifierEntry,
    OneOrMore,
    OtherEntry,
    TemperatureEntry,
    acquisition_stream,
    instruments_in,
    thermometers_in,
)
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFacts, StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import CHANNEL_UNITS, STROKE_CHANNELS, Channel
from bufferstand.foundation.settings import (
    Settings,
    Within,
    WrongKeyError,
    load_settings,
    place_of,
    read_text,
    toml_document,
)

SPECIMEN_C = Within(-50.0, 300.0, "no elastomer or rubber is tested colder or warmer")


class RecordingLimits(Settings):
    """Beyond these a recording warns; what is not stated is not watched. Nothing is stopped by itself."""

    force_max_kN: StandForce | None = None
    force_min_kN: (
        Annotated[float, Field(le=0.0), Within(-10_000.0, 0.0, "no stand pulls with more")] | None
    ) = None
    stroke_max_mm: Travel | None = None
    temperature_max_C: Annotated[float, SPECIMEN_C] | None = None
    silence_s: Annotated[float, Field(gt=0), Within(0.5, 600.0, "a silence is seen after a few readings")] = (
        5.0
    )
    """A device that delivers nothing for so long is warned of [s]."""
    ask_for_stop: bool = False
    """Whether what is beyond a limit also sets the devices' ``stop_output``."""


class RecordingStand(Settings):
    """A checked stand file without ``[controller]``, for record-only mode."""

    stand: StandFacts
    limits: RecordingLimits = RecordingLimits()
    acquisition: Annotated[tuple[AcquisitionEntry, ...], OneOrMore()] = ()
    """Devices of many channels: a table, or a list of them."""
    amplifier: Annotated[tuple[AmplifierEntry, ...], OneOrMore()] = ()
    temperature: Annotated[tuple[TemperatureEntry, ...], OneOrMore()] = ()
    sensor: Annotated[tuple[OtherEntry, ...], OneOrMore()] = ()
    simulation: dict[str, Any] | None = None
    """Only the simulated stand reads it, and checks it."""
    _path: Path = PrivateAttr(default=Path("stand.toml"))

    @model_validator(mode="after")
    def _measures_something(self) -> RecordingStand:
        channels = [channel for _, channel in self.channels()]
        names = [channel.name for channel in channels]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"two channels of the stand have the name “{name}”; give each its own")
        for channel in channels:
            if channel.unit not in CHANNEL_UNITS[channel.quantity]:
                units = " or ".join(CHANNEL_UNITS[channel.quantity])
                raise ValueError(
                    f"channel “{channel.name}” is in “{channel.unit}”; write unit = “{units}”, and a "
                    "calibration that gives it"
                )
        self._demand_force_and_stroke(names)
        if sum(one.own_clock for one in self.acquisition) > 1:
            raise WrongKeyError(
                "two devices with a clock of their own cannot be recorded in one run yet: their clocks drift "
                "apart; put all channels on one of them",
                "acquisition",
            )
        can_ask = any(getattr(one, "stop_output", "") for one in self.acquisition)
        if self.limits.ask_for_stop and not can_ask:
            raise WrongKeyError(
                "ask_for_stop needs an output; write stop_output in [[acquisition]], or leave it out",
                ("limits", "ask_for_stop"),
            )
        return self

    @staticmethod
    def _demand_force_and_stroke(names: list[str]) -> None:
        if "force" not in names or not set(names) & set(STROKE_CHANNELS):
            raise ValueError(
                "a record needs force and stroke: name one channel “force”, and one “stroke_1” (a second "
                "draw wire “stroke_2”)"
            )

    @model_serializer(mode="wrap")
    def _as_written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what there is not; one amplifier and one device of thermometers is a table, as ever."""
        content: dict[str, Any] = handler(self)
        for table in ("amplifier", "temperature"):
            if len(content[table]) == 1:
                content[table] = content[table][0]
        return {key: value for key, value in content.items() if value not in ([], (), None)}

    def channels(self) -> list[tuple[str, Channel]]:
        """Return every channel with the stream that it comes in."""
        found = [
            (acquisition_stream(number), channel)
            for number, entry in enumerate(self.acquisition)
            for channel in entry.channels
        ]
        found += [(one.stream, one.channel) for one in self.instruments]
        return found + [(sensor.name, sensor.channel()) for sensor in self.temperature_sensors]

    @property
    def instruments(self) -> tuple[Instrument, ...]:
        """Amplifiers, then sensors."""
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


def has_controller(path: Path) -> bool:
    """Say whether a stand file has a controller: then it is for campaigns.

    Raises
    ------
    BadInput
        If it cannot be read.
    """
    return "controller" in toml_document(read_text(path), path)


def load_any_stand(path: Path) -> StandFile | RecordingStand:
    """Read and check a stand file, with a controller or without.

    Raises
    ------
    BadInput
        As :func:`bufferstand.drivers.stand_file.load_stand` and :func:`load_recording_stand`.
    """
    return load_stand(path) if has_controller(path) else load_recording_stand(path)


def load_recording_stand(path: Path) -> RecordingStand:
    """Read and check a stand file without a controller.

    Raises
    ------
    BadInput
        If it cannot be read, has a controller, or breaks the schema.
    """
    if has_controller(path):
        raise BadInput(
            "this stand file has a controller, which record-only mode would leave alone and not record",
            file=path,
            place=place_of(("controller",), read_text(path)),
            remedy="run a campaign (bufferstand run), or write a stand file without [controller] for a stand "
            "that others move",
        )
    stand = load_settings(path, RecordingStand)
    stand._path = path
    for number, entry in enumerate(stand.acquisition):
        try:
            acquisition_kind_of(entry).demand(entry, stand.folder)
        except BadInput as error:
            if error.file is not None:
                raise
            keys = [int(part) if part.isdigit() else part for part in error.place.split(".") if part]
            place = place_of((ACQUISITION, number, *keys), read_text(path))
            raise BadInput(error.problem, file=path, place=place, remedy=error.remedy) from None
    return stand
