"""One session on a stand: from the first look at every device to the safe stop, recorded steps between."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from bufferstand.daq.acquisition import BlockRecorder, PolledPeriods
from bufferstand.daq.campaign.agenda import Agenda
from bufferstand.daq.campaign.connected_stand import ConnectedStand
from bufferstand.daq.campaign.display import CampaignDisplay, phase_of
from bufferstand.daq.campaign.loop_passes import LoopPasses
from bufferstand.daq.campaign.opening import Opening, expired_today, guards_of, trip_at
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign.start_temperature import begins_with_a_wait, say_beginning, too_cold
from bufferstand.daq.campaign.stroke_settings import SessionMessages, terms_for
from bufferstand.daq.campaign_folder import CampaignMetadata, StandOrigin, run_document
from bufferstand.daq.guards import Action, Trip, run_status
from bufferstand.daq.guards.kinds import TemperatureGuard
from bufferstand.daq.motions import Halt, SafeStopReport
from bufferstand.daq.operator import ProgressSink, StopRequest, Watcher
from bufferstand.daq.stand import give_back, rests_long
from bufferstand.daq.strokes import NOW_NAME, StrokeCommandSettings, StrokeKeeper, add_strokes, prepare
from bufferstand.daq.warm_up import LATE_S, HeatLog, StepHeat, WarmUpOutcome, warm_up
from bufferstand.daq.zero import BEYOND_MM
from bufferstand.daq.zero import LATE_S as LATE_FORCE_S
from bufferstand.drivers import Identity, Stand
from bufferstand.drivers.controllers import SWITCHED_ON
from bufferstand.foundation import BadInput, Clock, DeviceFault, NotInCharge
from bufferstand.protocols.planning import Plan
from bufferstand.protocols.prediction import Predictor
from bufferstand.protocols.steps import Motion, PlannedStep, TouchOff

RecorderMaker = Callable[[Path, str, Mapping[str, Any]], BlockRecorder]
"""Makes the recorder of a run in a folder, under an id, with its metadata document."""


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
    predictor : Predictor, optional
        What the plan expects of the specimen.
    """

    def __init__(
        self,
        plan: Plan,
        agenda: Agenda,
        stand: Stand,
        clock: Clock,
        facts: CampaignMetadata,
        progress: ProgressSink,
        request: StopRequest,
        settings: RunSettings,
        recorder: RecorderMaker,
        notes: Path,
        watcher: Watcher | None = None,
        predictor: Predictor | None = None,
    ) -> None:
        self._plan = plan
        self._stand = stand
        self._clock = clock
        self._facts = facts
        self._showing = CampaignDisplay(plan, agenda, clock, progress)
        self._settings = settings
        self._make_recorder = recorder
        self._notes = notes
        self._passes = LoopPasses(clock, self._showing, request, notes, watcher)
        self._opening = Opening(
            plan,
            stand,
            clock,
            facts,
            settings,
            settings.guards or plan.campaign.content.guards,
            request,
            notes,
            self._showing,
            self._passes,
            watcher,
            predictor,
        )
        self._alive: ConnectedStand | None = None
        self._polled: PolledPeriods | None = None
        self._terms: StrokeCommandSettings | None = None
        self._keeper: StrokeKeeper | None = None
        self._off: list[int] = []
        self._forces_off: list[int] = []
        self._warmed: WarmUpOutcome | None = None
        self.seen: StepHeat | None = None
        """What the last step, or wait for cooling, did to the specimen."""

    @property
    def cycles_done(self) -> int:
        """Full cycles of the last attempt at a step."""
        return self._alive.driver.cycles_done if self._alive else 0

    @property
    def stand(self) -> tuple[StandOrigin, Identity]:
        """What kind of stand was come to, and who its controller is."""
        alive = self._need()
        return alive.reached, alive.identity

    def trip_of(self, guard: str, reason: str, *, device_fault: bool = True) -> Trip:
        """Return a trip that comes from no sample."""
        return trip_at(self._clock, guard, reason, device_fault=device_fault)

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
        prepare()  # before anything is read: it takes a moment
        self._alive = alive = self._opening.assemble(steps)
        controller = self._stand.controller.facts
        if controller.clock == "host":
            self._polled = PolledPeriods(controller.rate_Hz)
            alive.acquisition.listeners.append(self._polled.take)
        self._terms = terms_for(self._plan, self._stand, self._notes)
        self._keeper = StrokeKeeper(self._notes, self._terms.knowledge)
        alive.driver.commanding.agree(
            self._terms, SessionMessages(alive.acquisition, self._showing), self._keep_learned
        )
        alive.zeroing.arrived = self._set_limits
        alive.zeroing.ended = self._unload
        self._opening.look(alive, steps)
        if must_be_cool and (why := alive.panel.warmer_than()):
            stream = why.partition(" ")[0]
            raise Halt(self.trip_of(stream, f"still too warm to go on: {why}", device_fault=False))
        self._switch_on()

    def _switch_on(self) -> None:
        """Switch the actuator on; a stand that is not this program's (any more) is looked at once more.

        Raises
        ------
        Halt
            If another program has it, or something moves: nothing was written then.
        DeviceFault
            If it does not come on.
        """
        alive = self._need()
        if not self._stand.controller.in_charge:
            self._opening.demand_free()
        alive.safe_stop.arm()
        alive.acquisition.feeding = True
        alive.panel.change(alive.guards)
        alive.panel.expect_valve(None)
        self._set_limits()
        alive.panel.switched_on()
        alive.panel.expect_valve(True)

    def _set_limits(self) -> None:
        """Give the controller its limits and switch on; its stroke counts from its own zero.

        A piston that stands farther out, as a jog has left it, may come back to be touched off.

        Raises
        ------
        Halt
            If it stands farther out, and nothing will bring it back.
        """
        alive, most_mm = self._need(), self._plan.stand_limits.stroke_max_mm
        furthest_mm = self._need_terms().bounds.piston_max_mm
        limit_mm = min(furthest_mm + max(0.0, alive.driver.commanding.zero_mm), most_mm)
        stands_mm = alive.acquisition.latest.values.get("position", 0.0)
        if stands_mm > limit_mm:
            if not alive.zeroing.to_come:
                why = (
                    f"the piston stands at {stands_mm:.2f} mm, beyond the {limit_mm:.4g} mm of this "
                    "campaign: bring it back first (“bufferstand stand jog STAND.toml --to 0”)"
                )
                raise Halt(self.trip_of("zero", why, device_fault=False))
            limit_mm = min(stands_mm + BEYOND_MM, most_mm)
        alive.driver.outlasting(
            lambda: self._stand.controller.enable(
                force_limit_kN=self._plan.limits.force.value,
                stroke_limit_mm=limit_mm,
                watchdog_ms=round(self._facts.watchdog_s * 1000.0),
            )
        )

    def end(self) -> SafeStopReport | None:
        """Stop safely (once) and give the right to commands back; None if the controller never answered."""
        if self._alive is None:
            return None
        report = self._stop(self._alive.panel.action is Action.EMERGENCY)
        give_back(self._stand.controller, report)
        return report

    def late_fault(self) -> Trip | None:
        """Return a device's fault that a guard has seen since the last motion; None if there is none."""
        trip = None if self._alive is None else self._alive.panel.trip
        return trip if trip is not None and trip.device_fault else None

    def show_end(self, status: str, reason: str) -> None:
        """Show how the campaign ended."""
        self._showing.phase = "done"
        report = self._alive.safe_stop.report if self._alive else None
        self._showing.message(f"campaign {status}" + (f": {reason}" if reason else ""))
        if self._off:
            steps = ", ".join(str(index) for index in dict.fromkeys(self._off))
            self._showing.message(f"WARNING: the stroke that was asked for was not reached in step {steps}")
        if self._forces_off:
            steps = ", ".join(str(index) for index in dict.fromkeys(self._forces_off))
            self._showing.message(f"WARNING: the forces that were asked for were not met in step {steps}")
        if report is not None:
            self._showing.message(report.line)
        if self._alive is not None:
            self._showing.now(self._alive.acquisition, self._alive.driver)

    # --- steps -------------------------------------------------------------------------------------

    def ready(self, step: PlannedStep, *, begun: bool = False) -> bool:
        """Set the guards to a step's own limits, and let the specimen come into the band it begins in.

        Parameters
        ----------
        step : PlannedStep
            The step that comes now.
        begun : bool
            Some of its cycles are done already: it goes on though the specimen has become too cold.

        Returns
        -------
        bool
            Whether the specimen had to be waited for; ``seen`` is what the wait did to it then.

        Raises
        ------
        Halt
            If it is too cold or does not cool in time, or a guard or the operator demands it; the stand is at
            zero force with the valve off then.
        """
        alive = self._guard(step, waiting=begins_with_a_wait(step))
        alive.driver.begin_step()
        if step.start_band is None:
            return False
        if too_warm := alive.panel.warmer_than(step.start_band.high_C):
            self._showing.await_step(step, f"waits for the specimen to cool: {too_warm}")
        with self._stopping():
            valve_off = self._valve_off() if too_warm else nullcontext()
            with self._watched(), valve_off:
                alive.driver.cool(step.start_band.high_C, step.start_band.timeout_s)
            alive = self._guard(step, waiting=False)
            if why := too_cold(step, step.start_band, alive.panel.specimen_temperatures()):
                if step.start_band.refuses_cold and not begun:
                    raise Halt(self.trip_of("start temperature", why, device_fault=False))
                self._showing.message(f"WARNING: {why}")
        return bool(too_warm)

    def _guard(self, step: PlannedStep, *, waiting: bool) -> ConnectedStand:
        """Let the guards of a step count from now on."""
        alive = self._need()
        self._alive = replace(alive, guards=guards_of(self._plan, step, alive.base, waiting=waiting))
        self._alive.panel.change(self._alive.guards)
        return self._alive

    def perform(
        self,
        step: PlannedStep,
        motions: Sequence[Motion],
        where: tuple[Path, str] | None,
        specimen_C: float | None = None,
    ) -> None:
        """Perform (the rest of) a step and record it as a run; :meth:`ready` comes before.

        Parameters
        ----------
        step : PlannedStep
            The step.
        motions : sequence of Motion
            Its motions, or those that are left.
        where : tuple of Path and str, or None
            Folder and id of the run; None for a step that is not recorded.
        specimen_C : float, optional
            Temperature of the specimen's mass as it begins [°C]; as planned if not given.

        Raises
        ------
        Halt
            If it was stopped; the stand is at zero force with the valve off then, and the run is closed.
        """
        alive = self._need()
        alive.driver.begin_step(step, motions, specimen_C)
        self._showing.begin_step(step)
        if alive.zeroing.due(motions):
            try:
                with self._stopping():
                    self._touch(TouchOff())
            finally:
                # A stroke of the touch is no cycle of the step.
                alive.driver.begin_step(step, motions, specimen_C)
        try:
            with self._watched(), self._stopping():
                self._perform(step, motions, where)
        finally:
            self._keep_strokes(step)
        if unsealed := self._close_run("complete", ""):
            raise Halt(unsealed)

    def _keep_strokes(self, step: PlannedStep) -> None:
        """Keep what a step asked, commanded and reached, with what was learned of the stroke."""
        terms, rows = self._need_terms(), self._need().driver.commanding.rows
        self._forces_off += [step.index] * any(row.cycles_off for row in self._need().driver.force_rows)
        if not rows:
            return
        self._off += [step.index] * any(row.not_reached for row in rows)
        try:
            add_strokes(self._notes, step.index, step.name, rows, terms.knowledge.as_dict())
            if self._keeper is not None:
                self._keeper.end()
        except OSError as error:
            self._showing.message(f"strokes.jsonl could not be written: {error.strerror}")

    def _keep_learned(self) -> None:
        """Keep what is learned within a step; the test goes on where the disk does not take it."""
        try:
            if self._keeper is not None:
                self._keeper.keep()
        except OSError as error:
            self._keeper = None
            self._showing.message(f"{NOW_NAME} could not be written: {error.strerror}")

    def _touch(self, motion: TouchOff) -> None:
        """Touch off, keep the zero, and let the controller's stroke limit follow it."""
        alive = self._need()
        self._showing.phase = "touch"
        zero = alive.zeroing.touch(motion)
        self._opening.keep(zero)
        self._set_limits()

    def _unload(self, trip: Trip) -> None:
        """Stop for what has ended a touch, and see for a moment what the signals do then: it says why."""
        self._stop(trip.action is Action.EMERGENCY)
        self._passes.watch_rest(LATE_FORCE_S)

    @contextmanager
    def _stopping(self) -> Iterator[None]:
        """Whatever goes wrong inside, the stand is stopped safely and the run is closed."""
        try:
            yield
        except BaseException as error:
            halt = error if isinstance(error, Halt) else self._halt_of(error)
            try:
                self._stop(halt.trip.action is Action.EMERGENCY)
            finally:
                self._close_run(run_status(halt.trip), halt.trip.reason)
            if isinstance(error, DeviceFault):
                raise halt from error
            raise

    def _perform(self, step: PlannedStep, motions: Sequence[Motion], where: tuple[Path, str] | None) -> None:
        alive = self._need()
        self._passes.catch_up()  # what was sampled before belongs to no run, or to the one before
        alive.driver.obey()
        if where is not None:
            alive.acquisition.attach(self._recorder(*where, step))
            if self._polled is not None:
                self._polled.begin()
            self._passes.run_id = where[1]
        alive.acquisition.log.say("step", f"step {step.index} begins: {step.name}")
        for change in self._facts.changes:
            alive.acquisition.log.say("changed", "{what}: {before} → {now}".format_map(change), **change)
        for doubt in self._facts.doubted if where is not None else ():
            alive.acquisition.log.say("doubted", **doubt)
        if step.start_band is not None:
            say_beginning(alive.acquisition, step.start_band)
        for text in expired_today(self._stand):
            alive.acquisition.log.say("calibration", text)
        with self._valve_off() if rests_long(step) else nullcontext():
            self._motions(step, motions)
        self._passes.catch_up()  # what was sampled until the last motion's end
        self._passes.hear_doubts()
        alive.driver.obey()

    def _recorder(self, folder: Path, run_id: str, step: PlannedStep) -> BlockRecorder:
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
            self.seen = replace(log.seen(self._clock.now_s()), warmed=self._warmed)
            self._warmed = None

    def temperatures(self) -> StepHeat:
        """Return what the sensors show now; their first readings are waited for a moment.

        Raises
        ------
        Halt
            If a guard or the operator demands it.
        """
        alive = self._need()
        with self._watched():
            until_s = self._clock.now_s() + LATE_S
            sensors = {guard.stream for guard in alive.guards.of(TemperatureGuard)}
            while sensors - alive.panel.latest_temperatures().keys() and self._clock.now_s() < until_s:
                alive.driver.pump()
        return self.seen or StepHeat(0.0, None, None, None, 0.0)

    def meanwhile(self, work: Callable[[], object]) -> BaseException | None:
        """Do something lengthy in a thread while the loop goes on; return what it raised."""
        return self._passes.meanwhile(work)

    def take_notes(self) -> None:
        """Take what the operator asked for and wrote."""
        self._passes.take_notes()

    def _halt_of(self, error: BaseException) -> Halt:
        if isinstance(error, DeviceFault):
            return Halt(self.trip_of("controller", f"the controller or its wire failed: {error}"))
        if isinstance(error, KeyboardInterrupt):
            return Halt(self.trip_of("operator", "Ctrl-C (SIGINT)", device_fault=False))
        return Halt(self.trip_of("internal", f"internal error: {error!r}"))

    def _motions(self, step: PlannedStep, motions: Sequence[Motion]) -> None:
        alive = self._need()
        if step.warmth is not None:
            self._showing.phase = "motion"
            self._warmed = warm_up(step, step.warmth, motions, alive.driver, alive.acquisition)
            self._showing.message(f"  warmed up: {self._warmed.sentence()}")
            return
        for motion, estimate in zip(motions, step.estimates, strict=True):
            self._showing.phase = phase_of(motion)
            if isinstance(motion, TouchOff):
                self._touch(motion)
            else:
                alive.driver.perform(motion, estimate.duration_s, step.steady)

    def _document(self, run_id: str, step: PlannedStep) -> dict[str, Any]:
        alive = self._need()
        return run_document(
            run_id,
            step,
            self._plan,
            self._stand,
            alive.identity,
            alive.reached,
            alive.guards,
            self._facts,
            alive.zeroing.zero,
        )

    def _close_run(self, status: str, reason: str) -> Trip | None:
        """Seal in a thread, because the watchdog wants to be fed meanwhile; return why it failed, if so."""
        alive = self._need()
        if alive.acquisition.log.recorder is not None and status != "failed":
            if status != "complete":
                self._passes.watch_rest()
            self._passes.catch_up(stopped=True)  # what led to the stop belongs into the run
        if self._polled is not None:
            alive.acquisition.log.say("polls", self._polled.sentence(), **self._polled.facts())
        recorder, self._passes.run_id = alive.acquisition.detach(), ""
        if recorder is None:
            return None
        sealed: list[Path] = []
        if failure := self._passes.meanwhile(lambda: sealed.append(recorder.close(status, reason))):
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
        alive.panel.expect_valve(None)
        with alive.rides.in_safe_stop():
            report = alive.safe_stop.run(
                emergency=emergency,
                seen=alive.acquisition.latest.status,
                stopping_s=alive.driver.stopping_s,
            )
        if first:
            alive.acquisition.log.say("safe stop", report.line, safe=report.safe, by=report.by)
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
        with self._watched(), self._keeping_lock():
            alive.driver.cool(None, self._settings.cool_limit_s)
        self._showing.message("cool enough: going on")
        self._switch_on()

    @contextmanager
    def _valve_off(self) -> Iterator[None]:
        """Wait inside at zero force with the valve off and the lock kept; switched on again behind it.

        Raises
        ------
        Halt
            If the stand was not seen to be safe, or is another program's behind the wait.
        DeviceFault
            If the actuator cannot be switched on again.
        """
        phase, guards = self._showing.phase, self._need().panel.guards
        report = self._stop(emergency=False)
        if not report.safe:
            raise Halt(self.trip_of("controller", report.line))
        self._showing.phase = phase
        self._need().panel.change(guards.valve_off())
        with self._keeping_lock():
            yield
        self._switch_on()

    @contextmanager
    def _keeping_lock(self) -> Iterator[None]:
        """Inside, with the valve off, what is lost is asked for again: wire, lock, a controller's memory."""
        acquisition = self._need().acquisition

        def lost(fault: NotInCharge) -> None:
            self._need().safe_stop.arm()  # what was seen then says nothing of a stand that is another's
            self._showing.message(f"WARNING: {fault}; this campaign asks for the stand again before it moves")

        acquisition.continuity.awake.lock_lost = lost
        self._need().panel.expect_valve(False)
        try:
            with self._need().rides.while_waiting():
                yield
                while acquisition.continuity.is_cut_off:  # what was waited for came by another wire
                    self._need().driver.pump()
        except BaseException:
            self._stop_anew_if_on()
            raise
        finally:
            acquisition.continuity.awake.lock_lost = None

    def _stop_anew_if_on(self) -> None:
        """Let the safe stop stop once more unless the valve is seen to be off still: it was off in a wait."""
        try:
            is_on = self._stand.controller.status().state in SWITCHED_ON
        except DeviceFault:
            is_on = True  # not seen
        if is_on:
            self._need().safe_stop.arm()

    def _need_terms(self) -> StrokeCommandSettings:
        if self._terms is None:
            raise RuntimeError("the session is not open")
        return self._terms

    def _need(self) -> ConnectedStand:
        if self._alive is None:
            raise RuntimeError("the session is not open")
        return self._alive
