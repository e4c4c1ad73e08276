"""Faults of the simulated stand: how they are written down, when they strike, and what they do in process."""

from __future__ import annotations

import json
import socket
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.drivers.simulated.faults.control import ask
from bufferstand.drivers.simulated.faults.file import load_faults
from bufferstand.drivers.simulated.faults.frames import FrameFaults
from bufferstand.drivers.simulated.faults.schedule import (
    FAULTS,
    FRAME_KINDS,
    FaultSchedule,
    ScheduledFault,
    parse_fault,
)
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.drivers.conftest import SAMPLE_STAND

FILE = """
seed = 7
[[fault]]
target = "controller"
kind = "drop"
at_s = 30.0
for_s = 10.0
share = 0.05
every_s = 60.0
times = 3
[[fault]]
target = "stroke_1"
kind = "broken"
at_sample = 1500
for_samples = 500
side = "high"
"""


def opened(*faults: str, seed: int = 0) -> InProcessStand:
    stand = open_in_process(load_stand(SAMPLE_STAND), faults=[parse_fault(text) for text in faults])
    stand.device.faults.random.seed(seed)
    return stand


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("controler=lost@1", "there is no “controler” that could fail; did you mean “controller”?"),
        ("temperature_1=cr@1", "temperature_1 has no fault “cr”; did you mean “crc”?"),
        ("controller=drop@1,shar=1", "it has no parameter “shar”; did you mean “share”?"),
        ("controller=drop@1,share=2", "share = 2 is not possible"),
        ("controller=drop@1,share=much", "share = “much” is not possible; write a number"),
        ("controller=trip@1,code=9", "code = 9 is not known; write 1 (watchdog), 2 (force limit)"),
        ("controller=lost@5:5", "a fault from 5 s to 5 s is none"),
        ("stroke_1=broken@1,side=left", "side = “left” is not known; write “low” or “high”"),
        ("lost", "write TARGET=KIND@START"),
    ],
)
def test_what_is_no_fault_is_refused_with_the_nearest(text: str, problem: str) -> None:
    with pytest.raises(BadInput) as refused:
        parse_fault(text)
    assert problem in str(refused.value)


def test_every_fault_can_be_written_and_read_back() -> None:
    targets = {"channel": "stroke_1", "temperature": "temperature_2"}
    for kind_of, kinds in FAULTS.items():
        for kind, settings in kinds.items():
            fault = ScheduledFault(targets.get(kind_of, kind_of), kind, 2.5, 9.0, dict(settings))
            assert parse_fault(str(fault)) == fault


def test_a_file_of_faults(tmp_path: Path) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(FILE, encoding="utf-8")
    faults, seed = load_faults(path)
    assert seed == 7
    assert [(fault.start_s, fault.end_s) for fault in faults] == [
        (30.0, 40.0), (90.0, 100.0), (150.0, 160.0), (1.5, 2.0),
    ]  # fmt: skip
    assert faults[0].number("share") == 0.05
    assert faults[3].name("side") == "high"


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            'kind = "drop"',
            'kind = "dorp"',
            "[[fault]] 1 (fault controller=dorp): controller has no fault “dorp”",
        ),
        ("at_sample = 1500", "at_sample = 1500\nat_s = 2.0", "either in seconds (at_s, for_s) or in samples"),
        ("times = 3", "", "every_s and times belong together"),
        ('side = "high"', 'sid = "high"', "sid"),
    ],
)
def test_a_file_that_is_wrong_is_refused_with_the_place(
    tmp_path: Path, old: str, new: str, problem: str
) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(FILE.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load_faults(path)
    assert problem in str(refused.value)
    assert str(path) in str(refused.value)


def test_frames_are_struck_by_their_share_and_by_the_seed() -> None:
    def struck(seed: int) -> list[int]:
        schedule = FaultSchedule([parse_fault("controller=drop@0,share=0.05")], seed)
        trouble = FrameFaults(schedule, "controller", lambda: 1.0)
        return [number for number in range(4000) if not trouble.arrivals(b"frame")]

    assert struck(1) == struck(1) != struck(2)
    assert 150 <= len(struck(1)) <= 250  # 200 ± 3.6 standard deviations


def test_what_arrives_of_a_frame() -> None:
    now = [0.0]

    def arrivals(kind: str, frames: Sequence[bytes]) -> list[tuple[float, bytes]]:
        schedule = FaultSchedule([parse_fault(f"controller={kind}@0:10")])
        trouble = FrameFaults(schedule, "controller", lambda: now[0])
        return [one for frame in frames for one in trouble.arrivals(frame)]

    assert arrivals("drop", [b"one", b"two"]) == []
    assert arrivals("delay", [b"one"]) == [(1.0, b"one")]
    assert arrivals("duplicate", [b"one"]) == [(0.0, b"one")] * 2
    assert arrivals("reorder", [b"one", b"two", b"three"]) == [(0.0, b"one"), (0.0, b"two")]
    ((_, altered),) = arrivals("corrupt", [b"frame of bytes"])
    assert len(altered) == 14
    assert 1 <= sum(a != b for a, b in zip(altered, b"frame of bytes", strict=True)) <= 5
    now[0] = 11.0
    for kind in FRAME_KINDS:
        assert arrivals(kind, [b"one"]) == [(0.0, b"one")]


def test_requests_are_lost_or_altered_on_their_way() -> None:
    def heard(fault: str) -> bytes | None:
        schedule = FaultSchedule([parse_fault(fault)], 3)
        return FrameFaults(schedule, "controller", lambda: 0.0).heard(b"request of bytes")

    assert heard("controller=request-drop@0") is None
    altered = heard("controller=request-corrupt@0") or b""
    assert 1 <= sum(a != b for a, b in zip(altered, b"request of bytes", strict=True)) <= 5
    for other in ("controller=drop@0", "controller=request-drop@1", "controller=request-corrupt@0,share=0"):
        assert heard(other) == b"request of bytes"


def test_a_fault_begins_and_ends_at_its_sample(tmp_path: Path) -> None:
    del tmp_path
    stand = opened("stroke_1=broken@1.5:2.0,side=high")
    stand.stand.controller.connect()
    stand.clock.sleep(3.0)
    _, columns = stand.device.ring.window(0, 3000)
    broken = np.flatnonzero(columns["stroke_1"] == 65535)
    assert (broken[0], broken[-1], broken.size) == (1500, 1999, 500)
    assert not np.any(columns["stroke_2"] == 65535)


def test_a_clock_that_jumps_and_a_ring_that_forgets() -> None:
    stand = opened("controller=overrun@1.0")
    controller = stand.stand.controller
    controller.connect()
    stand.clock.sleep(0.1)
    before = controller.read_block()
    assert before is not None
    stand.clock.sleep(1.9)
    block = controller.read_block()
    assert block is not None
    assert block.first_sequence == pytest.approx(1000, abs=50)
    assert block.lost == block.first_sequence - len(before.time_us)
    assert "samples lost before sequence" in controller.events()[0]
    jump = opened("controller=clock-jump@1.0,jump_s=3")
    controller = jump.stand.controller
    controller.connect()
    jump.clock.sleep(0.9)
    while (block := controller.read_block()) is not None and block.more:
        pass
    jump.clock.sleep(0.5)
    with pytest.raises(DeviceFault, match=r"cannot be true: the ticks? steps? by .*3001000"):
        controller.read_block()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("controller=lost@1", "no reply within 0.5 s, twice"),
        ("controller=drop@1", ", twice"),
        ("controller=corrupt@1", ", twice"),
        ("controller=delay@1,delay_s=9", ", twice"),
        ("controller=exception@1,code=6", "refused with Modbus exception 6 (device busy)"),
        ("controller=nan@1", "register force of the controller holds nan, which is no number"),
    ],
)
def test_the_controller_in_process_says_it(fault: str, told: str) -> None:
    stand = opened(fault)
    controller = stand.stand.controller
    stand.clock.sleep(1.1)
    said = ""
    try:
        controller.status()
    except DeviceFault as error:
        said = str(error)
    assert told in said + " ".join(controller.events())


def test_the_controller_in_process_asks_again() -> None:
    stand = opened("controller=drop@0,share=0.2", seed=3)
    controller = stand.stand.controller
    said = []
    for _ in range(20):
        try:
            controller.status()
        except DeviceFault as fault:
            said.append(str(fault))
    events = controller.events()
    assert any("sent once more on a new connection" in event for event in events)
    assert sum("given up" in event for event in events) == len(said)


def test_a_controller_that_trips_and_one_whose_watchdog_runs_out() -> None:
    for fault, code in (
        ("controller=trip@1", 4),
        ("controller=trip@1,code=2", 2),
        ("controller=watchdog@1", 1),
    ):
        stand = opened(fault)
        controller = stand.stand.controller
        controller.enable(force_limit_kN=100.0, stroke_limit_mm=50.0, watchdog_ms=60_000)
        stand.clock.sleep(0.9)
        assert controller.status().fault_code == 0
        stand.clock.sleep(1.0)
        status = controller.status()
        assert status.fault_code == code
        assert status.watchdog_trips == (code == 1)


@pytest.mark.slow
def test_registers_stand_still_and_go_on() -> None:
    stand = opened("controller=stuck@1:2")
    controller = stand.stand.controller
    seen = []
    for _ in range(6):
        seen.append(controller.status().heartbeat)
        stand.clock.sleep(0.5)
    assert seen[2] == seen[3]
    assert len(set(seen)) == 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ("amplifier=silent@1", "silent; look at cable, power and port"),
        ("amplifier=overload@1", "an end of its converter"),
        ("amplifier=resync@1", "the spacing of its frames was lost (count since the start: 1)"),
        *(
            (f"temperature_1={kind}@1", "look")
            for kind in FAULTS["temperature"]
            if kind not in {"frozen", "stale"}
        ),
    ],
)
def test_the_sensors_in_process_say_it(fault: str, told: str) -> None:
    stand = opened(fault)
    target = fault.partition("=")[0]
    sensor = next(one for one in stand.stand.sensors if one.facts.name == target)
    sensor.start()
    stand.clock.sleep(0.9)
    assert not [item for item in sensor.drain() if isinstance(item, SensorFault)]
    stand.clock.sleep(2.0)
    assert told in " ".join(item.what for item in sensor.drain() if isinstance(item, SensorFault))


@pytest.mark.slow
def test_a_stale_sensor_gives_nothing_and_a_frozen_one_the_same() -> None:
    stand = opened("temperature_1=stale@2", "temperature_2=frozen@2")
    stale, frozen = stand.stand.sensors[1:3]
    stand.clock.sleep(10.0)
    assert len(stale.drain()) == 1
    counts = [int(b.counts["temperature_2"][0]) for b in frozen.drain() if isinstance(b, SampleBlock)]
    assert len(counts) == 10
    assert len(set(counts[1:])) == 1


@pytest.mark.slow
def test_lost_frames_of_the_amplifier_are_counted() -> None:
    stand = opened("amplifier=drop@1:2,share=0.5")
    sensor = stand.stand.sensors[0]
    sensor.start()
    total = lost = 0
    for _ in range(60):
        stand.clock.sleep(0.05)
        for block in sensor.drain():
            assert isinstance(block, SampleBlock)
            total += len(block.time_us) + block.lost
            lost += block.lost
    assert 50 < lost < 200
    assert total == pytest.approx(750, abs=15)


@pytest.mark.slow
def test_faults_that_this_stand_cannot_have_are_refused() -> None:
    with pytest.raises(BadInput, match="the stand has no temperature_9; did you mean"):
        opened("temperature_9=crc@1")


@pytest.mark.slow
def test_the_socket_of_a_served_stand(tmp_path: Path) -> None:
    path = tmp_path / "stand.toml"
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    path.write_text(text.replace("models/", f"{SAMPLE_STAND.parent}/models/", 1), encoding="utf-8")
    schedule = tmp_path / "faults.toml"
    schedule.write_text('[[fault]]\ntarget = "amplifier"\nkind = "silent"\nat_s = 500.0\n', encoding="utf-8")
    deep = tmp_path / ("a" * 60) / ("b" * 60)  # longer than an address of a socket can be
    with start_process(path, directory=deep, fault_file=schedule) as process:
        at = Path(process.served.faults_socket or "")
        assert ask(at, {"add": "temperature_1=crc", "for_s": 30}).endswith(":" + ask_end(at))
        assert "to come amplifier=silent@500" in ask(at, {"list": True})
        assert "on      temperature_1=crc@" in ask(at, {"list": True})
        assert ask(at, {"clear": "temperature_1"}) == "1 fault taken away"
        for wrong, told in (
            ({"add": "temperature_1=crk"}, "did you mean “crc”?"),
            ({"add": "temperature_9=crc"}, "the stand has no temperature_9"),
            ({"add": "controller=stuck,register=hartbeat"}, "did you mean “heartbeat”?"),
            ({"add": "controller=nan,register=state"}, "no register “state” can be nan"),
            ({"do": "nothing"}, "add, clear or list is missing"),
        ):
            with pytest.raises(BadInput) as refused:
                ask(at, wrong)
            assert told in str(refused.value)
        assert process.running
    assert not at.exists()
    with pytest.raises(BadInput, match="no simulated stand takes faults here"):
        ask(at, {"list": True})


def ask_end(at: Path) -> str:
    """Return the end of the one fault that lasts for a time."""
    line = next(one for one in ask(at, {"list": True}).splitlines() if "crc@" in one)
    return line.rpartition(":")[2]


@pytest.mark.slow
def test_a_request_that_is_none_does_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "stand.toml"
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    path.write_text(text.replace("models/", f"{SAMPLE_STAND.parent}/models/", 1), encoding="utf-8")
    with start_process(path, directory=tmp_path / "r") as process:
        at = process.served.faults_socket or ""
        for line in (b"\n", b"[]\n", b"{}\n", b"\xff\xfe\n", b'{"add": 3}\n', b'{"clear": "pump"}\n'):
            with socket.socket(socket.AF_UNIX) as wire:
                wire.settimeout(5.0)
                wire.connect(at)
                wire.sendall(line)
                reply = json.loads(wire.makefile("rb").readline())
            assert reply["ok"] is False
        assert ask(Path(at), {"list": True}).startswith("stand time")
