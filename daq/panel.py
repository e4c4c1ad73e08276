"""The guard panel: all guards of a stand, what they remember, and the latch of the first trip."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from bufferstand.daq.clock_guard import (
    DeviceClockMemory,
    LagGuard,
    LagMemory,
    evaluate_device_clock,
    evaluate_lag,
)
from bufferstand.daq.controller_guard import (
    ControllerGuard,
    ControllerMemory,
    evaluate_controller_silence,
    evaluate_gap,
    evaluate_status,
    new_limit,
)
from bufferstand.daq.frozen_guard import FrozenGuard, FrozenMemory, evaluate_frozen
from bufferstand.daq.guards import (
    Action,
    AgreementGuard,
    AgreementMemory,
    ChannelGuard,
    ChannelMemory,
    Trip,
    evaluate_agreement,
    evaluate_channel,
)
from bufferstand.daq.missed_guard import MissedGuard, MissedMemory, evaluate_missed
from bufferstand.daq.rate_guard import (
    HeatingGuard,
    HeatingMemory,
    SpeedGuard,
    SpeedMemory,
    evaluate_heating,
    evaluate_speed,
)
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.silence_guard import SilenceGuard, SilenceMemory, evaluate_stream_silence
from bufferstand.daq.temperature_guard import (
    TemperatureGuard,
    TemperatureMemory,
    evaluate_fault,
    evaluate_reading,
    evaluate_silence,
)
from bufferstand.daq.wiring import Compared, WiringGuard, WiringWatch
from bufferstand.daq.wiring.tripped import Limited
from bufferstand.drivers.interfaces import ControllerStatus, SensorFault

CONTROLLER_STREAM = "controller"
"""Name of the controller's stream (spec of the run file)."""
FORCE_2_STREAM = "amplifier"
"""Name of the stream of the second way to the force."""


WIRES_AT_REST = ("stroke", "tilt")
"""Signals of the draw wires, which mean nothing before their zero is known."""


@dataclass(frozen=True)
class GuardSet:
    """Every guard of a stand, as data; it travels in the run file as the limits in force."""

    channels: tuple[ChannelGuard, ...]
    temperatures: tuple[TemperatureGuard, ...]
    controller: ControllerGuard
    agreement: AgreementGuard | None = None
    speeds: tuple[SpeedGuard, ...] = ()
    heating: tuple[HeatingGuard, ...] = ()
    silences: tuple[SilenceGuard, ...] = ()
    frozen: tuple[FrozenGuard, ...] = ()
    lag: LagGuard | None = None
    missed: MissedGuard | None = None
    disk_stop_s: float = 10.0
    wiring: WiringGuard | None = None

    def cooling(self) -> GuardSet:
        """Return the set for waiting at zero force: a warm specimen does not trip, a silent sensor does."""
        watched = tuple(replace(guard, stop_C=None) for guard in self.temperatures)
        return replace(self, temperatures=watched, heating=())

    def stopping_at(self, stop_C: float, resume_C: float) -> GuardSet:
        """Return the set with other thresholds for the sensors that touch the specimen [°C]."""
        own = tuple(
            guard if guard.stop_C is None else replace(guard, stop_C=stop_C, resume_C=resume_C)
            for guard in self.temperatures
        )
        return replace(self, temperatures=own)

    def valve_off(self) -> GuardSet:
        """Return the set for a stand that is not switched on: nothing follows a command."""
        kept = tuple(guard for guard in self.channels if guard.signal != "following_error")
        return replace(self, channels=kept, frozen=()).comparing("none")

    def comparing(self, motion: Compared) -> GuardSet:
        """Return the set in which so much of force, strokes and position is held against each other."""
        wiring = None if self.wiring is None else replace(self.wiring, motion=motion)
        return replace(self, wiring=wiring)

    def first_look(self) -> GuardSet:
        """Return the set for the look before anything moves.

        What the draw wires read then, where nobody has set their zero yet, is judged by its own limits
        (``[zero]``), which say what to do: a wire that is hooked in wrongly is no tilt.
        """
        own = self.valve_off()
        return replace(own, channels=tuple(one for one in own.channels if one.signal not in WIRES_AT_REST))

    def as_dict(self) -> dict[str, Any]:
        """Return the guards as data for the run file, actions by name."""
        content: dict[str, Any] = json.loads(json.dumps(asdict(self)))
        listed = (
            content[name] for name in ("channels", "temperatures", "speeds", "heating", "silences", "frozen")
        )
        single = [content[name] for name in ("agreement", "wiring") if content[name]]
        for guard in (*(one for guards in listed for one in guards), *single):
            for key in {"action", "silence_action"} & guard.keys():
                guard[key] = Action(guard[key]).name.lower()
        return content


@dataclass
class _Memories:
    channels: dict[str, ChannelMemory] = field(default_factory=dict)
    temperatures: dict[str, TemperatureMemory] = field(default_factory=dict)
    speeds: dict[str, SpeedMemory] = field(default_factory=dict)
    heating: dict[str, HeatingMemory] = field(default_factory=dict)
    silences: dict[str, SilenceMemory] = field(default_factory=dict)
    frozen: dict[str, FrozenMemory] = field(default_factory=dict)
    clock: DeviceClockMemory = field(default_factory=DeviceClockMemory)


class GuardPanel:
    """Hands every block, reading, fault and status to the guards; the first trip is latched.

    Parameters
    ----------
    guards : GuardSet
        The guards; :meth:`change` replaces them between steps.
    wall_s : float
        Time of the wall at which it begins to listen [s].
    """

    def __init__(self, guards: GuardSet, *, wall_s: float) -> None:
        self.guards = guards
        self._trip: Trip | None = None
        self._action = Action.NOTE
        self._said: list[Trip] = []
        self._tripped: set[str] = set()
        self._wall_s = wall_s
        self._memories = _Memories()
        self._controller = ControllerMemory(wall_s, wall_s)
        self._agreement = AgreementMemory()
        self._lag = LagMemory(wall_s)
        self._missed: MissedMemory = ()
        self.cut_off = False
        """Whether an outage is being ridden out, which has its own end: no silence of the controller then."""
        self._wiring = WiringWatch()
        self.explained_by = ""
        """What a device's fault that is seen now comes of: this program did not look meanwhile."""

    @property
    def trip(self) -> Trip | None:
        """Return the first trip that demands a stop; it stays until :meth:`reset`."""
        return self._trip

    @property
    def action(self) -> Action:
        """Return the strongest action demanded since the last reset."""
        return self._action

    def said(self) -> list[Trip]:
        """Return (and forget) every trip and note since the last call, in the order they came."""
        said, self._said = self._said, []
        return said

    def latch(self, trip: Trip) -> None:
        """Take a trip from a guard or from outside (operator, recorder, lost link).

        The first one that demands a stop is kept; later ones can only make the action stronger. The
        same guard is said once per latch.
        """
        if trip.action is Action.NOTE:
            self._said.append(trip)
            return
        if self.explained_by and trip.device_fault and self._trip is None:
            trip = replace(trip, reason=f"{self.explained_by}: {trip.reason}")
        if trip.action > self._action or trip.guard not in self._tripped:
            self._said.append(trip)
        self._tripped.add(trip.guard)
        self._action = max(self._action, trip.action)
        if self._trip is None:
            self._trip = trip

    def reset(self) -> None:
        """Forget the latch, not what was seen: a condition that lasts trips again at once."""
        self._trip, self._action = None, Action.NOTE
        self._tripped.clear()

    def change(self, guards: GuardSet) -> None:
        """Replace the guards (limits of another step); what was seen of the sensors is kept."""
        self.guards = guards

    def rebase(self, *, counted: bool = False) -> None:
        """Forget the values of the controller's channels seen so far: they count from another zero now.

        Parameters
        ----------
        counted : bool
            Whether that zero is first contact; else channels are as their calibrations say.
        """
        self._wiring.rebase(counted=counted)
        self._memories.speeds.clear()
        self._memories.frozen.clear()
        self._memories.channels.clear()
        self._agreement = AgreementMemory()

    def observe(self, block: ScaledBlock, wall_s: float) -> None:
        """Judge every sample of a block of any stream."""
        if block.stream == CONTROLLER_STREAM:
            self._observe_wiring(block)  # first: it says more of a wrong sign than the limit that it breaks
            self._observe_controller(block, wall_s)
        for guard in self.guards.temperatures:
            if guard.stream == block.stream:
                memory, trip = evaluate_reading(guard, self._heard(guard), block, wall_s)
                self._memories.temperatures[guard.stream] = memory
                self._take(trip)
        self._observe_heating(block)
        if block.stream != CONTROLLER_STREAM:
            self._observe_channels(block)
            self._observe_wiring(block)  # after its thermometer has said whether the reading is true
        for silence in self.guards.silences:
            if silence.stream == block.stream and len(block):
                self._memories.silences[silence.stream] = SilenceMemory(wall_s)
        if self.guards.agreement and block.stream in (CONTROLLER_STREAM, FORCE_2_STREAM):
            self._agreement, trip = evaluate_agreement(
                self.guards.agreement,
                self._agreement,
                block,
                device_clock=block.stream == CONTROLLER_STREAM,
            )
            self._take(trip)

    def _observe_controller(self, block: ScaledBlock, wall_s: float) -> None:
        if len(block):
            self._controller = replace(self._controller, sample_s=wall_s)
        self._take(evaluate_gap(self.guards.controller, block))
        if self.guards.missed is not None:
            self._missed, trip = evaluate_missed(self.guards.missed, self._missed, block)
            self._take(trip)
        self._observe_channels(block)
        for quick in self.guards.speeds:
            speed = self._memories.speeds.get(quick.name, SpeedMemory())
            self._memories.speeds[quick.name], trip = evaluate_speed(quick, speed, block)
            self._take(trip)
        for still in self.guards.frozen:
            stood = self._memories.frozen.get(still.signal, FrozenMemory())
            self._memories.frozen[still.signal], trip = evaluate_frozen(still, stood, block)
            self._take(trip)
        if self.guards.controller.own_clock:
            rate_Hz = self.guards.controller.rate_Hz
            self._memories.clock, trip = evaluate_device_clock(self._memories.clock, block, rate_Hz)
            self._take(trip)

    def _observe_channels(self, block: ScaledBlock) -> None:
        for guard in self.guards.channels:
            seen = self._memories.channels.get(guard.name, ChannelMemory())
            self._memories.channels[guard.name], trip = evaluate_channel(guard, seen, block)
            if trip is not None:
                self._latch_explained(trip)

    def _latch_explained(self, trip: Trip, limited: Limited | None = None) -> None:
        """Take a trip with what the wiring says of it; under whichever name, the same limit is said once."""
        self.latch(self._explained(trip, limited))
        if trip.action > Action.NOTE:
            self._tripped.add(trip.guard)

    def _explained(self, trip: Trip, limited: Limited | None) -> Trip:
        """Return a trip with what the wiring says of it: it may have come from a signal that is none."""
        wiring = self.guards.wiring
        if wiring is None or wiring.action is Action.NOTE or self._trip is not None:
            return trip
        own = [value for name, value in self.latest_temperatures().items() if name in wiring.specimen]
        return self._wiring.explained(wiring, trip, max(own, default=None), limited)

    def _observe_wiring(self, block: ScaledBlock) -> None:
        if self.guards.wiring is None:
            return
        for trip in self._wiring.observe(
            self.guards.wiring,
            block,
            self.latest_temperatures(),
            controller=block.stream == CONTROLLER_STREAM,
            device_clock=self.guards.controller.own_clock,
        ):
            self.latch(trip)

    def look_once_more(self, at_s: float) -> bool:
        """Ask the judges of the wiring what they have not looked at yet, as a motion has ended.

        Parameters
        ----------
        at_s : float
            Host stand time [s].

        Returns
        -------
        bool
            Whether one of them has begun to doubt, and will know from what comes next.
        """
        if self.guards.wiring is None:
            return False
        for trip in self._wiring.look_once_more(self.guards.wiring, self.latest_temperatures(), at_s):
            self.latch(trip)
        return self._wiring.begun

    def _observe_heating(self, block: ScaledBlock) -> None:
        for guard in self.guards.heating:
            if guard.stream == block.stream:
                memory = self._memories.heating.get(guard.stream, ())
                true_C = self.latest_temperatures().get(guard.stream)
                self._memories.heating[guard.stream], trip = evaluate_heating(guard, memory, block, true_C)
                self._take(trip)

    def complain(self, fault: SensorFault) -> None:
        """Take a reading that could not be had: it explains the silence, should it last."""
        for silence in self.guards.silences:
            if silence.stream == fault.stream:
                memory = self._memories.silences.get(fault.stream, SilenceMemory(self._wall_s))
                self._memories.silences[fault.stream] = replace(memory, complaint=fault.what)
        for guard in self.guards.temperatures:
            if guard.stream == fault.stream:
                self._memories.temperatures[guard.stream] = evaluate_fault(self._heard(guard), fault)

    def judge(self, status: ControllerStatus, at_s: float, wall_s: float) -> None:
        """Judge a snapshot of the controller."""
        limited = self.has_limited(status)
        self._controller, trip = evaluate_status(self._controller, status, at_s, wall_s)
        if trip is not None and limited is not None:
            self._latch_explained(trip, limited)
        else:
            self._take(trip)

    def has_limited(self, status: ControllerStatus) -> Limited | None:
        """Return what a limit of the device's own was of that has just ended a motion; None without one.

        The samples that led to it are to be observed before it is judged: they say whether it was the wiring.
        """
        return None if self._trip is not None else new_limit(self._controller, status)

    @property
    def old_fault(self) -> int | None:
        """Return the fault that the controller shows from before, and that switching on resets."""
        return self._controller.forgiven

    def switched_on(self) -> None:
        """Forgive nothing from now on: what the controller showed from before has been reset."""
        self._controller = replace(self._controller, forgiven=None)

    def expect_valve(self, on: bool | None) -> None:
        """Expect the controller's valve on or off from now on; None while this program switches it."""
        self._controller = replace(self._controller, valve_on=on, valve_differs=False)

    def came_back(self, wall_s: float) -> None:
        """Judge silence and lag again from now on [s of the wall]: an outage is over."""
        self.cut_off = False
        self._lag = LagMemory(wall_s)

    def begin_anew(self, wall_s: float) -> None:
        """Listen as at a start from now on [s of the wall]: nothing that was seen before is believed.

        What the controller shows is from before; where its valve is to be, and the zero, stay.
        """
        self._wall_s, self._memories = wall_s, _Memories()
        self._controller = ControllerMemory(wall_s, wall_s, valve_on=self._controller.valve_on)
        self._agreement, self._lag, self._missed = AgreementMemory(), LagMemory(wall_s), ()
        self._wiring.begin_anew()
        self.cut_off = False

    def listen(self, at_s: float, wall_s: float) -> None:
        """Judge every silence; called in each pass, after all that came in was observed."""
        for silence in self.guards.silences:
            heard = self._memories.silences.get(silence.stream, SilenceMemory(self._wall_s))
            self._memories.silences[silence.stream], trip = evaluate_stream_silence(
                silence, heard, at_s, wall_s
            )
            self._take(trip)
        for guard in self.guards.temperatures:
            memory, trip = evaluate_silence(guard, self._heard(guard), at_s, wall_s)
            self._memories.temperatures[guard.stream] = memory
            self._take(trip)
        if not self.cut_off:
            self._take(evaluate_controller_silence(self.guards.controller, self._controller, at_s, wall_s))

    def keep_up(self, *, age_s: float | None, up_to_date: bool, at_s: float, wall_s: float) -> None:
        """Judge whether the reader keeps up with the stand; called with each look at the status.

        Parameters
        ----------
        age_s : float or None
            Age of the newest sample by the device's own clock [s of the wall]; None where it shows none.
        up_to_date : bool
            Whether all that the device had sampled was read.
        at_s, wall_s : float
            Present stand time and time of the wall [s].
        """
        if self.guards.lag is not None:
            self._lag, trip = evaluate_lag(
                self.guards.lag, self._lag, age_s=age_s, up_to_date=up_to_date, at_s=at_s, wall_s=wall_s
            )
            self._take(trip)

    def latest_temperatures(self) -> Mapping[str, float]:
        """Return the last true reading of every sensor that gave one [°C]."""
        return {
            stream: memory.value_C
            for stream, memory in self._memories.temperatures.items()
            if memory.value_C is not None
        }

    def warmer_than(self, limit_C: float | None = None) -> str:
        """Return which specimen sensor is not at or below a temperature (or silent), empty if none.

        Parameters
        ----------
        limit_C : float, optional
            The temperature [°C]; without it each sensor's own resume threshold counts.
        """
        for guard in self.guards.temperatures:
            if guard.resume_C is None:
                continue
            wanted_C = guard.resume_C if limit_C is None else limit_C
            value_C = self._heard(guard).value_C
            if value_C is None:
                return f"{guard.label} has given no reading yet"
            if value_C > wanted_C:
                return (
                    f"{guard.label} is at {value_C:.2f} °C, to go on it must be at or below {wanted_C:g} °C"
                )
        return ""

    def specimen_temperatures(self) -> Mapping[str, float | None]:
        """Return the last true reading of every sensor that touches the specimen [°C], by its label."""
        return {
            guard.label: self._heard(guard).value_C
            for guard in self.guards.temperatures
            if guard.resume_C is not None
        }

    def _heard(self, guard: TemperatureGuard) -> TemperatureMemory:
        return self._memories.temperatures.get(guard.stream) or TemperatureMemory(self._wall_s)

    def _take(self, trip: Trip | None) -> None:
        if trip is not None:
            self.latch(trip)
