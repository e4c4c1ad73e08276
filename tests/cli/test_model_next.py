"""``bufferstand model next`` on recorded samples: what is chosen, written and refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.cli.commands.model.next import command
from bufferstand.foundation.errors import BadInput

SAMPLES = Path(__file__).parents[2] / "sample_runs"
RUN = SAMPLES / "runs" / "001-static-5mm_s.h5"
STAND = SAMPLES / "stand.toml"
SPECIMEN = SAMPLES / "specimens" / "category-a-elastomer.toml"
LOOP = "damping at 40 +- 20 mm, 1 Hz, 20 C to"


def invoked(*words: object):
    files = ("--stand", str(STAND), "--specimen", str(SPECIMEN), "--knots", "6")
    return CliRunner().invoke(command, [str(RUN), *files, *map(str, words)], standalone_mode=False)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("next")
    outcome = invoked(
        "--question", f"{LOOP} 1e-5", "--steps", "3", "--out", folder / "next.toml",
        "--json", folder / "next.json",
    )  # fmt: skip
    assert outcome.exception is None, outcome.output
    return (
        outcome.output,
        json.loads((folder / "next.json").read_text(encoding="utf-8")),
        folder / "next.toml",
    )


def test_steps_are_chosen_with_their_time_and_what_they_tell(asked):
    output, document, _ = asked
    assert document["schema"] == "bufferstand/model-next/1"
    assert 1 <= len(document["steps"]) <= 3
    assert document["duration_s"] == pytest.approx(sum(step["duration_s"] for step in document["steps"]))
    assert all(step["duration_s"] > 0.0 for step in document["steps"])
    u = [step["expanded_uncertainty"] for step in document["steps"]]
    assert u == sorted(u, reverse=True)
    assert all(step["start_temperature_C"] < 40.0 for step in document["steps"])
    assert "what to run next" in output


def test_what_cannot_be_reached_is_said_with_what_is_left(asked):
    output, document, _ = asked
    # 0.5 % of reversibility alone: U of damping is 2 · 0.005 / √3 · (1 - damping), some 4e-3.
    assert document["question"]["least_by_repetition"] == pytest.approx(0.004, rel=0.5)
    assert document["end"] != "reached"
    assert "cannot be reached by any number of such steps" in output
    assert "errors of the channels" in output


def test_the_campaign_is_one_that_a_plan_takes(asked):
    _, document, campaign = asked
    plan = prepare(campaign).plan
    kinds = [step.kind for step in plan.steps]
    assert set(kinds) <= {"static", "harmonic", "hold"}
    assert len(kinds) >= len(document["steps"])
    text = campaign.read_text(encoding="utf-8")
    assert text.startswith("# Steps that tell most")
    assert "# tells " in text


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--question", "damping at 40 +- 40 mm"), "“,” is missing"),
        (("--question", "damping at 90 +- 80 mm, 1 Hz, 20 C to 0.1"), "beyond no curve is measured"),
        (("--stand", SPECIMEN), "stand"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(words, said):
    outcome = invoked(*words)
    assert isinstance(outcome.exception, BadInput), outcome.output
    assert said in str(outcome.exception)
