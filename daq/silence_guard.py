"""The guard of a stream that should deliver all the time: said when it falls silent, and why."""

from __future__ import annotations

from dataclasses import dataclass, replace

from bufferstand.daq.guards import Action, Trip


@dataclass(frozen=True)
class SilenceGuard:
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

    stream: str
    limit_s: float
    action: Action


@dataclass(frozen=True)
class SilenceMemory:
    """When it was heard last [s of the wall], what its driver complained of, and whether it was said."""

    heard_s: float
    complaint: str = ""
    said: bool = False


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
