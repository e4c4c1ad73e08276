"""The catalogue of quantities: each entry keeps its contract, and a further one is one more file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from bufferstand.evaluation.archive.run_queries import FIELDS
from bufferstand.evaluation.archive.tables import RUN_COLUMNS
from bufferstand.evaluation.catalogue.cycle_quantities import NOWHERE
from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from bufferstand.evaluation.catalogue.quantity import Catalogue, Incomplete, Quantity, Shown
from bufferstand.evaluation.document.build import evaluate_entry, evaluation_document
from bufferstand.evaluation.document.tables import NUMBERS
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import make_record
from bufferstand.evaluation.report.content.numbers import quantity_cell
from bufferstand.evaluation.run.evaluate import evaluate_run
from tests.docs.symbols_page import PAGE, row
from tests.evaluation.signals import STATED, Ellipse
from tests.house.house_page import example_of, package_with, source_of

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "sample_runs" / "runs"
OF_A_NAME = pytest.mark.parametrize("entry", QUANTITIES, ids=QUANTITIES.names)


@cache
def entry_of_a_run(*, broken: bool = False) -> dict[str, Any]:
    """Return the document's entry of a harmonic run; of a broken one no force stores any energy."""
    time, stroke, force = Ellipse().columns(1.0, 200.0, 4.5)
    record = make_record(time, stroke, -force if broken else force)
    run = evaluate_run(record, RunFacts("run", "harmonic", **STATED))  # type: ignore[arg-type]
    (entry,) = evaluation_document([run])["runs"]
    return dict(entry)


# --- an entry says everything -----------------------------------------------------------------------


def _facts(entry: Any) -> dict[str, Any]:
    return {field.name: getattr(entry, field.name) for field in fields(entry)}


DAMPING = QUANTITIES.named("damping")


@pytest.mark.parametrize("field", [field.name for field in fields(Quantity)])
def test_an_entry_that_leaves_a_field_out_is_refused(field: str) -> None:
    facts = _facts(DAMPING)
    del facts[field]
    with pytest.raises(TypeError, match=f"'{field}'"):
        Quantity(**facts)
    with pytest.raises(Incomplete, match=f"^quantity “{'None' if field == 'name' else 'damping'}”: {field} "):
        replace(DAMPING, **{field: None})


@pytest.mark.parametrize("field", [field.name for field in fields(Shown)])
def test_an_entry_that_does_not_say_where_it_is_shown_is_refused(field: str) -> None:
    facts = _facts(DAMPING.shown)
    del facts[field]
    with pytest.raises(TypeError, match=f"'{field}'"):
        Shown(**facts)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"label": ""}, "label is missing"),
        ({"path": ()}, "path is missing"),
        ({"path": ("a", "b", "c")}, "path is a key, or a group and a key"),
        ({"kinds": frozenset()}, "kinds is missing"),
        ({"unit": "kJ"}, "unit “kJ” is none of"),
        ({"needs": "luck"}, "needs “luck” is none of"),
        ({"kinds": frozenset({"crash"})}, "unknown kind of run or channel: crash"),
        ({"reads": frozenset({"colour"})}, "unknown kind of run or channel: colour"),
        ({"compute": 1.0}, "must be functions"),
        ({"symbol": ""}, "a main result needs a symbol"),
        ({"kinds": frozenset({"static"})}, "a trend over frequency is of harmonic runs"),
        ({"shown": NOWHERE}, "shown.heading is missing"),
    ],
)
def test_an_entry_that_contradicts_itself_is_refused_by_name(change: dict[str, Any], why: str) -> None:
    with pytest.raises(Incomplete, match=f"^quantity “damping”: .*{why}"):
        replace(DAMPING, **change)


def test_two_entries_cannot_have_one_name_or_place() -> None:
    with pytest.raises(Incomplete, match="“damping”: its name is another's"):
        Catalogue([DAMPING, DAMPING])
    with pytest.raises(Incomplete, match="“damping”: its path is another's"):
        Catalogue([DAMPING, replace(DAMPING, name="more")])


# --- a walk over the catalogue ----------------------------------------------------------------------


@OF_A_NAME
def test_it_is_in_the_document_with_its_uncertainty_or_the_reasons(entry: Quantity) -> None:
    steady = [cycle for cycle in entry_of_a_run()["cycles"] if cycle["steady"]]
    assert len(steady) >= 2
    for cycle in steady:
        value, U = entry.value_in(cycle), cycle["expanded_uncertainty"].get(entry.name)
        if value is None:
            assert entry.needs == "thermometer"
            assert cycle["missing"][entry.name] == "no sensor on the specimen is on record"
        else:
            assert entry.name not in cycle["missing"]
            assert U is not None or cycle["missing"][f"U({entry.name})"]


@OF_A_NAME
def test_what_is_missing_carries_its_reason(entry: Quantity) -> None:
    run = entry_of_a_run(broken=True)
    for part in (*run["cycles"], {**run["summary"], "missing": run["missing"]}):
        value = part.get(entry.name) if entry.path[0] not in part else entry.value_in(part)
        value = value["value"] if isinstance(value, dict) else value
        assert (value is None) == (entry.name in part["missing"])
        assert part["missing"].get(entry.name, "said") != ""


def test_the_reason_is_the_one_that_was_decided_where_it_is_computed() -> None:
    run = entry_of_a_run(broken=True)
    (cycle, *_) = (cycle for cycle in run["cycles"] if cycle["steady"])
    assert cycle["missing"]["damping"].startswith("the stored energy is not positive (-")
    assert cycle["missing"]["loss_factor"] == "the storage stiffness is not positive"
    assert run["missing"]["damping"] == f"cycle {cycle['index']}: {cycle['missing']['damping']}"


@OF_A_NAME
def test_it_is_in_the_tables_and_can_be_asked_for(entry: Quantity) -> None:
    assert entry.name in NUMBERS
    assert {entry.name, f"U({entry.name})"} <= set(RUN_COLUMNS)
    assert {entry.name, f"mean_{entry.name}", f"measured_{entry.name}"} & set(FIELDS)
    assert (f"U({entry.name})" in NUMBERS) == entry.shown.main


@OF_A_NAME
def test_it_is_rounded_and_documented(entry: Quantity) -> None:
    assert row(entry) in PAGE.read_text(encoding="utf-8").splitlines(), (
        "run: python -m tests.docs.symbols_page"
    )
    assert quantity_cell(entry.name, 1.0, "").tone == "number"
    assert quantity_cell(entry.name, None, "it is not there").why == "it is not there"


# --- one more quantity ------------------------------------------------------------------------------

FURTHER = '''
"""How far the branches of a loop are apart."""

from dataclasses import replace

from bufferstand.evaluation.catalogue.quantity import InCycles, OnScreen, Rounding, Settled, Trended
from bufferstand.evaluation.catalogue.cycle_quantities import NOWHERE, of_loop

ENTRIES = [
    of_loop(
        "hysteresis_kN", "F_h", "Hysteresis", "kN", "mean distance of both branches: W_a over the range",
        replace(
            NOWHERE, main=True, heading="Hysteresis Fₕ", cycles=InCycles("energy", 9), beside_loops=True,
            runs="mean", compared="Hysteresis Fₕ", before_after=True, settled=Settled(9, "Fₕ"),
            trend=Trended("hysteresis", "Hysteresis", "Hysteresis [kN]", amplitudes=False, two_sided=True),
            terminal=OnScreen("hysteresis\\nkN", 1), archive=OnScreen("hysteresis", 1),
            monitor=OnScreen("hysteresis", 1),
        ),
        rounding=Rounding(1),
        compute=lambda loops: loops.absorbed_J / loops.span_mm,
        propagate=lambda drawn: drawn.absorbed_J / drawn.span_mm,
    ),
]
'''
NAME, HEADING = "hysteresis_kN", "Hysteresis Fₕ"
LOOK = """
import json, pathlib, sys
from dataclasses import replace
from click.testing import CliRunner
from bufferstand.cli.main import bufferstand
from bufferstand.daq.monitor.results import describe
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content.content import Table
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.evaluation.report.source.specimens import side_by_side
from bufferstand.evaluation.catalogue.every_quantity import QUANTITIES
from tests.docs.symbols_page import page

def said(*words):
    done = CliRunner().invoke(bufferstand, list(map(str, words)), catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output

def headings(content):
    return {
        table.title: [column.title for column in table.columns]
        + [cell.text for row in table.rows for cell in row]
        for section in content.sections for table in section.blocks if isinstance(table, Table)
    }

folder, out = map(pathlib.Path, sys.argv[1:])
terminal = said("evaluate", folder, "--json", out / "all.json", "--table", out / "cycles.csv",
                "--run-table", out / "runs.csv", "--jobs", 1, "--draws", 200)
document = json.loads((out / "all.json").read_text())
source = replace(read_source(folder, document), detailed=True)
sides = side_by_side([source, read_source(folder, document)], ReportFields())
found = {
    "none": said("runs", folder, "--where", "hysteresis > 1e6", "--json", "-"),
    "all": said("runs", folder, "--where", "hysteresis > 0", "--json", "-"),
    "names": QUANTITIES.names,
    "schema": json.loads(said("schema", "evaluation")),
    "terminal": terminal,
    "symbols": page(),
    "report": headings(build_content(source)),
    "comparison": headings(build_comparison(sides)),
    "monitor": describe(min(folder.iterdir()), folder)["columns"],
}
(out / "found.json").write_text(json.dumps(found))
"""


@pytest.fixture(scope="module")
def further(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Evaluate two runs with a package that has one more file, and nothing else that is not in this one."""
    root = tmp_path_factory.mktemp("further")
    runs = root / "runs"
    package_with(root, source_of("Add a quantity", "hysteresis"), FURTHER)
    runs.mkdir()
    for name in ("003-harmonic-20mm-20mm-0.318Hz.h5", "005-harmonic-20mm-20mm-1.27Hz.h5"):
        (runs / name).write_bytes((SHIPPED / name).read_bytes())
    environment = {**os.environ, "PYTHONPATH": f"{root}:{ROOT}", "XDG_CACHE_HOME": str(root / "cache")}
    words = [sys.executable, "-P", "-c", LOOK, str(runs), str(root)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, cwd=root)
    assert done.returncode == 0, done.stdout + done.stderr
    return root


@pytest.mark.slow
def test_a_further_quantity_is_one_file(further: Path) -> None:
    found = json.loads((further / "found.json").read_text(encoding="utf-8"))
    assert found["names"] == [*QUANTITIES.names, NAME]
    document = json.loads((further / "all.json").read_text(encoding="utf-8"))
    for run in document["runs"]:
        mean = run["summary"][NAME]
        assert mean["value"] == pytest.approx(
            run["summary"]["absorbed_energy_J"]["value"] / (2.0 * run["summary"]["amplitude_mm"]["value"]),
            rel=1e-3,
        )
        assert 0.0 < mean["expanded_uncertainty"] < 0.05 * mean["value"]
        assert NAME in {row["quantity"] for row in run["settling"]}
        lacking = [cycle for cycle in run["cycles"] if cycle[NAME] is None]
        assert lacking
        assert all(cycle["missing"][NAME] == "; ".join(cycle["why"]) for cycle in lacking)
    assert "hysteresis" in {trend["quantity"] for trend in document["trends"]}
    jsonschema.validate(document, found["schema"])
    for part in ("CycleEntry", "SummaryEntry"):
        told = found["schema"]["$defs"][part]["properties"][NAME]
        assert (told["title"], told["unit"]) == ("Hysteresis", "kN")
    for table in ("cycles.csv", "runs.csv"):
        head = (further / table).read_text(encoding="utf-8").partition("\n")[0].split(",")
        assert {NAME, f"U({NAME})"} <= set(head)
    assert len(json.loads(found["all"])["runs"]) == 2
    assert json.loads(found["none"])["runs"] == []
    assert "hysteresis" in found["terminal"]
    assert (
        f"| F_h | `{NAME}` | kN | mean distance of both branches: W_a over the range |  |" in found["symbols"]
    )
    assert f"{HEADING} ± U" in found["report"]["Results"]
    assert HEADING in found["report"]["Cycles: energy, damping and stiffness"]
    compared = [texts for title, texts in found["comparison"].items() if title.startswith("Step 1")]
    assert compared
    assert all(HEADING in texts for texts in compared)
    assert "hysteresis" in {column["heading"] for column in found["monitor"]}


def test_the_entry_of_the_how_to_is_taken() -> None:
    found: dict[str, Any] = {}
    exec(example_of("add-a-quantity.md", "python"), found)
    assert Catalogue([*QUANTITIES, *found["ENTRIES"]]).names[-1] == NAME


@pytest.mark.slow
def test_a_further_quantity_changes_no_figure_of_the_others(further: Path) -> None:
    (path, *_) = sorted((further / "runs").iterdir())
    without, _ = evaluate_entry(path, Options(draws=200))
    with_it = json.loads((further / "all.json").read_text(encoding="utf-8"))["runs"][0]
    for name in QUANTITIES.names:
        assert with_it["summary"][name] == pytest.approx(without["summary"][name], rel=1e-9)
    for one, other in zip(with_it["cycles"], without["cycles"], strict=True):
        assert one.pop(NAME) is None or other["complete"]
        one["expanded_uncertainty"].pop(NAME, None)
        one["missing"].pop(NAME, None)
        assert one["expanded_uncertainty"] == pytest.approx(other["expanded_uncertainty"], rel=1e-9)
        assert one["missing"] == other["missing"]
        assert all(entry.value_in(one) == entry.value_in(other) for entry in QUANTITIES)
