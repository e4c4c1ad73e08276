"""The simulated stand in process and in virtual time: the same physics, the same interfaces, no wires.

Stand time passes only as its user waits, so that a campaign of minutes runs in seconds and twice alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bufferstand.drivers.interfaces import Sensor, Stand
from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.faults import ScheduledFault
from bufferstand.drivers.simulated.inprocess.controller import InProcessController
from bufferstand.drivers.simulated.inprocess.sensors import InProcessInstrument, InProcessThermometer
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import SimulatedDevice, Spring, TruthLog
from bufferstand.drivers.stand_file import StandFile


@dataclass(frozen=True)
class InProcessStand:
    """A stand in virtual time.

    Parameters
    ----------
    clock : VirtualClock
        To wait by.
    stand : Stand
        Controller and sensors, as the acquisition sees them.
    device : SimulatedDevice
        What is behind them.
    truth : Truth
        What really happened.
    """

    clock: VirtualClock
    stand: Stand
    device: SimulatedDevice
    truth: TruthLog


def open_in_process(
    stand_file: StandFile,
    *,
    model: Path | None = None,
    spring: Spring | None = None,
    faults: Sequence[ScheduledFault] = (),
    log_truth: bool = True,
) -> InProcessStand:
    """Return a stand in virtual time at time 0, switched off; the same for the same seed and the same use.

    Parameters
    ----------
    stand_file : StandFile
        With a table ``[simulation]``.
    model : Path, optional
        Spring model instead of the one that the stand file names.
    spring : Spring, optional
        A specimen that is there already, instead of a model.
    faults : sequence of ScheduledFault
        What shall fail, and when; more can be added to ``device.faults`` later.
    log_truth : bool
        Whether to keep what really happens (56 bytes a sample, 0.2 GB an hour); ``truth`` stays empty if not.

    Raises
    ------
    BadInput
        As :func:`bufferstand.drivers.simulated.build.make_device`.
    """
    clock = VirtualClock()
    truth = TruthLog()
    device = make_device(
        stand_file,
        clock.wall_s,
        model=model,
        spring=spring,
        truth=truth if log_truth else None,
        faults=faults,
    )
    clock.listen(device.advance_to)
    beside: dict[str, list[Sensor]] = {"amplifier": [], "sensor": []}
    for one, simulated in zip(stand_file.instruments, device.instruments, strict=True):
        beside[one.kind.table].append(InProcessInstrument(device, one, simulated, clock))
    thermometers: list[Sensor] = []
    if stand_file.temperature is not None:
        period_s = stand_file.temperature.period_s
        thermometers = [InProcessThermometer(device, t, clock, period_s) for t in device.thermometers]
    sensors = (*beside["amplifier"], *thermometers, *beside["sensor"])
    controller = InProcessController(device, stand_file, clock)
    return InProcessStand(clock, Stand(controller, sensors), device, truth)
