"""Progress of a campaign as facts, at most ten times a second, for whoever shows it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

if TYPE_CHECKING:
    from bufferstand.daq.acquisition import Acquisition
    from bufferstand.daq.scaling import ScaledBlock

Phase = Literal["start", "ramp", "motion", "release", "touch", "hold", "cool-down", "safe stop", "done"]
"""What the campaign does at present."""
Part = Literal["", "lead-in", "run-out"]
"""What a sine does beside its full cycles: it grows before the first, and fades behind the last."""


@dataclass(frozen=True)
class CampaignProgress:
    """One snapshot of a running campaign.

    Parameters
    ----------
    step, steps : int
        Number of the step (from 1; 0 before the first) and how many there are.
    name : str
        The step's name.
    phase : Phase
        What it does at present.
    cycle, cycles : int
        Full cycles done and wanted; ``cycle`` never exceeds what is wanted of the motion under way.
    force_kN, stroke_mm : float or None
        Newest values.
    temperatures_C : mapping of str to float
        Newest true reading by sensor.
    temperature_limit_C : float or None
        The stop threshold.
    elapsed_s : float
        Stand time since the campaign began [s].
    remaining_s : float
        Time that is left, by all that was learned so far [s].
    lost : int
        Samples lost on the wire so far.
    written, durable : int
        Samples of the run under way: handed to the file, and known to be on the disk.
    warnings : tuple of str
        What guards noted so far in this step.
    planned_remaining_s : float or None
        Time that would be left by the plan that the campaign began with [s].
    heating, cooling : float
        Learned factors on the model's heat and its loss to the air.
    learned_from : int
        From so many steps and waits.
    stroke : str
        What was asked, commanded and reached in the last cycle that was judged; empty before the first.
    part : Part
        Whether a sine is growing or fading, which are no full cycles; empty else.
    stop_asked : str
        The operator's wish to stop, and whose it is; empty where nobody asked.
    """

    step: int
    steps: int
    name: str
    phase: Phase
    cycle: int
    cycles: int
    force_kN: float | None
    stroke_mm: float | None
    temperatures_C: Mapping[str, float]
    temperature_limit_C: float | None
    elapsed_s: float
    remaining_s: float
    lost: int = 0
    written: int = 0
    durable: int = 0
    warnings: tuple[str, ...] = field(default=())
    planned_remaining_s: float | None = None
    heating: float = 1.0
    cooling: float = 1.0
    learned_from: int = 0
    stroke: str = ""
    part: Part = ""
    stop_asked: str = ""

    @property
    def cycles_text(self) -> str:
        """Which cycle it is in words, e.g. ``cycle 2 of 5, running out``; empty where there are none."""
        if not self.cycles:
            return ""
        if self.part == "lead-in":
            return f"leading in to {self.cycles} cycle{'s' * (self.cycles > 1)}"
        return f"cycle {self.cycle} of {self.cycles}" + (", running out" if self.part == "run-out" else "")


class ProgressSink(Protocol):
    """Whoever shows a campaign's progress; called in the acquisition's thread, so it must be quick."""

    def update(self, progress: CampaignProgress) -> None:
        """Show a snapshot."""
        ...

    def message(self, text: str) -> None:
        """Show one line that must not be missed: a step begun or ended, a warning, a trip."""
        ...


class Watcher(Protocol):
    """Whoever looks on more closely; called in the acquisition's thread: it must be quick and never fail."""

    def take(self, block: ScaledBlock) -> None:
        """Take a block of any stream."""
        ...

    def look(self, acquisition: Acquisition) -> None:
        """Look at everything there is, once in every pass."""
        ...


class SilentSink:
    """Shows nothing."""

    def update(self, progress: CampaignProgress) -> None:
        """Take a snapshot and drop it."""

    def message(self, text: str) -> None:
        """Take a line and drop it."""


class TwoSinks:
    """Shows everything in two places."""

    def __init__(self, one: ProgressSink, two: ProgressSink) -> None:
        self._sinks = (one, two)

    def update(self, progress: CampaignProgress) -> None:
        """Show a snapshot in both."""
        for sink in self._sinks:
            sink.update(progress)

    def message(self, text: str) -> None:
        """Show a line in both."""
        for sink in self._sinks:
            sink.message(text)


class Throttle:
    """Lets a snapshot through at most every ``interval_s`` of the wall; it is not even made otherwise.

    Parameters
    ----------
    sink : ProgressSink
        Who gets it.
    wall_s : callable
        Time of the wall [s].
    interval_s : float
        Least time between two snapshots [s].
    """

    def __init__(self, sink: ProgressSink, wall_s: Callable[[], float], *, interval_s: float = 0.1) -> None:
        self._sink = sink
        self._wall_s = wall_s
        self._interval_s = interval_s
        self._next_s = wall_s()

    def offer(self, make: Callable[[], CampaignProgress]) -> None:
        """Make and pass on a snapshot if it is time for one."""
        now_s = self._wall_s()
        if now_s >= self._next_s:
            self._next_s = now_s + self._interval_s
            self._sink.update(make())
