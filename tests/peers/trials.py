"""What each peer goes through: check, a campaign, a kill under load, resume; and the account afterwards."""

from __future__ import annotations

import re
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.peers.accounting import Account, accounts
from tests.peers.campaigns import armed, bufferstand, command, write_campaign
from tests.peers.controllers import Case, Running, controller

HARMONIC = 3
UNLOADED_kN = 0.5


@dataclass(frozen=True)
class Outcome:
    """Exit status and account of what was tried, and the controller's last word."""

    exit_status: int
    said: str
    runs: list[Account]
    names: list[str]  # of the run files
    truth: NDArray[np.void]
    events: list[dict[str, Any]]

    def recorded(self, kind: str) -> int:
        """Count the run files of a kind."""
        return sum(f"-{kind}-" in name for name in self.names)

    @property
    def figures(self) -> str:
        """Produced / missed / recorded / lost samples of all its runs."""
        names = ("produced", "missed", "recorded", "lost")
        return " / ".join(str(sum(getattr(run, name) for run in self.runs)) for name in names)

    @property
    def at_rest(self) -> bool:
        """Say whether the controller itself ended with no force and its valve off."""
        last = self.truth[-1]
        enabled = int(last["status_word"]) & 0x0004
        return (
            abs(float(last["true_force_kN"])) < UNLOADED_kN and not enabled and not self.events[-1]["valve"]
        )


def started(code: int) -> Any:
    """Give what recognises the start of a motion in a controller's log."""
    return lambda event: event["event"] == "started" and event["code"] == code


def is_event(name: str) -> Any:
    """Give what recognises an event in a controller's log."""
    return lambda event: event["event"] == name


def carried(checked: str) -> tuple[str, str]:
    """Get what `check` says of a wire: the time of a block, and the samples a second that it carries."""
    found = re.search(r"at most (\d+) samples/s of \d+ \(\d+ samples a block in ([\d.]+ ms)", checked)
    return ("–", "–") if found is None else (found[2], found[1])


def run_check(case: Case, program: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """`bufferstand check` against a fresh controller."""
    with controller(case, program, folder) as peer:
        return bufferstand("check", peer.stand, "--watch", "3")


def run_campaign(case: Case, program: Path, folder: Path, *more: str, touch: bool = True) -> Outcome:
    """Run a campaign from beginning to end."""
    with controller(case, program, folder, *more) as peer:
        out = folder / "campaign"
        done = bufferstand("run", write_campaign(folder, touch=touch), "--out", out, *armed("run"))
        return _outcome(peer, out, done)


def _outcome(peer: Running, out: Path, done: subprocess.CompletedProcess[str]) -> Outcome:
    peer.end()
    truth = peer.truth()
    names = sorted(path.name for path in (out / "runs").glob("*.h5"))
    runs = accounts(out, truth) if names else []
    return Outcome(done.returncode, done.stdout + done.stderr, runs, names, truth, peer.events())


def kill_and_resume(case: Case, program: Path, folder: Path) -> Outcome:
    """Kill the campaign with SIGKILL amid a sine; the controller releases by itself; then resume."""
    with controller(case, program, folder) as peer:
        out = folder / "campaign"
        words = command("run", write_campaign(folder, cycles=20), "--out", out, *armed("run"))
        said = folder / "killed.txt"
        with said.open("w") as to, subprocess.Popen(words, stdout=to, stderr=to) as campaign:
            try:
                place = peer.wait_for(started(HARMONIC), meanwhile=campaign)
                wait_for_load(peer, campaign)
            except AssertionError as error:
                lines = said.read_text().splitlines() or ["it has said nothing"]
                raise AssertionError(f"{error}: {lines[-1]}\n" + "\n".join(lines)) from None
            campaign.send_signal(signal.SIGKILL)
        place = peer.wait_for(lambda e: is_event("fault")(e) and e["code"] == 1, after=place)
        closed = peer.wait_for(is_event("valve-off"), after=place)
        loaded = peer.events()[closed]["force_kN"]
        assert abs(loaded) < UNLOADED_kN, f"it closed its valve at {loaded} kN"
        # A ring controller without the writer's lock has nothing to forget.
        if "--lean" not in case.options:
            peer.wait_for(is_event("writer-forgotten"), after=place)
        done = bufferstand("resume", out, *armed("resume"))
        return _outcome(peer, out, done)


def wait_for_load(peer: Running, campaign: subprocess.Popen[Any]) -> None:
    """Wait until the specimen bears a force in the sine, two hundred samples after it began."""
    made = len(peer.truth())
    while True:
        truth = peer.truth()
        if len(truth) > made + 200 and truth[-1]["true_force_kN"] > 10.0:
            return
        assert peer.process.poll() is None, "the controller has died"
        assert campaign.poll() is None, "the campaign ended before the specimen bore a force"
        time.sleep(0.02)
