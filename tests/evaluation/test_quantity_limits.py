"""``[[requirement]]`` of a limit set: a limit on any quantity of any kind of run is a TOML file, no code."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.document.build import evaluate_paths
from bufferstand.evaluation.facts.results import Extreme, Measured, Summary
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.requirements.limit_set import LimitSet, load_limit_set
from bufferstand.evaluation.requirements.quantity_limits import JudgedPart, judge_quantities
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.loading import parse_settings

RUNS = Path(__file__).resolve().parents[2] / "sample_runs" / "runs"
HEAD = """
id = "lab"
standard = "own"
edition = "1"
clause = "4.2"
date = 2026-11-01
source = "test plan 7"
[applies]
specimen = "buffer"
stroke_mm = 105
stroke_tolerance_mm = 5
"""
DAMPING = """
[[requirement]]
id = "damping-at-1-3-hz"
text = "damping of large strokes"
quantity = "damping"
kind = "harmonic"
where = { frequency_Hz = [1.2, 1.35], amplitude_mm = [18.0, 22.0] }
lower = 0.2
upper = 0.3
"""
FORCE = """
[[requirement]]
id = "greatest-force"
quantity = "force_max_kN"
kind = "harmonic"
upper = 200.0
clause = "4.3"
"""


def limits(text: str) -> LimitSet:
    return parse_settings(HEAD + text, LimitSet, Path("lab.toml"))


def part(
    damping: Measured | None = None, *, frequency: float | None = 1.3, force: Extreme | None = None
) -> JudgedPart:
    means = {
        "damping": damping or Measured(0.22, 0.004),
        "frequency_Hz": Measured(frequency, 0.001),
        "amplitude_mm": Measured(20.0, 0.1),
    }
    return JudgedPart("", Summary((2, 3), means), {} if force is None else {"force_max_kN": force})


def judged(text: str, one: JudgedPart, rule: Any = "simple", kind: Any = "harmonic") -> list[tuple[str, str]]:
    rows = judge_quantities(limits(text), RunFacts("r", kind), [one], rule)
    return [(row.id, row.verdict) for row in rows]


def test_one_toml_file_judges_recorded_harmonic_runs(tmp_path: Path) -> None:
    file = tmp_path / "lab.toml"
    file.write_text(HEAD + DAMPING + FORCE, encoding="utf-8")
    document = evaluate_paths([RUNS], Options(draws=500), load_limit_set(file))
    rows = {entry["run"]["id"]: entry["requirements"] for entry in document["runs"]}
    at_1_3_hz = rows["005-harmonic-20mm-20mm-1.27Hz"]
    assert [row["id"] for row in at_1_3_hz] == ["damping-at-1-3-hz", "greatest-force"]
    damping = at_1_3_hz[0]
    entry = next(e for e in document["runs"] if e["run"]["id"] == "005-harmonic-20mm-20mm-1.27Hz")
    mean = entry["summary"]["damping"]
    assert (damping["measured"], damping["expanded_uncertainty"]) == (
        mean["value"],
        mean["expanded_uncertainty"],
    )
    assert (damping["verdict"], damping["clause"], damping["lower_limit"]) == ("pass", "4.2", 0.2)
    assert damping["conformance_probability"] > 0.99
    assert entry["verdict"] == "pass"
    assert [row["id"] for row in rows["004-harmonic-20mm-20mm-0.637Hz"]] == ["greatest-force"]
    warm = rows["013-harmonic-78mm-15mm-0.849Hz"][0]
    assert (warm["verdict"], warm["clause"]) == ("fail", "4.3")
    assert warm["measured"] == next(
        e["extremes"]["force_max_kN"]["value"] for e in document["runs"] if e["run"]["id"].startswith("013")
    )
    assert rows["001-static-5mm_s"] == []


def test_a_run_outside_of_where_is_asked_nothing_and_one_of_which_that_is_unknown_is_open() -> None:
    assert judged(DAMPING, part(frequency=0.6)) == []
    assert judged(DAMPING, part(), kind="static") == []
    assert judged(DAMPING, part(frequency=None)) == [("damping-at-1-3-hz", "inconclusive")]


@pytest.mark.parametrize(
    ("value", "verdict"),
    [(0.19, "fail"), (0.199, "conditional-fail"), (0.201, "conditional-pass"), (0.25, "pass")],
)
def test_the_guard_band_counts(value: float, verdict: str) -> None:
    assert judged(DAMPING, part(Measured(value, 0.004)), "guard-band") == [("damping-at-1-3-hz", verdict)]


def test_what_is_missing_or_doubted_is_never_a_verdict() -> None:
    (row,) = judge_quantities(
        limits(DAMPING), RunFacts("r", "harmonic"), [part(Measured(None, missing="no loop closes"))], "simple"
    )
    assert (row.verdict, row.why, row.measured) == ("inconclusive", "no loop closes", None)
    assert judged(FORCE, part(force=Extreme(150.0, 1.0, 2.0, doubt="a lone sample"))) == [
        ("greatest-force", "inconclusive")
    ]
    assert judged(FORCE, part(force=Extreme(150.0, 1.0, 2.0))) == [("greatest-force", "pass")]


def test_a_limit_to_be_filled_in_is_never_passed() -> None:
    open_limit = DAMPING.replace("lower = 0.2", 'lower = "fill-in"')
    assert judged(open_limit, part()) == [("damping-at-1-3-hz", "inconclusive")]
    assert judged(open_limit, part(Measured(0.4, 0.004))) == [("damping-at-1-3-hz", "fail")]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('quantity = "damping"', 'quantity = "dampening"', "no quantity is called “dampening”"),
        ("frequency_Hz =", "frequenzy_Hz =", "no quantity is called “frequenzy_Hz”"),
        ("lower = 0.2", "lower = 0.4", "the lower limit 0.4 is above the upper one 0.3"),
        ('kind = "harmonic"', 'kind = "dynamic"', "harmonic"),
    ],
)
def test_a_mistyped_requirement_is_refused_with_its_line(old: str, new: str, said: str) -> None:
    with pytest.raises(BadInput, match=r"line \d+|requirement damping-at-1-3-hz") as refused:
        limits(DAMPING.replace(old, new))
    assert said in str(refused.value)


def test_sets_without_requirements_keep_their_hash() -> None:
    assert limits("").sha256 != limits(DAMPING).sha256
    assert "requirement" not in limits("").identity()
