"""What the demo must show: physics that closes its balance, the paper's figures, the stop, the report."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pypdfium2
import pytest

from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify
from tests.evaluation_report.test_pages import broken
from tests.main_job.conftest import Demo, bufferstand


def used_cycles(entry: dict[str, Any]) -> list[dict[str, Any]]:
    return [cycle for cycle in entry["cycles"] if cycle["index"] in entry["summary"]["cycles_used"]]


def value(entry: dict[str, Any], name: str) -> float:
    found = entry["summary"][name]["value"]
    assert found is not None
    return float(found)


def true_difference(demo: Demo, path: str, cycle: dict[str, Any], name: str) -> float:
    """Return what the specimen's ledger gained over a cycle; run time zero is the run's first sample."""
    first_s = float(open_run(Path(path)).streams["controller"].time_s[0])
    at_s = [first_s + cycle["start_s"], first_s + cycle["end_s"]]
    before, after = np.interp(at_s, demo.truth["time_us"] / 1e6, demo.truth[name])
    return float(after - before)


def test_every_step_is_complete_but_the_one_that_means_to_get_too_hot(demo: Demo) -> None:
    statuses = [step["status"] for step in demo.record["steps"]]
    assert statuses == ["complete"] * 12 + ["stopped"]
    assert demo.record["steps"][-1]["stopped_by"].startswith("temperature")


def test_absorbed_energy_is_the_work_that_the_specimen_kept(demo: Demo) -> None:
    """Each within its own U, a run's mean within 0.8 %.

    The flicker of the force, 0.05 kN, at the cycle's own frequency and in quadrature, is 0.35 % of 520 J
    at 1.27 Hz (standard deviation of 16 cycles of four demos; of the mean of the four of a run, 0.17 %).
    """
    checked = 0
    for entry in demo.document["runs"]:
        away = []
        for cycle in used_cycles(entry):
            work_J = true_difference(demo, entry["run"]["path"], cycle, "work_J")
            found_J, uncertainty_J = (
                cycle["absorbed_energy_J"],
                cycle["expanded_uncertainty"]["absorbed_energy_J"],
            )
            assert uncertainty_J < 0.02 * work_J
            assert found_J == pytest.approx(work_J, abs=uncertainty_J), entry["run"]["id"]
            away.append(found_J / work_J - 1.0)
        checked += len(away)
        assert np.mean(away) == pytest.approx(0.0, abs=0.008), entry["run"]["id"]
    assert checked > 60


def test_absorbed_energy_is_the_heat_that_the_specimen_made(demo: Demo) -> None:
    for entry in demo.document["runs"]:
        cycles = used_cycles(entry)
        if entry["run"]["kind"] == "static":
            # Softening takes stored work along; in all three cycles together the balance closes.
            whole = {"start_s": cycles[0]["start_s"], "end_s": cycles[-1]["end_s"]}
            cycles = [whole | {"absorbed_energy_J": sum(cycle["absorbed_energy_J"] for cycle in cycles)}]
        for cycle in cycles:
            heat_J = true_difference(demo, entry["run"]["path"], cycle, "heat_J")
            # The viscous branch goes on relaxing after the ramp to the prestress: heat that is no loop area,
            # most in the smallest loop (5 mm: 1 … 2 %, by how soon after the ramp it begins).
            assert cycle["absorbed_energy_J"] == pytest.approx(heat_J, rel=0.03), entry["run"]["id"]


def test_damping_of_the_paper(demo: Demo) -> None:
    assert value(demo.entry("002-harmonic-20mm-20mm"), "damping") == pytest.approx(0.232, abs=0.006)
    assert value(demo.entry("010-harmonic-40mm-40mm"), "damping") == pytest.approx(0.386, abs=0.006)


def test_damping_falls_a_little_with_frequency_as_in_the_paper(demo: Demo) -> None:
    for prestress_mm, fall in ((20.0, 0.232 - 0.225), (40.0, 0.386 - 0.373)):
        (trend,) = [
            trend
            for trend in demo.document["trends"]
            if trend["quantity"] == "damping" and abs(trend["prestress_mm"] - prestress_mm) < 2.0
        ]
        assert trend["slope_per_Hz"] < 0.0
        assert 0.3 * fall < trend["values"][0] - trend["values"][-1] < 2.5 * fall


def test_stiffness_rises_with_frequency_at_constant_speed_and_says_why_not_to_trust_it(demo: Demo) -> None:
    (trend,) = [
        trend
        for trend in demo.document["trends"]
        if trend["quantity"] == "tangent_stiffness" and trend["amplitude_mm"] is None
    ]
    assert trend["slope_per_Hz"] > 0.5
    assert any("confounded" in text for text in trend["warnings"])


def test_static_run_meets_the_windows_it_reaches_and_says_what_it_cannot_show(demo: Demo) -> None:
    entry = demo.entry("001-static")
    verdicts = {(row["id"], row["cycle"]): row["verdict"] for row in entry["requirements"]}
    assert [cycle["complete"] for cycle in entry["cycles"]] == [True] * 3
    for cycle in (1, 2, 3):
        for name in ("preload", "force-at-25mm", "force-at-60mm", "stored-energy"):
            assert verdicts[name, cycle] == "pass"
        assert verdicts["force-at-100mm", cycle] == "not-tested"
        assert verdicts["full-stroke", cycle] == "inconclusive"
        assert verdicts["absorbed-energy-ratio", cycle] == "inconclusive"
    conditions = {row["id"]: row["verdict"] for row in entry["requirements"] if row["condition"]}
    conditions.pop("full-stroke")
    assert set(conditions.values()) == {"pass"}
    assert {"temperature-range", "speed-limit", "cycle-count", "rest-after-assembly"} <= set(conditions)
    assert entry["verdict"] == "inconclusive"


def test_stop_at_forty_degrees_leaves_the_actuator_without_force_and_the_data_whole(demo: Demo) -> None:
    run = open_run(Path(demo.entry("013-")["run"]["path"]))
    assert run.status == "stopped"
    assert re.search(r"temperature_\d \(spring plate \d\) 40\.\d+ °C has reached the stop", run.reason)
    force, temperature = run.series("force"), run.series("temperature_1")
    assert abs(float(np.mean(force.value[-200:]))) < 1.0
    stopped_s = next(event.time_s for event in run.events if event.kind == "trip")
    assert stopped_s is not None
    before = temperature.value[temperature.time_s < stopped_s - 2.0]
    assert before.max() < 40.0 + 0.5
    assert float(demo.truth["force_kN"][-1]) == pytest.approx(0.0, abs=0.5)


def test_run_files_are_whole_and_lose_nothing(demo: Demo) -> None:
    files = sorted((demo.folder / "runs").glob("*.h5"))
    assert len(files) == 13
    for file in files:
        assert [finding for finding in verify(file) if finding.level == "fault"] == []
        run = open_run(file)
        controller = run.streams["controller"]
        made_us = demo.truth["time_us"]  # a cycle that the controller missed has no sample
        inside = (made_us >= controller.time[0]) & (made_us <= controller.time[-1])
        assert np.array_equal(made_us[inside], controller.time)
        assert (
            sum(lost for _, lost in run.gaps("controller"))
            == np.ptp(controller.time) // 1000 + 1 - inside.sum()
        )
        assert run.streams["temperature_1"].rows >= controller.rows / 1000 - 3


def test_both_readings_of_the_force_agree(demo: Demo) -> None:
    run = open_run(demo.folder / "runs" / "001-static-5mm_s.h5")
    force, force_2 = run.series("force"), run.series("force_2")
    at = np.interp(force_2.time_s, force.time_s, force.value)
    inside = (force_2.time_s > force.time_s[0]) & (force_2.time_s < force.time_s[-1])
    assert float(np.median(np.abs(at - force_2.value)[inside])) < 3.0


def test_report_is_there_and_tells_the_story(demo: Demo) -> None:
    (html,) = (demo.folder / "report").glob("*.html")
    text = html.read_text()
    assert html.as_uri().replace("%20", " ") in demo.process.stdout.replace("%20", " ")
    assert "A-105-E-01" in text
    assert "40 °C" in text
    assert text.count("<img") >= 7
    assert "<script" not in text
    assert "Simulated stand" in text


def test_the_report_has_at_most_eight_pages_before_its_annex(demo: Demo) -> None:
    (pdf,) = (demo.folder / "report").glob("*.pdf")
    texts = [page.get_textpage().get_text_range() for page in pypdfium2.PdfDocument(str(pdf))]
    annex = next(at for at, text in enumerate(texts) if re.search(r"^Annex\r?$", text, re.MULTILINE))
    assert annex <= 8
    assert "Authorised by" in texts[0]
    warned = "".join(texts[:annex]).partition("Warnings")[2]
    assert "above the limit of 600" in warned
    assert "not complete" not in warned, "the lead-in is planned"


def test_the_report_breaks_no_number_and_leaves_no_heading_alone(demo: Demo) -> None:
    (pdf,) = (demo.folder / "report").glob("*.pdf")
    (html,) = (demo.folder / "report").glob("*.html")
    assert list(broken(pdf.read_bytes())) == []
    titles = set(re.findall(r"<h[23]>(.*?)</h[23]>", html.read_text(encoding="utf-8"))) | {"Annex"}
    assert len(titles) > 20
    for page in pypdfium2.PdfDocument(str(pdf)):
        lines = [line.strip() for line in page.get_textpage().get_text_range().splitlines() if line.strip()]
        assert not {lines[-1], lines[-2]} & titles  # the foot of the page may stand last


def test_the_report_sets_the_paper_s_numbers_beside_its_own(demo: Demo) -> None:
    (html,) = (demo.folder / "report").glob("*.html")
    text = html.read_text(encoding="utf-8")
    (section,) = re.findall(r'<section id="paper">.*?</section>', text, re.DOTALL)
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row, re.DOTALL) for row in section.split("<tr>")[2:]]
    shown = [[re.sub(r"<sup>.*?</sup>|<[^>]*>", "", cell) for cell in row] for row in rows]
    dampings = [row for row in shown if row[1] == "Damping"]
    assert [row[3] for row in dampings] == ["0.232", "0.225", "0.386", "0.373"]
    assert all(row[8] == "within U" for row in dampings)


def test_progress_goes_to_standard_error_without_colour(demo: Demo) -> None:
    assert "step 13 of 13" in demo.process.stderr
    assert re.search(r"safe stop: force -?\d\.\d kN \(channel force, zero taken off\)", demo.process.stderr)
    assert "\x1b[" not in demo.process.stderr + demo.process.stdout
    assert "step 13 of 13" not in demo.process.stdout


def test_what_it_says_to_do_next_can_be_done(demo: Demo) -> None:
    after = demo.process.stdout.partition("What next")[2]
    typed = [line.strip() for line in after.splitlines() if line.strip().startswith("bufferstand ")]
    assert len(typed) >= 4
    for line in typed:
        words = shlex.split(line)[1:]
        if words[:2] == ["model", "fit"]:  # takes half a minute, and has tests of its own
            assert list(Path(words[2]).glob("*.h5"))
            continue
        done = bufferstand(*words)
        assert done.returncode == 0, f"{line}\n{done.stderr}"
