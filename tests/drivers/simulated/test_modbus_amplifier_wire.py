"""The stand's amplifier with registers: served over TCP and RTU, its faults as the driver tells them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.drivers.register_maps.amplifier_map import SHIPPED_MAPS, load_amplifier_map
from bufferstand.drivers.simulated.faults.control import ask
from bufferstand.drivers.simulated.faults.schedule import parse_fault
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.drivers.simulated.serving.process import SimulatedStandProcess, start_process
from bufferstand.drivers.simulated.serving.server import ServerOptions, serve
from bufferstand.drivers.simulated.wires.modbus_amplifier import AmplifierBank
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.drivers.stand_file.schema import StandFile, with_endpoints
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput
from tests.contract.stand.backends import GSV2, MODBUS_RTU, MODBUS_TCP, write_stand
from tests.drivers.amplifiers import Collector, for_16_bits, until

RATE_HZ = 100.0
WIRES = {"TCP": MODBUS_TCP, "RTU": MODBUS_RTU}


@pytest.fixture(scope="module", params=WIRES)
def served(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[SimulatedStandProcess, StandFile]]:
    folder = tmp_path_factory.mktemp("stand")
    path = write_stand(folder, ((GSV2, WIRES[request.param]),))
    with start_process(path, directory=folder / "run") as process:
        yield process, with_endpoints(load_stand(path), process.served.endpoints())


@pytest.fixture
def got(served: tuple[SimulatedStandProcess, StandFile]) -> Iterator[Collector]:
    sensor = build_sensors(served[1], WallClock())[0]
    assert sensor is not None
    sensor.start()
    yield Collector(sensor)
    sensor.close()


def test_force_comes_by_the_map_with_no_value_twice(got: Collector) -> None:
    until(lambda: len(got.take().blocks) >= 30)
    # On a loaded machine the served amplifier is a reply late now and then; nothing else is said.
    assert all(re.search(r"no reply within 0\.2 s|opened again", words) for words in got.said)
    (channel,) = got.sensor.facts.channels
    raw = np.concatenate([block.counts["force_2"] for block in got.blocks])
    assert raw.dtype == np.float32
    assert abs(float(np.mean(channel.calibration.apply(raw)))) < 2.0  # nothing on the transducer
    assert np.any(raw != np.rint(raw))  # a float that is not rounded to counts
    stamps = np.concatenate([block.time_us for block in got.blocks])
    assert np.all(np.diff(stamps) > 0)


@pytest.mark.dose(4)
@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ("amplifier=overload", "its input is overloaded; look at load, transducer cable and range"),
        ("amplifier=silent", "no reply within 0.2 s, twice; look at the "),
        ("amplifier=drop,share=0.5", "no reply within 0.2 s; connection closed, sent once more"),
        ("amplifier=corrupt,share=0.5", "no reply within|instead of|cannot be decoded|its value is nan"),
        ("amplifier=delay,delay_s=0.5", "no reply within 0.2 s"),
    ],
)
def test_each_fault_has_its_words(
    served: tuple[SimulatedStandProcess, StandFile], got: Collector, fault: str, expected: str
) -> None:
    socket = Path(served[0].served.faults_socket or "")
    until(lambda: bool(got.take().blocks))
    ask(socket, {"add": fault})
    try:
        until(lambda: any(re.search(expected, text) for text in got.take().said))
    finally:
        ask(socket, {"clear": None})
    had = len(got.blocks)
    until(lambda: len(got.take().blocks) > had + 5)  # it goes on by itself


def test_a_loss_of_spacing_is_no_fault_of_registers(
    served: tuple[SimulatedStandProcess, StandFile],
) -> None:
    with pytest.raises(BadInput, match=r"sends no stream whose spacing could be lost; use drop, delay"):
        ask(Path(served[0].served.faults_socket or ""), {"add": "amplifier=resync"})


def test_another_machine_is_refused(tmp_path: Path) -> None:
    far = MODBUS_TCP.replace("127.0.0.1", "192.0.2.1")
    path = write_stand(tmp_path, ((GSV2, far),))
    with pytest.raises(BadInput, match=r"serves this machine only, not 192\.0\.2\.1") as caught:
        serve(path, ServerOptions(port=0, wires=tmp_path / "wires"), ready=lambda _: None, signals=())
    assert caught.value.place == "amplifier.modbus.host"


class TestInProcess:
    """The same amplifier without a wire: form and rate are those that its driver would give."""

    def drained(
        self, folder: Path, change: str, *faults: str, int16: bool = False
    ) -> tuple[list[SampleBlock], list[str]]:
        path = write_stand(folder, ((GSV2, change),))
        if int16:
            path.write_text(for_16_bits(path.read_text(encoding="utf-8")), encoding="utf-8")
        file = load_stand(path)
        made = open_in_process(file, faults=[parse_fault(text) for text in faults])
        sensor = made.stand.sensors[0]
        sensor.start()
        blocks: list[SampleBlock] = []
        said: list[str] = []
        for _ in range(50):
            made.clock.sleep(0.02)
            for item in sensor.drain():
                if isinstance(item, SampleBlock):
                    blocks.append(item)
                else:
                    said.append(item.what)
        made.stand.close()
        return blocks, said

    def test_it_comes_at_the_rate_that_is_asked_for(self, tmp_path: Path) -> None:
        blocks, said = self.drained(tmp_path, MODBUS_TCP)
        stamps = np.concatenate([block.time_us for block in blocks])
        assert abs(len(stamps) - RATE_HZ) <= 3  # of one second
        np.testing.assert_allclose(np.diff(stamps), 1e6 / RATE_HZ, atol=1)
        assert blocks[0].counts["force_2"].dtype == np.float32
        assert said == []

    @pytest.mark.parametrize(("kind", "dtype"), [("i16", np.int16), ("i32", np.int32), ("f32", np.float32)])
    def test_an_overload_is_an_end_of_its_own_numbers(self, tmp_path: Path, kind: str, dtype: type) -> None:
        text = (SHIPPED_MAPS / "dms-float.toml").read_text(encoding="utf-8")
        old = 'address = 0              # 0-based wire address: 30001 of many manuals is 0\ntype = "f32"'
        assert old in text
        (tmp_path / "mine.toml").write_text(
            text.replace(old, f'address = 0\ntype = "{kind}"'), encoding="utf-8"
        )
        change = MODBUS_TCP.replace("dms-float", "mine.toml")
        blocks, said = self.drained(tmp_path, change, "amplifier=overload@0.5", int16=kind == "i16")
        assert blocks[0].counts["force_2"].dtype == dtype
        assert any("an end of its converter" in text for text in said)


def test_a_bank_counts_its_measurements_and_wraps() -> None:
    bank = AmplifierBank(load_amplifier_map("dms-float", Path()), 400.0)
    bank.measure(1.5, 2, times=0x10000 - 1)  # one was made at first
    assert bank.read_packed(0, 4, "input") == bytes.fromhex("3fc0 0000 0002 0000")
    assert bank.write(0, [1]) != 0
    assert bank.is_harmless(0, 1)
    assert bank.readable["holding"] == frozenset()
