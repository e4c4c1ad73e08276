"""The simulated controller on a real wire: Modbus TCP by pymodbus, one snapshot of the device a request."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from itertools import groupby
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.profile import Profile
from drivers.simulated.register_bank import RegisterBank
from foundation.errors import BadInput

# What pymodbus logs here is a client's doing; without a handler Python would print it.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


class ModbusStandServer:
    """Serves a register bank on a TCP port of the loopback interface.

    Parameters
    ----------
    bank : RegisterBank
    profile : Profile
        Says which addresses exist and which of them can be written.
    device_id : int
        Unit identifier that it answers to; others get exception 0x0B.
    catch_up : callable
        Brings the device up to the present; called before each request, with whether the request acts on the
        stand.
    cut : callable
        Whether the link is cut at present: then nothing is heard and nothing answered.
    """

    def __init__(
        self,
        bank: RegisterBank,
        profile: Profile,
        device_id: int,
        catch_up: Callable[[bool], object],
        cut: Callable[[], bool],
    ) -> None:
        self._bank = bank
        self._catch_up = catch_up
        self._cut = cut
        everything = SimData(0, count=bank.size, datatype=DataType.REGISTERS)
        self._devices = [SimDevice(device_id, _served(profile), action=self._act)]
        if device_id != 0:
            self._devices.append(SimDevice(0, everything, action=_nobody))
        self._server: ModbusTcpServer | None = None

    async def start(self, host: str, port: int) -> int:
        """Listen; return the port (0 takes a free one).

        Raises
        ------
        BadInput
            If the port cannot be had.
        """
        server = ModbusTcpServer(self._devices, address=(host, port), trace_packet=self._pass)
        try:
            await server.serve_forever(background=True)
        except RuntimeError:
            raise BadInput(
                f"cannot listen on {host}:{port}",
                place="controller.port",
                remedy="another program holds the port: end it, or choose another one (0 takes a free one)",
            ) from None
        self._server = server
        found: int = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]
        return found

    async def stop(self) -> None:
        """Close the port and every connection."""
        if self._server is not None:
            await self._server.shutdown()  # type: ignore[no-untyped-call]
            self._server = None

    async def _act(
        self,
        function: int,  # noqa: ARG002 - pymodbus calls with these
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        self._catch_up(values is not None and not self._bank.is_acknowledgement(address, count))
        if values is not None:
            code = self._bank.write(address, [int(value) for value in values])
            if code:
                return ExcCodes(code)
        registers[address - start : address - start + count] = self._bank.read(address, count)
        return None

    def _pass(self, sending: bool, data: bytes) -> bytes:  # noqa: ARG002 - pymodbus calls with both
        return b"" if self._cut() else data


async def _nobody(*_: object) -> ExcCodes | None:
    return ExcCodes.GATEWAY_NO_RESPONSE


def _served(profile: Profile) -> list[SimData]:
    """Return the map's addresses; those between are illegal, as on a strict device."""
    ring = profile.ring
    readonly = {
        address: register.access == "r"
        for register in profile.registers.values()
        for address in range(register.address, register.address + register.words)
    }
    readonly.update(dict.fromkeys(range(ring.address, ring.address + ring.registers), True))
    numbered = enumerate(sorted(readonly.items()))
    # Consecutive addresses of one kind share address minus rank.
    runs = groupby(numbered, key=lambda item: (item[1][0] - item[0], item[1][1]))
    served = []
    for (_, locked), run in runs:
        addresses = [address for _, (address, _) in run]
        served.append(
            SimData(addresses[0], count=len(addresses), datatype=DataType.REGISTERS, readonly=locked)
        )
    return served
