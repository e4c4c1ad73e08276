"""The golden figures as today's code gives them: evaluations, tables, plans, reports, simulated runs.

Each function returns plain JSON. What depends on the day, the place or the version is left out by name.
``python -m tests.golden.figures FILE.json.gz`` writes them all, for a figure that is to change on purpose.
"""

from __future__ import annotations

import csv
import gzip
import json
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any
from unittest import mock

from bufferstand.cli.main import bufferstand
from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content.content import Content
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.specimens import side_by_side
from bufferstand.foundation.files.hashes import content_hash
from bufferstand.recording.runfile.file import read_metadata
from tests.daq.cases import Lines
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.evaluation_report.make_runs import PAPER_LIKE, write_campaign
from tests.golden.direct_stand import open_direct

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "sample_runs"
SHARED = ROOT.parent / "shared" / "data"

VOLATILE = frozenset(
    {
        "software",  # versions and hash of the code and its libraries
        "version",  # the same, in a table
        "path",  # where a run file lies
        "report_id",  # a hash over names of classes and the version, too; what it stands for is compared here
        "started_utc",
        "ended_utc",
        "imported_utc",
        "found",  # when a zero was
        "entry/anchors/utc",
        "recorder",  # how long the disk took
        "sealed_from",  # the journal, whose frames hold times of the day
        "content_sha256",  # over all of these
    }
)
"""Keys, at any depth, of what is no figure: it depends on the day, the place or the version."""

SIMULATED = """
[campaign]
id = "golden"
stand = "samples/stand.toml"
specimen = "samples/specimens/category-a-elastomer.toml"

[[step]]
kind = "static"
speed_mm_per_s = 10.0
force_limit_kN = 300.0
cycles = 2

[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 1.0
cycles = 5

[[step]]
kind = "force-cycles"
force_min_kN = 20.0
force_max_kN = 100.0
speed_mm_per_s = 20.0
cycles = 2
"""


def lasting(value: Any) -> Any:
    """Return JSON without what :data:`VOLATILE` names."""
    if isinstance(value, dict):
        return {key: lasting(inner) for key, inner in value.items() if key not in VOLATILE}
    return [lasting(inner) for inner in value] if isinstance(value, list) else value


def command(*words: object) -> None:
    """Run a command in this process."""
    status = bufferstand.main([str(word) for word in words], "bufferstand", standalone_mode=False)
    assert status in (0, None), (words, status)


def evaluated(folder: Path, paths: Path, *options: str) -> dict[str, Any]:
    """Return what ``bufferstand evaluate`` writes: the document, a row a cycle, a row a run."""
    out, cycles, runs = (folder / name for name in ("out.json", "cycles.csv", "runs.csv"))
    words = ("--no-cache", "--jobs", "1", "--json", out, "--table", cycles, "--run-table", runs, *options)
    command("evaluate", paths, *words)
    tables = {}
    for table in (cycles, runs):
        with table.open(encoding="utf-8", newline="") as stream:
            tables[table.stem] = list(csv.DictReader(stream))
    return {"document": json.loads(out.read_text(encoding="utf-8")), **tables}


def evaluated_samples(folder: Path) -> dict[str, Any]:
    return evaluated(folder, SAMPLES / "runs")


def evaluated_with_options(folder: Path) -> dict[str, Any]:
    options = ("--decision-rule", "guard-band", "--moving-mass", "80", "--draws", "200")
    return evaluated(folder, SAMPLES / "runs", *options)


def evaluated_paper_like(folder: Path) -> dict[str, Any]:
    return evaluated(folder, write_campaign(folder / "campaign"), "--draws", "200")


def imported(folder: Path, record: Path, *options: str) -> dict[str, Any]:
    command("import", record, "--out", folder / "runs", *options)
    return evaluated(folder, folder / "runs")


def imported_sample(folder: Path) -> dict[str, Any]:
    return imported(folder, SAMPLES / "records" / "harmonic.csv")


def friction_damper(folder: Path, frequency: str) -> dict[str, Any]:
    columns = ("--column", "stroke=Displacement [in]", "--column", "force=Friction Force [kip]")
    return imported(folder, SHARED / f"friction_damper_{frequency}.csv", *columns)


def friction_damper_1Hz(folder: Path) -> dict[str, Any]:  # noqa: N802 - the unit's own letters
    return friction_damper(folder, "1Hz")


def friction_damper_half_Hz(folder: Path) -> dict[str, Any]:  # noqa: N802
    return friction_damper(folder, "0.5Hz")


def planned(folder: Path) -> dict[str, Any]:
    """Return the plans of the sample campaigns, but for the one whose order takes half a minute to find."""
    plans = {}
    for name in ("demo", "en15551", "fig9", "paper"):
        plan, _ = sample_plan(SAMPLES / f"{name}.toml")
        plans[name] = json.loads(json.dumps(plan.as_dict()))
    return plans


def said(content: Content) -> dict[str, Any]:
    """Return what a report says, and of each figure a hash of what it draws."""
    drawn = [content_hash(picture.plot.facts()) for picture in content.pictures()]
    return {**_without_its_evaluations_hash(content.document()), "drawn": drawn}


def _without_its_evaluations_hash(document: dict[str, Any]) -> dict[str, Any]:
    """Leave out the hash of the evaluation inside the PDF: it is over versions of code and libraries, too."""
    (data,) = (section for section in document["sections"] if section["id"] == "data")
    for row in data["blocks"][0]["rows"]:
        if row[1]["text"].startswith("evaluation"):
            row[2]["text"] = "a hash"
    return document


def reported_samples(folder: Path) -> dict[str, Any]:
    model = SAMPLES / "models" / "category-a-elastomer.toml"
    return said(build_content(read_source(SAMPLES / "runs", None, Given(model=model))))


def reported_paper_like(folder: Path) -> dict[str, Any]:
    given = Given(options=Options(draws=200))
    return said(build_content(read_source(write_campaign(folder / "campaign"), None, given)))


def reported_side_by_side(folder: Path) -> dict[str, Any]:
    runs, given = PAPER_LIKE[:4], Given(options=Options(draws=200), fields=ReportFields())
    sources = [
        read_source(write_campaign(folder / specimen, runs, rate_Hz=rate_Hz, specimen=specimen), None, given)
        for specimen, rate_Hz in (("KX-0815", 200.0), ("KX-0816", 190.0))
    ]
    return said(build_comparison(side_by_side(sources, given.fields)))


def at_once(pool: ThreadPoolExecutor, work: Callable[..., Any], /, *words: Any, **named: Any) -> Future[Any]:
    """Do the work of a thread here and now: how many passes fit beside it would depend on the machine."""
    done: Future[Any] = Future()
    try:
        done.set_result(work(*words, **named))
    except BaseException as error:  # noqa: BLE001 - as the pool does
        done.set_exception(error)
    return done


def simulated(folder: Path) -> dict[str, Any]:
    """Return the metadata of the run files of a campaign in virtual time: they hold each dataset's hash."""
    campaign = folder / "campaign.toml"
    campaign.write_text(SIMULATED, encoding="utf-8")
    (folder / "samples").symlink_to(SAMPLES)
    plan, stand_file = sample_plan(campaign)
    opened = open_direct(stand_file)
    with mock.patch.object(ThreadPoolExecutor, "submit", at_once):
        outcome = run_campaign(
            plan, opened.stand, opened.clock, folder / "out", facts_of(stand_file),
            progress=Lines(), settings=COARSE,
        )  # fmt: skip
    opened.stand.close()
    return {run.stem: json.loads(json.dumps(read_metadata(run))) for run in outcome.runs}


FIGURES: dict[str, Callable[[Path], dict[str, Any]]] = {
    function.__name__: function
    for function in (
        evaluated_samples,
        evaluated_with_options,
        evaluated_paper_like,
        imported_sample,
        friction_damper_1Hz,
        friction_damper_half_Hz,
        planned,
        reported_samples,
        reported_paper_like,
        reported_side_by_side,
        simulated,
    )
}
"""Name → how to make it in an empty folder."""


def made(name: str, folder: Path) -> dict[str, Any]:
    """Return one of the golden figures as today's code gives it."""
    figures = lasting(FIGURES[name](folder))
    text = json.dumps(figures).replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    whole = json.loads(text)
    assert isinstance(whole, dict)
    return whole


def write(file: Path) -> None:
    """Write all figures, the same bytes each time."""
    whole = {}
    for name in FIGURES:
        with tempfile.TemporaryDirectory() as folder:
            whole[name] = made(name, Path(folder))
    text = json.dumps(whole, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    file.write_bytes(gzip.compress(text.encode(), compresslevel=9, mtime=0))


if __name__ == "__main__":
    write(Path(sys.argv[1]))
