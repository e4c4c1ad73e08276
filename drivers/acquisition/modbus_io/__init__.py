"""Modbus I/O by description: devices whose registers a TOML file describes, polled over TCP or a line."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.acquisition.modbus_io.description import (
        Description,
        load_description,
        shipped_descriptions,
    )
    from bufferstand.drivers.acquisition.modbus_io.points import (
        Point,
        resolved_points,
    )
    from bufferstand.drivers.acquisition.modbus_io.reads import (
        Image,
        planned_reads,
    )
    from bufferstand.drivers.acquisition.modbus_io.settings import (
        ModbusIoSettings,
    )

__all__ = [
    "Description",
    "Image",
    "ModbusIoSettings",
    "Point",
    "load_description",
    "planned_reads",
    "resolved_points",
    "shipped_descriptions",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
