"""The stand file (STAND.toml): its schema, the bounds of its numbers, and reading it."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.stand_file.bounds import (
        power_on_C,
    )
    from bufferstand.drivers.stand_file.figures import (
        FigureChannels,
    )
    from bufferstand.drivers.stand_file.instrument_lists import (
        acquisition_stream,
    )
    from bufferstand.drivers.stand_file.loading import (
        load_stand,
    )
    from bufferstand.drivers.stand_file.recording_stand import (
        RecordingLimits,
        RecordingStand,
        has_controller,
        load_any_stand,
        load_recording_stand,
    )
    from bufferstand.drivers.stand_file.schema import (
        ControllerSettings,
        Endpoints,
        StandFile,
        wires_from,
        with_endpoints,
    )

__all__ = [
    "ControllerSettings",
    "Endpoints",
    "FigureChannels",
    "RecordingLimits",
    "RecordingStand",
    "StandFile",
    "acquisition_stream",
    "has_controller",
    "load_any_stand",
    "load_recording_stand",
    "load_stand",
    "power_on_C",
    "wires_from",
    "with_endpoints",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
