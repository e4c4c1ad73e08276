"""Which licence a package has, and whether bufferstand may depend on it."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from email.message import Message
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path
from typing import Any

from packaging.licenses import InvalidLicenseExpression, canonicalize_license_expression

from tests.supply.locks import Pin

FILE = Path(__file__).with_name("licences.toml")
Metadata = Callable[[str], Any]


def known(file: Path = FILE) -> dict[str, Any]:
    """Return the file of licences."""
    return tomllib.loads(file.read_text(encoding="utf-8"))


def licence_of(name: str, rules: Mapping[str, Any], look: Metadata = metadata) -> str | None:
    """Return the SPDX expression of a package; None where nobody says it.

    Parameters
    ----------
    name : str
        Of a package that is installed.
    rules : mapping
        :func:`known`.
    look : callable
        Returns a package's metadata.
    """
    if (stated := rules["stated"].get(name)) is not None:
        return str(stated["licence"])
    try:
        facts = look(name)
    except PackageNotFoundError:
        return None
    for text in _texts(facts):
        try:
            return str(canonicalize_license_expression(rules["words"].get(text, text)))
        except InvalidLicenseExpression:
            continue
    return None


def _texts(facts: Message | Any) -> Iterator[str]:
    """Yield what metadata say of the licence: expression, key, classifiers, the surest first."""
    for key in ("License-Expression", "License"):
        if text := facts.get(key):
            yield str(text).strip()
    for line in facts.get_all("Classifier") or []:
        if line.startswith("License :: "):
            yield line.rpartition(" :: ")[2]


def may_be(expression: str, allowed: Iterable[str]) -> bool:
    """Return whether a licence may be depended on: one of those joined by OR, all of those joined by AND."""
    good = set(allowed)
    words = expression.replace("(", " ( ").replace(")", " ) ").split()

    def either() -> bool:
        found = both()
        while words and words[0] == "OR":
            words.pop(0)
            found = both() or found
        return found

    def both() -> bool:
        found = one()
        while words and words[0] == "AND":
            words.pop(0)
            found = one() and found
        return found

    def one() -> bool:
        word = words.pop(0)
        if word == "(":
            found = either()
            words.pop(0)
            return found
        if words and words[0] == "WITH":
            word = f"{word} {words.pop(0)} {words.pop(0)}"
        return word in good

    return either()


def faults(pinned: Iterable[Pin], rules: Mapping[str, Any], look: Metadata = metadata) -> list[str]:
    """Return what is wrong with the licences of packages, one line each with the package's name."""
    found = []
    for name in sorted({pin.name for pin in pinned}):
        licence = licence_of(name, rules, look)
        excepted = rules["excepted"].get(name)
        if licence is None:
            found.append(f"{name}: its metadata say no licence: look it up, and state it in {FILE.name}")
        elif excepted is not None and (excepted["licence"] != licence or not excepted["why"]):
            found.append(f"{name}: is excepted as {excepted['licence']}, and has {licence}")
        elif excepted is None and not may_be(licence, rules["allowed"]):
            found.append(f"{name}: {licence} is not among the licences of {FILE.name}")
    return found
