"""What every acquisition device must do, whatever its wire: each kind on a device that others have made."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from bufferstand.drivers.acquisition.catalogue import acquisition_kind_of, acquisition_kinds
from bufferstand.drivers.acquisition.kind import AcquisitionDevice, AcquisitionSettings
from bufferstand.drivers.instruments.kind import InstrumentSite
from bufferstand.drivers.interfaces import SampleBlock
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.modbus_io_entries import io_entry, wago_entry
from tests.drivers.test_labjack import entry
from tests.peers.labjack.emulator import LabJackEmulator
from tests.peers.modbus_io.laumas import Transmitter
from tests.peers.modbus_io.wago import Module, WagoNode, ten_volt_word
from tests.peers.modbus_io.wire import Server

PATIENCE_S = 120.0
Serving = Callable[[], AbstractContextManager[AcquisitionSettings]]


def _labjack(delivery: str) -> Serving:
    @contextmanager
    def serve() -> Iterator[AcquisitionSettings]:
        with LabJackEmulator({0: lambda t: 0.0 * t + 1.0, 1: lambda t: 0.0 * t + 2.0}) as far:
            content = entry(delivery=delivery, stop_output="FIO0")
            content |= {"port": far.port, "stream_port": far.stream_port}
            kind = next(kind for kind in acquisition_kinds() if kind.name == "labjack")
            yield kind.settings.model_validate(content)

    return serve


@contextmanager
def _wago() -> Iterator[AcquisitionSettings]:
    node = WagoNode([Module([lambda: ten_volt_word(2.5), lambda: ten_volt_word(-5.0)])])
    with Server(node) as far:
        yield wago_entry(far.port, rate_Hz=100.0)


@contextmanager
def _transmitter_on_a_line() -> Iterator[AcquisitionSettings]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        stack.enter_context(Server(Transmitter(gross=-1250), folder / "wire"))
        yield io_entry(
            "laumas",
            {"gross": ("force", "force", "kN", [0.0, 0.00980665])},
            serial=str(folder / "wire"),
            baud=115200,
            rate_Hz=50.0,
            answers={"unit_per_digit": 0.1, "unit": "kg"},
        )


BACKENDS: dict[str, Serving] = {
    "modbus-io-tcp": _wago,
    "modbus-io-rtu": _transmitter_on_a_line,
    "labjack-packets": _labjack("packets"),
    "labjack-requests": _labjack("requests"),
}


@pytest.fixture(params=BACKENDS)
def device(request: pytest.FixtureRequest) -> Iterator[AcquisitionDevice]:
    with BACKENDS[request.param]() as settings:
        site = InstrumentSite(Path(), WallClock(), "acquisition")
        made: AcquisitionDevice = acquisition_kind_of(settings).driver(settings, site)
        yield made
        made.close()


def blocks_of(device: AcquisitionDevice, rows: int) -> list[SampleBlock]:
    found: list[SampleBlock] = []
    end_s = time.monotonic() + PATIENCE_S
    while sum(len(block.time_us) for block in found) < rows:
        assert time.monotonic() < end_s
        found += [item for item in device.drain() if isinstance(item, SampleBlock)]
        time.sleep(0.01)
    return found


def own_clock(device: AcquisitionDevice) -> bool:
    settings: AcquisitionSettings = device._settings  # type: ignore[attr-defined]
    return settings.own_clock


def test_every_kind_is_tried_and_says_where_it_comes_from() -> None:
    assert {name.rpartition("-")[0] for name in BACKENDS} == {kind.name for kind in acquisition_kinds()}
    for kind in acquisition_kinds():
        assert kind.__doc__
        assert kind.sources


def test_it_says_what_it_is_once_it_was_started(device: AcquisitionDevice) -> None:
    assert (device.facts.name, device.facts.clock) == (
        "acquisition",
        "device" if own_clock(device) else "host",
    )
    assert device.identity == ""
    assert list(device.drain()) == []
    device.start()
    assert device.identity
    assert device.can_ask_for_stop == own_clock(device)  # nothing is ever written to a polled one
    assert not device.stop_asked


def test_rows_follow_each_other(device: AcquisitionDevice) -> None:
    device.start()
    found = blocks_of(device, 400 if own_clock(device) else 50)
    following = 0
    for block in found:
        assert block.stream == "acquisition"
        assert block.first_sequence == following + block.lost
        assert set(block.counts) == {channel.name for channel in device.facts.channels}
        assert all(values.shape == block.time_us.shape for values in block.counts.values())
        following = block.first_sequence + len(block.time_us)
    time_us = np.concatenate([block.time_us for block in found])
    assert np.all(np.diff(time_us) > 0)
    if own_clock(device):
        np.testing.assert_allclose(np.diff(time_us), 1e6 / device.facts.rate_Hz, atol=1.0)


def test_starting_and_closing_twice_is_quiet(device: AcquisitionDevice) -> None:
    device.start()
    device.start()
    blocks_of(device, 50)
    device.close()
    device.close()
    device.drain()
    assert list(device.drain()) == []


def test_it_can_be_started_again_after_it_was_closed(device: AcquisitionDevice) -> None:
    device.start()
    blocks_of(device, 50)
    device.close()
    device.drain()
    device.start()
    blocks_of(device, 50)


def test_a_request_for_a_stop_never_waits_and_is_taken(device: AcquisitionDevice) -> None:
    device.start()
    blocks_of(device, 50)
    device.ask_for_stop("a limit")
    if not device.can_ask_for_stop:
        blocks_of(device, 50)
        assert not device.stop_asked
        return
    end_s = time.monotonic() + PATIENCE_S
    while not device.stop_asked:
        assert time.monotonic() < end_s
        time.sleep(0.01)
    blocks_of(device, 50)


def test_a_drain_never_waits(device: AcquisitionDevice) -> None:
    device.start()
    began_s = time.process_time()
    for _ in range(200):
        device.drain()
    assert time.process_time() - began_s < 1.0


def test_a_second_reader_is_refused(device: AcquisitionDevice) -> None:
    device.start()
    settings = getattr(device, "_settings", None)
    if settings is None:
        pytest.skip("this kind keeps its settings elsewhere")
    site = InstrumentSite(Path(), WallClock(), "acquisition")
    other = acquisition_kind_of(settings).driver(settings, site)
    with pytest.raises(DeviceFault, match="another program"):
        other.start()
