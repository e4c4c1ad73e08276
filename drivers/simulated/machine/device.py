"""The stand without wires: controller, actuator, specimen and transducers, advanced sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.simulated.faults import FOREVER_S, FaultSchedule, ScheduledFault
from bufferstand.drivers.simulated.imperfections import ColouredNoise, Latency, MissedCycles, TransducerDrift
from bufferstand.drivers.simulated.machine.acquisition import SimulatedAcquisition
from bufferstand.drivers.simulated.machine.commands import Capabilities, ControllerFault
from bufferstand.drivers.simulated.machine.controller import SimulatedController
from bufferstand.drivers.simulated.machine.felt_quantities import FeltQuantities
from bufferstand.drivers.simulated.machine.instruments import SimulatedInstrument
from bufferstand.drivers.simulated.machine.physics import Actuator, ActuatorFacts, SpecimenAndFrame, Spring
from bufferstand.drivers.simulated.machine.ring import SampleRing
from bufferstand.drivers.simulated.machine.sampled_columns import SampledColumns, mean_of
from bufferstand.drivers.simulated.machine.thermometer import Thermometer
from bufferstand.drivers.simulated.machine.truth import TruthLog
from bufferstand.drivers.simulated.miswiring import MiswiredStand
from bufferstand.drivers.simulated.settings import SimulationSettings
from bufferstand.drivers.simulated.transducers import Converters, Delay, DrawWires
from bufferstand.drivers.stand_file import StandFile, acquisition_stream

RATE_HZ = 1000.0
"""Samples a second of the controller's own clock."""
SLICE = 200
"""Most samples that are advanced before wall time and thermometers are looked at again."""
DWELL = 100
"""Most samples that are bridged by one step while nothing moves."""

_US = 1_000_000
_PERIOD_US = round(_US / RATE_HZ)
_MISSED_SEED = 0x6D697373
_ACQUISITION_SEED = 0x61637175
_INSTRUMENT_SEED = 0x696E7374


class SimulatedDevice:
    """A whole stand, advanced by stand time.

    Parameters
    ----------
    stand_file : StandFile
        Channels, limits, sensors.
    settings : SimulationSettings
        Physics and imperfections.
    spring : Spring
        The specimen.
    wall_s : callable
        Monotonic wall time [s], for the watchdog.
    truth : Truth, optional
        Where to log what really happens.
    faults : sequence of ScheduledFault
        What shall fail, and when.
    fault_seed : int
        By which the frames are picked that a fault strikes.

    Raises
    ------
    BadInput
        If a channel's calibration cannot be inverted.
    """

    def __init__(
        self,
        stand_file: StandFile,
        settings: SimulationSettings,
        spring: Spring,
        wall_s: Callable[[], float],
        truth: TruthLog | None = None,
        faults: Sequence[ScheduledFault] = (),
        fault_seed: int = 0,
    ) -> None:
        self.settings = settings
        self.spring = spring
        self.truth = truth
        self.wall_s = wall_s
        self.faults = FaultSchedule(faults, fault_seed)
        self._jumps: list[tuple[int, int]] = []
        self._gaps: list[int] = []
        self._held: dict[str, float] = {}
        self._clock_rate = 1.0 + settings.clock_drift_ppm * 1e-6
        self.period_s = 1.0 / (RATE_HZ * self._clock_rate)
        limits, profile = stand_file.limits, stand_file.profile()
        self.controller = SimulatedController(
            Capabilities(
                limits.force_max_kN,
                limits.stroke_max_mm,
                limits.speed_max_mm_per_s,
                limits.frequency_max_Hz,
                adjusts=profile.adjusts(profile.version),
            ),
            1.0 / RATE_HZ,
            wall_s,
        )
        self.actuator = Actuator(
            ActuatorFacts(
                settings.actuator_bandwidth_Hz,
                settings.actuator_damping,
                limits.speed_max_mm_per_s,
                servo_lag_s=settings.servo_lag_s,
                reversal_s=settings.reversal_s,
                force_speed=settings.force_speed or limits.force_speed or (),
            ),
            self.period_s,
            settings.piston_start_mm,
        )
        self.controller.position_mm = self.controller.command_mm = settings.piston_start_mm
        self.contact = SpecimenAndFrame(spring, settings.frame_stiffness_kN_per_mm, self.period_s)
        self._delay = Delay(settings.force_delay_s, self.period_s, settings.force_low_pass_Hz)
        self._drift = TransducerDrift.of(settings, _wires_of(stand_file))
        self._columns = SampledColumns(stand_file, settings)
        self._quantities = FeltQuantities(settings, self._drift)
        self._miswired = MiswiredStand(stand_file, settings.miswired, self.period_s, self._columns.names)
        self._cell_force_kN = 0.0
        self.measured_force_kN = 0.0
        """What the controller takes for the force; that of its cell, where it is wired right."""
        self.measured_stroke_mm = 0.0
        self.time_s = 0.0
        self.ring = SampleRing(columns=self._columns.dtypes)
        self.latency = Latency(settings.reply_latency_s, settings.reply_jitter_s, settings.seed)
        """How long requests to the controller and its replies are on their way."""
        # A seed of its own: transducers draw the same noise with and without missed cycles.
        seed = np.random.SeedSequence((settings.seed, _MISSED_SEED))
        self._missed = MissedCycles(settings.missed_cycles_per_h, RATE_HZ, seed)
        self._make_transducers(stand_file, settings)

    def _make_transducers(self, stand_file: StandFile, settings: SimulationSettings) -> None:
        sensors = [
            (sensor, device.kind.sensor_type)
            for device in stand_file.thermometers
            for sensor in device.sensors
        ]
        seeds = np.random.SeedSequence(settings.seed).spawn(3 + len(sensors))
        self._converters = Converters(self._columns.converters(), seeds[0])
        wires = len(self._columns.strokes)
        self._wires = DrawWires(settings.wire_linearity_mm, settings.wire_tilt, wires)
        self._wander = ColouredNoise(
            (settings.force_flicker_kN, *[settings.stroke_flicker_mm] * wires),
            (settings.force_hum_kN, *[settings.stroke_hum_mm] * wires),
            self.period_s,
            seeds[-1],
        )
        self.instruments = tuple(self._instruments(stand_file, settings, seeds[1]))
        own = np.random.SeedSequence((settings.seed, _ACQUISITION_SEED)).spawn(len(stand_file.acquisition))
        self.acquisition = tuple(
            SimulatedAcquisition(entry, acquisition_stream(number), settings, own[number])
            for number, entry in enumerate(stand_file.acquisition)
        )
        self.thermometers = tuple(
            Thermometer(one, what, settings.temperature_noise_C, seed, self._miswired.place_of(one))
            for (one, what), seed in zip(sensors, seeds[2:-1], strict=True)
        )
        self._look_at_thermometers()

    def _instruments(
        self, stand_file: StandFile, settings: SimulationSettings, seed: np.random.SeedSequence
    ) -> Iterator[SimulatedInstrument]:
        """Yield what measures beside the controller; a wrong wiring is one of the first amplifier."""
        # Seeds of their own: a further instrument leaves the noise of all others as it was.
        further = np.random.SeedSequence((settings.seed, _INSTRUMENT_SEED)).spawn(len(stand_file.instruments))
        for number, one in enumerate(stand_file.instruments):
            if one.stream == "amplifier":
                yield SimulatedInstrument(one, settings, seed, self._miswired.second_force)
            else:
                yield SimulatedInstrument(one, settings, further[number])

    # --- time ---------------------------------------------------------------------------------------

    def advance_to(self, time_s: float, most: int | None = None) -> int:
        """Advance to a stand time.

        Parameters
        ----------
        time_s : float
            Stand time [s].
        most : int, optional
            Most periods to advance; what is left follows with a later call, nothing is dropped.

        Returns
        -------
        int
            Periods that are left to advance.
        """
        due = int(time_s / self.period_s + 1e-6) - self.ring.periods
        count = due if most is None else min(due, most)
        if count > 0:
            self.advance(count)
        else:
            self._fail_when_due()
            self.controller.look_at_watchdog()
        left = max(0, due - max(count, 0))
        self.time_s = max(self.time_s, self.ring.periods * self.period_s if left else time_s)
        return left

    def advance(self, count: int) -> None:
        """Advance by ``count`` periods of the controller's clock: each has a sample, or was missed."""
        while count > 0:
            self._fail_when_due()
            self.controller.look_at_watchdog()
            count -= self._advance_some(count)
            self.time_s = self.ring.periods * self.period_s
            self._look_at_thermometers()

    def _advance_some(self, count: int) -> int:
        """Advance by at most ``count`` periods in which one thing happens; return how many they were."""
        undisturbed = min(count, self._samples_to_next_fault(), self._missed.next - self.ring.periods)
        if undisturbed == 0:
            self._miss_cycle()
            return 1
        still = min(undisturbed, DWELL, self._still_samples())
        if still > 1:
            self._dwell(still)
            return still
        some = min(undisturbed, SLICE)
        self._move(some)
        return some

    def tick_us(self, time_s: float) -> int:
        """Return the controller's clock, 32 bits, at a stand time [µs]."""
        jumped_us = sum(jump_us for _, jump_us in self._jumps)
        return (self.settings.tick_start_us + jumped_us + round(time_s * self._clock_rate * _US)) % (1 << 32)

    def time_us(self, sequence: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the controller's time stamps of samples without wrapping [µs], same shape."""
        stamps: NDArray[np.int64] = self.settings.tick_start_us + self._periods_of(sequence) * _PERIOD_US
        for first, jump_us in self._jumps:
            stamps += np.where(sequence >= first, jump_us, 0)
        return stamps

    def _periods_of(self, sequence: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the periods that had passed when samples were taken, same shape."""
        passed: NDArray[np.int64] = sequence + 1
        return passed + np.searchsorted(self._gaps, sequence, side="right") if self._gaps else passed

    @property
    def heartbeat(self) -> int:
        """Counts up by one every 10 ms of device time, 16 bits."""
        return self.ring.total // 10 % (1 << 16)

    # --- faults -------------------------------------------------------------------------------------

    def _samples_to_next_fault(self) -> int:
        """Return after how many samples a fault begins or ends, so that it does so at its sample."""
        change_s = self.faults.next_change_s(self.time_s)
        if change_s == FOREVER_S:
            return SLICE
        return max(1, round(change_s / self.period_s) - self.ring.periods)

    def _fail_when_due(self) -> None:
        """Let the faults of an instant happen."""
        for fault in self.faults.due(self.time_s, "controller"):
            match fault.kind:
                case "trip":
                    self.controller.fail(ControllerFault(int(fault.number("code"))))
                case "watchdog":
                    self.controller.watchdog.expire()
                case "clock-jump":
                    self._jumps.append((self.ring.total, round(fault.number("jump_s") * _US)))
                case "overrun":
                    self.ring.forget(int(fault.number("keep")))

    def _break_transducers(self, counts: NDArray[np.float64]) -> None:
        """Overwrite the counts, shape (n, channels), of channels whose transducer is broken or stuck."""
        for column, name in enumerate(self._columns.names):
            kind = self.faults.at(name, self.time_s)
            if kind == "stuck":
                counts[:, column] = self._held.setdefault(name, counts[0, column])
                continue
            self._held.pop(name, None)
            if kind == "broken":
                fault = self.faults.find(name, kind, self.time_s)
                low, high = self._converters.ends(column)
                counts[:, column] = high if fault is not None and fault.name("side") == "high" else low

    def _look_at_thermometers(self) -> None:
        for thermometer in self.thermometers:
            specimen = thermometer.settings.role == "specimen"
            specimen_C, ambient_C = self.spring.sensor_temperature_C, self.settings.ambient_C
            felt_C = specimen_C if specimen else ambient_C
            if thermometer.place is not None:
                felt_C = thermometer.place.feel(self.time_s, specimen_C, ambient_C)
            thermometer.look(self.time_s, felt_C)

    def _still_samples(self) -> int:
        if self._miswired.acted_on is not None and self._miswired.acted_on.has_memory:
            return 0  # what the controller feels can change while nothing moves
        if not self.controller.valve_on:
            return DWELL if self.contact.force_kN == 0.0 and self.measured_force_kN == 0.0 else 0
        still = self.controller.still_samples()
        return still if still and self.actuator.rests_at(self.controller.command_mm) else 0

    # --- samples ------------------------------------------------------------------------------------

    def _move(self, count: int) -> None:
        """Advance sample by sample."""
        controller, actuator, contact, delay = self.controller, self.actuator, self.contact, self._delay
        spring, gap_mm = self.spring, self.settings.gap_mm
        cell_kN, position_mm = self._cell_force_kN, actuator.position_mm
        force_kN, miswired = self.measured_force_kN, self._miswired.acted_on is not None
        rows: list[tuple[float, ...]] = []
        for number in range(count):
            command_mm = controller.step(force_kN, position_mm)
            if controller.valve_on:
                position_mm = actuator.follow(command_mm, contact.force_kN)
            else:
                position_mm = actuator.leak(contact.force_kN)
            true_kN = contact.push(position_mm - gap_mm)
            cell_kN = force_kN = delay.push(true_kN)
            if miswired:
                force_kN = self._felt(number + 1, cell_kN, position_mm)
            rows.append(
                (
                    cell_kN,
                    contact.stroke_mm,
                    position_mm,
                    command_mm,
                    true_kN,
                    spring.temperature_C,
                    contact.work_J,
                    spring.heat_J,
                )
            )
        self._cell_force_kN, self.measured_force_kN = cell_kN, force_kN
        self._publish(np.array(rows))

    def _felt(self, periods: int, cell_kN: float, position_mm: float) -> float:
        """Return what the controller takes for the force, so many periods after the last slice."""
        wrong = self._miswired.acted_on
        if wrong is None:
            return cell_kN
        instead = {
            None: None,
            "position": position_mm,
            "command": self.controller.command_mm,
        }.get(self._miswired.force_reads, self.contact.stroke_mm)
        return wrong.feel((self.ring.periods + periods) * self.period_s, cell_kN, instead=instead)

    def _miss_cycle(self) -> None:
        """Let a period pass in which the controller does nothing: no sample, the command stays as it is."""
        controller, actuator, contact = self.controller, self.actuator, self.contact
        if controller.valve_on:
            position_mm = actuator.follow(controller.command_mm, contact.force_kN)
        else:
            position_mm = actuator.leak(contact.force_kN)
        self._cell_force_kN = self._delay.push(contact.push(position_mm - self.settings.gap_mm))
        self.measured_force_kN = self._felt(1, self._cell_force_kN, position_mm)
        self.ring.missed += 1
        self._gaps.append(self.ring.total)
        self._missed.draw()

    def _dwell(self, count: int) -> None:
        """Bridge samples in which neither command nor piston moves: only force and temperature relax."""
        contact, spring, controller = self.contact, self.spring, self.controller
        before = np.array(
            (
                self._cell_force_kN,
                contact.stroke_mm,
                self.actuator.position_mm,
                controller.command_mm,
                contact.force_kN,
                spring.temperature_C,
                contact.work_J,
                spring.heat_J,
            )
        )
        true_kN = contact.push(self.actuator.position_mm - self.settings.gap_mm, count)
        self._delay.settle(true_kN)
        controller.skip(count - 1)
        self._cell_force_kN = true_kN
        self.measured_force_kN = self._felt(count, true_kN, self.actuator.position_mm)
        controller.step(self.measured_force_kN, self.actuator.position_mm)
        after = np.array(
            (
                true_kN,
                contact.stroke_mm,
                self.actuator.position_mm,
                controller.command_mm,
                true_kN,
                spring.temperature_C,
                contact.work_J,
                spring.heat_J,
            )
        )
        share = np.arange(1, count + 1)[:, np.newaxis] / count
        self._publish(before + (after - before) * share)

    def _publish(self, table: NDArray[np.float64]) -> None:
        """Turn a slice of the truth, one of ``_move``'s rows a sample, into counts, frames and log."""
        count = table.shape[0]
        first = self.ring.total
        sequence = np.arange(first, first + count)
        time_us = self.time_us(sequence)
        columns, wires = self._columns, len(self._columns.strokes)
        samples = np.empty((count, 1 + len(columns.names)))
        samples[:, 0] = time_us % (1 << 32)
        felt = samples[:, 1:]
        made_s = np.asarray(self._periods_of(sequence) * self.period_s, dtype=np.float64)
        felt[:, 0] = table[:, 0]
        felt[:, 1 : 1 + wires] = self._wires.feel(table[:, 1])
        felt[:, 1 + wires : 3 + wires] = table[:, 2:4]
        self._drift.feel(made_s, felt[:, : 1 + wires])
        self._wander.add(made_s, felt[:, : 1 + wires])
        beside = [one.quantity for one in self.instruments if one.quantity != "force"]
        asked = columns.further or beside or self.acquisition
        quantities = self._quantities.at(made_s, table) if asked else {}
        if columns.further:
            felt[:, 3 + wires :] = columns.further_values(quantities)
        samples[:, 1:] = self._converters.counts(felt)
        self._miswired.samples(made_s, samples[:, 1:], self._converters)
        if self.faults.faults:
            self._break_transducers(samples[:, 1:])
        self.ring.append(samples)
        last = self._converters.values(samples[-1, 1:])
        self.measured_stroke_mm = mean_of(last[1 : 1 + wires].tolist())
        for instrument in self.instruments:
            is_force = instrument.quantity == "force"
            own = (
                self._quantities.contact_force(made_s, table) if is_force else quantities[instrument.quantity]
            )
            instrument.measure(made_s, own)
        for device in self.acquisition:
            force_kN = self._quantities.contact_force(made_s, table)
            device.measure(made_s, {**quantities, "force": force_kN})
        if self.truth is not None:
            truth = np.empty((count, 9))
            truth[:, 0] = sequence
            truth[:, 1] = time_us
            truth[:, 2] = table[:, 1]
            truth[:, 3:7] = table[:, 4:]
            truth[:, 7:] = table[:, 2:4]
            self.truth.add(truth)


def _wires_of(stand_file: StandFile) -> int:
    """Return how many sensors of the stroke the stand has."""
    return sum(channel.quantity == "stroke" for channel in stand_file.controller.channel)
