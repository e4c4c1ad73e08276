"""What is on record of one run, not evaluated: facts, channels, events, and its samples thinned out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording.runfile import Run, open_run, simulated_of

POINTS = 1200
MOST_EVENTS = 300
MOST_ROWS = 4_000_000
"""Of a longer run no curve is drawn here: it would hold up the page."""


def run_facts(path: Path) -> dict[str, Any]:
    """Return what a page shows of a run; may block.

    Raises
    ------
    BadInput
        If it is no run file, or is damaged.
    """
    run = open_run(path)
    return {
        "id": run.id,
        "kind": run.kind,
        "status": run.status,
        "reason": run.reason,
        "simulated": simulated_of(run.metadata),
        "facts": [(name, str(value)) for name, value in _facts(run) if value],
        "channels": [
            {
                "name": channel.name,
                "quantity": channel.quantity,
                "unit": channel.unit,
                "rows": stream.rows,
                "stream": stream.name,
            }
            for stream in run.streams.values()
            for channel in stream.channels.values()
        ],
        "events": [
            {"at_s": None if one.time_s is None else round(one.time_s, 2), "kind": one.kind, "text": one.text}
            for one in list(run.events)[:MOST_EVENTS]
        ],
        "curve": _curve(run),
    }


def _facts(run: Run) -> list[tuple[str, Any]]:
    specimen, stated = run.specimen, run.metadata["run"]
    kind = [str(specimen[key]) for key in ("kind", "category", "elastic_system") if specimen.get(key)]
    return [
        ("specimen", specimen.get("id")),
        ("which is", ", ".join(kind)),
        ("campaign", stated.get("campaign")),
        ("step", run.step.get("name")),
        ("started", stated.get("started_utc") or ""),
        ("operator", stated.get("operator")),
    ]


def _curve(run: Run) -> dict[str, Any]:
    """Return time, stroke and force of some samples; empty where there are none."""
    wires = [name for name in ("stroke", *STROKE_CHANNELS) if run.has(name)]
    if not wires or not run.has("force"):
        return {"t": [], "s": [], "f": []}
    stream = run.stream_of(wires[0])
    if stream.rows == 0 or stream.rows > MOST_ROWS or run.stream_of("force").rows != stream.rows:
        return {"t": [], "s": [], "f": []}
    try:
        stroke, force = run.series(wires[0]), run.series("force")
    except BadInput:
        return {"t": [], "s": [], "f": []}
    whole = np.flatnonzero(np.isfinite(stroke.value) & np.isfinite(force.value))
    rows = whole[:: max(1, -(-whole.size // POINTS))]
    return {
        "t": np.round(stroke.time_s[rows], 3).tolist(),
        "s": np.round(stroke.value[rows], 3).tolist(),
        "f": np.round(force.value[rows], 3).tolist(),
    }
