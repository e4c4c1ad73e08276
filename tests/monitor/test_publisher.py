"""The acquiring side: it never waits for a listener, never fails the campaign, counts what it drops."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.monitor.publisher import LISTENERS, LIVE_NAME, Publisher, further_channels, publishing
from bufferstand.daq.monitor.sample_rows import MOST_ROWS, RowBuffer
from bufferstand.daq.scaling import ScaledBlock
from bufferstand.drivers.interfaces import StreamFacts
from bufferstand.foundation.channels.channel import Channel
from tests.daq.cases import HARMONIC, Lines
from tests.daq.test_runner import Case

if TYPE_CHECKING:
    from bufferstand.daq.acquisition.loop import Acquisition

FLOOD = 3000
"""Packets that are more than any listener's buffer holds."""


def block(stroke: Any, force: Any, first: int = 0, stream: str = "controller") -> ScaledBlock:
    stroke, force = np.asarray(stroke, dtype=float), np.asarray(force, dtype=float)
    time_us = (first + np.arange(len(stroke))) * 1000
    return ScaledBlock(stream, first, time_us, {"stroke": stroke, "force": force}, 0, 0.0)


@given(st.integers(1, 1200), st.integers(0, 1199))
def test_rows_are_thinned_and_extremes_are_of_every_sample(count: int, peak: int) -> None:
    stroke = np.linspace(0.0, 50.0, count)
    force = np.zeros(count)
    force[peak % count] = 700.0
    buffer = RowBuffer()
    buffer.add(block(stroke[: count // 2], force[: count // 2]))
    buffer.add(block(stroke[count // 2 :], force[count // 2 :], count // 2))
    rows, extremes = buffer.take()
    assert len(rows["t"]) == len(rows["s"]) == len(rows["f"]) <= MOST_ROWS
    assert len(rows["t"]) >= min(count, MOST_ROWS // 2)
    assert np.all(np.diff(rows["t"]) > 0)
    assert extremes["force"] == [700.0 if count == 1 else 0.0, 700.0], "a peak between two rows counts"
    assert extremes["stroke"] == pytest.approx([0.0, 50.0 if count > 1 else 0.0])
    assert buffer.take() == ({}, {})


def test_what_is_no_number_is_left_out_and_stays_json() -> None:
    buffer = RowBuffer()
    buffer.add(block([1.0, np.nan, 3.0], [1.0, 2.0, np.inf]))
    rows, extremes = buffer.take()
    assert rows["s"] == [1000]
    assert extremes["stroke"] == [None, None]
    json.dumps([rows, extremes], allow_nan=False)


def listener(folder: Path) -> socket.socket:
    wire = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    wire.settimeout(10.0)
    try:
        wire.connect(str(folder / LIVE_NAME))
    except OSError:
        wire.close()
        raise
    return wire


def telling(publisher: Publisher) -> Callable[[int], None]:
    """Return what lets 50 samples, with a number, come, and a packet be due."""
    from tests.monitor.stub import acquisition_of

    wall, stub = [time.monotonic()], acquisition_of()
    publisher._wall_s = lambda: wall[0]

    def tell(number: int) -> None:
        publisher.take(block(np.full(50, 1.0), np.full(50, 2.0), 50 * number))
        wall[0] += 0.06
        publisher.look(stub)

    return tell


class Connecting(Lines):
    """Connects listeners when the first step begins, and reads with those that want to."""

    def __init__(self, folder: Path, count: int, reads: bool) -> None:
        super().__init__()
        self.folder, self.count, self.reads = folder, count, reads
        self.wires: list[socket.socket] = []
        self.packets: list[dict[str, Any]] = []

    def message(self, text: str) -> None:
        super().message(text)
        if text.startswith("step 1") and not self.wires:
            self.wires = [listener(self.folder) for _ in range(self.count)]

    def update(self, progress: Any) -> None:
        super().update(progress)
        time.sleep(0.01)
        if self.reads:
            self.read()

    def read(self) -> None:
        for wire in self.wires:
            if wire.fileno() < 0:
                continue
            wire.setblocking(False)
            try:
                while packet := wire.recv(1 << 20):
                    self.packets.append(json.loads(packet))
                wire.close()  # it was let go
            except BlockingIOError:
                pass


def watched(
    folder: Path, count: int = 1, *, reads: bool = True, steps: str = HARMONIC
) -> tuple[Case, Connecting]:
    case = Case(folder, steps)
    shown = Connecting(case.out, count, reads)
    case.shown = shown
    return case, shown


def test_a_listener_is_told_every_sample_every_line_and_the_end(tmp_path: Path) -> None:
    case, shown = watched(tmp_path)
    outcome = case.run()
    shown.read()
    packets = shown.packets
    assert packets[0]["schema"] == "bufferstand/live/1"
    assert packets[0]["guards"]["channels"]
    end = packets[-1]["end"]
    assert (end["status"], end["reason"]) == ("complete", "")
    assert end["stand"] == {"safe": True, "line": outcome.safe_stop.line}
    lines = [line["text"] for packet in packets for line in packet.get("lines", [])]
    assert lines == shown.lines, "also those from before it came"
    assert max(
        packet["extremes"]["stroke"][1] for packet in packets if packet.get("extremes")
    ) == pytest.approx(15.0, abs=0.05)
    assert packets[-1]["progress"]["phase"] == "done"
    assert all(packet["dropped"] == 0 for packet in packets)
    readings = [
        reading for packet in packets for reading in packet.get("readings", {}).get("temperature_1", [])
    ]
    assert len(readings) > 5
    assert [at for at, _ in readings] == sorted(at for at, _ in readings)
    assert not (case.out / LIVE_NAME).exists(), "the socket goes with the campaign"
    assert outcome.status == "complete"


def test_only_the_campaigns_user_can_listen(tmp_path: Path) -> None:
    with publishing(tmp_path, print):
        assert (tmp_path / LIVE_NAME).stat().st_mode & 0o077 == 0


def test_listeners_that_read_nothing_stop_nothing_and_what_they_miss_is_counted(tmp_path: Path) -> None:
    steps = HARMONIC.replace("cycles = 3", "cycles = 8")
    case, shown = watched(tmp_path, LISTENERS, reads=False, steps=steps)
    outcome = case.run()
    assert outcome.status == "complete"
    shown.read()
    dropped = [packet["dropped"] for packet in shown.packets]
    samples = sum(len(p["rows"]["t"]) for p in shown.packets if p.get("rows"))
    assert samples > 0
    assert dropped == sorted(dropped) or len(shown.wires) > 1
    assert case.shown.snapshots[-1].lost == 0


def test_a_listener_whose_buffer_is_full_loses_rows_but_no_line(tmp_path: Path) -> None:
    said: list[str] = []
    with publishing(tmp_path, said.append) as publisher:
        tell, wire = telling(publisher), listener(tmp_path)
        for number in range(FLOOD):
            if number % 500 == 0:
                publisher.message(f"line {number}")
            tell(number)
        packets = []
        wire.setblocking(False)
        while True:
            try:
                packets.append(json.loads(wire.recv(1 << 20)))
            except BlockingIOError:
                break
        tell(20_000)
        wire.settimeout(10.0)
        packets.append(json.loads(wire.recv(1 << 20)))
        told = sum(len(packet["rows"]["t"]) for packet in packets if packet["rows"])
        assert packets[-1]["dropped"] > 0
        # rows before the listener was taken on are not its own: at most one packet of them
        assert (FLOOD + 1) * 50 - told - packets[-1]["dropped"] in (0, 50)
        lines = [line["text"] for packet in packets for line in packet.get("lines", [])]
        assert lines == [f"line {number}" for number in range(0, FLOOD, 500)]
        wire.close()
    assert said == []


def test_the_end_reaches_a_listener_that_is_behind(tmp_path: Path) -> None:
    with publishing(tmp_path, print) as publisher:
        tell, wire = telling(publisher), listener(tmp_path)
        for number in range(FLOOD):
            tell(number)
        packets: list[dict[str, Any]] = []

        def read() -> None:
            time.sleep(0.3)
            while packet := wire.recv(1 << 20):
                packets.append(json.loads(packet))

        reader = threading.Thread(target=read)
        reader.start()
        publisher.end("stopped", "by the operator")
        reader.join(60.0)
        wire.close()
    assert packets[-1]["dropped"] > 0
    assert packets[-1]["end"] == {"status": "stopped", "reason": "by the operator", "stand": None}


def test_a_listener_that_hangs_keeps_the_end_only_so_long(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("bufferstand.daq.monitor.publisher.LAST_WORD_S", 0.2)
    said: list[str] = []
    with publishing(tmp_path, said.append) as publisher:
        tell, wires = telling(publisher), [listener(tmp_path) for _ in range(LISTENERS)]
        for number in range(FLOOD):
            tell(number)
        publisher.end("stopped", "by the operator")
        for wire in wires:
            wire.close()
    assert said == []


def test_a_fault_in_showing_is_said_once_and_fails_nothing(tmp_path: Path) -> None:
    said: list[str] = []
    with publishing(tmp_path, said.append) as publisher:
        wire = listener(tmp_path)
        publisher._due_s = -1.0
        publisher.look(None)  # type: ignore[arg-type]  # a bug of ours
        publisher.look(None)  # type: ignore[arg-type]
        publisher.message("goes on")
        with pytest.raises(ConnectionResetError):  # nobody had taken it on yet
            wire.recv(10)
        wire.close()
    assert len(said) == 1
    assert "the campaign goes on" in said[0]


def test_a_folder_that_takes_no_socket_is_no_reason_not_to_run(tmp_path: Path) -> None:
    case = Case(tmp_path)
    (case.out / LIVE_NAME).mkdir(parents=True)  # nothing can be bound there
    assert case.run().status == "complete"


def test_a_long_path_is_no_obstacle(tmp_path: Path) -> None:
    folder = tmp_path / ("d" * 100) / ("e" * 60)
    folder.mkdir(parents=True)
    with publishing(folder, print):
        assert (folder / LIVE_NAME).is_socket()
        with pytest.raises(OSError):  # noqa: PT011 - too long for the plain way
            listener(folder)
        assert [path.name for path in folder.iterdir()] == [LIVE_NAME]


def test_channels_without_a_place_of_their_own_are_named_with_their_unit() -> None:
    channels = (
        Channel(name="force", quantity="force", unit="kN"),
        Channel(name="pressure_1", quantity="pressure", unit="bar"),
        Channel(name="acceleration_1", quantity="acceleration", unit="m/s²"),
    )
    facts = StreamFacts("controller", "device", channels, 1000.0, "test")
    values = {"force": 10.0, "pressure_1": 3.33333, "acceleration_1": float("nan")}
    latest = SimpleNamespace(values=values | {"force_2": 9.9, "force_3": 9.8, "temperature_1": 20.0})
    beside = [
        StreamFacts(stream, "host", (Channel(name=name, quantity=quantity, unit=unit),), 10.0, "test")
        for stream, name, quantity, unit in (
            ("amplifier", "force_2", "force", "kN"),
            ("amplifier_2", "force_3", "force", "kN"),
            ("temperature_1", "temperature_1", "temperature", "°C"),
        )
    ]
    sensors = [SimpleNamespace(facts=one) for one in beside]
    stand = SimpleNamespace(controller=SimpleNamespace(facts=facts), sensors=sensors)
    assert further_channels(cast("Acquisition", SimpleNamespace(latest=latest, stand=stand))) == [
        {"name": "pressure_1", "value": 3.3333, "unit": "bar"},
        {"name": "acceleration_1", "value": None, "unit": "m/s²"},
        {"name": "force_3", "value": 9.8, "unit": "kN"},
    ]
