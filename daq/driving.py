"""Driving one motion: start it, keep acquisition going until it has ended, and obey guards and operator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from daq.acquisition import Acquisition
from daq.guards import Action, Trip
from daq.signals import StopLevel, StopRequest
from daq.steadiness import SteadinessWatch
from drivers.interfaces import ControllerStatus, EndReason
from foundation.errors import CommandRejected
from protocols.steps import (
    Harmonic,
    Hold,
    Motion,
    RampTo,
    RampToForce,
    Release,
    StaticCycles,
    Steadiness,
    WaitUntilCool,
)

GOOD_ENDS = (EndReason.REACHED, EndReason.FORCE_LIMIT)
"""How a motion ends that did what it should; static cycles turn at a force."""


class Halt(Exception):  # noqa: N818 - it names the fact
    """The campaign must stop: the trip that demands it."""

    def __init__(self, trip: Trip) -> None:
        super().__init__(trip.reason)
        self.trip = trip


@dataclass(frozen=True)
class Patience:
    """How long a motion may take: ``factor`` × what the plan expects + ``margin_s`` [s of device time]."""

    factor: float = 1.5
    margin_s: float = 10.0

    def limit_s(self, expected_s: float) -> float:
        """Return the longest time for a motion that should take ``expected_s``."""
        return self.factor * expected_s + self.margin_s


class Driver:
    """Performs motions one after the other on an acquisition.

    Parameters
    ----------
    acquisition : Acquisition
        Owns the controller and the guards' panel.
    request : StopRequest
        The operator's wish.
    tick : callable
        One pass of the acquisition with everything that is shown of it.
    patience : Patience
        How long a motion may take.
    """

    def __init__(
        self,
        acquisition: Acquisition,
        request: StopRequest,
        tick: Callable[[], object],
        patience: Patience | None = None,
    ) -> None:
        self._acquisition = acquisition
        self._request = request
        self._tick = tick
        self._patience = patience or Patience()
        self._cyclic = False
        self._last_cycle: int | None = None
        self._cycles_before = 0
        self.cycles_done = 0
        """Full cycles of all cyclic motions of the step so far."""

    def begin_step(self) -> None:
        """Forget the cycles of the step before."""
        self.cycles_done = self._cycles_before = 0

    def pump(self) -> None:
        """Make one pass, wait for the next, and see whether to stop.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        self._tick()
        status = self._acquisition.latest.status
        if self._cyclic and status is not None:
            self.cycles_done = self._cycles_before + status.cycles_done
        self.obey()
        self._acquisition.rest()

    def obey(self) -> None:
        """See whether to stop, after the cycle under way if that is enough.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        panel = self._acquisition.panel
        self._hear_operator()
        if panel.trip is None:
            return
        if panel.action is Action.STOP_AFTER_CYCLE and self._cyclic:
            if self._last_cycle is None:
                self._last_cycle = self.cycles_done
            if self.cycles_done == self._last_cycle:
                return
        raise Halt(panel.trip)

    def perform(self, motion: Motion, expected_s: float, steady: Steadiness | None = None) -> None:
        """Perform one motion to its end.

        Parameters
        ----------
        motion : Motion
            What to do.
        expected_s : float
            How long the plan expects it to take [s].
        steady : Steadiness, optional
            A harmonic motion ends when its cycles have settled by this.

        Raises
        ------
        Halt
            If a guard or the operator stops it, it ends otherwise than it should, or takes too long.
        DeviceFault
            If it cannot be started.
        """
        if isinstance(motion, Hold):
            self.wait(motion.wait_s)
            return
        if isinstance(motion, WaitUntilCool):
            self.cool(motion.temperature_C, motion.timeout_s)
            return
        if isinstance(motion, RampToForce):
            self._ramp_to_force(motion, expected_s)
            return
        self._last_cycle = None
        self._cycles_before = self.cycles_done
        sequence = self._start(motion)
        self._cyclic = isinstance(motion, Harmonic | StaticCycles)
        limit_s = self._patience.limit_s(expected_s)
        try:
            if steady is not None and isinstance(motion, Harmonic):
                self._until_settled(motion, sequence, limit_s, steady)
            else:
                self._until_done(motion, sequence, limit_s)
        finally:
            self._cyclic = False

    def _until_settled(self, motion: Harmonic, sequence: int, limit_s: float, steady: Steadiness) -> None:
        """Let a harmonic motion go on until its cycles have settled, or to its own end."""
        acquisition, watch = self._acquisition, SteadinessWatch(steady, motion)
        began_s = self._device_s()
        acquisition.listeners.append(watch.take)
        try:
            while not self._ended(motion, sequence):
                self.pump()
                if watch.settled(self.cycles_done - self._cycles_before):
                    acquisition.say(
                        "step",
                        f"settled after {self.cycles_done - self._cycles_before} cycles: damping "
                        f"{watch.damping[-1]:.4f}, stiffness {watch.stiffness[-1]:.4f} kN/mm",
                    )
                    self._cyclic = False  # the hold counts no cycles, and would begin at none
                    self._until_done(motion, acquisition.stand.controller.start_hold(), limit_s)
                    return
                if self._device_s() - began_s > limit_s:
                    self._refuse("controller", f"the {motion.name} has not ended after {limit_s:.0f} s")
            acquisition.say("step", f"not settled after {motion.cycles} cycles, the most that were planned")
            self.obey()
        finally:
            acquisition.listeners.remove(watch.take)
            watch.close()

    def _ramp_to_force(self, motion: RampToForce, expected_s: float) -> None:
        """Ramp towards the stroke limit and hold at the first sample that shows the force."""
        acquisition = self._acquisition
        limit_s, began_s = self._patience.limit_s(expected_s), self._device_s()
        sequence = self._start(RampTo(motion.stroke_limit_mm, motion.speed_mm_per_s))
        while not self._ended(motion, sequence):
            self.pump()
            if acquisition.latest.values.get("force", 0.0) >= motion.force_kN:
                hold = acquisition.stand.controller.start_hold()
                self._until_done(motion, hold, limit_s)
                return
            if self._device_s() - began_s > limit_s:
                self._refuse("controller", f"the {motion.name} has not ended after {limit_s:.0f} s")
        acquisition.say(
            "step",
            f"{motion.force_kN:g} kN were not reached at the stroke limit of {motion.stroke_limit_mm:g} mm",
        )
        self.obey()

    def wait(self, duration_s: float) -> None:
        """Stand still for a time of the device.

        Raises
        ------
        Halt
            As :meth:`pump`.
        """
        began_s = self._device_s()
        while self._device_s() - began_s < duration_s:
            self.pump()

    def cool(self, temperature_C: float | None, timeout_s: float) -> None:
        """Wait until every specimen sensor is at or below a temperature; warm ones do not trip meanwhile.

        Parameters
        ----------
        temperature_C : float or None
            The temperature [°C]; None means each sensor's resume threshold.
        timeout_s : float
            Longest wait [s of device time].

        Raises
        ------
        Halt
            As :meth:`pump`, and if it takes longer than ``timeout_s``.
        """
        panel = self._acquisition.panel
        guards = panel.guards
        panel.change(guards.cooling())
        began_s = self._device_s()
        try:
            while why := panel.warmer_than(temperature_C):
                self.pump()
                if (
                    self._request.level is StopLevel.AFTER_STEP
                ):  # nothing is under way that must come to its end
                    reason = f"stopped by the operator: {self._request.reason}"
                    self._refuse("operator", reason, device_fault=False)
                if self._device_s() - began_s > timeout_s:
                    self._refuse("cool-down", f"not cool after {timeout_s:g} s: {why}", device_fault=False)
        finally:
            panel.change(guards)

    def _start(self, motion: RampTo | Release | Harmonic | StaticCycles) -> int:
        controller = self._acquisition.stand.controller
        try:
            match motion:
                case RampTo():
                    return controller.start_ramp(
                        target_mm=motion.target_mm, speed_mm_per_s=motion.speed_mm_per_s
                    )
                case Release():
                    return controller.start_release(speed_mm_per_s=motion.speed_mm_per_s)
                case Harmonic():
                    return controller.start_harmonic(
                        mean_mm=motion.mean_mm,
                        amplitude_mm=motion.amplitude_mm,
                        frequency_Hz=motion.frequency_Hz,
                        cycles=motion.cycles,
                    )
                case StaticCycles():
                    return controller.start_static(
                        speed_mm_per_s=motion.speed_mm_per_s,
                        force_limit_kN=motion.force_limit_kN,
                        stroke_limit_mm=motion.stroke_limit_mm,
                        cycles=motion.cycles,
                        pause_s=motion.pause_s,
                    )
        except CommandRejected as rejected:
            self._refuse("controller", f"the controller refused a motion: {rejected}")
            raise

    def _until_done(self, motion: Motion, sequence: int, limit_s: float) -> None:
        began_s = self._device_s()
        while not self._ended(motion, sequence):
            self.pump()
            if self._device_s() - began_s > limit_s:
                self._refuse("controller", f"the {motion.name} has not ended after {limit_s:.0f} s")
        self.obey()

    def _ended(self, motion: Motion, sequence: int) -> bool:
        status: ControllerStatus | None = self._acquisition.latest.status
        if status is None or status.done_sequence != sequence:
            return False
        if status.end_reason not in GOOD_ENDS:
            how = status.end_reason.name.lower().replace("_", " ")
            self._refuse("controller", f"the {motion.name} was ended from outside ({how})")
        return True

    def _device_s(self) -> float:
        """Return the newest time stamp of the controller [s]: a slow simulation is no slow stand."""
        return self._acquisition.latest.device_s or 0.0

    def _refuse(self, guard: str, reason: str, *, device_fault: bool = True) -> None:
        at_s = self._acquisition.clock.now_s()
        self._acquisition.panel.latch(Trip(guard, Action.STOP, reason, at_s, device_fault=device_fault))
        self.obey()

    def _hear_operator(self) -> None:
        actions = {StopLevel.NOW: Action.STOP, StopLevel.AFTER_CYCLE: Action.STOP_AFTER_CYCLE}
        action = actions.get(self._request.level)
        if action is not None and self._acquisition.panel.action < action:
            reason = f"stopped by the operator: {self._request.reason}"
            self._acquisition.panel.latch(Trip("operator", action, reason, self._acquisition.clock.now_s()))
