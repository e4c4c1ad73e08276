"""An amplifier with Modbus registers: polled in a thread of its own, by a map that is data.

Each value is stamped with the middle of its request; the stamp may be wrong by half of the round trip.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from typing import Literal

import numpy as np

from bufferstand.drivers.amplifiers.modbus.settings import RegisterEntry
from bufferstand.drivers.amplifiers.serial import SILENCE_S, STREAM, with_saturation
from bufferstand.drivers.interfaces import SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.mailbox import Mailbox
from bufferstand.drivers.modbus import ModbusLink
from bufferstand.drivers.register_maps import AmplifierMap, decode_value, status_texts
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import PlausibilityWatch

STUCK_S = 2.0
"""Stand time without a new measurement after which the amplifier counts as stuck [s]."""
_RETRY_S = 1.0
_POLL_S = 0.001
_RATE_TOLERANCE = 0.01
_DTYPES = {"u16": np.uint16, "i16": np.int16, "u32": np.uint32, "i32": np.int32, "f32": np.float32}


class ModbusAmplifier:
    """Sensor of :mod:`bufferstand.drivers.interfaces`: force through an amplifier with registers, stamped
    with host time.

    Parameters
    ----------
    link : ModbusLink
        To the amplifier; this object owns it.
    registers : AmplifierMap
        What lies where.
    settings : RegisterEntry
        Rate at which it is asked, channel.
    clock : Clock
        Stand time for the stamps, wall time for the judgement of silence.
    stream : str
        What its samples are called.
    """

    facts: StreamFacts

    def __init__(
        self,
        link: ModbusLink,
        registers: AmplifierMap,
        settings: RegisterEntry,
        clock: Clock,
        stream: str = STREAM,
    ) -> None:
        device = f"Modbus amplifier, map {registers.id} edition {registers.edition}"
        self.facts = StreamFacts(stream, "host", (settings.channel,), settings.rate_Hz, device)
        self._link = link
        self._map = registers
        self._period_s = 1.0 / settings.rate_Hz
        self._rate_Hz = settings.rate_Hz
        self._clock = clock
        self._mailbox = Mailbox()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._watch = PlausibilityWatch(with_saturation(settings.channel, registers.saturation))
        self._wrong: set[str] = set()
        self._sequence = 0
        self._missed = 0
        self._due_s = 0.0
        self._last_us = -1
        self._counter: int | None = None
        self._new_s = 0.0
        self._heard_wall_s = 0.0
        self._failing = False

    def start(self) -> None:
        """Connect, check the amplifier by its map, begin to ask; does nothing if it reads already.

        Raises
        ------
        DeviceFault
            If it does not answer, is another one, or measures slower than it is to be asked.
        """
        if self._thread is not None:
            return
        try:
            self._check()
        except DeviceFault:
            self._link.close()
            raise
        finally:
            self._tell_events()
        self._stop.clear()
        self._due_s = self._new_s = self._clock.now_s()
        self._heard_wall_s = self._clock.wall_s()
        self._thread = threading.Thread(target=self._run, name=self.facts.name, daemon=True)
        self._thread.start()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call; never blocks."""
        return self._mailbox.take()

    def close(self) -> None:
        """Stop reading and let go of the wire; never raises."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(timeout=2.0)
            self._thread = None
        self._link.close()

    def _check(self) -> None:
        identity, rate = self._map.identity, self._map.rate
        if identity is not None:
            words = self._link.read(identity.address, identity.words, "identity", table=self._table)
            self._check_identity(words)
        if rate is not None:
            words = self._link.read(rate.address, rate.words, "rate", table=self._table)
            measured_Hz = float(decode_value(words, rate.type, self._map.word_order))
            if measured_Hz < self._rate_Hz * (1.0 - _RATE_TOLERANCE):
                raise DeviceFault(
                    f"{self._name}: it makes {measured_Hz:g} measurements a second, the stand file asks for "
                    f"{self._rate_Hz:g}; values would come twice (amplifier.rate_Hz)"
                )

    def _check_identity(self, words: Sequence[int]) -> None:
        identity = self._map.identity
        assert identity is not None
        found = decode_value(words, identity.type, self._map.word_order)
        if found == identity.expect:
            return
        swapped = "little" if self._map.word_order == "big" else "big"
        if decode_value(words, identity.type, swapped) == identity.expect:
            cause = f"the words are swapped; set word_order = “{swapped}” in the map"
        else:
            shown = f"0x{found:X}" if isinstance(found, int) else f"{found:g}"
            cause = f"it holds {shown}; look at device id, address (numbered from 1?) and table of the map"
        raise DeviceFault(f"{self._name}: register {identity.address} does not identify it: {cause}")

    @property
    def _table(self) -> Literal["holding", "input"]:
        return "input" if self._map.table == "input" else "holding"

    @property
    def _name(self) -> str:
        return f"{self.facts.name} at {self._link.address}"

    def _run(self) -> None:
        while not self._stop.is_set():
            if self._clock.now_s() < self._due_s:
                self._stop.wait(_POLL_S)
                continue
            try:
                self._read_once()
            except DeviceFault as fault:
                if not self._failing:  # told once, not with every request of an outage
                    self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), str(fault)))
                self._failing = True
                if self._clock.wall_s() - self._heard_wall_s > SILENCE_S:
                    self._stop.wait(_RETRY_S)
            self._tell_events()

    def _read_once(self) -> None:
        block, order = self._map.block, self._map.word_order
        asked_s = self._clock.now_s()
        words = self._link.read(block.first, block.words, "value", table=self._table)
        answered_s = self._clock.now_s()
        self._failing = False
        self._heard_wall_s = self._clock.wall_s()
        at_s = 0.5 * (asked_s + answered_s)
        missed = max(0, math.floor((answered_s - self._due_s) / self._period_s))
        self._due_s += (missed + 1) * self._period_s
        self._missed += missed
        value = block.decode(words, self._map.value, order)
        wrong: dict[str, str] = {}
        if self._map.status is not None:
            status = int(block.decode(words, self._map.status, order))
            wrong |= {
                key: f"{self._name}: {text}" for key, text in status_texts(status, self._map.status.bits)
            }
        if self._is_old(words, at_s, wrong):
            self._tell(wrong, ends=False)  # an old measurement says nothing about the present
            return
        if isinstance(value, float) and not math.isfinite(value):
            wrong["nan"] = f"{self._name}: its value is {value}; look at its transducer and settings"
            self._tell(wrong)
            return
        self._post(value, at_s, wrong)

    def _is_old(self, words: Sequence[int], at_s: float, wrong: dict[str, str]) -> bool:
        """Return whether the measurement was seen before; say it if that lasts."""
        counter = self._map.counter
        if counter is None:
            return False
        now = int(self._map.block.decode(words, counter, self._map.word_order))
        if now != self._counter:
            self._counter, self._new_s = now, at_s
            return False
        if at_s - self._new_s >= STUCK_S:
            wrong["stuck"] = (
                f"{self._name}: it answers, but its counter stands at {now} for {at_s - self._new_s:.1f} s: "
                "it measures no more; look at the amplifier itself"
            )
        return True

    def _post(self, value: float, at_s: float, wrong: dict[str, str]) -> None:
        channel = self.facts.channels[0]
        time_us = max(round(at_s * 1e6), self._last_us + 1)
        # Also those before an answer that held no new measurement, or none at all.
        lost, self._missed = (self._missed if self._sequence else 0), 0
        raw = np.array([value], dtype=_DTYPES[self._map.value.type])
        times = np.array([time_us], dtype=np.int64)
        for found in self._watch.look(times, raw, channel.calibration.apply(raw)):
            wrong.setdefault(found.kind, f"{self._name}: {found.what}")
        self._sequence += lost
        self._mailbox.put(
            SampleBlock(
                self.facts.name, self._sequence, times, {channel.name: raw}, lost, self._clock.now_s()
            )
        )
        self._sequence += 1
        self._last_us = time_us
        self._tell(wrong)

    def _tell(self, wrong: dict[str, str], *, ends: bool = True) -> None:
        """Say each state once when it begins; it may be said again when it has ended."""
        for key, text in wrong.items():
            if key not in self._wrong:
                self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), text))
        self._wrong = set(wrong) if ends else self._wrong | set(wrong)

    def _tell_events(self) -> None:
        for text in self._link.events():
            self._mailbox.put(SensorFault(self.facts.name, self._clock.now_s(), f"{self._name}: {text}"))
