"""Measures a cycle of a sine: turns of specimen, piston and command, and the forces there."""

from __future__ import annotations

import cmath
import math
from bisect import bisect_left, bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.daq.strokes.turning_points import StrokeTurns
from bufferstand.protocols.prediction import Sine

Floats = NDArray[np.float64]

HARMONICS = 8
"""Multiples of the frequency that a channel is fitted with: a hysteresis' kinks fade as 1/k²."""
MOST_SAMPLES = 1000
"""Samples of a cycle that are fitted at most, evenly chosen."""
FEWEST_SAMPLES = 12
EDGE_SAMPLES = 2.0
"""A period is whole where its first and last sample are so near to its ends."""
GAP_SHARE = 0.01
"""A hole of so much of a period is bridged: at a crest that makes 0.05 % of the amplitude."""
PURE_SHARE, PURE_MM = 0.01, 0.02
"""A command that departs by more than this from a sine is growing, falling or being changed."""
TURN_SHARE = 0.2
"""The stiffness at a turn is that of so much of the branch that leads to it."""
FLANK_SHARE = 0.5
"""The flanks are so near to the mean (share of the amplitude)."""
_GRID = 256
_CHANNELS = ("stroke", "position", "command")


@dataclass(frozen=True)
class CycleSeen:
    """One whole cycle at full amplitude, fitted.

    Parameters
    ----------
    frequency_Hz : float
        Of the sine.
    stroke, position, command : Sine
        Mean and amplitude, half the sum and the difference of the turns [mm], from first contact.
    u_mm : float
        Standard uncertainty of mean and amplitude of the stroke, from what noise makes of its turns.
    lower_kN, upper_kN : float
        Force at the turns of the stroke.
    top_kN_per_mm, bottom_kN_per_mm : float
        Stiffness of the loading branch towards its upper turn, of the unloading branch towards its lower one.
    response : complex
        Gain and phase of the actuator: amplitude of the position over that of the command, by the turns, and
        the phase between their fundamentals. A piston that stands still for a moment at its turns has less
        amplitude than its fundamental.
    force_kN, taken_mm : NDArray, shape (n,)
        Over the cycle: the force, and position − stroke, what the machine took.
    """

    frequency_Hz: float
    stroke: Sine
    position: Sine
    command: Sine
    u_mm: float
    lower_kN: float
    upper_kN: float
    top_kN_per_mm: float
    bottom_kN_per_mm: float
    response: complex
    force_kN: Floats
    taken_mm: Floats


@dataclass(frozen=True)
class CommandSeen:
    """The command of a period, fitted with a sine.

    Parameters
    ----------
    sine : Sine
        Mean and amplitude [mm], as recorded.
    late_share : float
        By how much of a cycle it rises through its mean after the first sample, −0.5 … 0.5.
    misfit_mm : float
        Most that a sample departs from the sine.
    """

    sine: Sine
    late_share: float
    misfit_mm: float


@dataclass(frozen=True)
class Period:
    """The samples of one period of a sine.

    Parameters
    ----------
    since_s : NDArray, shape (n,)
        Time stamps from its first sample on, any phase.
    values : mapping of str to NDArray, shape (n,)
        ``stroke``, ``position``, ``command`` [mm] and ``force`` [kN].
    frequency_Hz : float
        Of the sine.
    delays_s : mapping of str to float
        By how much a channel is late; 0 where it is not named.
    first_us : float, optional
        Time stamp of its first sample [µs].
    """

    since_s: Floats
    values: Mapping[str, Floats]
    frequency_Hz: float
    delays_s: Mapping[str, float]
    first_us: float = 0.0

    @cached_property
    def command(self) -> CommandSeen:
        """What the command was."""
        phase, values = self._phase("command"), self.values["command"]
        basis = _basis(phase, 1)
        found = np.linalg.lstsq(basis, values, rcond=None)[0]
        mean_mm, cos_mm, sin_mm = (float(one) for one in found)
        return CommandSeen(
            Sine(mean_mm, math.hypot(cos_mm, sin_mm)),
            -math.atan2(cos_mm, sin_mm) / (2.0 * math.pi),
            float(np.abs(values - basis @ found).max()),
        )

    @cached_property
    def turned(self) -> StrokeTurns | None:
        """The specimen's turns; None where one is not whole."""
        return StrokeTurns.of(self.since_s, self.values["stroke"])

    def seen(self) -> CycleSeen | None:
        """Return what the cycle did; None where the command was no steady sine, or too little is on record.

        Notes
        -----
        The turns are fitted crests (:mod:`bufferstand.daq.strokes.turning_points`), and the force there is
        read from the branch that leads to them. Phases, branches and what the machine took are those of a
        Fourier series over the period, by least squares, which takes a channel's delay out exactly; a series
        has not the height of a flat crest."""
        count, values = len(self.since_s), self.values
        if count < FEWEST_SAMPLES:
            return None
        order = min(HARMONICS, (count - 1) // 4)
        phase = {name: self._phase(name) for name in (*_CHANNELS, "force")}
        command, position, stroke, force = (
            _fit(phase[name], values[name], order) for name in ("command", "position", "stroke", "force")
        )
        amplitude_mm = math.hypot(command[1], command[2])
        pure = _basis(phase["command"], 1) @ command[:3]
        if np.abs(values["command"] - pure).max() > PURE_SHARE * amplitude_mm + PURE_MM:
            return None
        specimen, piston = self.turned, StrokeTurns.of(self.since_s, values["position"])
        if specimen is None or piston is None:
            return None
        late_s = self.delays_s.get("force", 0.0) - self.delays_s.get("stroke", 0.0)
        lower_kN, upper_kN = specimen.forces(self.since_s - late_s, values["stroke"], values["force"])
        grid = _basis(np.linspace(0.0, 2.0 * math.pi, _GRID, endpoint=False), order)
        way, taken, load = grid @ stroke, grid @ (position - stroke), grid @ force
        low, high = int(np.argmin(way)), int(np.argmax(way))
        return CycleSeen(
            self.frequency_Hz,
            specimen.sine,
            piston.sine,
            Sine(float(command[0]), amplitude_mm),
            specimen.u_mm,
            lower_kN,
            upper_kN,
            _stiffness_before(way, load, low, high),
            _stiffness_before(-way, -load, high, low),
            _response(phase["position"], values["position"], command, position, piston.sine),
            load,
            taken,
        )

    def _phase(self, name: str) -> Floats:
        """Return the phase [rad] of a channel's samples, its delay taken out."""
        return 2.0 * math.pi * self.frequency_Hz * (self.since_s - self.delays_s.get(name, 0.0))


def _response(phase: Floats, values: Floats, command: Floats, position: Floats, piston: Sine) -> complex:
    """Return the actuator's gain, by the turns, and its phase, by the flanks.

    A valve's overlap holds the piston at its turns: that delays the fundamental, and takes nothing of the
    turns. Half way between them the piston follows its loop again.

    Parameters
    ----------
    phase, values : NDArray, shape (n,)
        Phase [rad] and position of the piston [mm].
    command, position : NDArray
        Series of both.
    piston : Sine
        Turns of the position.
    """
    amplitude_mm = math.hypot(command[1], command[2])
    lag = cmath.phase(complex(command[1], -command[2]) / complex(position[1], -position[2]))
    since = phase + math.atan2(command[1], command[2])  # of the command's sine
    share = (values - piston.mean_mm) / piston.amplitude_mm
    near, rising = np.abs(share) < FLANK_SHARE, np.cos(since - lag) > 0.0
    up, down = near & rising, near & ~rising
    if up.any() and down.any():
        way = np.arcsin(np.where(near, share, 0.0))
        behind = (np.exp(1j * (since - way))[up].mean(), np.exp(1j * (since + way - math.pi))[down].mean())
        lag = cmath.phase(complex(sum(behind)))
    return cmath.rect(piston.amplitude_mm / amplitude_mm, -lag)


def _basis(phase: Floats, order: int) -> Floats:
    """Return 1, cos φ, sin φ, cos 2φ, … at phases, shape (n, 2 order + 1)."""
    columns = [np.ones_like(phase)]
    for k in range(1, order + 1):
        columns += [np.cos(k * phase), np.sin(k * phase)]
    return np.stack(columns, axis=1)


def _fit(phase: Floats, values: Floats, order: int) -> Floats:
    return np.asarray(np.linalg.lstsq(_basis(phase, order), values, rcond=None)[0], dtype=np.float64)


def _stiffness_before(stroke: Floats, force: Floats, start: int, turn: int) -> float:
    """Return the slope [kN/mm] of the last part of the branch that leads from a turn up to the other one."""
    branch = np.arange(start, turn + (len(stroke) if turn < start else 0) + 1) % len(stroke)
    reach = float(stroke[turn] - stroke[start])
    near = branch[stroke[branch] >= stroke[turn] - TURN_SHARE * reach]
    step = float(stroke[turn] - stroke[near[0]])
    return max(0.0, float(force[turn] - force[near[0]]) / step) if step > 0.0 else 0.0


class SineWatch:
    """Keeps the samples of a running sine; a listener of the acquisition.

    Parameters
    ----------
    frequency_Hz : float
        Of the sine.
    delays_s : mapping of str to float
        Delay of each channel of the controller.
    """

    def __init__(self, frequency_Hz: float, delays_s: Mapping[str, float]) -> None:
        self._frequency_Hz = frequency_Hz
        self._delays_s = delays_s
        self._blocks: list[ScaledBlock] = []
        self._first_us: list[int] = []  # of each block: a look at every block's array would cost more than it
        self._last_us: list[int] = []
        self._gaps_us: list[tuple[int, int]] = []

    @property
    def period_us(self) -> float:
        """Duration of a cycle [µs]."""
        return 1e6 / self._frequency_Hz

    @property
    def oldest_us(self) -> int | None:
        """Time stamp of the oldest sample that is kept [µs]."""
        return self._first_us[0] if self._blocks else None

    @property
    def newest_us(self) -> int | None:
        """Time stamp of the newest sample [µs]."""
        return self._last_us[-1] if self._blocks else None

    def take(self, block: ScaledBlock) -> None:
        """Keep a block of the controller's samples."""
        if not len(block) or any(name not in block.values for name in (*_CHANNELS, "force")):
            return
        if block.lost and self._blocks:
            self._gaps_us.append((self._last_us[-1], int(block.time_us[0])))
        self._blocks.append(block)
        self._first_us.append(int(block.time_us[0]))
        self._last_us.append(int(block.time_us[-1]))

    def forget_before(self, time_us: float) -> None:
        """Keep no block that ends before a time stamp [µs]."""
        old = bisect_left(self._last_us, time_us)
        del self._blocks[:old], self._first_us[:old], self._last_us[:old]
        self._gaps_us = [gap for gap in self._gaps_us if gap[1] >= time_us]

    def period_from(self, begin_us: float) -> Period | None:
        """Return the samples of the period from a time stamp [µs] on; None where they are not all on record.

        A hole of a few samples, as of a cycle that the controller missed, is bridged by straight lines.
        """
        end_us = begin_us + self.period_us
        if self._is_running(end_us):
            return None
        blocks = self._blocks[bisect_left(self._last_us, begin_us) : bisect_right(self._first_us, end_us)]
        if not blocks:
            return None
        time_us = np.concatenate([block.time_us for block in blocks])
        step_us = float(np.median(np.diff(time_us))) if len(time_us) > 1 else self.period_us
        first, last = np.searchsorted(time_us, (begin_us - 0.5 * step_us, end_us - 0.5 * step_us))
        inside = slice(first, last)
        if last - first < FEWEST_SAMPLES or time_us[first] > begin_us + EDGE_SAMPLES * step_us:
            return None
        if time_us[last - 1] < end_us - EDGE_SAMPLES * step_us:
            return None
        gaps = [gap for gap in self._gaps_us if gap[1] > time_us[first] and gap[0] < time_us[last - 1]]
        if any(after - before - step_us > GAP_SHARE * self.period_us for before, after in gaps):
            return None
        values = {
            name: np.concatenate([block.values[name] for block in blocks])[inside]
            for name in (*_CHANNELS, "force")
        }
        time_us = time_us[inside]
        if gaps:
            even_us = np.arange(time_us[0], time_us[-1] + 0.5 * step_us, step_us)
            values = {name: np.interp(even_us, time_us, one) for name, one in values.items()}
            time_us = even_us
        every = slice(None, None, max(1, math.ceil(len(time_us) / MOST_SAMPLES)))
        values = {name: one[every] for name, one in values.items()}
        since_s = (time_us[every] - time_us[0]) / 1e6
        return Period(since_s, values, self._frequency_Hz, self._delays_s, float(time_us[0]))

    def _is_running(self, end_us: float) -> bool:
        """Return whether the newest sample is clearly before the end of a period, as at most looks."""
        newest_us = self._blocks[-1].time_us[-2:] if self._blocks else np.empty(0)
        if len(newest_us) < 2:
            return False
        return bool(newest_us[-1] < end_us - 2.0 * EDGE_SAMPLES * (newest_us[-1] - newest_us[0]))
