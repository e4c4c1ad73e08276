"""The simulated machine without wires: controller, actuator, specimen and transducers, sample by sample."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.simulated.machine.acquisition import (
        Scans,
        SimulatedAcquisition,
    )
    from bufferstand.drivers.simulated.machine.commands import (
        AT_MEAN_MM,
        ENABLE_OPERATION,
        ENABLE_VOLTAGE,
        QUICK_STOP_OFF,
        SWITCH_ON,
        Command,
        CommandCode,
        ControllerFault,
        RejectReason,
    )
    from bufferstand.drivers.simulated.machine.controller import (
        SimulatedController,
    )
    from bufferstand.drivers.simulated.machine.device import (
        RATE_HZ,
        SimulatedDevice,
    )
    from bufferstand.drivers.simulated.machine.instruments import (
        InstrumentValues,
        SimulatedInstrument,
    )
    from bufferstand.drivers.simulated.machine.physics import (
        Spring,
    )
    from bufferstand.drivers.simulated.machine.ring import (
        SampleRing,
    )
    from bufferstand.drivers.simulated.machine.thermometer import (
        Thermometer,
    )
    from bufferstand.drivers.simulated.machine.truth import (
        TruthLog,
    )
    from bufferstand.drivers.simulated.machine.writer_lock import (
        SingleWriterLock,
    )

__all__ = [
    "AT_MEAN_MM",
    "ENABLE_OPERATION",
    "ENABLE_VOLTAGE",
    "QUICK_STOP_OFF",
    "RATE_HZ",
    "SWITCH_ON",
    "Command",
    "CommandCode",
    "ControllerFault",
    "InstrumentValues",
    "RejectReason",
    "SampleRing",
    "Scans",
    "SimulatedAcquisition",
    "SimulatedController",
    "SimulatedDevice",
    "SimulatedInstrument",
    "SingleWriterLock",
    "Spring",
    "Thermometer",
    "TruthLog",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
