"""Running a campaign: every step of the plan on the stand, one recorded run a step, and always a safe end."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from bufferstand.daq.campaign.agenda import Agenda
from bufferstand.daq.campaign.first_stroke import SpecimenKnowledge
from bufferstand.daq.campaign.run_settings import RunSettings
from bufferstand.daq.campaign.session import RecorderMaker, Session
from bufferstand.daq.campaign.until_known import Rounds, UntilKnown, until_of
from bufferstand.daq.campaign_folder import (
    AsRun,
    CampaignFolder,
    CampaignMetadata,
    CampaignRecord,
    CampaignStatus,
    add_as_run,
    begin,
    begun,
    changes_taken,
    doubts_before,
    edits_taken,
    observed_run,
    read_as_run,
    with_doubt,
    with_stand,
)
from bufferstand.daq.guards import Trip, run_status
from bufferstand.daq.guards.kinds import FORCE_LIMIT_FAULT, fault_text
from bufferstand.daq.monitor import publishing
from bufferstand.daq.motions import Halt, SafeStopReport
from bufferstand.daq.operator import ProgressSink, SilentSink, StopLevel, StopRequest, TwoSinks, listening
from bufferstand.daq.warm_up import StepHeat
from bufferstand.drivers import Stand
from bufferstand.foundation import BadInput, Clock, DeviceFault, ExitStatus, duration_text
from bufferstand.protocols.planning import Plan, Replanner, limits_of
from bufferstand.protocols.prediction import CurvePredictor, Observation, Predictor
from bufferstand.protocols.steps import Motion, PlannedStep, motions_after
from bufferstand.recording import RunRecorder
from bufferstand.recording.sealing import seal_orphans

FORCE_ADVICE = (
    "the same step would bring the same force again: make it smaller (edit the campaign file, then resume), "
    "or put a slow stroke before it, by which the spring is learned"
)


@dataclass(frozen=True)
class CampaignOutcome:
    """How a campaign ended.

    Parameters
    ----------
    status : CampaignStatus
        ``complete``; ``stopped`` by a limit or the operator; ``failed`` by a device, a wire or the disk;
        ``refused`` before anything moved.
    exit_status : ExitStatus
        Of the command (docs/commands.md).
    runs : tuple of Path
        The run files of this start, in order.
    reason : str
        Why it did not complete.
    safe_stop : SafeStopReport or None
        What the safe stop reached; None if the controller never answered.
    error : BaseException or None
        A fault of this software that ended it, for a bug report.
    """

    status: CampaignStatus
    exit_status: ExitStatus
    runs: tuple[Path, ...]
    reason: str
    safe_stop: SafeStopReport | None
    error: BaseException | None = None


def run_campaign(
    plan: Plan,
    stand: Stand,
    clock: Clock,
    out_dir: Path,
    facts: CampaignMetadata,
    *,
    progress: ProgressSink | None = None,
    stop_request: StopRequest | None = None,
    settings: RunSettings | None = None,
    recorder: RecorderMaker = RunRecorder,
    predictor: Predictor | None = None,
    until: UntilKnown | None = None,
) -> CampaignOutcome:
    """Run a campaign, or go on with it: steps that ``campaign.json`` there calls complete are left out.

    Whatever ends it, the stand ends at zero force with the valve off, and every run is closed. The stand is
    not closed. Enter :func:`bufferstand.daq.operator.stop_request.stop_on_signals` around the call.

    Parameters
    ----------
    plan : Plan
        What is to be done.
    stand : Stand
        Opened, not connected yet.
    clock : Clock
        Stand time.
    out_dir : Path
        The campaign's folder.
    facts : CampaignFacts
        Stand file, operator, watchdog time.
    progress : ProgressSink, optional
        Who shows it.
    stop_request : StopRequest, optional
        The operator's wish.
    settings : RunSettings, optional
        Guards of the stand, pace, patience.
    recorder : callable
        Makes the recorder of a run.
    predictor : Predictor, optional
        The spring model of the plan. With it the specimen's heating is learned as the campaign goes, also
        from what an earlier start left in the folder, and pauses, order and time that is left follow;
        without it the plan stands as it is.
    until : UntilKnown, optional
        What is to be known: the plan has as many rounds as it may take, and those that are left when it is
        known, or cannot be, are skipped. A campaign that was begun with one goes on with it.

    Returns
    -------
    CampaignOutcome
        Faults of devices and of this software are told in it, not raised.

    Raises
    ------
    BadInput
        If the folder cannot be used.
    """
    folder = CampaignFolder(out_dir)
    request = stop_request or StopRequest()
    own = progress or SilentSink()
    with listening(folder.path, request), publishing(folder.path, own.message) as publisher:
        shown = TwoSinks(own, publisher)
        try:
            for path in seal_orphans(folder.runs):
                shown.message(f"recovered {path.name}: the program had ended while it was recorded")
            before = folder.load()
            record = begin(plan, folder, facts)
            known = begun(before, folder.path)
            facts = replace(
                facts,
                edited=edits_taken(record),
                changes=changes_taken(record),
                doubted=doubts_before(record),
                began_simulated=known.simulated,
                began_controller=known.controller,
            )
        except OSError as error:
            raise BadInput(f"the folder cannot be written: {error.strerror}", file=out_dir) from None
        until = until_of(record.until) or until
        if until is not None and not record.until:
            record = replace(record, until=until.as_dict())
        agenda = Agenda(
            plan,
            lambda step: record.step(step).over,
            None if predictor is None else Replanner(plan, predictor),
            () if predictor is None else _known(folder, record, facts),
        )
        session = Session(
            plan,
            agenda,
            stand,
            clock,
            facts,
            shown,
            request,
            settings or RunSettings(),
            recorder,
            folder.path,
            publisher,
            predictor,
        )
        outcome = _Campaign(
            plan, folder, record, session, request, agenda, SpecimenKnowledge(plan, predictor), until
        ).run()
        publisher.end(outcome.status, outcome.reason, outcome.safe_stop)
        return outcome


def _known(folder: CampaignFolder, record: CampaignRecord, facts: CampaignMetadata) -> list[Observation]:
    """Return what an earlier start saw of the specimen: from its lines, and from runs that left none."""
    rows = read_as_run(folder.path)
    found = [seen for row in rows if (seen := row.observation()) is not None]
    lines = {row.run for row in rows}
    unwritten = [run for step in record.steps for run in step.runs if run not in lines]
    recorded = (observed_run(folder.path / run, facts.ambient()) for run in unwritten)
    return found + [seen for seen in recorded if seen is not None]


class _Campaign:
    """One start of a campaign."""

    def __init__(
        self,
        plan: Plan,
        folder: CampaignFolder,
        record: CampaignRecord,
        session: Session,
        request: StopRequest,
        agenda: Agenda,
        acquaintance: SpecimenKnowledge,
        until: UntilKnown | None = None,
    ) -> None:
        self._agenda = agenda
        self._acquaintance = acquaintance
        self._plan = plan
        self._folder = folder
        self._record = record
        self._session = session
        self._request = request
        self._runs: list[Path] = []
        self._rounds = None if until is None else Rounds(plan, until, self._complete_runs)
        if self._rounds is not None:
            self._rounds.go_on(record.until)

    def run(self) -> CampaignOutcome:
        """Do everything there is to do; tell how it ended."""
        try:
            trip, refused, error = self._guarded()
        finally:
            report = self._session.end()
        status: CampaignStatus = "complete"
        if trip is not None:
            status = "refused" if refused and trip.guard != "operator" else run_status(trip)
        reason = "" if trip is None else trip.reason
        exit_status = _exit_status(trip, report)
        if trip is None and exit_status:
            reason = "" if report is None else report.line
        if trip is None and not exit_status and self._rounds is not None and self._rounds.end != "known":
            exit_status, reason = ExitStatus.STOPPED, self._rounds.sentence
        if trip is None and (late := self._session.late_fault()):  # of the last release: no step is the worse
            trip, reason, exit_status = late, late.reason, ExitStatus.DEVICE_FAULT
        self._record = replace(
            self._record,
            status=status,
            reason=reason,
            stopped_by="" if trip is None else trip.guard,
            trip={} if trip is None else trip.facts(),
        )
        if trip is not None and _is_told_later(trip, refused=refused) and not self._runs:  # no run holds it
            self._record = with_doubt(self._record, {**trip.facts(), "reason": reason})
        self._save()
        self._session.take_notes()
        if trip is not None and not refused and _too_much_force(trip):
            self._session.say_aloud(FORCE_ADVICE)
        self._session.show_end(status, reason)
        return CampaignOutcome(status, exit_status, tuple(self._runs), reason, report, error)

    def _guarded(self) -> tuple[Trip | None, bool, BaseException | None]:
        """Do everything; return what stopped it, whether before anything moved, and a fault of our own."""
        refused = True
        try:
            self._session.open(self._agenda.left, must_be_cool=self._record.must_cool)
            refused = False
            self._record = with_stand(self._record, *self._session.stand)
            self._save()
            self._recall()
            if self._learns:
                now = self._session.temperatures()
                self._agenda.begin(now.end_C, now.ambient_C)
                self._look_ahead()
            while (step := self._agenda.next()) is not None:
                if self._rounds is None or not self._ended_before(self._rounds, step):
                    self._step(step)
                elif not step.pause:
                    self._note(step, status="skipped", reason=self._rounds.sentence)
            if self._rounds is not None and not self._rounds.end:
                self._judge(self._rounds, self._rounds.until.most_rounds)
        except Halt as halt:
            return halt.trip, refused, None
        except KeyboardInterrupt:
            return self._session.trip_of("operator", "Ctrl-C (SIGINT)", device_fault=False), refused, None
        except DeviceFault as fault:
            return self._session.trip_of("controller", str(fault)), refused, None
        except Exception as error:  # noqa: BLE001 - a bug must not keep the stand loaded; it is told with its place
            place = traceback.extract_tb(error.__traceback__)[-1]
            text = f"internal error: {error!r} in {Path(place.filename).name}, line {place.lineno}"
            return self._session.trip_of("internal", text), refused, error
        return None, False, None

    def _ended_before(self, rounds: Rounds, step: PlannedStep) -> bool:
        """Say whether no further round is to be run; judge those that are through where a step begins one."""
        if not rounds.end and (done := rounds.done_before(step)) is not None:
            self._judge(rounds, done)
        return bool(rounds.end)

    def _judge(self, rounds: Rounds, done: int) -> None:
        """Evaluate the rounds that are through while the loop goes on, and say what comes of it."""
        if error := self._session.meanwhile(lambda: rounds.judge(done)):
            raise error
        self._record = replace(self._record, until=rounds.as_dict())
        self._save()
        self._session.say_aloud(rounds.sentence)

    def _complete_runs(self, step: PlannedStep) -> list[Path]:
        record = self._record.step(step)
        if step.run_kind is None or record.status != "complete":
            return []
        return [self._folder.path / run for run in record.runs[-1:]]

    # --- one step ----------------------------------------------------------------------------------

    def _step(self, step: PlannedStep) -> None:
        if self._request.level >= StopLevel.AFTER_STEP:
            raise Halt(
                self._session.trip_of(
                    "operator", f"stopped by the operator: {self._request.reason}", device_fault=False
                )
            )
        if step.pause:
            self._pause(step)
            return
        if why := self._acquaintance.refuses(step):
            raise Halt(self._session.trip_of("plan", why, device_fault=False))
        known = self._record.step(step)
        done = known.cycles_done if known.too_warm else 0
        while motions := motions_after(step.motions, done):
            try:
                self._ready(step, begun=done > 0)
                self._attempt(step, motions)
            except Halt as halt:
                done += self._session.cycles_done
                self._note(
                    step,
                    status=run_status(halt.trip),
                    cycles_done=done,
                    reason=halt.trip.reason,
                    stopped_by=halt.trip.guard,
                    too_warm=_too_warm(halt.trip),
                )
                if not _too_warm(halt.trip) or self._policy == "stop" or step.warmth is not None:
                    raise  # to cool a specimen and warm it up again would end at the stop again
                self._cool_down(step)
                if self._policy == "skip":
                    self._note(step, status="skipped")
                    return
            else:
                ended_early = step.ends_early
                done = done + self._session.cycles_done if ended_early else step.cycles or 0
                break
        self._note(step, status="complete", cycles_done=done, reason="", stopped_by="", too_warm=False)

    @property
    def _policy(self) -> Literal["stop", "wait-and-continue", "skip"]:
        return self._plan.campaign.limits.on_temperature_stop

    def _ready(self, step: PlannedStep, *, begun: bool = False) -> None:
        """Let the specimen come into the band in which the step begins, and learn from the wait."""
        waited = self._session.ready(step, begun=begun)
        if waited and self._learns and (seen := self._session.seen) is not None:
            self._write(self._agenda.waited(step, seen))

    def _pause(self, step: PlannedStep) -> None:
        complete = False
        self._ready(step)
        try:
            self._session.perform(step, step.motions, None)
            complete = True
        except Halt as halt:
            if not _too_warm(halt.trip) or self._policy == "stop":
                raise
        finally:
            self._learn(step, complete=complete)
        if not complete:
            self._cool_down(step)

    def _cool_down(self, step: PlannedStep) -> None:
        self._session.cool_down()
        if self._learns and (seen := self._session.seen) is not None:
            resume_C = limits_of(step, self._plan.campaign.limits).temperature_resume_C
            self._write(self._agenda.rested(step, seen, resume_C))

    @property
    def _learns(self) -> bool:
        return self._agenda.learns

    def _learn(self, step: PlannedStep, *, complete: bool, run: str = "") -> None:
        """Learn from a step or a part of it, and keep it as it was run."""
        seen: StepHeat | None = self._session.seen
        if seen is None or not self._learns:
            return
        row = self._agenda.done(step, seen, self._session.cycles_done, complete=complete, run=run)
        if complete:
            self._look_ahead()
            row = replace(row, left_s=self._agenda.later_s)
            self._session.say_aloud(f"  {row.sentence()}")
        self._write(row)

    def _write(self, row: AsRun) -> None:
        try:
            add_as_run(self._folder.path, row)
        except OSError as error:
            self._session.say_aloud(f"as-run.jsonl could not be written: {error.strerror}")

    def _look_ahead(self) -> None:
        """Plan anew what is left, if what is known by now says that the outlook no longer holds."""
        if not self._agenda.outdated:
            return
        before_s = self._agenda.later_s
        if error := self._session.meanwhile(self._agenda.look_ahead):
            # The test goes on as it was planned: that it lasts longer than said is no danger to the stand.
            self._session.say_aloud(f"WARNING: what is left could not be planned anew: {error!r}")
            return
        now_s, scale = self._agenda.later_s, self._agenda.scale
        if abs(now_s - before_s) > 0.02 * before_s + 1.0:
            self._session.say_aloud(
                f"planned anew (heating × {scale.heating:.2f}, cooling × {scale.cooling:.2f} of the model, "
                f"from {scale.steps} steps): {duration_text(now_s)} left, {duration_text(before_s)} before"
            )

    def _attempt(self, step: PlannedStep, motions: Sequence[Motion]) -> None:
        """Perform and record (the rest of) a step; whatever happens, the run is closed after a safe stop."""
        before = self._record.step(step).runs
        if step.run_kind is None:
            self._note(step, status="running")
            complete = False
            try:
                self._session.perform(step, motions, None, self._agenda.specimen_C)
                complete = True
            finally:
                self._learn(step, complete=complete)
            return
        run_id = self._folder.run_id(step)
        run, complete = f"{self._folder.runs.name}/{run_id}.h5", False
        self._note(step, status="running", runs=(*before, run))
        try:
            self._session.perform(step, motions, (self._folder.runs, run_id), self._agenda.specimen_C)
            complete = True
        finally:
            path = self._folder.runs / f"{run_id}.h5"
            if path.exists():
                self._runs.append(path)
            elif not path.with_suffix(".journal").exists():
                self._note(step, runs=before)  # it was stopped before there was anything to record
            if complete:
                self._met(self._acquaintance.meet(step, path))
            self._learn(step, complete=complete, run=run)

    def _recall(self) -> None:
        """Take what runs of an earlier start show of a specimen that nothing else is known of."""
        over = [step for step in self._plan.steps if not step.pause and self._record.step(step).over]
        runs = ((step, self._folder.path / run) for step in over for run in self._record.step(step).runs)
        self._met(self._acquaintance.recall(runs))

    def _met(self, curve: CurvePredictor | None) -> None:
        """Plan with the curve that a slow stroke has shown."""
        if curve is not None:
            self._agenda.know(curve)
            more = 100.0 * (curve.margin - 1.0)
            end_mm, end_kN = curve.points[-1]
            self._session.say_aloud(
                f"the specimen's curve is known to {end_mm:.1f} mm and {end_kN:.0f} kN: "
                f"what follows is judged by it, with {more:.0f} % more force"
            )

    def _note(self, step: PlannedStep, **changes: object) -> None:
        self._record = self._record.with_step(replace(self._record.step(step), **changes))  # type: ignore[arg-type]
        self._save()

    def _save(self) -> None:
        """Bring ``campaign.json`` up to date; a disk that does not take it stops the next run anyway."""
        try:
            self._folder.save(self._record)
        except OSError as error:
            self._session.say_aloud(f"campaign.json could not be written: {error.strerror}")


def _exit_status(trip: Trip | None, report: SafeStopReport | None) -> ExitStatus:
    """Return the exit status of what ended a campaign: only a stand that was seen to be safe is no fault."""
    if report is None or not report.safe or (trip is not None and trip.device_fault):
        return ExitStatus.DEVICE_FAULT
    return ExitStatus.DONE if trip is None else ExitStatus.STOPPED


def _too_much_force(trip: Trip) -> bool:
    """Return whether a trip is the force limit, of the guard or of the device, and not for a wrong signal."""
    if trip.doubt:
        return False
    return trip.guard == "force" or fault_text(FORCE_LIMIT_FAULT) in trip.reason


def _is_told_later(trip: Trip, *, refused: bool) -> bool:
    """Return whether later runs tell of a start that this ended: a doubt, or a guard once things moved."""
    return bool(trip.doubt) or (not refused and trip.guard != "operator" and not _too_warm(trip))


def _too_warm(trip: Trip) -> bool:
    """Return whether a trip is a warm specimen, not a silent sensor."""
    return trip.guard.startswith("temperature") and not trip.device_fault
