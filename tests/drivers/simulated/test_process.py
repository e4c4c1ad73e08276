"""The stand as a process, over every wire with the real drivers; how it begins and ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.connect import open_stand
from bufferstand.drivers.interfaces import EndReason, SampleBlock, Stand
from bufferstand.drivers.simulated.machine.truth import read_truth
from bufferstand.drivers.simulated.serving.process import SimulatedStandProcess, start_process
from bufferstand.drivers.simulated.serving.server import ServerOptions, serve
from bufferstand.drivers.stand_file.schema import with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.motions import Harmonic, RampTo, Release
from tests.drivers.simulated.standing import STAND, stand_file

MODEL = Path(__file__).parents[3] / "sample_runs/models/category-a-elastomer.toml"
PATIENCE_S = 60.0


def started(folder: Path, **options: object) -> SimulatedStandProcess:
    file = stand_file(folder)
    return start_process(file.path, directory=folder / "run", model=MODEL, **options)  # type: ignore[arg-type]


def until(done: Callable[[], bool]) -> None:
    """Wait without caring how long it takes, within reason."""
    end_s = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < end_s, "it did not happen"
        time.sleep(0.01)


def opened(running: SimulatedStandProcess, folder: Path) -> Stand:
    file = with_endpoints(stand_file(folder), running.served.endpoints())
    return open_stand(file, WallClock(running.served.speed))


def test_a_run_over_real_wires_matches_the_truth(tmp_path: Path) -> None:
    """Drivers, TCP, pty, files: every sample comes, and the loop's area is the work really done."""
    truth_path = tmp_path / "truth.npz"
    blocks: list[SampleBlock] = []
    sensed: dict[str, int] = {}
    with started(tmp_path, speed=4.0, truth=truth_path) as running:
        stand = opened(running, tmp_path)
        controller = stand.controller
        full = stand_file(tmp_path).profile().ring.samples_per_block

        def drained() -> bool:
            controller.feed_watchdog()
            for _ in range(50):
                if (block := controller.read_block()) is None:
                    return True
                blocks.append(block)
                if block.time_us.size < full:  # where a round trip takes long there is always one more
                    return True
            return False

        def turn() -> int:
            drained()
            for sensor in stand.sensors:
                for item in sensor.drain():
                    if isinstance(item, SampleBlock):
                        sensed[item.stream] = sensed.get(item.stream, 0) + item.time_us.size
            return controller.status().done_sequence

        controller.enable(force_limit_kN=600.0, stroke_limit_mm=105.0, watchdog_ms=60_000)
        for start in (
            lambda: controller.start(RampTo(target_mm=40.0, speed_mm_per_s=100.0)),
            lambda: controller.start(Harmonic(mean_mm=40.0, amplitude_mm=20.0, frequency_Hz=2.0, cycles=4)),
            lambda: controller.start(Release(speed_mm_per_s=100.0)),
        ):
            sequence = start()
            until(lambda wanted=sequence: turn() == wanted)  # type: ignore[misc]
            assert controller.status().end_reason is EndReason.REACHED
        until(lambda: turn() > 0 and len(sensed) == 3)
        until(drained)  # on a busy machine the reader is behind the stand
        status = controller.status()
        controller.disable()
        facts = controller.facts
        stand.close()
        assert running.stop() == 0
    sequence_numbers = np.concatenate([b.first_sequence + np.arange(b.time_us.size) for b in blocks])
    assert sequence_numbers.tolist() == list(range(sequence_numbers.size))
    time_us = np.concatenate([b.time_us for b in blocks])
    assert set(np.diff(time_us)) == {1000}  # as many samples as device time says, at whatever speed
    truth = read_truth(truth_path)
    assert truth["sequence"].size >= sequence_numbers.size
    assert truth["time_us"][: time_us.size].tolist() == time_us.tolist()
    assert status.heartbeat <= truth["sequence"].size // 10
    channels = {c.name: c for c in facts.channels}
    values = {
        n: c.calibration.apply(np.concatenate([b.counts[n] for b in blocks])) for n, c in channels.items()
    }
    time_s = time_us / 1e6
    force = np.interp(time_s, time_s - channels["force"].delay_s, values["force"])
    stroke = 0.5 * (values["stroke_1"] + values["stroke_2"])
    deep = np.flatnonzero(truth["stroke_mm"] > 1.0)
    window = slice(int(deep[0]) - 200, int(deep[-1]) + 200)  # from zero force to zero force
    measured_J = np.sum(0.5 * (force[window][1:] + force[window][:-1]) * np.diff(stroke[window]))
    true_J = truth["work_J"][window][-1] - truth["work_J"][window][0]
    assert measured_J == pytest.approx(true_J, rel=5e-3)
    assert truth["heat_J"][-1] == pytest.approx(truth["work_J"][-1], rel=0.02)  # all of it has become heat
    assert set(sensed) == {"amplifier", "temperature_1", "temperature_2"}


def test_a_stand_that_waits_takes_a_hold_in_one_request_while_nobody_reads(tmp_path: Path) -> None:
    """Switching on reads no samples, so the stand makes none meanwhile: a hold at rest must not need one."""
    with started(tmp_path, speed=50.0) as running:
        stand = opened(running, tmp_path)
        controller = stand.controller
        ticks = [0, 1]

        def waits() -> bool:
            ticks.append(controller.status().tick_us or 0)
            return ticks[-1] == ticks[-2]

        controller.skip_backlog()
        while (block := controller.read_block()) is not None and block.more:
            pass
        until(waits)
        controller.enable(force_limit_kN=600.0, stroke_limit_mm=105.0, watchdog_ms=60_000)
        assert controller.stops_at_once
        assert not [text for text in controller.events() if "in one request" in text]
        controller.disable()
        stand.close()


def test_it_says_where_it_is_and_leaves_nothing_behind(tmp_path: Path) -> None:
    running = started(tmp_path)
    served = running.served
    assert json.loads((tmp_path / "run/endpoints.json").read_text(encoding="utf-8")) == {
        "host": "127.0.0.1",
        "port": served.port,
        "w1_root": str(tmp_path / "run/wires/w1/devices"),
        "speed": 1.0,
        "pid": running.pid,
        "controller_serial": None,
        "onewire_port": None,
        "faults_socket": str(tmp_path / "run/wires/faults"),
        "instruments": {
            "amplifier": str(tmp_path / "run/wires/amplifier"),
            "thermometers": str(tmp_path / "run/wires/w1/devices"),
        },
        "time_file": str(tmp_path / "run/wires/time"),
        "acquisition": {},
    }
    assert Path(str(served.instruments["amplifier"])).is_symlink()
    assert (Path(served.w1_root or "") / "28-00000a3f91c2/w1_slave").is_file()
    assert running.stop() == 0
    assert not Path(str(served.instruments["amplifier"])).is_symlink()
    assert not Path(served.w1_root or "").exists()
    assert running.log.read_text(encoding="utf-8") == ""


def test_it_ends_with_whoever_started_it(tmp_path: Path) -> None:
    """The starter is killed: its end of the pipe closes, and the stand goes by itself."""
    file = stand_file(tmp_path)
    script = (
        "import sys, time; from pathlib import Path\n"
        "from bufferstand.drivers.simulated.serving.process import start_process\n"
        "stand = start_process(Path(sys.argv[1]), directory=Path(sys.argv[2]), model=Path(sys.argv[3]))\n"
        "print(stand.pid, flush=True); time.sleep(600)\n"
    )
    root = Path(__file__).parents[3]
    with subprocess.Popen(
        [sys.executable, "-c", script, str(file.path), str(tmp_path / "run"), str(MODEL)],
        stdout=subprocess.PIPE,
        cwd=root,
    ) as starter:
        assert starter.stdout is not None
        pid = int(starter.stdout.readline())
        starter.kill()
    until(lambda: not (tmp_path / "run/wires/amplifier").is_symlink())
    until(lambda: not alive(pid))


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").split()[2] != "Z"
    except FileNotFoundError:
        return False


def test_after_a_kill_it_can_be_started_again(tmp_path: Path) -> None:
    first = started(tmp_path)
    os.kill(first.pid, signal.SIGKILL)
    first.kill()
    assert (tmp_path / "run/wires/amplifier").is_symlink()
    with started(tmp_path) as second:
        stand = opened(second, tmp_path)
        assert stand.controller.connect().sample_rate_Hz == 1000.0
        stand.close()


def test_what_it_refuses_is_said_by_its_starter(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no fault that can be simulated"):
        started(tmp_path, faults=["pump=lost@1"])


def refused(path: Path, options: ServerOptions) -> str:
    with pytest.raises(BadInput) as caught:
        serve(path, options, ready=lambda served: pytest.fail(f"it serves: {served}"), signals=())
    return str(caught.value)


def test_it_serves_this_machine_only(tmp_path: Path) -> None:
    path = stand_file(tmp_path, STAND.replace('host = "127.0.0.1"', 'host = "0.0.0.0"')).path
    assert "this machine only" in refused(path, ServerOptions(model=MODEL, port=0))
    assert not (tmp_path / "wires/amplifier").is_symlink()  # opened before it was refused, and taken away


def test_a_speed_that_cannot_be_is_refused(tmp_path: Path) -> None:
    assert "speed of -1" in refused(stand_file(tmp_path).path, ServerOptions(model=MODEL, speed=-1.0))


def test_a_stand_without_a_model_is_refused(tmp_path: Path) -> None:
    path = stand_file(tmp_path, STAND.replace('model = "spring.toml"', "")).path
    assert "simulation.model: no spring model is named" in refused(path, ServerOptions())
