"""What the spring model costs beside a plain C loop of the same step.

The C loops (``common/model_step.c``) are compiled here with ``cc -O2``. All are measured in one process,
taking turns, best of the rounds, in processor time. Every pair does the same work and must give the same
figures: the isothermal pair the force at 35 °C without viscous branches, the stepwise pair force, heat, both
temperatures, work and one viscous branch.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.common import ROOT, Benchmark, NotHere, best, tell
from bufferstand.model import kernels
from bufferstand.model.compiled import factors_of, law_of, rest_of
from bufferstand.model.file import load_model
from bufferstand.model.isothermal import isothermal_force
from bufferstand.model.spring import SpringModel, ViscousBranch

Floats = NDArray[np.float64]
STEP_S = 1e-3
WARM_C = 35.0


def c_loops(folder: Path) -> ctypes.CDLL:
    """Return the C loops, compiled with -O2 into a folder."""
    library = folder / "model_step.so"
    source = ROOT / "benchmarks/common/model_step.c"
    command = ["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(source), "-lm"]
    subprocess.run(command, check=True)
    loops = ctypes.CDLL(str(library))
    row, figure, count = ctypes.c_void_p, ctypes.c_double, ctypes.c_size_t
    loops.isothermal.argtypes = [row, row, figure, figure, figure, count, row, row]
    loops.drive.argtypes = [row, row, row, row, row, count, row, row]
    for loop in (loops.isothermal, loops.drive):
        loop.restype = None
    return loops


def address(values: NDArray[np.generic]) -> int:
    """Return where an array begins."""
    return values.ctypes.data


def isothermal(model: SpringModel, strokes: Floats, loops: ctypes.CDLL, rounds: int) -> float:
    """Measure numpy beside C for the force at one temperature; return the ratio of their times."""
    bare = replace(model, viscous=ViscousBranch())
    cells, law = np.ascontiguousarray(bare.tables.rows()), np.array(law_of(bare))
    soft, e = float(bare.temperature.softening(WARM_C)), float(bare.width_scale(WARM_C))
    force = np.empty_like(strokes)

    def plain_c() -> None:
        loops.isothermal(
            address(cells), address(law), soft, e, 0.0, len(strokes), address(strokes), address(force)
        )

    def numpy() -> Floats:
        return isothermal_force(bare, strokes, WARM_C)

    plain_c()
    np.testing.assert_allclose(numpy(), force, atol=1e-9)
    ours, theirs = best([numpy, plain_c], rounds)
    per_step = 1e9 / len(strokes)
    tell(f"isothermal: C {theirs * per_step:.1f} ns a step, numpy {ours * per_step:.1f} ns")
    return ours / theirs


def stepwise(model: SpringModel, strokes: Floats, loops: ctypes.CDLL, rounds: int) -> float:
    """Measure numba beside C for the whole step; return the ratio of their times."""
    cells, law = model.tables.rows().ravel(), np.array(law_of(model))
    factors, places = np.array(factors_of(model, STEP_S)), np.zeros(4 * len(strokes), dtype=np.int64)
    outputs, expected = np.zeros((2, kernels.READ * len(strokes)))

    def rest() -> Floats:
        state = np.array(rest_of(model))
        state[[kernels.TEMPERATURE, kernels.SENSOR, kernels.AMBIENT]] = 20.0
        return state

    def plain_c() -> None:
        state = rest()
        rows = (cells, law, factors, state, places)
        loops.drive(*(address(r) for r in rows), len(strokes), address(strokes), address(expected))

    def numba() -> None:
        kernels.compiled()(cells, law, factors, rest(), places, strokes, outputs)

    plain_c()
    numba()
    np.testing.assert_array_equal(outputs, expected)
    ours, theirs = best([numba, plain_c], rounds)
    per_step = 1e9 / len(strokes)
    tell(f"stepwise: C {theirs * per_step:.1f} ns a step, numba {ours * per_step:.1f} ns, the same bits")
    return ours / theirs


def measure(folder: Path, *, samples: int, rounds: int) -> Sequence[float]:
    """Measure both pairs with steps of 1 ms, 50 ± 45 mm at 0.849 Hz."""
    if not shutil.which("cc"):
        raise NotHere("needs a C compiler (cc)")
    if not kernels.available():
        raise NotHere("needs numba (the extra fast)")
    model = load_model(ROOT / "sample_runs/models/category-a-elastomer.toml")
    strokes = 50.0 - 45.0 * np.cos(2.0 * np.pi * 0.849 * STEP_S * np.arange(samples))
    loops = c_loops(folder)
    return isothermal(model, strokes, loops, rounds), stepwise(model, strokes, loops, rounds)


BENCHMARK = Benchmark(
    {
        "numpy, force at one temperature / C -O2, processor": 2.0,
        "numba, whole step / C -O2, processor": 1.25,
    },
    full=partial(measure, samples=1_000_000, rounds=9),
    smoke=partial(measure, samples=1000, rounds=1),
)
