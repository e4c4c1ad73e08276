"""Nothing in the tree cites what is not in it: pages, headings, files."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from tests.house.test_house import ROOT, committed_files

PAGES = [path for path in committed_files() if path.suffix == ".md"]
SOURCES = [path for path in committed_files() if path.suffix == ".py"]
NOT_PAGES = {"comparison.md", "own.md", "FILE.md"}
"""What a command writes, a laboratory's own text, and what stands for any file."""
PAGE = re.compile(r"(?<![\w.])[\w/-]+\.md\b(?!\()")
ROOMS = "cli|daq|drivers|evaluation|foundation|model|protocols|recording|tests|docs|sample_runs|benchmarks"
FILE = re.compile(rf"`((?:{ROOMS})/(?![\w./-]*NAME)[\w./-]+\.(?:py|md|toml|csv|h5))`")
"""A file of the repository; one with NAME in it is to be made (tests/house/test_recipes.py)."""
NOT_HERE = re.compile(r"\bshared/|contracts? §|wire-facts|reference notes")
SKIPS_WITHOUT_IT = {
    "tests/evaluation/test_real_records.py",
    "tests/golden/test_golden.py",
    "tests/outside/dcc.py",
}


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def headings(page: Path) -> frozenset[str]:
    """Return the anchors of a page's headings, as GitHub and the site make them."""
    text = re.sub(r"^(```|~~~).*?^\1", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    titles = re.findall(r"^#+ (.+?)\s*$", text, re.MULTILINE)
    return frozenset(re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_link_leads_to_a_file_and_to_a_heading_of_it(page: Path) -> None:
    broken = []
    for target, anchor in re.findall(r"\]\(([^)#:\s]*)(?:#([^)\s]*))?\)", page.read_text(encoding="utf-8")):
        linked = page.parent / target if target else page
        if not linked.exists() or (
            anchor and linked.suffix == ".md" and anchor not in headings(linked.resolve())
        ):
            broken.append(f"{target}#{anchor}")
    assert broken == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=name)
def test_every_file_that_a_page_names_is_there(page: Path) -> None:
    named = FILE.findall(page.read_text(encoding="utf-8"))
    assert [file for file in named if not (ROOT / file).exists()] == []


def test_every_page_that_a_module_names_is_there() -> None:
    broken = []
    for source in SOURCES:
        cited = set(PAGE.findall(source.read_text(encoding="utf-8"))) - NOT_PAGES
        places = (ROOT, ROOT / "docs", ROOT / "docs" / "how-to", source.parent)
        broken += [
            f"{name(source)}: {page}" for page in cited if not any((at / page).exists() for at in places)
        ]
    assert broken == []


def test_nothing_is_cited_that_lies_outside_of_the_repository() -> None:
    here = Path(__file__).resolve()
    found = [
        f"{name(path)}:{number}"
        for path in (*PAGES, *SOURCES)
        if path != here and name(path) not in SKIPS_WITHOUT_IT
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if NOT_HERE.search(line)
    ]
    assert found == []
