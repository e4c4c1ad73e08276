"""Runs of a finished campaign with what evaluation says of each; a process of its own, one line a run.

python -m bufferstand.daq.monitor.results DIR
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.evaluation.document import evaluate_entry
from bufferstand.evaluation.load import load_run
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.catalogue import facts_of, run_files
from bufferstand.recording.runfile import open_run

LOOP_ROWS = 1500
"""Rows of a loop on the screen."""
SHOWN = (
    "amplitude_mm", "frequency_Hz", "damping", "tangent_stiffness_kN_per_mm", "stored_energy_J",
    "absorbed_energy_J", "temperature_start_C",
)  # fmt: skip
"""Values of the summary that a page shows, means over cycles …"""
EXTREMES = ("stroke_max_mm", "force_max_kN", "temperature_max_C")
"""… and greatest values over all samples of the run."""


def describe(path: Path, root: Path) -> dict[str, Any]:
    """Return what a page shows of a run: facts, results, events, loop; never raises for what is in it."""
    facts = facts_of(path)
    content: dict[str, Any] = {
        "file": str(path.relative_to(root)),
        "id": facts.id or path.stem,
        "kind": facts.kind,
        "status": facts.status,
        "step": facts.step,
        "started_utc": facts.started_utc,
        "problem": facts.problem,
        "summary": {},
        "extremes": {},
        "requirements": [],
        "warnings": [],
        "verdict": None,
        "events": [],
        "loop": {},
    }
    if facts.problem is not None:
        return content
    try:
        run = open_run(path)
        content["reason"] = run.reason
        content["events"] = [
            {"at_s": None if e.time_s is None else round(e.time_s, 2), "text": f"{e.kind}: {e.text}"}
            for e in run.events
        ]
        entry, _ = evaluate_entry(path)
        summary = entry["summary"] or {}
        content["summary"] = {name: summary[name] for name in SHOWN if summary.get(name)}
        content["extremes"] = {name: entry["extremes"][name] for name in EXTREMES}
        content["verdict"], content["warnings"] = entry["verdict"], entry["warnings"]
        content["requirements"] = entry["requirements"]
        content["cycles"] = len(entry["cycles"])
        content["loop"] = _loop(path)
    except BadInput as error:
        content["problem"] = str(error)
    return content


def _loop(path: Path) -> dict[str, Any]:
    record, _ = load_run(path)
    whole = np.flatnonzero(np.isfinite(record.stroke_mm) & np.isfinite(record.force_kN))
    rows = whole[:: max(1, -(-len(whole) // LOOP_ROWS))]
    return {
        "t": np.round(record.time_s[rows], 3).tolist(),
        "s": np.round(record.stroke_mm[rows], 3).tolist(),
        "f": np.round(record.force_kN[rows], 3).tolist(),
    }


def main(folder: Path) -> None:
    """Write one line of JSON a run, in their order."""
    os.nice(10)
    for path in run_files([folder]):
        sys.stdout.write(json.dumps(describe(path, folder), allow_nan=False) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
