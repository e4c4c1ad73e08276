"""An evaluated run in the form in which it is sent between processes and stored: text and numbers.

Every run goes through it, whether it was evaluated here, on a cluster or long ago: they cannot differ. It
holds nothing that could be executed, so that a cache may lie where others can write.
"""

from __future__ import annotations

import json
import zlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from functools import cached_property
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from bufferstand.evaluation.across_runs import RecordingIdentity
from bufferstand.evaluation.across_runs.conformity import Candidate, Purpose, candidate_of
from bufferstand.evaluation.document import LIGHT, NUMBERS, cycle_numbers, cycle_rows, run_entry
from bufferstand.evaluation.facts import (
    Extreme,
    MeanLoop,
    Measured,
    RunEvaluation,
    RunFacts,
    StepResult,
    Summary,
    shared_of,
)

_HEAD = '{"run":{'
_QUICK = 1
"""Level of compression: the higher ones cost more time than they save."""


@dataclass(frozen=True)
class RequestedParts:
    """What will be asked for beyond facts, means and numbers: entries of the document, rows as CSV."""

    entries: bool = True
    rows: bool = True


@dataclass(frozen=True)
class StoredRun:
    """One run.

    Attributes
    ----------
    path : str
        As the user named it, readable (:func:`bufferstand.foundation.files.names.readable`); not part of what
        is kept, as a file may be moved.
    text : str
        Facts and means, JSON.
    cycles : bytes
        Numbers of the table of cycles, float64, shape (C, len(NUMBERS)).
    loop : bytes
        Mean loops of the run, or of each of its steps: strokes and forces of both branches, float64, shape
        (3, M) one after the other; empty where there is none.
    entry : bytes
        Entry of the evaluation document but for the path, compressed JSON; empty where it was not asked for.
    rows : str
        Numbers of the table of cycles as CSV (:func:`bufferstand.evaluation.document.tables.cycle_rows`);
        empty where it was not asked for.
    """

    path: str
    text: str
    cycles: bytes
    loop: bytes
    entry: bytes
    rows: str

    @cached_property
    def facts(self) -> dict[str, Any]:
        """Facts and means."""
        facts: dict[str, Any] = orjson.loads(self.text)
        return facts

    @property
    def candidate(self) -> Candidate:
        """What decides whether the run is a conformity test."""
        return Candidate(**{**self.facts["candidate"], "path": self.path})

    @property
    def recording(self) -> RecordingIdentity:
        """By what its recording is known again in another file."""
        facts = self.facts
        started = None if facts["started"] is None else datetime.fromisoformat(facts["started"])
        return RecordingIdentity(
            self.path, facts["id"], facts["sha256"], facts["samples_sha256"], facts["campaign"], started
        )

    @property
    def cycle_numbers(self) -> NDArray[np.float64]:
        """Numbers of the table of cycles, shape (C, len(NUMBERS))."""
        return np.frombuffer(self.cycles, dtype="<f8").reshape(-1, len(NUMBERS))

    def with_only(self, wanted: RequestedParts) -> StoredRun:
        """Return the run without what nobody will ask for: the larger part."""
        return replace(
            self, entry=self.entry if wanted.entries else b"", rows=self.rows if wanted.rows else ""
        )

    def entry_text(self, purpose: Purpose) -> str:
        """Return the entry of the document as JSON text, on one line; its purpose hangs on the other runs."""
        text = zlib.decompress(self.entry).decode()
        path = json.dumps(self.path, ensure_ascii=False)
        of = json.dumps(purpose.entry(), ensure_ascii=False)
        return f'{_HEAD}"path":{path},{text[len(_HEAD) : -1]},{of[1:]}'

    def light(self) -> RunEvaluation:
        """Return the result without samples and cycles, from which trends and comparisons are made."""
        facts = self.facts
        steps = facts["steps"]
        loops = _curves(self.loop, [facts, *steps])
        return replace(
            LIGHT,
            facts=RunFacts(
                id=facts["id"],
                kind=facts["kind"],
                path=self.path,
                sha256=facts["sha256"],
                simulated=facts["simulated"],
                specimen=facts["specimen"],
                started=None if facts["started"] is None else datetime.fromisoformat(facts["started"]),
                proof_load=facts["proof_load"],
            ),
            summary=_summary(facts),
            verdict=facts["verdict"],
            preload=None if facts["preload"] is None else Measured(*facts["preload"]),
            mean_loop=_loop(facts["loop"], loops[0]),
            steps=tuple(
                StepResult(
                    index=step["index"],
                    start_s=step["start_s"],
                    end_s=step["end_s"],
                    cycles=tuple(step["cycles"]),
                    summary=_summary(step),
                    mean_loop=_loop(step["loop"], curves),
                    shared_errors=shared_of(step["shared_errors"]),
                )
                for step, curves in zip(steps, loops[1:], strict=True)
            ),
            shared_errors=shared_of(facts["shared_errors"]),
        )


def keep(run: RunEvaluation) -> StoredRun:
    """Return a run in the form in which it is kept."""
    entry = run_entry(run)
    of_run = {key: value for key, value in entry["run"].items() if key != "path"}
    text = _json({**entry, "run": of_run})
    assert text.startswith(_HEAD.encode())
    loops = [_worth_keeping(loop) for loop in (run.mean_loop, *(step.mean_loop for step in run.steps))]
    curves = b"".join(
        np.stack((loop.stroke_mm, loop.loading_kN, loop.unloading_kN)).tobytes() for loop in loops if loop
    )
    numbers = cycle_numbers(entry)
    return StoredRun(
        path=run.facts.path,
        text=_json(_facts(entry, run)).decode(),
        cycles=numbers.tobytes(),
        loop=curves,
        entry=zlib.compress(text, _QUICK),
        rows=cycle_rows(numbers),
    )


def _worth_keeping(loop: MeanLoop | None) -> MeanLoop | None:
    """Return a loop that can be compared with others: one whose temperature is known."""
    return loop if loop is not None and loop.temperature_C is not None else None


def _facts(entry: Mapping[str, Any], run: RunEvaluation) -> dict[str, Any]:
    limits = entry["limit_set"]
    return {
        "id": run.facts.id,
        "kind": run.facts.kind,
        "specimen": dict(run.facts.specimen),
        "sha256": run.facts.sha256,
        "samples_sha256": run.facts.samples_sha256,
        "campaign": run.facts.campaign,
        "simulated": run.facts.simulated,
        "started": None if run.facts.started is None else run.facts.started.isoformat(),
        "status": run.facts.status,
        "proof_load": run.facts.proof_load,
        "cycles": len(run.cycles),
        **_of_summary(run.summary, run.mean_loop),
        "extremes": _of_extremes(run.extremes),
        "steps": [
            {
                "index": step.index,
                "start_s": step.start_s,
                "end_s": step.end_s,
                "cycles": list(step.cycles),
                **_of_summary(step.summary, step.mean_loop),
                "extremes": _of_extremes(step.extremes),
                "shared_errors": None if step.shared_errors is None else step.shared_errors.entry(),
            }
            for step in run.steps
        ],
        "verdict": run.verdict,
        "preload": None if run.preload is None else (run.preload.value, run.preload.expanded_uncertainty),
        "candidate": asdict(candidate_of(run)),
        "requirements": dict(Counter(row.verdict for row in run.requirements)),
        "limit_set": None if limits is None else {"id": limits["id"], "sha256": limits["sha256"]},
        "warnings": len(run.warnings),
        "shared_errors": entry["shared_errors"],
    }


def _of_extremes(extremes: Mapping[str, Extreme]) -> dict[str, Any]:
    return {n: (e.value, e.expanded_uncertainty, e.time_s, bool(e.doubt)) for n, e in extremes.items()}


def _of_summary(summary: Summary, loop: MeanLoop | None) -> dict[str, Any]:
    """Return what is kept of the figures that stand for a run or a step."""
    kept = _worth_keeping(loop)
    return {
        "cycles_used": list(summary.cycles_used),
        "means": {n: (m.value, m.expanded_uncertainty, m.half_width_95) for n, m in summary.values.items()},
        "loop": None
        if kept is None
        else {
            "cycles": list(kept.cycles),
            "temperature_C": kept.temperature_C,
            "temperature_accuracy_C": kept.temperature_accuracy_C,
            "means": dict(kept.means),
            "expanded_uncertainties": dict(kept.expanded_uncertainties),
        },
    }


def _summary(facts: Mapping[str, Any]) -> Summary:
    means = facts["means"].items()
    values = {name: Measured(value, U, half_width_95=half) for name, (value, U, half) in means}
    return Summary(tuple(facts["cycles_used"]), values)


def _curves(kept: bytes, parts: Sequence[Mapping[str, Any]]) -> list[NDArray[np.float64] | None]:
    """Return the curves of run and steps, shape (3, M) each; None of one whose loop was not kept."""
    there = [part["loop"] is not None for part in parts]
    if not any(there):
        return [None] * len(parts)
    loops = iter(np.frombuffer(kept, dtype="<f8").reshape(sum(there), 3, -1))
    return [next(loops) if own else None for own in there]


def _loop(facts: Mapping[str, Any] | None, curves: NDArray[np.float64] | None) -> MeanLoop | None:
    if facts is None or curves is None:
        return None
    stroke, loading, unloading = curves
    return MeanLoop(
        cycles=tuple(facts["cycles"]),
        stroke_mm=stroke,
        loading_kN=loading,
        unloading_kN=unloading,
        temperature_C=facts["temperature_C"],
        temperature_accuracy_C=facts["temperature_accuracy_C"],
        means=facts["means"],
        expanded_uncertainties=facts["expanded_uncertainties"],
    )


def _json(content: Any) -> bytes:
    return orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY)
