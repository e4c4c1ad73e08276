"""A simulated amplifier behind Modbus: the registers of a map, on a port or on a pseudo-terminal."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bufferstand.drivers.modbus import Table
from bufferstand.drivers.register_maps import AmplifierMap, AmplifierRegister, encode_value
from bufferstand.drivers.simulated.faults import FrameFaults
from bufferstand.drivers.simulated.machine import SimulatedDevice, SimulatedInstrument
from bufferstand.drivers.simulated.wires.modbus_requests import ILLEGAL_ADDRESS, Responder
from bufferstand.drivers.simulated.wires.modbus_rtu import RtuStandServer
from bufferstand.drivers.simulated.wires.modbus_tcp import ModbusStandServer


class AmplifierBank:
    """An amplifier's registers, as its map lays them out; they can only be read.

    Parameters
    ----------
    registers : AmplifierMap
        What lies where.
    rate_Hz : float
        Measurements a second that it says it makes.
    """

    def __init__(self, registers: AmplifierMap, rate_Hz: float) -> None:
        self._map = registers
        self._words: dict[int, int] = {}
        self._counter = 0
        self.stuck = False
        """Whether its counter stands still: it measures no more."""
        if registers.rate is not None:
            self.put(registers.rate, rate_Hz)
        if registers.identity is not None:
            self.put(registers.identity, registers.identity.expect)
        self.measure(0.0)
        block = registers.block
        self._words = dict.fromkeys(range(block.first, block.first + block.words), 0) | self._words
        there: Table = "input" if registers.table == "input" else "holding"
        self.readable: Mapping[Table, frozenset[int]] = {
            "holding": frozenset(),
            "input": frozenset(),
            there: frozenset(self._words),
        }
        self.writable: frozenset[int] = frozenset()

    def measure(self, value: float, status: int = 0, times: int = 1) -> None:
        """Make measurements, the last of which is shown.

        Parameters
        ----------
        value : float
            In raw counts.
        status : int
            Bits of the status word.
        times : int
            How many it has made since the last one that was shown.
        """
        self.put(self._map.value, value)
        if self._map.status is not None:
            self.put(self._map.status, status)
        if self._map.counter is not None:
            size = 16 * self._map.counter.words
            self._counter = (self._counter + (0 if self.stuck else times)) % (1 << size)
            self.put(self._map.counter, self._counter)

    def put(self, register: AmplifierRegister, value: float) -> None:
        """Set one register, whatever it is for."""
        words = encode_value(value, register.type, self._map.word_order)
        self._words.update(zip(range(register.address, register.address + len(words)), words, strict=True))

    def read_packed(self, address: int, count: int, table: Table) -> bytes:  # noqa: ARG002 - it has one only
        """Return registers as they are on the wire."""
        return struct.pack(f">{count}H", *(self._words[at] for at in range(address, address + count)))

    def write(self, address: int, values: Sequence[int]) -> int:  # noqa: ARG002 - nothing can be written
        """Refuse."""
        return ILLEGAL_ADDRESS

    def is_harmless(self, address: int, count: int) -> bool:  # noqa: ARG002 - nothing can be written
        """Return that a write does nothing."""
        return True

    def is_momentary(self, addresses: range, table: Table) -> bool:  # noqa: ARG002 - all of it is
        """Return that a read wants present values."""
        return True


class ModbusInstrumentWire:
    """An instrument with registers, on a port or on a serial line.

    Parameters
    ----------
    device : SimulatedDevice
        Whose faults strike it.
    simulated : SimulatedInstrument
        Measures; its values are taken from there when they are asked for.
    registers : AmplifierMap
    device_id : int
        Unit at which it answers.
    catch_up : callable
        Brings the device up to the present.
    """

    def __init__(
        self,
        device: SimulatedDevice,
        simulated: SimulatedInstrument,
        registers: AmplifierMap,
        device_id: int,
        catch_up: Callable[[bool], object],
    ) -> None:
        self._device = device
        self._simulated = simulated
        self._stream = simulated.stream
        self._catch_up = catch_up
        status = registers.status
        self._overloaded = 0 if status is None else 1 << min(int(bit) for bit in status.bits)
        self.bank = AmplifierBank(registers, simulated.form.rate_Hz)
        trouble = FrameFaults(device.faults, self._stream, lambda: device.time_s)
        responder = Responder(self.bank, self._measure, self._is_cut, trouble)
        self._network = ModbusStandServer(responder, device_id)
        self._line = RtuStandServer(responder, device_id)

    async def listen(self, host: str, port: int) -> int:
        """Serve a TCP port; return it (0 takes a free one).

        Raises
        ------
        BadInput
            If the port cannot be had.
        """
        return await self._network.start(host, port, f"{self._table}.modbus.tcp_port")

    def start_line(self, link: Path) -> None:
        """Serve a pseudo-terminal.

        Raises
        ------
        BadInput
            If something that is no link lies there, or the link cannot be made.
        """
        self._line.start(link, f"{self._table}.port")

    async def stop(self) -> None:
        """Take it away."""
        await self._network.stop()
        self._line.stop()

    def _measure(self, acting: bool) -> None:
        """Show the newest of what has been measured by now."""
        self._catch_up(acting)
        frames = self._simulated.frames
        times = sum(one.counts.size for one in frames)
        if not times:
            return
        value = float(frames[-1].counts[-1])
        frames.clear()
        overload = self._device.faults.find(self._stream, "overload", self._device.time_s) is not None
        self.bank.measure(
            self._simulated.form.high if overload else value, self._overloaded if overload else 0, times
        )

    @property
    def _table(self) -> str:
        return self._stream.partition("_")[0]

    def _is_cut(self) -> bool:
        return self._device.faults.find(self._stream, "silent", self._device.time_s) is not None
