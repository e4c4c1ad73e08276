"""Instruments beside the controller: what a kind of them is, and which kinds there are."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.instruments.bounded_numbers import (
        STAND_FORCE_KN,
        Baud,
        CellRange,
        MassAccuracy,
        MovingMass,
        ReplyTime,
        SampleRate,
        SensorDelay,
        SensorPeriod,
        StandForce,
        StandFrequency,
        StandSpeed,
        Stiffness,
        Travel,
        Watchdog,
    )
    from bufferstand.drivers.instruments.catalogue import (
        Instrument,
        Thermometers,
        kind_of,
        kinds,
        stream_name,
    )
    from bufferstand.drivers.instruments.channel_rules import (
        demand_channel,
    )
    from bufferstand.drivers.instruments.kind import (
        TAGS,
        InstrumentKind,
        InstrumentSite,
        NumberForm,
        SerialKind,
        SerialSettings,
        SignalKind,
        Table,
        demand_port,
        demand_rate,
    )
    from bufferstand.drivers.instruments.thermometer_kind import (
        SensorEntry,
        SensorFaults,
        SensorType,
        SerialThermometerKind,
        SimulatedSensor,
        SimulatedThermometers,
        TemperatureEntry,
        ThermometerKind,
        ThermometerNote,
    )
    from bufferstand.drivers.instruments.wire_address import (
        FolderAddress,
        Place,
        SerialAddress,
        TcpAddress,
        WireAddress,
    )
    from bufferstand.drivers.instruments.wire_device import (
        Counts,
        WireDevice,
    )

__all__ = [
    "STAND_FORCE_KN",
    "TAGS",
    "Baud",
    "CellRange",
    "Counts",
    "FolderAddress",
    "Instrument",
    "InstrumentKind",
    "InstrumentSite",
    "MassAccuracy",
    "MovingMass",
    "NumberForm",
    "Place",
    "ReplyTime",
    "SampleRate",
    "SensorDelay",
    "SensorEntry",
    "SensorFaults",
    "SensorPeriod",
    "SensorType",
    "SerialAddress",
    "SerialKind",
    "SerialSettings",
    "SerialThermometerKind",
    "SignalKind",
    "SimulatedSensor",
    "SimulatedThermometers",
    "StandForce",
    "StandFrequency",
    "StandSpeed",
    "Stiffness",
    "Table",
    "TcpAddress",
    "TemperatureEntry",
    "ThermometerKind",
    "ThermometerNote",
    "Thermometers",
    "Travel",
    "Watchdog",
    "WireAddress",
    "WireDevice",
    "demand_channel",
    "demand_port",
    "demand_rate",
    "kind_of",
    "kinds",
    "stream_name",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
