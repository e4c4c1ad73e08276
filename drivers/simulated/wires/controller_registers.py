"""The simulated controller's registers, as its profile lays them out; knows no sockets.

Every read is one latched snapshot; what a write means is found by the names of the registers that it touches.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property

import numpy as np

from bufferstand.drivers.modbus import Table
from bufferstand.drivers.register_maps import (
    ASKED,
    CHECK,
    COMMAND,
    OPTIONAL_REGISTERS,
    POLLED_REGISTERS,
    RING_REGISTERS,
    SIMULATED,
    SIMULATED_SIGN,
    STATUS,
    Profile,
    ProfileRegister,
    Ring,
    crc_of,
    encode_value,
    pack,
)
from bufferstand.drivers.simulated.faults import ScheduledFault, nearest
from bufferstand.drivers.simulated.machine import RATE_HZ, Command, SimulatedDevice, SingleWriterLock
from bufferstand.foundation import BadInput

ILLEGAL_VALUE = 3
"""Modbus exception code for a value that a register does not take."""

_HEADER = (ASKED, "first_sequence", "count", "overruns", "status_word", CHECK)
_HARMLESS = ("ring_acknowledge", "request_number")
"""Registers whose writing does nothing to the stand."""


class RegisterBank:
    """Reads and writes by address.

    Parameters
    ----------
    device : SimulatedDevice
    profile : Profile
        The register map; its names are those of ``ring``, its addresses and word order its own.
    now_s : callable, optional
        Present stand time [s], for the clock register; that of the newest sample without it.

    Raises
    ------
    BadInput
        If the profile names what this device does not have.
    """

    def __init__(
        self, device: SimulatedDevice, profile: Profile, now_s: Callable[[], float] | None = None
    ) -> None:
        self._device = device
        self._now_s = now_s or (lambda: device.time_s)
        self._profile = profile
        self._writer = SingleWriterLock(device.wall_s)
        self._stuck: dict[str, float] = {}
        self._status = profile.span(STATUS)
        self._command = profile.span(COMMAND)
        self._demand_known()
        self._names = {
            at: name
            for name, register in profile.registers.items()
            if register.table == "holding"
            for at in range(register.address, register.address + register.words)
        }
        self._window = None if profile.window is None else _WindowBank(device, profile, profile.window)
        self._raw = () if profile.poll is None else tuple(f"raw_{name}" for name in profile.sampled)
        self._unpolled = set(self._raw)
        size = max(r.address + r.words for r in profile.registers.values())
        if profile.window is not None:
            size = max(size, profile.window.address + profile.window.registers)
        self._tables: dict[Table, list[int]] = {"holding": [0] * size, "input": [0] * size}
        self._words = self._tables["holding"]
        for name, register in profile.registers.items():
            if register.expect is not None:
                self._store(name, register.expect)
        controller = device.controller
        for name, value in (
            ("serial", device.settings.seed),
            ("sample_rate", RATE_HZ),
            (SIMULATED, SIMULATED_SIGN),
            ("force_limit", controller.force_limit_kN),
            ("stroke_limit", controller.stroke_limit_mm),
        ):
            if profile.has(name):
                self._store(name, value)

    def _demand_known(self) -> None:
        known = {*RING_REGISTERS, *POLLED_REGISTERS, *OPTIONAL_REGISTERS}
        names = [place.name for part in (self._status, self._command) for place in part.places]
        if self._profile.window is not None:
            known |= {*self._device.ring.columns, *_HEADER}
            names += [name for name, _ in (*self._profile.ring.header, *self._profile.ring.sample)]
        if unknown := [name for name in names if name not in known]:
            raise BadInput(
                f"the simulated controller has no “{unknown[0]}”",
                file=self._profile.facts.id,
                remedy="use a shipped profile, or one with its names at other addresses",
            )

    @cached_property
    def readable(self) -> Mapping[Table, frozenset[int]]:
        """Addresses that exist, by table."""
        tables: tuple[Table, ...] = ("holding", "input")
        window = self._profile.window
        of_window = () if window is None else range(window.address, window.address + window.registers)
        return {
            table: self._addresses(table, "r", "rw").union(of_window if table == "holding" else ())
            for table in tables
        }

    @cached_property
    def writable(self) -> frozenset[int]:
        """Addresses of the holding table that can be written."""
        return self._addresses("holding", "rw")

    def _addresses(self, table: Table, *access: str) -> frozenset[int]:
        return frozenset(
            address
            for register in self._profile.registers.values()
            if register.table == table and register.access in access
            for address in range(register.address, register.address + register.words)
        )

    @property
    def size(self) -> int:
        """Addresses from 0 on that the bank spans."""
        return len(self._words)

    def read(self, address: int, count: int, table: Table = "holding") -> list[int]:
        """Return registers as one snapshot of the device."""
        end = address + count
        status = self._status
        if status.table == table and address < status.address + status.words and end > status.address:
            self._latch_status()
        if polled := self._momentary(range(address, end), table):
            self._latch_raw()
            self._unpolled = (self._unpolled - polled) or set(self._raw)
            self._device.ring.poll(whole=len(self._unpolled) == len(self._raw))
        if self._profile.has("writer") and address <= self._profile.find("writer").address < end:
            self._store("writer", self._writer.number)
        window = self._window
        if window is not None and table == "holding" and window.overlaps(address, end):
            words = struct.unpack(f">{window.words}H", window.latch(int(self._value("ring_acknowledge"))))
            self._words[window.address : window.address + window.words] = words
        return self._tables[table][address:end]

    def read_packed(self, address: int, count: int, table: Table = "holding") -> bytes:
        """Return the same as bytes on the wire; the window of the ring without a detour over numbers."""
        window = self._window
        if window is not None and table == "holding" and window.is_whole(address, count):
            return window.latch(int(self._value("ring_acknowledge")))
        return pack(self.read(address, count, table))

    def write(self, address: int, values: Sequence[int]) -> int:
        """Write registers and let the device act on them.

        Returns
        -------
        int
            0, or the Modbus exception code with which nothing has been changed.
        """
        end = address + len(values)
        before = self._words[address:end]
        self._words[address:end] = values
        touched = dict.fromkeys(self._names[at] for at in range(address, end) if at in self._names)
        if not (self._writer_accepted(touched) and self._limits_accepted(touched)):
            self._words[address:end] = before
            return ILLEGAL_VALUE
        for name in touched:
            self._act(name)
        return 0

    def is_harmless(self, address: int, count: int) -> bool:
        """Return whether a write says only what has been read or asked: the stand does not care."""
        return all(self._names.get(at) in _HARMLESS for at in range(address, address + count))

    def is_momentary(self, addresses: range, table: Table) -> bool:
        """Return whether a read wants the converters' present values: those must not be of earlier."""
        return bool(self._momentary(addresses, table))

    def _momentary(self, addresses: range, table: Table) -> set[str]:
        """Return the converters whose registers begin at these addresses."""
        return {name for name, register in self._raw_registers(table) if register.address in addresses}

    # --- writes -------------------------------------------------------------------------------------

    def _writer_accepted(self, touched: Collection[str]) -> bool:
        return "writer" not in touched or self._writer.write(int(self._value("writer")))

    def _limits_accepted(self, touched: Collection[str]) -> bool:
        """Set the limits that were written; they are judged before anything else is done."""
        controller = self._device.controller
        before = controller.force_limit_kN
        if "force_limit" in touched and not controller.set_force_limit(self._value("force_limit")):
            return False
        if "stroke_limit" in touched and not controller.set_stroke_limit(self._value("stroke_limit")):
            controller.set_force_limit(before)
            return False
        return True

    def _act(self, name: str) -> None:
        controller = self._device.controller
        match name:
            case "control_word":
                controller.control(int(self._value(name)))
            case "watchdog_feed":
                controller.watchdog.feed(int(self._value(name)))
                self._writer.keep()
            case "watchdog_time":
                controller.watchdog.set_time(int(self._value(name)))
            case "command_sequence":
                controller.arm(self._written_command())
            case "ring_acknowledge":
                self._device.ring.acknowledge(int(self._value(name)))
            case "execute":
                controller.execute(int(self._value(name)))

    def _written_command(self) -> Command:
        start = self._command.address
        values = self._command.decode(self._words[start : start + self._command.words])
        return Command(
            sequence=int(values["command_sequence"]),
            code=int(values["command_code"]),
            target_mm=values["target"],
            speed_mm_per_s=values["speed"],
            mean_mm=values["mean"],
            amplitude_mm=values["amplitude"],
            frequency_Hz=values["frequency"],
            cycles=int(values["cycles"]),
            turning_force_kN=values["turning_force"],
            turning_stroke_mm=values["turning_stroke"],
            pause_s=values["static_pause"],
        )

    # --- reads --------------------------------------------------------------------------------------

    def _latch_status(self) -> None:
        device, controller = self._device, self._device.controller
        values: dict[str, float] = {
            "status_word": controller.status_word,
            "state": controller.state,
            "fault_code": controller.fault,
            "echo_sequence": controller.echo_sequence,
            "reject_code": controller.reject,
            "done_sequence": controller.done_sequence,
            "cycles_done": controller.cycles_done,
            "heartbeat": device.heartbeat,
            "watchdog_remaining": controller.watchdog.remaining_ms,
            "watchdog_trips": controller.watchdog.trips % 0x10000,
            "end_reason": controller.end_reason,
            "force": device.measured_force_kN,
            "stroke": device.measured_stroke_mm,
            "position": device.actuator.position_mm,
            "command": controller.command_mm,
            "tick": device.tick_us(self._now_s()),
            "request_echo": self._value("request_number") if self._profile.has("request_number") else 0,
            "status_check": 0,
        }
        values |= self._wrong(values)
        places = self._status.places
        words = self._status.encode({place.name: values[place.name] for place in places})
        if places[-1].name == "status_check":
            self._status_check(words)
        start = self._status.address
        self._tables[self._status.table][start : start + len(words)] = words

    def _wrong(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the registers that are stuck, or no numbers, by a simulated fault."""
        wrong: dict[str, float] = {}
        faults, now_s = self._device.faults, self._device.time_s
        if fault := faults.find("controller", "stuck", now_s):
            name = fault.name("register")
            wrong[name] = self._stuck.setdefault(name, values[name])
        else:
            self._stuck.clear()
        if fault := faults.find("controller", "nan", now_s):
            wrong[fault.name("register")] = math.nan
        return wrong

    def demand_register(self, fault: ScheduledFault) -> None:
        """See that the register that shall fail is one of the status, and can.

        Raises
        ------
        BadInput
            If it is not.
        """
        if fault.target != "controller" or fault.kind not in {"stuck", "nan"}:
            return
        kinds = ("f32",) if fault.kind == "nan" else ("f32", "u16", "u32", "i16", "i32")
        known = [place.name for place in self._status.places if place.kind in kinds]
        known = [name for name in known if name not in {"request_echo", "status_check"}]
        if (name := fault.name("register")) not in known:
            raise BadInput(
                f"no register “{name}” can be {fault.kind}{nearest(name, known)}",
                place=f"fault {fault}",
                remedy=f"those of the status that can: {', '.join(known) or 'none'}",
            )

    def _status_check(self, words: list[int]) -> None:
        """Put the CRC of the words before it into the last place."""
        place = self._status.places[-1]
        order = place.word_order or self._status.word_order
        words[place.offset :] = encode_value(crc_of(words[: place.offset]), place.kind, order)

    def _raw_registers(self, table: Table) -> list[tuple[str, ProfileRegister]]:
        return [(name, r) for name in self._raw if (r := self._profile.find(name)).table == table]

    def _latch_raw(self) -> None:
        """Lay the newest sample out: what a controller without a ring shows of its converters."""
        samples = self._device.ring
        if not samples.total:
            return
        _, columns = samples.window(samples.total - 1, 1)
        for name in self._profile.sampled:
            self._store(f"raw_{name}", int(columns[name][0]))

    def _value(self, name: str) -> float:
        register = self._profile.find(name)
        return self._profile.decode(name, self._words[register.address : register.address + register.words])

    def _store(self, name: str, value: float) -> None:
        register = self._profile.find(name)
        words = self._tables[register.table]
        words[register.address : register.address + register.words] = self._profile.encode(name, value)


class _WindowBank:
    """The window of the sample ring as registers.

    Parameters
    ----------
    device : SimulatedDevice
    profile : Profile
    ring : Ring
        The profile's window.
    """

    def __init__(self, device: SimulatedDevice, profile: Profile, ring: Ring) -> None:
        self._device = device
        self._header = profile.ring_header
        self._sample = profile.ring_sample
        self._most = ring.samples_per_block
        self._fields = tuple(name for name, _ in ring.header)
        self._rows = np.zeros((device.ring.capacity, self._sample.words), dtype=">u2")
        self._encoded = 0
        self.address, self.words = ring.address, ring.registers

    def is_whole(self, address: int, count: int) -> bool:
        """Return whether these registers are just the window."""
        return address == self.address and count == self.words

    def overlaps(self, start: int, end: int) -> bool:
        """Return whether some of the registers from ``start`` to before ``end`` are of the window."""
        return start < self.address + self.words and end > self.address

    def latch(self, acknowledged: int) -> bytes:
        """Return the window, as it is on the wire, for a reader who wants the samples from there on."""
        samples = self._device.ring
        self._encode_new_samples()
        first, count = samples.locate(samples.absolute(acknowledged), self._most)
        start = first % samples.capacity
        rows = self._rows[start : start + count].tobytes()
        if start + count > samples.capacity:
            rows += self._rows[: start + count - samples.capacity].tobytes()
        values = {
            ASKED: acknowledged,
            "first_sequence": first % (1 << 32),
            "count": count,
            "overruns": samples.overruns % 0x10000,
            "status_word": self._device.controller.status_word,
            CHECK: 0,
        }
        header = self._header.pack({name: values[name] for name in self._fields})
        if CHECK in self._fields:
            crc = zlib.crc32(rows, zlib.crc32(header[:-4]))
            header = header[:-4] + pack(encode_value(crc, "u32", self._header.word_order))
        return (header + rows).ljust(2 * self.words, b"\0")

    def _encode_new_samples(self) -> None:
        """Lay the samples that have come since the last look out as registers, all at once."""
        samples = self._device.ring
        encoded = max(self._encoded, samples.oldest)
        while encoded < samples.total:
            start = encoded % samples.capacity
            most = min(samples.total - encoded, samples.capacity - start)
            _, columns = samples.window(encoded, most)
            self._rows[start : start + most] = self._sample.pack_rows(
                {place.name: columns[place.name] for place in self._sample.places}
            )
            encoded += most
        self._encoded = encoded
