"""The simulated sensors without wires, behind the interface that the acquisition sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bufferstand.drivers.amplifiers import resync_text, with_saturation
from bufferstand.drivers.instruments import Instrument, SensorType
from bufferstand.drivers.interfaces import SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.simulated.inprocess.virtual_clock import VirtualClock
from bufferstand.drivers.simulated.machine import (
    InstrumentValues,
    SimulatedDevice,
    SimulatedInstrument,
    Thermometer,
)
from bufferstand.foundation.channels import PlausibilityWatch


class InProcessInstrument:
    """An instrument beside the controller, as a Sensor of :mod:`bufferstand.drivers.interfaces`.

    Parameters
    ----------
    device : SimulatedDevice
    instrument : Instrument
        Of its stand file.
    simulated : SimulatedInstrument
        The same, in the device.
    clock : VirtualClock
    """

    def __init__(
        self,
        device: SimulatedDevice,
        instrument: Instrument,
        simulated: SimulatedInstrument,
        clock: VirtualClock,
    ) -> None:
        channel, form = instrument.channel, simulated.form
        self._device = device
        self._frames = simulated.frames
        self._form = form
        self._passed = 0
        self._clock = clock
        self._stream = instrument.stream
        self._name = channel.name
        self._sequence = 0
        self._calibration = channel.calibration
        self._watch = PlausibilityWatch(with_saturation(channel, (form.low, form.high)))
        self._wrong: set[str] = set()
        self._lost = self._resyncs = 0
        self._silent = False
        self.facts = StreamFacts(
            instrument.stream,
            "host",
            (channel,),
            instrument.settings.rate_Hz,
            f"simulated {instrument.kind.table}, in process",
            simulated=True,
        )

    def start(self) -> None:
        """Begin to read: older values are forgotten."""
        self._frames.clear()

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call."""
        frames = self._asked_for()
        faults = self._device.faults
        frames, lost = self._spoiled(frames)
        said = self._wire_faults()
        if said and frames:
            lost += frames.pop(0).counts.size
        frames = [
            replace(f, counts=np.full_like(f.counts, self._form.high))
            if faults.find(self._stream, "overload", float(f.time_s[-1]))
            else f
            for f in frames
        ]
        if not frames:
            self._lost += lost
            return said
        lost, self._lost = lost + self._lost, 0
        time_us = np.rint(np.concatenate([f.time_s for f in frames]) * 1e6).astype(np.int64)
        counts = np.concatenate([f.counts for f in frames]).astype(self._form.dtype)
        first = self._sequence + lost
        self._sequence = first + counts.size
        block = SampleBlock(self._stream, first, time_us, {self._name: counts}, lost, self._clock.now_s())
        return [*said, block, *self._complaints(block)]

    def _asked_for(self) -> list[InstrumentValues]:
        """Take what has been measured; of an amplifier with registers, that which would be asked for."""
        taken: list[InstrumentValues] = []
        for one in self._frames:
            first = -self._passed % self._form.every
            self._passed += one.counts.size
            if first < one.counts.size:
                every = slice(first, None, self._form.every)
                taken.append(InstrumentValues(one.time_s[every], one.counts[every]))
        self._frames.clear()
        return taken

    def _spoiled(self, frames: list[InstrumentValues]) -> tuple[list[InstrumentValues], int]:
        """Return what comes through in spite of the schedule's faults, and how many values do not."""
        faults = self._device.faults
        left: list[InstrumentValues] = []
        for one in frames:
            at_s = float(one.time_s[-1])
            if faults.find(self._stream, "silent", at_s):
                continue
            if not any(faults.strikes(self._stream, kind, at_s) for kind in ("drop", "corrupt")):
                left.append(one)
        return left, sum(f.counts.size for f in frames) - sum(f.counts.size for f in left)

    def _wire_faults(self) -> list[SampleBlock | SensorFault]:
        """Return what the driver of a real amplifier would say of the line."""
        now_s = self._clock.now_s()
        texts: list[str] = []
        for _ in self._device.faults.due(now_s, self._stream):
            self._resyncs += 1
            texts.append(resync_text(self._resyncs))
        was, self._silent = self._silent, self._device.faults.find(self._stream, "silent", now_s) is not None
        if self._silent and not was:
            texts.append("silent; look at cable, power and port")
        return [SensorFault(self._stream, now_s, f"{self._stream} (simulated): {text}") for text in texts]

    def _complaints(self, block: SampleBlock) -> list[SensorFault]:
        """Return what cannot be true in a block, where it was true in the one before."""
        counts = block.counts[self._name]
        found = self._watch.look(block.time_us, counts, self._calibration.apply(counts))
        wrong = {item.kind: item.what for item in found}
        new = [text for kind, text in wrong.items() if kind not in self._wrong]
        self._wrong = set(wrong)
        return [
            SensorFault(self._stream, block.received_s, f"{self._stream} (simulated): {text}") for text in new
        ]

    def close(self) -> None:
        """Let go: nothing to do."""


class InProcessThermometer:
    """One temperature sensor's stream, as a Sensor of :mod:`bufferstand.drivers.interfaces`.

    Parameters
    ----------
    device : SimulatedDevice
    thermometer : Thermometer
        Of that device.
    sensor_type : SensorType
        What it is.
    clock : VirtualClock
    period_s : float
        It is read once in this time [s].
    """

    def __init__(
        self,
        device: SimulatedDevice,
        thermometer: Thermometer,
        sensor_type: SensorType,
        clock: VirtualClock,
        period_s: float,
    ) -> None:
        self._device = device
        self._thermometer = thermometer
        self._clock = clock
        self._period_s = period_s
        self._next_s = period_s
        self._sequence = 0
        self._last: int | None = None
        self._type = sensor_type
        self._name = thermometer.settings.name
        self.facts = sensor_type.stream_facts(thermometer.settings, period_s, simulated=True)

    def start(self) -> None:
        """Begin to read."""
        self._next_s = self._clock.now_s() + self._period_s

    def drain(self) -> Sequence[SampleBlock | SensorFault]:
        """Get (and forget) what has come in since the last call."""
        came: list[SampleBlock | SensorFault] = []
        while self._next_s <= self._clock.now_s():
            if self._device.faults.at(self._name, self._next_s) != "stale":  # its reads hang
                came.append(self._read(self._next_s))
            self._next_s += self._period_s
        return came

    def close(self) -> None:
        """Let go: nothing to do."""

    def _read(self, at_s: float) -> SampleBlock | SensorFault:
        fault = self._device.faults.at(self._name, at_s)
        readings = reversed(self._thermometer.readings)
        counts = next((counts for time_s, counts in readings if time_s <= at_s), None)
        if fault == "frozen" and self._last is not None:
            counts = self._last
        self._last = counts
        text = None if fault is None else self._type.faults[fault]
        if text is None and counts is None:
            text = "it has not measured yet; look at it again in a second"
        if text is not None:
            return SensorFault(self._name, at_s, f"{self._name} (simulated): {text}")
        first, self._sequence = self._sequence, self._sequence + 1
        return SampleBlock(
            self._name,
            first,
            np.array([round(at_s * 1e6)], dtype=np.int64),
            {self._name: np.array([counts], dtype=self._type.form.dtype)},
            0,
            self._clock.now_s(),
        )
