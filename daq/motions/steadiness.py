"""Whether a harmonic step has settled: its cycles are evaluated while it runs, beside the loop."""

from __future__ import annotations

import math
from concurrent.futures import Future, ThreadPoolExecutor, wait

import numpy as np

from bufferstand.daq.scaling import ScaledBlock
from bufferstand.evaluation.cycles import find_cycles
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.evaluation.quantities import evaluate_cycle
from bufferstand.evaluation.record import Record
from bufferstand.foundation import Harmonic
from bufferstand.protocols.steps import Steadiness

KEPT_PERIODS = 2.6
"""The last whole cycle lies within so many periods of the end, wherever the count of cycles changes."""
MOST_SAMPLES = 2000
"""Samples that are evaluated at most, evenly chosen: damping and stiffness of a cycle need no more."""
WAIT_S = 0.2
"""So long at most the loop waits for the cycle before [s]."""


class SteadinessWatch:
    """Keeps the last cycles of a harmonic motion and judges each as it ends; the loop of a stand never waits.

    Parameters
    ----------
    steady : Steadiness
        When it has settled.
    motion : Harmonic
        Its period says what to keep.
    """

    def __init__(self, steady: Steadiness, motion: Harmonic) -> None:
        self._steady = steady
        self._keep_s = KEPT_PERIODS / motion.frequency_Hz
        self._blocks: list[ScaledBlock] = []
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="steadiness")
        self._waiting: list[Future[tuple[float, float]]] = []
        self._cycles = 0
        self.damping: list[float] = []
        """Of each full cycle so far; not a number where it could not be evaluated."""
        self.stiffness: list[float] = []
        """Dynamic stiffness of each [kN/mm]."""

    def take(self, block: ScaledBlock) -> None:
        """Keep a block of the controller's samples, and forget what is older than is needed."""
        if not len(block) or "stroke" not in block.values or "force" not in block.values:
            return
        if block.lost:
            self._blocks.clear()  # nothing is evaluated across a gap
        self._blocks.append(block)
        oldest_us = int(block.time_us[-1]) - self._keep_s * 1e6
        while len(self._blocks) > 1 and self._blocks[0].time_us[-1] < oldest_us:
            self._blocks.pop(0)

    def settled(self, cycles_done: int) -> bool:
        """Return whether the cycles judged so far have settled; hands over the one that has just ended."""
        if cycles_done > self._cycles and self._blocks:
            self._cycles = cycles_done
            # The cycle before had a whole cycle's time: there is something to wait for in virtual time only.
            wait(self._waiting, timeout=WAIT_S)
            time_s = np.concatenate([block.time_us for block in self._blocks]) / 1e6
            stroke = np.concatenate([block.values["stroke"] for block in self._blocks])
            force = np.concatenate([block.values["force"] for block in self._blocks])
            self._waiting.append(self._pool.submit(last_cycle, time_s, stroke, force))
        while self._waiting and self._waiting[0].done():
            damping, stiffness = self._waiting.pop(0).result()
            self.damping.append(damping)
            self.stiffness.append(stiffness)
        return bool(self.damping) and self._steady.reached(self.damping, self.stiffness)

    def close(self) -> None:
        """End the thread."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def last_cycle(time_s: FloatArray, stroke_mm: FloatArray, force_kN: FloatArray) -> tuple[float, float]:
    """Return damping and dynamic stiffness [kN/mm] of the last complete cycle; not numbers without one."""
    every = max(1, math.ceil(len(time_s) / MOST_SAMPLES))
    record = Record(time_s[::every], stroke_mm[::every], force_kN[::every])
    complete = [cycle for cycle in find_cycles(record) if cycle.complete]
    if not complete:
        return math.nan, math.nan
    found = evaluate_cycle(record, complete[-1]).quantities
    if found is None or found.damping is None or found.dynamic_stiffness_kN_per_mm is None:
        return math.nan, math.nan
    return found.damping, found.dynamic_stiffness_kN_per_mm
