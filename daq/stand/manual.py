"""A stand under a person's hand: slow guarded motions, and the same safe stop on every way out.

What is different from a campaign: a low force trips, the piston is slow, and it moves only while somebody
says so (a dead-man: a key that is held, or a command that is short).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from bufferstand.daq.acquisition import NOT_CAUGHT_UP, Acquisition, catch_up
from bufferstand.daq.guards import Action, GuardPanel, GuardSet, Trip, guards_for
from bufferstand.daq.guards.kinds import DEVICE_LIMIT_FAULTS, fault_text
from bufferstand.daq.motions import (
    Halt,
    MotionRunner,
    SafeStop,
    SafeStopReport,
    SafeStopSettings,
    SampleObserver,
)
from bufferstand.daq.operator import StopRequest
from bufferstand.daq.stand.in_use import give_back, use_trouble
from bufferstand.daq.stand.start_checks import first_look
from bufferstand.daq.zero import BEYOND_MM
from bufferstand.drivers import EndReason, Stand
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import Clock, DeviceFault, RampTo, StandStill
from bufferstand.foundation.specimen import Specimen
from bufferstand.protocols import StandLimits, TestLimits, envelope
from bufferstand.protocols.campaign_file import GuardActions, GuardTable

SPEED_MAX_MM_PER_S = 5.0
"""Nothing moves faster by hand."""
SPEED_TRIP_MM_PER_S = 25.0
"""The speed guard of the draw wires trips here: noise of a wire over 20 ms must not."""
FORCE_MAX_KN = 20.0
"""Greatest force by hand where nothing else is asked: more than a preload, far less than a test."""
RELEASE_SPEED_MM_PER_S = 5.0
WATCHDOG_S = 1.0
"""The controller's watchdog by hand, several times what a feed takes: a command that is killed while a key is
held leaves the piston moving for so long [s]."""
DEVICE_LIMIT_FACTOR, DEVICE_LIMIT_OVER_KN = 1.1, 2.0
"""The controller's own limit lies so much over that of the guard, which is to stop first: from 20.6
to 24 kN it takes 0.17 s at 5 mm/s into 4 kN/mm, several times what a guard takes."""


@dataclass(frozen=True)
class ManualLimits:
    """What a motion by hand may use.

    Parameters
    ----------
    force_kN : float
        The guard trips 3 % over it; the controller's own limit lies above that.
    stroke_mm : float
        The controller's own limit of the piston's position, once it has come within it.
    """

    force_kN: float
    stroke_mm: float

    def device_force_kN(self, most_kN: float) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the controller's own limit of the force [kN], on a stand that can take ``most_kN``."""
        return min(DEVICE_LIMIT_FACTOR * self.force_kN + DEVICE_LIMIT_OVER_KN, most_kN)


def watchdog_s(stand_file: StandFile) -> float:
    """Return the controller's watchdog by hand [s]: the shortest that slow replies allow, 1 s at least.

    Parameters
    ----------
    stand_file : StandFile
        Its own watchdog is not exceeded; twice ``timeout_s`` is the least.
    """
    controller = stand_file.controller
    return min(controller.watchdog_s, max(WATCHDOG_S, 2.0 * controller.timeout_s))


class ManualStand:
    """An open stand that moves by hand; made by :func:`by_hand`.

    Parameters
    ----------
    stand : Stand
    stand_file : StandFile
    clock : Clock
    limits : ManualLimits
    request : StopRequest
        The operator's wish (Ctrl-C).
    say : callable
        Shows a line.
    """

    def __init__(
        self,
        stand: Stand,
        stand_file: StandFile,
        clock: Clock,
        limits: ManualLimits,
        request: StopRequest,
        say: Callable[[str], object],
    ) -> None:
        self._stand, self._file, self._clock = stand, stand_file, clock
        self._limits = limits
        self._say = say
        self._guards = _guards(stand, stand_file, limits)
        panel = GuardPanel(self._guards.valve_off(), wall_s=clock.wall_s())
        self.acquisition = Acquisition(stand, clock, panel)
        self.acquisition.feeding = False  # the actuator may be another's
        self.driver = MotionRunner(self.acquisition, request, self.tick)
        self._safe_stop = SafeStop(
            stand.controller,
            clock,
            SafeStopSettings(RELEASE_SPEED_MM_PER_S, watchdog_s(stand_file), stays_where_unloaded=True),
            pump=self.tick,
            eyes=SampleObserver(self.acquisition, stand_file.limits.force_max_kN),
            emergency=lambda: panel.action is Action.EMERGENCY,
        )
        self.rest: dict[str, float] = {}
        """Means at rest, before anything moved."""

    def look(self) -> None:
        """Look at the stand with the valve as it is.

        Raises
        ------
        Halt
            If a guard trips.
        """
        self._stand.controller.skip_backlog()
        self.rest = first_look(self.acquisition, self.driver.pump)

    def switch_on(self) -> None:
        """Switch the actuator on, with low limits of its own; a fault from before is reset, and said.

        Raises
        ------
        DeviceFault
            If it does not come on, a fault stays, or another program gives commands.
        """
        old_fault = self.acquisition.panel.old_fault
        self._safe_stop.arm()
        self.acquisition.feeding = True
        self.acquisition.panel.change(self._guards)
        self.set_limits()
        self.acquisition.panel.switched_on()
        if old_fault is not None:
            self._say(f"{fault_text(old_fault)} of the controller was reset")

    def set_limits(self) -> None:
        """Give the controller its limits and switch on; a piston that stands farther out may come back.

        Raises
        ------
        DeviceFault
            As :meth:`switch_on`.
        """
        stands_mm = self.acquisition.latest.values.get("position", 0.0)
        far_mm = stands_mm + BEYOND_MM if stands_mm > self._limits.stroke_mm else self._limits.stroke_mm
        self._stand.controller.enable(
            force_limit_kN=self._limits.device_force_kN(self._file.limits.force_max_kN),
            stroke_limit_mm=min(far_mm, self._file.limits.stroke_max_mm),
            watchdog_ms=round(watchdog_s(self._file) * 1000.0),
        )

    def tick(self) -> None:
        """Make one pass, and say what guards say."""
        for trip in self.acquisition.tick():
            self._say(f"{'note' if trip.action is Action.NOTE else 'STOP'}: {trip.reason}")

    def catch_up(self) -> None:
        """Make passes until every sample that was taken is read, or a guard has tripped.

        Raises
        ------
        DeviceFault
            If the controller gives no newer sample.
        """
        if not catch_up(self.acquisition, self.tick, lambda: self.acquisition.panel.trip is not None):
            raise DeviceFault(NOT_CAUGHT_UP)

    def jog(
        self,
        target_mm: float,
        speed_mm_per_s: float,
        held: Callable[[], bool],
        watch: Callable[[], object] = lambda: None,
    ) -> bool:
        """Move to a position of the piston while ``held``; hold where it is not.

        Parameters
        ----------
        target_mm : float
            On the controller's own scale.
        speed_mm_per_s : float
        held : callable
            Whether it may move at this moment: asked in every pass.
        watch : callable
            Called in every pass, e.g. to show where it is.

        Returns
        -------
        bool
            Whether the target was reached; False where it was let go.

        Raises
        ------
        Halt
            If a guard or the operator stops it.
        """
        controller = self._stand.controller
        sequence = controller.start(RampTo(target_mm, speed_mm_per_s))
        self.acquisition.renew_status()
        while True:
            self.driver.pump()
            watch()
            status = self.acquisition.latest.status
            if status is not None and status.done_sequence == sequence:
                if status.end_reason is not EndReason.REACHED:
                    reason = f"the motion was ended from outside ({status.end_reason.name.lower()})"
                    raise Halt(
                        Trip("controller", Action.STOP, reason, self._clock.now_s(), device_fault=True)
                    )
                return True
            if not held():
                self.hold()
                return False

    def hold(self) -> None:
        """Stop where it stands, and wait until it does.

        Raises
        ------
        Halt
            If a guard or the operator stops it.
        """
        sequence = self._stand.controller.start(StandStill())
        self.acquisition.renew_status()
        until_s = self._clock.now_s() + 2.0
        while self._clock.now_s() < until_s:
            self.driver.pump()
            status = self.acquisition.latest.status
            if status is not None and status.done_sequence == sequence:
                return

    def end(self) -> SafeStopReport:
        """Stop safely (once): unload, valve off; where no force is left the piston stays."""
        self.acquisition.panel.change(self._guards.valve_off())
        return self._safe_stop.run(
            emergency=self.acquisition.panel.action is Action.EMERGENCY, seen=self.acquisition.latest.status
        )

    def reset_own_limit(self) -> bool:
        """Reset the fault by which the device's own limit ended a motion; call it after a safe :meth:`end`.

        Returns
        -------
        bool
            Whether there was one: a limit that this command had set is an ordinary end.

        Raises
        ------
        DeviceFault
            If the wire fails, force has come back, or the fault stays.
        """
        controller = self._stand.controller
        code = controller.status().fault_code
        if code not in DEVICE_LIMIT_FAULTS:
            return False
        controller.reset_fault()
        self._say(f"{fault_text(code)} of the controller was reset: the specimen is unloaded, the valve off")
        return True


@contextmanager
def by_hand(
    stand: Stand,
    stand_file: StandFile,
    clock: Clock,
    limits: ManualLimits,
    request: StopRequest,
    say: Callable[[str], object],
) -> Iterator[ManualStand]:
    """Connect, look, switch on; whatever happens inside, stop safely at the end and say it.

    A motion that the device's own limit has ended, though the guard lies below it, leaves no fault behind.
    A stop whose safe state was not seen is a device's fault, whatever had demanded it.

    Raises
    ------
    Halt
        If a guard or the operator stops it; if the stand is in use, and then nothing was written to it.
    DeviceFault
        If a device does not answer, or the stop was not seen to be safe.
    """
    stand.controller.connect()
    if why := use_trouble(stand.controller, clock, GuardTable().zero_force_max_kN):
        why = f"{why}; the stand was not touched"
        raise Halt(Trip("controller", Action.STOP, why, clock.now_s(), device_fault=True))
    for sensor in stand.sensors:
        sensor.start()
    hand = ManualStand(stand, stand_file, clock, limits, request, say)
    halt: Halt | None = None
    try:
        hand.look()
        hand.switch_on()
        yield hand
    except Halt as stopped:
        halt = stopped
    finally:
        report = hand.end()
        give_back(stand.controller, report)
        say(report.line)
    late = hand.acquisition.panel.trip
    if halt is None and late is not None and late.device_fault:  # seen as it was released
        halt = Halt(late)
    if not report.safe:
        raise DeviceFault(report.line if halt is None else f"{halt.trip.reason}; {report.line}")
    if hand.reset_own_limit() and halt is not None:
        halt = Halt(replace(halt.trip, device_fault=False))
    if halt is not None:
        raise halt


def _guards(stand: Stand, stand_file: StandFile, limits: ManualLimits) -> GuardSet:
    """Return the guards of motions by hand: thermometers are watched, and stop nothing."""
    of_stand = StandLimits(
        force_max_kN=stand_file.limits.force_max_kN,
        stroke_max_mm=stand_file.limits.stroke_max_mm,
        frequency_max_Hz=stand_file.limits.frequency_max_Hz,
        speed_max_mm_per_s=stand_file.limits.speed_max_mm_per_s,
    )
    test = TestLimits(force_max_kN=limits.force_kN)
    thermometers = [
        sensor.facts.name for sensor in stand.sensors if sensor.facts.channels[0].quantity == "temperature"
    ]
    return guards_for(
        test,
        envelope(of_stand, test, Specimen(id="by hand")),
        stand,
        ambient=thermometers,
        # Wires that nobody has set to zero yet may read anything; a wire on the specimen may stand still.
        table=GuardTable(
            speed_trip_mm_per_s=SPEED_TRIP_MM_PER_S,
            stroke_below_mm=stand_file.limits.stroke_max_mm,
            action=GuardActions(frozen="note"),
        ),
        stand_tilt_mm=stand_file.stand.tilt_max_mm,
    )
