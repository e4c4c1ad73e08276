"""The guard of a stream that should deliver all the time: said when it falls silent, and why."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, Self

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Complaint, PassOver, Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip


@dataclass(frozen=True)
class SilenceMemory:
    """When it was heard last [s of the wall], what its driver complained of, and whether it was said."""

    heard_s: float
    complaint: str = ""
    said: bool = False


@dataclass(frozen=True)
class SilenceGuard(Guard[SilenceMemory]):
    """A stream that must deliver.

    Parameters
    ----------
    stream : str
        Which.
    limit_s : float
        Without a sample for so long [s of the wall]: trip.
    action : Action
        What that leads to.
    """

    kind: ClassVar = "silences"
    title: ClassVar = "sensors that must deliver all the time"
    settings: ClassVar = ("guards.amplifier_silence_s", "guards.action.amplifier_silence")
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`silence of amplifier`",)
    looks_at: ClassVar = (Samples, Complaint, PassOver)
    turn: ClassVar = 10

    stream: str
    limit_s: float
    action: Action

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return one for each amplifier and sensor; thermometers have a guard of their own."""
        for stream in site.sensors:
            if stream in site.thermometers:
                continue
            limit_s, does = site.table.amplifier_silence_s, site.does("amplifier_silence")
            if stream in site.acquisition:  # of what it does not measure no figure can be made
                limit_s, does = site.table.controller_silence_s, max(does, Action.STOP)
            yield cls(stream, limit_s, does)

    @property
    def key(self) -> str:
        """Return the stream."""
        return self.stream

    def begin(self, wall_s: float) -> SilenceMemory:
        """Return that listening begins now."""
        return SilenceMemory(wall_s)

    def look(self, memory: SilenceMemory, sight: Sight, beside: Beside) -> tuple[SilenceMemory, Found]:
        """Take what is heard, and judge the silence at the end of a pass."""
        match sight:
            case Samples(block=block) if block.stream == self.stream and len(block):
                return SilenceMemory(beside.wall_s), None
            case Complaint(fault=fault) if fault.stream == self.stream:
                return replace(memory, complaint=fault.what), None
            case PassOver():
                return evaluate_stream_silence(self, memory, beside.at_s, beside.wall_s)
        return memory, None

    def margin(self, memory: SilenceMemory, beside: Beside) -> Margin:
        """Return how long ago the stream was heard."""
        silent_s = beside.wall_s - memory.heard_s
        text = f"{silent_s:.1f} s ago, trips after {self.limit_s:g} s"
        name, label = f"silence {self.stream}", f"silence of {self.stream}"
        return Margin(name, label, text, silent_s / self.limit_s, self.action)


def evaluate_stream_silence(
    guard: SilenceGuard, memory: SilenceMemory, at_s: float, wall_s: float
) -> tuple[SilenceMemory, Trip | None]:
    """Judge the time since the last sample; it is said once until the stream is heard again."""
    silent_s = wall_s - memory.heard_s
    if memory.said or silent_s <= guard.limit_s:
        return memory, None
    why = memory.complaint or "nothing was received; check cable, power and port"
    return replace(memory, said=True), Trip(
        f"silence of {guard.stream}",
        guard.action,
        f"{guard.stream} has delivered nothing for {silent_s:.1f} s (limit {guard.limit_s:g} s): {why}",
        at_s,
        value=silent_s,
        limit=guard.limit_s,
        unit="s",
        stream=guard.stream,
        device_fault=guard.action is not Action.NOTE,
    )
