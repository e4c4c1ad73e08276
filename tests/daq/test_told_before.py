"""What ended a start that recorded nothing is told by the runs that come after, and by the report."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.daq.campaign_folder.folder import CampaignRecord
from bufferstand.daq.campaign_folder.start_records import doubts_before
from bufferstand.evaluation.report.content.content import Texts
from bufferstand.evaluation.report.sections.statements import deviations_section
from bufferstand.evaluation.report.source.reading import read_source
from bufferstand.recording.runfile.file import open_run
from tests.daq.touch_stands import HELD, KINDS, run_stand

AT = "2026-11-24T12:03:11.5+00:00"
TRIP = {"guard": "wiring of force", "reason": "force falls.", "doubt": "sign", "sensor": "force"}


def record(*starts: dict[str, object]) -> CampaignRecord:
    """Return a campaign with some starts, and one that goes on."""
    return replace(CampaignRecord({}, (), ""), starts=(*starts, {"at_utc": "2026-11-24T13:00:00+00:00"}))


@pytest.mark.parametrize("changes", [[], [{"what": "stand.toml: a", "before": "1", "now": "2"}]])
def test_a_doubt_is_told_with_what_was_changed_until_a_start_passed(changes: list[dict[str, str]]) -> None:
    again = {"at_utc": AT, "changes": changes, "trip": TRIP}
    passed = {"at_utc": AT, "changes": changes}
    later = {"at_utc": AT, "changes": [{"what": "stand.toml: b", "before": "1", "now": "2"}]}
    told = doubts_before(record({"at_utc": AT, "trip": TRIP}, again, passed, later))
    assert [len(one["changed"]) for one in told] == [2 * len(changes), len(changes)]
    words = "changed since: stand.toml: a: 1 → 2" if changes else "no setting was changed since"
    for one in told:
        assert one["text"].startswith(
            "the start of 2026-11-24 12:03 UTC recorded nothing and was ended by “wiring of force”: "
            "force falls; "
        )
        assert words in one["text"]
        assert "stand.toml: b" not in one["text"]
        assert one["sensor"] == "force"


def test_nothing_is_told_of_starts_that_were_not_ended_so() -> None:
    assert doubts_before(record({"at_utc": AT}, {"at_utc": AT, "changes": []})) == ()


def test_runs_and_report_of_a_campaign_that_went_on_tell_what_ended_it_before(tmp_path: Path) -> None:
    wrong = run_stand(tmp_path, miswired=KINDS["piston: half"].tables, steps=HELD)
    assert wrong.outcome.exit_status == 4
    right = run_stand(tmp_path, steps=HELD)
    assert right.outcome.exit_status == 0, right.outcome.reason
    (event,) = [one for one in open_run(right.outcome.runs[0]).events if one.kind == "doubted"]
    assert event.data["sensor"] == "position"
    assert event.data["reason"] == wrong.outcome.reason
    starts = json.loads((right.folder / "campaign.json").read_text(encoding="utf-8"))["starts"]
    assert event.data["at_utc"] == starts[0]["at_utc"]
    assert any("miswired" in text for text in event.data["changed"])
    blocks = deviations_section(read_source(right.folder)).blocks
    listed = [text for block in blocks if isinstance(block, Texts) for text in block.items]
    assert sum(str(event.text)[1:] in text for text in listed) == 1
