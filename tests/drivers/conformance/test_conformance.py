"""The driver against servers, and the simulated controller against a client, that are not pymodbus."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.controllers.polling_controller import PollingController
from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.interfaces import MotionState, SampleBlock
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import RtuWire, TcpWire, Wire
from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.drivers.simulated.serving.process import start_process
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import CommandRejected, DeviceFault
from bufferstand.foundation.motions import Harmonic, RampTo
from tests.drivers import noisy
from tests.drivers.conformance import peers
from tests.drivers.conftest import SAMPLE_STAND

CHANNELS = load_stand(SAMPLE_STAND).controller.channel
BAUD = "460800"  # enough for 1000 samples/s


@pytest.fixture(scope="module")
def libmodbus_server(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return peers.build_c("libmodbus_server", tmp_path_factory.mktemp("server"))


@pytest.fixture(scope="module")
def libmodbus_client(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return peers.build_c("libmodbus_client", tmp_path_factory.mktemp("client"))


@pytest.fixture(scope="module")
def go_server(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return peers.build_go(tmp_path_factory.mktemp("go"))


@pytest.fixture(params=["TCP", "RTU"])
def libmodbus_wire(request: pytest.FixtureRequest, libmodbus_server: Path, tmp_path: Path) -> Iterator[Wire]:
    """A wire to a fresh libmodbus server; on a line between two pseudo-terminals for RTU."""
    if request.param == "TCP":
        with peers.running(str(libmodbus_server), "tcp", "0") as port:
            yield TcpWire("127.0.0.1", port)
        return
    with (
        noisy.line(tmp_path) as line,
        peers.running(str(libmodbus_server), "rtu", str(line.far), BAUD),
    ):
        yield RtuWire(line.near, baud=int(BAUD))


def ring_at(wire: Wire, profile: Profile) -> RingController:
    link = ModbusLink(wire, timeout_s=10.0)
    return RingController(link, profile, CHANNELS, WallClock(), timeout_s=10.0)


class TestLibmodbusServer:
    def test_samples(self, libmodbus_wire: Wire, profile: Profile) -> None:
        controller = ring_at(libmodbus_wire, profile)
        identity = controller.connect()
        assert (identity.serial, identity.sample_rate_Hz) == ("316", 1000.0)
        blocks: list[SampleBlock] = []
        while sum(len(block.time_us) for block in blocks) < 1000:
            block = controller.read_block()
            assert block is not None
            blocks.append(block)
        sequence = np.arange(sum(len(block.time_us) for block in blocks))
        got = {name: np.concatenate([b.counts[name] for b in blocks]) for name in blocks[0].counts}
        time_us = np.concatenate([block.time_us for block in blocks])
        np.testing.assert_array_equal(time_us, (sequence + 1) * 1000)
        np.testing.assert_array_equal(got["force"], sequence * 7 - 1_000_000)
        np.testing.assert_array_equal(got["stroke_1"], sequence)
        np.testing.assert_array_equal(got["stroke_2"], sequence + 1)
        np.testing.assert_array_equal(got["position"], -sequence)
        np.testing.assert_array_equal(got["command"], sequence)
        assert controller.events() == []
        controller.close()

    def test_commands(self, libmodbus_wire: Wire, profile: Profile) -> None:
        controller = ring_at(libmodbus_wire, profile)
        controller.connect()
        controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=1000)
        assert controller.status().state is MotionState.HOLDING
        number = controller.start(Harmonic(mean_mm=50.0, amplitude_mm=12.5, frequency_Hz=1.25, cycles=12))
        assert controller.status().done_sequence == number
        beats = [controller.status().heartbeat for _ in range(3)]
        assert beats == sorted(set(beats))
        controller.feed_watchdog()
        controller.disable()
        (event,) = controller.events()
        assert event.startswith("controller does not take a command and its execution in one request")
        controller.close()

    def test_an_address_that_is_not_there(self, libmodbus_wire: Wire) -> None:
        link = ModbusLink(libmodbus_wire, timeout_s=10.0)
        with pytest.raises(DeviceFault, match=r"Modbus exception 2 \(illegal data address\)"):
            link.read(600, 2, "nothing")
        assert link.read(0, 1, "type") == [0x4253]
        link.close()


def test_the_go_server_is_polled(go_server: Path) -> None:
    with peers.running(str(go_server), str(peers.free_port())) as port:
        link = ModbusLink(TcpWire("127.0.0.1", port), timeout_s=10.0)
        controller = PollingController(link, load_profile("polling"), CHANNELS, WallClock(), timeout_s=10.0)
        try:
            assert controller.connect().serial == "163"
            controller.enable(force_limit_kN=500.0, stroke_limit_mm=100.0, watchdog_ms=1000)
            number = controller.start(RampTo(target_mm=12.5, speed_mm_per_s=5.0))
            assert controller.status().done_sequence == number
            with pytest.raises(CommandRejected, match="was not sent"):
                controller.start(RampTo(target_mm=400.0, speed_mm_per_s=5.0))  # does not fit its 16 bits
            blocks: list[SampleBlock] = []
            while sum(len(block.time_us) for block in blocks) < 30:
                if (block := controller.read_block()) is not None:
                    blocks.append(block)
            polls = np.concatenate([block.counts["stroke_1"] for block in blocks]).astype(np.int64)
            force = np.concatenate([block.counts["force"] for block in blocks])
            np.testing.assert_array_equal(force, polls * 70_000)  # both words, of the poll that stroke is of
            np.testing.assert_array_equal(np.concatenate([b.counts["position"] for b in blocks]), -polls)
            assert np.all(np.diff(polls) > 0)
            controller.disable()
        finally:
            controller.close()


@pytest.mark.parametrize("kind", ["TCP", "RTU"])
def test_a_libmodbus_client_drives_the_simulated_controller(
    libmodbus_client: Path, tmp_path: Path, kind: str
) -> None:
    """Switched on, armed, executed, watched to the end of the motion, and every sample of it read."""
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    text = text.replace('model = "', f'model = "{SAMPLE_STAND.parent}/')
    if kind == "RTU":
        wire = 'host = "127.0.0.1"\nport = 15020'
        assert wire in text
        text = text.replace(wire, f'serial = "wires/controller"\nbaud = {BAUD}\nparity = "none"')
    path = tmp_path / "stand.toml"
    path.write_text(text, encoding="utf-8")
    with start_process(path, directory=tmp_path / "run") as stand:
        served = stand.served
        where = ["tcp", str(served.port)] if kind == "TCP" else ["rtu", str(served.controller_serial), BAUD]
        done = subprocess.run(
            [str(libmodbus_client), *where], capture_output=True, text=True, check=False, timeout=120
        )
    assert done.returncode == 0, done.stderr
    found = re.match(
        r"samples (\d+) first 0 last (\d+) broken 0 position (\S+) state 2 done 1$", done.stdout.strip()
    )
    assert found, done.stdout
    assert int(found[1]) == int(found[2]) + 1 > 300  # 12 mm at 40 mm/s are 300 ms
    assert float(found[3]) == pytest.approx(12.0, abs=0.06)
