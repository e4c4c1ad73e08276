"""Preparing over the wire: the plan follows the text, messages have their place, no change is lost."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.desk.served import HACK, Served, laboratory, served
from tests.desk.tab import WIDE, Tab
from tests.monitor.browser import chromium


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(laboratory(tmp_path_factory.mktemp("laboratory"))) as it:
        it.enter()
        yield it


@pytest.fixture
def demo(desk: Served) -> Iterator[Path]:
    path = desk.folder / "demo.toml"
    before = path.read_text()
    yield path
    path.write_text(before)


def test_the_plan_is_that_of_the_text_not_of_the_file(desk: Served, demo: Path) -> None:
    text = demo.read_text().replace("cycles = 200", "cycles = 2")
    status, said = desk.post("/prepare/plan", {"name": "demo.toml", "text": text})
    assert status == 200
    assert "warming up" in said["plan"]
    key = said["plan"].partition("/prepare/picture/")[2].partition('"')[0]
    status, headers, picture = desk.request("GET", f"/prepare/picture/{key}")
    assert status == 200
    assert headers["content-type"].startswith("image/svg")
    assert "<svg" in picture
    assert "cycles = 200" in demo.read_text()
    assert sorted(path.name for path in desk.folder.iterdir() if path.name.startswith(".")) == []


def test_what_is_wrong_is_said_with_its_line_and_its_field(desk: Served, demo: Path) -> None:
    text = demo.read_text().replace("speed_mm_per_s = 5.0", "speed_mm_per_s = -5.0")
    line = text[: text.index("-5.0")].count("\n") + 1
    status, said = desk.post("/prepare/plan", {"name": "demo.toml", "text": text})
    assert status == 200
    assert f"line {line}" in said["wrong"]
    assert ".draft" not in said["wrong"]
    assert said["line"] == line
    assert said["group"] == "g-step-0"
    assert said["field"] == "f-step-0-speed_mm_per_s"


def test_a_step_that_breaks_a_limit_is_refused_at_its_step(desk: Served, demo: Path) -> None:
    text = demo.read_text().replace("amplitude_mm = [20.0]", "amplitude_mm = [70.0]")
    said = desk.post("/prepare/plan", {"name": "demo.toml", "text": text})[1]
    assert "below first contact" in said["wrong"]
    assert said["group"] == "g-step-1"


def test_a_file_that_somebody_changed_meanwhile_is_not_written_over(desk: Served, demo: Path) -> None:
    text = demo.read_text()
    base = hashlib.sha256(text.encode()).hexdigest()
    theirs = text.replace("ambient_C = 21.0", "ambient_C = 19.0")
    demo.write_text(theirs)
    mine = text.replace("ambient_C = 21.0", "ambient_C = 23.0")
    status, said = desk.post("/prepare/save", {"name": "demo.toml", "text": mine, "base": base})
    assert status == 409
    assert "changed by somebody else" in said["problem"]
    assert demo.read_text() == theirs
    base = hashlib.sha256(theirs.encode()).hexdigest()
    assert desk.post("/prepare/save", {"name": "demo.toml", "text": mine, "base": base})[0] == 200
    assert demo.read_text() == mine
    status, said = desk.post("/prepare/save", {"name": "demo.toml", "text": mine, "as": "demo"})
    assert (status, "is there already" in said["problem"]) == (409, True)


def test_it_writes_nothing_outside_the_folder_and_no_text_that_is_no_toml(desk: Served, demo: Path) -> None:
    text = demo.read_text()
    for name in ("../x.toml", "/tmp/x.toml", "a/../../x.toml"):
        assert desk.post("/prepare/save", {"name": "demo.toml", "text": text, "as": name})[0] == 409
        assert desk.post("/prepare/plan", {"name": name, "text": text})[0] == 409
    status, said = desk.post("/prepare/save", {"name": "demo.toml", "text": "[a", "as": "new"})
    assert status == 409
    assert said["problem"]
    assert not (desk.folder / "new.toml").exists()


def test_the_form_changes_one_value_of_the_text(desk: Served, demo: Path) -> None:
    sent = {"name": "demo.toml", "text": demo.read_text(), "what": "set"}
    status, said = desk.post("/prepare/edit", {**sent, "path": ["limits", "force_max_kN"], "value": "550,5"})
    assert status == 200
    assert said["text"] == demo.read_text().replace("force_max_kN = 600.0", "force_max_kN = 550.5")
    status, said = desk.post("/prepare/edit", {**sent, "path": ["limits", "force_max_kN"], "value": "much"})
    assert (status, said["field"]) == (409, "f-limits-force_max_kN")
    for path in (["limits"], ["step", 99, "cycles"], "limits", [1.5], [], ["__class__"]):
        assert desk.post("/prepare/edit", {**sent, "path": path, "value": "1"})[0] == 409


def test_script_in_a_file_stays_text_in_form_text_and_plan(desk: Served, demo: Path) -> None:
    demo.write_text(
        demo.read_text().replace('operator = "demo"', f"operator = '{HACK}'\nnote = '</textarea>{HACK}'")
    )
    page = desk.request("GET", "/prepare?campaign=demo.toml")[2]
    assert "<img" not in page
    assert "</textarea>&lt;" not in page.replace("&lt;/textarea&gt;", "")
    text = demo.read_text().replace('name = "warming up"', f"name = '{HACK}'")
    plan = desk.post("/prepare/plan", {"name": "demo.toml", "text": text})[1]["plan"]
    assert "<img src=x" not in plan
    assert "&lt;img src=x" in plan


def test_a_text_with_a_line_feed_first_is_given_back_as_it_is(desk: Served) -> None:
    path = desk.folder / "blank.toml"
    path.write_text("\n\n[campaign]\nid = 'x'\n")
    page = desk.request("GET", "/prepare?campaign=blank.toml")[2]
    shown = page.partition("<textarea")[2].partition(">")[2].partition("</textarea>")[0]
    assert shown == "\n" + path.read_text().replace("'", "&#39;"), "a browser drops the first line feed"
    path.unlink()


def test_a_plan_that_nobody_waits_for_any_more_is_given_up(desk: Served, demo: Path) -> None:
    sent = {"name": "demo.toml", "text": demo.read_text(), "page": "1"}
    with ThreadPoolExecutor() as pool:
        answers = [said for _, said in pool.map(lambda _: desk.post("/prepare/plan", sent), range(4))]
    assert all(said == {"stale": True} or "warming up" in said["plan"] for said in answers)
    assert any("plan" in said for said in answers)
    assert any("stale" in said for said in answers)
    assert [path for path in desk.folder.iterdir() if ".draft" in path.name] == []


EDITS = """(texts) => { const field = document.getElementById("text");
    for (const one of texts) { field.value = one; field.dispatchEvent(new Event("input")); } }"""


def test_edits_in_a_row_make_one_plan_and_a_text_that_is_planned_already_none(desk: Served) -> None:
    with chromium() as browser, Tab(browser, desk.link, **WIDE) as it:
        it.go(f"{desk.origin}/prepare?campaign=demo.toml")
        it.says("Peak force")
        text = it.tab.input_value("#text")
        it.requests.clear()
        it.tab.evaluate(EDITS, [text + "#", text])
        it.wait("document.getElementById('state').innerText === 'as in the file'")
        it.tab.evaluate(EDITS, [f"{text}# {number}" for number in range(10)])
        it.wait("document.getElementById('plan').getAttribute('aria-busy') === 'true'")
        it.wait("document.getElementById('plan').getAttribute('aria-busy') === null")
        assert [url for url in it.requests if url.endswith("/prepare/plan")] == [
            f"{desk.origin}/prepare/plan"
        ]
        it.requests.clear()
        it.tab.evaluate(EDITS, [text, f"{text}# 9"])
        it.tab.wait_for_timeout(4000)
        assert not [url for url in it.requests if url.endswith("/prepare/plan")]
        it.tab.evaluate(EDITS, [text])
        it.wait("document.getElementById('plan').getAttribute('aria-busy') === 'true'")
        assert it.complaints == []
