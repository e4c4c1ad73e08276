"""The simulated stand as a process of its own, for ``demo`` and ``run --simulate``."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.drivers.simulated.serving import StandClock
from bufferstand.drivers.stand_file import StandFile, with_endpoints
from bufferstand.foundation import Clock

STARVED_S = 10.0
"""Longest wait for a reply of the simulated stand [s of the wall]: a busy machine starves its process."""


@contextmanager
def simulated_stand(
    prepared: PreparedCampaign, *, speed: float, truth: Path | None = None
) -> Iterator[tuple[StandFile, Clock]]:
    """Serve the campaign's stand, with the campaign's specimen in it, while inside.

    Stand and campaign share one computer, so the stand waits for its reader at every speed, and the campaign
    goes by the stand's own time: a busy machine costs time, neither samples nor the campaign.

    Yields
    ------
    tuple of StandFile and Clock
        The stand file with the addresses of the simulated wires, and the stand's time.

    Raises
    ------
    BadInput, DeviceFault
        If the stand file has no usable ``[simulation]`` or the process does not come up.
    """
    # The simulated stand is slow to import, and a real one does without it.
    from bufferstand.drivers.simulated.serving import start_process, wires_folder  # noqa: PLC0415

    with (
        wires_folder() as folder,
        start_process(
            prepared.stand_file.path,
            directory=folder,
            model=prepared.model_path,
            speed=speed,
            truth=truth,
            wait_for_reader=True,
        ) as process,
    ):
        served = process.served
        endpoints = replace(served.endpoints(), timeout_s=STARVED_S)
        yield with_endpoints(prepared.stand_file, endpoints), StandClock(Path(served.time_file or ""))
