"""Advice for a device that does not answer: found by further reading, without setting anything."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from bufferstand.drivers.controllers import REGISTERS, find_mismatch
from bufferstand.drivers.interfaces import NO_REPLY
from bufferstand.drivers.modbus import ModbusLink, ModbusRefusal, RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps import IDENTITY
from bufferstand.drivers.serial_line import is_held
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import DeviceFault, WireLost

UNITS = (1, 0, 255, 2, 3, 4, 5, 247)
"""Unit identifiers that are tried where the stand file's does not answer."""
BAUDS = (9600, 19200, 38400, 57600, 115200)
PROBE_S = 0.25
"""Longest wait for an answer of a probe [s]."""
GATEWAY_CODES = (10, 11)
"""Modbus exceptions with which a gateway says that there is nobody."""
_PLACES = ("/dev/serial/by-id", "/dev")
_NAMES = ("ttyUSB*", "ttyACM*", "ttyS[0-9]", "usb-*")


def controller_hint(fault: DeviceFault, stand_file: StandFile) -> str:
    """Return what was found about a controller that could not be connected to; empty if nothing."""
    text = str(fault)
    if hint := port_hint(text):
        return hint
    if stand_file.controller.kind != REGISTERS:  # its test values are found out by its own link
        return ""
    gateway = isinstance(fault, ModbusRefusal) and fault.code in GATEWAY_CODES
    if not gateway and NO_REPLY not in text:
        return "" if isinstance(fault, WireLost) else _what_would_fit(stand_file)
    return _who_answers(stand_file)


def port_hint(text: str) -> str:
    """Return what to do about a serial port that cannot be opened; empty if it was opened."""
    if "ermission denied" in text:
        return (
            "your account may not use this port: add it to the group dialout "
            "(sudo usermod -a -G dialout $USER), then log in again"
        )
    if "No such file" in text:
        found = sorted({str(path) for place in _PLACES for name in _NAMES for path in Path(place).glob(name)})
        return f"serial ports of this computer: {', '.join(found) or 'none'}"
    if is_held(text):
        return "another program holds this port: look with fuser, and end it"
    return ""


def _what_would_fit(stand_file: StandFile) -> str:
    """Return how to find out what a foreign device is: by reads of everything that is known."""
    settings, line = stand_file.controller, stand_file.controller_serial()
    where = f"{settings.host}:{settings.port}" if line is None else f"{line} --baud {settings.baud}"
    command = f"bufferstand instruments --probe {where} --unit {settings.device_id}"
    return f"{command} says which description would fit what it answers"


def _who_answers(stand_file: StandFile) -> str:
    """Ask other units, and on a line at other baud rates, for the profile's test values."""
    answered: list[str] = []
    for where, link in _probes(stand_file):
        try:
            profile = stand_file.profile()
            window = profile.span(IDENTITY)
            registers = link.read(window.address, window.words, "identity", table=window.table)
        except ModbusRefusal as refusal:
            if refusal.code not in GATEWAY_CODES:
                answered.append(where)
            continue
        except DeviceFault:
            continue
        finally:
            link.close()
        if not find_mismatch(profile, window, registers):
            return f"it answers with {where}, by this profile: write that into the stand file"
        answered.append(where)
    if answered:
        return f"something answers with {answered[0]}, but not by this profile; {_what_would_fit(stand_file)}"
    settings = stand_file.controller
    tried = f"device_id {', '.join(str(unit) for unit in UNITS if unit != settings.device_id)}"
    if settings.serial:
        return f"nobody answers with {tried} either, nor at other baud rates; are the wires A and B swapped?"
    return f"nobody answers with {tried} either"


def _probes(stand_file: StandFile) -> Iterator[tuple[str, ModbusLink]]:
    settings, line = stand_file.controller, stand_file.controller_serial()
    if line is None:
        wire: Wire = TcpWire(settings.host, settings.port)
    else:
        wire = RtuWire(line, baud=settings.baud, parity=settings.parity, stop_bits=settings.stop_bits)
    for unit in UNITS:
        if unit != settings.device_id:
            yield f"device_id = {unit}", ModbusLink(wire, device_id=unit, timeout_s=PROBE_S)
    if line is None:
        return
    for baud in BAUDS:
        if baud != settings.baud:
            other = RtuWire(line, baud=baud, parity=settings.parity, stop_bits=settings.stop_bits)
            yield f"baud = {baud}", ModbusLink(other, device_id=settings.device_id, timeout_s=PROBE_S)
