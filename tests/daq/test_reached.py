"""Simulated or real is a fact of how a stand was reached; a campaign stays on what it was begun on."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bufferstand.daq.campaign.campaign_runner import CampaignOutcome, run_campaign
from bufferstand.daq.campaign_folder.first_start import CampaignStart, begun
from bufferstand.daq.campaign_folder.folder import CampaignFolder, load_record
from bufferstand.daq.campaign_folder.stand_origin import OWN_WORD, REAL, STARTED, WAITS, how_reached
from bufferstand.drivers.interfaces import Identity, Stand
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.recording.runfile.file import open_run, read_metadata
from tests.daq.cases import FACTS, HARMONIC, SAMPLES, plan_of, write_campaign
from tests.daq.fake_stand import Orders, fake_stand
from tests.daq.test_runner import Case

SHORT = HARMONIC.replace("cycles = 3", "cycles = 1").replace("frequency_Hz = 1.0", "frequency_Hz = 2.0")
LONGER = SHORT.replace("amplitude_mm = 5.0", "amplitude_mm = 6.0")
LOOKED = {"connect", "other_writer", "status", "close"}
"""Calls that write nothing."""


def goes_on(case: Case, *, simulated: bool = False, serial: str = "1", **facts: Any) -> CampaignOutcome:
    """Start once more with a step more, on a stand of its own."""
    case.plan = plan_of(write_campaign(case.folder / "files", SHORT + LONGER))
    case.stand, case.controller = fake_stand(case.clock, Orders())
    case.controller.simulated = simulated
    case.controller.connect = lambda: Identity("fake", "nowhere", serial, "ring", 1000.0)  # type: ignore[method-assign]
    return run_campaign(
        case.plan, case.stand, case.clock, case.out, replace(FACTS, **facts), progress=case.shown
    )


def states(runs: Sequence[Path]) -> list[tuple[bool, str]]:
    tables = [read_metadata(run)["run"] for run in runs]
    return [(table["simulated"], table["simulated_by"]) for table in tables]


@pytest.mark.parametrize(("name", "simulated"), [("Simulationsprüfstand 2", False), ("hall-3", True)])
def test_run_files_and_campaign_say_it_whatever_the_stand_is_called(
    tmp_path: Path, name: str, simulated: bool
) -> None:
    case = Case(tmp_path, SHORT)
    case.controller.simulated = simulated
    facts = replace(FACTS, stand={"stand": {"id": name, "name": name}})
    outcome = run_campaign(case.plan, case.stand, case.clock, case.out, facts)
    assert outcome.status == "complete"
    assert states(outcome.runs) == [(simulated, OWN_WORD if simulated else REAL)]
    (start,) = case.record()["starts"]
    assert (start["simulated"], start["simulate"]) == (simulated, False)
    assert start["controller"]["serial"] == "1"


def test_how_a_stand_was_reached_is_known_by_what_it_is() -> None:
    opened = open_in_process(load_stand(SAMPLES / "stand.toml"), log_truth=False)
    case, _ = fake_stand(opened.clock)  # type: ignore[arg-type]

    def found(stand: Stand, **how: bool) -> tuple[bool, str]:
        reached = how_reached(stand, **{"started_here": False, "waits": False} | how)
        return reached.simulated, reached.by

    assert found(opened.stand) == (True, OWN_WORD)
    assert found(case) == (False, REAL)
    assert found(case, started_here=True) == (True, STARTED)
    assert found(case, waits=True) == (True, WAITS)
    sensors = found(Stand(case.controller, opened.stand.sensors))
    assert sensors[0]
    assert "amplifier, temperature_1" in sensors[1], "a real controller, and simulated sensors"


@pytest.mark.parametrize("first", [True, False])
def test_real_and_simulated_never_come_into_one_folder(tmp_path: Path, *, first: bool) -> None:
    case = Case(tmp_path, SHORT)
    case.controller.simulated = first
    assert case.run().status == "complete"
    refused = goes_on(case, simulated=not first)
    assert refused.status == "refused"
    assert refused.safe_stop is None
    assert "real and simulated runs never come into one folder" in refused.reason
    assert set(case.controller.calls) <= LOOKED, "nothing was written"
    assert len(list((case.out / "runs").iterdir())) == 1
    assert goes_on(case, simulated=first).status == "complete", "a refused start binds nobody"
    assert {state for state, _ in states(sorted((case.out / "runs").glob("*.h5")))} == {first}


def test_a_start_that_recorded_nothing_binds_nobody(tmp_path: Path) -> None:
    case = Case(tmp_path, SHORT, orders=Orders(writer=4711))
    case.controller.simulated = True
    assert case.run().status == "refused"
    assert goes_on(case, simulated=False).status == "complete"


def test_another_controller_is_refused_unless_its_serial_number_was_accepted(tmp_path: Path) -> None:
    case = Case(tmp_path, SHORT)
    assert case.run().status == "complete"
    refused = goes_on(case, serial="2")
    assert refused.status == "refused"
    assert "has the serial number 2, and the one of this campaign has 1" in refused.reason
    assert set(case.controller.calls) <= LOOKED
    assert goes_on(case, serial="2", accepted_serial="3").status == "refused"
    change = {"what": "the controller’s serial number", "before": "1", "now": "2", "accepted": "typed"}
    outcome = goes_on(case, serial="2", accepted_serial="2", changes=(change,))
    assert outcome.status == "complete"
    told = [event for event in open_run(outcome.runs[-1]).events if event.kind == "changed"]
    assert [event.text.partition(":")[0] for event in told[:-1]] == ["campaign.toml"] * (len(told) - 1)
    event = told[-1]
    assert event.text == "the controller’s serial number: 1 → 2"
    assert event.data["accepted"] == "typed"
    starts = case.record()["starts"]
    assert starts[-1]["changes"] == [change], "the file is no other than at the refused start"
    assert begun(load_record(case.out), case.out).controller["serial"] == "2", (
        "the next one is compared with it"
    )


def test_the_controller_of_a_simulated_stand_may_be_another(tmp_path: Path) -> None:
    """Its serial number is the seed of its noise."""
    case = Case(tmp_path, SHORT)
    case.controller.simulated = True
    assert case.run().status == "complete"
    assert goes_on(case, simulated=True, serial="2").status == "complete"


# --- folders of earlier versions ---------------------------------------------------------------------


def older(case: Case, *, arming: dict[str, str] | None) -> CampaignStart:
    """Return how a campaign was begun of whose folder an earlier version wrote ``campaign.json``."""
    path = case.out / "campaign.json"
    content = json.loads(path.read_text())
    content["starts"] = [] if arming is None else [{"at_utc": "2026-11-01T08:00:00+00:00", "arming": arming}]
    path.write_text(json.dumps(content))
    return begun(CampaignFolder(case.out).load(), case.out)


def test_a_folder_of_an_earlier_version_is_judged_by_who_was_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = Case(tmp_path, SHORT)
    (run,) = case.run().runs
    document = read_metadata(run)
    del document["run"]["simulated"]
    monkeypatch.setattr("bufferstand.daq.campaign_folder.first_start.read_metadata", lambda _: document)
    for arming, simulate, simulated in (
        ({}, True, True),
        ({"by": "tester"}, False, None),
        (None, None, None),
    ):
        known = older(case, arming=arming)
        assert (known.simulate, known.simulated, known.speed) == (simulate, simulated, 1.0)
        assert known.controller["serial"] == "1", "as its run file has it"
        assert known.software == document["software"]["version"]
