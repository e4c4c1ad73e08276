"""What a stand can do next: slow strokes, loops and rests, and the nodes that the fit would make of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bufferstand.model.identification import Drive, Experiment, Reduction

Floats = NDArray[np.float64]

RAMP_mm_per_s = 20.0
"""To and from a loop; the default of a campaign file."""
FADES = 2
"""Cycles in which a loop's amplitude grows and shrinks: time, and no information that is counted on."""
AROUND_S = 5.0
"""What a step costs beside its motion: start, stop, and the file."""


@dataclass(frozen=True)
class SlowStroke:
    """From contact to ``stroke_mm`` and back at constant speed, ``cycles`` times."""

    stroke_mm: float
    speed_mm_per_s: float
    cycles: int = 1

    @property
    def text(self) -> str:
        """What it is, in words."""
        many = "s" * (self.cycles > 1)
        return f"{self.cycles} slow stroke{many} to {self.stroke_mm:.1f} mm at {self.speed_mm_per_s:g} mm/s"


@dataclass(frozen=True)
class Loops:
    """Sines of ``amplitude_mm`` (half the range) about ``prestress_mm``."""

    prestress_mm: float
    amplitude_mm: float
    frequency_Hz: float
    cycles: int

    @property
    def text(self) -> str:
        """What it is, in words."""
        return (
            f"{self.cycles} cycles of {self.prestress_mm:.1f} ± {self.amplitude_mm:.1f} mm "
            f"at {self.frequency_Hz:.3g} Hz"
        )


@dataclass(frozen=True)
class Rest:
    """Nothing moves: the spring cools, and nothing is recorded."""

    duration_s: float

    @property
    def text(self) -> str:
        """What it is, in words."""
        return f"rest of {self.duration_s:g} s"


Piece = SlowStroke | Loops | Rest
Candidate = tuple[Piece, ...]
"""Pieces in a row, begun and ended at contact."""


def text_of(candidate: Candidate) -> str:
    """Return what a candidate does, in words."""
    return ", then ".join(piece.text for piece in candidate)


def seconds_of(piece: Piece) -> float:
    """Return how long a piece takes the stand [s]."""
    match piece:
        case Rest():
            return piece.duration_s
        case SlowStroke():
            return 2.0 * piece.cycles * piece.stroke_mm / piece.speed_mm_per_s + AROUND_S
    lead = (piece.prestress_mm - piece.amplitude_mm) / RAMP_mm_per_s
    return 2.0 * lead + (piece.cycles + FADES) / piece.frequency_Hz + AROUND_S


@dataclass(frozen=True)
class RunNoise:
    """Weights that the fit gives to a node of such runs, its own factors included.

    Attributes
    ----------
    force_kN : float
        Standard deviation of the force of one node.
    turn_kN : float
        What one standard deviation of a fitted turn does to the forces of its half stroke.
    sensor_C, reading_s : float
        Standard deviation of a temperature reading, and the time from one to the next.
    correlation : float
        By how many each effective sample stands.
    spacing : Reduction
        How far nodes lie apart, as the fit keeps them of a record.
    """

    force_kN: float
    turn_kN: float
    sensor_C: float
    reading_s: float
    correlation: float
    spacing: Reduction = field(default_factory=Reduction)

    @classmethod
    def of(cls, experiments: Sequence[Experiment], correlation: float) -> RunNoise:
        """Return the medians of a fit's experiments."""
        force = np.concatenate([e.drive.force_sigma_kN[e.used] * e.force_factor for e in experiments])
        turn = np.concatenate([e.drive.turn_kN[e.used] * e.force_factor for e in experiments])
        read = [e for e in experiments if e.drive.sensor_C.size > 1]
        gaps = np.concatenate([np.diff(e.drive.sensor_s) for e in read]) if read else np.empty(0)
        return cls(
            float(np.median(force)),
            float(np.median(turn)),
            read[0].sensor_sigma_C * read[0].sensor_factor if read else 0.0,
            float(np.median(gaps)) if gaps.size else 0.0,
            correlation,
        )


def drive_of(pieces: Candidate, noise: RunNoise, ambient_C: float) -> Drive:
    """Return the nodes that the fit would see of pieces in a row, forces 0.

    Parameters
    ----------
    pieces : tuple of Piece
    noise : RunNoise
    ambient_C : float
        Temperature of the air [°C].
    """
    nodes = _Nodes(noise.spacing)
    for piece in pieces:
        before_s = nodes.time_s
        match piece:
            case Rest():
                nodes.rest(piece.duration_s)
            case SlowStroke():
                for _ in range(piece.cycles):
                    nodes.line(piece.stroke_mm, piece.speed_mm_per_s)
                    nodes.line(0.0, piece.speed_mm_per_s)
            case Loops():
                low, high = (piece.prestress_mm + side * piece.amplitude_mm for side in (-1.0, 1.0))
                nodes.coarser(1 + piece.cycles // _EACH_CYCLE)
                nodes.line(low, RAMP_mm_per_s)
                for _ in range(piece.cycles):
                    nodes.half_sine(high, piece.frequency_Hz)
                    nodes.half_sine(low, piece.frequency_Hz)
                nodes.line(0.0, RAMP_mm_per_s)
                nodes.coarser(1)
        if not isinstance(piece, Rest) and noise.reading_s > 0.0:
            nodes.read(before_s, noise.reading_s)
    return nodes.drive(noise, ambient_C)


_EACH_CYCLE = 10
"""Of more cycles than this the nodes are taken coarser, with as much more weight each: it is the same
information, and a hundred cycles are no more work than ten."""


class _Nodes:
    """Nodes of a stroke from contact, half stroke by half stroke."""

    def __init__(self, spacing: Reduction) -> None:
        self._spacing = spacing
        self._t, self._x, self._half = [np.zeros(1)], [np.zeros(1)], [np.zeros(1, dtype=np.intp)]
        self._number, self._way = 0, 1
        self._weight = [np.ones(1)]
        self._coarser, self._each = 1, 1.0
        self._sensor_s: list[Floats] = []

    def coarser(self, by: int) -> None:
        """Take nodes so many times further apart from now on."""
        self._coarser = by

    @property
    def time_s(self) -> float:
        """Time of the last node."""
        return float(self._t[-1][-1])

    @property
    def _at_mm(self) -> float:
        return float(self._x[-1][-1])

    def line(self, to_mm: float, speed_mm_per_s: float) -> None:
        """Move at constant speed."""
        x = self._marks(to_mm)
        self._append(np.abs(x - self._at_mm) / speed_mm_per_s, x)

    def half_sine(self, to_mm: float, frequency_Hz: float) -> None:
        """Move as half a sine from rest to rest."""
        x = self._marks(to_mm)
        start = self._at_mm
        share = np.arccos(np.clip(1.0 - 2.0 * np.abs(x - start) / abs(to_mm - start), -1.0, 1.0)) / np.pi
        self._append(share / (2.0 * frequency_Hz), x)

    def rest(self, duration_s: float) -> None:
        """Stand still at contact."""
        self._append(np.array([duration_s]), np.array([self._at_mm]))

    def read(self, since_s: float, every_s: float) -> None:
        """Read the temperature from then until now."""
        self._sensor_s.append(np.arange(since_s, self.time_s, every_s))

    def _marks(self, to_mm: float) -> Floats:
        """Return the strokes of a half stroke's nodes; the end is its turn."""
        total = abs(to_mm - self._at_mm)
        if total == 0.0:
            return np.empty(0)
        ways = self._ways(total, self._coarser)
        self._each = len(self._ways(total, 1)) / len(ways) if self._coarser > 1 else 1.0
        return np.asarray(
            self._at_mm + np.sign(to_mm - self._at_mm) * np.array([*ways, total]), dtype=np.float64
        )

    def _ways(self, total_mm: float, coarser: int) -> list[float]:
        """Return the ways from one turn to the next at which nodes lie, the turns left out."""
        near_mm, far_mm = coarser * self._spacing.near_mm, coarser * self._spacing.far_mm
        ways = [0.0]
        while ways[-1] < total_mm:
            from_turn = min(ways[-1], total_mm - ways[-1])
            ways.append(ways[-1] + min(near_mm + self._spacing.growth * from_turn, far_mm))
        inner = [way for way in ways[1:-1] if total_mm - way > 0.5 * self._spacing.near_mm]
        return inner or [0.5 * total_mm]

    def _append(self, after_s: Floats, x: Floats) -> None:
        if not x.size:
            return
        way = int(np.sign(x[-1] - self._at_mm))
        if way not in (0, self._way):
            self._number, self._way = self._number + 1, way
            self._half[-1][-1] = self._number  # a half stroke has its beginning, without its end
        self._t.append(self.time_s + after_s)
        self._x.append(x.copy())
        self._half.append(np.full(x.size, self._number, dtype=np.intp))
        self._weight.append(np.full(x.size, self._each))

    def drive(self, noise: RunNoise, ambient_C: float) -> Drive:
        time, stroke, half = np.concatenate(self._t), np.concatenate(self._x), np.concatenate(self._half)
        weight = np.concatenate(self._weight)
        turns = np.diff(half, prepend=-1) > 0
        turns[-1] = True
        node = np.flatnonzero(~turns)
        nothing = np.zeros(node.size)
        sensor_s = np.concatenate([*self._sensor_s, np.empty(0)])
        return Drive(
            time, stroke, half, node, nothing, noise.force_kN / np.sqrt(weight[node]),
            np.full(node.size, noise.turn_kN), sensor_s, np.full(sensor_s.size, ambient_C), ambient_C,
        )  # fmt: skip
