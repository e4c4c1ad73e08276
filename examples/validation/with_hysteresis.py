"""What the package ``hysteresis`` (C. Slotboom, Apache 2.0) finds in the standard data sets.

It is no dependency of bufferstand: ``pip install hysteresis``, then
``python -m examples.validation.with_hysteresis SETS > hysteresis.json``, and
``bufferstand validate --results hysteresis.json --out DIR`` judges it.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from examples.validation.records import FloatArray, plain_records


def figures(stroke: FloatArray, force: FloatArray) -> list[dict[str, float]]:
    """Return the energies of each cycle by the areas of the package's half cycles."""
    import hysteresis  # type: ignore[import-not-found] # noqa: PLC0415 - not a dependency

    loop = hysteresis.Hysteresis(
        np.column_stack((stroke, force)), revProminence=0.2 * float(np.ptp(stroke)), setSlope=False
    )
    first = 0 if loop.cycles[0].direction > 0 else 1
    halves = loop.cycles[first:]
    found = []
    for up, down in zip(halves[::2], halves[1::2], strict=False):
        area = [float(np.sum(half.setArea())) for half in (up, down)]
        low, high = float(up.xy[0, 0]), float(up.xy[-1, 0])
        if abs(float(down.xy[-1, 0]) - low) > 0.02 * (high - low):
            continue  # cut by an end of the record
        found.append(
            {
                "stored_energy_J": area[0],
                "absorbed_energy_J": area[0] + area[1],
                "damping": (area[0] + area[1]) / area[0],
                "stroke_min_mm": low,
                "stroke_max_mm": high,
                "prestress_mm": 0.5 * (low + high),
                "amplitude_mm": 0.5 * (high - low),
            }
        )
    return found


def results(folder: Path) -> dict[str, Any]:
    """Return what the package finds in each set; what it fails on is left out."""
    found: dict[str, Any] = {}
    for identity, _, _, stroke, force in plain_records(folder):
        try:
            each = figures(stroke, force)
        except Exception as error:  # noqa: BLE001 - the package raises bare ones
            print(f"{identity}: {error}", file=sys.stderr)  # noqa: T201 - a script
            continue
        if each:
            found[identity] = {
                "summary": {name: float(np.mean([one[name] for one in each])) for name in each[0]},
                "cycles": [{"index": number, "complete": True, **one} for number, one in enumerate(each, 1)],
            }
    return found


if __name__ == "__main__":
    json.dump(results(Path(sys.argv[1])), sys.stdout, indent=1)
