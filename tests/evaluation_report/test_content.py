from __future__ import annotations

import copy
import dataclasses
import json
import re
from collections.abc import Iterator
from datetime import date
from typing import Any

import pytest

from bufferstand.daq.motions.force_rows import ForceTurns, force_row
from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.content.content import (
    DASH,
    Cell,
    Column,
    Content,
    Table,
    Texts,
    VerdictLine,
)
from bufferstand.evaluation.report.sections.statements import deviations_section, targets_section
from bufferstand.evaluation.report.sections.verdicts import (
    is_condition,
    name_of,
    verdict_cell,
    verdict_line,
    worst,
)
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.source import ReportRun, ReportSource, runs_text
from bufferstand.protocols.steps.motions import ForceCycles
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.make_runs import PAPER_LIKE, requirement

FILLED = ReportFields(
    laboratory="Test hall 2",
    laboratory_address="Studentská 95, Pardubice",
    place_of_test="Pardubice",
    customer="Wagon works",
    customer_address="Poprad",
    method="EN 15551:2022, procedure P-7 rev. 3",
    received=date(2026, 2, 20),
    issued=date(2026, 3, 9),
    checked_by="A. Kohout",
    authorised_by="P. Vágner",
    deviations=("The room was at 27 °C.",),
    customer_supplied=("Date of assembly",),
    amends="BR-000000000000",
    amends_issued=date(2026, 3, 1),
    amendment_reason="serial number corrected",
    amendment_changes=("Serial number 0815 instead of 0816.",),
)


def strings(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for inner in value.values():
            yield from strings(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from strings(inner)
    elif isinstance(value, str):
        yield value


def everything(content: Content) -> str:
    return "\n".join(strings(content.document()))


def with_run(source: ReportSource, number: int, **changes: Any) -> ReportSource:
    runs = tuple(dataclasses.replace(r, **changes) if r.number == number else r for r in source.runs)
    return dataclasses.replace(source, runs=runs)


def with_evaluated(source: ReportSource, number: int, **changes: Any) -> ReportSource:
    (run,) = [r for r in source.runs if r.number == number]
    return with_run(source, number, evaluated={**run.evaluated, **changes})


def tables(content: Content) -> list[Table]:
    blocks = [block for section in content.sections for block in section.blocks]
    return [b for b in blocks if isinstance(b, Table)] + [p.numbers for p in content.pictures()]


def test_every_run_every_requirement_and_every_file_is_there(report: Made) -> None:
    by_title = {table.title: table for table in tables(report.detailed)}
    for title in ("Tests performed", "Results", "The steps"):
        assert [row[0].text for row in by_title[title].rows] == [str(n) for n in range(1, 12)]
    files = [row[0].text for row in by_title["Raw data"].rows]
    assert files == [*(str(n) for n in range(1, 12)), "—"], "the evaluation belongs to no single run"
    ids = [row[1].text for row in by_title["Tests performed"].rows]
    assert ids == [made.id for made in PAPER_LIKE]
    (static,) = [run for run in report.source.runs if run.kind == "static"]
    for conditions, title in ((False, "requirements on the specimen"), (True, "conditions of the test")):
        wanted = [r for r in static.requirements if is_condition(r) is conditions]
        table = by_title[f"Run 1 (static-1): {title}"]
        assert sorted((r[0].text, r[1].text) for r in table.rows) == sorted(
            (name_of(r), "all" if r["cycle"] is None else str(r["cycle"])) for r in wanted
        )
        assert {row[6].text.split(maxsplit=1)[1] for row in table.rows} == {
            r["verdict"].replace("-", " ") for r in wanted
        }
    text = everything(report.content)
    assert not [
        one for one in tables(report.content) if one.title.startswith(("Cycles:", "Run 1 (static-1)"))
    ]
    for run in report.source.runs:
        assert run.sha256 in text
        assert run.file in text


def test_every_cycle_of_a_short_run_is_there_and_a_long_run_says_what_is_left_out(report: Made) -> None:
    (table,) = [t for t in tables(report.detailed) if t.title.startswith("Cycles: stroke")]
    count = {
        run.number: sum(row[0].text == str(run.number) for row in table.rows) for run in report.source.runs
    }
    assert count == {r.number: min(10, len(r.cycles)) for r in report.source.runs}
    assert "run 10: 10 of 14" in table.note


def test_the_report_id_is_a_hash_of_the_content(report: Made) -> None:
    assert re.fullmatch(r"BR-[0-9a-f]{12}", report.content.report_id)
    assert build_content(report.source).report_id == report.content.report_id
    other = dataclasses.replace(report.content, subtitle="another")
    assert other.report_id != report.content.report_id
    (first, *_) = report.content.pictures()
    curve = dataclasses.replace(first.plot.curves[0], y=first.plot.curves[0].y + 1.0)
    moved = dataclasses.replace(first, plot=dataclasses.replace(first.plot, curves=(curve,)))
    certificate = tuple(moved if block is first else block for block in report.content.certificate)
    changed = dataclasses.replace(report.content, certificate=certificate)
    assert changed.report_id != report.content.report_id


def test_no_missing_value_is_a_zero_a_nan_or_none(report: Made) -> None:
    text = everything(report.content)
    assert not re.search(r"\b(nan|NaN|inf|None|null)\b", text)
    for table in tables(report.content):
        for row in table.rows:
            assert all(cell.text for cell in row)
            assert all(cell.why for cell in row if cell.text == DASH and cell.tone == "missing")


def test_a_value_that_is_missing_says_why_below_its_table(report: Made) -> None:
    (table,) = [t for t in tables(report.detailed) if t.title.startswith("Cycles: energy")]
    cut_off = table.rows[-1]
    assert (cut_off[0].text, cut_off[2].text) == ("11", "incomplete")
    assert (cut_off[5].text, cut_off[5].why) == (DASH, "the cycle was cut off by the stop")
    document = report.detailed.document()
    (block,) = [
        b
        for s in document["sections"]
        for b in s["blocks"]
        if b.get("title", "").startswith("Cycles: energy")
    ]
    letters = {note["letter"]: note["why"] for note in block["footnotes"]}
    assert letters[block["rows"][-1][5]["note"]] == cut_off[5].why


@pytest.mark.parametrize("bad", [None, float("nan"), float("inf")])
def test_nan_in_the_evaluation_becomes_a_dash(report: Made, bad: float | None) -> None:
    cycles = copy.deepcopy(report.source.runs[0].cycles)
    for cycle in cycles:
        cycle |= {"damping": bad, "stored_energy_J": bad, "temperature_C": {"start": bad, "max": bad}}
    source = with_evaluated(report.source, 1, cycles=cycles, summary={"cycles_used": [1, 2, 3]})
    content = build_content(source)
    json.dumps(content.document(), allow_nan=False)
    (table,) = [t for t in tables(content) if t.title == "Results"]
    assert [table.rows[0][n].text for n in (5, 6, 8)] == [DASH, DASH, DASH]
    assert all(table.rows[0][n].why for n in (5, 6, 8))


def test_a_missing_cell_without_a_reason_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="must say why"):
        Cell(DASH, "missing")


def test_a_row_of_another_length_than_the_heading_cannot_be_made() -> None:
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        Table("t", (Column("a"), Column("b")), ((Cell("1"),),))


def test_the_summary_says_in_words_why_it_is_inconclusive(report: Made) -> None:
    (line,) = [block for block in report.content.certificate if isinstance(block, VerdictLine)]
    assert line.subject == "EN 15551: static test, run 1"
    assert line.verdict.text == "◇ inconclusive"
    assert line.sentence == "Nothing failed; 12 of 18 requirements are met. Not decided:"
    assert line.points == (
        "Full stroke: the stand ended at 560 kN and 95.0 mm, before full stroke",
        "Rest after assembly: no date of assembly is on record",
        "Force at 100 mm (cycles 1, 2, 3): the record ends at 95.0 mm",
        "Absorbed / stored energy (cycles 1, 2, 3): the loop is cut short of full stroke",
    )


def judged(report: Made, verdict: str, requirements: list[dict[str, Any]]) -> VerdictLine:
    source = with_evaluated(report.source, 1, verdict=verdict, requirements=requirements)
    return verdict_line(source.runs[0])


def test_a_failure_names_what_failed_and_only_that(report: Made) -> None:
    line = judged(
        report,
        "fail",
        [
            requirement("force-at-60mm", 2, "fail", why="410 kN lies above 400 kN"),
            requirement("preload", 1, "pass", why="fine"),
        ],
    )
    assert line.verdict.tone == "bad"
    assert line.sentence == "1 of 2 requirements are not met:"
    assert line.points == ("Force at 60 mm (cycle 2): 410 kN lies above 400 kN",)


def test_broken_conditions_make_the_test_not_count(report: Made) -> None:
    line = judged(
        report,
        "invalid",
        [requirement("speed-limit", None, "fail", why="80 mm/s"), requirement("preload", 1, "invalid")],
    )
    assert line.sentence == "The test does not count, because its conditions were broken:"
    assert line.points == ("Speed of the plunger: 80 mm/s",)


def test_a_pass_and_a_near_pass_read_differently(report: Made) -> None:
    passed = [requirement("preload", 1, "pass"), requirement("speed-limit", None, "pass")]
    assert judged(report, "pass", passed).sentence == (
        "All 1 requirements are met and all 1 conditions of the test were kept."
    )
    near = [requirement("preload", 1, "conditional-pass", why="within U of 50 kN")]
    assert "closer to a limit than their uncertainty" in judged(report, "conditional-pass", near).sentence


def test_verdicts_read_without_colour() -> None:
    cells = [verdict_cell(v) for v in ("pass", "fail", "inconclusive", "not-tested", "invalid")]
    assert [c.text for c in cells] == ["✓ pass", "✗ fail", "◇ inconclusive", "◇ not tested", "✗ invalid"]
    assert verdict_cell(None).why
    assert worst(["pass", "not-tested", "fail"]) == "fail"
    assert worst(["pass", "inconclusive"]) == "inconclusive"


def test_without_the_laboratory_s_facts_it_is_a_draft_that_lists_them(report: Made) -> None:
    assert "address of the laboratory" in report.content.missing
    assert "who authorised the report" in report.content.missing
    assert "name of the operator" not in report.content.missing, "the runs say who tested"
    filled = build_content(dataclasses.replace(report.source, fields=FILLED))
    assert filled.missing == ()
    text = everything(filled)
    for fact in (
        "Studentská 95, Pardubice",
        "2026-03-09",
        "P. Vágner",
        "The room was at 27 °C.",
        "Date of assembly",
    ):
        assert fact in text
    for fact in ("Amendment to report BR-000000000000", "serial number corrected", "instead of 0816"):
        assert fact in text


def test_stopped_runs_are_on_top_and_in_the_deviations_with_their_reason(report: Made) -> None:
    assert "Run 11 ended early; see Deviations and stopped runs." in report.content.notices
    (table,) = [t for t in tables(report.content) if t.title == "Runs that ended early"]
    (row,) = table.rows
    assert row[1].text == "h-80-10"
    assert "40.1 °C" in row[3].text
    assert row[4].why == "no event but the reason on record"
    (run,) = [one for one in report.source.runs if one.number == 11]
    then = (4.0, "safe-stop", "safe stop: force 0.0 kN")
    stopped = deviations_section(with_run(report.source, 11, events=(*run.events, then)))
    (table,) = [block for block in stopped.blocks if isinstance(block, Table)]
    assert table.rows[0][4].text == "4.0 s: safe stop: force 0.0 kN"


def test_a_limited_force_is_a_deviation(report: Made) -> None:
    assert "Force limited to 600 kN by the stand (run 1): full stroke was not reached." in everything(
        report.content
    )


@pytest.mark.parametrize("missed", [True, False])
def test_a_stroke_that_was_not_reached_is_a_deviation(report: Made, missed: bool) -> None:
    row = {
        "motion": "harmonic",
        "asked_mean_mm": 45.0,
        "asked_amplitude_mm": 8.0,
        "last_commanded_mean_mm": 45.6,
        "last_commanded_amplitude_mm": 8.1,
        "reached_mean_mm": 44.95,
        "reached_amplitude_mm": 7.57,
        "by_force": False,
        "compensated": True,
        "off_mm": -0.05,
        "off_percent": -5.3,
        "cycles": 8,
        "cycles_off": "1-8",
        "not_reached": missed,
    }
    source = with_run(report.source, 3, strokes=(row,))
    section, targets = deviations_section(source), targets_section(source)
    assert targets is not None
    assert targets.annex
    text = "\n".join(strings([dataclasses.asdict(block) for block in section.blocks]))
    told = (
        "Run 3: the stroke that was asked for was not reached: 44.95 ± 7.57 mm in place of 45.00 ± 8.00 mm."
    )
    assert (told in text) is missed
    assert "44.95 ± 7.57" in [cell.text for row in targets.blocks[0].rows for cell in row], (
        "in the table, too"
    )


def test_an_overdue_calibration_is_shown_and_warned_of_by_the_day_of_the_test(report: Made) -> None:
    (table,) = [t for t in tables(report.content) if t.title.startswith("Calibrations")]
    state = {row[0].text: row[6].text for row in table.rows}
    assert (state["force"], state["stroke_1"], state["stroke_2"]) == ("valid", "valid", "overdue")
    assert table.rows[0][3].text == "D-K-15019 2026-01"
    assert "The calibration of stroke_2 (WDS-500-2) was overdue: valid until 2026-02-01." in everything(
        report.content
    )


def test_a_simulated_stand_is_said_before_anything_else(report: Made) -> None:
    metadata = copy.deepcopy(dict(report.source.runs[0].metadata))
    metadata["stand"]["stand"]["name"] = "Simulated servo-hydraulic stand"
    content = build_content(with_run(report.source, 1, metadata=metadata))
    assert content.notices[0].startswith("Simulated stand in run 1: nothing of them was measured")
    assert not any("Simulated" in notice for notice in report.content.notices)


def test_imported_runs_are_marked_as_results_of_others(report: Made) -> None:
    metadata = copy.deepcopy(dict(report.source.runs[0].metadata))
    metadata["run"]["status"] = "imported"
    metadata["original"] = {"file": "buffer.csv", "sha256": "ab" * 32}
    text = everything(build_content(with_run(report.source, 1, metadata=metadata)))
    assert "Imported from foreign records, not measured by this software: run 1." in text
    assert f"buffer.csv, SHA-256 {'ab' * 32}" in text


def test_a_run_without_samples_is_reported_and_not_drawn(report: Made) -> None:
    source = with_run(report.source, 1, record=None, problem="the run has no samples of the channel “force”")
    content = build_content(source)
    assert not any("run 1 (static)" in picture.caption for picture in content.pictures())
    assert "Run 1: the run has no samples of the channel “force”" in everything(content)


def test_nothing_to_draw_is_said_in_words(report: Made) -> None:
    runs: tuple[ReportRun, ...] = tuple(
        dataclasses.replace(r, record=None, problem="empty") for r in report.source.runs
    )
    document = {**report.source.document, "trends": []}
    content = build_content(dataclasses.replace(report.source, runs=runs, document=document))
    assert content.pictures() == ()
    assert "No run holds samples that could be drawn." in everything(content)


def test_without_start_times_the_campaign_figure_says_so(report: Made) -> None:
    metadata = copy.deepcopy(dict(report.source.runs[2].metadata))
    metadata["run"] |= {"started_utc": "", "ended_utc": ""}
    content = build_content(with_run(report.source, 3, metadata=metadata))
    assert "Start times are not on record" in content.pictures()[-1].caption
    assert "Start times" not in report.content.pictures()[-1].caption


def test_runs_that_overlap_in_wall_time_are_drawn_one_behind_the_other(report: Made) -> None:
    metadata = copy.deepcopy(dict(report.source.runs[1].metadata))
    metadata["run"]["started_utc"] = report.source.runs[0].metadata["run"]["started_utc"]
    caption = build_content(with_run(report.source, 2, metadata=metadata)).pictures()[-1].caption
    assert "faster than the clock on the wall" in caption


def test_the_numbers_behind_the_static_figure_follow_the_loops(report: Made) -> None:
    table = report.content.pictures()[0].numbers
    assert [row[0].text for row in table.rows] == [str(10 * n) for n in range(1, 10)]
    at_60 = table.rows[5]
    loading, unloading = float(at_60[1].text), float(at_60[2].text)
    expected = 20.0 + 1.2 * 60.0 + 0.0473 * 60.0**2
    assert loading == pytest.approx(expected, abs=1.0)
    assert unloading == pytest.approx(0.55 * expected, abs=1.0)


def test_figures_are_those_of_the_paper(report: Made) -> None:
    captions = [picture.caption for picture in report.content.pictures()]
    for number, words in enumerate(
        (
            "Force over stroke of 3 cycles of run 1 (static) with the permitted ranges",
            "Dynamic loops of runs 2–11 over the quasi-static cycle 3 of run 1 (dotted)",
            "constant prestress and amplitude and several frequencies, prestress 20 mm, amplitude 20 mm",
            "constant prestress and several amplitudes, prestress 50 mm",
            "Damping (absorbed over stored energy) over frequency with linear fits. Bars",
            "Tangent stiffness of the loading branch at mean stroke over frequency",
            "Temperatures over the campaign, limit 40 °C",
            "Stroke over the campaign",
        )
    ):
        assert words in captions[number]
    assert all(picture.alt for picture in report.content.pictures())


def test_windows_carry_the_gravest_verdict_of_the_cycles(report: Made) -> None:
    windows = report.content.pictures()[0].plot.windows
    assert [(w.at, w.lower, w.upper, w.verdict) for w in windows] == [
        (0.0, 10.0, 50.0, "pass"),
        (25.0, 30.0, 130.0, "pass"),
        (60.0, 100.0, 400.0, "pass"),
        (100.0, 350.0, 1000.0, "not-tested"),
    ]
    assert windows[3].measured == ()
    assert "not tested" in windows[3].label


@pytest.mark.parametrize(
    ("numbers", "text"), [([3], "run 3"), ([4, 1, 2, 3, 7], "runs 1–4, 7"), ([1, 2], "runs 1–2")]
)
def test_runs_are_named_in_ranges(numbers: list[int], text: str) -> None:
    assert runs_text(numbers) == text


def test_a_run_that_is_not_its_step_is_warned_of(report: Made) -> None:
    assert "is not the required" not in everything(report.content)
    (run,) = [r for r in report.source.runs if r.number == 9]
    step = {"prestress_mm": 20.0, "amplitude_mm": 20.0, "frequency_Hz": 1.27}
    text = everything(build_content(with_run(report.source, 9, metadata={**run.metadata, "step": step})))
    assert "Run 9: mean stroke 50 mm is not the required 20 mm of the step." in text
    assert "Run 9: amplitude 30 mm is not the required 20 mm of the step." in text
    assert "Run 9: frequency 0.42 Hz is not the required 1.27 Hz of the step." in text
    assert "Run 9: not the motion that the step required; see Warnings" in text


def test_a_run_without_a_steady_cycle_has_no_result_though_it_has_cycles(report: Made) -> None:
    summary = {"cycles_used": [], "damping": {"value": None, "expanded_uncertainty": None}}
    source = with_evaluated(report.source, 2, summary=summary)
    assert source.runs[1].shown_cycle() is not None
    (table,) = [t for t in tables(build_content(source)) if t.title == "Results"]
    force = [column.title for column in table.columns].index("Force max.")
    assert table.rows[1][force].tone == "number", "the extreme of all samples needs no cycle"
    for cell in (*table.rows[1][1:force], *table.rows[1][force + 1 : 8]):
        assert (cell.text, cell.why) == (DASH, "no cycle of the run is complete and steady")


def test_forces_that_were_not_met_stand_in_the_report(report: Made) -> None:
    motion = ForceCycles(50.0, 400.0, 60.0, 20.0, 2, 2.0)
    met = force_row(motion, [ForceTurns(1, 52.0, 396.0, by_limit=False)])
    short = [ForceTurns(number, 50.0, 207.0, by_limit=True) for number in (1, 2)]
    missed = force_row(motion, short)
    assert met is not None
    assert missed is not None
    source = with_run(report.source, 1, forces=(met.as_dict(), missed.as_dict()))
    (table,) = [one for one in tables(build_content(source)) if one.title == "Forces asked and reached"]
    assert [[cell.text for cell in row] for row in table.rows] == [
        ["1", "50 … 400", "52.0 … 396.0", "8", "none of 1 cycles"],
        ["1", "50 … 400", "50.0 … 207.0", "8", "cycles 1-2 of 2; the stroke limit of 60 mm came first"],
    ]
    assert [row[-1].tone for row in table.rows] == ["text", "bad"]
    assert not [one for one in tables(report.content) if one.title == "Forces asked and reached"]


def stated(source: ReportSource, *, simulated: bool, name: str) -> ReportSource:
    """Return the same runs with the fact stated, on a stand of that name."""
    for run in source.runs:
        metadata = copy.deepcopy(dict(run.metadata))
        metadata["run"]["simulated"] = simulated
        metadata["stand"]["stand"]["name"] = name
        source = with_run(source, run.number, metadata=metadata)
    return source


def test_a_simulated_stand_of_any_name_passes_no_certificate_off_as_used(report: Made) -> None:
    content = build_content(stated(report.source, simulated=True, name="hall-3"))
    assert content.notices[0].startswith(
        "Simulated stand: nothing in this report was measured on a specimen."
    )
    assert (
        "calibrations of a simulated run are those of the stand file: no such instrument was used"
        in (content.notices[0])
    )
    (table,) = [t for t in tables(content) if t.title.startswith("Calibrations")]
    assert {row[6].text for row in table.rows} == {"not used (simulated)"}
    assert "was overdue" not in everything(content)
    assert "hall-3" in everything(content)
    head = dict(content.head.facts)
    assert head["Test stand"].text.endswith("(simulated)")
    (runs,) = [t for t in tables(content) if t.title == "Tests performed"]
    assert all(row[-1].text.endswith("(simulated)") for row in runs.rows)


def test_a_real_stand_that_is_called_a_simulation_stand_gets_no_notice(report: Made) -> None:
    name = "Simulationsprüfstand 2"
    content = build_content(stated(report.source, simulated=False, name=name))
    assert not any("imulated" in notice for notice in content.notices)
    assert name in everything(content)
    assert "(simulated)" not in everything(content)


def test_what_the_customer_supplied_is_a_list_below_its_sentence(report: Made) -> None:
    content = build_content(dataclasses.replace(report.source, fields=FILLED))
    (section,) = [section for section in content.sections if section.id == "data"]
    sentence, items = section.blocks[-2:]
    assert isinstance(sentence, Texts)
    assert isinstance(items, Texts)
    assert (sentence.listed, items.listed, items.items) == (False, True, ("Date of assembly",))
