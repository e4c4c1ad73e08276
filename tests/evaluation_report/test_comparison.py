"""Reports that compare: specimens side by side, re-evaluations, and a model beside the runs."""

from __future__ import annotations

import copy
import dataclasses
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.comparison import build_comparison
from bufferstand.evaluation.report.content.content import Content, Table
from bufferstand.evaluation.report.sections.comparison import _scatter
from bufferstand.evaluation.report.source.fields import ReportFields, read_fields
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportSource
from bufferstand.evaluation.report.source.specimens import ComparedSpecimens, conditions_of, side_by_side
from bufferstand.evaluation.report.writing import write_comparison
from bufferstand.foundation.errors import BadInput
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.layout import MODEL, RUNS
from tests.evaluation_report.make_runs import PAPER_LIKE, hand_made_document, write_campaign
from tests.evaluation_report.test_content import everything, tables


def softer(document: dict[str, Any], factor: float) -> dict[str, Any]:
    """Return an evaluation in which every damping and its U are so many times what they were."""
    other = copy.deepcopy(document)
    for entry in other["runs"]:
        damping = entry["summary"]["damping"]
        damping["value"] *= factor
    return other


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    root = tmp_path_factory.mktemp("sides")
    few, more = RUNS[:2], RUNS
    return (
        write_campaign(root / "one", more, rate_Hz=50.0),
        write_campaign(root / "two", few, rate_Hz=50.0, specimen="KX-0816"),
        write_campaign(root / "three", few, rate_Hz=50.0, specimen="KX-0817"),
    )


def sides_of(folders: tuple[Path, ...], factors: tuple[float, ...]) -> ComparedSpecimens:
    document = hand_made_document(RUNS)
    sources = [
        read_source(folder, softer(document, factor)) for folder, factor in zip(folders, factors, strict=True)
    ]
    return side_by_side(sources, ReportFields())


def test_a_draft_says_where_each_thing_is_to_be_given(folders: tuple[Path, Path, Path]) -> None:
    sides = sides_of(folders[:2], (1.0, 0.9))
    comparison = build_comparison(sides)
    assert comparison.lacks[0].where.endswith("comparison (--fields FILE.toml):")
    assert not any("report.toml" in lack.where for lack in comparison.lacks)
    own = build_content(sides.sides[0].source)
    assert own.lacks[0].where == "Missing, to be given in report.toml beside the runs:"
    assert own.missing == tuple(item for lack in own.lacks for item in lack.items)


def test_what_summing_leaves_of_equal_values_is_no_standard_deviation() -> None:
    values = [0.1 + 0.2, 0.3, 0.3]
    assert np.std(values, ddof=1) > 0.0
    assert _scatter(values) == 0.0
    assert _scatter([1000.0, 1000.1, 1000.2]) == pytest.approx(0.1)


def table_named(content: Content, start: str) -> Table:
    return next(table for table in tables(content) if table.title.startswith(start))


def test_runs_of_the_same_step_are_paired_and_the_others_named(folders: tuple[Path, Path, Path]) -> None:
    sides = sides_of(folders[:2], (1.0, 1.0))
    conditions = conditions_of(sides)
    pairs = [tuple(run.number if run else None for run in c.runs) for c in conditions]
    assert pairs == [(1, 4), (2, 5)]
    content = build_comparison(sides)
    (row,) = table_named(content, "Steps without a counterpart").rows
    assert [cell.text for cell in row[:4]] == ["A", "3", "20 ± 20 mm, 0.64 Hz", "B"]
    assert row[4].text == (
        "Run 5 is the nearest: frequency 0.64 Hz against 0.32 Hz: 0.32 Hz apart, at most 0.032 Hz permitted"
    )
    assert [run.file for run in sides.whole.runs][3].startswith("two/")


def test_a_difference_is_stated_with_its_uncertainty_and_judged_by_it(
    folders: tuple[Path, Path, Path],
) -> None:
    # U of the hand-made damping is 0.007 of about 0.39: 1 % is within the U of a difference, 10 % far beyond.
    for factor, judged in ((1.01, "within U"), (1.10, "◆ beyond U")):
        content = build_comparison(sides_of(folders[:2], (1.0, factor)))
        row = next(r for r in table_named(content, "Step 1").rows if r[0].text.startswith("Damping"))
        assert row[8].text == judged
        assert row[6].text == f"+{100.0 * (factor - 1.0):.1f}"
        value, U = (float(part.replace("−", "-")) for part in row[5].text.split(" ± "))
        assert float(row[7].text) == pytest.approx(value / U, rel=0.03, abs=0.06)
    assert "Clearest: Damping" in everything(content)


def test_specimens_that_are_equal_differ_in_nothing(folders: tuple[Path, Path, Path]) -> None:
    content = build_comparison(sides_of(folders[:2], (1.0, 1.0)))
    statements = [row[8].text for t in tables(content) if t.title.startswith("Step ") for row in t.rows]
    assert statements
    assert "◆ beyond U" not in statements
    assert "0 of them beyond their expanded uncertainty" in everything(content)


def test_three_specimens_have_a_spread_and_degrees_of_equivalence(folders: tuple[Path, Path, Path]) -> None:
    content = build_comparison(sides_of(folders, (1.0, 1.1, 0.9)))
    row = next(r for r in table_named(content, "Spread").rows if r[1].text.startswith("Damping"))
    assert len(row) == 6 + 3
    deviations = [float(cell.text.split(" ±")[0].replace("−", "-")) for cell in row[6:]]
    assert sum(deviations) == pytest.approx(0.0, abs=2e-4)
    assert deviations[1] > 0.0 > deviations[2]


def test_each_specimen_keeps_its_own_statement_of_conformity(folders: tuple[Path, Path, Path]) -> None:
    content = build_comparison(sides_of(folders[:2], (1.0, 1.0)))
    (section,) = [s for s in content.sections if s.id == "conformity"]
    titles = [block.title for block in section.blocks if isinstance(block, Table)]
    assert [title[0] for title in titles[1:]] == ["A", "A", "B", "B"]
    identification = everything(dataclasses.replace(content, sections=(content.sections[3],)))
    assert "KX-0815" in identification
    assert "KX-0816" in identification


def test_steps_that_do_not_meet_are_said_to_be_none(folders: tuple[Path, Path, Path], tmp_path: Path) -> None:
    other = write_campaign(tmp_path / "other", (PAPER_LIKE[5],), rate_Hz=200.0)
    sources = [
        read_source(folders[1], hand_made_document(RUNS)),
        read_source(other, hand_made_document((PAPER_LIKE[5],))),
    ]
    content = build_comparison(side_by_side(sources, ReportFields()))
    text = everything(content)
    assert "nothing can be compared" in text
    assert "0 differences" not in text
    assert "cannot be compared: they share no step. Run " in text
    reasons = {row[3].text: row[4].text for row in table_named(content, "Steps without a counterpart").rows}
    assert set(reasons) == {"A", "B"}


def test_a_step_that_was_repeated_more_often_on_one_is_said_to_be(folders: tuple[Path, Path, Path]) -> None:
    sides = sides_of(folders[1:], (1.0, 1.0))
    again = dataclasses.replace(sides.sides[1].source, runs=sides.sides[1].source.runs[:1])
    first, second = sides.sides
    run = dataclasses.replace(first.source.runs[0], number=9)
    more = dataclasses.replace(
        first, source=dataclasses.replace(first.source, runs=(*first.source.runs, run))
    )
    both = dataclasses.replace(
        sides,
        sides=(more, dataclasses.replace(second, source=again)),
        whole=dataclasses.replace(sides.whole, runs=(*more.source.runs, *again.runs)),
    )
    rows = table_named(build_comparison(both), "Steps without a counterpart").rows
    said = {row[1].text: row[4].text for row in rows}
    assert said["9"] == "B has run this step fewer times (run 3)"
    assert said["2"] == "B has no harmonic run"


def test_shared_steps_without_results_are_no_differences(folders: tuple[Path, Path, Path]) -> None:
    sides = sides_of(folders[1:], (1.0, 1.0))
    bare = tuple(
        dataclasses.replace(
            run,
            record=None,
            evaluated={**run.evaluated, "cycles": [], "summary": None, "requirements": [], "extremes": {}},
        )
        for run in sides.sides[1].source.runs
    )
    second = dataclasses.replace(sides.sides[1], source=dataclasses.replace(sides.sides[1].source, runs=bare))
    both = dataclasses.replace(
        sides,
        sides=(sides.sides[0], second),
        whole=dataclasses.replace(sides.whole, runs=(*sides.sides[0].source.runs, *bare)),
    )
    text = everything(build_comparison(both))
    assert "0 differences" not in text
    assert "gave no result of both" in text
    assert "runs 2, 4 have no result in common" in text


IN_ANOTHER_PROCESS = """
import sys
from pathlib import Path
from bufferstand.evaluation.report.writing import write_comparison
write_comparison([Path(sys.argv[1]), Path(sys.argv[2])], Path(sys.argv[3]))
"""


def test_a_comparison_has_the_same_bytes_in_another_process(
    folders: tuple[Path, Path, Path], tmp_path: Path
) -> None:
    first = write_comparison(folders[1:], tmp_path / "one")
    environment = os.environ | {
        "PYTHONHASHSEED": "11",
        "TZ": "Asia/Tokyo",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-c", IN_ANOTHER_PROCESS, *map(str, folders[1:]), str(tmp_path / "two")]
    subprocess.run(command, check=True, env=environment, timeout=300)
    assert [path.name for path in first] == ["comparison-report.html", "comparison-report.pdf"]
    for path in first:
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes()


def test_what_cannot_be_compared_is_refused(folders: tuple[Path, Path, Path], tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="given twice"):
        write_comparison([folders[0], folders[0]], tmp_path)
    copied = tmp_path.with_name("copied")
    shutil.copytree(folders[1], copied)
    with pytest.raises(
        BadInput, match=r"one of .*two, too, with the same content: it does not differ"
    ) as same:
        write_comparison([folders[0], folders[1], copied], tmp_path)
    assert same.value.file == str(copied)
    with pytest.raises(BadInput, match="takes 2 to 26 paths, not 1"):
        write_comparison(folders[:1], tmp_path)
    with pytest.raises(BadInput, match="takes no model"):
        write_comparison(folders[:2], tmp_path, given=Given(model=MODEL))
    assert not list(tmp_path.iterdir())


def reevaluated(report: Made, earlier: dict[str, Any]) -> Content:
    source: ReportSource = dataclasses.replace(report.source, earlier=earlier)
    return build_content(source)


def test_a_re_evaluation_names_what_moved_beyond_its_uncertainty(report: Made) -> None:
    before = hand_made_document()
    before["decision_rule"] = "guard-band"
    before["runs"][0]["summary"]["damping"]["value"] += 0.05
    before["runs"][1]["summary"]["damping"]["value"] += 0.001
    before["runs"][0]["requirements"][0]["verdict"] = "fail"
    content = reevaluated(report, before)
    (notice, *_) = content.notices
    assert notice.startswith("Re-evaluation: 2 results are not what they were, 1 of them beyond")
    rows = table_named(content, "Changed results").rows
    assert [(row[0].text, row[1].text, row[-1].text) for row in rows] == [
        ("1", "damping", "◆ beyond U"),
        ("2", "damping", "within U"),
    ]
    (verdict,) = table_named(content, "Changed verdicts").rows
    assert (verdict[3].text, verdict[4].text) == ("✗ fail", "✓ pass")


def test_the_same_evaluation_again_moves_nothing(report: Made) -> None:
    content = reevaluated(report, hand_made_document())
    assert content.notices[0].startswith("Re-evaluation: 0 results are not what they were")
    (row,) = table_named(content, "Changed settings and software").rows
    assert row[0].text == "none"


def test_a_model_is_shown_beside_the_runs_with_what_it_misses(tmp_path: Path) -> None:
    folder = write_campaign(tmp_path / "campaign", RUNS, rate_Hz=100.0)
    source = read_source(folder, hand_made_document(RUNS), Given(model=MODEL))
    content = build_content(source)
    (section,) = [s for s in content.sections if s.id == "model"]
    assert section.title == "Model against measurement"
    table = table_named(content, "Measurement and model")
    assert [column.title for column in table.columns[2:4]] == [
        "Damping compared, measured",
        "Damping compared, model",
    ]
    assert "stand under Results" in table.note  # which has another damping, of all samples
    rows = table.rows
    assert [row[0].text for row in rows] == ["1", "2", "3"]
    # make_runs.py's static loop returns at 0.55 of the loading force.
    assert float(rows[0][2].text) == pytest.approx(0.45, abs=0.01)
    captions = [picture.caption for picture in content.pictures()]
    assert any("measured (thin, black) and by the model Side buffer" in caption for caption in captions)
    assert source.modelled is not None
    assert source.modelled.sha256 in everything(content)


def test_an_amendment_says_what_it_replaces_what_it_changes_and_why(report: Made, tmp_path: Path) -> None:
    file = tmp_path / "report.toml"
    file.write_text(
        'amends = "BR-000000000000"\namends_issued = 2026-03-01\n'
        'amendment_reason = "serial number corrected"\n'
        'amendment_changes = ["0815 instead of 0816"]\n'
    )
    content = build_content(dataclasses.replace(report.source, fields=read_fields(file)))
    assert content.sections[0].title == "Amendment to report BR-000000000000"
    assert content.notices[0].startswith("Amendment: this report replaces report BR-000000000000")
    assert content.report_id != report.content.report_id
    file.write_text('amends = "BR-000000000000"\namendment_reason = "serial number corrected"\n')
    draft = build_content(dataclasses.replace(report.source, fields=read_fields(file)))
    assert {"date of the report that this one replaces", "what this report changes"} <= set(draft.missing)
    file.write_text('amendment_changes = ["0815 instead of 0816"]\n')
    with pytest.raises(BadInput, match="not which"):
        read_fields(file)
