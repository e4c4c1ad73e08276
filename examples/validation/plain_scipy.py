"""What a plain script finds in the standard data sets: turns by scipy's find_peaks, areas by trapezoid.

``python -m examples.validation.plain_scipy SETS > plain-scipy.json``, then
``bufferstand validate --results plain-scipy.json --out DIR`` judges it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import trapezoid
from scipy.signal import find_peaks

from examples.validation.records import FloatArray, plain_records

_MEANS = (
    "stored_energy_J",
    "absorbed_energy_J",
    "damping",
    "prestress_mm",
    "amplitude_mm",
    "frequency_Hz",
    "force_max_kN",
    "force_min_kN",
    "secant_stiffness_kN_per_mm",
)


def figures(time_s: FloatArray, stroke: FloatArray, force: FloatArray, turns: list[int]) -> dict[str, float]:
    """Return the figures of a cycle from its lower, upper and lower turning samples."""
    start, top, end = turns
    up, whole = slice(start, top + 1), slice(start, end + 1)
    stored = float(trapezoid(force[up], stroke[up]))
    absorbed = float(trapezoid(force[whole], stroke[whole]))
    low, high = float(stroke[start]), float(stroke[top])
    return {
        "stored_energy_J": stored,
        "absorbed_energy_J": absorbed,
        "damping": absorbed / stored,
        "stroke_max_mm": high,
        "stroke_min_mm": low,
        "prestress_mm": 0.5 * (low + high),
        "amplitude_mm": 0.5 * (high - low),
        "frequency_Hz": 1.0 / float(time_s[end] - time_s[start]),
        "force_max_kN": float(np.max(force[whole])),
        "force_min_kN": float(np.min(force[whole])),
        "secant_stiffness_kN_per_mm": float(force[top] - force[start]) / (high - low),
    }


def cycles(stroke: FloatArray) -> list[list[int]]:
    """Return the samples of the turning points of each cycle."""
    prominence = 0.2 * float(np.ptp(stroke))
    upper, _ = find_peaks(stroke, prominence=prominence)
    found = []
    for number, top in enumerate(upper):
        first = upper[number - 1] if number else 0
        last = upper[number + 1] if number + 1 < upper.size else stroke.size - 1
        lower = first + int(np.argmin(stroke[first:top])), top + int(np.argmin(stroke[top : last + 1]))
        # A record that begins or ends within a cycle has no lower turn there.
        if abs(stroke[lower[1]] - stroke[lower[0]]) <= 0.02 * (stroke[top] - stroke[lower[0]]):
            found.append([lower[0], int(top), lower[1]])
    return found


def results(folder: Path) -> dict[str, Any]:
    """Return what the script finds in each set."""
    found: dict[str, Any] = {}
    for identity, _, time_s, stroke, force in plain_records(folder):
        each = [figures(time_s, stroke, force, turns) for turns in cycles(stroke)]
        if not each:
            continue
        found[identity] = {
            "summary": {name: float(np.mean([one[name] for one in each])) for name in _MEANS},
            "cycles": [{"index": number, "complete": True, **one} for number, one in enumerate(each, 1)],
        }
    return found


if __name__ == "__main__":
    json.dump(results(Path(sys.argv[1])), sys.stdout, indent=1)
