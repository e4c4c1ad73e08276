"""Controllers by others: check, a campaign, a kill under load and resume; no sample vanishes in silence.

The C one (libmodbus) and the one in Go were written from docs/drivers.md and
drivers/register_maps/profiles/ring.toml by somebody who had not read the driver; each keeps its own truth,
with which every recorded sample is compared count by count."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.peers.controllers import Case
from tests.peers.trials import carried, is_event, kill_and_resume, run_campaign, run_check

Program = Callable[[str], Path]
Record = Callable[[str, object], None]
"""Puts a figure into the report that `--junitxml` writes."""

SLOW = tuple(
    Case(peer, ("--delay-ms", delay)) for peer in ("c", "go") for delay in ("0", "1", "2", "5", "10")
)
LINE_Hz = 350.0
"""A line of 115 200 baud carries some 400 samples a second (docs/drivers.md)."""
FIFTY_PPM = ("--ppm", "50")
SPECIAL = (
    Case("c", FIFTY_PPM),
    Case("go", ("--ppm", "-50", "--lean")),
    Case("c", ("--scan-ms", "5")),
    Case("go", ("--scan-ms", "5")),
    Case("c", ("--scan-ms", "5", "--reply-at-edge")),
    Case("go", ("--scan-ms", "5", "--reply-at-edge")),
    Case("c", ("--no-fc23", "--delay-ms", "1")),
    Case("go", ("--no-fc23", "--delay-ms", "1")),
    Case("c", ("--miss-every", "733")),
    Case("go", ("--miss-every", "733", "--delay-ms", "2")),
    Case("c", ("--miss-every", "733", "--miss-leaves-hole")),
    Case("go", ("--miss-every", "733", "--miss-leaves-hole", "--delay-ms", "2")),
    Case("c", ("--tick-start-us", "4290000000", "--jitter-ms", "3")),
    Case("go", ("--tick-start-us", "4290000000", "--sequence-start", "4294963000")),
    Case("c", FIFTY_PPM, line=True, rate_Hz=LINE_Hz),
    Case("go", FIFTY_PPM, line=True, rate_Hz=LINE_Hz),
)
TOO_MUCH = (
    Case("c", ("--delay-ms", "13")),
    Case("go", ("--delay-ms", "13")),
    Case("go", ("--no-fc23", "--delay-ms", "6")),
    Case("c", FIFTY_PPM, line=True, rate_Hz=500.0),
    Case("go", FIFTY_PPM, line=True, rate_Hz=500.0),
)
DAILY = (SLOW[2], SPECIAL[1], SPECIAL[8])


def cases(daily: Sequence[Case], others: Sequence[Case]) -> Sequence[object]:
    """Give all cases; those that are not run daily only with --long."""
    late = [pytest.param(case, marks=pytest.mark.long, id=str(case)) for case in others if case not in daily]
    return [pytest.param(case, id=str(case)) for case in daily] + late


@pytest.mark.parametrize("case", cases(DAILY, SLOW + SPECIAL))
def test_check_finds_what_there_is(
    case: Case, program: Program, tmp_path: Path, record_property: Record
) -> None:
    done = run_check(case, program(case.peer), tmp_path)
    record_property("wire", " | ".join(carried(done.stdout)))
    if "--miss-every" in case.options:  # that is to be told, not to be passed over
        assert "lost" in done.stdout or "missed" in done.stdout, done.stdout
    else:
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("case", cases(DAILY, SLOW + SPECIAL))
def test_a_campaign_loses_no_sample_in_silence(
    case: Case, program: Program, tmp_path: Path, record_property: Record
) -> None:
    outcome = run_campaign(case, program(case.peer), tmp_path)
    record_property("samples", outcome.figures)
    assert outcome.exit_status == 0, outcome.said
    assert outcome.recorded("harmonic") == 1
    assert all(run.balanced for run in outcome.runs), outcome.runs
    assert outcome.at_rest


@pytest.mark.parametrize("case", cases(DAILY[:1], SLOW + SPECIAL))
def test_a_killed_campaign_is_released_and_resumed(
    case: Case, program: Program, tmp_path: Path, record_property: Record
) -> None:
    outcome = kill_and_resume(case, program(case.peer), tmp_path)
    record_property("samples", outcome.figures)
    assert outcome.exit_status == 0, outcome.said
    assert outcome.recorded("harmonic") == 2, "the part that was killed, and the step done again"
    assert all(run.balanced for run in outcome.runs), outcome.runs
    assert outcome.at_rest


@pytest.mark.parametrize("case", cases(TOO_MUCH[1:2], TOO_MUCH))
def test_what_cannot_keep_up_is_said_and_refused_before_anything_moves(
    case: Case, program: Program, tmp_path: Path
) -> None:
    # At 13 ms 14 samples a block are less than 1077 a second even if nothing else were asked for.
    figures = re.compile(
        rf"does not keep up: at most (\d+) samples/s of {case.rate_Hz:g} \(14 samples a block in ([\d.]+) ms,"
    )
    checked = run_check(case, program(case.peer), tmp_path / "check")
    assert checked.returncode == 4, checked.stdout + checked.stderr
    outcome = run_campaign(case, program(case.peer), tmp_path / "run")
    assert outcome.exit_status == 4, outcome.said
    for said in (checked.stdout, outcome.said):
        found = figures.search(said)
        assert found, said
        assert 0.3 * case.rate_Hz < float(found[1]) < case.rate_Hz
        assert float(found[1]) < 14e3 / float(found[2])
        assert "a block must take less than" in said
    assert outcome.names == [], "nothing was recorded"
    assert not any(is_event(name)(event) for event in outcome.events for name in ("valve-on", "started"))
    assert outcome.at_rest


@pytest.mark.parametrize("peer", ["c", "go"])
def test_what_a_short_ring_loses_is_counted(peer: str, program: Program, tmp_path: Path) -> None:
    # 60 samples are 60 ms; one reply of fifty is 120 ms late: some are overwritten before they are asked for.
    options = ("--ring", "60", "--late-every", "50", "--late-ms", "120")
    # Nothing is touched off: a first contact among what is lost would rightly not be found.
    outcome = run_campaign(Case(peer, options), program(peer), tmp_path, touch=False)
    assert outcome.exit_status == 0, outcome.said
    assert sum(run.lost for run in outcome.runs) > 0
    assert all(run.balanced for run in outcome.runs), outcome.runs
    assert outcome.at_rest
