"""The simulated devices on real wires: Modbus TCP and RTU, serial instruments, 1-Wire."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.wires.controller_registers import (
        RegisterBank,
    )
    from bufferstand.drivers.simulated.wires.labjack import (
        LabJackTwin,
    )
    from bufferstand.drivers.simulated.wires.modbus_amplifier import (
        ModbusInstrumentWire,
    )
    from bufferstand.drivers.simulated.wires.modbus_requests import (
        Responder,
    )
    from bufferstand.drivers.simulated.wires.modbus_rtu import (
        RtuStandServer,
    )
    from bufferstand.drivers.simulated.wires.modbus_tcp import (
        ModbusStandServer,
    )
    from bufferstand.drivers.simulated.wires.pace import (
        CREDIT_S,
        StandPace,
    )
    from bufferstand.drivers.simulated.wires.rmc_registers import (
        RmcBank,
    )
    from bufferstand.drivers.simulated.wires.sensors import (
        SensorWires,
    )

__all__ = [
    "CREDIT_S",
    "LabJackTwin",
    "ModbusInstrumentWire",
    "ModbusStandServer",
    "RegisterBank",
    "Responder",
    "RmcBank",
    "RtuStandServer",
    "SensorWires",
    "StandPace",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
