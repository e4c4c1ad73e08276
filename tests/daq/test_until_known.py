"""``run --until``: a campaign in rounds until a figure is known, or it is said that it cannot be."""

from __future__ import annotations

import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.campaign.until_known import UntilKnown, mean_of, until_of
from bufferstand.daq.campaign_folder.folder import load_record
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.evaluation.facts import ErrorSource, Measured, SharedContributions
from bufferstand.foundation.errors import BadInput
from tests.daq.cases import Lines
from tests.daq.run_in_process import COARSE, facts_of
from tests.daq.test_in_process import campaign

LOOPS = """
[[step]]
kind = "harmonic"
prestress_mm = 30.0
amplitude_mm = 15.0
frequency_Hz = 1.0
cycles = 3
"""
FORCE = ErrorSource("force scale", "K-1", "rectangular")


@pytest.mark.parametrize(
    ("text", "quantity", "u"),
    [
        ("u(damping) < 0.002", "damping", 0.002),
        ("  U ( damping )<4e-3 ", "damping", 0.002),
        ("U(secant_stiffness_kN_per_mm) < 0.1", "secant_stiffness_kN_per_mm", 0.05),
    ],
)
def test_a_goal_is_a_standard_or_an_expanded_uncertainty(text: str, quantity: str, u: float) -> None:
    found = UntilKnown.parsed(text)
    assert (found.quantity, found.standard_uncertainty) == (quantity, pytest.approx(u))
    assert until_of(json.loads(json.dumps(found.as_dict()))) == found


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "u or U is missing at character 1"),
        ("damping < 0.002", "u or U is missing at character 1"),
        ("u(damping < 0.002", "“)” is missing at character 10"),
        ("u(damping) = 0.002", "“<” is missing at character 11"),
        ("u(damping) < little", "a number is missing at character 13"),
        ("u(damping) < 0.002 kN", "its end is missing at character 19"),
        ("u(dampness) < 0.002", "there is no quantity “dampness”"),
        ("u(damping) < 0", "an uncertainty cannot be 0"),
        ("u(damping) < 1e", "an uncertainty cannot be 1e"),
        ("u(damping) < 1e999", "an uncertainty cannot be 1e999"),
    ],
)
def test_a_goal_that_is_none_is_refused_with_its_place(text: str, said: str) -> None:
    with pytest.raises(BadInput) as error:
        UntilKnown.parsed(text)
    assert said in str(error.value)
    assert "--until" in str(error.value)


def evaluated(value: float, own: float, shared: float) -> SimpleNamespace:
    """A run as far as its mean of damping is concerned."""
    u = math.hypot(own, shared)
    return SimpleNamespace(
        summary=SimpleNamespace(values={"damping": Measured(value, 2.0 * u)}),
        shared_errors=SimpleNamespace(of=lambda _: SharedContributions({FORCE: shared}, shared)),
    )


@given(
    own=st.floats(1e-5, 0.01),
    shared=st.floats(1e-5, 0.01),
    count=st.integers(1, 40),
)
def test_repetition_lowers_what_is_a_runs_own_and_nothing_else(own: float, shared: float, count: int) -> None:
    found = mean_of("loops", [evaluated(0.3, own, shared)] * count, "damping")
    assert found is not None
    assert found.shared_u == pytest.approx(shared)
    assert found.u == pytest.approx(math.hypot(own / math.sqrt(count), shared))
    asked = math.hypot(0.1 * own, shared)
    assert found.rounds_for(asked) == pytest.approx(100.0, rel=1e-3)
    assert found.rounds_for(0.999 * shared) == math.inf


def test_what_rounds_scatter_by_counts() -> None:
    runs = [evaluated(value, 1e-5, 1e-4) for value in (0.30, 0.31, 0.32, 0.33)]
    found = mean_of("loops", runs, "damping")
    assert found is not None
    assert found.u == pytest.approx(0.0129 / 2.0, rel=0.01)
    runs[1].summary.values["damping"] = Measured(None, missing="no cycle is steady")
    assert mean_of("loops", runs, "damping") is None


def begun(folder: Path, until: UntilKnown | None, *, rounds: int, request: StopRequest | None = None):
    path = folder / "campaign.toml"
    if not path.exists():
        campaign(folder, LOOPS)
        stand = (folder / "stand.toml").read_text(encoding="utf-8")
        assert "uncertainty" in stand
    prepared = prepare(path, rounds=rounds)
    opened = open_in_process(prepared.stand_file)

    class Stops(Lines):
        def message(self, text: str) -> None:
            super().message(text)
            if request is not None and "another round" in text:
                request.ask(StopLevel.AFTER_STEP, "enough for today")

    shown = Stops()
    outcome = run_campaign(
        prepared.plan, opened.stand, opened.clock, folder / "out", facts_of(prepared.stand_file),
        progress=shown, stop_request=request, settings=COARSE, until=until,
    )  # fmt: skip
    opened.stand.close()
    record = load_record(folder / "out")
    assert record is not None
    return outcome, record, shown


@pytest.mark.slow
def test_it_ends_as_soon_as_it_is_known(tmp_path: Path) -> None:
    outcome, record, shown = begun(tmp_path, UntilKnown.parsed("u(damping) < 0.1", 3), rounds=3)
    assert (outcome.status, outcome.exit_status) == ("complete", 0)
    assert [step.status for step in record.steps] == ["complete", "skipped", "skipped"]
    assert record.until["end"] == "known"
    assert len(record.until["judged"]) == 1
    assert len(outcome.runs) == 1
    assert any("is known: after 1 round" in line for line in shown.lines)


@pytest.mark.slow
def test_what_errors_of_the_channels_leave_is_said_and_not_repeated(tmp_path: Path) -> None:
    outcome, record, _ = begun(tmp_path, UntilKnown.parsed("u(damping) < 1e-6", 3), rounds=3)
    assert (outcome.status, outcome.exit_status) == ("complete", 3)
    assert "cannot be known by going on" in outcome.reason
    assert "errors of the channels" in outcome.reason
    assert [step.status for step in record.steps] == ["complete", "skipped", "skipped"]


@pytest.mark.slow
def test_a_stopped_campaign_goes_on_with_its_goal(tmp_path: Path) -> None:
    _, first, _ = begun(tmp_path / mkdir(tmp_path, "one"), UntilKnown.parsed("u(damping) < 0.1", 2), rounds=2)
    [figure] = first.until["judged"][0]["figures"]
    between = 0.5 * (figure["u"] + figure["shared_u"])  # more than one round, and not impossible
    folder = tmp_path / mkdir(tmp_path, "two")
    until = UntilKnown.parsed(f"u(damping) < {between!r}", 2)
    outcome, record, _ = begun(folder, until, rounds=2, request=StopRequest())
    assert (outcome.status, outcome.exit_status) == ("stopped", 3)
    assert record.rounds == 2
    outcome, record, _ = begun(folder, None, rounds=record.rounds)
    assert outcome.status == "complete"
    assert record.until["end"] in ("known", "rounds")
    assert outcome.exit_status == (0 if record.until["end"] == "known" else 3)
    assert [step.status for step in record.steps] == ["complete"] * 2
    assert record.until["judged"][-1]["figures"][0]["runs"] == 2


def mkdir(parent: Path, name: str) -> str:
    (parent / name).mkdir()
    return name


def test_rounds_are_not_mixed(tmp_path: Path) -> None:
    path = campaign(tmp_path, '[plan]\norder = "soonest"\n' + LOOPS)
    with pytest.raises(BadInput, match="would mix them"):
        prepare(path, rounds=2)
    assert len(prepare(path).plan.steps) == 1
