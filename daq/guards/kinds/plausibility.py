"""The guard of the controller's transducers: readings that cannot be true stop the stand.

A broken draw wire or a saturated amplifier shows a steady value that no limit need catch. What a channel can
show is stated with it (``plausible`` in the stand file); without that, nothing is judged here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Samples, Sight
from bufferstand.daq.guards.site import CONTROLLER_STREAM
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers import SampleBlock, StreamFacts
from bufferstand.foundation.channels import Channel, ImplausibleSamples, PlausibilityWatch

HOLD_S = 0.05
"""An end of the range or an overload must last this long [s]: one bad sample is none."""
NOTES_APART_S = 1.0
"""Jumps of one channel are noted at most this often [s]."""


@dataclass
class _Seen:
    """What a channel has shown: bad samples in a row by kind, and when a jump was last noted."""

    watch: PlausibilityWatch
    in_a_row: dict[str, int]
    noted_s: float = float("-inf")


class PlausibilityGuard:
    """Looks at each channel of a stream that states what it can show; remembers from block to block.

    Parameters
    ----------
    facts : StreamFacts
        The controller's.
    """

    def __init__(self, facts: StreamFacts) -> None:
        self._hold = max(1, round(HOLD_S * facts.rate_Hz))
        self._channels = {
            channel.name: channel for channel in facts.channels if channel.plausible is not None
        }
        self._seen = {
            name: _Seen(PlausibilityWatch(channel, facts.raw_unit(name)), {})
            for name, channel in self._channels.items()
        }

    def look(self, block: SampleBlock, scaled: ScaledBlock) -> list[Trip]:
        """Return what a block shows: a stop for a transducer that has failed, a note for a jump."""
        trips: list[Trip] = []
        for name, channel in self._channels.items():
            if name not in block.counts or not len(scaled):
                continue
            seen = self._seen[name]
            found = seen.watch.look(block.time_us, block.counts[name], scaled.values[name])
            for kind in ("counts", "overload"):
                trips += self._lasting(
                    [one for one in found if one.kind == kind], kind, seen, channel, scaled
                )
            jumps = [one for one in found if one.kind == "rate"]
            if jumps and scaled.received_s - seen.noted_s >= NOTES_APART_S:
                seen.noted_s = scaled.received_s
                trips.append(self._trip(jumps[0], channel, scaled, Action.NOTE))
        return trips

    def _lasting(
        self, found: list[ImplausibleSamples], kind: str, seen: _Seen, channel: Channel, scaled: ScaledBlock
    ) -> list[Trip]:
        """Return a stop when a state has lasted for long enough, counting on from the block before."""
        before = seen.in_a_row.get(kind, 0)
        seen.in_a_row[kind] = 0
        for one in found:
            in_a_row = one.samples + (before if one.first == 0 else 0)
            if one.first + one.samples == len(scaled):
                seen.in_a_row[kind] = in_a_row
            if in_a_row >= self._hold:
                return [self._trip(one, channel, scaled, Action.EMERGENCY)]
        return []

    @staticmethod
    def _trip(one: ImplausibleSamples, channel: Channel, scaled: ScaledBlock, action: Action) -> Trip:
        return Trip(
            f"plausibility of {channel.name}",
            action,
            one.what,
            scaled.received_s,
            value=float(scaled.values[channel.name][one.first]),
            unit=channel.unit,
            stream=scaled.stream,
            sequence=scaled.first_sequence + one.first,
            time_us=int(scaled.time_us[one.first]),
            device_fault=action is not Action.NOTE,
        )


@dataclass(frozen=True)
class TransducerGuard(Guard["PlausibilityGuard | None"]):
    """The controller's transducers must read what they can; their channels state that."""

    kind: ClassVar = "plausibility"
    title: ClassVar = "transducers whose readings cannot be true"
    settings: ClassVar = ()
    facts_as: ClassVar = "none"
    docs: ClassVar = ("`plausibility of …`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 1
    in_journal: ClassVar = False
    lasting: ClassVar = True
    standing: ClassVar = True

    def look(
        self, memory: PlausibilityGuard | None, sight: Sight, beside: Beside
    ) -> tuple[PlausibilityGuard | None, Found]:
        """Judge the counts of a block of the controller."""
        if not isinstance(sight, Samples) or sight.block.stream != CONTROLLER_STREAM:
            return memory, None
        if sight.raw is None or sight.facts is None:
            return memory, None
        memory = memory or PlausibilityGuard(sight.facts)
        return memory, memory.look(sight.raw, sight.block)

    def margin(self, memory: PlausibilityGuard | None, beside: Beside) -> Margin:
        """Return what it watches for."""
        text = f"readings must be possible; an end of the range counts after {HOLD_S * 1e3:g} ms"
        return Margin("plausibility", "plausibility of transducers", text, None, Action.EMERGENCY)
