"""One session on a stand: from the first look at every device to the safe stop, recorded steps between."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

from daq.acquisition import Acquisition, Pace, Recorder
from daq.agenda import Agenda
from daq.before_start import disk_trouble, first_look, specimen_gaps, zero_trouble
from daq.driving import Driver, Halt, Patience
from daq.guards import Action, Trip, run_status
from daq.heat_log import LATE_S, HeatLog, Seen
from daq.limits import guards_for
from daq.metadata import CampaignFacts, run_document
from daq.notes import add_note
from daq.panel import GuardPanel, GuardSet
from daq.progress import ProgressSink, Watcher
from daq.safe_stop import SafeStop, SafeStopReport, SafeStopSettings
from daq.showing import Showing, phase_of
from daq.signals import StopRequest
from daq.validity import expired_calibrations
from drivers.interfaces import Identity, Stand
from foundation.clock import Clock
from foundation.errors import BadInput, DeviceFault
from protocols.guard_table import GuardTable
from protocols.plan import Plan
from protocols.steps import Motion, PlannedStep

RecorderMaker = Callable[[Path, str, Mapping[str, Any]], Recorder]
"""Makes the recorder of a run in a folder, under an id, with its metadata document."""

AFTER_STOP_S = 1.0
"""So long a run goes on after its safe stop [s of stand time]."""
CATCH_UP_S = 20.0
"""So long at most the reader may take to come to the end of the ring between two steps [s of the wall]."""


@dataclass(frozen=True)
class RunSettings:
    """How a campaign is run, apart from what it does.

    Parameters
    ----------
    guards : GuardTable or None
        How the guards judge the stand itself; ``[guards]`` of the campaign if not given.
    pace : Pace
        Of the acquisition.
    patience : Patience
        How long a motion may take.
    cool_limit_s : float
        So long at most a specimen may take to cool to the resume threshold after a temperature stop [s].
    """

    guards: GuardTable | None = None
    pace: Pace = field(default_factory=Pace)
    patience: Patience = field(default_factory=Patience)
    cool_limit_s: float = 4.0 * 3600.0


class Session:
    """Everything that is alive while a campaign runs.

    Parameters
    ----------
    plan : Plan
        Its limits, and what is shown of it.
    agenda : Agenda
        What is left of it.
    stand, clock
        The stand and its time.
    facts : CampaignFacts
        For the runs' metadata.
    progress : ProgressSink
        Who shows it.
    request : StopRequest
        The operator's wish.
    settings : RunSettings
        Guards, pace, patience.
    recorder : callable
        Makes the recorder of a run.
    notes : Path
        The campaign's folder, where the operator's notes go.
    watcher : Watcher, optional
        Who sees every block and every pass (the live monitor).
    """

    def __init__(
        self,
        plan: Plan,
        agenda: Agenda,
        stand: Stand,
        clock: Clock,
        facts: CampaignFacts,
        progress: ProgressSink,
        request: StopRequest,
        settings: RunSettings,
        recorder: RecorderMaker,
        notes: Path,
        watcher: Watcher | None = None,
    ) -> None:
        self._plan = plan
        self._stand = stand
        self._clock = clock
        self._facts = facts
        self._showing = Showing(plan, agenda, clock, progress)
        self._request = request
        self._settings = settings
        self._make_recorder = recorder
        self._notes = notes
        self._watcher = watcher
        self._run_id = ""
        self._table = settings.guards or plan.campaign.content.guards
        self._alive: _Alive | None = None
        self.seen: Seen | None = None
        """What the last step, or wait for cooling, did to the specimen."""

    @property
    def cycles_done(self) -> int:
        """Full cycles of the last attempt at a step."""
        return self._alive.driver.cycles_done if self._alive else 0

    def trip_of(self, guard: str, reason: str, *, device_fault: bool = True) -> Trip:
        """Return a trip that comes from no sample."""
        return Trip(guard, Action.STOP, reason, self._clock.now_s(), device_fault=device_fault)

    def say_aloud(self, text: str) -> None:
        """Show a line that must not be missed."""
        self._showing.message(text)

    # --- before and after --------------------------------------------------------------------------

    def open(self, steps: Sequence[PlannedStep], *, must_be_cool: bool) -> None:
        """Connect, look at every device, and switch on; nothing has moved when it returns.

        Parameters
        ----------
        steps : sequence of PlannedStep
            What is to be done: the disk must have room for it.
        must_be_cool : bool
            The campaign was stopped by the temperature before: now the resume threshold counts.

        Raises
        ------
        Halt
            If a guard has tripped already, or the specimen is still too warm: the campaign does not begin.
        DeviceFault
            If a device does not answer.
        """
        identity = self._stand.controller.connect()
        self._stand.controller.skip_backlog()  # guards judge the present, not what led to an earlier stop
        for sensor in self._stand.sensors:
            sensor.start()
        guards = guards_for(
            self._plan.campaign.limits,
            self._plan.limits,
            self._stand,
            ambient=self._facts.ambient(),
            table=self._table,
            stand_tilt_mm=(self._facts.stand.get("stand") or {}).get("tilt_max_mm"),
        )
        panel = GuardPanel(guards.valve_off(), wall_s=self._clock.wall_s())
        acquisition = Acquisition(self._stand, self._clock, panel, pace=self._settings.pace)
        if self._watcher is not None:
            acquisition.observers.append(self._watcher.take)
        acquisition.feeding = False  # the actuator may be another's: a feed would hide that one's death
        driver = Driver(acquisition, self._request, self._tick, self._settings.patience)
        safe_stop = SafeStop(
            self._stand.controller,
            self._clock,
            SafeStopSettings(
                self._plan.campaign.content.motion.release_speed_mm_per_s, self._facts.watchdog_s
            ),
            pump=self._tick,
        )
        self._alive = _Alive(identity, guards, panel, acquisition, driver, safe_stop)
        self._demand_ready(acquisition, driver, steps)
        if must_be_cool and (why := panel.warmer_than()):
            stream = why.partition(" ")[0]
            raise Halt(self.trip_of(stream, f"still too warm to go on: {why}", device_fault=False))
        self._switch_on()

    def _demand_ready(self, acquisition: Acquisition, driver: Driver, steps: Sequence[PlannedStep]) -> None:
        """Look at everything that can be looked at while nothing moves; say it, or refuse."""
        for text in (*self._expired(), specimen_gaps(self._plan.specimen)):
            if text:
                self._showing.message(f"WARNING: {text}")
        if why := disk_trouble(self._notes, steps):
            raise Halt(self.trip_of("disk", why))
        why, refused = zero_trouble(first_look(acquisition, driver.pump), self._table.zero_force_max_kN)
        if refused:
            raise Halt(self.trip_of("zero", why, device_fault=False))
        if why:
            self._showing.message(f"WARNING: {why}")

    def _switch_on(self) -> None:
        alive = self._need()
        alive.safe_stop.arm()
        alive.acquisition.feeding = True
        alive.panel.change(alive.guards)
        self._stand.controller.enable(
            force_limit_kN=self._plan.limits.force.value,
            stroke_limit_mm=self._plan.limits.stroke.value,
            watchdog_ms=round(self._facts.watchdog_s * 1000.0),
        )

    def end(self) -> SafeStopReport | None:
        """Stop safely (once); None if the controller never answered."""
        if self._alive is None:
            return None
        return self._stop(self._alive.panel.action is Action.EMERGENCY)

    def show_end(self, status: str, reason: str) -> None:
        """Show how the campaign ended."""
        self._showing.phase = "done"
        report = self._alive.safe_stop.report if self._alive else None
        self._showing.message(f"campaign {status}" + (f": {reason}" if reason else ""))
        if report is not None:
            self._showing.message(report.line)
        if self._alive is not None:
            self._showing.now(self._alive.acquisition, self._alive.driver)

    # --- steps -------------------------------------------------------------------------------------

    def perform(self, step: PlannedStep, motions: Sequence[Motion], where: tuple[Path, str] | None) -> None:
        """Perform (the rest of) a step and record it as a run.

        Parameters
        ----------
        step : PlannedStep
            The step.
        motions : sequence of Motion
            Its motions, or those that are left.
        where : tuple of Path and str, or None
            Folder and id of the run; None for a step that is not recorded.

        Raises
        ------
        Halt
            If it was stopped; the stand is at zero force with the valve off then, and the run is closed.
        """
        alive = self._need()
        alive.driver.begin_step()
        self._showing.begin_step(step)
        with self._watched():
            self._perform(step, motions, where)
        if unsealed := self._close_run("complete", ""):
            raise Halt(unsealed)

    def _perform(self, step: PlannedStep, motions: Sequence[Motion], where: tuple[Path, str] | None) -> None:
        alive = self._need()
        try:
            self._catch_up()  # what was sampled before belongs to no run, or to the one before
            alive.driver.obey()
            if where is not None:
                alive.acquisition.attach(self._recorder(*where, step))
                self._run_id = where[1]
            alive.acquisition.say("step", f"step {step.index} begins: {step.name}")
            for text in self._expired():
                alive.acquisition.say("calibration", text)
            self._motions(step, motions)
            self._catch_up()  # what was sampled until the last motion's end
            alive.driver.obey()
        except BaseException as error:
            halt = error if isinstance(error, Halt) else self._halt_of(error)
            try:
                self._stop(halt.trip.action is Action.EMERGENCY)
            finally:
                self._close_run(run_status(halt.trip), halt.trip.reason)
            if isinstance(error, DeviceFault):
                raise halt from error
            raise

    def _recorder(self, folder: Path, run_id: str, step: PlannedStep) -> Recorder:
        """Return a run's recorder; where there is no room for one, nothing may move."""
        try:
            return self._make_recorder(folder, run_id, self._document(run_id, step))
        except (BadInput, OSError) as error:
            raise Halt(self.trip_of("recorder", f"the run cannot be recorded: {error}")) from None

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Keep what a step, or a wait, does to the specimen while inside."""
        acquisition = self._need().acquisition
        log = HeatLog(acquisition.panel, self._facts.ambient(), self._clock.now_s())
        self.seen = None
        acquisition.listeners.append(log.take)
        try:
            yield
        finally:
            acquisition.listeners.remove(log.take)
            self.seen = log.seen(self._clock.now_s())

    def temperatures(self) -> Seen:
        """Return what the sensors show now; their first readings are waited for a moment.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        alive = self._need()
        with self._watched():
            until_s = self._clock.now_s() + LATE_S
            sensors = {guard.stream for guard in alive.guards.temperatures}
            while sensors - alive.panel.latest_temperatures().keys() and self._clock.now_s() < until_s:
                alive.driver.pump()
        return self.seen or Seen(0.0, None, None, None, 0.0)

    def meanwhile(self, work: Callable[[], object]) -> BaseException | None:
        """Do something lengthy in a thread while the loop goes on; return what it raised."""
        with ThreadPoolExecutor(1) as pool:
            doing = pool.submit(work)
            while not doing.done():
                self._tick_safely()
                wait_for([doing], timeout=0.02)
        return doing.exception()

    def _expired(self) -> list[str]:
        """Return what is to be said about calibrations that have expired by today."""
        return expired_calibrations(self._stand, date.today())  # noqa: DTZ011 - the lab's day

    def _halt_of(self, error: BaseException) -> Halt:
        if isinstance(error, DeviceFault):
            return Halt(self.trip_of("controller", f"the controller or its wire failed: {error}"))
        if isinstance(error, KeyboardInterrupt):
            return Halt(self.trip_of("operator", "Ctrl-C (SIGINT)", device_fault=False))
        return Halt(self.trip_of("internal", f"internal error: {error!r}"))

    def _motions(self, step: PlannedStep, motions: Sequence[Motion]) -> None:
        alive = self._need()
        for motion, estimate in zip(motions, step.estimates, strict=True):
            self._showing.phase = phase_of(motion)
            alive.driver.perform(motion, estimate.duration_s, step.steady)

    def _document(self, run_id: str, step: PlannedStep) -> dict[str, Any]:
        alive = self._need()
        return run_document(run_id, step, self._plan, self._stand, alive.identity, alive.guards, self._facts)

    def _close_run(self, status: str, reason: str) -> Trip | None:
        """Seal in a thread, because the watchdog wants to be fed meanwhile; return why it failed, if so."""
        alive = self._need()
        if alive.acquisition.recorder is not None and status != "failed":
            if status != "complete":
                self._watch_rest()
            self._catch_up(stopped=True)  # what led to the stop belongs into the run
        recorder, self._run_id = alive.acquisition.detach(), ""
        if recorder is None:
            return None
        sealed: list[Path] = []
        if failure := self.meanwhile(lambda: sealed.append(recorder.close(status, reason))):
            self._showing.message(f"the run could not be sealed: {failure}")
            return self.trip_of("recorder", f"the run could not be sealed: {failure}")
        self._showing.message(f"  {status}: {sealed[0].name}" + (f" ({reason})" if reason else ""))
        return None

    # --- safe stop and cooling ---------------------------------------------------------------------

    def _stop(self, emergency: bool) -> SafeStopReport:
        alive = self._need()
        first = alive.safe_stop.report is None
        self._showing.phase = "safe stop"
        alive.panel.change(alive.guards.valve_off())
        report = alive.safe_stop.run(emergency=emergency)
        if first:
            alive.acquisition.say("safe stop", report.line, safe=report.safe, by=report.by)
        return report

    def cool_down(self) -> None:
        """After a temperature stop: wait with the valve off until every sensor is at its resume threshold.

        Raises
        ------
        Halt
            If a sensor falls silent, the operator asks, or it takes longer than ``cool_limit_s``.
        DeviceFault
            If the actuator cannot be switched on again.
        """
        alive = self._need()
        self._showing.phase = "cool-down"
        self._showing.message(f"waiting at zero force, valve off: {alive.panel.warmer_than()}")
        alive.panel.change(alive.guards.valve_off().cooling())
        alive.panel.reset()
        with self._watched():
            alive.driver.cool(None, self._settings.cool_limit_s)
        self._showing.message("cool enough: going on")
        self._switch_on()

    # --- passes of the loop ------------------------------------------------------------------------

    def _tick(self) -> None:
        alive = self._need()
        for trip in alive.acquisition.tick():
            self._showing.trip(trip)
        for text in alive.acquisition.unrecorded():
            self._showing.message(f"note: {text}")
        self.take_notes()
        self._showing.offer(alive.acquisition, alive.driver)
        if self._watcher is not None:
            self._watcher.look(alive.acquisition)

    def take_notes(self) -> None:
        """Put what the operator asked for and wrote into the run, notes into the campaign's folder, too."""
        for wish in self._request.take_wishes():
            self._showing.message(f"operator: {wish}")
            if self._alive is not None:
                self._alive.acquisition.say("operator", wish)
        for text in self._request.take_notes():
            self._showing.message(f"operator: {text}")
            if self._alive is not None:
                self._alive.acquisition.say("operator", text)
            try:
                add_note(self._notes, text, step=self._showing.step_index, run=self._run_id)
            except OSError as error:
                self._showing.message(f"the note could not be written: {error.strerror}")

    def _watch_rest(self) -> None:
        """Keep recording for a moment after a safe stop: the run is to show that the force is gone."""
        acquisition = self._need().acquisition
        until_s = self._clock.now_s() + AFTER_STOP_S
        while self._clock.now_s() < until_s:
            trip = acquisition.panel.trip
            if trip is not None and trip.device_fault:
                return
            self._tick()
            acquisition.rest()

    def _catch_up(self, *, stopped: bool = False) -> None:
        """Make passes until the ring is drained: on a busy machine the reader can be behind the stand.

        A trip ends it at once, unless the stand is ``stopped`` already and the wire is whole.
        """
        acquisition = self._need().acquisition
        until_s = self._clock.wall_s() + CATCH_UP_S
        self._tick()
        while not acquisition.drained and self._clock.wall_s() < until_s:
            trip = acquisition.panel.trip
            if trip is not None and (trip.device_fault or not stopped):
                return
            self._tick()

    def _tick_safely(self) -> None:
        try:
            self._tick()
        except Exception as error:  # noqa: BLE001 - sealing must come to its end; the next pass says it again
            self._showing.warn(repr(error))

    def _need(self) -> _Alive:
        if self._alive is None:
            raise RuntimeError("the session is not open")
        return self._alive


@dataclass(frozen=True)
class _Alive:
    """What exists once the controller has said who it is."""

    identity: Identity
    guards: GuardSet
    panel: GuardPanel
    acquisition: Acquisition
    driver: Driver
    safe_stop: SafeStop
