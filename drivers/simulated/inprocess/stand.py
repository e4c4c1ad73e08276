"""The simulated stand in process and in virtual time: the same physics, behind wires in memory.

The controller is reached by the driver of real ones. Stand time passes only as its user waits, so that a
campaign of minutes runs in seconds and twice alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

from bufferstand.drivers.instruments import TAGS
from bufferstand.drivers.interfaces import Controller, Sensor, Stand
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.simulated.build import make_device
from bufferstand.drivers.simulated.faults import ScheduledFault
from bufferstand.drivers.simulated.inprocess.acquisition import InProcessAcquisition
from bufferstand.drivers.simulated.inprocess.register_wire import (
    Lost,
    VirtualWire,
    in_memory,
    open_controller,
)
from bufferstand.drivers.simulated.inprocess.sensors import InProcessInstrument, InProcessThermometer
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import SimulatedDevice, Spring, TruthLog
from bufferstand.drivers.simulated.settings import simulation_settings
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
    second : callable
        Makes another program's driver of the same controller, not connected yet.
    """

    clock: VirtualClock
    stand: Stand
    device: SimulatedDevice
    truth: TruthLog
    second: Callable[[], Controller]


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
        As :func:`bufferstand.drivers.simulated.build.make_device`; if a fault names a register that the
        controller's map has not.
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
    beside: dict[str, list[Sensor]] = {table: [] for table in TAGS}
    for one, simulated in zip(stand_file.instruments, device.instruments, strict=True):
        beside[one.kind.table].append(InProcessInstrument(device, one, simulated, clock))
    thermometers = iter(device.thermometers)
    beside["temperature"] += [
        InProcessThermometer(device, thermometer, one.kind.sensor_type, clock, one.settings.period_s)
        for one in stand_file.thermometers
        for thermometer in islice(thermometers, len(one.sensors))
    ]
    settings = simulation_settings(stand_file)
    acquisition = (
        InProcessAcquisition(
            device,
            one,
            clock,
            trip_s=2e-4,
            jitter_s=settings.acquisition_jitter_s,
            seed=settings.seed + number,
        )
        for number, one in enumerate(device.acquisition)
    )
    sensors = (*(sensor for table in TAGS for sensor in beside[table]), *acquisition)
    way_s, profile = device.latency.way_s, in_memory(stand_file.profile())
    wire = VirtualWire(device, profile, clock, lambda: way_s() + way_s())
    for fault in faults:
        wire.bank.demand_register(fault)
    reach = partial(open_controller, wire, stand_file, profile)
    return InProcessStand(clock, Stand(reach(), sensors), device, truth, reach)


def behind_a_wire(
    opened: InProcessStand,
    stand_file: StandFile,
    round_trip_s: Callable[[], float],
    profile: Profile | None = None,
    lost: Callable[[bytes], Lost] = lambda _: "",
) -> Stand:
    """Return a stand in virtual time whose controller is reached over another wire; its clock stays the same.

    Parameters
    ----------
    opened : InProcessStand
        The stand; its sensors stay as they are.
    stand_file : StandFile
        For channels, timeout and register profile.
    round_trip_s : callable
        Duration of the next round trip [s].
    profile : Profile, optional
        Another register profile than the stand file's, with a ring or polled.
    lost : callable, optional
        Which requests or replies get lost; as for
        :class:`bufferstand.drivers.simulated.inprocess.register_wire.VirtualWire`.
    """
    chosen = profile or stand_file.profile()
    wire = VirtualWire(opened.device, chosen, opened.clock, round_trip_s, lost)
    return Stand(open_controller(wire, stand_file, chosen), opened.stand.sensors)
