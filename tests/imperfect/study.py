"""Many records: made, written, imported, evaluated, judged; and the tables of what came of it."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
import traceback
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from bufferstand.evaluation.document.python_api import evaluate, import_record
from bufferstand.recording.foreign.import_options import ImportOptions

from . import world
from .judge import judge
from .judgement import COUNTED, FALSE, Judgement

DRAWS = 1000


def one(number: int, only: str | None = None, out: Path | None = None) -> Judgement:
    """Make, import, evaluate and judge one record; with `out` its files stay there."""
    folder = out or Path(tempfile.mkdtemp(prefix="imperfect-"))
    try:
        try:
            scene = world.make(number, only)
            files = world.write(scene, folder)
        except Exception:  # noqa: BLE001 - a fault of the world itself is said apart
            j = Judgement(number, [])
            j.say("generator", "no record", traceback.format_exc()[-1500:])
            return j
        begun = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # what a user would see on standard error is a finding, too
                imported = import_record(files.record, folder / "runs", ImportOptions(mapping=files.mapping))
                document = evaluate(imported.path, draws=DRAWS)
        except Exception as e:  # noqa: BLE001 - whatever it is, it is a finding
            j = Judgement(number, [a.name for a in scene.applied])
            if _is_bug(e):
                j.say("crash", type(e).__name__, traceback.format_exc()[-1500:])
            else:
                j.say("refused record", "BadInput", str(e)[:500])
            return j
        if out is not None:
            (out / f"r{number:06d}.json").write_text(json.dumps(document, indent=1, default=str))
        spent = time.process_time() - begun
        j = judge(scene, document, list(imported.warnings))
        j.seconds = spent
        return j
    finally:
        if out is None:
            shutil.rmtree(folder, ignore_errors=True)


def _is_bug(e: Exception) -> bool:
    return type(e).__name__ != "BadInput"


def many(numbers: Iterable[int], jobs: int = 1, only: str | None = None) -> list[Judgement]:
    """Judge many records, in processes of their own if `jobs` is more than one."""
    if jobs == 1:
        return [one(n, only) for n in numbers]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(partial(one, only=only), numbers, chunksize=20))


def coverage(judgements: Iterable[Judgement]) -> dict[str, tuple[int, float, float]]:
    """Return, by figure, how many there are, the share within U, and the share within 1.5 U (in per cent)."""
    ratios = defaultdict(list)
    for j in judgements:
        for name, ratio in j.ratios:
            ratios[name].append(abs(ratio))
    return {
        name: (len(r), 100.0 * sum(v <= 1.0 for v in r) / len(r), 100.0 * sum(v <= 1.5 for v in r) / len(r))
        for name, r in sorted(ratios.items())
    }


def by_kind(judgements: Iterable[Judgement]) -> dict[str, Counter[str]]:
    """Return, by kind of imperfection, how many records it was in and how many had which findings."""
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for j in judgements:
        for kind in j.kinds or ["(none)"]:
            row = table[kind]
            row["records"] += 1
            row["cycles"] += j.whole
            row["refused"] += j.refused
            for category in {c for c, _, _ in j.findings}:
                row[category] += 1
            inside = [abs(r) <= 1.0 for _, r in j.ratios]
            row["figures"] += len(inside)
            row["inside"] += sum(inside)
    return dict(sorted(table.items()))


def tables(judgements: list[Judgement], seconds: float | None = None) -> str:
    """Return the tables as Markdown."""
    columns = ["records", *FALSE, *COUNTED]
    lines = [
        "| kind | " + " | ".join(columns) + " | cycles refused % | within U % |",
        "|---|" + "---|" * (len(columns) + 2),
    ]
    everything: Counter[str] = Counter()
    for j in judgements:
        everything["records"] += 1
        for category in {c for c, _, _ in j.findings}:
            everything[category] += 1
    for kind, row in by_kind(judgements).items():
        share = f"{100.0 * row['refused'] / row['cycles']:.1f}" if row["cycles"] else ""
        inside = f"{100.0 * row['inside'] / row['figures']:.1f}" if row["figures"] else ""
        lines.append(f"| {kind} | " + " | ".join(str(row[c]) for c in columns) + f" | {share} | {inside} |")
    lines.append("| **all** | " + " | ".join(str(everything[c]) for c in columns) + " | | |")
    lines += ["", "| figure | number | within U % | within 1.5 U % |", "|---|---|---|---|"]
    for name, (count, inside_U, more) in coverage(judgements).items():
        lines.append(f"| {name} | {count} | {inside_U:.1f} | {more:.1f} |")
    if seconds is not None:
        longest = max(judgements, key=lambda j: j.seconds)
        slow = f"longest evaluation: {longest.seconds:.1f} s of processor time (record {longest.number})"
        lines += ["", f"{len(judgements)} records in {seconds:.0f} s; {slow}"]
    return "\n".join(lines)


def examples(judgements: list[Judgement], most: int = 4) -> str:
    """Return, by category and what, how often and in which records; single faults first."""
    found: dict[tuple[str, str], list[tuple[Judgement, str]]] = defaultdict(list)
    for j in judgements:
        for category, what, detail in j.findings:
            found[category, what.split(" of stroke ")[0]].append((j, detail))
    lines = []
    for (category, what), hits in sorted(found.items(), key=lambda item: (item[0][0], -len(item[1]))):
        kinds: Counter[str] = Counter(k for j, _ in hits for k in (j.kinds or ["(none)"]))
        records = {j.number for j, _ in hits}
        lines.append(
            f"- **{category}: {what}** — {len(hits)} in {len(records)} records; {dict(kinds.most_common(5))}"
        )
        for j, detail in sorted(hits, key=lambda hit: len(hit[0].kinds))[:most]:
            lines.append(f"  - {j.number} {j.kinds}: {detail[:330]}".replace("\n", " "))
    return "\n".join(lines)


def run(first: int, count: int, jobs: int, only: str | None, report: Path | None) -> str:
    """Do a study and return its report."""
    begun = time.monotonic()
    judgements = many(range(first, first + count), jobs, only)
    text = tables(judgements, time.monotonic() - begun) + "\n\n" + examples(judgements) + "\n"
    if report is not None:
        report.write_text(text)
        rows: list[dict[str, Any]] = [asdict(j) for j in judgements]
        report.with_suffix(".json").write_text(json.dumps(rows))
    return text
