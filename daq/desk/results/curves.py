"""Loops of runs for the screen, and a spring model's answer to the same strokes: a process of its own.

python -m bufferstand.daq.desk.results.curves < JSON, that is
``{"runs": [{"path": …, "from_s": …, "to_s": …}], "model": FILE}``
"""

from __future__ import annotations

import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.evaluation.figures import kept_samples
from bufferstand.evaluation.figures.model_comparison import KINDS, answer_to, check_run, drive_of
from bufferstand.evaluation.loading import load_run
from bufferstand.evaluation.record import Record
from bufferstand.foundation import BadInput
from bufferstand.model import SpringModel, load_model

LOOP_POINTS = 600
MOST_MEMORY_BYTES = 3 << 30
"""Whatever a file holds, the machine keeps its memory."""


def loop_of(record: Record, from_s: float | None, to_s: float | None) -> dict[str, Any]:
    """Return stroke and force of a cycle, or of a whole record, thinned out by what is seen on a screen."""
    begin = 0 if from_s is None else int(np.searchsorted(record.time_s, from_s))
    end = record.time_s.size if to_s is None else int(np.searchsorted(record.time_s, to_s, side="right"))
    stroke, force = record.stroke_mm[begin:end], record.force_kN[begin:end]
    kept = kept_samples(stroke, force, LOOP_POINTS)
    return {"s": _rounded(stroke[kept]), "f": _rounded(force[kept])}


def answered(model: SpringModel, record: Record, name: str, from_s: float, to_s: float) -> dict[str, Any]:
    """Return what a model says to a run: its loop in the same cycle, and how far it is off.

    Raises
    ------
    BadInput
        If the run has no usable samples.
    """
    drive = drive_of(record, name)
    check = check_run(drive, answer_to(model, drive))
    inside = (drive.time_s >= from_s) & (drive.time_s <= to_s)
    rest, cycles = check.residual_kN, check.cycles
    return {
        "s": _rounded(drive.stroke_mm[inside]),
        "f": _rounded(check.answer.force_kN[inside]),
        "rms_kN": float(np.sqrt(np.mean(rest**2))) if rest.size else None,
        "worst_share": float(np.max(np.abs(rest))) / check.largest_force_kN if rest.size else None,
        "damping": float(np.mean([one.damping for one in cycles])) if cycles else None,
        "predicted_damping": float(np.mean([one.predicted_damping for one in cycles])) if cycles else None,
    }


def curve_of(asked: dict[str, Any], model: SpringModel | None) -> dict[str, Any]:
    """Return the curves of one run; what cannot be had is said in ``problem``."""
    path, from_s, to_s = Path(asked["path"]), asked.get("from_s"), asked.get("to_s")
    found: dict[str, Any] = {"path": asked["path"], "problem": ""}
    try:
        record, facts = load_run(path)
        found |= loop_of(record, from_s, to_s)
        if model is not None and from_s is not None and to_s is not None:
            if facts.kind in KINDS:
                found["model"] = answered(model, record, path.stem, from_s, to_s)
            else:
                found["problem"] = f"a run of kind “{facts.kind}” does not show the spring alone"
    except BadInput as error:
        found["problem"] = str(error)
    return found


def _rounded(values: Any) -> list[float | None]:
    return [None if not np.isfinite(one) else round(float(one), 3) for one in values]


def main() -> int:
    """Read what is asked for; write the curves as one JSON object."""
    os.nice(10)
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY_BYTES, MOST_MEMORY_BYTES))
    asked = json.load(sys.stdin)
    try:
        model = load_model(Path(asked["model"])) if asked.get("model") else None
    except BadInput as error:
        sys.stdout.write(json.dumps({"problem": str(error)}))
        return 2
    curves = [curve_of(one, model) for one in asked["runs"]]
    sys.stdout.write(json.dumps({"curves": curves}, allow_nan=False))
    return 0


if __name__ == "__main__":
    sys.exit(main())
