"""Modbus I/O by description on the real wires: what goes wrong is said and is a gap, never a guess."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from bufferstand.drivers.acquisition.modbus_io.driver import ModbusIoDriver
from bufferstand.drivers.acquisition.modbus_io.kind import KIND
from bufferstand.drivers.acquisition.modbus_io.settings import ModbusIoSettings
from bufferstand.drivers.instruments.kind import InstrumentSite
from bufferstand.drivers.instruments.wire_address import SerialAddress, TcpAddress
from bufferstand.drivers.interfaces import SampleBlock, SensorFault
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.drivers.modbus_io_entries import io_entry, wago_entry
from tests.peers.modbus_io.laumas import CELL_ERROR, Transmitter
from tests.peers.modbus_io.wago import Module, WagoNode, pt100_word, ten_volt_word
from tests.peers.modbus_io.wire import Server
from tests.peers.modbus_io.wiren_board import M1W2

PATIENCE_S = 120.0
WEIGHT = {"gross": ("force", "force", "kN", [0.0, 0.00980665])}
KG = {"unit_per_digit": 0.1, "unit": "kg"}


class Counting:
    """A node whose first input rises by one step with each poll: a repeated or guessed value shows."""

    def __init__(self) -> None:
        self.asked = 0
        self.node = WagoNode([Module([self._next, lambda: ten_volt_word(1.0)])])

    def _next(self) -> int:
        self.asked += 1
        return (self.asked % 4000) << 3


class Seen:
    """What a driver has delivered."""

    def __init__(self, driver: ModbusIoDriver) -> None:
        self._driver = driver
        self.blocks: list[SampleBlock] = []
        self.said: list[str] = []

    def until(self, done: Callable[[Seen], bool]) -> Seen:
        end_s = time.monotonic() + PATIENCE_S
        while not done(self):
            assert time.monotonic() < end_s, (len(self.blocks), self.said)
            for item in self._driver.drain():
                if isinstance(item, SampleBlock):
                    self.blocks.append(item)
                else:
                    assert isinstance(item, SensorFault)
                    self.said.append(item.what)
            time.sleep(0.002)
        return self

    def rows(self, count: int) -> Seen:
        return self.until(lambda seen: len(seen.blocks) >= count)

    def column(self, name: str) -> list[float]:
        return [float(block.counts[name][0]) for block in self.blocks]


@contextmanager
def reading(settings: ModbusIoSettings, folder: Path | None = None) -> Iterator[ModbusIoDriver]:
    driver = KIND.driver(settings, InstrumentSite(folder or Path(), WallClock(), "acquisition"))
    try:
        driver.start()
        yield driver
    finally:
        driver.close()


def on_line(folder: Path, **keys: object) -> ModbusIoSettings:
    keys = {"serial": "wire", "baud": 115200, "rate_Hz": 40.0, "timeout_s": 0.1, "answers": KG} | keys
    return io_entry("laumas", WEIGHT, **keys)


# --- the fault table: on TCP and on a line ---------------------------------------------------------------

FAULTS = {
    "lost": ("lose", "no reply within"),
    "late": ("late:0.3", "no reply within"),
    "busy": ("exception:6", "device busy"),
    "gateway": ("exception:11", "gateway target does not respond"),
    "short": ("short", "instead of"),
    "wrong unit": ("unit", "no reply within"),
    "hung up": ("hang-up", ""),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_over_tcp_a_fault_is_said_once_and_is_a_gap(fault: str) -> None:
    trouble, said = FAULTS[fault]
    counting = Counting()
    with Server(counting.node) as far, reading(wago_entry(far.port, timeout_s=0.1)) as driver:
        seen = Seen(driver).rows(5)
        far.trouble.plan(trouble)
        seen.until(lambda one: bool(one.said) and far.trouble.left == 0)
        before = len(seen.blocks)
        seen.rows(before + 5)
    assert any(said in one for one in seen.said), seen.said
    demand_gaps_only(seen)


RTU_FAULTS = {
    **{name: FAULTS[name] for name in FAULTS if name != "hung up"},
    "wrong CRC": ("crc", "no reply"),
}


@pytest.mark.parametrize("fault", RTU_FAULTS)
def test_on_a_line_a_fault_is_said_and_is_a_gap(fault: str, tmp_path: Path) -> None:
    trouble, said = RTU_FAULTS[fault]
    with (
        Server(Transmitter(gross=1250), tmp_path / "wire") as far,
        reading(on_line(tmp_path), tmp_path) as driver,
    ):
        seen = Seen(driver).rows(5)
        far.trouble.plan(trouble)
        seen.until(lambda one: bool(one.said) and far.trouble.left == 0)
        before = len(seen.blocks)
        seen.rows(before + 5)
    assert any(said in one for one in seen.said), seen.said
    assert sum(block.lost for block in seen.blocks) >= 1
    assert set(seen.column("force")) == {125.0}


def demand_gaps_only(seen: Seen) -> None:
    """See that rows are numbered with their gaps, none came twice, and stamps rise with them."""
    following = seen.blocks[0].first_sequence
    for block in seen.blocks:
        assert block.first_sequence == following + block.lost
        following = block.first_sequence + 1
    assert sum(block.lost for block in seen.blocks) >= 1
    values = np.array(seen.column("force"))
    assert np.all(np.diff(values) > 0)
    time_us = np.array([int(block.time_us[0]) for block in seen.blocks])
    assert np.all(np.diff(time_us) > 0)


def test_a_poll_slower_than_its_stamp_may_be_off_is_a_gap() -> None:
    counting = Counting()
    with Server(counting.node) as far:
        entry = wago_entry(far.port, rate_Hz=20.0, stamp_within_s=0.01)
        with reading(entry) as driver:
            seen = Seen(driver).rows(3)
            far.trouble.plan("late:0.06")
            seen.until(lambda one: any("could be off" in text for text in one.said))
            seen.rows(len(seen.blocks) + 3)
            assert "polls beyond ± 10 ms are gaps" in driver.stamp_note
    demand_gaps_only(seen)


def test_a_stamp_is_the_middle_of_its_poll() -> None:
    counting = Counting()
    with Server(counting.node, delay_s=0.03) as far:
        entry = wago_entry(far.port, rate_Hz=5.0)
        clock = WallClock()
        driver = KIND.driver(entry, InstrumentSite(Path(), clock, "acquisition"))
        driver.start()
        seen = Seen(driver).rows(4)
        driver.close()
    for block in seen.blocks:
        # received_s is when the reply had come: half of a poll of 30 ms or more behind the stamp.
        assert block.received_s - block.time_us[0] / 1e6 >= 0.015


def test_its_values_come_in_the_units_of_their_points(tmp_path: Path) -> None:
    entry = on_line(tmp_path)
    driver = KIND.driver(entry, InstrumentSite(tmp_path, WallClock(), "acquisition"))
    assert driver.facts.raw_unit(entry.input[0].channel.name) == "kg"


def test_how_far_stamps_are_off_is_part_of_a_stated_uncertainty() -> None:
    wanted = wago_entry(1, rate_Hz=20.0, stamp_within_s=0.006)
    channel = wanted.input[0].channel
    stated = channel.model_copy(
        update={"uncertainty": channel.uncertainty.model_copy(update={"u_delay_s": 0.002})}
    )
    entry = wanted.model_copy(
        update={"input": (wanted.input[0].model_copy(update={"channel": stated}), wanted.input[1])}
    )
    assert entry.channels[0].uncertainty.u_delay_s == pytest.approx((0.002**2 + 0.006**2 / 3.0) ** 0.5)
    assert entry.channels[1].uncertainty.u_delay_s is None  # nothing is known of it, and nothing is made up


def test_a_device_that_is_away_comes_back_and_the_hole_is_counted() -> None:
    counting = Counting()
    far = Server(counting.node)
    port = far.port
    entry = wago_entry(port, timeout_s=0.1)
    with reading(entry) as driver:
        seen = Seen(driver).rows(5)
        far.trouble.plan(*["hang-up"] * 20)
        seen.until(lambda _: far.trouble.left == 0)
        seen.rows(len(seen.blocks) + 5)
    far.close()
    demand_gaps_only(seen)
    assert len(seen.said) < 12  # an outage is told, not every poll of it


# --- sensors that are off --------------------------------------------------------------------------------


def test_an_open_wire_is_no_value_and_leaves_the_others() -> None:
    words = [pt100_word(23.4)] * 4
    node = WagoNode([Module([lambda place=place: words[place] for place in range(4)])])  # type: ignore[misc]
    wanted = {
        "AI1": ("temperature_1", "temperature", "°C", [0.0, 1.0]),
        "AI2": ("temperature_2", "temperature", "°C", [0.0, 1.0]),
    }
    with Server(node) as far:
        entry = io_entry(
            "wago-750-pt100", wanted, host="127.0.0.1", port=far.port, rate_Hz=50.0, answers={"first_word": 0}
        )
        with reading(entry) as driver:
            seen = Seen(driver).rows(3)
            words[1] = pt100_word(1e9)
            seen.until(lambda one: np.isnan(one.column("temperature_2")[-1]))
            assert seen.column("temperature_1")[-1] == pytest.approx(23.4)
            seen.until(lambda one: bool(one.said))
            words[1] = pt100_word(24.0)
            seen.until(lambda one: not np.isnan(one.column("temperature_2")[-1]))
            words[1] = pt100_word(1e9)
            seen.until(lambda one: len(one.said) == 2)  # told again, since it had ended
    assert all("temperature_2: AI2: 850 °C" in text and "a wire is broken" in text for text in seen.said)
    assert sum(block.lost for block in seen.blocks) == 0


def test_a_load_cell_that_is_off_and_a_negative_weight(tmp_path: Path) -> None:
    scale = Transmitter(gross=-31250)
    with Server(scale, tmp_path / "wire"), reading(on_line(tmp_path), tmp_path) as driver:
        seen = Seen(driver).rows(2)
        assert seen.column("force")[-1] == pytest.approx(-3125.0)
        scale.faults = frozenset({CELL_ERROR})
        seen.until(lambda one: np.isnan(one.column("force")[-1]) and bool(one.said))
    assert "load cell error" in seen.said[0]


def test_thermometers_behind_bits_and_registers(tmp_path: Path) -> None:
    pair = M1W2(first=21.5, second=None)
    wanted = {
        "sensor1": ("temperature_1", "temperature", "°C", [0.0, 1.0]),
        "sensor2": ("temperature_2", "temperature", "°C", [0.0, 1.0]),
    }
    with Server(pair, tmp_path / "wire") as far:
        entry = io_entry("wb-m1w2", wanted, serial="wire", baud=115200, rate_Hz=5.0)
        with reading(entry, tmp_path) as driver:
            seen = Seen(driver).rows(2).until(lambda one: bool(one.said))
        assert {function for _, function, _, _ in far.requests} == {2, 4}
    assert seen.column("temperature_1")[-1] == 21.5
    assert np.isnan(seen.column("temperature_2")).all()
    assert "does not answer" in seen.said[0]


# --- what is refused at the start ------------------------------------------------------------------------


def started(entry: ModbusIoSettings) -> DeviceFault:
    driver = KIND.driver(entry, InstrumentSite(Path(), WallClock(), "acquisition"))
    with pytest.raises(DeviceFault) as refused:
        driver.start()
    driver.close()
    return refused.value


def test_another_device_is_told_by_its_constants() -> None:
    class Swapped(WagoNode):
        def registers(self, function: int, address: int, count: int) -> list[int]:
            words = super().registers(function, address, count)
            return [one >> 8 | (one & 0xFF) << 8 for one in words]

    with Server(WagoNode([Module([lambda: 0, lambda: 0])], item=352)) as far:
        assert "bufferstand instruments --probe" in str(
            started(
                wago_entry(far.port, answers={"first_word": 8})
            )  # no such words in this node: refused with exception 2
        )
    with Server(Swapped([Module([lambda: 0, lambda: 0])])) as far:
        assert "exchanges bytes" in str(started(wago_entry(far.port)))


def test_nobody_there_is_said_with_where_to_look() -> None:
    with Server(Transmitter(unit=7)) as far:
        entry = io_entry(
            "laumas", WEIGHT, host="127.0.0.1", port=far.port, rate_Hz=5.0, answers=KG, timeout_s=0.1
        )
        assert "no reply within" in str(started(entry))
        at_home = entry.model_copy(update={"device_id": 7})
        with reading(at_home) as driver:  # an RTU device behind a gateway is reached over TCP
            Seen(driver).rows(2)


def test_nothing_is_ever_written() -> None:
    counting = Counting()
    with Server(counting.node) as far, reading(wago_entry(far.port)) as driver:
        driver.ask_for_stop("a limit")
        Seen(driver).rows(10)
        assert {function for _, function, _, _ in far.requests} <= {1, 2, 3, 4}


# --- what a stand file may not say -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "place", "said"),
    [
        ({"answers": {}}, "answers", "which its documents do not say"),
        ({"answers": {"first_word": "none"}}, "answers.first_word", "not a whole number"),
        ({"description": "wago-750"}, "", "there is no description"),
    ],
)
def test_what_its_description_does_not_fit_is_refused_by_its_key(
    keys: dict[str, object], place: str, said: str
) -> None:
    entry = wago_entry(1).model_copy(update=keys)
    with pytest.raises(BadInput, match=said) as refused:
        KIND.demand(entry, Path())
    assert refused.value.place == place


def test_an_unknown_point_is_refused_with_the_nearest() -> None:
    entry = io_entry(
        "laumas", {"groß": ("force", "force", "kN", [0.0, 1.0])}, serial="x", rate_Hz=1.0, answers=KG
    )
    with pytest.raises(BadInput, match="did you mean gross") as refused:
        KIND.demand(entry, Path())
    assert refused.value.place == "input.0.point"


def test_a_line_that_is_too_slow_is_reckoned() -> None:
    # 8 + 5 + 6 bytes and two silences of 3.5 characters are 26 characters of 11 bits: 33.6 a second at 9600.
    entry = io_entry("laumas", WEIGHT, serial="x", baud=9600, rate_Hz=33.0, answers=KG)
    KIND.demand(entry, Path())
    with pytest.raises(BadInput, match=r"9600 baud carries 33\.6"):
        KIND.demand(entry.model_copy(update={"rate_Hz": 34.0}), Path())


def test_a_device_on_tcp_is_not_looked_for_on_a_line() -> None:
    with pytest.raises(BadInput, match="on Modbus TCP"):
        KIND.demand(wago_entry(1).model_copy(update={"host": "", "serial": "wire"}), Path())


def test_values_that_would_come_twice_are_refused(tmp_path: Path) -> None:
    (tmp_path / "slow.toml").write_text(
        'id = "slow"\nedition = 1\ntitle = "slow"\nwires = ["tcp"]\nfastest_Hz = 2.0\n'
        '[[source]]\ndocument = "m"\nedition = "1"\nplace = "p. 1"\n'
        '[[point]]\nname = "AI1"\naddress = 0\ntype = "u16"\nunit = "V"\n',
        encoding="utf-8",
    )
    wanted = {"AI1": ("force", "force", "kN", [0.0, 1.0])}
    entry = io_entry("slow.toml", wanted, host="127.0.0.1", rate_Hz=5.0)
    with pytest.raises(BadInput, match="2 new values a second"):
        KIND.demand(entry, tmp_path)
    KIND.demand(entry.model_copy(update={"rate_Hz": 2.0}), tmp_path)


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"host": ""}, "write host"),
        ({"serial": "wire"}, "not both"),
        ({"stamp_within_s": 0.1}, "more than half of the period"),
    ],
)
def test_an_entry_says_one_wire_and_a_time_that_fits(keys: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        wago_entry(1, **keys)


def test_where_it_is_reached(tmp_path: Path) -> None:
    assert KIND.wire(wago_entry(1502), tmp_path) == TcpAddress("127.0.0.1", 1502)
    line = on_line(tmp_path, stop_bits=2, parity="none")
    assert KIND.wire(line, tmp_path) == SerialAddress(tmp_path / "wire", 115200, "none", 2)
