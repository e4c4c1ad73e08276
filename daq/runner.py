"""Running a campaign: every step of the plan on the stand, one recorded run a step, and always a safe end."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from daq.control import listening
from daq.driving import Halt
from daq.folder import CampaignFolder, CampaignRecord, CampaignStatus, begin_record
from daq.guards import Trip, run_status
from daq.metadata import CampaignFacts
from daq.progress import ProgressSink, Silent
from daq.safe_stop import SafeStopReport
from daq.session import RecorderMaker, RunSettings, Session
from daq.signals import StopLevel, StopRequest
from drivers.interfaces import Stand
from foundation.clock import Clock
from foundation.errors import BadInput, DeviceFault, ExitStatus
from protocols.plan import Plan
from protocols.steps import Motion, PlannedStep, motions_after
from recording.seal import seal_orphans
from recording.writer import RunRecorder


@dataclass(frozen=True)
class CampaignOutcome:
    """How a campaign ended.

    Parameters
    ----------
    status : CampaignStatus
        ``complete``; ``stopped`` by a limit or the operator; ``failed`` by a device, a wire or the disk;
        ``refused`` before anything moved.
    exit_status : ExitStatus
        Of the command (contracts § 1).
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
    facts: CampaignFacts,
    *,
    progress: ProgressSink | None = None,
    stop_request: StopRequest | None = None,
    settings: RunSettings | None = None,
    recorder: RecorderMaker = RunRecorder,
) -> CampaignOutcome:
    """Run a campaign, or go on with it: steps that ``campaign.json`` there calls complete are left out.

    Whatever ends it, the stand ends at zero force with the valve off, and every run is closed. The stand is
    not closed. Enter :func:`daq.signals.stop_on_signals` around the call.

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
    shown = progress or Silent()
    request = stop_request or StopRequest()
    with listening(folder.path, request):
        before = folder.load()
        try:
            campaign_file = folder.copy_inputs(plan.campaign.path)
            for path in seal_orphans(folder.runs):
                shown.message(f"recovered {path.name}: the program had ended while it was recorded")
            record = begin_record(plan, before, campaign_file, folder.path)
            folder.save(record)
        except OSError as error:
            raise BadInput(f"the folder cannot be written: {error.strerror}", file=out_dir) from None
        session = Session(
            plan, stand, clock, facts, shown, request, settings or RunSettings(), recorder, folder.path
        )
        return _Campaign(plan, folder, record, session, request).run()


class _Campaign:
    """One start of a campaign."""

    def __init__(
        self,
        plan: Plan,
        folder: CampaignFolder,
        record: CampaignRecord,
        session: Session,
        request: StopRequest,
    ) -> None:
        self._plan = plan
        self._folder = folder
        self._record = record
        self._session = session
        self._request = request
        self._runs: list[Path] = []

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
        exit_status = ExitStatus.DONE
        if trip is not None:
            exit_status = ExitStatus.DEVICE_FAULT if trip.device_fault else ExitStatus.STOPPED
        elif report is not None and not report.safe:  # nobody saw the stand come to rest
            reason, exit_status = report.line, ExitStatus.DEVICE_FAULT
        self._record = replace(
            self._record, status=status, reason=reason, stopped_by="" if trip is None else trip.guard
        )
        self._save()
        self._session.take_notes()
        self._session.show_end(status, reason)
        return CampaignOutcome(status, exit_status, tuple(self._runs), reason, report, error)

    def _guarded(self) -> tuple[Trip | None, bool, BaseException | None]:
        """Do everything; return what stopped it, whether before anything moved, and a fault of our own."""
        refused = True
        try:
            left = [step for step in self._plan.steps if not self._record.step(step).over]
            self._session.open(left, must_be_cool=self._record.must_cool)
            refused = False
            for step in self._plan.steps:
                self._step(step)
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

    # --- one step ----------------------------------------------------------------------------------

    def _step(self, step: PlannedStep) -> None:
        known = self._record.step(step)
        if known.over:
            return
        if self._request.level >= StopLevel.AFTER_STEP:
            raise Halt(
                self._session.trip_of(
                    "operator", f"stopped by the operator: {self._request.reason}", device_fault=False
                )
            )
        done = known.cycles_done if known.too_warm else 0
        while motions := motions_after(step.motions, done):
            try:
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
                if not _too_warm(halt.trip) or self._policy == "stop":
                    raise
                self._session.cool_down()
                if self._policy == "skip":
                    self._note(step, status="skipped")
                    return
            else:
                ended_early = step.steady is not None
                done = done + self._session.cycles_done if ended_early else step.cycles or 0
                break
        self._note(step, status="complete", cycles_done=done, reason="", stopped_by="", too_warm=False)

    @property
    def _policy(self) -> Literal["stop", "wait-and-continue", "skip"]:
        return self._plan.campaign.limits.on_temperature_stop

    def _attempt(self, step: PlannedStep, motions: Sequence[Motion]) -> None:
        """Perform and record (the rest of) a step; whatever happens, the run is closed after a safe stop."""
        before = self._record.step(step).runs
        if step.run_kind is None:
            self._note(step, status="running")
            self._session.perform(step, motions, None)
            return
        run_id = self._folder.run_id(step)
        self._note(step, status="running", runs=(*before, f"{self._folder.runs.name}/{run_id}.h5"))
        try:
            self._session.perform(step, motions, (self._folder.runs, run_id))
        finally:
            path = self._folder.runs / f"{run_id}.h5"
            if path.exists():
                self._runs.append(path)
            elif not path.with_suffix(".journal").exists():
                self._note(step, runs=before)  # it was stopped before there was anything to record

    def _note(self, step: PlannedStep, **changes: object) -> None:
        self._record = self._record.with_step(replace(self._record.step(step), **changes))  # type: ignore[arg-type]
        self._save()

    def _save(self) -> None:
        """Bring ``campaign.json`` up to date; a disk that does not take it stops the next run anyway."""
        try:
            self._folder.save(self._record)
        except OSError as error:
            self._session.say_aloud(f"campaign.json could not be written: {error.strerror}")


def _too_warm(trip: Trip) -> bool:
    """Return whether a trip is a warm specimen, not a silent sensor."""
    return trip.guard.startswith("temperature") and not trip.device_fault
