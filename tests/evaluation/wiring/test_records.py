"""Records of one motion over wrong wires: each is named, with channel and size, and none is called good."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.simulated.miswiring.settings import (
    Miswired,
    MiswiredForce,
    MiswiredSignal,
    MiswiredStroke,
)
from bufferstand.evaluation.facts.finding import Finding
from bufferstand.evaluation.facts.results import RunEvaluation
from tests.evaluation.wiring.bench import FAST, SINE, SLOW, Recorded, evaluated, recorded

F, A, S = MiswiredForce, MiswiredSignal, MiswiredStroke
STEPS = {"slow": SLOW, "sine": SINE, "fast": FAST}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Recorded]:
    """One right record of each kind of motion."""
    return {name: recorded(tmp_path_factory.mktemp(name), step) for name, step in STEPS.items()}


def about(run: RunEvaluation, kind: str, channel: str) -> Finding:
    """Return the finding of a kind about a channel; there is just one."""
    (one,) = [found for found in run.findings if (found.kind, found.channel) == (kind, channel)]
    assert one.text in " ".join(run.warnings)
    return one


@pytest.mark.parametrize("name", STEPS)
def test_nothing_is_said_of_a_right_record(runs: dict[str, Recorded], tmp_path: Path, name: str) -> None:
    run = evaluated(runs[name].written(tmp_path))
    assert run.findings == ()
    assert len(run.cycles) >= 2


SPOILED = {
    "force sign": (Miswired(force=F(scale=-1.0)), "sign", "force", -1.0),
    "both tenth": (Miswired(force=F(scale=0.1), amplifier=A(scale=0.1)), "scale", "force", 0.1),
    "force tonnes": (Miswired(force=F(scale=0.101972)), "scale", "force", 0.102),
    "both 1000 lbf": (Miswired(force=F(scale=0.22481), amplifier=A(scale=0.22481)), "scale", "force", 0.2248),
    "force half": (Miswired(force=F(scale=0.5)), "scale", "force", 0.5),
    "force zero": (Miswired(force=F(zero=15.0)), "zero", "force", -15.0),
    "force late": (Miswired(force=F(delay_s=0.8)), "delay", "force", 0.8),
    "wires half": (Miswired(stroke_1=S(scale=0.5), stroke_2=S(scale=0.5)), "scale", "stroke", 0.5),
    "wires inches": (
        Miswired(stroke_1=S(scale=1.0 / 25.4), stroke_2=S(scale=1.0 / 25.4)),
        "scale",
        "stroke",
        0.0394,
    ),
    "wires turned": (
        Miswired(stroke_1=S(scale=-1.0, zero=100.0), stroke_2=S(scale=-1.0, zero=100.0)),
        "sign",
        "stroke",
        -1.0,
    ),
    "wires off": (Miswired(stroke_1=S(zero=15.0), stroke_2=S(zero=15.0)), "zero", "stroke", 15.0),
    "one wire off": (Miswired(stroke_1=S(zero=15.0)), "zero", "stroke_1", 15.0),
    "one wire half": (Miswired(stroke_2=S(scale=0.5)), "scale", "stroke_2", 0.5),
    "one wire late": (Miswired(stroke_2=S(delay_s=0.5)), "delay", "stroke_2", 0.5),
    "both wires late": (Miswired(stroke_1=S(delay_s=0.5), stroke_2=S(delay_s=0.5)), "delay", "stroke", 0.5),
    "wires unhooked": (
        Miswired(stroke_1=S(frozen_at_s=5.0), stroke_2=S(frozen_at_s=5.0)),
        "frozen",
        "stroke",
        5.0,
    ),
    "wire slips": (Miswired(stroke_2=S(slip_mm=-3.0, slip_at_s=6.0)), "slip", "stroke_2", -3.0),
}


ALWAYS = (
    ("sine", "force sign"),
    ("slow", "both tenth"),
    ("sine", "force zero"),
    ("slow", "force late"),
    ("sine", "wires half"),
    ("slow", "wires off"),
    ("sine", "one wire half"),
    ("sine", "one wire late"),
    ("sine", "wires unhooked"),
    ("sine", "wire slips"),
)
CASES = [
    pytest.param(motion, name, marks=[] if (motion, name) in ALWAYS else [pytest.mark.long])
    for motion in STEPS
    for name in SPOILED
]


@pytest.mark.parametrize(("motion", "name"), CASES)
def test_a_wrong_signal_is_named_with_its_size(
    runs: dict[str, Recorded], tmp_path: Path, motion: str, name: str
) -> None:
    miswired, kind, channel, size = SPOILED[name]
    run = evaluated(runs[motion].rewired(miswired).written(tmp_path))
    finding = about(run, kind, channel)
    assert finding.size == pytest.approx(
        size, rel=0.03, abs=0.05 if kind in ("zero", "delay", "frozen", "slip") else 0.003
    )
    assert finding.effect == "spoils"
    assert "stand file" in finding.text or "hook" in finding.text
    assert run.verdict != "pass"
    rows = [row for row in run.requirements if row.id.startswith(("force-at", "preload"))]
    assert not [row for row in rows if row.verdict in ("pass", "fail")]
    assert run.unfit or not any(result.cycle.complete for result in run.cycles)


@pytest.mark.parametrize("motion", STEPS)
def test_a_slip_is_told_with_the_time_at_which_it_happened(
    runs: dict[str, Recorded], tmp_path: Path, motion: str
) -> None:
    miswired = Miswired(stroke_2=S(slip_mm=-3.0, slip_at_s=6.0))
    run = evaluated(runs[motion].rewired(miswired).written(tmp_path))
    told = re.search(r"about ([0-9.]+) s", about(run, "slip", "stroke_2").text)
    assert told is not None
    assert float(told.group(1)) == pytest.approx(6.0, abs=0.8)  # a twentieth of the record


def test_a_run_whose_steps_are_all_spoiled_is_unfit(runs: dict[str, Recorded], tmp_path: Path) -> None:
    miswired = Miswired(stroke_2=S(slip_mm=-3.0, slip_at_s=6.0))
    run = evaluated(runs["fast"].rewired(miswired).written(tmp_path))
    assert len(run.steps) == 2
    assert all(step.unfit for step in run.steps)
    assert run.unfit
    assert sum("all its cycles are spoiled" in text for text in run.warnings) == 2


NOTED = {
    "tenth": (Miswired(amplifier=A(scale=0.1)), "scale", "force_2"),
    "sign": (Miswired(amplifier=A(scale=-1.0)), "sign", "force_2"),
    "late": (Miswired(amplifier=A(delay_s=0.8)), "delay", "force_2"),
    "frozen": (Miswired(amplifier=A(frozen_at_s=5.0)), "frozen", "force_2"),
    "piston half": (Miswired(position=S(scale=0.5)), "scale", "position"),
    "piston late": (Miswired(position=S(delay_s=0.5)), "delay", "position"),
    "piston frozen": (Miswired(position=S(frozen_at_s=0.0)), "frozen", "position"),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in ("late", "piston frozen") else [pytest.mark.long])
        for name in NOTED
    ],
)
def test_a_signal_that_no_figure_comes_from_is_named_and_takes_none(
    runs: dict[str, Recorded], tmp_path: Path, name: str
) -> None:
    miswired, kind, channel = NOTED[name]
    right = evaluated(runs["sine"].written(tmp_path))
    run = evaluated(runs["sine"].rewired(miswired).written(tmp_path))
    assert about(run, kind, channel).effect == "noted"
    assert not run.unfit
    assert run.summary == right.summary


@pytest.mark.parametrize("motion", ["sine"])
def test_exchanged_channels_are_named(runs: dict[str, Recorded], tmp_path: Path, motion: str) -> None:
    for miswired, channel in (
        (Miswired(force=F(reads="position")), "force"),
        (Miswired(stroke_2=S(reads="force")), "stroke_2"),
    ):
        run = evaluated(runs[motion].rewired(miswired).written(tmp_path))
        assert about(run, "exchanged", channel).effect == "spoils"


@pytest.mark.parametrize("delay_s", [0.1])
@pytest.mark.parametrize("motion", ["sine"])
def test_a_force_is_late_by_its_turns_where_no_second_one_says_so(
    runs: dict[str, Recorded], tmp_path: Path, motion: str, delay_s: float
) -> None:
    late = Miswired(force=F(delay_s=delay_s), amplifier=A(delay_s=delay_s))
    run = evaluated(runs[motion].rewired(late).written(tmp_path))
    assert about(run, "delay", "force").size == pytest.approx(delay_s, abs=0.03)
    assert not any(found.kind == "sign" for found in run.findings)


def test_forces_that_stand_still_together_are_named(runs: dict[str, Recorded], tmp_path: Path) -> None:
    for motion in STEPS:
        still = Miswired(force=F(frozen_at_s=0.0), amplifier=A(frozen_at_s=0.0))
        run = evaluated(runs[motion].rewired(still).written(tmp_path))
        assert about(run, "frozen", "force").effect == "spoils"
        assert all(found.size is None or np.isfinite(found.size) for found in run.findings)


def test_which_of_two_forces_is_wrong_is_said_by_the_plan_and_left_open_without_one(
    runs: dict[str, Recorded], tmp_path: Path
) -> None:
    slow = runs["slow"]
    step = {**slow.document["step"], "expected_peak_force_kN": None}
    for scale, channel in ((10.0, "force_2"), (0.1, "force_2")):
        wired = slow.rewired(Miswired(amplifier=A(scale=scale)))
        about(evaluated(wired.written(tmp_path)), "scale", channel)
        finding = about(evaluated(wired.written(tmp_path, step=step)), "scale", "force")
        assert "one of them is scaled wrong" in finding.text


def test_wires_that_were_set_to_zero_with_the_piston_and_differ_are_named(
    runs: dict[str, Recorded], tmp_path: Path
) -> None:
    zero = {"how": "touch", "found": "2026-03-05T09:00:00+00:00", "channel": []}
    right = runs["sine"].written(tmp_path, zero=zero)
    assert evaluated(right).findings == ()
    off = runs["sine"].rewired(Miswired(stroke_1=S(zero=9.0), stroke_2=S(zero=9.0)))
    assert about(evaluated(off.written(tmp_path, zero=zero)), "zero", "stroke").size == pytest.approx(
        9.0, abs=0.5
    )
