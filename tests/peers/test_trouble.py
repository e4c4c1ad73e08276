"""What peers do wrong on purpose: the campaign copes or stops, unloaded, and loses nothing in silence."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.peers.accounting import account
from tests.peers.campaigns import armed, bufferstand, command, write_campaign
from tests.peers.controllers import Case, controller
from tests.peers.trials import HARMONIC, UNLOADED_kN, is_event, run_campaign, started

Program = Callable[[str], Path]
BOTH = ["c", pytest.param("go", marks=pytest.mark.long)]


@pytest.mark.parametrize("peer", BOTH)
@pytest.mark.parametrize(
    "options",
    [("--late-every", "301", "--late-ms", "700"), ("--cut-every", "97")],
    ids=["late beyond the timeout", "cut"],
)
def test_bad_replies_now_and_then_cost_no_sample(
    peer: str, options: tuple[str, ...], program: Program, tmp_path: Path
) -> None:
    outcome = run_campaign(Case(peer, options, timeout_s=0.4), program(peer), tmp_path)
    assert outcome.exit_status == 0, outcome.said
    assert outcome.recorded("harmonic") == 1
    assert all(run.balanced and run.lost == 0 for run in outcome.runs), outcome.runs
    assert outcome.at_rest


@pytest.mark.long
@pytest.mark.parametrize("peer", ["c", "go"])
def test_cut_replies_on_a_line_cost_no_sample(peer: str, program: Program, tmp_path: Path) -> None:
    case = Case(peer, ("--cut-every", "97"), line=True, rate_Hz=200.0)
    outcome = run_campaign(case, program(peer), tmp_path)
    assert outcome.exit_status == 0, outcome.said
    assert all(run.balanced and run.lost == 0 for run in outcome.runs), outcome.runs
    assert outcome.at_rest


@pytest.mark.parametrize("peer", BOTH)
def test_a_controller_that_boots_amid_a_sine_ends_the_campaign(
    peer: str, program: Program, tmp_path: Path
) -> None:
    with controller(Case(peer), program(peer), tmp_path) as running:
        out = tmp_path / "campaign"
        words = command("run", write_campaign(tmp_path, cycles=40), "--out", out, *armed("run"))
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as campaign:
            running.wait_for(started(HARMONIC), meanwhile=campaign)
            running.boot()
            said, _ = campaign.communicate(timeout=300)
        last = running.end()
        assert campaign.returncode == 4, said
        assert not last["valve"]
        truth = running.truth()
        assert not np.any(truth[truth["boot"] == 1]["status_word"] & 0x0004), "it was switched on again"
        first_boot = truth[truth["boot"] == 0]
        for path in sorted((out / "runs").glob("*.h5")):
            assert account(path, first_boot).balanced


# One block of 14 samples every 20 ms: 700 a second of 1000.
TOO_SLOW = ("--scan-ms", "20", "--reply-at-edge", "--ring", "4000")


@pytest.mark.parametrize("peer", BOTH)
def test_a_scan_that_is_too_slow_stops_a_campaign(peer: str, program: Program, tmp_path: Path) -> None:
    outcome = run_campaign(Case(peer, TOO_SLOW), program(peer), tmp_path)
    assert outcome.exit_status == 4, outcome.said
    assert all(run.balanced for run in outcome.runs), outcome.runs
    assert outcome.at_rest


@pytest.mark.parametrize("peer", BOTH)
def test_a_scan_that_is_too_slow_is_no_good_stand_to_check(
    peer: str, program: Program, tmp_path: Path
) -> None:
    with controller(Case(peer, TOO_SLOW), program(peer), tmp_path) as running:
        done = bufferstand("check", running.stand, "--watch", "3")
    rate = next(line for line in done.stdout.splitlines() if "sample rate" in line)
    assert not rate.strip().startswith("ok"), done.stdout


@pytest.mark.parametrize("peer", BOTH)
def test_a_second_program_touches_nothing(peer: str, program: Program, tmp_path: Path) -> None:
    with controller(Case(peer), program(peer), tmp_path) as running:
        campaign = write_campaign(tmp_path, cycles=500)
        words = command("run", campaign, "--out", tmp_path / "one", *armed("run"))
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as one:
            place = running.wait_for(started(HARMONIC), meanwhile=one)
            two = bufferstand("run", campaign, "--out", tmp_path / "two", *armed("run"))
            assert one.poll() is None, "the first ran on meanwhile"
            one.send_signal(signal.SIGINT)
            said, _ = one.communicate(timeout=300)
        assert two.returncode in {3, 4}, two.stdout + two.stderr
        assert one.returncode == 3, said
        armed_since = [e["code"] for e in running.events()[place + 1 :] if e["event"] == "armed"]
        assert set(armed_since) <= {1, 5}, (
            "only the first program's hold and release came after its sine began"
        )
        assert not running.end()["valve"]


def test_two_controllers_at_once_know_nothing_of_each_other(program: Program, tmp_path: Path) -> None:
    with (
        controller(Case("c", ("--delay-ms", "1")), program("c"), tmp_path / "c") as one,
        controller(Case("go", ("--delay-ms", "2")), program("go"), tmp_path / "go") as other,
    ):
        both = (one, other)
        campaigns = []
        for peer in both:
            words = command("run", write_campaign(peer.folder), "--out", peer.folder / "out", *armed("run"))
            campaigns.append(
                subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            )
        for peer, campaign in zip(both, campaigns, strict=True):
            with campaign:
                said, _ = campaign.communicate(timeout=300)
            assert campaign.returncode == 0, said
            assert not peer.end()["valve"]
            truth = peer.truth()
            assert abs(float(truth[-1]["true_force_kN"])) < UNLOADED_kN
            assert all(account(path, truth).balanced for path in (peer.folder / "out" / "runs").glob("*.h5"))


def test_another_controller_at_the_same_address_is_noticed(program: Program, tmp_path: Path) -> None:
    with controller(Case("c", ("--serial", "7001")), program("c"), tmp_path / "a") as first:
        port = next(line for line in first.stand.read_text().splitlines() if line.startswith("port")).split()[
            -1
        ]
        campaign = write_campaign(first.folder, cycles=40)
        words = command("run", campaign, "--out", tmp_path / "out", *armed("run"))
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as running:
            first.wait_for(started(HARMONIC), meanwhile=running)
            first.end()
            case = Case("c", ("--serial", "7002", "--port", port))
            with controller(case, program("c"), tmp_path / "b") as second:
                said, _ = running.communicate(timeout=300)
                assert running.returncode == 4, said
                assert not any(is_event("valve-on")(event) for event in second.events())
                assert not any(is_event("started")(event) for event in second.events())
