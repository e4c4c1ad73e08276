"""The guard of a channel that must stay between two limits: force, stroke, tilt and following error."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin, Peaks
from bufferstand.daq.guards.sights import Phase, Samples, Sight
from bufferstand.daq.guards.site import Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

DEFAULT_TILT_MM = 5.0
"""Where neither the campaign nor the stand file states a tilt."""
WIRES_AT_REST = ("stroke", "tilt")
"""Signals of the draw wires, which mean nothing before their zero is known."""


@dataclass(frozen=True)
class ChannelMemory:
    """What a signal has shown: since when it is beyond its limits, and its extremes of late."""

    since_us: int | None = None
    """Time stamp of the first sample of an excess without a break [µs]."""
    peaks: Peaks = field(default_factory=Peaks)


@dataclass(frozen=True)
class ChannelGuard(Guard[ChannelMemory]):
    """A signal of the controller's samples that must stay between two limits; every sample counts.

    Parameters
    ----------
    name : str
        Name of the guard.
    signal : str
        Channel or derived signal of :class:`bufferstand.daq.scaling.ScaledBlock`.
    upper, lower : float or None
        Limits in ``unit``; a sample beyond one of them, or no number at all, is an excess.
    unit : str
        Unit of the signal.
    label : str
        What a person calls it, with its sensor and place.
    action : Action
        What the trip leads to.
    hold_s : float
        The excess must last this long [s of device time]; 0 trips at the first sample.
    """

    kind: ClassVar = "channels"
    title: ClassVar = "force, stroke, tilt and following error between their limits"
    settings: ClassVar = (
        "limits.force_trip_kN", "guards.force_below_kN", "guards.action.force",
        "limits.stroke_trip_mm", "guards.stroke_below_mm", "guards.action.stroke",
        "guards.tilt_max_mm", "guards.tilt_hold_s", "guards.action.tilt",
        "limits.following_error_max_mm", "limits.following_error_grace_s", "guards.action.following_error",
    )  # fmt: skip
    facts_as: ClassVar = "list"
    docs: ClassVar = ("`force`", "`stroke`", "`tilt`", "`following error`")
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 70
    remembers: ClassVar = ChannelMemory
    of_zero: ClassVar = True

    name: str
    signal: str
    upper: float | None
    lower: float | None
    unit: str
    label: str
    action: Action = Action.STOP
    hold_s: float = 0.0

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return the four of every stand; of one with a single draw wire, which shows no tilt, three.

        A force that an acquisition device measures beside the controller has the controller's limits.
        """
        table, limits = site.table, site.limits
        tilt_mm = table.tilt_max_mm or site.stand_tilt_mm or DEFAULT_TILT_MM
        error_mm = limits.following_error_max_mm
        yield cls(
            "force",
            "force",
            site.envelope.force_trip_kN,
            -table.force_below_kN,
            "kN",
            "force (transducer of the controller)",
            site.does("force"),
        )
        forces = [
            one.name
            for facts in site.acquisition.values()
            for one in facts.channels
            if one.quantity == "force"
        ]
        for name in forces:
            yield cls(
                f"{name} of the acquisition device",
                name,
                site.envelope.force_trip_kN,
                -table.force_below_kN,
                "kN",
                f"{name} (transducer of the acquisition device)",
                site.does("force"),
            )
        yield cls(
            "stroke",
            "stroke",
            site.envelope.stroke_trip_mm,
            -table.stroke_below_mm,
            "mm",
            "stroke (mean of the draw wires on the specimen)",
            site.does("stroke"),
        )
        wires = sum(one.quantity == "stroke" for one in site.stand.controller.facts.channels)
        if wires > 1:
            pair = "stroke_1 − stroke_2" if wires == 2 else "largest difference of two draw wires"
            does = site.does("tilt")
            yield cls("tilt", "tilt", tilt_mm, -tilt_mm, "mm", f"tilt ({pair})", does, table.tilt_hold_s)
        yield cls(
            "following error",
            "following_error",
            error_mm,
            -error_mm,
            "mm",
            "following error (command − position)",
            site.does("following_error"),
            limits.following_error_grace_s,
        )

    @property
    def key(self) -> str:
        """Return its name."""
        return self.name

    def look(self, memory: ChannelMemory, sight: Sight, beside: Beside) -> tuple[ChannelMemory, Found]:
        """Judge every sample of a block that has the signal."""
        return evaluate_channel(self, memory, sight.block) if isinstance(sight, Samples) else (memory, None)

    def during(self, phase: Phase) -> Self | None:
        """Return it where its signal means something."""
        follows = phase is Phase.VALVE_OFF and self.signal == "following_error"
        wire = phase is Phase.FIRST_LOOK and self.signal in WIRES_AT_REST
        return None if follows or wire else self

    def margin(self, memory: ChannelMemory, beside: Beside) -> Margin:
        """Return the extreme of late that came nearest to its limit."""
        span, action = memory.peaks.span(), self.action
        if span is None:
            return Margin(self.name, self.label, "no value", None, action)
        sides = [
            (value / limit, value, limit)
            for value, limit in zip(span, (self.lower, self.upper), strict=True)
            if limit
        ]
        if not sides:
            return Margin(self.name, self.label, f"{span[1]:.2f} {self.unit}", None, action)
        share, value, limit = max(sides)
        left = abs(limit - value) if share < 1.0 else 0.0
        text = f"{value:.1f} of {limit:g} {self.unit}, {left:.1f} left"
        return Margin(self.name, self.label, text, max(0.0, share), action)


def evaluate_channel(
    guard: ChannelGuard, memory: ChannelMemory, block: ScaledBlock
) -> tuple[ChannelMemory, Trip | None]:
    """Judge every sample of a block.

    Returns
    -------
    tuple of ChannelMemory and Trip or None
        The trip names the first sample at which the excess had lasted ``hold_s``; a block without the
        signal (or without samples) changes nothing.
    """
    value = block.values.get(guard.signal)
    if value is None or not len(value):
        return memory, None
    lower = -np.inf if guard.lower is None else guard.lower
    upper = np.inf if guard.upper is None else guard.upper
    least, greatest = float(value.min()), float(value.max())
    peaks = memory.peaks
    if math.isfinite(least) and math.isfinite(greatest):
        peaks = peaks.seen(block.received_s, least, greatest)
    if lower <= least and greatest <= upper:  # false for NaN, too
        unchanged = memory.since_us is None and peaks is memory.peaks
        return memory if unchanged else ChannelMemory(None, peaks), None
    beyond = ~((value >= lower) & (value <= upper))
    index = np.arange(len(value))
    start = np.maximum.accumulate(np.where(beyond, -1, index)) + 1  # first row of the excess each row is in
    since = np.where(start < len(value), block.time_us[np.minimum(start, len(value) - 1)], 0)
    if memory.since_us is not None:
        since = np.where(start == 0, memory.since_us, since)
    tripped = np.flatnonzero(beyond & (block.time_us - since >= round(guard.hold_s * 1e6)))
    after = ChannelMemory(int(since[-1]) if beyond[-1] else None, peaks)
    if not len(tripped):
        return after, None
    return after, _excess(guard, block, int(tripped[0]))


def _excess(guard: ChannelGuard, block: ScaledBlock, row: int) -> Trip:
    value = float(block.values[guard.signal][row])
    over = guard.upper is not None and not value <= guard.upper
    limit = guard.upper if over else guard.lower
    sequence, time_us = block.first_sequence + row, int(block.time_us[row])
    where = f"sample {sequence} at {time_us / 1e6:.3f} s of the device's clock"
    if np.isnan(value):
        said = f"{guard.label} is not a number"
    else:
        said = (
            f"{guard.label} {value:.2f} {guard.unit} {'exceeds' if over else 'is below'} "
            f"the limit of {limit:.2f} {guard.unit}"
        )
    if guard.hold_s:
        said += f" for {guard.hold_s:g} s"
    return Trip(
        guard.name,
        guard.action,
        f"{said} ({where})",
        block.received_s,
        value=None if np.isnan(value) else value,
        limit=limit,
        unit=guard.unit,
        stream=block.stream,
        sequence=sequence,
        time_us=time_us,
        believed=True,
    )
