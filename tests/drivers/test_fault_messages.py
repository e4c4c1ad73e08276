"""Every fault that the simulated stand can show, and the words in which the engineer is told of it.

The faults are given over the socket, as ``bufferstand fault`` does; the drivers talk to a stand in another
process over its real wires. The same table is in docs/simulated-stand.md (compared here).
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from bufferstand.drivers.check.devices import check_devices
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import Controller, Sensor, SensorFault
from bufferstand.drivers.simulated.faults.control import ask
from bufferstand.drivers.simulated.faults.schedule import FAULTS, ONCE, parse_fault, target_class
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import SimulatedStandProcess, start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from bufferstand.foundation.motions import RampTo
from tests.drivers.conftest import SAMPLE_STAND

DOCS = Path(__file__).parents[2] / "docs" / "simulated-stand.md"
PATIENCE_S = 120.0
W1 = 'kind = "w1"\nroot = "wires/w1/devices"\n'
ADAPTER = 'kind = "ds2480b"\nport = "wires/onewire"\n'

# What is told through the driver: as an event on the wire, a fault of the device or of a reading.
BY_DRIVER = {
    "controller=lost": "no reply within 0.15 s, twice; look at the network cable",
    "controller=drop,share=0.4": "no reply within 0.15 s; connection closed, sent once more on a new",
    "controller=delay,delay_s=0.4": "no reply within 0.15 s; connection closed",
    "controller=corrupt,share=0.5": "altered on its way|cannot be decoded|no reply within|instead of",
    "controller=reorder,share=0.5": "no reply within 0.15 s; connection closed",
    "controller=request-drop,share=0.4": "no reply within 0.15 s; connection closed, sent once more on a new",
    "controller=request-corrupt,share=0.5": "answers a request|refused with Modbus|instead of|no reply",
    "controller=exception": "refused with Modbus exception 4 \\(device failure\\); look at the register",
    "controller=exception,code=2": "Modbus exception 2 \\(illegal data address\\); look at the register",
    "controller=nan": "register force of the controller holds nan, which is no number; look at its",
    "controller=clock-jump": "two blocks of samples running cannot be true: the ticks? steps? by .*1[0-9]{6}",
    "controller=overrun": "samples lost before sequence [0-9]+: the ring was read too late",
    "amplifier=silent": "silent for 1.[0-9] s; look at cable, power and port",
    "amplifier=overload": "an end of its converter: the amplifier is saturated or the bridge open",
    "amplifier=resync": "the spacing of its frames was lost .* look at cable, shield and baud rate",
    "amplifier=drop,share=0.5": "values a second come in instead of 250; look at its data rate",
    "amplifier=delay,delay_s=30": "silent for 1.[0-9] s; look at cable, power and port",
    "amplifier=corrupt": "the spacing of its frames was lost .* look at cable, shield and baud rate",
    "amplifier=duplicate": "values a second come in instead of 250; look at its data rate",
    "temperature_1=silent": "empty read \\(bus error or wrong CRC\\); look at cable length, pull-up",
    "temperature_1=crc": "wrong CRC \\(“NO”\\); look at cable length, pull-up and interference",
    "temperature_1=crc-mismatch": "nine bytes do not match their CRC; look at cable and interference",
    "temperature_1=all-zero": "all bytes are zero, .* look for a short circuit of the data line",
    "temperature_1=power-on": "its power-on value 85.0 °C: .* look at its supply wire and loose contacts",
    "temperature_1=no-power": "127.94 °C: too little power for a conversion; look at its supply wire",
    "temperature_1=out-of-range": "its value is outside −55 … 125 °C; look at the sensor",
    "temperature_1=garbled": "does not look like that of a DS18B20; look at the 1-Wire folder",
    "temperature_1=missing": "not on the bus; look at plug and cable, and at the ROM in the stand file",
    "temperature_1=stale": "a read of the 1-Wire bus hangs for [0-9]+ s; look at the bus and the kernel's",
}  # fmt: skip
BY_ADAPTER = {
    "temperature_1=shorted": "the data line is shorted; look at plugs and crushed cables",
    "temperature_1=unfinished": "the conversion did not end in time; look at the supply wire of every sensor",
    "temperature_1=unpowered": "has no supply wire \\(parasite power\\); look at its plug, use three wires",
}
BY_CHECK = {
    "controller=stuck": "it answers but its heartbeat does not count: its control loop stands still",
    "controller=stuck,register=tick": "times as fast as this computer's: look at the unit of register tick",
    "controller=trip": "fault 4 \\(actuator\\)",
    "force=broken": "an end of its converter: the amplifier is saturated or the bridge open",
    "stroke_1=broken": "an end of its converter: a draw wire at its end, or its cable broken; look at",
    "stroke_2=broken,side=high": "the draw wires disagree; look for tilt, a slack or a snagged wire",
    "position=broken": "outside -60 … 250 mm; look at transducer, cable and coefficients",
}
# Told elsewhere, each by the test named.
ELSEWHERE = {
    "controller=duplicate": "test_a_doubled_reply_changes_nothing",
    "controller=watchdog": "test_a_watchdog_that_runs_out",
    "temperature_1=unreadable": "tests/drivers/test_w1_folder.py (rights are no matter of who tests as root)",
    "temperature_1=frozen": "test_a_frozen_value_cannot_be_told",
    "force=stuck": "test_a_stuck_transducer_is_told_by_its_neighbour",
    "acquisition=silent": "tests/two_clocks/test_campaign.py",
}  # fmt: skip


def write_stand(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    limits = 'unit = "mm"\nplausible = { counts = [100.0, 65000.0] }\nplace = "draw wire, left'
    for old, new in (
        ("models/", f"{SAMPLE_STAND.parent}/models/"),
        ("timeout_s = 0.5", "timeout_s = 0.15"),
        ("period_s = 1.0", "period_s = 0.1"),
        ('unit = "mm"\nplace = "draw wire, left', limits),
        ('name = "force"\n', 'name = "force"\nplausible = { counts = [-2000000000.0, 2000000000.0] }\n'),
        *changes,
    ):
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


@dataclass
class Served:
    """A stand in another process, and the file by which to reach it."""

    process: SimulatedStandProcess
    file: StandFile

    def ask(self, **request: object) -> str:
        return ask(Path(self.process.served.faults_socket or ""), request)

    def forget(self) -> None:
        """Let the ring forget what came before: nobody shall have to read it."""
        self.ask(add="controller=overrun")
        time.sleep(0.01)

    @contextmanager
    def fault(self, text: str) -> Iterator[None]:
        self.ask(add=text)
        try:
            yield
        finally:
            self.ask(clear=None)


@contextmanager
def served(folder: Path, *changes: tuple[str, str]) -> Iterator[Served]:
    path = write_stand(folder, *changes)
    with start_process(path, directory=folder / "run") as process:
        yield Served(process, with_endpoints(load_stand(path), process.served.endpoints()))


@pytest.fixture(scope="module")
def stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("stand")) as one:
        yield one


@pytest.fixture(scope="module")
def adapter_stand(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("adapter"), (W1, ADAPTER)) as one:
        yield one


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bufferstand.drivers.amplifiers.host_stamps.RATE_WINDOW_S", 1.0)
    monkeypatch.setattr("bufferstand.drivers.thermometers.bus._LEAST_STALL_S", 1.0)
    monkeypatch.setattr("bufferstand.drivers.thermometers.bus._READ_WORST_S", 0.3)
    monkeypatch.setattr("bufferstand.drivers.check.devices.ANSWER_WAIT_S", 0.5)
    monkeypatch.setattr("bufferstand.drivers.check.hints.UNITS", ())


def until_told(expected: str, listen: Callable[[], list[str]]) -> None:
    end_s = time.monotonic() + PATIENCE_S
    told: list[str] = []
    while not any(re.search(expected, text) for text in told):
        assert time.monotonic() < end_s, f"“{expected}” was not told; told was: {told}"
        told += listen()
        time.sleep(0.005)


def use(controller: Controller) -> list[str]:
    """Do what the acquisition does, once; return what is told."""
    told: list[str] = []
    try:
        controller.status()
        while controller.read_block() is not None:
            pass
    except DeviceFault as fault:
        told.append(str(fault))
    return [*controller.events(), *told]


def begin_reading(controller: Controller) -> None:
    """Read until samples have come: what is lost before the first of them was never missed."""
    end_s = time.monotonic() + PATIENCE_S
    while controller.read_block() is None:
        assert time.monotonic() < end_s
        time.sleep(0.005)


def let_samples_wait(controller: Controller) -> None:
    """Wait until the ring holds samples that have not been read, and can be lost."""
    first = controller.status().heartbeat
    end_s = time.monotonic() + PATIENCE_S
    while (controller.status().heartbeat - first) % 0x10000 < 4:  # 10 ms each
        assert time.monotonic() < end_s
        time.sleep(0.005)


def readings(sensor: Sensor) -> list[str]:
    return [item.what for item in sensor.drain() if isinstance(item, SensorFault)]


def tell_by_driver(stand: Served, fault: str, expected: str) -> None:
    target, _, kind = fault.partition("=")
    clock = WallClock()
    if target == "controller":
        controller = build_controller(stand.file, clock)
        stand.forget()
        try:
            controller.connect()
            begin_reading(controller)
            use(controller)

            def fail_and_use() -> list[str]:
                if kind in ONCE:  # it may come when nothing was there to be spoilt
                    let_samples_wait(controller)
                    stand.ask(add=fault)
                return use(controller)

            with stand.fault(fault):
                until_told(expected, fail_and_use)
        finally:
            controller.close()
        return
    sensors = build_sensors(stand.file, clock)
    sensor = next(one for one in sensors if one.facts.name == target)
    try:
        sensor.start()
        end_s = time.monotonic() + PATIENCE_S
        while not sensor.drain():
            assert time.monotonic() < end_s
            time.sleep(0.01)
        with stand.fault(fault):
            until_told(expected, lambda: readings(sensor))
    finally:
        for one in sensors:
            one.close()


@pytest.mark.dose(10)
@pytest.mark.parametrize(("fault", "expected"), BY_DRIVER.items(), ids=BY_DRIVER)
def test_the_driver_tells(stand: Served, fault: str, expected: str) -> None:
    tell_by_driver(stand, fault, expected)


@pytest.mark.parametrize(("fault", "expected"), BY_ADAPTER.items(), ids=BY_ADAPTER)
def test_the_adapters_driver_tells(adapter_stand: Served, fault: str, expected: str) -> None:
    tell_by_driver(adapter_stand, fault, expected)


@pytest.mark.dose(4)
@pytest.mark.parametrize(("fault", "expected"), BY_CHECK.items(), ids=BY_CHECK)
def test_the_check_tells(stand: Served, fault: str, expected: str) -> None:
    clock = WallClock()

    def check() -> list[str]:
        stand.forget()
        rows = check_devices(stand.file, build_controller(stand.file, clock), (), clock, watch_s=0.4)
        return [row.remark for row in rows if row.remark]

    with stand.fault(fault):
        time.sleep(0.02)
        until_told(expected, check)  # a busy machine may not answer in time at first
    if fault == "controller=trip":
        reset(stand)


def test_every_fault_there_is_has_its_words() -> None:
    told = {*BY_DRIVER, *BY_ADAPTER, *BY_CHECK, *ELSEWHERE}
    known = {(kind_of, kind) for kind_of, kinds in FAULTS.items() for kind in kinds}
    shown = set()
    for text in told:
        target, _, rest = text.partition("=")
        shown.add((target_class(target), rest.partition(",")[0]))
    assert shown == known


def enable(controller: Controller, watchdog_ms: int) -> None:
    """Switch on; a latched fault is taken away by that."""
    controller.enable(force_limit_kN=100.0, stroke_limit_mm=50.0, watchdog_ms=watchdog_ms)


def reset(stand: Served) -> None:
    controller = build_controller(stand.file, WallClock())
    controller.connect()
    enable(controller, 2000)
    controller.disable()
    controller.close()


def test_a_watchdog_that_runs_out(stand: Served) -> None:
    stand.forget()
    controller = build_controller(stand.file, WallClock())
    try:
        controller.connect()
        enable(controller, 30_000)
        with stand.fault("controller=watchdog"):
            until_told("WATCHDOG", lambda: [fault_of(controller)])
        clock = WallClock()
        rows = check_devices(stand.file, build_controller(stand.file, clock), (), clock, watch_s=0.0)
        told = {row.item: row.remark for row in rows}
        assert told["state"].startswith(
            "fault 1 (watchdog: no heartbeat from the computer): look why; the next start"
        )
        assert told["watchdog trips"].startswith("a program that fed it died or lost the link")
        enable(controller, 2000)
        controller.disable()
    finally:
        controller.close()


def fault_of(controller: Controller) -> str:
    return "WATCHDOG" if controller.status().fault_code == 1 else ""


def test_a_doubled_reply_changes_nothing(stand: Served) -> None:
    """Its transaction number is that of a request which has its answer: it is passed over."""
    stand.forget()
    controller = build_controller(stand.file, WallClock())
    try:
        controller.connect()
        use(controller)
        with stand.fault("controller=duplicate"):
            blocks = []
            while len(blocks) < 20:
                controller.status()
                block = controller.read_block()
                blocks += [block] if block is not None else []
        assert all(block.lost == 0 for block in blocks)
        follows = [block.first_sequence + len(block.time_us) for block in blocks]
        assert follows[:-1] == [block.first_sequence for block in blocks[1:]]
    finally:
        controller.close()


def test_a_frozen_value_cannot_be_told(stand: Served) -> None:
    """One reading cannot be told from that of a steady temperature: nothing is said, and docs say so."""
    sensors = build_sensors(stand.file, WallClock())
    try:
        sensors[1].start()
        with stand.fault("temperature_1=frozen"):
            time.sleep(1.0)
            assert readings(sensors[1]) == []
    finally:
        for one in sensors:
            one.close()


def test_a_stuck_transducer_is_told_by_its_neighbour(tmp_path: Path) -> None:
    """In virtual time: the piston moves, one draw wire does not."""
    file = load_stand(write_stand(tmp_path))
    opened = open_in_process(file, faults=[parse_fault("stroke_1=stuck@0.5")])
    controller = opened.stand.controller
    controller.enable(force_limit_kN=300.0, stroke_limit_mm=50.0, watchdog_ms=60_000)
    opened.clock.sleep(1.0)
    controller.start(RampTo(target_mm=15.0, speed_mm_per_s=20.0))
    opened.clock.sleep(1.5)
    controller.disable()  # beside a valve that is on a check does not read the ring
    rows = check_devices(file, controller, (), opened.clock, watch_s=0.5)
    assert any("the draw wires disagree; look for tilt" in row.remark for row in rows)
    opened.stand.close()


def test_the_docs_have_every_fault() -> None:
    text = DOCS.read_text(encoding="utf-8")
    for kinds in FAULTS.values():
        for kind in kinds:
            assert f"`{kind}`" in text or f"`{kind} " in text, kind
