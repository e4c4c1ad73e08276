"""Reading a stand file: its schema, the profile that it names, and the bounds that hang on several keys."""

from __future__ import annotations

from pathlib import Path

from bufferstand.drivers.stand_file.bounds import demand_stand_bounds
from bufferstand.drivers.stand_file.schema import CONTROLLER_CHANNELS, StandFile
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import load_settings, read_text


def load_stand(path: Path) -> StandFile:
    """Read and check a stand file and the profile that it names.

    Raises
    ------
    BadInput
        If it cannot be read, breaks the schema, names a profile that is not there or does not fit, or has a
        setting outside its bounds.
    """
    stand_file = load_settings(path, StandFile)
    stand_file._path = path
    window = stand_file.profile().window
    sampled = set(CONTROLLER_CHANNELS) if window is None else {name for name, _ in window.sample} - {"tick"}
    if sampled != set(CONTROLLER_CHANNELS):
        raise BadInput(
            f"profile “{stand_file.controller.profile}” samples {', '.join(sorted(sampled))}",
            file=path,
            place="controller.profile",
            remedy=f"the ring must sample exactly {', '.join(CONTROLLER_CHANNELS)}",
        )
    demand_stand_bounds(stand_file, stand_file.profile(), read_text(path))
    return stand_file
