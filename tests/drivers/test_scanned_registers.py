"""A PLC's own Modbus server answers from registers that the program looks at once a scan; nothing is lost."""

from __future__ import annotations

import numpy as np
import pytest

from bufferstand.drivers.controllers.ring_controller import RingController
from bufferstand.drivers.modbus.link import ModbusLink
from bufferstand.drivers.modbus.wires import TcpWire
from bufferstand.drivers.register_maps.profile import Profile, load_profile
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import DeviceFault
from tests.drivers.ring_device import RingDevice
from tests.drivers.servers import raw_server
from tests.drivers.test_ring_controller import CHANNELS

ANOTHER = 7777


class ScannedDevice(RingDevice):
    """Looks at what was asked only each so many-th time that its window is read, and never for 0."""

    def __init__(self, profile: Profile, every: int) -> None:
        self.every, self.looks, self.asked, self.answered = every, 0, 0.0, 0
        super().__init__(profile)

    def get(self, name: str) -> float:
        return self.asked if name == "ring_acknowledge" else super().get(name)

    def window(self) -> list[int]:
        self.looks += 1
        if self.every and self.looks % self.every == 0:
            self.asked = super().get("ring_acknowledge")
        return super().window()

    def write(self, address: int, values: list[int]) -> None:
        self.answered += address == self.profile.find("ring_acknowledge").address
        super().write(address, values)


def controller_of(port: int, profile: Profile, timeout_s: float = 0.5) -> RingController:
    link = ModbusLink(TcpWire("127.0.0.1", port), timeout_s=timeout_s, read_write=False)
    controller = RingController(link, profile, CHANNELS, WallClock(), timeout_s=timeout_s)
    controller.connect()
    return controller


@pytest.mark.parametrize("every", [1, 2, 5])
def test_the_window_is_read_again_until_a_scan_has_seen_what_is_asked(every: int) -> None:
    profile = load_profile("ring")
    device = ScannedDevice(profile, every)
    with raw_server(device) as server:
        controller = controller_of(server.port, profile)
        device.sample(100)
        blocks = []
        while (block := controller.read_block()) is not None:
            blocks.append(block)
        events = controller.events()
        controller.close()
    sequence = np.concatenate([b.first_sequence + np.arange(len(b.time_us)) for b in blocks])
    assert np.array_equal(sequence, np.arange(100))
    assert not any("refused" in event or "opened" in event for event in events), events
    assert device.answered == len(blocks) + 1, "asked once each, and once for nothing"
    assert device.looks >= every * len(blocks)


def test_one_that_never_looks_is_doubted_as_ever() -> None:
    profile = load_profile("ring")
    device = ScannedDevice(profile, 1)
    with raw_server(device) as server:
        controller = controller_of(server.port, profile, timeout_s=0.1)
        device.sample(30)
        assert controller.read_block() is not None
        device.every = 0
        with pytest.raises(DeviceFault, match="the block answers a request for sequence 0, not 14"):
            controller.read_block()
        controller.close()


class TwoWriters(RingDevice):
    """Another program wrote its number just before: the scan that sees both puts that one back."""

    def __init__(self, profile: Profile) -> None:
        super().__init__(profile)
        self.statuses = 0

    def read(self, address: int, count: int) -> list[int]:
        if address == self.profile.find("status_word").address and self.get("writer"):
            self.statuses += 1
            if self.statuses == 2:
                self.set("writer", ANOTHER)
        return super().read(address, count)


def test_a_right_that_a_scan_takes_away_again_was_never_had() -> None:
    profile = load_profile("ring")
    device = TwoWriters(profile)
    with raw_server(device) as server:
        controller = controller_of(server.port, profile)
        with pytest.raises(DeviceFault, match=rf"another program \(number {ANOTHER}"):
            controller.enable(force_limit_kN=60.0, stroke_limit_mm=20.0, watchdog_ms=1000)
        assert not controller.in_charge
        assert device.control_words == [], "it was switched on by nobody"
        controller.close()
