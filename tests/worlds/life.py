"""The life of a world: its campaign is begun, stopped, killed and resumed until it is complete."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NoReturn

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.faults.schedule import ScheduledFault
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.machine.truth import COLUMNS
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report import Given, write_report
from bufferstand.foundation.errors import BadInput, ExitStatus
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.model.file import load_model
from bufferstand.protocols.campaign_file.schema import load_campaign
from bufferstand.protocols.limits import StandLimits
from bufferstand.protocols.planning.plan import Plan, make_plan
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.recording.runfile.file import open_run
from tests.daq.run_in_process import COARSE, facts_of
from tests.worlds.computer import Computer, Evidence
from tests.worlds.death import Death, set_traps
from tests.worlds.troubles import Trouble
from tests.worlds.world import World

REST_S = 15.0
"""From the end of a start that ended by itself to the next one [s]."""
MENDED_S = 0.3
"""From mending what failed to the next start: no sample of before is the newest then [s]."""
OPTIONS = Options(draws=50)
OPERATOR = {
    "stop now": StopLevel.NOW,
    "stop after cycle": StopLevel.AFTER_CYCLE,
    "stop after step": StopLevel.AFTER_STEP,
}
FORCE = COLUMNS.index("force_kN")


@dataclass
class Start:
    """One start of the campaign, and how it ended.

    Parameters
    ----------
    number : int
        From 0.
    began_s, ended_s : float
        Stand time [s].
    """

    number: int
    began_s: float
    ended_s: float = 0.0
    status: int | None = None
    """Exit status; None if it was killed."""
    reason: str = ""
    safe: bool | None = None
    """Whether the safe stop says that it saw a safe stand; None if there was none."""
    stop_s: float = 0.0
    """How long the safe stop took [s]."""
    killed_at: str = ""
    error: str = ""
    """A fault of the software that ended it."""
    lines: list[str] = field(default_factory=list)
    struck: list[tuple[Trouble, str, float]] = field(default_factory=list)
    """Troubles, the phase and the stand time [s] in which each struck."""
    valve_on: bool = False
    force_kN: float = 0.0
    position_mm: float = 0.0
    """Truth at its end."""
    second: str = ""
    """What a second program was told."""
    complete: dict[str, Any] = field(default_factory=dict)
    """Steps that campaign.json calls complete at its end, by their hash."""

    @property
    def causes(self) -> list[Trouble]:
        """Return the troubles that struck."""
        return [trouble for trouble, _, _ in self.struck]


@dataclass
class Lived:
    """All that is known of a world at its end: what the laws judge."""

    world: World
    folder: Path
    plan: Plan
    watchdog_s: float
    starts: list[Start] = field(default_factory=list)
    evidence: list[Evidence] = field(default_factory=list)
    truth: dict[str, Any] = field(default_factory=dict)
    valve: list[tuple[float, bool, float]] = field(default_factory=list)
    """When the valve went on or off, and the true force then."""
    marks: list[tuple[float, int]] = field(default_factory=list)
    """Stand time [s], and how many samples of the truth there were by then."""
    document: dict[str, Any] | None = None
    evaluation_error: str = ""
    report: str = ""
    """The report's HTML; why there is none in ``report_error``."""
    report_error: str = ""
    period_s: float = 0.001
    spent_s: float = 0.0
    """Processor time of all its processes [s]."""
    runs: dict[str, Any] = field(default_factory=dict)

    @property
    def out(self) -> Path:
        """The campaign's folder."""
        return self.folder / "out"

    def digest(self) -> str:
        """Return a hash of what happened: the same seed and commit give the same."""
        told = [[one.status, one.reason, one.killed_at, one.ended_s] for one in self.starts]
        digest = hashlib.sha256(json.dumps(told).encode())
        for name in ("force_kN", "position_mm"):
            digest.update(self.truth[name].tobytes())
        return digest.hexdigest()


def plan_world(world: World, folder: Path) -> tuple[Plan, Any, ModelPredictor]:
    """Write a world's files and plan its campaign, as the commands do."""
    plan, stand_file, predictor = _planned(world.write(folder))
    if world.tight is not None:
        peak_kN = max((step.expected_peak_force_kN or 0.0 for step in plan.steps), default=0.0)
        for more in (1.0, 1.15, 1.5):  # cycles between forces need room above them
            with suppress(BadInput):
                return _planned(world.write(folder, more * max(30.0, world.tight * peak_kN)))
        world.write(folder)
    return plan, stand_file, predictor


def _planned(path: Path) -> tuple[Plan, Any, ModelPredictor]:
    campaign = load_campaign(path)
    stand_file = load_stand(campaign.stand_path)
    specimen = load_specimen(campaign.specimen_path).specimen
    assert specimen.model is not None
    predictor = ModelPredictor(load_model(campaign.specimen_path.parent / specimen.model))
    limits = StandLimits(**stand_file.limits.model_dump())
    return make_plan(campaign, limits, predictor, specimen), stand_file, predictor


class Life:
    """Lives a world to its end.

    Parameters
    ----------
    world : World
    folder : Path
        For its files; absolute.
    sabotage : callable, optional
        Breaks something on purpose before it begins, so that a law can be seen to fail.
    """

    def __init__(self, world: World, folder: Path, sabotage: Callable[[Life], object] | None = None) -> None:
        self.world = world
        self.plan, self.stand_file, self.predictor = plan_world(world, folder)
        self.opened: InProcessStand = open_in_process(self.stand_file)
        self.computer = Computer(self.opened.clock, seals_in_s=world.seals_in_s)
        watchdog_s = self.stand_file.controller.watchdog_s
        self.lived = Lived(world, folder, self.plan, watchdog_s, period_s=self.opened.device.period_s)
        self.lived.evidence = self.computer.evidence
        self.death = Death(self.lived.out, self._died)
        self.computer.take_over()
        wire = self.opened.stand.controller._link._wire  # type: ignore[attr-defined]
        self._lost = wire.lost
        wire.lost = self._requested
        set_traps(self.death, wire)
        self._count_truth()
        self.opened.clock.listen(self._tick)
        self._waiting: list[Trouble] = []
        self._seen: dict[str, float] = {}
        self._phase = ""
        self._second_due = False
        self._ended: Callable[[Lived], NoReturn] | None = None
        self._valve_on = False
        if sabotage is not None:
            sabotage(self)

    @property
    def start(self) -> Start:
        """The start under way."""
        return self.lived.starts[-1]

    def live(self, ended: Callable[[Lived], NoReturn]) -> NoReturn:
        """Live to the end; ``ended`` gets what was seen, maybe in another process than this one."""
        self._ended = ended
        self._go_on()

    def _go_on(self) -> NoReturn:
        while len(self.lived.starts) < self.world.starts:
            self._begin()
            status = self._run()
            self._note_end()
            if status == 0:
                break
            self.opened.clock.sleep(REST_S)
        self._end()

    def _died(self, step: str) -> NoReturn:
        self.start.killed_at = step
        self._note_end()
        self.opened.clock.sleep(self.world.rests_s)
        self._go_on()

    def _begin(self) -> None:
        """Mend what ailed the start before, and let the troubles of this one wait for their moment."""
        number = len(self.lived.starts)
        self.opened.device.faults.clear()
        self.computer.disk.full, self.computer.disk.slow_s = False, 0.0
        self.computer.memory.short_at = ""
        if number:
            self.opened.clock.sleep(MENDED_S)
        self.computer.start = number
        self.death.disarm()
        self._seen, self._phase, self._second_due = {}, "start", False
        self._waiting = [one for one in self.world.troubles if one.start == number]
        self.lived.starts.append(Start(number, self.opened.clock.now_s()))
        self._seen[""] = self._seen["start"] = self.start.began_s

    def _run(self) -> int:
        first = self.start.number == 0
        controller = self.opened.stand.controller if first else self.opened.second()
        self.request = StopRequest()
        start = self.start
        try:
            outcome = run_campaign(
                self.plan,
                Stand(controller, self.opened.stand.sensors),
                self.opened.clock,
                self.lived.out,
                facts_of(self.stand_file),
                progress=self,
                stop_request=self.request,
                settings=replace(COARSE, awaits_stand=not first),
                recorder=self.computer.recorder,
                predictor=self.predictor,
            )
        except BadInput as refusal:
            start.status, start.reason = int(ExitStatus.BAD_INPUT), self._told(str(refusal))
            return start.status
        start.status, start.reason = int(outcome.exit_status), self._told(outcome.reason)
        start.safe = None if outcome.safe_stop is None else outcome.safe_stop.safe
        start.stop_s = 0.0 if outcome.safe_stop is None else outcome.safe_stop.duration_s
        start.error = "" if outcome.error is None else repr(outcome.error)
        controller.close()
        self.death.let_go()  # the program is over, and whatever it left open
        return start.status

    def _told(self, reason: str) -> str:
        """Return a reason without the folder, which is another one each time."""
        return reason.replace(str(self.lived.folder), "")

    def _note_end(self) -> None:
        start, device = self.start, self.opened.device
        self._waiting = []
        self.death.disarm()
        start.ended_s = self.opened.clock.now_s()
        start.valve_on = device.controller.valve_on
        truth = self.opened.truth.arrays()
        if truth["force_kN"].size:
            start.force_kN = float(truth["force_kN"][-1])
            start.position_mm = float(truth["position_mm"][-1])
        with suppress(OSError, ValueError):
            steps = json.loads((self.lived.out / "campaign.json").read_text())["steps"]
            start.complete = {one["plan_hash"]: one for one in steps if one["status"] == "complete"}

    def _end(self) -> NoReturn:
        lived = self.lived
        lived.truth = self.opened.truth.arrays()
        lived.spent_s = self.death.spent_s
        runs = sorted((lived.out / "runs").glob("*.h5"))
        for path in runs:
            with suppress(Exception):  # the law of the files says what is wrong with one
                lived.runs[path.stem] = open_run(path)
        if runs:
            try:
                lived.document = dict(evaluate_paths([lived.out], OPTIONS))
            except Exception as error:  # noqa: BLE001 - a law judges it
                lived.evaluation_error = repr(error)
        if runs and lived.document is not None and self.world.reports:
            try:
                (html,) = write_report(
                    lived.out,
                    lived.folder / "report",
                    formats=("html",),
                    document=lived.document,
                    given=Given(options=OPTIONS),
                )
                lived.report = html.read_text(encoding="utf-8")
            except Exception as error:  # noqa: BLE001 - a law judges it
                lived.report_error = repr(error)
        assert self._ended is not None
        self._ended(lived)

    # --- what happens meanwhile --------------------------------------------------------------------

    def update(self, progress: CampaignProgress) -> None:
        """Take a snapshot: by it is known which phase the campaign is in."""
        self._phase = progress.phase
        self._seen.setdefault(progress.phase, self.opened.clock.now_s())
        if self._second_due:
            self._second_due = False
            self._come_second()

    def message(self, text: str) -> None:
        """Keep a line."""
        self.start.lines.append(text)

    def _count_truth(self) -> None:
        truth, self._rows = self.opened.truth, 0
        real = truth.add

        def add(rows: Any) -> None:
            self._rows += len(rows)
            real(rows)

        truth.add = add  # type: ignore[method-assign, assignment]

    def _tick(self, now_s: float) -> None:
        self.lived.marks.append((now_s, self._rows))
        controller = self.opened.device.controller
        if controller.valve_on != self._valve_on:
            self._valve_on = controller.valve_on
            self.lived.valve.append((now_s, self._valve_on, self._true_force_kN()))
        due = [
            one
            for one in self._waiting
            if one.phase in self._seen and now_s >= self._seen[one.phase] + one.after_s
        ]
        for trouble in due:
            self._waiting.remove(trouble)
            self._strike(trouble, now_s)

    def _true_force_kN(self) -> float:  # noqa: N802 - the unit keeps its capitals
        slices = self.opened.truth._slices
        return float(slices[-1][-1, FORCE]) if slices else 0.0

    def _strike(self, trouble: Trouble, now_s: float) -> None:
        """Let a trouble begin."""
        self.start.struck.append((trouble, self._phase, now_s))
        if trouble.kind == "device":
            target, _, fault = trouble.what.partition("=")
            end_s = {} if trouble.for_s is None else {"end_s": now_s + trouble.for_s}
            self.opened.device.faults.add(
                ScheduledFault(target, fault, now_s, settings=dict(trouble.settings), **end_s)
            )
        elif trouble.what == "full":
            self.computer.disk.full = True
        elif trouble.what == "slow":
            self.computer.disk.slow_s = trouble.for_s or 0.0
        elif trouble.kind == "clock":
            self.computer.set_by_s += trouble.for_s or 0.0
        elif trouble.kind == "memory":
            self.computer.memory.short_at = trouble.what
        elif trouble.what == "note":
            self.request.note("looked at the specimen")
        elif trouble.kind == "operator":
            self.request.ask(OPERATOR[trouble.what], "Ctrl-C (SIGINT)")
        elif trouble.kind == "second program":
            self._second_due = True
        elif trouble.what == "anywhere":
            self.death.die("anywhere")
        else:
            self.death.arm(trouble.what, trouble.count)

    def _come_second(self) -> None:
        """Let another program ask for the stand as this one does."""
        other = self.opened.second()
        try:
            other.connect()
            first = not other.other_writer()
            other.enable(force_limit_kN=200.0, stroke_limit_mm=100.0, watchdog_ms=2000)
            self.start.second = "it came first" if first else "it was let"
        except Exception as error:  # noqa: BLE001 - whatever it is told, it must not have the stand
            self.start.second = str(error)

    def _requested(self, request: bytes) -> Any:
        self.computer.memory.demand("request")
        return self._lost(request)
