"""The guard of the two ways to the force: of the controller, and ``force_2``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

import numpy as np

from bufferstand.daq.guards.guard import Beside, Found, Guard
from bufferstand.daq.guards.margin import Margin
from bufferstand.daq.guards.sights import Samples, Sight
from bufferstand.daq.guards.site import CONTROLLER_STREAM, Site
from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.daq.scaling import ScaledBlock

WINDOWS_KEPT = 8
"""So many windows wait at most for the other stream; it may be silent for good."""


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
    difference_kN: float | None = None
    """Of the means of the last window that both have passed."""


@dataclass(frozen=True)
class AgreementGuard(Guard[AgreementMemory]):
    """The force through the controller and through ``force_2`` must agree in the mean.

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

    kind: ClassVar = "agreement"
    title: ClassVar = "both ways to the force agree"
    settings: ClassVar = ("guards.agreement_kN", "guards.action.agreement")
    facts_as: ClassVar = "one"
    docs: ClassVar = ("`agreement`",)
    looks_at: ClassVar = (Samples,)
    turn: ClassVar = 110
    remembers: ClassVar = AgreementMemory
    of_zero: ClassVar = True

    tolerance_kN: float
    window_s: float = 5.0
    windows: int = 3
    action: Action = Action.NOTE

    @classmethod
    def made_for(cls, site: Site) -> Iterable[Self]:
        """Return it where there is a second way."""
        channels = site.stand.controller.facts.channels
        others = (one for facts in site.sensors.values() for one in facts.channels)
        if any(one.name == "force_2" for one in (*channels, *others)):
            yield cls(site.table.agreement_kN, action=site.does("agreement"))

    def look(self, memory: AgreementMemory, sight: Sight, beside: Beside) -> tuple[AgreementMemory, Found]:
        """Add a block of either stream."""
        if not isinstance(sight, Samples):
            return memory, None
        if sight.block.stream != CONTROLLER_STREAM and "force_2" not in sight.block.values:
            return memory, None
        device_clock = sight.block.stream == CONTROLLER_STREAM
        return evaluate_agreement(self, memory, sight.block, device_clock=device_clock)

    def margin(self, memory: AgreementMemory, beside: Beside) -> Margin:
        """Return the difference of the last window."""
        label, action = "agreement of both forces", self.action
        if memory.difference_kN is None:
            text = f"mean difference of both forces at most {self.tolerance_kN:g} kN"
            return Margin("agreement", label, text, None, action)
        text = f"mean difference {memory.difference_kN:+.2f} of {self.tolerance_kN:g} kN"
        return Margin("agreement", label, text, abs(memory.difference_kN) / self.tolerance_kN, action)


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
    there = [signal for signal in memory.sums if signal in block.values]
    if not there or not len(block):
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
    number, windows = None, [first]
    if first != last:  # most blocks lie in one window
        number = np.floor((block.time_us / 1e6 + offset_s) / guard.window_s).astype(np.int64)
        windows = np.unique(number).tolist()  # time stamps of a damaged journal may be years apart
    for signal in there:
        mine = dict(memory.sums[signal])
        for window in windows:
            inside = block.values[signal] if number is None else block.values[signal][number == window]
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
    disagreed, trip, difference_kN = memory.disagreed, None, memory.difference_kN
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
    return replace(memory, sums=kept, disagreed=disagreed, difference_kN=difference_kN), trip


def _disagreement(guard: AgreementGuard, difference_kN: float, block: ScaledBlock) -> Trip:
    return Trip(
        "agreement",
        guard.action,
        f"force and force_2 (the second way to it) differ by {difference_kN:+.2f} kN in the mean of "
        f"{guard.window_s:g} s, {guard.windows} times in a row (tolerance {guard.tolerance_kN:g} kN): "
        "check both calibrations and zeros",
        block.received_s,
        value=difference_kN,
        limit=guard.tolerance_kN,
        unit="kN",
        stream=block.stream,
        sequence=block.first_sequence,
    )
