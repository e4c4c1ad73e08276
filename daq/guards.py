"""Guards as data, and their evaluation as pure functions: observation in, verdict and memory out.

A guard never keeps anything itself: what it must remember from block to block is a small frozen record
that its evaluation takes and returns. The latch lies in :mod:`bufferstand.daq.panel`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import Literal

import numpy as np

from bufferstand.daq.scaling import ScaledBlock


class Action(IntEnum):
    """What a trip leads to; a higher one overrides a lower one."""

    NOTE = 0
    """Said and recorded; the campaign goes on."""
    STOP_AFTER_CYCLE = 1
    """The cycle under way ends, then the safe stop."""
    STOP = 2
    """Safe stop at once: hold, ramp to zero force, valve off."""
    EMERGENCY = 3
    """Safe stop at once without the hold: unload first."""


@dataclass(frozen=True)
class Trip:
    """A guard that tripped: who, what to do, and all that a person needs to understand it.

    Parameters
    ----------
    guard : str
        Name of the guard (``force``, ``temperature_1`` …).
    action : Action
        What it leads to.
    reason : str
        One sentence with value, limit, unit, sensor and place.
    at_s : float
        Host stand time at which it was noticed [s].
    value, limit : float or None
        The offending value and the limit, in ``unit``.
    unit : str
        Unit of both.
    stream : str
        The stream of the causing sample, empty if none caused it.
    sequence : int or None
        Absolute sequence number of the causing sample.
    time_us : int or None
        Its time stamp [µs].
    device_fault : bool
        True if a device or its wire failed (exit status 4), False for a limit or an operator (3).
    sensor, setting, doubt : str
        Of a signal that does not fit the others: its channel, where in the stand file to look, and what is
        wrong with it; empty for any other trip.
    """

    guard: str
    action: Action
    reason: str
    at_s: float
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    stream: str = ""
    sequence: int | None = None
    time_us: int | None = None
    device_fault: bool = False
    sensor: str = ""
    setting: str = ""
    doubt: str = ""

    def facts(self) -> dict[str, object]:
        """Return the trip as data of a run's event (only what is known)."""
        content: dict[str, object] = {"guard": self.guard, "action": self.action.name.lower()}
        for name in ("value", "limit", "sequence", "time_us"):
            number = getattr(self, name)
            if number is not None and math.isfinite(number):  # a run's event holds numbers only
                content[name] = number
        if self.unit:
            content["unit"] = self.unit
        for name in ("stream", "sensor", "setting", "doubt"):
            if getattr(self, name):
                content[name] = getattr(self, name)
        if self.device_fault:
            content["device_fault"] = True
        return content


def run_status(trip: Trip) -> Literal["stopped", "failed"]:
    """Return how a run ends that a trip stopped: ``failed`` where its last moment may be missing."""
    return "failed" if trip.guard in ("controller", "recorder", "internal") else "stopped"


# --- a channel that must stay between limits ---------------------------------------------------------


@dataclass(frozen=True)
class ChannelGuard:
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

    name: str
    signal: str
    upper: float | None
    lower: float | None
    unit: str
    label: str
    action: Action = Action.STOP
    hold_s: float = 0.0


@dataclass(frozen=True)
class ChannelMemory:
    """Since when (time stamp of the first sample, µs) the signal is beyond its limits without a break."""

    since_us: int | None = None


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
    if lower <= value.min() and value.max() <= upper:  # false for NaN, too
        return ChannelMemory(), None
    beyond = ~((value >= lower) & (value <= upper))
    index = np.arange(len(value))
    start = np.maximum.accumulate(np.where(beyond, -1, index)) + 1  # first row of the excess each row is in
    since = np.where(start < len(value), block.time_us[np.minimum(start, len(value) - 1)], 0)
    if memory.since_us is not None:
        since = np.where(start == 0, memory.since_us, since)
    tripped = np.flatnonzero(beyond & (block.time_us - since >= round(guard.hold_s * 1e6)))
    after = ChannelMemory(int(since[-1]) if beyond[-1] else None)
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
    )


# --- two ways to the same force ----------------------------------------------------------------------


WINDOWS_KEPT = 8
"""So many windows wait at most for the other stream; it may be silent for good."""


@dataclass(frozen=True)
class AgreementGuard:
    """The force through the controller and through its own amplifier must agree in the mean.

    Means over windows of the samples' own time are compared, because the two clocks differ by the wire's
    latency: at 1500 kN/s ten milliseconds are 15 kN that nothing is wrong with, and in the mean of 5 s
    it is a five-hundredth of it. What is left changes its sign from window to window; a wrong calibration
    does not.

    Parameters
    ----------
    tolerance_kN : float
        Largest difference of the two window means [kN].
    window_s : float
        Length of a window [s of stand time].
    windows : int
        So many windows in a row must disagree, all in the same direction.
    action : Action
        What that leads to.
    """

    tolerance_kN: float
    window_s: float = 5.0
    windows: int = 3
    action: Action = Action.NOTE


@dataclass(frozen=True)
class WindowSum:
    """Sum and number of the samples of a window."""

    total: float = 0.0
    count: int = 0


@dataclass(frozen=True)
class AgreementMemory:
    """Sums by signal and number of the window, the clocks' offset, and how many windows have disagreed.

    ``disagreed`` is negative where force is below force_2.
    """

    sums: Mapping[str, Mapping[int, WindowSum]] = field(default_factory=lambda: {"force": {}, "force_2": {}})
    offset_s: float = math.inf
    disagreed: int = 0


def evaluate_agreement(
    guard: AgreementGuard, memory: AgreementMemory, block: ScaledBlock, *, device_clock: bool
) -> tuple[AgreementMemory, Trip | None]:
    """Add a block of either stream; compare the means of a window that both have passed.

    Parameters
    ----------
    guard, memory, block
        What must hold, what was seen, what came.
    device_clock : bool
        Whether the block's time stamps are a device's own, to be mapped to the host's by the least delay
        seen so far.

    Returns
    -------
    tuple of AgreementMemory and Trip or None
        A trip when ``windows`` windows in a row have disagreed (then again after as many).
    """
    signal = "force" if "force" in block.values else "force_2"
    if signal not in block.values or not len(block):
        return memory, None
    if device_clock:
        memory = replace(
            memory, offset_s=min(memory.offset_s, block.received_s - int(block.time_us[-1]) / 1e6)
        )
    offset_s = memory.offset_s if device_clock else 0.0
    first, last = (
        math.floor((int(at_us) / 1e6 + offset_s) / guard.window_s)
        for at_us in (block.time_us[0], block.time_us[-1])
    )
    mine = dict(memory.sums[signal])
    number = None
    if first != last:  # most blocks lie in one window
        number = np.floor((block.time_us / 1e6 + offset_s) / guard.window_s).astype(np.int64)
    for window in range(first, last + 1):  # time never steps back within a block
        inside = block.values[signal] if number is None else block.values[signal][number == window]
        if not inside.size:
            continue
        before = mine.get(window, WindowSum())
        mine[window] = WindowSum(before.total + float(inside.sum()), before.count + len(inside))
    newest = dict(sorted(mine.items())[-WINDOWS_KEPT:])
    memory = replace(memory, sums={**memory.sums, signal: newest})
    if not memory.sums["force"] or not memory.sums["force_2"]:
        return memory, None
    return _compare_windows(guard, memory, block)


def _compare_windows(
    guard: AgreementGuard, memory: AgreementMemory, block: ScaledBlock
) -> tuple[AgreementMemory, Trip | None]:
    """Compare every window before the one that the slower stream is in, and forget it."""
    one, two = memory.sums["force"], memory.sums["force_2"]
    present = min(max(one), max(two))
    disagreed, trip = memory.disagreed, None
    for window in sorted(one.keys() & two.keys()):
        if window >= present:
            break
        difference_kN = one[window].total / one[window].count - two[window].total / two[window].count
        sign = 0 if abs(difference_kN) <= guard.tolerance_kN else int(math.copysign(1, difference_kN))
        disagreed = sign if disagreed * sign <= 0 else disagreed + sign
        if abs(disagreed) >= guard.windows:
            trip, disagreed = _disagreement(guard, difference_kN, block), 0
    kept = {
        name: {window: total for window, total in sums.items() if window >= present}
        for name, sums in memory.sums.items()
    }
    return replace(memory, sums=kept, disagreed=disagreed), trip


def _disagreement(guard: AgreementGuard, difference_kN: float, block: ScaledBlock) -> Trip:
    return Trip(
        "agreement",
        guard.action,
        f"force and force_2 (its own amplifier) differ by {difference_kN:+.2f} kN in the mean of "
        f"{guard.window_s:g} s, {guard.windows} times in a row (tolerance {guard.tolerance_kN:g} kN): "
        "check both calibrations and zeros",
        block.received_s,
        value=difference_kN,
        limit=guard.tolerance_kN,
        unit="kN",
        stream=block.stream,
        sequence=block.first_sequence,
    )
