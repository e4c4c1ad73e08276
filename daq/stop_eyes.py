"""What a stop must see of the samples: does the piston go on, and what force is left, by which channel."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.acquisition import Acquisition
from daq.panel import CONTROLLER_STREAM
from daq.scaling import ScaledBlock
from foundation.channel import Channel

WINDOW_S = 0.015
"""Speed and force are means over so long [s]: a block of a ring at 1 kHz; three samples at least."""
SETTLE_S = 0.03
"""An actuator of 15 Hz has lost nine tenths of its speed so long after its command stands [s]."""
SHARE_LEFT = 0.5
"""More than this share of the speed that it stops from is no settling."""
LEAST_MM_PER_S = 2.0
"""Slower is not told from an encoder's noise within the window."""
LEAST_RISE_KN = 1.0
"""Less is noise of the force."""
FRESH_S = 0.5
"""A channel without a sample for so long says nothing of the present [s of stand time]."""
APART_KN = 6.0
"""Two force channels that differ by more do not show the same force: the threshold of the agreement guard."""
KEPT_S = 0.2
BLOCKS_KEPT = 50
"""Blocks by whose quickest it is told when a sample of the present will come."""


@dataclass(frozen=True)
class ForceSeen:
    """The force that is left, by the best channel there is.

    Parameters
    ----------
    force_kN : float
        Mean of its newest samples.
    channel : str
        Its name.
    tared : bool
        Whether a zero of this specimen on this stand is taken off.
    other_kN : tuple of (str, float)
        Other channels of force that show another one, with what they show.
    broken : tuple of str
        Channels of force that show what cannot be.
    """

    force_kN: float
    channel: str
    tared: bool
    other_kN: tuple[tuple[str, float], ...] = ()
    broken: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Where it comes from, for a person."""
        others = "".join(f"; {name} shows {value_kN:.1f} kN" for name, value_kN in self.other_kN)
        broken = "".join(f"; {name} shows what cannot be" for name in self.broken)
        zero = "zero taken off" if self.tared else "no zero taken off"
        return f"channel {self.channel}, {zero}{others}{broken}"


class StopEyes:
    """Looks at the samples for the safe stop.

    Parameters
    ----------
    acquisition : Acquisition
        Its passes bring the samples; its zero is taken off them.
    force_max_kN : float
        Greatest force of the stand: a channel that shows half as much again is broken.
    """

    def __init__(self, acquisition: Acquisition, force_max_kN: float) -> None:
        self._acquisition = acquisition
        self._most_kN = 1.5 * force_max_kN
        self._newest: dict[str, tuple[float, float]] = {}
        self._rows: deque[NDArray[np.float64]] = deque()
        self._behind_s: deque[float] = deque(maxlen=BLOCKS_KEPT)
        self._stroke = -math.inf, 0.0
        self._from_mm_per_s = 0.0
        self._done_s = 0.0
        self._done_kN: float | None = None
        acquisition.observers.append(self.take)

    def take(self, block: ScaledBlock) -> None:
        """Keep a block: newest means of its force channels and of the stroke, and the piston's way."""
        if not len(block):
            return
        time_s = block.time_us / 1e6
        for channel in self._force_channels(block.stream):
            if channel.name in block.values:
                recent = block.values[channel.name][time_s > time_s[-1] - WINDOW_S]
                self._newest[channel.name] = block.received_s, float(np.mean(recent))
        if block.stream == CONTROLLER_STREAM and "stroke" in block.values:
            recent = block.values["stroke"][time_s > time_s[-1] - WINDOW_S]
            self._stroke = block.received_s, float(np.mean(recent))
        if block.stream == CONTROLLER_STREAM and {"position", "force"} <= block.values.keys():
            self._behind_s.append(block.received_s - float(time_s[-1]))
            self._rows.append(np.column_stack((time_s, block.values["position"], block.values["force"])))
            while len(self._rows) > 1 and self._rows[0][-1, 0] < time_s[-1] - KEPT_S:
                self._rows.popleft()

    # --- does it go on? -----------------------------------------------------------------------------

    def told(self) -> None:
        """Remember the piston's speed: it is being told to stop."""
        self._from_mm_per_s = abs(self._look()[1])

    def done(self) -> None:
        """Look from now on whether it goes on: the controller has taken the command."""
        behind_s = min(self._behind_s, default=math.inf)  # of the controller's clock and the quickest way
        self._done_s, self._done_kN = self._acquisition.clock.now_s() - behind_s, None

    def goes_on(self, stopping_s: float = 0.0) -> str:
        """Return how the piston goes on toward more force though it was told to stop, empty if it does not.

        Toward more force is compression: a piston that draws back takes force away.
        It may still settle for ``SETTLE_S``: behind a turn a piston that lags its command has yet to reach
        the speed that it stops from. Where the controller slows a running sine down (a hold of it), at an
        even rate, it may do so for ``stopping_s`` [s]. It is asked after every pass.
        """
        at_s, speed_mm_per_s, force_kN = self._look()
        after_s = at_s - self._done_s
        if after_s < WINDOW_S:
            return ""
        if self._done_kN is None:
            self._done_kN = force_kN
        if after_s < SETTLE_S + WINDOW_S:
            self._from_mm_per_s = max(self._from_mm_per_s, speed_mm_per_s)
            return ""
        braking = max(0.0, 1.0 - after_s / stopping_s) if stopping_s > 0.0 else 0.0
        allowed = max((SHARE_LEFT + braking) * self._from_mm_per_s, LEAST_MM_PER_S)
        if speed_mm_per_s > allowed and force_kN - self._done_kN > LEAST_RISE_KN:
            return f"the piston went on toward more force ({speed_mm_per_s:.1f} mm/s)"
        return ""

    def _look(self) -> tuple[float, float, float]:
        """Return newest time [s], speed [mm/s] and force [kN] by the samples of the last window."""
        if not self._rows:
            return 0.0, 0.0, 0.0
        rows = np.concatenate(self._rows)
        recent = rows[(rows[:, 0] > rows[-1, 0] - WINDOW_S) | (np.arange(len(rows)) >= len(rows) - 3)]
        time_s = recent[:, 0] - recent[:, 0].mean()
        square = float(time_s @ time_s)
        speed = float(time_s @ recent[:, 1]) / square if square > 0.0 else 0.0
        return float(rows[-1, 0]), speed, float(recent[:, 2].mean())

    # --- what is left? ------------------------------------------------------------------------------

    def force(self) -> ForceSeen | None:
        """Return the force by the freshly sampled channel whose zero is known best; None without one."""
        now_s, zero = self._acquisition.clock.now_s(), self._acquisition.zero
        shown = {
            channel.name: (
                math.inf if channel.uncertainty.zero is None else channel.uncertainty.zero,
                value_kN,
            )
            for stream in self._acquisition.facts
            for channel in self._force_channels(stream)
            for at_s, value_kN in [self._newest.get(channel.name, (-math.inf, 0.0))]
            if now_s - at_s <= FRESH_S
        }
        true = {name: one for name, one in shown.items() if abs(one[1]) <= self._most_kN}
        if not true:
            return None
        best = min(true, key=lambda name: true[name][0])  # the controller's own where they are equal
        best_kN = true[best][1]
        return ForceSeen(
            best_kN,
            best,
            zero is not None and zero.of(best) is not None,
            tuple((name, kN) for name, (_, kN) in true.items() if abs(kN - best_kN) > APART_KN),
            tuple(shown.keys() - true.keys()),
        )

    def stroke_mm(self) -> float | None:
        """Return the specimen's stroke [mm] with its zero taken off; None without fresh samples."""
        at_s, stroke_mm = self._stroke
        return stroke_mm if self._acquisition.clock.now_s() - at_s <= FRESH_S else None

    def _force_channels(self, stream: str) -> list[Channel]:
        facts = self._acquisition.facts.get(stream)
        return [] if facts is None else [one for one in facts.channels if one.quantity == "force"]
