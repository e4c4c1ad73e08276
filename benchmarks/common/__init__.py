"""What the benchmarks share: the form of each, how time is taken, and the stand they read."""

from benchmarks.common.form import Benchmark, NotHere, load, names, tell
from benchmarks.common.measuring import ROOT, Cost, best, cost, processor_s
from benchmarks.common.stand import PATIENCE_S, SAMPLE_STAND, record, wide_guards

__all__ = [
    "PATIENCE_S",
    "ROOT",
    "SAMPLE_STAND",
    "Benchmark",
    "Cost",
    "NotHere",
    "best",
    "cost",
    "load",
    "names",
    "processor_s",
    "record",
    "tell",
    "wide_guards",
]
