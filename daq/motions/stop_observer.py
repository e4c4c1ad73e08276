"""What a stop must see of the samples: does the piston go on, and what force is left, by which channel."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.acquisition import Acquisition
from bufferstand.daq.guards import CONTROLLER_STREAM
from bufferstand.daq.guards.wiring.forces import apart_at_rest
from bufferstand.daq.motions.release_bound import contact_of
from bufferstand.daq.scaling import FORCES, ScaledBlock
from bufferstand.foundation.channels import Channel

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
_WRAP, _HALF = 1 << 32, 1 << 31


@dataclass
class _Mark:
    """An instant of the controller's clock: by its tick, and by the stamps of its samples once that is known.

    Without a tick it is the newest sample of the first pass behind it that leaves nothing unread.
    """

    tick_us: int | None
    stamp_s: float | None = None


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
    beside : str
        That both ways to the force do not agree, and where to look; empty where they do.
    silent : tuple of str
        Channels of force that show nothing of the present.
    """

    force_kN: float
    channel: str
    tared: bool
    other_kN: tuple[tuple[str, float], ...] = ()
    broken: tuple[str, ...] = ()
    beside: str = ""
    silent: tuple[str, ...] = ()

    @property
    def source(self) -> str:
        """Where it comes from, for a person."""
        others = "".join(f"; {name} shows {value_kN:.1f} kN" for name, value_kN in self.other_kN)
        broken = "".join(f"; {name} shows what cannot be" for name in self.broken)
        silent = "".join(f"; {name} shows nothing of the present" for name in self.silent)
        zero = "zero taken off" if self.tared else "no zero taken off"
        return f"channel {self.channel}, {zero}{others}{broken}{silent}"


class StopObserver(Protocol):
    """What the safe stop sees of the samples (:class:`SampleObserver`)."""

    def told(self) -> None:
        """A command that stops goes out now."""
        ...

    def done(self, taken_us: int | None) -> None:
        """The controller has taken it, at this time of its clock: samples from before tell nothing of it."""
        ...

    def goes_on(self, stopping_s: float = 0.0) -> str:
        """Return how the piston goes on toward more force nevertheless, empty if it does not."""
        ...

    def since(self, tick_us: int | None) -> None:
        """Judge the force by samples from after the present, at which the controller's clock shows this."""
        ...

    def force(self) -> ForceSeen | None:
        """Return the force that is left, by the best channel; None without fresh samples."""
        ...

    def stroke_mm(self) -> float | None:
        """Return the specimen's stroke [mm], its zero taken off; None without fresh samples."""
        ...

    def contact_mm(self) -> float | None:
        """Return where the piston touches the specimen, by its own zero [mm]; None where none was found."""
        ...


class ControllerReadingOnly:
    """Without samples: the controller's own reading is all there is."""

    def told(self) -> None:
        """Remember nothing."""

    def done(self, taken_us: int | None) -> None:
        """Look at nothing."""

    def goes_on(self, stopping_s: float = 0.0) -> str:  # noqa: ARG002 - as Eyes
        """Return that nothing goes on, as far as is seen."""
        return ""

    def since(self, tick_us: int | None) -> None:
        """Judge nothing."""

    def force(self) -> ForceSeen | None:
        """Return that no sample shows the force."""
        return None

    def stroke_mm(self) -> float | None:
        """Return that no sample shows the stroke."""
        return None

    def contact_mm(self) -> float | None:
        """Return that no first contact is known."""
        return None


class SampleObserver:
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
        self._newest: dict[str, tuple[float, NDArray[np.float64], NDArray[np.float64]]] = {}
        self._rows: deque[NDArray[np.float64]] = deque()
        self._from_mm_per_s = 0.0
        self._done = _Mark(None, 0.0)
        self._done_kN: float | None = None
        self._since = _Mark(None, -math.inf)
        self._since_host_s = -math.inf
        acquisition.observers.append(self.take)

    def take(self, block: ScaledBlock) -> None:
        """Keep a block: newest samples of its force channels and of the stroke, and the piston's way."""
        if not len(block):
            return
        time_s = block.time_us / 1e6
        for channel in self._force_channels(block.stream):
            if channel.name in block.values:
                self._newest[channel.name] = block.received_s, time_s, block.values[channel.name]
        if block.stream == CONTROLLER_STREAM and "stroke" in block.values:
            self._newest["stroke"] = block.received_s, time_s, block.values["stroke"]
        if block.stream == CONTROLLER_STREAM and {"position", "force"} <= block.values.keys():
            self._rows.append(np.column_stack((time_s, block.values["position"], block.values["force"])))
            while len(self._rows) > 1 and self._rows[0][-1, 0] < time_s[-1] - KEPT_S:
                self._rows.popleft()

    # --- does it go on? -----------------------------------------------------------------------------

    def told(self) -> None:
        """Remember the piston's speed: it is being told to stop."""
        speed_mm_per_s = abs(self._look()[1])
        self._from_mm_per_s = speed_mm_per_s if math.isfinite(speed_mm_per_s) else 0.0

    def done(self, taken_us: int | None) -> None:
        """Look from now on whether it goes on: the controller has taken the command.

        Parameters
        ----------
        taken_us : int or None
            Its clock then [µs, modulo 2³²]: samples from before, which may come late, tell nothing of what it
            does since. None where it shows none.
        """
        self._done, self._done_kN = self._mark(taken_us), None

    def _mark(self, tick_us: int | None) -> _Mark:
        """Return the present instant, at which the controller's clock shows a tick."""
        polled = self._acquisition.facts[CONTROLLER_STREAM].clock != "device"
        return _Mark(None, self._acquisition.clock.now_s()) if polled else _Mark(tick_us)

    def _stamp_s(self, mark: _Mark) -> float | None:
        """Return an instant by the stamps of the samples [s], None while it is not known."""
        if mark.stamp_s is None and self._rows:
            newest_s = float(self._rows[-1][-1, 0])
            if mark.tick_us is not None:
                newest_us = round(newest_s * 1e6)
                mark.stamp_s = (newest_us + (mark.tick_us - newest_us + _HALF) % _WRAP - _HALF) / 1e6
            elif self._acquisition.up_to_date:
                mark.stamp_s = newest_s
        return mark.stamp_s

    def goes_on(self, stopping_s: float = 0.0) -> str:
        """Return how the piston goes on toward more force though it was told to stop, empty if it does not.

        Toward more force is compression: a piston that draws back takes force away.
        It may still settle for ``SETTLE_S``: behind a turn a piston that lags its command has yet to reach
        the speed that it stops from. Where the controller slows a running sine down (a hold of it), at an
        even rate, it may do so for ``stopping_s`` [s]. It is asked after every pass.
        """
        done_s = self._stamp_s(self._done)
        if done_s is None:
            return ""
        at_s, speed_mm_per_s, force_kN = self._look()
        after_s = at_s - done_s
        if after_s <= 0.0:  # it was told while these samples were waiting
            self._from_mm_per_s = max(self._from_mm_per_s, abs(speed_mm_per_s))
        if after_s < WINDOW_S:
            return ""
        if self._done_kN is None:
            self._done_kN = force_kN
        if after_s < SETTLE_S + WINDOW_S:
            self._from_mm_per_s = max(self._from_mm_per_s, speed_mm_per_s)
            return ""
        braking = max(0.0, 1.0 - after_s / stopping_s) if stopping_s > 0.0 else 0.0
        allowed = max((SHARE_LEFT + braking) * self._from_mm_per_s, LEAST_MM_PER_S)
        # What is no number shows no standstill: the other one alone decides then, and neither of neither.
        known = not (math.isnan(speed_mm_per_s) and math.isnan(force_kN))
        stands = speed_mm_per_s <= allowed or force_kN - self._done_kN <= LEAST_RISE_KN
        if known and not stands:
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

    def since(self, tick_us: int | None) -> None:
        """Judge the force from now on by what is sampled after the present.

        Parameters
        ----------
        tick_us : int or None
            What the controller's clock shows, as ``taken_us`` of :meth:`done`.
        """
        self._since, self._since_host_s = self._mark(tick_us), self._acquisition.clock.now_s()

    def force(self) -> ForceSeen | None:
        """Return the force by the freshly sampled channel whose zero is known best; None without one.

        Fresh is what came within ``FRESH_S`` and was sampled after the instant of :meth:`since`.
        """
        zero = self._acquisition.zero
        there = [(one, stream) for stream in self._acquisition.facts for one in self._force_channels(stream)]
        shown = {
            channel.name: (
                math.inf if channel.uncertainty.zero is None else channel.uncertainty.zero,
                value_kN,
            )
            for channel, stream in there
            for value_kN in self._fresh_mean(stream, channel.name)
        }
        true = {name: one for name, one in shown.items() if abs(one[1]) <= self._most_kN}
        if not true:
            return None
        best = min(true, key=lambda name: true[name][0])  # the controller's own where they are equal
        best_kN = true[best][1]
        tared = zero is not None and all(zero.of(name) is not None for name in true)
        first, second = (true.get(name, (0.0, None))[1] for name in FORCES)
        return ForceSeen(
            best_kN,
            best,
            zero is not None and zero.of(best) is not None,
            tuple((name, kN) for name, (_, kN) in true.items() if abs(kN - best_kN) > APART_KN),
            tuple(shown.keys() - true.keys()),
            "" if first is None else apart_at_rest(first, second, counted=tared),
            tuple(channel.name for channel, _ in there if channel.name not in shown),
        )

    def stroke_mm(self) -> float | None:
        """Return the specimen's stroke [mm] with its zero taken off; None without fresh samples."""
        return next(self._fresh_mean(CONTROLLER_STREAM, "stroke"), None)

    def contact_mm(self) -> float | None:
        """Return where the piston touched the specimen, by its own zero [mm]; None where none was found."""
        return contact_of(self._acquisition.zero)

    def _fresh_mean(self, stream: str, name: str) -> Iterator[float]:
        """Yield the mean of a channel's newest samples, if they are fresh."""
        received_s, time_s, values = self._newest.get(name, (-math.inf, np.empty(0), np.empty(0)))
        if self._acquisition.clock.now_s() - received_s > FRESH_S:
            return
        since_s: float | None = -math.inf
        if stream == CONTROLLER_STREAM:
            since_s = self._stamp_s(self._since)
        elif received_s <= self._since_host_s:
            return
        if since_s is not None and time_s[-1] > since_s:
            yield float(np.mean(values[time_s > max(time_s[-1] - WINDOW_S, since_s)]))

    def _force_channels(self, stream: str) -> list[Channel]:
        facts = self._acquisition.facts.get(stream)
        return [] if facts is None else [one for one in facts.channels if one.quantity == "force"]
