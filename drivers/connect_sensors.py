"""From a stand file to the sensors beside the controller: which driver for which table."""

from __future__ import annotations

from bufferstand.drivers.amplifiers import ModbusAmplifier
from bufferstand.drivers.amplifiers.aed import AedAmplifier
from bufferstand.drivers.amplifiers.gsv2 import Gsv2Amplifier
from bufferstand.drivers.interfaces import Sensor
from bufferstand.drivers.modbus import ModbusLink, RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps import AmplifierMap, load_amplifier_map
from bufferstand.drivers.stand_file import StandFile
from bufferstand.drivers.thermometers import Ds2480bBus, W1Bus
from bufferstand.foundation import BadInput, Clock


def build_amplifier(stand_file: StandFile, clock: Clock) -> Sensor | None:
    """Return the stand's amplifier, not started yet; None if it has none.

    Raises
    ------
    BadInput
        If its register map cannot be read.
    """
    settings = stand_file.amplifier
    if settings is None:
        return None
    port = stand_file.folder / settings.port
    if settings.protocol == "gsv2":
        return Gsv2Amplifier(port, settings, clock)
    if settings.protocol == "aed":
        return AedAmplifier(port, settings, clock)
    modbus = settings.modbus
    assert modbus is not None  # the schema demands it
    if modbus.host is not None:
        wire: Wire = TcpWire(modbus.host, modbus.tcp_port)
    else:
        wire = RtuWire(port, baud=settings.baud, parity=modbus.parity, stop_bits=modbus.stop_bits)
    link = ModbusLink(wire, device_id=modbus.device_id, timeout_s=modbus.timeout_s, name="amplifier")
    return ModbusAmplifier(link, _map_of(stand_file, modbus.map), settings, clock)


def build_sensors(stand_file: StandFile, clock: Clock) -> tuple[Sensor, ...]:
    """Return the devices beside the controller, not started yet: amplifier, then temperatures in order.

    Raises
    ------
    BadInput
        If the amplifier's register map cannot be read.
    """
    sensors: list[Sensor] = []
    amplifier = build_amplifier(stand_file, clock)
    if amplifier is not None:
        sensors.append(amplifier)
    temperature = stand_file.temperature
    root, adapter = stand_file.w1_root(), stand_file.onewire_port()
    if temperature is not None and root is not None:
        sensors += W1Bus(root, temperature, clock).sensors
    if temperature is not None and adapter is not None:
        sensors += Ds2480bBus(adapter, temperature, clock).sensors
    return tuple(sensors)


def _map_of(stand_file: StandFile, name: str) -> AmplifierMap:
    try:
        return load_amplifier_map(name, stand_file.folder)
    except BadInput as error:
        if error.file is not None:
            raise
        raise BadInput(error.problem, file=stand_file.path, place=error.place, remedy=error.remedy) from None
