"""Each public record as a user would have it: imported, evaluated, its loop areas compared."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bufferstand.evaluation.document.build import evaluate_file
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.foreign.import_options import ImportOptions
from bufferstand.recording.foreign.importing import import_file
from tests.public_records.independent import area_between
from tests.public_records.sources import Record

LEAST_SAMPLES = 100
"""Cycles of fewer samples are not compared: of 50 a polygon encloses 0.26 % too little by itself …"""
CLOSED = 0.02
"""… nor are loops that do not close within this share of their range: how one closes them is a choice."""


@dataclass(frozen=True)
class Result:
    """What became of a record. ``worst`` is the largest relative difference of the ``compared`` loop areas,
    ``refused`` why nothing was evaluated, ``unevaluated`` reasons of the cycles that were not.
    """

    record: Record
    cycles: int = 0
    complete: int = 0
    compared: int = 0
    worst: float | None = None
    refused: str = ""
    unevaluated: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The result in words."""
        if self.refused:
            return f"refused: {self.refused}"
        if not self.complete:
            none = [text for text in self.warnings if text.startswith("no cycle found")]
            reasons = "; ".join(dict.fromkeys(self.unevaluated)) or "; ".join(none or self.warnings[-1:])
            return f"no cycle evaluated: {reasons}"
        worst = "" if self.worst is None else f", {self.compared} areas within {100.0 * self.worst:.3f} %"
        return f"{self.complete} of {self.cycles} cycles{worst}"


def evaluate(record: Record, options: ImportOptions | None = None) -> Result:
    """Import and evaluate one record; whatever is refused says why."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mapping = folder / "mapping.toml"
        if record.mapping:
            mapping.write_text(record.mapping, encoding="utf-8")
        try:
            imported = import_file(
                record.csv(folder),
                folder / "runs",
                options
                or ImportOptions(
                    kind="harmonic",
                    mapping=mapping if record.mapping else None,
                    sample_rate_hz=record.sample_rate_Hz,
                ),
            )
            run = evaluate_file(imported.path)
        except BadInput as error:
            return Result(record, refused=error.problem)
    done = [result for result in run.cycles if result.cycle.complete]
    time_s, stroke, force = run.record.time_s, run.record.stroke_mm, run.record.force_kN
    differences = []
    largest = max((abs(r.quantities.absorbed_energy_J or 0.0) for r in done), default=0.0)
    for result in done:
        found = result.quantities.absorbed_energy_J
        samples = np.count_nonzero((time_s > result.cycle.start_s) & (time_s < result.cycle.end_s))
        if found is None or samples < LEAST_SAMPLES or _opens(result.cycle):
            continue
        own = area_between(time_s, stroke, force, result.cycle.start_s, result.cycle.end_s)
        # A loop of nearly no area is compared by the largest of the record.
        differences.append(abs(found - own) / max(abs(own), 0.02 * largest, 1e-12))
    return Result(
        record,
        len(run.cycles),
        len(done),
        len(differences),
        float(np.max(differences)) if differences else None,
        "",
        tuple(reason for result in run.cycles if not result.cycle.complete for reason in result.cycle.why),
        run.warnings,
    )


def _opens(cycle: Cycle) -> bool:
    return abs(cycle.stroke_end_mm - cycle.stroke_min_mm) > CLOSED * cycle.range_mm
