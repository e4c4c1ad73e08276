"""The documentation: the site builds without a warning, and its list of commands is the commands' own."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from bufferstand.cli.main import COMMANDS, SECTIONS
from tests.docs.bounds_page import page as bounds_page
from tests.docs.commands_page import page
from tests.docs.keys_page import page as keys_page
from tests.docs.registers_page import page as registers_page
from tests.docs.symbols_page import page as symbols_page
from tests.mutants.page import page as mutants_page

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    options = ["-q", "-W", "-b", "html", "-d", tmp_path / "cache"]
    built = subprocess.run(
        [sys.executable, "-P", "-m", "sphinx", *options, DOCS, tmp_path / "site"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert built.returncode == 0, built.stderr
    assert "From unpacking to a test report" in (tmp_path / "site" / "index.html").read_text(encoding="utf-8")


def test_every_page_is_in_the_site() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    listed = {DOCS / f"{name}.md" for name in re.findall(r"^[\w/-]+$", index, re.MULTILINE)}
    pages = {path for path in DOCS.rglob("*.md") if path.parent.name != "decisions"} - {DOCS / "index.md"}
    assert pages - listed == set()


def test_the_page_of_commands_is_their_own_help() -> None:
    assert (DOCS / "commands.md").read_text(encoding="utf-8") == page(), (
        "run: python -m tests.docs.commands_page > docs/commands.md"
    )


def test_the_page_of_bounds_is_that_of_the_schemas() -> None:
    assert (DOCS / "bounds.md").read_text(encoding="utf-8") == bounds_page(), (
        "run: python -m tests.docs.bounds_page > docs/bounds.md"
    )


def test_the_page_of_registers_is_that_of_the_profile() -> None:
    assert (DOCS / "registers.md").read_text(encoding="utf-8") == registers_page(), (
        "run: python -m tests.docs.registers_page > docs/registers.md"
    )


def test_the_page_of_keys_is_that_of_the_schemas() -> None:
    """Every key has a meaning in its schema; the page cannot be made where one has none."""
    assert (DOCS / "keys.md").read_text(encoding="utf-8") == keys_page(), (
        "run: python -m tests.docs.keys_page > docs/keys.md"
    )


def test_the_page_of_symbols_is_that_of_the_catalogue() -> None:
    assert (DOCS / "symbols.md").read_text(encoding="utf-8") == symbols_page(), (
        "run: python -m tests.docs.symbols_page"
    )


def test_the_page_of_mutants_has_the_scores_and_explanations_that_are_kept() -> None:
    assert (DOCS / "mutants.md").read_text(encoding="utf-8") == mutants_page(), (
        "run: python -m tests.mutants.page > docs/mutants.md"
    )


def test_every_command_has_its_place_in_the_list() -> None:
    assert {name for names in SECTIONS.values() for name in names} == set(COMMANDS)


@pytest.mark.parametrize("block", re.findall(r"^## .*?(?=^## |\Z)", page(), re.MULTILINE | re.DOTALL))
def test_every_command_has_an_example(block: str) -> None:
    assert re.search(r"Example:|bufferstand demo", block), block
