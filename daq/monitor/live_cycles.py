"""Figures of the cycles of the run under way, by evaluation's own functions, from the samples as told.

They come as the cycles do and are for looking at: what counts is the evaluation of the record, which knows
more (what came before and after, uncertainty, gaps of the record). Its formulas are these.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor.sample_rows import finite
from bufferstand.foundation import BadInput

MOST_SAMPLES = 40_000
"""Samples that are held: of a slower cycle every second one is forgotten."""
LEAST_SAMPLES = 60
LOOPS_KEPT = 4
LOOP_POINTS = 240
ROWS_SHOWN = 8
TREND_KEPT = 240
"""Cycles of a step whose figures are kept for the trend: of more, every second one of the older half."""
CONTEXT = 0.4
"""So much of the last cycle's duration before it is kept, for its turning point to be fitted again."""
BEHIND = 0.05
"""So much of a cycle's duration must have come behind its end, for the turning point there to be known."""
SAME = 0.3
"""A cycle that begins so much of its duration before the end of the last one is that one, fitted again."""
FULL = 0.98
"""The trend is that of cycles of the full amplitude, within the share by which steady ones agree: a sine that
grows or fades beside them is none of them."""
FADES = 0.3
"""From so much of a cycle's duration before it is known that a sine runs out, one may be smaller for that."""
BEYOND = ("amplitude_mm", "frequency_Hz", "force_max_kN")
"""Quantities that the page shows beside those that the catalogue names for it."""


def columns() -> list[dict[str, Any]]:
    """Return name, heading, unit and decimals of the quantities that the page has a column of."""
    from bufferstand.evaluation.catalogue import QUANTITIES  # noqa: PLC0415 - the page is served before

    return [
        {
            "name": entry.name,
            "heading": entry.shown.monitor.heading,
            "unit": "" if entry.unit == "1" else entry.unit,
            "decimals": entry.shown.monitor.decimals,
        }
        for entry in QUANTITIES
        if entry.shown.monitor is not None
    ]


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples in a row: device's time [s], stroke [mm] and force [kN], shape (N,) each."""

    time_s: NDArray[np.float64]
    stroke_mm: NDArray[np.float64]
    force_kN: NDArray[np.float64]

    def __len__(self) -> int:
        """Return how many."""
        return len(self.time_s)

    def picked(self, chosen: slice) -> Stretch:
        """Return some of them."""
        return Stretch(self.time_s[chosen], self.stroke_mm[chosen], self.force_kN[chosen])


@dataclass
class Seen:
    """A cycle that was evaluated."""

    start_s: float
    end_s: float
    figures: dict[str, float | None]
    loop: Stretch
    missing: str = ""


@dataclass
class _Step:
    number: int
    rows: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=ROWS_SHOWN))
    trend: list[dict[str, Any]] = field(default_factory=list)
    loops: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=LOOPS_KEPT))
    cycles: int = 0


class LiveCycles:
    """Collects samples, has them evaluated when a cycle may be complete, and keeps what is shown."""

    def __init__(self) -> None:
        self._parts: list[Stretch] = []
        self._size = 0
        self._done_s = -np.inf
        self._asked_for = 0
        self._step = _Step(0)
        self._delay_s: dict[str, float] = {}
        self._over = False
        self._part = ""
        self._fades_s = (np.inf, np.inf)
        self.changed = False
        self.epoch = 0
        """Changes whenever what was collected is forgotten: figures of before are then of no use."""

    def name(self, channels: Sequence[Mapping[str, Any]]) -> None:
        """Take the delays of the channels: stroke and force are brought to the same moments by them."""
        found: dict[str, list[float]] = {}
        for one in channels:
            found.setdefault(str(one.get("quantity")), []).append(float(one.get("delay_s") or 0.0))
        self._delay_s = {what: sum(delays) / len(delays) for what, delays in found.items()}

    def begin(self, step: int) -> None:
        """Begin another step: the loops and figures of the one before are no longer compared with."""
        if step != self._step.number:
            self._step, self.changed = _Step(step), True
            self._forget()

    def restart(self) -> None:
        """Begin the step again: the campaign was resumed, and what came before belongs to another run."""
        self._step, self.changed = _Step(self._step.number), True
        self._forget()

    def _forget(self) -> None:
        self._parts, self._size, self._done_s, self._asked_for = [], 0, -np.inf, 0
        self._over = False
        self._part, self._fades_s = "", (np.inf, np.inf)
        self.epoch += 1

    def end(self) -> None:
        """Know that no more comes of this run: its last cycle may end with the samples."""
        self._over, self._asked_for = bool(self._parts), 0

    def add(self, rows: Mapping[str, Any], part: str = "") -> None:
        """Take rows of samples as pages get them, and whether a sine grows (lead-in) or fades (run-out)."""
        if not rows:
            return
        self._over = False
        time_s = rows["t0_us"] / 1e6 + np.asarray(rows["t"], dtype=np.float64) / 1e4
        if self._parts and time_s[0] < self._parts[-1].time_s[-1]:
            self._forget()  # another controller, or its clock was set
        stretch = Stretch(
            time_s, np.asarray(rows["s"], np.float64) / 1000.0, np.asarray(rows["f"], np.float64) / 1000.0
        )
        self._parts.append(stretch)
        self._size += len(stretch)
        if part != self._part:
            self._part = part
            if part == "run-out":
                self._fades_s = (time_s[0], np.inf)
            elif part == "lead-in":  # of the next motion of the step
                self._fades_s = (self._fades_s[0], time_s[0])
        if self._size > MOST_SAMPLES:
            self._thin()

    def _thin(self) -> None:
        whole = self._joined().picked(slice(None, None, 2))
        self._parts, self._size = [whole], len(whole)
        self._asked_for //= 2

    def _joined(self) -> Stretch:
        if len(self._parts) > 1:
            self._parts = [
                Stretch(
                    np.concatenate([one.time_s for one in self._parts]),
                    np.concatenate([one.stroke_mm for one in self._parts]),
                    np.concatenate([one.force_kN for one in self._parts]),
                )
            ]
        return self._parts[0]

    def due(self) -> Stretch | None:
        """Return the samples that may hold another cycle; None where that is not worth a look yet.

        A look costs what it looks at: it waits until a tenth more has come.
        """
        if self._size < LEAST_SAMPLES or self._size < 1.1 * self._asked_for:
            return None
        self._asked_for = self._size
        return self._joined()

    def evaluate(self, stretch: Stretch) -> list[Seen]:
        """Return the complete cycles in some samples that are not known yet; may take a while."""
        delays_s = (self._delay_s.get("stroke", 0.0), self._delay_s.get("force", 0.0))
        found = evaluate_stretch(stretch, *delays_s, behind=0.0 if self._over else BEHIND)
        return [one for one in found if self._is_new(one)]

    def _is_new(self, one: Seen) -> bool:
        return one.start_s > self._done_s - SAME * (one.end_s - one.start_s)

    def take(self, found: Sequence[Seen], temperature_C: float | None) -> None:
        """Keep cycles that were evaluated, with the warmest reading on the specimen now [°C]."""
        for one in found:
            if not self._is_new(one):
                continue
            self._done_s, self.changed = one.end_s, True
            if self._runs_out(one):
                continue
            self._step.cycles += 1
            row = {
                "n": self._step.cycles,
                **{name: finite(value, 5) for name, value in one.figures.items()},
                "temperature_C": finite(temperature_C, 2),
                "missing": one.missing,
            }
            self._step.rows.append(row)
            self._keep(row)
            stride = max(1, -(-len(one.loop) // LOOP_POINTS))
            self._step.loops.append(
                {
                    "n": self._step.cycles,
                    "s": np.round(one.loop.stroke_mm[::stride], 3).tolist(),
                    "f": np.round(one.loop.force_kN[::stride], 3).tolist(),
                }
            )
        if found and self._parts:
            self._drop_before(found[-1].start_s - CONTEXT * (found[-1].end_s - found[-1].start_s))

    def _runs_out(self, one: Seen) -> bool:
        """Return whether a cycle is that in which a sine fades: it is none of those that were asked for."""
        largest = max((row["amplitude_mm"] or 0.0 for row in self._step.trend), default=0.0)
        begin_s, end_s = self._fades_s
        fades = begin_s - FADES * (one.end_s - one.start_s) < one.end_s and one.start_s < end_s
        return (self._over or fades) and (one.figures["amplitude_mm"] or 0.0) < FULL * largest

    def _keep(self, row: dict[str, Any]) -> None:
        trend = self._step.trend
        trend.append(row)
        if len(trend) > TREND_KEPT:
            del trend[1 : TREND_KEPT // 2 : 2]

    def _drop_before(self, start_s: float) -> None:
        whole = self._joined()
        kept = whole.picked(slice(int(np.searchsorted(whole.time_s, start_s)), None))
        self._parts, self._size = [kept], len(kept)
        self._asked_for = 0

    def sections(self) -> dict[str, Any]:
        """Return what the page shows: the newest cycles, their trend, and the last loops."""
        step = self._step
        largest = max((row["amplitude_mm"] or 0.0 for row in step.trend), default=0.0)
        full = [row for row in step.trend if (row["amplitude_mm"] or 0.0) >= FULL * largest]
        trend = {
            name: [[row["n"], row[name]] for row in full if row.get(name) is not None]
            for name in (*(one["name"] for one in columns()), "temperature_C")
        }
        return {
            "cycles": {"step": step.number, "columns": columns(), "rows": list(step.rows), "trend": trend},
            "loops": list(step.loops),
        }

    @property
    def kept(self) -> int:
        """Return how many samples and figures are held."""
        step = self._step
        return self._size + len(step.rows) + len(step.trend) + sum(len(one["s"]) for one in step.loops)


def evaluate_stretch(
    stretch: Stretch, stroke_delay_s: float = 0.0, force_delay_s: float = 0.0, behind: float = BEHIND
) -> list[Seen]:
    """Return the complete cycles in a stretch of samples with their figures, in order.

    Parameters
    ----------
    stretch : Stretch
        As told: time stamps as received.
    stroke_delay_s, force_delay_s : float
        Their values were true so long before their stamps [s].
    behind : float
        So much of a cycle's duration must lie behind its end.

    Returns
    -------
    list of Seen
        None where nothing can be evaluated.
    """
    from bufferstand.evaluation.cycles import find_with_harmonics  # noqa: PLC0415 - the page is served before
    from bufferstand.evaluation.loading import on_time  # noqa: PLC0415
    from bufferstand.evaluation.quantities import evaluate_cycles  # noqa: PLC0415
    from bufferstand.evaluation.record import make_record  # noqa: PLC0415

    time_s = stretch.time_s - stroke_delay_s
    force_kN = stretch.force_kN
    if stroke_delay_s != force_delay_s:
        force_kN = on_time(stretch.time_s - force_delay_s, force_kN, time_s, [0, len(stretch)])
    try:
        record = make_record(time_s.copy(), stretch.stroke_mm.copy(), np.array(force_kN))
        cycles, first = find_with_harmonics(record)
        whole = [(cycle, k) for cycle, k in zip([c for c in cycles if c.complete], first, strict=True)]
        results = evaluate_cycles(record, [c for c, _ in whole], np.array([k for _, k in whole]))
    except BadInput:
        return []
    names = [one["name"] for one in columns()] + list(BEYOND)
    seen = []
    for (cycle, _), result in zip(whole, results, strict=True):
        if cycle.end_s + behind * cycle.duration_s > time_s[-1]:
            continue
        begin, end = np.searchsorted(time_s, [cycle.start_s, cycle.end_s])
        missing = "; ".join(dict.fromkeys(result.missing[name] for name in names if name in result.missing))
        figures = {name: getattr(result.quantities, name, None) for name in dict.fromkeys(names)}
        loop = Stretch(time_s, stretch.stroke_mm, np.asarray(force_kN)).picked(
            slice(int(begin), int(end) + 1)
        )
        seen.append(Seen(cycle.start_s, cycle.end_s, figures, loop, missing))
    return seen
