"""The simulated controller on a real wire: Modbus TCP by pymodbus, one snapshot of the device a request.

What pymodbus 3.16 leaves open is closed through its own extension points: refusals of what it cannot decode
and of other units, FC23 refused whole, and a link that can be cut.
Source: Modbus application protocol 1.1b3, Modbus messaging on TCP/IP 1.0b.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from itertools import groupby
from typing import cast

from pymodbus.constants import ExcCodes
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.register_message import ReadWriteMultipleRegistersRequest
from pymodbus.server import ModbusTcpServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.simulator import DataType, SimData, SimDevice

from drivers.profile import Profile
from drivers.simulated.register_bank import RegisterBank
from foundation.errors import BadInput

# What pymodbus logs here is a client's doing; without a handler Python would print it.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())

WRITE_ONE = 6
SERVED = frozenset((3, WRITE_ONE, 16, 23))
"""Function codes that are served; everything lies in the holding table."""


class ModbusStandServer:
    """Serves a register bank on a TCP port, to any number of clients.

    Parameters
    ----------
    bank : RegisterBank
    profile : Profile
        Says which addresses exist and which of them can be written; those between are illegal.
    device_id : int
        Unit identifier that it answers to; others get exception 0x0B.
    catch_up : callable
        Brings the device up to the present; called before a request is done, with whether the request acts on
        the stand. An acknowledgement of samples needs none.
    cut : callable
        Whether the link is cut at present: then nothing is heard, done or answered.
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
        self._device_id = device_id
        self._catch_up = catch_up
        self._cut = cut
        access = _access(profile)
        self._readable = frozenset(access)
        self._device = SimDevice(device_id, _layout(access), action=self._act)
        self._server: _Server | None = None

    async def start(self, host: str, port: int) -> int:
        """Listen; return the port (0 takes a free one).

        Raises
        ------
        BadInput
            If the port cannot be had.
        """
        server = _Server(self._device, (host, port), self._admit, self._cut)
        try:
            await server.serve_forever(background=True)
        except (RuntimeError, OverflowError):  # pymodbus keeps the operating system's reason to itself
            raise BadInput(
                f"cannot listen on {host}:{port}",
                place="controller.port",
                remedy="another program may hold the port, or it is not one that you may take: "
                "end that program, or choose another port (0: a free one)",
            ) from None
        self._server = server
        found: int = cast(asyncio.Server, server.transport).sockets[0].getsockname()[1]
        return found

    async def stop(self) -> None:
        """Close the port and every connection."""
        server, self._server = self._server, None
        if server is not None:
            await server.shutdown()  # type: ignore[no-untyped-call]
            await asyncio.sleep(0)  # the connections' sockets are closed in the next turn of the loop

    async def _act(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Do one access; pymodbus calls it once for each half of FC23, and for the echo of FC6."""
        if values is None:
            if function != WRITE_ONE:
                self._catch_up(False)
            registers[address - start : address - start + count] = self._bank.read(address, count)
            return None
        if not self._bank.is_acknowledgement(address, count):
            self._catch_up(True)
        if self._cut():  # since the request came; the reply is held back too
            return ExcCodes.DEVICE_FAILURE
        code = self._bank.write(address, [int(value) for value in values])
        return ExcCodes(code) if code else None

    def _admit(self, sending: bool, pdu: ModbusPDU) -> ModbusPDU:
        """Let a request pass, or put its refusal in its place."""
        if sending:
            return pdu
        if pdu.dev_id != self._device_id:
            return _Refusal.of(pdu, ExcCodes.GATEWAY_NO_RESPONSE)
        if pdu.function_code not in SERVED:
            return _Refusal.of(pdu, ExcCodes.ILLEGAL_FUNCTION)
        if isinstance(pdu, ReadWriteMultipleRegistersRequest):
            # pymodbus writes before it looks at what is to be read.
            wanted = range(pdu.read_address, pdu.read_address + pdu.read_count)
            if not self._readable.issuperset(wanted):
                return _Refusal.of(pdu, ExcCodes.ILLEGAL_ADDRESS)
        return pdu


class _Refusal(ModbusPDU):
    """A request whose only answer is an exception."""

    def __init__(self, function: int, code: ExcCodes) -> None:
        super().__init__()
        self.function_code = function
        self._code = code

    @classmethod
    def of(cls, pdu: ModbusPDU, code: ExcCodes) -> ModbusPDU:
        """Return what stands for a request that is refused."""
        refusal = cls(pdu.function_code, code)
        refusal.dev_id, refusal.transaction_id = pdu.dev_id, pdu.transaction_id
        return refusal

    async def datastore_update(self, context: object, device_id: int) -> ModbusPDU:  # noqa: ARG002
        """Return the exception."""
        return ExceptionResponse(self.function_code, self._code)


class _Decoder(DecodePDU):
    """Makes a refusal of what cannot be decoded, which pymodbus answers with a function code of 0x80."""

    def decode(self, frame: bytes) -> ModbusPDU:
        """Decode a request."""
        pdu = super().decode(frame)
        return _Refusal(frame[0], ExcCodes.ILLEGAL_VALUE) if pdu is None else pdu


class _Server(ModbusTcpServer):
    def __init__(
        self,
        device: SimDevice,
        address: tuple[str, int],
        admit: Callable[[bool, ModbusPDU], ModbusPDU],
        cut: Callable[[], bool],
    ) -> None:
        super().__init__(device, address=address, trace_pdu=admit)
        self.decoder = _Decoder(True)
        self.cut = cut

    def callback_new_connection(self) -> ServerRequestHandler:
        """Return the protocol of a new connection."""
        return _Connection(self)


class _Connection(ServerRequestHandler):
    """One client's connection, whose cable can be cut."""

    def __init__(self, owner: _Server) -> None:
        super().__init__(owner, None, owner.trace_pdu, None)  # type: ignore[no-untyped-call]
        self._cut = owner.cut

    def callback_data(self, data: bytes, addr: tuple[str, int] | None = None) -> int:
        """Take all that was received and not used yet; return how much of it is done with."""
        if self._cut():
            self.last_pdu = None
            return len(data)
        if data[2:4].strip(b"\0"):  # not Modbus: pymodbus would wait for ever
            self.close()
            return len(data)
        return super().callback_data(data, addr)

    def server_send(self, pdu: ModbusPDU, addr: tuple[str, int] | None) -> None:
        """Send a reply, if there is a cable."""
        if not self._cut():
            super().server_send(pdu, addr)  # type: ignore[no-untyped-call]


def _access(profile: Profile) -> dict[int, bool]:
    """Return every address of the map and whether it can be written."""
    writable = {
        address: register.access == "rw"
        for register in profile.registers.values()
        for address in range(register.address, register.address + register.words)
    }
    ring = profile.ring
    writable.update(dict.fromkeys(range(ring.address, ring.address + ring.registers), False))
    return writable


def _layout(writable: dict[int, bool]) -> list[SimData]:
    """Return the addresses as pymodbus wants them; those between are illegal, as on a strict device."""
    numbered = enumerate(sorted(writable.items()))
    # Consecutive addresses of one kind share address minus rank.
    runs = groupby(numbered, key=lambda item: (item[1][0] - item[0], item[1][1]))
    layout = []
    for (_, free), run in runs:
        addresses = [address for _, (address, _) in run]
        layout.append(
            SimData(addresses[0], count=len(addresses), datatype=DataType.REGISTERS, readonly=not free)
        )
    return layout
