"""A served stand without a serial lock, the tap before it, the witness at it, and campaigns for it."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.clean_stand import clean_stand_text
from tests.two_programs.programs import PATIENCE_S, ROOT, Launcher, Program
from tests.two_programs.tap import Tap
from tests.two_programs.witness import Witness

SAMPLES = ROOT / "sample_runs"
AIR_C = 21.0
"""Of the sample stand, and of its specimen at the start."""
TIMEOUT_S = 1.0
"""Longest wait for a reply: twice that of the sample stand, for a busy computer."""
STAND_ID = "simulated-630kN"
SPECIMEN_ID = "A-105-E-01"
COPIED = ("specimens/category-a-elastomer.toml", "models/category-a-elastomer.toml")
HEAD = """
[campaign]
id = "{name}"
stand = "stand.toml"
specimen = "specimens/category-a-elastomer.toml"
operator = "two programs"
[limits]
force_max_kN = 200.0
{limits}
[motion]
ramp_speed_mm_per_s = {speed}
release_speed_mm_per_s = {speed}
[zero]
touch = false
[guards]
lag_stop_s = 30.0
"""
"""A computer that is too busy to follow the stand is not what is tried here."""
NEVER_HOT = "temperature_stop_C = 60.0\ntemperature_resume_C = 59.0\n"
WAITS_WHEN_HOT = 'on_temperature_stop = "wait-and-continue"\n'
"""At 40 °C, until it is at 30 °C: in air of `NEARLY_HOT_C` until somebody stops it."""
NEARLY_HOT_C = 39.88
"""Two steps of a DS18B20 below the temperature stop: some seconds of `HEATING`."""
HOLD = """
[[step]]
kind = "hold"
stroke_mm = {stroke}
duration_s = {duration}
"""
SINE = """
[[step]]
kind = "harmonic"
prestress_mm = 30.0
amplitude_mm = 15.0
frequency_Hz = 1.0
cycles = {cycles}
"""
HEATING = SINE.format(cycles=200).replace("frequency_Hz = 1.0", "frequency_Hz = 2.5")
COOL_DOWN = """
[[step]]
kind = "cool-down"
temperature_C = 15.0
timeout_s = 600.0
"""
"""Colder than the air of the stand: it waits until somebody stops it."""


@dataclass
class Bench:
    """A stand that outlives the programs which use it."""

    folder: Path
    launcher: Launcher
    tap: Tap
    witness: Witness
    watchdog_s: float
    programs: list[Program] = field(default_factory=list)

    @property
    def stand(self) -> Path:
        """The stand file: its address is the tap's."""
        return self.folder / "stand.toml"

    def campaign(self, name: str, *steps: str, speed_mm_per_s: float = 20.0, limits: str = NEVER_HOT) -> Path:
        """Write a campaign file of these steps; ``limits``: more lines of that table."""
        path = self.folder / f"{name}.toml"
        head = HEAD.format(name=name, speed=speed_mm_per_s, limits=limits)
        path.write_text(head + "".join(steps), encoding="utf-8")
        return path

    def start(self, label: str, *words: str | Path, module: str = "bufferstand") -> Program:
        """Start a command on this stand."""
        log = self.folder / f"{len(self.programs)}-{label.replace(' ', '-')}.txt"
        program = self.launcher.start(label, log, *words, module=module)
        self.programs.append(program)
        return program

    def run(self, campaign: Path) -> Program:
        """Start ``bufferstand run``; its folder has the campaign's name."""
        return self.start("run", "run", campaign, "--out", self.out(campaign), "--yes-move", SPECIMEN_ID)

    def resume(self, campaign: Path) -> Program:
        """Start ``bufferstand resume`` in the folder of a campaign."""
        return self.start("resume", "resume", self.out(campaign), "--yes-move", SPECIMEN_ID)

    def out(self, campaign: Path) -> Path:
        return self.folder / f"out-{campaign.stem}"

    def name(self, pid: int | None) -> str:
        """Return who a process is."""
        named = [f"{place + 1}: {one.label}" for place, one in enumerate(self.programs) if one.pid == pid]
        return named[0] if named else f"process {pid}"


@contextmanager
def bench(
    folder: Path, launcher: Launcher, watchdog_s: float = 2.0, temperature_C: float = AIR_C
) -> Iterator[Bench]:
    """Serve a stand at real time; on leaving, kill the programs that are left and see that they are gone.

    Args:
        folder: Made for it.
        launcher: Starts the stand and the programs on it.
        watchdog_s: Of the stand file [s].
        temperature_C: Of the air and of the specimen at the start [°C].
    """
    folder.mkdir(parents=True)
    tap = Tap()
    _write_files(folder, tap.port, watchdog_s, temperature_C)
    ends = folder / "endpoints.json"
    words = ("simulate-stand", folder / "stand.toml", "--port", "0", "--endpoints", ends)
    served = launcher.start("stand", folder / "served.txt", *words)
    try:
        port = _port(ends, served)
        tap.serve(port)
        witness = Witness(port)
        made = Bench(folder, launcher, tap, witness, watchdog_s)
        try:
            yield made
        finally:
            for program in made.programs:
                program.kill()
                program.wait()
            witness.close()
    finally:
        tap.close()
        served.kill()
        served.wait()


def _write_files(folder: Path, port: int, watchdog_s: float, temperature_C: float) -> None:
    for name in COPIED:
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes((SAMPLES / name).read_bytes())
    text = clean_stand_text()
    # An amplifier's serial line would be held by the first program alone, and stop the second one there.
    begin, end = text.index("[amplifier]"), text.index("[temperature]")
    text = text[:begin] + text[end:]
    timeout = ("timeout_s = 0.5", f"timeout_s = {TIMEOUT_S}")
    for old, new in (
        timeout,
        ("port = 15020", f"port = {port}"),
        ("watchdog_s = 2.0", f"watchdog_s = {watchdog_s}"),
        (f"ambient_C = {AIR_C}", f"ambient_C = {temperature_C}"),
        (f"initial_C = {AIR_C}", f"initial_C = {temperature_C}"),
    ):
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "stand.toml").write_text(text, encoding="utf-8")


def _port(ends: Path, served: Program) -> int:
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        assert served.alive, served.said
        if ends.exists() and (text := ends.read_text()).strip():
            return int(json.loads(text)["port"])
        time.sleep(0.02)
    raise AssertionError("the stand is not served")
