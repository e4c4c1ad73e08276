"""No figure has changed since commit dd850b6, before issue 18: compared exactly, new keys aside."""

from __future__ import annotations

import gzip
import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.golden.figures import FIGURES, SHARED, made

QUICK = (
    "evaluated_samples",
    "reported_samples",
    "imported_sample",
    "friction_damper_1Hz",
    "friction_damper_half_Hz",
)
NAMES = [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in FIGURES]
STORED = Path(__file__).with_name("dd850b6.json.gz")


@cache
def stored() -> dict[str, Any]:
    whole = json.loads(gzip.decompress(STORED.read_bytes()))
    assert isinstance(whole, dict)
    return whole


def differences(then: Any, now: Any, place: str = "") -> list[str]:
    """Return where two JSON documents differ, and by how much; what is new in an object is no difference."""
    if isinstance(then, dict) and isinstance(now, dict):
        gone = [f"{place}.{key}: is gone" for key in then.keys() - now.keys()]
        both = [(f"{place}.{key}", then[key], now[key]) for key in then if key in now]
    elif isinstance(then, list) and isinstance(now, list):
        gone = [f"{place}: {len(then)} entries, now {len(now)}"] if len(then) != len(now) else []
        both = [(f"{place}[{at}]", *pair) for at, pair in enumerate(zip(then, now, strict=False))]
    elif then == now and type(then) is type(now):
        return []
    elif isinstance(then, int | float) and isinstance(now, int | float):
        return [f"{place}: {then!r}, now {now!r}, {now - then:+.3g}"]
    else:
        return [f"{place}: {then!r}, now {now!r}"]
    return gone + [text for inner_place, one, other in both for text in differences(one, other, inner_place)]


@pytest.mark.parametrize("name", NAMES)
def test_nothing_has_changed(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if name.startswith("friction_damper") and not SHARED.is_dir():
        pytest.skip("REAL RECORDS NOT HERE: shared/data is not beside the repository")
    found = differences(stored()[name], made(name, tmp_path), name)
    assert not found, "\n".join([f"{len(found)} differences", *found[:50]])


def test_a_difference_is_named_with_its_size() -> None:
    then = {"a": [1.0, {"b": "x"}], "c": 1}
    assert differences(then, {"a": [1.0, {"b": "x", "new": 1}], "c": 1, "d": 2}) == []
    assert differences(then, {"a": [1.5, {}], "c": True}) == [
        ".a[0]: 1.0, now 1.5, +0.5",
        ".a[1].b: is gone",
        ".c: 1, now True, +0",
    ]


def test_every_golden_figure_is_compared_and_the_file_is_small() -> None:
    assert stored().keys() == FIGURES.keys()
    assert STORED.stat().st_size < 600_000
