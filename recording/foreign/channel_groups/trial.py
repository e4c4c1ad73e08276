"""The process that tries an MDF file: it reads every channel, and ends as its library lets it."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.recording.foreign.channel_groups.mdf import opened
from bufferstand.recording.foreign.library_files import of_library


def read_all(path: Path) -> None:
    """Read all channels; what the library raises is for the process that reads in earnest."""
    with suppress(BadInput), opened(path) as file:
        for number, group in enumerate(file.groups):
            with suppress(BadInput), of_library(path, "MDF file"):
                file.get_master(number)
            for index in range(len(group.channels)):
                with suppress(BadInput), of_library(path, "MDF file"):
                    file.get(group=number, index=index, ignore_invalidation_bits=True)


if __name__ == "__main__":
    read_all(Path(sys.argv[1]))
