"""The reference controllers, in C and in Structured Text: a campaign, a kill, faults, a bad wire.

The contract of a controller is tried on them in ``tests/contract/controller``.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from math import exp
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault, WireLost
from bufferstand.foundation.motions import Harmonic, RampTo
from tests.contract.controller.backends import Bench
from tests.drivers.noisy import Noise, noisy_tcp
from tests.peers.campaigns import armed, bufferstand, command
from tests.peers.references import (
    BUILD_PLC,
    IN_C,
    IN_ST,
    build_plc_by_translator,
    build_reference,
    reference_stand,
)

QUICK = "-O2"
"""Without sanitizers: what is tried in real time shall not be slow."""
BOTH = ["C", "ST"]


class ReferenceStand:
    """A reference controller that runs, and its stand file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @contextmanager
    def bench(self, path: Path | None = None) -> Iterator[Bench]:
        """Connect to it."""
        stand, clock = load_stand(path or self.path), WallClock()
        controller = build_controller(stand, clock)
        controller.connect()
        try:
            yield Bench("reference", controller, clock)
        finally:
            controller.close()


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Path]]:
    folder = tmp_path_factory.mktemp("built")
    return {
        "C": [build_reference(folder / "c", QUICK)],
        "ST": [build_plc_by_translator(folder / "st", QUICK)],
    }


@contextmanager
def running(kind: str, programs: dict[str, list[Path]], folder: Path) -> Iterator[ReferenceStand]:
    with reference_stand(folder, programs[kind], IN_C if kind == "C" else IN_ST) as path:
        yield ReferenceStand(path)


def plant_facts() -> dict[str, float]:
    """Get the constants of the simulated machine from its source: the law of its buffer."""
    text = (IN_C / "hal_simulated.c").read_text(encoding="utf-8")
    return {name: float(value) for name, value in re.findall(r"(\w+) = (-?[\d.]+)[,;]", text)}


def damping_of(facts: dict[str, float], low_mm: float, high_mm: float) -> float:
    """Return absorbed over stored energy of the law F = E(x) (1 + MU z) between two strokes.

    The friction z follows dz/dx = (1 - z sgn dx) / l; in a steady cycle it starts each way with what the
    other way left.
    """
    x = np.linspace(low_mm, high_mm, 20001)
    elastic = facts["PRELOAD_KN"] * np.minimum(x / facts["PRELOAD_WITHIN_MM"], 1.0)
    elastic += facts["STIFFNESS_KN_PER_MM"] * x
    length = facts["FRICTION_LENGTH_MM"]
    left = exp(-(high_mm - low_mm) / length)
    start = -(1.0 - left) / (1.0 + left)  # the fixed point of z -> 1 - (1 - z) left there, and alike back
    loading = elastic * (1.0 + facts["MU"] * (1.0 - (1.0 - start) * np.exp(-(x - low_mm) / length)))
    unloading = elastic * (1.0 + facts["MU"] * (-1.0 + (1.0 - start) * np.exp(-(high_mm - x) / length)))
    stored = float(np.trapezoid(loading, x))
    return (stored - float(np.trapezoid(unloading, x))) / stored


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*BOTH, pytest.param("matiec", marks=pytest.mark.long)])
def test_a_campaign_runs_is_evaluated_and_reported(
    kind: str, programs: dict[str, list[Path]], tmp_path: Path
) -> None:
    """What the evaluation finds is what the law of the simulated buffer says, from its constants."""
    if kind == "matiec":
        programs = {kind: [BUILD_PLC[kind](tmp_path / "built")]}
    out = tmp_path / "out"
    with running(kind, programs, tmp_path) as stand:
        done = bufferstand("run", stand.path.parent / "try.toml", "--out", out, *armed("run"))
        assert done.returncode == 0, done.stdout + done.stderr
        with stand.bench() as bench:
            status = bench.controller.status()
            assert status.state in (MotionState.OFF, MotionState.READY)
            assert abs(status.force_kN) < 0.5  # near zero it is 27 kN a mm
    document = json.loads(bufferstand("evaluate", out, "--json", "-").stdout)
    runs = {run["run"]["kind"]: run for run in document["runs"]}
    steady = [cycle for cycle in runs["harmonic"]["cycles"] if cycle["steady"]]
    assert steady
    facts = plant_facts()
    for cycle in steady:
        assert cycle["amplitude_mm"] == pytest.approx(8.0, rel=0.01)
        assert cycle["frequency_Hz"] == pytest.approx(2.5, rel=0.002)
        expected = damping_of(facts, cycle["stroke_min_mm"], cycle["stroke_max_mm"])
        assert cycle["damping"] == pytest.approx(expected, rel=0.01)
    (static,) = (cycle for cycle in runs["static"]["cycles"] if cycle["complete"])
    assert static["damping"] == pytest.approx(damping_of(facts, 0.0, static["stroke_max_mm"]), rel=0.01)
    assert runs["static"]["extremes"]["stroke_max_mm"]["value"] == pytest.approx(15.0, abs=0.3)
    reported = bufferstand("report", out, "--out", tmp_path / "report")
    assert reported.returncode == 0, reported.stdout + reported.stderr
    assert list((tmp_path / "report").glob("*.pdf"))


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOTH)
def test_a_killed_campaign_is_released_by_the_controller_and_resumed(
    kind: str, programs: dict[str, list[Path]], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    with running(kind, programs, tmp_path) as stand, stand.bench() as bench:
        campaign_file = stand.path.parent / "try.toml"
        text = campaign_file.read_text(encoding="utf-8")
        campaign_file.write_text(text.replace("cycles = 6", "cycles = 30"), encoding="utf-8")
        words = command("run", campaign_file, "--out", out, *armed("run"))
        with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as campaign:
            seen = bench.controller.status
            while not ((now := seen()).state is MotionState.WAVEFORM and now.cycles_done >= 2):
                assert campaign.poll() is None, campaign.communicate()[0]
                bench.clock.sleep(0.05)
            campaign.send_signal(signal.SIGKILL)
            campaign.communicate()
        trips = seen().watchdog_trips
        end_s = bench.clock.now_s() + 30.0
        while (status := seen()).state is not MotionState.FAULT:
            assert bench.clock.now_s() < end_s, status
            bench.clock.sleep(0.05)
        assert (status.fault_code, status.watchdog_trips) == (1, trips + 1)
        assert status.end_reason is EndReason.WATCHDOG
        assert abs(status.force_kN) < 0.5
        done = bufferstand("resume", out, *armed("resume"))
        assert done.returncode == 0, done.stdout + done.stderr
    assert sum("-harmonic-" in path.name for path in (out / "runs").glob("*.h5")) == 2


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOTH)
def test_limits_of_the_device_take_the_force_away_and_the_fault_can_be_reset(
    kind: str, programs: dict[str, list[Path]], tmp_path: Path
) -> None:
    cases = {2: ("force_limit", 10.0), 3: ("stroke_limit", 5.0)}  # below what it stands at
    with running(kind, programs, tmp_path) as stand, stand.bench() as bench:
        panel = cast(RingController, bench.controller)._panel
        for fault, (name, narrow) in cases.items():
            bench.enable()
            bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=20.0)))
            panel.link.write(panel.profile.find(name).address, panel.profile.encode(name, narrow), name)
            status = bench.until(lambda seen: seen.state is MotionState.FAULT)
            assert status.fault_code == fault
            assert abs(status.force_kN) < 0.5  # near zero it is 27 kN a mm
            assert status.position_mm == pytest.approx(0.0, abs=0.1)
            bench.controller.reset_fault()
            assert bench.controller.status().fault_code == 0
        with pytest.raises(DeviceFault):  # more than the machine can
            bench.controller.enable(force_limit_kN=631.0, stroke_limit_mm=20.0, watchdog_ms=5000)
        bench.rest()


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOTH)
def test_off_is_off_amid_a_sine(kind: str, programs: dict[str, list[Path]], tmp_path: Path) -> None:
    with running(kind, programs, tmp_path) as stand, stand.bench() as bench:
        bench.enable()
        bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=20.0)))
        sine = Harmonic(mean_mm=10.0, amplitude_mm=4.0, frequency_Hz=1.0, cycles=9)
        number = bench.controller.start(sine)
        bench.until(lambda status: status.cycles_done >= 1)
        bench.controller.disable()
        status = bench.controller.status()
        assert status.state in (MotionState.OFF, MotionState.READY)
        assert (status.done_sequence, status.end_reason) == (number, EndReason.COMMANDED)
        bench.finish()
        bench.blocks.clear()
        begin_s = bench.clock.now_s()
        bench.until(lambda _: bench.clock.now_s() > begin_s + 0.5)
        position = bench.values("position")  # a closed valve leaks a little, and that is all
        assert np.all(np.diff(position) <= 0.02)
        assert np.ptp(position) < 2.0
        bench.rest()


class Lossy(Noise):
    """Loses, delays and doubles frames, but alters none: a network's own checksums see to that."""

    def disturb(self, frame: bytes) -> list[tuple[float, bytes]]:
        with self._lock:
            if self._random.random() >= self._share:
                return [(0.0, frame)]
            kind = self._random.choice(("drop", "delay", "double"))
            self.done[kind] += 1
        late = [(0.5 * self._delay_s + self._delay_s * self._random.random(), frame)]
        return {"drop": [], "delay": late, "double": [(0.0, frame), (0.0, frame)]}[kind]


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOTH)
def test_a_lossy_wire_costs_no_sample_and_no_cycle(
    kind: str, programs: dict[str, list[Path]], tmp_path: Path
) -> None:
    with running(kind, programs, tmp_path) as stand:
        text = stand.path.read_text(encoding="utf-8")
        port = int(re.findall(r"^port = (\d+)$", text, re.MULTILINE)[0])
        noise = Lossy(seed=21, share=0.0, delay_s=0.4)
        with noisy_tcp(port, noise) as between:
            path = stand.path.with_name("lossy.toml")
            path.write_text(text.replace(f"port = {port}", f"port = {between}"), encoding="utf-8")
            with stand.bench(path) as bench:
                bench.enable()
                bench.done(bench.controller.start(RampTo(target_mm=10.0, speed_mm_per_s=20.0)))
                bench.finish()
                bench.blocks.clear()
                sine = Harmonic(mean_mm=10.0, amplitude_mm=4.0, frequency_Hz=2.0, cycles=12)
                number = bench.controller.start(sine)
                noise._share = 0.01
                status = bench.controller.status()
                while status.done_sequence != number:
                    for ask in (bench.feed, bench.drain):
                        try:
                            ask()
                            status = bench.controller.status()
                        except WireLost:  # twice in a row: whoever runs the campaign asks again
                            continue
                noise._share = 0.0
                assert (status.end_reason, status.cycles_done) == (EndReason.REACHED, 12)
                bench.finish()
                assert sum(block.lost for block in bench.blocks) == 0
                numbers = [block.first_sequence + np.arange(len(block.time_us)) for block in bench.blocks]
                assert np.all(np.diff(np.concatenate(numbers)) == 1)
                position = bench.values("position")
                assert np.max(position) == pytest.approx(14.0, abs=0.2)
                assert np.min(position) == pytest.approx(6.0, abs=0.2)
                bench.rest()
        assert min(noise.done[kind] for kind in ("drop", "delay", "double")) > 0, noise.done


@pytest.mark.slow
@pytest.mark.parametrize(
    "words", [["--port", "x"], ["--port", "70000"], ["--unit", "-1"], ["--porrt", "1"], ["more"]]
)
def test_mistyped_words_end_in_one_message(words: list[str], programs: dict[str, list[Path]]) -> None:
    done = subprocess.run([programs["C"][0], *words], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert any(word.lstrip("-") in done.stderr for word in words)
