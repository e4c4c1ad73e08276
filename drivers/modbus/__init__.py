"""Modbus: the wires (TCP, RTU), requests with checked replies, and the pipelined exchange of function 23."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.modbus.likeness import (
        Candidate,
        Found,
        Likeness,
        look_at,
    )
    from bufferstand.drivers.modbus.link import (
        EXCEPTION_TEXTS,
        HURRY_S,
        LONGER,
        BitTable,
        Exchange,
        ModbusLink,
        ModbusRefusal,
        Table,
    )
    from bufferstand.drivers.modbus.wires import (
        RtuWire,
        TcpWire,
        Wire,
        with_quick_replies,
    )

__all__ = [
    "EXCEPTION_TEXTS",
    "HURRY_S",
    "LONGER",
    "BitTable",
    "Candidate",
    "Exchange",
    "Found",
    "Likeness",
    "ModbusLink",
    "ModbusRefusal",
    "RtuWire",
    "Table",
    "TcpWire",
    "Wire",
    "look_at",
    "with_quick_replies",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
