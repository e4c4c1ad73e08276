"""The survivors that are explained: ``accepted.toml``, an entry each."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.generating import Mutant

FILE = Path(__file__).with_name("accepted.toml")


@dataclass(frozen=True)
class Survivor:
    """One entry: what names the mutant, and why no test can or need tell it from the code."""

    module: str
    where: str
    line: str
    mutant: str
    why: str

    @property
    def identity(self) -> tuple[str, str, str, str]:
        """Return what names the mutant."""
        return self.module, self.where, self.line, self.mutant


def accepted() -> list[Survivor]:
    """Return every entry."""
    content = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return [Survivor(**one) for one in content.get("survivor", [])]


def unexplained(survived: Iterable[Mutant], entries: Iterable[Survivor]) -> list[Mutant]:
    """Return the survivors that have no entry."""
    known = {one.identity for one in entries}
    return [one for one in survived if one.identity not in known]


def out_of_date(
    modules: Iterable[str], survived: Iterable[Mutant], entries: Iterable[Survivor]
) -> list[Survivor]:
    """Return the entries of modules tried in full that no survivor needs any more."""
    needed, tried = {one.identity for one in survived}, set(modules)
    return [one for one in entries if one.module in tried and one.identity not in needed]
