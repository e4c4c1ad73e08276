"""What records hold besides the figures of cycles, as a report shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.document import python_api as api
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import Cell, Section, Table
from bufferstand.evaluation.report.sections.history import MOST_ROWS, contact_section, history_section
from bufferstand.evaluation.report.source.reading import Given, read_source
from bufferstand.evaluation.report.source.source import ReportRun, ReportSource
from tests.evaluation_report.campaigns import (
    PRELOAD_LOST_KN,
    RELAXES_KN,
    SETTLES,
    ZERO_OFF_MM,
    write_eventful_campaign,
)
from tests.evaluation_report.conftest import Made


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> ReportSource:
    folder = write_eventful_campaign(tmp_path_factory.mktemp("eventful") / "campaign")
    return read_source(folder, None, Given(options=Options(draws=200)))


def table(section: Section | None, title: str) -> list[dict[str, Cell]]:
    """Return the rows of a table by the titles of their columns; of two alike the second one's has a 2."""
    assert section is not None
    found = next(b for b in section.blocks if isinstance(b, Table) and b.title.startswith(title))
    names: list[str] = []
    for column in found.columns:
        names.append(column.title if column.title not in names else f"{column.title} 2")
    return [dict(zip(names, row, strict=True)) for row in found.rows]


def value(cell: Cell) -> tuple[float, float]:
    """Return value and U of a cell."""
    one, _, U = cell.text.replace("−", "-").partition(" ± ")
    return float(one), float(U)


def test_by_how_much_the_zero_is_off(source: ReportSource) -> None:
    rows = {row["Run"].text: row for row in table(contact_section(source), "Place of first contact")}
    assert list(rows) == ["1", "2", "6"], "static runs only"
    off, U = value(rows["6"]["Zero counted from contact ± U"])
    assert abs(off + ZERO_OFF_MM) < U < 0.1
    assert rows["6"]["Zero"].tone == "bad"
    assert rows["1"]["Zero"].text == "kept"
    assert rows["1"]["Zero stated within"].text == "0.1"


def test_a_hold_and_what_stays_of_strokes(source: ReportSource) -> None:
    (hold,) = table(history_section(source), "Holds")
    assert (hold["Run"].text, hold["Kind"].text, hold["Length"].text) == ("2", "relaxation", "100.0")
    slope, U = value(hold["a decade of time ± U"])
    assert abs(slope + RELAXES_KN) < U < 0.5
    strokes = table(history_section(source), "Residual strokes")
    assert [row["Run"].text for row in strokes].count("1") == 3
    assert all(abs(value(row["Residual stroke ± U"])[0]) < 0.01 for row in strokes)


def test_settling_and_energy_of_each_run(source: ReportSource) -> None:
    rows = {row["Run"].text: row for row in table(history_section(source), "Settling")}
    assert list(rows) == ["1", "2", "3", "4", "5", "6"]
    change, U = value(rows["3"]["Wₐ, first to last ± U"])
    assert abs(change + 100.0 * SETTLES / (1.0 + SETTLES) * 0.9) < 1.0  # the first cycle is a mean itself
    assert U < 1.0
    # 0.1 exp(-t / 5) = 0.02 at t = 8
    assert 8 <= int(rows["3"]["All settled from cycle"].text) <= 10
    energy = sum(c["absorbed_energy_J"] for c in source.runs[2].cycles if c["absorbed_energy_J"] is not None)
    assert value(rows["3"]["Absorbed in all ± U"])[0] == pytest.approx(1e-3 * energy, abs=0.01)
    assert (
        rows["2"]["Complete cycles"].why
        == "fewer than three complete cycles, or one of them is without this figure"
    )


def test_before_and_after_with_the_preload(source: ReportSource) -> None:
    rows = {row["Figure"].text: row for row in table(history_section(source), "Before and after")}
    assert {row["Run"].text for row in rows.values()} == {"6"}
    change, U = value(rows["Preload"]["Change ± U"])
    # The zero that is off reads the preload elsewhere on the branch, and U says so.
    assert abs(change + PRELOAD_LOST_KN) < U < 1.5 * PRELOAD_LOST_KN
    change, U = value(rows["Force max."]["Change ± U"])
    assert abs(change + PRELOAD_LOST_KN) < U < 1.0
    assert rows["Force max."]["Beyond U"].text == "yes"
    assert rows["Tangent stiffness"]["Beyond U"].text == "no"


def test_proof_loads_are_added_up(source: ReportSource) -> None:
    rows = table(history_section(source), "Proof loads")
    assert [(r["Run"].text, r["Load cycles"].text, r["In all"].text) for r in rows] == [
        ("4", "3", "5"),
        ("5", "2", "5"),
    ]


def test_of_many_the_first_and_the_last(source: ReportSource) -> None:
    run = source.runs[0]
    many = [{**run.evaluated["residual_strokes"][0], "cycle": n} for n in range(1, 31)]
    crowded = replace(source, runs=(replace(run, evaluated={**run.evaluated, "residual_strokes": many}),))
    section = history_section(crowded)
    cycles = [int(row["Cycle"].text) for row in table(section, "Residual strokes")]
    assert cycles == [*range(1, MOST_ROWS + 1), *range(31 - MOST_ROWS, 31)]
    assert section is not None
    notes = [b.note for b in section.blocks if isinstance(b, Table)]
    assert any("run 1: 12 of 30" in note for note in notes)


def test_runs_of_other_campaigns_are_left_out(source: ReportSource) -> None:
    """An evaluation document may be of more runs than the report."""
    two = replace(source, runs=(source.runs[2],))
    section = history_section(two)
    assert section is not None
    titles = [b.title for b in section.blocks if isinstance(b, Table)]
    assert titles == ["Settling and cumulated energy"]
    assert contact_section(two) is None


def test_where_it_stands_and_where_there_is_nothing(
    source: ReportSource, report: Made, tmp_path: Path
) -> None:
    identities = [section.id for section in build_content(source).sections]
    at = identities.index("first-contact")
    assert identities[at - 1 : at + 2] == ["recorded", "first-contact", "history"]
    without: Mapping[str, Any] = report.source.document
    assert "before_after" not in without, "a document of an earlier version"
    assert {"first-contact", "history"} & {section.id for section in report.content.sections} == set()


def test_the_same_as_tables_in_python(source: ReportSource) -> None:
    """The public API gives what the report prints."""
    document = dict(source.document)
    (hold,) = api.holds(document).to_dict("records")
    assert (hold["run"], hold["kind"]) == ("hold", "relaxation")
    assert abs(hold["force_per_decade_kN"] + RELAXES_KN) < hold["U(force_per_decade_kN)"]
    assert list(api.residual_strokes(document)["run"]).count("static-before") == 3
    settled = api.settling(document).query("run == 'settling' and quantity == 'absorbed_energy_J'")
    assert 8 <= settled["settled_at_cycle"].item() <= 10
    changes = api.before_after(document).set_index("quantity")
    assert set(changes["run"]) == {"static-after"}
    assert set(changes["reference"]) == {"static-before"}
    assert abs(changes.change["preload_kN"] + PRELOAD_LOST_KN) < changes.expanded_uncertainty["preload_kN"]


def test_each_zero_is_shown_once_with_the_runs_that_count_from_it(source: ReportSource) -> None:
    def zeroed(run: ReportRun, minute: int) -> ReportRun:
        channel = {"name": "stroke_1", "value": 1.5 + minute / 100.0, "u": 0.02}
        zero = {"how": "touch", "taken_over": False, "found": f"2026-11-23T10:{minute:02d}:00+00:00"}
        facts = {**run.evaluated["run"], "zero": zero | {"channel": [channel]}}
        return replace(run, evaluated={**run.evaluated, "run": facts, "first_contact": None})

    runs = [zeroed(run, 7 if run.number < 4 else 9) for run in source.runs]
    rows = table(contact_section(replace(source, runs=tuple(runs))), "Determination of the zero")
    assert [row["Runs"].text for row in rows] == ["1–3", f"4–{runs[-1].number}"]
    assert [value(row["Draw wire 1 ± U"])[0] for row in rows] == [1.57, 1.59]
    assert not any("Draw wire 3 ± U" in row for row in rows)


def test_the_zero_of_every_draw_wire_is_shown(source: ReportSource) -> None:
    wires = [{"name": f"stroke_{number}", "value": float(number), "u": 0.02} for number in range(1, 5)]
    zero = {"how": "tare", "taken_over": False, "found": "2026-11-23T10:00:00+00:00", "channel": wires}
    (first, *_) = source.runs
    facts = {**first.evaluated["run"], "zero": zero}
    run = replace(first, evaluated={**first.evaluated, "run": facts, "first_contact": None})
    (row,) = table(contact_section(replace(source, runs=(run,))), "Determination of the zero")
    assert [value(row[f"Draw wire {number} ± U"])[0] for number in range(1, 5)] == [1.0, 2.0, 3.0, 4.0]
    assert row["Force ± U"].text == "—"
