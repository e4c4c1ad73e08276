"""The report is made, signed, verified and shown by one form, on the page of results and on a campaign's."""

from __future__ import annotations

import json
import shutil
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest

from tests.cli.processes import bufferstand
from tests.desk.served import SAMPLES, Served, served, until
from tests.desk.tab import PHONE, WIDE, Tab
from tests.evaluation_report.keys import PASSWORD, make
from tests.monitor.browser import chromium

HARMONIC = "old/004-harmonic-20mm-20mm-0.637Hz.h5"
WRONG = "not it, at all"


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a run, a key and a model."""
    folder = tmp_path_factory.mktemp("laboratory")
    (folder / "old").mkdir()
    shutil.copy(SAMPLES / "runs" / Path(HARMONIC).name, folder / "old")
    (folder / "old" / "report.toml").write_text('laboratory = "Lab <script>window.hacked=1</script>"\n')
    shutil.copytree(SAMPLES / "models", folder / "models")
    make(folder / "keys")
    return folder


@pytest.fixture(scope="module")
def desk(laboratory: Path) -> Iterator[Served]:
    with served(laboratory) as it:
        it.enter()
        yield it


class Watch:
    """Looks at the arguments and environments of all processes meanwhile, for a text that belongs in none."""

    def __init__(self, text: str) -> None:
        self._text = text.encode()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look)
        self.commands: set[bytes] = set()
        self.found: set[bytes] = set()

    def __enter__(self) -> Watch:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _look(self) -> None:
        while not self._over.is_set():
            for process in Path("/proc").glob("[0-9]*"):
                for name in ("cmdline", "environ"):
                    try:
                        said = (process / name).read_bytes()
                    except OSError:
                        continue
                    if b"--sign" in said and name == "cmdline":
                        self.commands.add(said)
                    if self._text in said:
                        self.found.add(said)
            time.sleep(0.05)


def reported(desk: Served, **content: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Have a report made; return what was answered, and how it ended."""
    status, begun = desk.post("/report", {"run": [HARMONIC], **content})
    assert status == 200, begun

    def ended() -> Any:
        state = desk.request("GET", f"/job/{begun['job']}")[2]
        return state if '"running":false' in state else None

    return begun, json.loads(until(ended))


def files(desk: Served) -> list[str]:
    """Return the files of the report, as the page lists them."""
    return list(json.loads(desk.request("GET", f"/report/made?{urlencode({'run': HARMONIC})}")[2])["files"])


def test_it_is_signed_with_a_key_whose_password_is_nowhere(desk: Served, laboratory: Path) -> None:
    with Watch(PASSWORD) as watch:
        begun, ended = reported(desk, key="keys/key.p12", password=PASSWORD)
    assert ended["status"] == 0, ended
    assert "--sign keys/key.p12" in begun["command"]
    assert any(b"--sign" in one for one in watch.commands), "it was looked while the command ran"
    assert watch.found == set()
    for kept in laboratory.rglob("*"):
        assert not kept.is_file() or PASSWORD.encode() not in kept.read_bytes(), kept
    assert PASSWORD not in ended["text"]
    (pdf,) = [name for name in files(desk) if name.endswith(".pdf")]
    said = bufferstand("verify", str(laboratory / pdf))
    assert said.returncode == 0, said.stderr
    assert "Test hall 2" in said.stdout
    status, found = desk.post("/report/verify", {"path": pdf})
    assert (status, found["good"]) == (200, True)
    assert "Test hall 2" in found["said"]
    assert found["command"].endswith(f"verify {pdf}")
    (laboratory / pdf).write_bytes((laboratory / pdf).read_bytes().replace(b"%PDF-1.", b"%PDF-2.", 1))
    _, found = desk.post("/report/verify", {"path": pdf})
    assert not found["good"]


@pytest.mark.parametrize(
    ("key", "password", "said"),
    [
        ("keys/key.p12", WRONG, "the password does not open it"),
        ("keys/key.p12", "", "the password does not open it"),
        ("keys/certificate.pem", PASSWORD, "PEM file"),
    ],
)
def test_what_is_wrong_with_a_key_is_said_before_anything_is_evaluated(
    desk: Served, key: str, password: str, said: str
) -> None:
    _, ended = reported(desk, key=key, password=password)
    assert ended["status"] == 2
    assert said in ended["text"]
    assert not password or password not in ended["text"]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ({"key": "no-key.p12", "password": "x"}, "no such file"),
        ({"key": "../key.p12", "password": "x"}, "outside the desk's folder"),
        ({"key": "keys/key.p12", "password": "x" * 5000}, "longer than"),
        ({"annex": "--out /"}, "--annex is one of"),
        ({"language": "xx"}, "--language is one of"),
        ({"model": "../x.toml"}, "outside the desk's folder"),
        ({"run": []}, "no campaign and no run"),
        ({"run": [], "folder": ["models"]}, "no run"),
    ],
)
def test_a_form_with_something_wrong_in_it_starts_nothing(
    desk: Served, content: dict[str, Any], said: str
) -> None:
    status, refused = desk.post("/report", {"run": [HARMONIC], **content})
    assert (status, said in refused["problem"]) == (409, True), refused


def test_whoever_may_only_look_makes_no_report_and_a_foreign_page_nothing(desk: Served) -> None:
    for path, content in (("/report", {"run": [HARMONIC]}), ("/report/verify", {"path": "x"})):
        assert desk.request("POST", path, content, Cookie="")[0] == 403
        assert desk.request("POST", path, content, Origin="http://evil.example")[0] == 403
        assert desk.request("POST", path, content, Host="evil.example")[0] == 421
    for path in ("old/report.toml", "../x", HARMONIC, "keys/key.p12", "models/category-a-elastomer.toml"):
        status, _, text = desk.request("GET", f"/report/file?{urlencode({'path': path})}")
        assert (status, "This cannot be shown" in text) == (404, True)
        assert desk.post("/report/verify", {"path": path})[0] == 409


def test_it_is_shown_and_runs_nothing(desk: Served) -> None:
    begun, ended = reported(desk, language="de", model="models/category-a-elastomer.toml")
    assert ended["status"] == 0, ended
    assert "--language de --model models/category-a-elastomer.toml" in begun["command"]
    html = next(name for name in files(desk) if name.endswith(".html"))
    assert any(name.endswith(".pdf") for name in files(desk))
    status, headers, text = desk.request("GET", f"/report/file?{urlencode({'path': html})}")
    assert status == 200
    policy = headers["content-security-policy"]
    assert "script-src" not in policy
    assert "default-src 'none'" in policy
    assert policy.endswith("sandbox")
    assert "&lt;script&gt;window.hacked" in text


@pytest.mark.parametrize("size", [WIDE, PHONE], ids=["1300", "390"])
def test_the_one_who_signs_does_it_in_the_browser(desk: Served, size: Any) -> None:
    with chromium() as browser, Tab(browser, desk.link, **size) as it:
        it.go(f"{desk.origin}/results?{urlencode({'run': HARMONIC})}")
        it.wait("document.getElementById('results')?.hidden === false")
        assert it.tab.evaluate(
            "[...document.querySelectorAll('#report-keys option')].map((o) => o.value)"
        ) == ["keys/key.p12"]
        it.tab.fill("#report-key", "keys/key.p12")
        it.tab.fill("#report-password", WRONG)
        it.tab.click("#make-report")
        it.wait("document.getElementById('said').innerText.includes('the password does not open it')")
        assert it.tab.input_value("#report-password") == "", "a password does not stay in the page"
        assert it.complaints == []
        it.tab.fill("#report-password", PASSWORD)
        it.tab.press("#report-password", "Enter")
        it.wait("document.getElementById('said').innerText.includes('made and signed')")
        it.tab.click("text=Verify it")
        it.wait("document.getElementById('verified').innerText.includes('Test hall 2')")
        assert it.tab.locator("#verified.problem").count() == 0
        assert it.width() == size["viewport"]["width"], "no scrolling sideways"
        assert PASSWORD not in it.tab.content()
        assert it.complaints == []
