"""What the stand's guards said of its devices while a run was recorded is in evaluation and report."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.daq.guards.trips import Action, Trip
from bufferstand.evaluation.document.build import evaluate_file, evaluation_document
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.evaluation.report.sections.statements import deviations_section
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.recording.content import Event
from tests.evaluation.wiring.bench import SINE, Recorded, evaluated, recorded

WIRING = Event(
    5.0,
    "trip",
    "force_2 is 0.1 of force: look at its wiring",
    {
        "guard": "wiring of force",
        "action": "stop",
        "sensor": "force",
        "doubt": "scale",
        "value": 0.1,
        "device_fault": True,
    },
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return recorded(tmp_path_factory.mktemp("told"), SINE)


def test_a_doubt_about_the_wiring_takes_the_figures_of_its_channel(run: Recorded, tmp_path: Path) -> None:
    made = evaluated(run.written(tmp_path, [WIRING]))
    (finding,) = made.findings
    assert (finding.kind, finding.channel, finding.effect) == ("guard", "force", "spoils")
    assert finding.size == 0.1
    assert "force_2 is 0.1 of force" in finding.text
    assert finding.text in " ".join(made.warnings)
    assert made.unfit


@pytest.mark.parametrize(
    "data",
    [
        {"guard": "frozen stroke_1", "action": "stop"},
        {"guard": "any device of tomorrow", "action": "stop", "device_fault": True},
        {"guard": "wiring of force_2", "action": "note", "sensor": "force_2", "doubt": "zero"},
    ],
)
def test_any_fault_of_a_device_is_noted_and_listed(
    run: Recorded, tmp_path: Path, data: dict[str, object]
) -> None:
    made = evaluated(run.written(tmp_path, [Event(5.0, "trip", "it said so", data)]))
    (finding,) = made.findings
    assert (finding.kind, finding.effect) == ("guard", "noted")
    assert not made.unfit


@pytest.mark.parametrize("guard", ["temperature_1", "following error"])
def test_a_limit_or_an_operator_is_no_fault_of_a_device(run: Recorded, tmp_path: Path, guard: str) -> None:
    event = Event(5.0, "trip", "it said so", {"guard": guard, "action": "stop", "value": 40.1})
    assert evaluated(run.written(tmp_path, [event])).findings == ()


def test_a_trip_says_whether_it_is_a_device_s_fault() -> None:
    assert Trip("x", Action.STOP, "y", 0.0, device_fault=True).facts()["device_fault"] is True
    assert "device_fault" not in Trip("x", Action.STOP, "y", 0.0).facts()


def test_the_report_lists_it_among_the_deviations(run: Recorded, tmp_path: Path) -> None:
    path = run.written(tmp_path, [WIRING])
    document = evaluation_document([evaluate_file(path, Options(draws=0))])
    (source) = read_source(tmp_path, document)
    section = deviations_section(source)
    texts = " ".join(
        text for block in section.blocks for text in getattr(block, "items", getattr(block, "texts", ()))
    )
    assert "told by the guard “wiring of force”" in texts
