"""The page of results says what the commands say, and does what they do; also in real Chromium."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from bufferstand.daq.desk.chosen import chosen_of
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.desk.results.curves import curve_of
from bufferstand.daq.desk.results.evaluations import OtherSettings, columns, in_words, settings_of
from bufferstand.evaluation.document import evaluate_entry
from bufferstand.foundation import BadInput
from bufferstand.model import load_model
from tests.desk.served import SAMPLES, Served, served
from tests.desk.tab import PHONE, WIDE, Tab
from tests.monitor.browser import chromium

STATIC = "old/001-static-5mm_s.h5"
HARMONIC = "old/005-harmonic-20mm-20mm-1.27Hz.h5"
UNNAMED = """[...document.querySelectorAll('input, select, button')].filter((e) =>
    !(e.labels?.length || e.textContent.trim() || e.getAttribute('aria-label'))).length"""
MODEL = "models/category-a-elastomer.toml"


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    (folder / "old").mkdir()
    for path in sorted((SAMPLES / "runs").glob("00[1345]*.h5")):
        shutil.copy(path, folder / "old")
    shutil.copytree(SAMPLES / "models", folder / "models")
    (folder / "old" / "report.toml").write_text('laboratory = "Lab <script>window.hacked=1</script>"\n')
    return folder


@pytest.fixture(scope="module")
def desk(laboratory: Path) -> Iterator[Served]:
    with served(laboratory) as it:
        it.enter()
        yield it


def get(desk: Served, path: str, **query: Any) -> tuple[int, Any]:
    status, _, text = desk.request("GET", f"{path}?{urlencode(query, doseq=True)}")
    return status, json.loads(text)


def patiently(it: Tab, condition: str) -> None:
    """Wait for what a child process computes: on a busy machine that takes minutes."""
    for _ in range(600):
        if it.tab.evaluate(condition):
            return
        it.tab.wait_for_timeout(400)
    it.wait(condition)  # says what the page shows instead


# --- pure parts --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({}, ()),
        (
            {"limits": "x.toml", "decision_rule": "simple"},
            ("--limits", "x.toml", "--decision-rule", "simple"),
        ),
        (
            {"moving_mass_kg": "120,5", "force_cell": "fixed-side"},
            ("--moving-mass", "120.5", "--force-cell", "fixed-side"),
        ),
        ({"limits": "--no-cache"}, ("--limits", "./--no-cache")),
    ],
)
def test_settings_become_words_of_the_command(content: dict[str, Any], words: tuple[str, ...]) -> None:
    assert settings_of(content).words == words


@pytest.mark.parametrize(
    "content",
    [{"decision_rule": "lenient"}, {"force_cell": "above"}, {"moving_mass_kg": "much"},
     {"moving_mass_kg": "-1"},
     {"moving_mass_kg": "nan"}],
)  # fmt: skip
def test_settings_that_are_none_are_refused(content: dict[str, Any]) -> None:
    with pytest.raises(BadInput):
        settings_of(content)
    assert OtherSettings().words == ()


def test_every_column_is_a_quantity_with_a_heading_and_what_was_asked_stands_first() -> None:
    found = columns()
    assert [one["name"] for one in found[:3]] == ["prestress_mm", "amplitude_mm", "frequency_Hz"]
    assert {"damping", "absorbed_energy_J"} <= {one["name"] for one in found}
    assert all(one["heading"].strip() and one["decimals"] >= 0 for one in found)


@pytest.mark.parametrize(
    "query",
    [{}, {"run": ["../x.h5"]}, {"run": ["old/report.toml"]}, {"folder": ["/etc"]},
     {"run": [f"{n}.h5" for n in range(80)]},
     {"run": STATIC}, {"run": [3]}],
)  # fmt: skip
def test_what_is_not_there_or_too_much_is_not_chosen(laboratory: Path, query: dict[str, object]) -> None:
    with pytest.raises(BadInput):
        chosen_of(Folder(laboratory), query)


@pytest.mark.slow
def test_the_models_loop_and_the_runs_are_those_of_the_same_cycle(laboratory: Path) -> None:
    path = laboratory / HARMONIC
    entry, _ = evaluate_entry(path)
    cycle = entry["cycles"][3]
    asked = {"path": str(path), "from_s": cycle["start_s"], "to_s": cycle["end_s"]}
    found = curve_of(asked, load_model(laboratory / MODEL))
    assert found["problem"] == ""
    for curve in (found, found["model"]):
        assert min(curve["s"]) == pytest.approx(cycle["stroke_min_mm"], abs=0.4)
        assert max(curve["s"]) == pytest.approx(cycle["stroke_max_mm"], abs=0.4)
    assert max(found["f"]) == pytest.approx(cycle["force_max_kN"], rel=0.01)
    assert found["model"]["predicted_damping"] == pytest.approx(cycle["damping"], rel=0.05)
    broken = curve_of({"path": str(laboratory / "old" / "report.toml")}, None)
    assert broken["problem"]


# --- served ------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_figures_are_those_of_the_command(desk: Served, laboratory: Path) -> None:
    status, found = get(desk, "/results/evaluation", run=[STATIC, HARMONIC])
    assert status == 200, found
    assert found["command"].endswith(f"evaluate {STATIC} {HARMONIC}")
    for run, path in zip(found["runs"], (STATIC, HARMONIC), strict=True):
        entry, _ = evaluate_entry(laboratory / path)
        assert run["path"] == path
        damping = entry["summary"]["damping"]
        assert run["values"]["damping"] == [damping["value"], damping["expanded_uncertainty"]]
        assert run["verdict"] == entry["verdict"]
        verdicts = [one["verdict"] for one in entry["requirements"]]
        assert [one["verdict"] for one in run["requirements"]] == verdicts
        assert run["step"]
    asked = {"runs": [{"path": HARMONIC, "from_s": 1.0, "to_s": 2.0}], "model": MODEL}
    status, curves = get(desk, "/results/curves", ask=json.dumps(asked))
    assert status == 200, curves
    assert curves["curves"][0]["model"]["rms_kN"] > 0.0
    assert f"model compare {MODEL} {HARMONIC}" in curves["command"]


def test_a_figure_that_moved_is_named_in_words() -> None:
    assert in_words("damping") == "damping"
    assert in_words("extreme_force_max_kN").endswith(" in kN, of the whole record")
    assert in_words("of_tomorrow_kN") == "of tomorrow kN"


@pytest.mark.slow
def test_other_settings_stand_beside_with_what_moved(desk: Served) -> None:
    status, found = desk.post("/results/again", {"run": [HARMONIC], "moving_mass_kg": "400"})
    assert status == 200, found
    stiffness = next(one for one in found["moves"] if one["quantity"] == "dynamic_stiffness_kN_per_mm")
    # m ω² of the inertia: with the load cell on the moving side the spring's force lies above the cell's
    omega = 2 * 3.14159 * 1.2732
    assert abs(stiffness["difference"]) == pytest.approx(400.0 * omega**2 / 1e6, rel=0.05)
    assert "--moving-mass 400" in found["command"]
    assert stiffness["words"].endswith("in kN/mm")
    beyond = [one["beyond_uncertainty"] for one in found["moves"]]
    assert beyond == sorted(beyond, reverse=True), "what counts stands first"
    status, refused = desk.post("/results/again", {"run": [HARMONIC]})
    assert (status, "nothing is set otherwise" in refused["problem"]) == (409, True)


@pytest.mark.slow
@pytest.mark.parametrize(
    "ask",
    ["", "[", "{}", '{"runs": []}', '{"runs": [3]}', '{"runs": [{"path": "../x.h5"}]}',
     json.dumps({"runs": [{"path": STATIC}] * 30}),
     json.dumps({"runs": [{"path": STATIC}], "model": "old/report.toml"})],
)  # fmt: skip
def test_nonsense_is_refused_in_words(desk: Served, ask: str) -> None:
    status, found = get(desk, "/results/curves", ask=ask)
    assert status == 409
    assert found["problem"]


@pytest.mark.slow
def test_whoever_may_only_look_evaluates_with_no_other_settings_and_a_foreign_page_nothing(
    desk: Served,
) -> None:
    content = {"run": [HARMONIC]}
    assert desk.request("POST", "/results/again", content, Cookie="")[0] == 403
    assert desk.request("POST", "/results/again", content, Origin="http://evil.example")[0] == 403
    assert desk.request("POST", "/results/again", content, Host="evil.example")[0] == 421


@pytest.mark.slow
@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_an_engineer_judges_in_the_browser(desk: Served, size: Any) -> None:
    with chromium() as browser, Tab(browser, desk.link, **size) as it:
        it.go(f"{desk.origin}/results?folder=old")
        patiently(it, "document.getElementById('results')?.hidden === false")
        patiently(it, "document.querySelector('#loops canvas') !== null")
        assert it.width() == size["viewport"]["width"], "no scrolling sideways"
        names = "[...document.querySelectorAll('#runs tbody tr')].map((r) => r.cells[0].innerText)"
        before = it.tab.evaluate(names)
        assert len(before) == 4
        damping = it.tab.locator("#runs th button", has_text="damping")
        damping.click()
        cells = (
            "[...document.querySelectorAll('#runs tbody tr')].map((r) => parseFloat(r.cells[6].innerText))"
        )
        rising = it.tab.evaluate(cells)
        assert rising == sorted(rising)
        damping.click()
        assert it.tab.evaluate(cells) == rising[::-1]
        it.tab.fill("#filter", "static")
        it.wait("document.querySelectorAll('#runs tbody tr').length === 1")
        it.tab.fill("#filter", "")
        it.tab.select_option("#model", MODEL)
        patiently(it, "document.querySelectorAll('#model-table tbody tr').length === 4")
        assert int(it.tab.get_attribute("#loops", "data-curves")) == 8
        it.wait("document.querySelector('#trend-chart canvas') !== null")
        assert "per Hz" in it.tab.inner_text("#trend-said")
        assert "inconclusive" in it.tab.inner_text("#requirements")
        it.tab.select_option("[name=decision_rule]", "guard-band")
        it.tab.click("#again button")
        patiently(it, "document.getElementById('moved').textContent.length > 0")
        assert it.tab.evaluate(UNNAMED) == 0, "everything that is operated has a name"
        assert it.tab.evaluate("window.hacked") is None
        assert it.complaints == []
