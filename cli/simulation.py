"""The simulated stand as a process of its own, for ``demo`` and ``run --simulate``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cli.campaigns import Prepared
from drivers.simulated.process import start_process, wires_folder
from drivers.stand_file import StandFile, with_endpoints


@contextmanager
def simulated_stand(prepared: Prepared, *, speed: float, truth: Path | None = None) -> Iterator[StandFile]:
    """Serve the campaign's stand, with the campaign's specimen in it, while inside.

    Yields
    ------
    StandFile
        The stand file with the addresses of the simulated wires.

    Raises
    ------
    BadInput, DeviceFault
        If the stand file has no usable ``[simulation]`` or the process does not come up.
    """
    with (
        wires_folder() as folder,
        start_process(
            prepared.stand_file.path,
            directory=folder,
            model=prepared.model_path,
            speed=speed,
            truth=truth,
        ) as process,
    ):
        yield with_endpoints(prepared.stand_file, process.served.endpoints())
