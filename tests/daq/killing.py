"""Campaigns that are killed -9 again and again until they are complete, and what must be true then."""

from __future__ import annotations

import json
import pickle
import random
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.interfaces import Controller, ControllerStatus, MotionState
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.recording.runfile.file import open_run
from bufferstand.recording.sealing.verification import verify
from tests.contract.stand.backends import write_stand

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_runs"
SPEED = 1.0
SPAN_S = {"anywhere": 9.0, "recording": 5.0, "sealing": 0.12, "recovering": 0.12}
"""Within so long after each moment it dies [s of the wall]."""
LOCK_S = 10.5
"""So long the controller keeps its writer's lock for a program that fell silent [s of the wall]."""
FALLBACK_S = 60.0
"""Patience for the controller's own fallback, on a busy machine [s of the wall]."""

HEAD = f"""
[campaign]
id = "doomed"
stand = "{{stand}}"
specimen = "{SAMPLES}/specimens/category-a-elastomer.toml"
[limits]
temperature_stop_C = 60.0
temperature_resume_C = 59.0
[guards]
lag_stop_s = 30.0
"""
"""A busy computer that falls behind is not what these tests are about."""
WATCHDOG = {"watchdog_s = 2.0": "watchdog_s = 4.0"}
STEP = """
[[step]]
kind = "harmonic"
prestress_mm = {prestress}
amplitude_mm = {amplitude}
frequency_Hz = 2.0
cycles = {cycles}
"""
TRIES = 5
TOO_BUSY = ("behind the stand for", "the ring was read too late", "was not fed in time", "the disk is slow")
"""What a computer says that cannot follow an accelerated stand: that is not what these tests are about."""
LOADED = (MotionState.HOLDING, MotionState.RAMPING, MotionState.WAVEFORM)


def write_campaign(path: Path, steps: int, stand: Path, more: str = "") -> Path:
    """Write a campaign of short steps; ``more`` goes into its guards."""
    text = [STEP.format(prestress=10.0 + i, amplitude=5.0, cycles=1 + i % 2) for i in range(steps)]
    path.write_text(HEAD.format(stand=stand) + more + "".join(text))
    return path


@dataclass
class Tally:
    """What the kills struck, and what became of stand and samples."""

    kills: int = 0
    stages: Counter[str] = field(default_factory=Counter)
    loaded: int = 0
    fell_back: int = 0
    fallback_s: list[float] = field(default_factory=list)
    acknowledged: int = 0
    recovered_beyond: int = 0
    runs: int = 0
    campaigns: int = 0

    def line(self) -> str:
        slowest = max(self.fallback_s, default=0.0)
        return (
            f"{self.kills} kills {dict(self.stages)}; under load {self.loaded}, fallback {self.fell_back}, "
            f"slowest {slowest:.1f} s; {self.campaigns} campaigns, {self.runs} runs, "
            f"{self.acknowledged} acknowledged samples, all there, {self.recovered_beyond} more recovered"
        )


class Bench:
    """A stand that outlives the programs which use it, and an onlooker at its controller."""

    def __init__(self, folder: Path, controller: Controller, server: subprocess.Popen[str]) -> None:
        self.stand_file = folder / "stand.toml"
        self.endpoints = folder / "endpoints.json"
        self.controller = controller
        self._server = server

    def status(self) -> ControllerStatus:
        return self.controller.status()

    def run(self, log: Path, words: list[str]) -> int:
        """Run a doomed command in a process of its own; return how it ended."""
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        self._server.stdin.write(json.dumps([str(log), words]) + "\n")
        self._server.stdin.flush()
        return int(self._server.stdout.readline())


@contextmanager
def bench(folder: Path, changes: Mapping[str, str] = WATCHDOG) -> Iterator[Bench]:
    folder.mkdir()
    path = write_stand(folder, tuple(changes.items()))
    file = load_stand(path)
    with start_process(path, directory=folder / "stand", speed=SPEED) as process:
        (folder / "endpoints.json").write_text(json.dumps(vars(process.served)))
        controller = build_controller(
            with_endpoints(file, process.served.endpoints()), WallClock(process.served.speed)
        )
        controller.connect()
        server = subprocess.Popen(
            [sys.executable, "-m", "tests.daq.doomed", "serve"],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        with server:
            try:
                yield Bench(folder, controller, server)
            finally:
                controller.close()
                assert server.stdin is not None
                server.stdin.close()


def lived(bench: Bench, folder: Path, campaign: Path, moment: str = "never", after_s: float = 0.0) -> int:
    """Return how a start ended; one that a busy computer kept from following the stand is made again."""
    for _ in range(TRIES):
        before = (folder / "log").stat().st_size if (folder / "log").exists() else 0
        status = bench.run(folder / "log", doomed(bench, folder, campaign, moment, after_s))
        said = (folder / "log").read_bytes()[before:].decode()
        if status != 4 or not any(text in said for text in TOO_BUSY):
            break
    return status


def doomed(bench: Bench, folder: Path, campaign: Path, moment: str, after_s: float) -> list[str]:
    """Return the words that begin the campaign, or resume it if it was begun."""
    out = folder / "out"
    begun = (out / "campaign.json").exists()
    words = ["resume", str(out)] if begun else ["run", str(campaign), "--out", str(out)]
    doom = [str(folder), moment, repr(after_s), str(bench.endpoints)]
    return [*doom, *words, "--simulate", "--speed", str(SPEED)]


def start(
    bench: Bench, folder: Path, campaign: Path, hindered: tuple[str, str] | None = None
) -> subprocess.Popen[str]:
    """Begin or resume the campaign, without doom; ``hindered`` by a slow disk and a clock that is set."""
    module = ["tests.daq.doomed"] if hindered is None else ["tests.daq.hindered", *hindered]
    with (folder / "log").open("a") as log:
        return subprocess.Popen(
            [sys.executable, "-m", *module, *doomed(bench, folder, campaign, "never", 0.0)],
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            text=True,
        )


def fallen_back(bench: Bench, tally: Tally) -> None:
    """See the controller bring a stand to rest whose program was killed."""
    at_kill = bench.status()
    began_s = time.monotonic()
    if at_kill.state not in LOADED:
        assert at_kill.state in (MotionState.OFF, MotionState.READY, MotionState.RELEASING, MotionState.FAULT)
    tally.loaded += at_kill.state in LOADED
    while True:
        status = bench.status()
        if status.state in (MotionState.OFF, MotionState.FAULT) and abs(status.force_kN) < 1.0:
            break
        assert time.monotonic() - began_s < FALLBACK_S, f"no fallback: {at_kill} became {status}"
        time.sleep(0.02)
    if at_kill.state in LOADED:
        assert status.state is MotionState.FAULT, status
        assert status.watchdog_trips == at_kill.watchdog_trips + 1
        tally.fell_back += 1
        tally.fallback_s.append(time.monotonic() - began_s)


def complete_steps(out: Path) -> dict[str, Any]:
    """Return the steps that campaign.json calls complete, by their hash."""
    path = out / "campaign.json"
    steps = json.loads(path.read_text())["steps"] if path.exists() else []
    return {step["plan_hash"]: step for step in steps if step["status"] == "complete"}


def sealed_whole(out: Path) -> set[str]:
    """Return the runs that lie there sealed and complete."""
    return {path.stem for path in (out / "runs").glob("*.h5") if open_run(path).status == "complete"}


def campaign_of_kills(bench: Bench, folder: Path, steps: int, kills: int, seed: int, tally: Tally) -> int:
    """Run one campaign to its end through at most so many kills; return how many it took."""
    folder.mkdir()
    dice = random.Random(seed)
    campaign, out = write_campaign(folder / "campaign.toml", steps, bench.stand_file), folder / "out"
    done: dict[str, Any] = {}
    struck = 0
    while struck < kills:
        orphans = out.exists() and list((out / "runs").glob("*.journal"))
        moments = ["anywhere", "recording", "recording", "sealing", "sealing"]
        moment = dice.choice(["recovering"] * 5 + moments if orphans else moments)
        status = lived(bench, folder, campaign, moment, dice.uniform(0.0, SPAN_S[moment]))
        died_s = time.monotonic()
        if status == 0:
            break  # complete before its hour had come
        assert status == -9, (status, (folder / "log").read_text()[-3000:])
        struck += 1
        tally.kills += 1
        stage = (folder / "stage").read_text().strip()
        tally.stages[stage] += 1
        fallen_back(bench, tally)
        (folder.parent / "tally").write_text(tally.line() + "\n")
        done = unrepeated(done, complete_steps(out))
        if stage not in ("starting", "recovering"):
            time.sleep(max(0.0, LOCK_S - (time.monotonic() - died_s)))
    whole = sealed_whole(out) if out.exists() else set()
    assert lived(bench, folder, campaign) == 0, (folder / "log").read_text()[-3000:]
    final = complete_steps(out)
    unrepeated(done, final)
    assert len(final) == steps
    attempts = [Path(run).stem for step in final.values() for run in step["runs"]]
    assert len(attempts) == len(set(attempts))
    assert whole <= set(attempts)
    statuses = {step["name"]: [open_run(out / run).status for run in step["runs"]] for step in final.values()}
    for name, found in statuses.items():
        assert found[-1] == "complete", (name, found)
        assert set(found[:-1]) <= {"recovered", "failed", "stopped"}, (name, found)
    nothing_lost(folder, set(attempts), tally)
    tally.campaigns += 1
    return struck


def unrepeated(before: dict[str, Any], after: dict[str, Any]) -> dict[str, Any]:
    """See that complete steps stayed as they were."""
    for key, step in before.items():
        assert after[key] == step
    return after


def nothing_lost(folder: Path, attempts: set[str], tally: Tally) -> None:
    """Compare every run with what its recorder was given and what it acknowledged."""
    runs = folder / "out" / "runs"
    assert {path.name for path in runs.iterdir()} == {f"{name}.h5" for name in attempts}
    evidence = {path.stem for path in folder.glob("*.ack")}
    assert evidence == attempts
    for name in sorted(attempts):
        path = runs / f"{name}.h5"
        assert not [finding for finding in verify(path) if finding.level == "fault"]
        run = open_run(path)
        acknowledged = max(int(line) for line in (folder / f"{name}.ack").read_text().split())
        given = given_to(folder / f"{name}.tap")
        rows = run.streams["controller"].rows if "controller" in run.streams else 0
        assert rows >= acknowledged, f"{path}: {acknowledged - rows} acknowledged samples are lost"
        tally.acknowledged += acknowledged
        tally.recovered_beyond += rows - acknowledged
        tally.runs += 1
        for stream, content in run.streams.items():
            sequence, stamps, counts = given[stream]
            held = content.rows
            assert content.sequence.tolist() == sequence[:held].tolist()
            assert content.time.tolist() == stamps[:held].tolist()
            for channel, values in content.counts.items():
                assert values.tobytes() == counts[channel][:held].astype(values.dtype).tobytes(), channel


def given_to(tap: Path) -> dict[str, tuple[Any, Any, dict[str, Any]]]:
    """Return what the recorder of a run was given, by stream: sequence, time stamps, counts."""
    blocks: dict[str, list[Any]] = {}
    if tap.exists():
        with tap.open("rb") as file:
            while True:
                try:
                    (words, named) = pickle.load(file)
                except (EOFError, pickle.UnpicklingError):
                    break
                stream, first, stamps, counts = words[:4]
                assert not named or set(named) == {"lost"}
                blocks.setdefault(stream, []).append((first + np.arange(len(stamps)), stamps, counts))
    return {
        stream: (
            np.concatenate([block[0] for block in found]),
            np.concatenate([block[1] for block in found]),
            {name: np.concatenate([block[2][name] for block in found]) for name in found[0][2]},
        )
        for stream, found in blocks.items()
    }


def kill(folder: Path, *, kills: int, seed: int, steps: int, per_campaign: int) -> Tally:
    """Kill campaigns on one stand until that many kills were made; return what became of them."""
    tally = Tally()
    with bench(folder / "bench") as stand:
        number = 0
        while tally.kills < kills:
            left = kills - tally.kills
            campaign_of_kills(
                stand, folder / f"{number}", steps, min(per_campaign, left), seed + number, tally
            )
            number += 1
            (folder / "tally").write_text(tally.line() + "\n")
    return tally
