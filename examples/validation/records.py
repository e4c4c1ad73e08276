"""Reads the records of the standard data sets without bufferstand: plain CSV with known headers only."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
HEADERS = ["time [s]", "stroke [mm]", "force [kN]"]


def plain_records(folder: Path) -> Iterator[tuple[str, dict[str, Any], FloatArray, FloatArray, FloatArray]]:
    """Yield id, truth, time, stroke and force of each set that is plain CSV and needs no option.

    Rows with a blank among the three are left out, and so is a row that does not advance in time: a plain
    script does no better.
    """
    for path in sorted(folder.rglob("truth.json")):
        truth = json.loads(path.read_text(encoding="utf-8"))
        record = path.parent / "record.csv"
        if truth["options"].keys() - {"decision_rule"} or (path.parent / "mapping.toml").exists():
            continue
        with record.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.reader(stream))
        if rows[0][:3] != HEADERS:
            continue
        kept = [[float(cell) for cell in row[:3]] for row in rows[1:] if all(row[:3])]
        time_s, stroke, force = np.array(kept, dtype=np.float64).T
        later = np.concatenate(([True], np.diff(np.maximum.accumulate(time_s)) > 0.0))
        yield truth["id"], truth, time_s[later], stroke[later], force[later]
