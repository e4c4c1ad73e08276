"""Ask a foreign Modbus device what it could be: every device that this software knows, by harmless reads."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from bufferstand.drivers.acquisition import acquisition_kinds
from bufferstand.drivers.check.hints import GATEWAY_CODES, PROBE_S, UNITS
from bufferstand.drivers.controllers import controller_kinds
from bufferstand.drivers.modbus import (
    Candidate,
    Found,
    Likeness,
    ModbusLink,
    ModbusRefusal,
    Table,
    Wire,
    look_at,
)
from bufferstand.drivers.register_maps import SHIPPED, AmplifierMap, decode_value, load_amplifier_map
from bufferstand.foundation import DeviceFault

_ORDER = {"fits": 0, "may fit": 1, "does not fit": 2}
_SILENT = 3
"""After so many requests in vain nobody is there."""


def probe(wire: Wire, *, device_id: int = 1, timeout_s: float = 0.5) -> list[Found]:
    """Return how well the device at the other end of a wire fits each one that is known, the best first.

    Function codes 1 to 4 only: nothing is written. Read are constants, and one value with its status.

    Parameters
    ----------
    wire : Wire
    device_id : int
        Unit identifier.
    timeout_s : float
        Longest wait for a reply [s].

    Raises
    ------
    DeviceFault
        If there is no connection, or nobody answers at this unit: with the units that do.
    """
    link = ModbusLink(wire, device_id=device_id, timeout_s=timeout_s, name="device")
    found: list[Found] = []
    try:
        for candidate in known_devices():
            found.append(look_at(candidate, link))
            if len(found) == _SILENT and not any(one.answered for one in found):
                raise DeviceFault(f"{link.address}: nobody answers; {_who_answers(wire, device_id)}")
    finally:
        link.close()
    return sorted(found, key=lambda one: _ORDER[one.likeness.verdict])


def known_devices() -> Iterator[Candidate]:
    """Yield every device on Modbus that a foreign one could be.

    Raises
    ------
    BadInput
        If an installed package's kind cannot be had.
    """
    for controller in controller_kinds():
        yield from controller.candidates()
    for acquisition in acquisition_kinds():
        yield from acquisition.candidates()
    for path in sorted((SHIPPED.parent / "amplifier_maps").glob("*.toml")):
        registers = load_amplifier_map(path.stem, Path())
        if registers.identity is not None:
            yield Candidate("map", path.stem, registers.id, partial(_map_likeness, registers))


def _map_likeness(registers: AmplifierMap, link: ModbusLink) -> Likeness:
    identity = registers.identity
    assert identity is not None
    table: Table = "input" if registers.table == "input" else "holding"
    words = link.read(identity.address, identity.words, "identity", table=table)
    shown = decode_value(words, identity.type, registers.word_order)
    if shown == identity.expect:
        return Likeness("fits", f"register {identity.address} holds {shown:g}")
    return Likeness(
        "does not fit", f"register {identity.address} holds {shown:g} instead of {identity.expect:g}"
    )


def _who_answers(wire: Wire, device_id: int) -> str:
    """Ask other units for any register."""
    there = []
    for unit in UNITS:
        if unit == device_id:
            continue
        link = ModbusLink(wire, device_id=unit, timeout_s=PROBE_S, name="device")
        try:
            link.read(0, 1, "any register")
        except ModbusRefusal as refusal:
            if refusal.code in GATEWAY_CODES:
                continue
        except DeviceFault:
            continue
        finally:
            link.close()
        there.append(str(unit))
    if there:
        return f"but unit {', '.join(there)} does: try --unit {there[0]}"
    tried = ", ".join(str(unit) for unit in UNITS if unit != device_id)
    return f"nor at unit {tried}; is this its port, and Modbus switched on in it?"
