"""The display of a running campaign: its state, the newest values, and important messages."""

from __future__ import annotations

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.campaign.agenda import Agenda
from bufferstand.daq.guards import Action, Trip
from bufferstand.daq.motions import MotionRunner
from bufferstand.daq.operator import CampaignProgress, Phase, ProgressSink, Throttle
from bufferstand.foundation import Clock, Harmonic, Release, StaticCycles
from bufferstand.protocols.planning import Plan, limits_of
from bufferstand.protocols.steps import ForceCycles, Hold, Motion, PlannedStep, TouchOff, WaitUntilCool


class CampaignDisplay:
    """Keeps what a snapshot needs beside the newest values, and passes everything on.

    Parameters
    ----------
    plan : Plan
        Its limits and how many steps it has.
    agenda : Agenda
        How long the rest should take.
    clock : Clock
        Stand time.
    sink : ProgressSink
        Who shows it.
    """

    def __init__(self, plan: Plan, agenda: Agenda, clock: Clock, sink: ProgressSink) -> None:
        self._plan = plan
        self._agenda = agenda
        self._clock = clock
        self._sink = sink
        self._throttle = Throttle(sink, clock.wall_s)
        self._began_s = self._step_began_s = clock.now_s()
        self._step: PlannedStep | None = None
        self._step_lasts_s = 0.0
        self._warnings: list[str] = []
        self.phase: Phase = "start"
        """What the campaign does at present."""
        self.stop_asked = ""
        """The operator's wish to stop, and whose it is."""

    @property
    def step_index(self) -> int:
        """Return the number of the step under way, 0 before the first."""
        return self._step.index if self._step else 0

    def message(self, text: str) -> None:
        """Show a line that must not be missed."""
        self._sink.message(text)

    def begin_step(self, step: PlannedStep) -> None:
        """Say that a step begins; warnings of the one before are forgotten."""
        self._step, self._step_began_s, self._warnings = step, self._clock.now_s(), []
        self._step_lasts_s = step.expected_duration_s - step.wait_s
        self.message(
            f"step {step.index} of {len(self._plan.steps)}: {step.name} "
            f"(about {step.duration_s - step.wait_s:.0f} s)"
        )

    def await_step(self, step: PlannedStep, why: str) -> None:
        """Say that a step waits for something before it begins."""
        self._step, self._step_began_s, self._warnings = step, self._clock.now_s(), []
        self._step_lasts_s = step.expected_duration_s
        self.phase = "cool-down"
        self.message(f"step {step.index} of {len(self._plan.steps)}: {step.name} {why}")

    def waiting(self, text: str, left_s: float) -> None:
        """Show that nothing is read yet: what is waited for, and how long it takes at most [s]."""
        began_s = self._clock.now_s() - self._began_s
        snapshot = CampaignProgress(
            0, len(self._plan.steps), text, self.phase, 0, 0, None, None, {}, None, began_s, left_s
        )
        self._throttle.offer(lambda: snapshot)

    def trip(self, trip: Trip) -> None:
        """Say what a guard said."""
        self._warnings.append(trip.reason)
        self.message(f"{'note' if trip.action is Action.NOTE else 'STOP'}: {trip.reason}")

    def warn(self, text: str) -> None:
        """Keep a warning for the snapshots of this step."""
        self._warnings.append(text)

    def offer(self, acquisition: Acquisition, driver: MotionRunner) -> None:
        """Show a snapshot if it is time for one."""
        self._throttle.offer(lambda: self._snapshot(acquisition, driver))

    def now(self, acquisition: Acquisition, driver: MotionRunner) -> None:
        """Show a snapshot in any case."""
        self._sink.update(self._snapshot(acquisition, driver))

    def _snapshot(self, acquisition: Acquisition, driver: MotionRunner) -> CampaignProgress:
        latest, step, done = acquisition.latest, self._step, self.phase == "done"
        agenda = self._agenda
        here_s = 0.0
        if step is not None and not done:
            here_s = max(0.0, self._step_lasts_s - (self._clock.now_s() - self._step_began_s))
        recorder = acquisition.log.recorder
        return CampaignProgress(
            step=step.index if step else 0,
            steps=len(self._plan.steps),
            name=step.name if step else "",
            phase=self.phase,
            cycle=0 if self.phase == "touch" else driver.cycles_done,
            cycles=(step.cycles or 0) if step else 0,
            force_kN=latest.values.get("force"),
            stroke_mm=latest.values.get("stroke"),
            temperatures_C=acquisition.panel.latest_temperatures(),
            temperature_limit_C=self._stop_C(),
            elapsed_s=self._clock.now_s() - self._began_s,
            remaining_s=here_s + (0.0 if done else agenda.later_s),
            lost=latest.lost,
            written=recorder.written if recorder else 0,
            durable=recorder.durable if recorder else 0,
            warnings=tuple(self._warnings),
            planned_remaining_s=here_s + (0.0 if done else agenda.planned_later_s),
            heating=agenda.scale.heating,
            cooling=agenda.scale.cooling,
            learned_from=agenda.scale.steps,
            stroke=driver.commanding.line,
            part=driver.part,
            stop_asked=self.stop_asked,
        )

    def _stop_C(self) -> float:  # noqa: N802 - the unit keeps its capital
        limits = self._plan.campaign.limits
        return (limits if self._step is None else limits_of(self._step, limits)).temperature_stop_C


def phase_of(motion: Motion) -> Phase:
    """Return what the campaign does while a motion lasts."""
    if isinstance(motion, Harmonic | StaticCycles | ForceCycles):
        return "motion"
    if isinstance(motion, TouchOff):
        return "touch"
    if isinstance(motion, Release):
        return "release"
    if isinstance(motion, WaitUntilCool):
        return "cool-down"
    return "hold" if isinstance(motion, Hold) else "ramp"
