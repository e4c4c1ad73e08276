"""Whether a run was made on a simulated stand: as stated, or by what an older file holds."""

from __future__ import annotations

from typing import Any

import pytest

from bufferstand.recording.finding.run_facts import facts_of
from bufferstand.recording.runfile.file import read_metadata
from bufferstand.recording.runfile.simulated_origin import simulated_of
from tests.daq.cases import SAMPLES

ARMED = {"by": "tester", "how": "typed"}
DEVICE = {"device": "bufferstand-ring", "serial": "1"}


def document(name: str, **tables: Any) -> dict[str, Any]:
    identity = tables.pop("identity", DEVICE)
    return {"run": tables.pop("run", {}), "stand": {"stand": {"name": name}, "identity": identity}, **tables}


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (document("hall-3", run={"simulated": True}), True),
        (document("Simulationsprüfstand 2", run={"simulated": False}, arming={}), False),
        (document("hall-3", arming={}), True),  # nobody was asked: the program had started the stand
        (document("hall-3", arming=ARMED), None),
        (document("hall-3", identity={"device": "simulated controller"}, arming=ARMED), True),
        (document("hall-3"), None),
        (document("Simulated servo-hydraulic stand"), True),
        (document("hall-3", identity=None, arming={}), None),  # of no campaign
        ({"run": {"status": "imported"}, "stand": None}, None),
        ({"run": {"simulated": "no"}}, None),
        ({}, None),
    ],
)
def test_a_file_is_judged_by_what_it_states_and_an_older_one_by_what_it_holds(
    given: dict[str, Any], found: bool | None
) -> None:
    assert simulated_of(given) is found


def test_the_shipped_runs_are_simulated_though_they_do_not_state_it() -> None:
    for path in sorted((SAMPLES / "runs").glob("*.h5")):
        assert "simulated" not in read_metadata(path)["run"], "else it is no test of older files"
        assert facts_of(path).simulated is True
