"""From a stand file to a stand: which driver for which table."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.controllers import (
    ControllerSite,
    NoticeBoard,
    PollingController,
    RegisterController,
    RingController,
)
from bufferstand.drivers.interfaces import Identity, Stand
from bufferstand.drivers.modbus import ModbusLink, RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import Clock, WallClock


def build_controller(
    stand_file: StandFile, clock: Clock, doing: str = ""
) -> RingController | PollingController:
    """Return the stand's controller, not connected yet: with a ring or polled, as its profile says.

    Parameters
    ----------
    stand_file : StandFile
        Where it is reached, and by which profile.
    clock : Clock
        Stand and wall time.
    doing : str
        What this program is to do with it: other programs on this computer are told once it gives commands.

    Raises
    ------
    BadInput
        If its register profile cannot be read.
    """
    settings, profile = stand_file.controller, stand_file.profile()
    link = _link(stand_file, profile, clock)
    kind = PollingController if profile.window is None else RingController
    board = NoticeBoard(link.address, doing)
    return kind(link, profile, settings.channel, clock, timeout_s=settings.timeout_s, board=board)


def _link(stand_file: StandFile, profile: Profile, clock: Clock) -> ModbusLink:
    settings, limits = stand_file.controller, stand_file.limits
    line = stand_file.controller_serial()
    wire: Wire = TcpWire(settings.host, settings.port)
    if line is not None:
        wire = RtuWire(line, baud=settings.baud, parity=settings.parity, stop_bits=settings.stop_bits)
    site = ControllerSite(
        wire=wire,
        profile=profile,
        device_id=settings.device_id,
        timeout_s=settings.timeout_s,
        speed_max_mm_per_s=limits.speed_max_mm_per_s,
        frequency_max_Hz=limits.frequency_max_Hz,
        now_s=clock.now_s,
    )
    return settings.of_kind.link(settings.kind_settings, site)


def open_stand(stand_file: StandFile, clock: Clock) -> Stand:
    """Connect to every device of a stand and begin to read the sensors.

    The actuator is not touched. ``connect`` and ``start`` may be called again: they only check again.

    Parameters
    ----------
    stand_file : StandFile
        What the stand is made of.
    clock : Clock
        Stand and wall time.

    Raises
    ------
    BadInput
        If the controller's register profile cannot be read.
    DeviceFault
        If a device does not answer or is another one; whatever was open is let go of.
    """
    stand = Stand(build_controller(stand_file, clock), build_sensors(stand_file, clock))
    try:
        stand.controller.connect()
        for sensor in stand.sensors:
            sensor.start()
    except BaseException:
        stand.close()
        raise
    return stand


@dataclass(frozen=True)
class ControllerAnswer:
    """Who answers at a controller's address, and whether it says that it is simulated."""

    identity: Identity
    simulated: bool


def look_at_controller(stand_file: StandFile) -> ControllerAnswer:
    """Return who answers where a stand file leads to; only identity registers are read, and it lets go again.

    Raises
    ------
    BadInput
        If the controller's register profile cannot be read.
    DeviceFault
        If nobody answers, or what answers is not what the profile describes.
    """
    profile = stand_file.profile()
    link = _link(stand_file, profile, WallClock())
    try:
        controller = RegisterController(link, profile, timeout_s=stand_file.controller.timeout_s)
        return ControllerAnswer(controller.identify(), controller.says_simulated())
    finally:
        link.close()
