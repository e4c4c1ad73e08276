"""An identified spring model as a JSON document: parameters, intervals or why there is none, cycles."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from bufferstand.model.identification import LAWS, CycleCheck, Estimate, Identification

SCHEMA = "bufferstand/model-fit/1"


def document_of(found: Identification) -> dict[str, Any]:
    """Return what ``model fit --json`` writes.

    A parameter that the runs do not tell has ``interval_95: null`` and says ``why``. ``of_prior`` is the
    standard deviation after the runs over the one before them (docs/identification.md).
    """
    symbols = {law.name: law.symbol for law in LAWS}
    why = {unknown.name: unknown.why for unknown in found.unknown}
    laws = [e for e in found.estimates if e.name in symbols]
    curves = [e for e in found.estimates if e.name not in symbols]
    return {
        "schema": SCHEMA,
        "model": found.model.name,
        "parameters": [{**_estimate(e), "symbol": symbols[e.name], "why": why.get(e.name)} for e in laws],
        "curves": [_estimate(e) for e in curves],
        "held_out": [_cycle(check) for check in found.held_out],
        "cycles": [_cycle(check) for check in found.cycles],
        "notes": list(found.notes),
    }


def _estimate(estimate: Estimate) -> dict[str, Any]:
    known = estimate.low is not None and estimate.high is not None
    return {
        "name": estimate.name,
        "unit": estimate.unit or "1",
        "value": estimate.value,
        "interval_95": [estimate.low, estimate.high] if known else None,
        "of_prior": estimate.of_prior,
        "at_bound": estimate.at_bound,
    }


def _cycle(check: CycleCheck) -> dict[str, Any]:
    return {**asdict(check), "stroke_mm": list(check.stroke_mm)}
