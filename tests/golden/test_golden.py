"""No figure has changed since commit dd850b6, before issue 18; new keys aside.

What reports say (``reported_…``) is as it was written anew since, where they were meant to change.

Equal is equal to 1e-7: the last bits hang on the processor, by which numpy's libraries choose their code.
"""

from __future__ import annotations

import gzip
import json
import math
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


SAME, NOTHING = 1e-7, 1e-6
"""Relative, and absolute where a figure is next to nothing: numbers of two processors differ by less.

Most agree to 1e-12; coefficients that are found by steps (coverage factors, slopes of a budget) to 1e-8.
"""


def differences(then: Any, now: Any, place: str = "") -> list[str]:
    """Return where two JSON documents differ, and by how much; what is new in an object is no difference."""
    if isinstance(then, dict) and isinstance(now, dict):
        gone = [f"{place}.{key}: is gone" for key in then.keys() - now.keys()]
        both = [(f"{place}.{key}", then[key], now[key]) for key in then if key in now]
    elif isinstance(then, list) and isinstance(now, list):
        gone = [f"{place}: {len(then)} entries, now {len(now)}"] if len(then) != len(now) else []
        both = [(f"{place}[{at}]", *pair) for at, pair in enumerate(zip(then, now, strict=False))]
    elif type(then) is type(now) and (then == now or _same(_number(then), _number(now))):
        return []
    elif isinstance(then, int | float) and isinstance(now, int | float):
        return [f"{place}: {then!r}, now {now!r}, {now - then:+.3g}"]
    else:
        return [f"{place}: {then!r}, now {now!r}"]
    return gone + [text for inner_place, one, other in both for text in differences(one, other, inner_place)]


def _number(value: Any) -> float | None:
    """Return a number, also one of a table's text."""
    try:
        return None if isinstance(value, bool | None) else float(value)
    except ValueError:
        return None


def _same(one: float | None, other: float | None) -> bool:
    return one is not None and other is not None and math.isclose(one, other, rel_tol=SAME, abs_tol=NOTHING)


def _last_bits_are_those_of_the_record(folder: Path) -> bool:
    """Return whether this processor evaluates a sample to the stored figures' last bit."""
    probe = folder / "probe"
    probe.mkdir()
    return _exact(stored()["imported_sample"], made("imported_sample", probe))


def _exact(then: Any, now: Any) -> bool:
    """Return whether this processor gives the stored figures to the last bit."""
    if isinstance(then, dict) and isinstance(now, dict):
        return all(_exact(then[key], now[key]) for key in then if key in now and key != "drawn")
    if isinstance(then, list) and isinstance(now, list):
        return all(map(_exact, then, now))
    return bool(then == now)


@pytest.mark.parametrize("name", NAMES)
def test_nothing_has_changed(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if name.startswith("friction_damper") and not SHARED.is_dir():
        pytest.skip("REAL RECORDS NOT HERE: shared/data is not beside the repository")
    then, now = stored()[name], made(name, tmp_path)
    drawn = now.get("drawn")
    if drawn is not None and not _last_bits_are_those_of_the_record(tmp_path):
        assert len(drawn) == len(then["drawn"])  # hashes over the last bits of what is drawn
        then = {**then, "drawn": drawn}
    found = differences(then, now, name)
    assert not found, "\n".join([f"{len(found)} differences", *found[:50]])


def test_a_difference_is_named_with_its_size() -> None:
    then = {"a": [1.0, {"b": "x"}], "c": 1}
    assert differences(then, {"a": [1.0, {"b": "x", "new": 1}], "c": 1, "d": 2}) == []
    assert differences(then, {"a": [1.5, {}], "c": True}) == [
        ".a[0]: 1.0, now 1.5, +0.5",
        ".a[1].b: is gone",
        ".c: 1, now True, +0",
    ]
    assert differences({"a": 1.0, "b": "2.5"}, {"a": 1.0 + 1e-12, "b": "2.5000000000001"}) == []
    assert differences({"a": 1.0, "b": "2.5"}, {"a": 1.0 + 1e-5, "b": "2.5001"}) == [
        ".a: 1.0, now 1.00001, +1e-05",
        ".b: '2.5', now '2.5001'",
    ]


def test_every_golden_figure_is_compared_and_the_file_is_small() -> None:
    assert stored().keys() == FIGURES.keys()
    assert STORED.stat().st_size < 600_000
