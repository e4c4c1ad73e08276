"""A controller of the ring profile in memory, as simple as its documentation allows: no physics, no time.

The tests decide when samples come and when a motion ends. It is written from the profile's text, apart from
the driver, and served by three Modbus servers (see ``servers``).
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from bufferstand.drivers.register_maps.coding import crc_of
from bufferstand.drivers.register_maps.profile import STATUS, Profile

PERIOD_US = 1000


class RingDevice:
    def __init__(
        self, profile: Profile, *, capacity: int = 4096, first_sequence: int = 0, tick: int = 0
    ) -> None:
        self.profile = profile
        self.words = [0] * 1024
        self.capacity = capacity
        self.oldest = self.newest = first_sequence  # samples oldest … newest-1 are held
        self.origin = (first_sequence, tick)
        self.missed: dict[int, int] = {}  # before sequence: cycles without a sample, though its clock went on
        self.overruns = 0
        self.at_rest = False  # samples show the values below instead of a pattern
        self.force_kN = 0.0
        self.apart_mm = 0.0
        self.obedient = True  # takes the control words
        self.reject = 0
        self.executed: list[dict[str, float]] = []
        self.fed: list[int] = []
        self.control_words: list[int] = []
        self.lock = threading.RLock()
        for register in profile.registers.values():
            if register.expect is not None:
                self.set(register.name, register.expect)
        self.set("serial", 630001)
        self.set("sample_rate", 1e6 / PERIOD_US)
        self.set("status_word", 0x0240)

    # --- registers ---
    def set(self, name: str, value: float) -> None:
        words = self.profile.encode(name, value)
        address = self.profile.find(name).address
        self.words[address : address + len(words)] = words

    def get(self, name: str) -> float:
        register = self.profile.find(name)
        return self.profile.decode(name, self.words[register.address : register.address + register.words])

    def read(self, address: int, count: int) -> list[int]:
        with self.lock:
            ring = self.profile.ring
            if address <= ring.address < address + count:
                self.words[ring.address : ring.address + ring.registers] = self.window()
            if address <= self.profile.find("status_word").address < address + count:
                self.set("heartbeat", (self.get("heartbeat") + 1) % 0x10000)
                if self.profile.has("status_check"):
                    self.set("request_echo", self.get("request_number"))
                    before = self.profile.find("status_check").address
                    self.set("status_check", crc_of(self.words[self.profile.span(STATUS).address : before]))
            return self.words[address : address + count]

    def write(self, address: int, values: list[int]) -> None:
        with self.lock:
            self.words[address : address + len(values)] = values
            written = {
                register.name
                for register in self.profile.registers.values()
                if address <= register.address < address + len(values)
            }
            if "command_sequence" in written:
                self.judge()
            if "execute" in written:
                self.execute(int(self.get("execute")))
            if "watchdog_feed" in written:
                self.fed.append(int(self.get("watchdog_feed")))
            if "control_word" in written:
                self.control(int(self.get("control_word")))

    # --- behaviour ---
    def judge(self) -> None:
        self.set("echo_sequence", self.get("command_sequence"))
        self.set("reject_code", self.reject)

    def execute(self, sequence: int) -> None:
        armed = int(self.get("command_sequence"))
        if sequence != armed:
            self.set("reject_code", 4)
            return
        if self.executed and self.executed[-1]["command_sequence"] == sequence:
            return  # sent twice, done once
        block = self.profile.block("command_sequence", "static_pause")
        start = block.address
        self.executed.append(block.decode(self.words[start : start + block.words]))
        if self.executed[-1]["command_code"] == 1:  # a hold that stands has ended at once
            self.set("done_sequence", sequence)
            self.set("end_reason", 1)

    def control(self, word: int) -> None:
        self.control_words.append(word)
        status = int(self.get("status_word"))
        if not self.obedient:
            return
        if status & 0x8:  # fault: only the reset leads out
            new = 0x0240 if word & 0x80 else status
        else:
            steps = {0x0000: 0x0240, 0x0006: 0x0231, 0x0007: 0x0233, 0x000F: 0x0237}
            allowed = {0x0006: True, 0x0007: status & 0x1, 0x000F: status & 0x3 == 0x3, 0x0000: True}
            new = steps[word] if allowed.get(word) else status
        self.set("status_word", new)
        self.set("fault_code", 0 if not new & 0x8 else self.get("fault_code"))
        self.set("state", 2 if new & 0x4 else 0)

    # --- ring ---
    def sample(self, count: int) -> None:
        with self.lock:
            self.newest += count
            over = self.newest - self.capacity - self.oldest
            if over > 0:
                self.oldest += over
                self.overruns += 1

    def rows(self, first: int, count: int) -> dict[str, Any]:
        sequence = np.arange(first, first + count, dtype=np.int64)
        elapsed = (sequence - self.origin[0]) * PERIOD_US + self.origin[1]
        for first_behind, cycles in self.missed.items():
            elapsed = elapsed + np.where(sequence >= first_behind, cycles * PERIOD_US, 0)
        if self.at_rest:
            return {
                "tick": elapsed % (1 << 32),
                "force": np.full(count, round(self.force_kN / 100 * 2**20)),
                "stroke_1": np.zeros(count, dtype=np.int64),
                "stroke_2": np.full(count, round(self.apart_mm / 500 * 2**16)),
                "position": np.zeros(count, dtype=np.int64),
                "command": np.zeros(count, dtype=np.int64),
            }
        return {
            "tick": elapsed % (1 << 32),
            "force": sequence % 10_000_000 * 7 - 1_000_000,
            "stroke_1": sequence % 65536,
            "stroke_2": (sequence + 1) % 65536,
            "position": sequence % 30000 - 15000,
            "command": -(sequence % 30000),
        }

    def window(self) -> list[int]:
        ring, header, sample = self.profile.ring, self.profile.ring_header, self.profile.ring_sample
        wanted = int(self.get("ring_acknowledge"))
        behind = (self.newest - wanted) % (1 << 32)
        first = self.newest - behind if behind < 1 << 31 else self.newest
        first = max(first, self.oldest)
        count = min(ring.samples_per_block, self.newest - first)
        named = {place.name for place in header.places}
        values = {
            "asked": wanted,
            "first_sequence": first % (1 << 32),
            "count": count,
            "overruns": self.overruns % 65536,
            "status_word": self.get("status_word"),
            "check": 0,
        }
        values = {name: value for name, value in values.items() if name in named}
        rows = sample.encode_rows(self.rows(first, count)) if count else []
        if "check" in named:
            values["check"] = crc_of(header.encode(values)[:-2] + rows)
        words = header.encode(values) + rows
        return words + [0] * (ring.registers - len(words))
