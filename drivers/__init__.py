"""Talk to one device each: wires, registers, readings. Knows nothing of tests."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.connect import (
        ControllerAnswer,
        build_controller,
        look_at_controller,
    )
    from bufferstand.drivers.connect_recording import (
        RecordingDevices,
        build_recording,
    )
    from bufferstand.drivers.connect_sensors import (
        build_sensors,
    )
    from bufferstand.drivers.instrument_list import (
        KnownInstrument,
        known_instruments,
        lab_program,
    )
    from bufferstand.drivers.interfaces import (
        NO_REPLY,
        ClockReading,
        Controller,
        ControllerStatus,
        EndReason,
        Identity,
        MotionState,
        OwnClock,
        ReadingLimits,
        SampleBlock,
        Sensor,
        SensorFault,
        Stand,
        StreamFacts,
        WriterSeen,
    )

__all__ = [
    "NO_REPLY",
    "ClockReading",
    "Controller",
    "ControllerAnswer",
    "ControllerStatus",
    "EndReason",
    "Identity",
    "KnownInstrument",
    "MotionState",
    "OwnClock",
    "ReadingLimits",
    "RecordingDevices",
    "SampleBlock",
    "Sensor",
    "SensorFault",
    "Stand",
    "StreamFacts",
    "WriterSeen",
    "build_controller",
    "build_recording",
    "build_sensors",
    "known_instruments",
    "lab_program",
    "look_at_controller",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
