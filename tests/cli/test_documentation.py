"""``bufferstand docs``: the pages, their links, and the search in them."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from urllib.request import urlopen

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from starlette.applications import Starlette

from bufferstand.cli.commands.docs import command
from bufferstand.cli.documentation import Page, documentation_site, find, read_pages
from bufferstand.foundation import BadInput
from tests.asgi import ask

PAGES = read_pages()
SITE = documentation_site()


@pytest.fixture
def site() -> Starlette:
    return SITE


@pytest.fixture(scope="module")
def rendered() -> Mapping[str, str]:
    return {f"/{name}.html": ask(SITE, f"/{name}.html").text for name in PAGES}


def test_every_page_is_rendered_with_its_title(rendered: Mapping[str, str]) -> None:
    for name, page in PAGES.items():
        assert f"{page.title.replace('&', '&amp;')} · bufferstand</title>" in rendered[
            f"/{name}.html"
        ].replace("&#x27;", "'"), name


def test_every_link_leads_to_a_page_and_a_heading_that_are_there(
    rendered: Mapping[str, str], site: Starlette
) -> None:
    wrong = []
    for name, text in rendered.items():
        for kind, target in re.findall(r'(href|src)="(/[^"]*|#[^"]*)"', text):
            place, _, anchor = target.partition("#")
            place = place or name
            if kind == "src" or place.startswith("/static/"):
                assert ask(site, place).status == 200, (name, target)
            elif place != "/" and (anchor and f'id="{anchor}"') not in rendered.get(place, "\0"):
                wrong.append((name, target))
    assert not wrong


def test_each_page_is_listed_where_everything_begins(rendered: Mapping[str, str]) -> None:
    listed = set(re.findall(r'<li><a href="(/[^"]*)">', rendered["/index.html"].split("<nav")[1]))
    assert listed == set(rendered) - {"/index.html"}


def test_nothing_comes_from_elsewhere_and_no_script_runs(
    rendered: Mapping[str, str], site: Starlette
) -> None:
    rules = ask(site, "/index.html").headers["content-security-policy"]
    assert "default-src 'none'" in rules
    assert "script" not in rules
    for text in rendered.values():
        assert not re.search(r'(?:src|action)="(?:https?:)?//', text)
        assert "<script" not in text


@pytest.mark.parametrize(("words", "page"), [
    ("zero touch", "how-to/zero"),
    ("calibrate force", "how-to/calibrate"),
    ("sign report", "how-to/sign-and-verify-a-report"),
])  # fmt: skip
def test_what_is_looked_for_comes_first(words: str, page: str) -> None:
    assert page in [hit.page.name for hit in find(PAGES.values(), words)[:3]]


def test_a_word_is_found_where_another_begins_with_it_and_only_sections_with_all_words() -> None:
    page = Page(
        "p", "# One\ncalibration of force\n## Two\nforce alone\n```\n# no heading\n```\n## `Three`\nCALIB"
    )
    assert [section.heading for section in page.sections] == ["One", "Two", "Three"]
    assert {hit.section.heading for hit in find([page], "calib")} == {"One", "Three"}
    assert [hit.section.heading for hit in find([page], "force CALIB")] == ["One"]
    assert find([page], "forces") == []
    assert find([page], " ,;") == []


@pytest.mark.slow
@given(st.text(max_size=60))
def test_any_query_is_answered_and_none_becomes_markup(query: str) -> None:
    answer = ask(SITE, "/search", {"q": f"<script>{query}"})
    assert answer.status == 200
    assert "<script" not in answer.text


def test_a_page_that_is_not_there_is_answered_with_what_there_is_of_its_words(site: Starlette) -> None:
    answer = ask(site, "/how-to/zero-wires.html")
    assert answer.status == 404
    assert "There is no such page" in answer.text
    assert "/how-to/zero.html" in answer.text


def test_markup_of_a_page_stays_text(tmp_path: Path) -> None:
    (tmp_path / "pictures").mkdir()
    (tmp_path / "index.md").write_text("# One\n<script>alert(1)</script>\n[x](javascript:alert(1))\n")
    text = ask(documentation_site(tmp_path), "/index.html").text
    assert "<script>" not in text
    assert 'href="javascript' not in text


def test_the_terminal_shows_what_was_found() -> None:
    shown = CliRunner().invoke(command, ["zero", "touch"])
    assert shown.exit_code == 0
    assert "docs/how-to/zero.md" in shown.output
    with pytest.raises(BadInput, match="nothing found"):
        CliRunner().invoke(command, ["nosuchwordanywhere"], catch_exceptions=False)


def test_the_site_is_served_until_it_is_interrupted() -> None:
    with subprocess.Popen(
        [sys.executable, "-m", "bufferstand", "docs", "--address", "127.0.0.1:0"],
        stderr=subprocess.PIPE, text=True,
    ) as served:  # fmt: skip
        assert served.stderr is not None
        place = served.stderr.readline().split("documentation: ")[1].strip()
        with urlopen(place, timeout=60) as answer:
            assert b"bufferstand" in answer.read()
        served.send_signal(signal.SIGINT)
        assert served.wait(60) == 0
        assert "Traceback" not in served.stderr.read()
