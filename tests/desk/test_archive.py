"""The archive: which runs are found, in which order, how the list is kept, and what is handed on of it."""

from __future__ import annotations

import csv
import io
import json
import shutil
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bufferstand.daq.desk.results.archive import FRESH_S, SORTS, RunList, found_in
from bufferstand.foundation import BadInput
from bufferstand.foundation.specimen.file import Specimen
from bufferstand.recording.finding import RunFileFacts, facts_of
from tests.daq.test_runner import Case
from tests.desk.served import HACK, SAMPLES, Served, served, until
from tests.desk.tab import PHONE, WIDE, Tab
from tests.monitor.browser import chromium

ROOT = Path("/archive")


def facts(number: int, **more: Any) -> RunFileFacts:
    """Return the facts of a run that is not there."""
    found = RunFileFacts(
        path=ROOT / f"{number // 100:03d}" / f"run-{number:05d}.h5",
        id=f"run-{number:05d}",
        kind="harmonic" if number % 2 else "static",
        status="complete",
        started_utc=f"2026-{1 + number % 12:02d}-05T08:00:00+00:00",
        specimen_id=f"S-{number % 20:02d}",
        frequency_Hz=None if number % 2 == 0 else 0.1 * (number % 30),
    )
    return replace(found, **more)


def listed(many: list[RunFileFacts]) -> RunList:
    return RunList(ROOT, lambda _: many)


NUMBERS = st.lists(st.integers(0, 9999), unique=True, max_size=60)


@given(NUMBERS, st.sampled_from(SORTS), st.booleans())
@settings(max_examples=80, deadline=None)
def test_sorting_loses_nothing_and_puts_what_is_unknown_last(
    numbers: list[int], sort: str, down: bool
) -> None:
    rows = listed([facts(number) for number in numbers]).rows()
    found = found_in(rows, "", "", sort, down=down)
    assert sorted(row.facts["path"] for row in found) == sorted(row.facts["path"] for row in rows)
    values = [row.facts[sort] for row in found]
    known = [value for value in values if value not in (None, "")]
    assert values[: len(known)] == known == sorted(known, reverse=down)


@given(NUMBERS, st.sampled_from(["S-07", "static", "run-00", "07-05", "S-07 static", "nowhere"]))
@settings(max_examples=60, deadline=None)
def test_every_word_is_somewhere_on_record_of_what_is_found(numbers: list[int], words: str) -> None:
    rows = listed([facts(number) for number in numbers]).rows()
    found = {row.facts["path"] for row in found_in(rows, words, "", "path", down=False)}
    for row in rows:
        texts = " ".join(str(row.facts[name]) for name in ("path", "started_utc", "kind", "specimen"))
        assert (row.facts["path"] in found) == all(
            word.casefold() in texts.casefold() for word in words.split()
        )


def test_a_condition_is_that_of_the_command() -> None:
    rows = listed([facts(number) for number in range(400)]).rows()
    found = found_in(rows, "", 'specimen == "S-11" and frequency_Hz > 0.5', "path", down=False)
    assert found
    assert all(row.facts["specimen"] == "S-11" and row.facts["frequency_Hz"] > 0.5 for row in found)
    with pytest.raises(BadInput, match="unknown name “frequncy_Hz”; did you mean “frequency_Hz”"):
        found_in(rows, "", "frequncy_Hz > 1", "path", down=False)
    with pytest.raises(BadInput, match="sorted by one of"):
        found_in(rows, "", "", "__class__", down=False)


def test_the_list_is_read_once_and_renewed_beside_whoever_asks() -> None:
    now, reads, renewed, goes_on = [0.0], [], threading.Event(), threading.Event()

    def read(_: Path) -> list[RunFileFacts]:
        reads.append(now[0])
        if len(reads) > 1:
            renewed.set()
            goes_on.wait(30.0)
        return [facts(number) for number in range(len(reads))]

    runs = RunList(ROOT, read, lambda: now[0])
    assert len(runs.rows()) == len(runs.rows()) == 1
    assert reads == [0.0]
    assert not runs.renewing
    now[0] = FRESH_S + 1.0
    assert len(runs.rows()) == 1, "whoever asks does not wait"
    assert renewed.wait(30.0)
    assert runs.renewing, "the page knows that what it shows is old, and asks again"
    goes_on.set()
    until(lambda: not runs.renewing)
    assert len(runs.rows()) == 2


def test_a_folder_without_runs_is_an_empty_archive(tmp_path: Path) -> None:
    assert RunList(tmp_path).rows() == []


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the samples' runs, one of a specimen with a wicked name, and one that is none."""
    folder = tmp_path_factory.mktemp("archive")
    (folder / "old").mkdir()
    for path in (SAMPLES / "runs").glob("*.h5"):
        shutil.copy(path, folder / "old")
    case = Case(folder / "wicked")
    case.plan = replace(case.plan, specimen=Specimen(id=f"=cmd|{HACK}"))
    assert case.run().status == "complete"
    (folder / "broken.h5").write_bytes(b"no HDF5")
    return folder


@pytest.fixture(scope="module")
def desk(laboratory: Path) -> Iterator[Served]:
    with served(laboratory) as it:
        it.enter()
        yield it


def search(desk: Served, **query: str) -> dict[str, Any]:
    status, _, text = desk.request("GET", f"/archive/runs?{urlencode(query)}")
    assert status == 200, text
    found: dict[str, Any] = json.loads(text)
    return found


@pytest.mark.slow
def test_what_is_served_is_on_record(desk: Served, laboratory: Path) -> None:
    whole = search(desk)
    paths = {row["path"] for row in whole["rows"]}
    assert len(paths) == whole["all"] == whole["found"] == 8
    for name in ("old/001-static-5mm_s.h5", "old/005-harmonic-20mm-20mm-1.27Hz.h5"):
        row = next(one for one in whole["rows"] if one["path"] == name)
        known = facts_of(laboratory / name)
        assert (row["step"], row["started_utc"], row["frequency_Hz"]) == (
            known.step, known.started_utc, known.frequency_Hz
        )  # fmt: skip
    broken = next(one for one in whole["rows"] if one["path"] == "broken.h5")
    assert broken["problem"]
    assert search(desk, words="static 5mm")["found"] == 1
    status, _, text = desk.request("GET", f"/archive/runs?{urlencode({'where': 'nonsense ('})}")
    assert (status, "no expression" in json.loads(text)["problem"]) == (409, True)
    assert desk.request("GET", "/archive/runs?first=x")[0] == 400


@pytest.mark.slow
def test_a_table_of_them_is_no_formula_for_a_spreadsheet(desk: Served) -> None:
    status, headers, text = desk.request("GET", "/archive/table?words=cmd")
    assert status == 200
    assert "attachment" in headers["content-disposition"]
    (row,) = csv.DictReader(io.StringIO(text))
    assert row["specimen"] == f"'=cmd|{HACK}"


@pytest.mark.slow
@pytest.mark.parametrize("path", ["../archive.h5", "/etc/passwd", "old", "old/none.h5", "broken.h5", ""])
def test_what_is_no_run_of_the_folder_is_not_opened(desk: Served, path: str) -> None:
    status, _, text = desk.request("GET", f"/archive/run?{urlencode({'path': path})}")
    assert status == 404
    assert "This cannot be shown" in text


@pytest.mark.slow
@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_runs_are_found_opened_and_taken_to_their_results(desk: Served, size: Any) -> None:
    with chromium() as browser, Tab(browser, desk.link, **size) as it:
        it.go(f"{desk.origin}/archive")
        it.wait("document.body.dataset.found === '8'")
        assert it.width() == size["viewport"]["width"], "no scrolling sideways"
        it.tab.fill("#words", "1.27")
        it.wait("document.body.dataset.found === '1'")
        it.tab.fill("#where", "nonsense (")
        it.tab.press("#where", "Enter")
        it.wait("document.getElementById('where-problem').textContent.includes('no expression')")
        it.tab.fill("#where", "")
        it.tab.press("#where", "Enter")
        it.wait("document.getElementById('where-problem').textContent === ''")
        it.tab.click("#archive tbody a")
        it.says("As recorded, thinned out")
        it.wait("document.querySelector('#curve canvas') !== null")
        assert "temperature_1" in it.tab.inner_text("main")
        it.go(f"{desk.origin}/archive?words=harmonic&sort=path&down=0")
        it.wait("document.body.dataset.found === '6'")
        assert it.tab.get_attribute("#archive th", "aria-sort") == "ascending"
        for box in it.tab.locator("#archive input[type=checkbox]").all()[:2]:
            box.check()
        it.tab.click("#open-ticked")
        it.wait("location.pathname === '/results' && location.search.split('run=').length === 3")
        assert [one for one in it.complaints if "409" not in one] == []


@pytest.mark.slow
def test_script_in_a_specimens_name_is_shown_as_text_and_never_run(desk: Served) -> None:
    with chromium() as browser, Tab(browser, desk.link) as it:
        it.go(f"{desk.origin}/archive?words=cmd")
        it.says("<img src=x onerror")
        it.tab.click("#archive tbody a")
        it.says("On record")
        it.says("<script>window.hacked=1</script>")
        assert it.tab.evaluate("window.hacked") is None
        assert it.tab.locator("img").count() == 0
        assert it.complaints == []
