"""The simulated controller's registers, as its profile lays them out; knows no sockets.

Every read is one latched snapshot; what a write means is found by the names of the registers that it touches.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from drivers.profile import RING_REGISTERS, Profile
from drivers.simulated.commands import Command
from drivers.simulated.device import RATE_HZ, SimulatedDevice
from drivers.simulated.ring import COLUMNS
from foundation.errors import BadInput

ILLEGAL_VALUE = 3
"""Modbus exception code for a value that a register does not take."""

_STATUS = ("status_word", "tick")
_COMMAND = ("command_sequence", "static_pause")
_HEADER = ("first_sequence", "count", "overruns", "status_word")


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
        self._status = profile.block(*_STATUS)
        self._command = profile.block(*_COMMAND)
        self._header = profile.ring_header
        self._sample = profile.ring_sample
        known = {**COLUMNS, **dict.fromkeys(RING_REGISTERS), **dict.fromkeys(_HEADER)}
        for part in (self._status, self._command, self._header, self._sample):
            if unknown := [place.name for place in part.places if place.name not in known]:
                raise BadInput(
                    f"the simulated controller has no “{unknown[0]}”",
                    file=profile.facts.id,
                    remedy="use the shipped profile “ring”, or one with its names at other addresses",
                )
        self._names = {
            at: name
            for name, register in profile.registers.items()
            for at in range(register.address, register.address + register.words)
        }
        self._rows = np.zeros((device.ring.capacity, self._sample.words), dtype=np.uint16)
        self._encoded = 0
        ring = profile.ring
        size = max(r.address + r.words for r in profile.registers.values())
        self._words = [0] * max(size, ring.address + ring.registers)
        for name, register in profile.registers.items():
            if register.expect is not None:
                self._store(name, register.expect)
        controller = device.controller
        for name, value in (
            ("serial", device.settings.seed),
            ("sample_rate", RATE_HZ),
            ("force_limit", controller.force_limit_kN),
            ("stroke_limit", controller.stroke_limit_mm),
        ):
            self._store(name, value)

    @property
    def size(self) -> int:
        """Addresses from 0 on that the bank spans."""
        return len(self._words)

    def read(self, address: int, count: int) -> list[int]:
        """Return registers as one snapshot of the device."""
        end = address + count
        if address < self._status.address + self._status.words and end > self._status.address:
            self._latch_status()
        ring = self._profile.ring
        if address < ring.address + ring.registers and end > ring.address:
            self._latch_ring()
        return self._words[address:end]

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
        if not self._limits_accepted(touched):
            self._words[address:end] = before
            return ILLEGAL_VALUE
        for name in touched:
            self._act(name)
        return 0

    def is_acknowledgement(self, address: int, count: int) -> bool:
        """Return whether a write only says which samples have been read: the stand does not care."""
        register = self._profile.find("ring_acknowledge")
        return address >= register.address and address + count <= register.address + register.words

    # --- writes -------------------------------------------------------------------------------------

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
        start = self._status.address
        self._words[start : start + self._status.words] = self._status.encode(
            {
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
            }
        )

    def _latch_ring(self) -> None:
        ring, samples = self._profile.ring, self._device.ring
        self._encode_new_samples()
        wanted = samples.absolute(int(self._value("ring_acknowledge")))
        first, count = samples.locate(wanted, ring.samples_per_block)
        words = self._header.encode(
            {
                "first_sequence": first % (1 << 32),
                "count": count,
                "overruns": samples.overruns % 0x10000,
                "status_word": self._device.controller.status_word,
            }
        )
        start = first % samples.capacity
        words += self._rows[start : start + count].ravel().tolist()
        if start + count > samples.capacity:
            words += self._rows[: start + count - samples.capacity].ravel().tolist()
        words += [0] * (ring.registers - len(words))
        self._words[ring.address : ring.address + ring.registers] = words

    def _encode_new_samples(self) -> None:
        """Lay the samples that have come since the last look out as registers, all at once."""
        samples, words = self._device.ring, self._sample.words
        encoded = max(self._encoded, samples.oldest)
        while encoded < samples.total:
            start = encoded % samples.capacity
            most = min(samples.total - encoded, samples.capacity - start)
            _, columns = samples.window(encoded, most)
            picked = {place.name: columns[place.name] for place in self._sample.places}
            self._rows[start : start + most] = np.reshape(self._sample.encode_rows(picked), (most, words))
            encoded += most
        self._encoded = encoded

    def _value(self, name: str) -> float:
        register = self._profile.find(name)
        return self._profile.decode(name, self._words[register.address : register.address + register.words])

    def _store(self, name: str, value: float) -> None:
        register = self._profile.find(name)
        self._words[register.address : register.address + register.words] = self._profile.encode(name, value)
