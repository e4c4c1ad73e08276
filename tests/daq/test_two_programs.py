"""Two programs at one served stand, as real processes; an independent Modbus client looks on."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.clean_stand import clean_stand_text
from tests.daq.witness import Witness, watching

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "sample_runs"
SPECIMEN = "category-a-elastomer"
PATIENCE_S = 180.0
"""For what a busy computer does in seconds [s of the wall]."""
LOADED_KN = 20.0
WATCHDOG_S = 2.0

HEAD = f"""
[campaign]
id = "{{name}}"
stand = "stand.toml"
specimen = "{SAMPLES}/specimens/{SPECIMEN}.toml"
[zero]
touch = false
[guards]
lag_stop_s = 30.0
"""
SINE = """
[[step]]
kind = "harmonic"
prestress_mm = 15.0
amplitude_mm = 3.0
frequency_Hz = 0.5
cycles = 200
"""
WAITS = SINE + "start_temperature_C = [15.0, 25.0]\n"


def words(*more: str | Path) -> list[str]:
    return [sys.executable, "-P", "-m", "bufferstand", *map(str, more)]


@dataclass
class Started:
    """A command that runs, and what it says."""

    process: subprocess.Popen[str]
    log: Path

    @property
    def said(self) -> str:
        return self.log.read_text(encoding="utf-8")

    def ended(self) -> int:
        return self.process.wait(timeout=PATIENCE_S)


@dataclass
class Hall:
    """A folder with a stand that is served."""

    folder: Path
    witness: Witness

    def campaign(self, name: str, steps: str) -> Path:
        path = self.folder / f"{name}.toml"
        path.write_text(HEAD.format(name=name) + steps, encoding="utf-8")
        return path

    def start(self, *more: str | Path) -> Started:
        """Start a command that moves."""
        log = self.folder / f"log-{len(list(self.folder.glob('log-*')))}"
        with log.open("w") as said:
            process = subprocess.Popen(
                words(*more, "--yes-move", specimen_id()),
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                text=True,
            )
        return Started(process, log)

    def until(self, reached: Callable[[], bool], started: Started, what: str) -> None:
        """Wait until something is so; fail once the command has ended, or patience has."""
        end_s = time.monotonic() + PATIENCE_S
        while not reached():
            alive = started.process.poll() is None and time.monotonic() < end_s
            assert alive, (what, self.witness.newest(), started.said[-2000:])
            time.sleep(0.02)


def specimen_id() -> str:
    text = (SAMPLES / f"specimens/{SPECIMEN}.toml").read_text(encoding="utf-8")
    return next(line.split('"')[1] for line in text.splitlines() if line.startswith("id"))


def free_port() -> int:
    with socket.socket() as chosen:
        chosen.bind(("127.0.0.1", 0))
        return int(chosen.getsockname()[1])


@pytest.fixture
def hall(tmp_path: Path) -> Iterator[Hall]:
    port, text = free_port(), clean_stand_text()
    for old, new in {
        'model = "': f'model = "{SAMPLES}/',
        "port = 15020": f"port = {port}",
        "initial_C = 21.0": "initial_C = 33.0",
    }.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    (tmp_path / "stand.toml").write_text(text, encoding="utf-8")
    with subprocess.Popen(
        words("simulate-stand", tmp_path / "stand.toml", "--wait-for-reader"),
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as served:
        try:
            end_s = time.monotonic() + PATIENCE_S
            while time.monotonic() < end_s:
                assert served.poll() is None, served.communicate()[1]
                try:
                    socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
                    break
                except OSError:
                    time.sleep(0.1)
            with watching(port) as witness:
                yield Hall(tmp_path, witness)
        finally:
            served.terminate()
            served.communicate(timeout=PATIENCE_S)


@pytest.mark.long
def test_a_second_campaign_is_refused_while_the_first_waits(hall: Hall) -> None:
    """In virtual time it is tried always: test_lock.py."""
    first = hall.start("run", hall.campaign("first", WAITS), "--out", hall.folder / "first")
    try:
        hall.until(lambda: "waits for the specimen to cool" in first.said, first, "the wait")
        hall.until(lambda: not hall.witness.newest().valve_on, first, "valve off while it waits")
        holder = hall.witness.newest().writer
        assert holder > 0
        began_s = time.monotonic()
        second = hall.start("run", hall.campaign("second", SINE), "--out", hall.folder / "second")
        assert second.ended() == 4
        assert f"process {first.process.pid} of " in second.said
        assert f"campaign “first” in {hall.folder / 'first'}" in second.said
        assert "it lives" in second.said
        assert "the stand was not touched" in second.said
        meanwhile = hall.witness.since(began_s)
        assert {look.writer for look in meanwhile} == {holder}, "it is the first one's all the time"
        assert not any(look.valve_on for look in meanwhile)
        assert first.process.poll() is None
    finally:
        first.process.send_signal(signal.SIGINT)
    assert first.ended() == 3, first.said
    assert hall.witness.newest().writer == 0, "given back at the end"


def test_a_campaign_killed_under_force_is_resumed_behind_its_own_release(hall: Hall) -> None:
    killed = hall.start("run", hall.campaign("third", SINE), "--out", hall.folder / "third")
    hall.until(lambda: hall.witness.newest().force_kN > LOADED_KN, killed, "force")
    killed.process.kill()
    killed.ended()
    died_s = time.monotonic()
    holder = hall.witness.newest().writer
    resumed = hall.start("resume", hall.folder / "third")
    try:
        hall.until(lambda: hall.witness.newest().writer not in (0, holder), resumed, "resume has the stand")
        see_it_come_to_rest_by_itself(hall.witness, died_s, holder)
        hall.until(lambda: hall.witness.newest().valve_on, resumed, "it goes on")
    finally:
        resumed.process.send_signal(signal.SIGINT)
    assert resumed.ended() == 3, resumed.said
    if "waits for the controller" in resumed.said:  # on a busy computer it is at rest before resume has begun
        assert f"process {killed.process.pid} of " in resumed.said
        assert ", which was killed (number" in resumed.said
        assert "the controller is at rest, and nobody has it" in resumed.said
    assert (hall.witness.newest().valve_on, hall.witness.newest().writer) == (False, 0)


def see_it_come_to_rest_by_itself(witness: Witness, died_s: float, holder: int) -> None:
    """From the kill until another program has the stand nobody feeds, and the watchdog ends the motion."""
    before = [look for look in witness.since(died_s + 0.3) if look.writer in (0, holder)]
    assert len({look.feed for look in before}) == 1, "nobody fed the dead program's watchdog"
    assert before[0].valve_on
    assert max(look.force_kN for look in before) > LOADED_KN
    assert abs(before[-1].force_kN) < 1.0
    assert (before[-1].valve_on, before[-1].fault) == (False, 1), "by its own watchdog"
    off = [look for look in before if look.at_s > before[-1].at_s - 1.0]
    assert not any(look.valve_on for look in off), "off before somebody else had it"
