"""What runs has licences that are allowed, and a bill of materials that CycloneDX's library takes."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from email.message import Message
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from tests.supply import validating
from tests.supply.licences import faults, known, may_be
from tests.supply.locks import ALL, ROOT, RUN, Pin, pins
from tests.supply.sbom import document, text

RULES = known()


@pytest.mark.parametrize("lock", [RUN, ALL])
def test_every_package_has_a_licence_that_is_allowed(lock: str) -> None:
    assert faults(pins(ROOT / lock), RULES) == []


def test_what_runs_needs_no_exception() -> None:
    assert not {pin.name for pin in pins(ROOT / RUN)} & set(RULES["excepted"])


def test_no_entry_is_left_of_a_package_that_is_gone() -> None:
    names = {pin.name for pin in pins(ROOT / ALL)}
    assert set(RULES["stated"]) | set(RULES["excepted"]) <= names
    assert all(one["why"] for table in ("stated", "excepted") for one in RULES[table].values())


def says(**keys: str) -> Callable[[str], Message]:
    def look(name: str) -> Message:
        facts = Message()
        for key, value in keys.items():
            facts[key.replace("_", "-")] = value
        return facts

    return look


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({}, "new: its metadata say no licence"),
        ({"License": "see the file"}, "new: its metadata say no licence"),
        ({"License_Expression": "GPL-3.0-or-later"}, "new: GPL-3.0-or-later is not among"),
        ({"License_Expression": "MIT AND GPL-2.0-only"}, "new: MIT AND GPL-2.0-only is not among"),
        ({"License": "LGPLv3+"}, "new: LGPL-3.0-or-later is not among"),
        ({"Classifier": "License :: OSI Approved :: MIT License"}, ""),
        ({"License_Expression": "GPL-2.0-only OR MIT"}, ""),
    ],
)
def test_a_new_package_passes_only_with_a_licence_that_is_allowed(facts: dict[str, str], said: str) -> None:
    found = faults([Pin("new", "1", "", ("0" * 64,))], RULES, says(**facts))
    assert [line.startswith(said) for line in found] == ([True] if said else [])


def test_a_package_that_is_not_installed_fails_by_its_name() -> None:
    def look(name: str) -> Message:
        raise PackageNotFoundError(name)

    assert faults([Pin("gone", "1", "", ("0" * 64,))], RULES, look)[0].startswith("gone: ")


def test_an_exception_is_of_one_licence() -> None:
    pinned = [Pin("asammdf", "1", "", ("0" * 64,))]
    assert faults(pinned, RULES, says(License_Expression="LGPL-3.0-or-later")) == []
    assert faults(pinned, RULES, says(License_Expression="GPL-3.0-only")) == [
        "asammdf: is excepted as LGPL-3.0-or-later, and has GPL-3.0-only"
    ]


@pytest.mark.parametrize(
    ("expression", "may"),
    [
        ("MIT", True),
        ("MIT OR GPL-3.0-only", True),
        ("MIT AND GPL-3.0-only", False),
        ("MPL-2.0 AND (GPL-3.0-only OR MIT)", True),
        ("(MIT AND GPL-3.0-only) OR LGPL-3.0-only", False),
        ("BSD-2-Clause AND Apache-2.0 WITH LLVM-exception", True),
        ("Apache-2.0 WITH Classpath-exception-2.0", False),
    ],
)
def test_and_wants_all_or_wants_one(expression: str, may: bool) -> None:
    assert may_be(expression, RULES["allowed"]) is may


def test_the_bill_of_materials_has_every_package_of_the_lock_with_its_hashes() -> None:
    lock = (ROOT / RUN).read_text(encoding="utf-8")
    found = document()["components"]
    assert len(found) == sum(line[:1].isalnum() for line in lock.splitlines())
    assert sum(len(one["hashes"]) for one in found) == lock.count("--hash=sha256:")
    for one in found:
        assert f"{one['name']}=={one['version']}" in lock
        assert one["purl"] == f"pkg:pypi/{one['name']}@{one['version']}"
        assert one["licenses"][0]["expression"]
        assert all(f"--hash=sha256:{each['content']}" in lock for each in one["hashes"])
    assert len({one["bom-ref"] for one in found}) == len(found)


def test_the_command_writes_the_same_bytes_each_time(tmp_path: Path) -> None:
    subprocess.run(
        [sys.executable, "-m", "tests.supply", "sbom", str(tmp_path / "sbom.json")], cwd=ROOT, check=True
    )
    assert (tmp_path / "sbom.json").read_text(encoding="utf-8") == text()


@pytest.mark.skipif(not validating.is_there(), reason="needs CycloneDX's library: bash .ci/peers")
def test_cyclonedx_own_library_takes_it_and_refuses_another(tmp_path: Path) -> None:
    file = tmp_path / "sbom.json"
    file.write_text(text(), encoding="utf-8")
    assert validating.problems(file) == []
    broken = document()
    broken["components"][0]["hashes"][0]["alg"] = "SHA-3"
    file.write_text(json.dumps(broken), encoding="utf-8")
    assert validating.problems(file)
