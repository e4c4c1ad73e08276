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

from bufferstand.daq.monitor.campaign_view import event_line, page_words
from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.document import evaluate_entry
from bufferstand.evaluation.loading import load_run
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import facts_of, run_files
from bufferstand.recording.runfile import open_run

LOOP_ROWS = 1500
"""Rows of a loop on the screen."""
COLUMNS = [
    {
        "name": entry.name,
        "heading": entry.shown.monitor.heading,
        "unit": "" if entry.unit == "1" else entry.unit,
        "decimals": entry.shown.monitor.decimals,
    }
    for entry in QUANTITIES
    if entry.shown.monitor is not None
]
"""Means over cycles that the page has a column of; after them come …"""
EXTREMES = ("stroke_max_mm", "force_max_kN", "temperature_max_C")
"""… greatest values over all samples of the run."""


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
        "columns": COLUMNS,
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
        content["reason"] = page_words(run.reason)
        content["events"] = [
            {
                "at_s": None if e.time_s is None else round(e.time_s, 2),
                "text": event_line(e.kind, e.text),
            }
            for e in run.events
        ]
        evaluated, _ = evaluate_entry(path)
        summary = evaluated["summary"] or {}
        content["summary"] = {name: summary[name] for name in QUANTITIES.names if summary.get(name)}
        content["extremes"] = {name: evaluated["extremes"][name] for name in EXTREMES}
        content["verdict"], content["warnings"] = evaluated["verdict"], evaluated["warnings"]
        content["requirements"] = evaluated["requirements"]
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
