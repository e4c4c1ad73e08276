"""The kernel's folder read by ``temperature`` and by bulk conversion, with the kernel's traps."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from bufferstand.drivers.thermometers.ds18b20 import ReadingFault, TemperatureReading, decode_temperature
from bufferstand.drivers.thermometers.w1.thermometer import TRIGGER, FolderReader, read_temperature
from tests.drivers.pump import Pump
from tests.drivers.test_ds18b20 import scratchpad, w1_text
from tests.drivers.test_w1_folder import ROMS, put


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for index, rom in enumerate(ROMS):
        put(tmp_path, rom, w1_text(scratchpad(336 + index)))
        (tmp_path / rom / "temperature").write_text(f"{int((336 + index) * 62.5)}\n", encoding="ascii")
    (tmp_path / "w1_bus_master1").mkdir()
    return tmp_path


class Kernel:
    """``therm_bulk_read`` as w1_therm makes it: two pipes cannot do it, so a thread watches a file.

    Only exactly ``trigger`` and a line end start a conversion; other bytes are taken and ignored. The state
    is −1 while it runs and 1 when it is done; then the scratchpads hold the new values.
    """

    def __init__(
        self, root: Path, *, takes: bool = True, ends: bool = True, conversion_s: float = 0.05
    ) -> None:
        self.path = root / "w1_bus_master1" / "therm_bulk_read"
        self.path.write_text("0\n", encoding="ascii")
        self.conversions = 0
        self._root = root
        self._takes, self._ends, self._conversion_s = takes, ends, conversion_s
        self._pump = Pump(self._look)

    def close(self) -> None:
        self._pump.close()

    def _look(self) -> None:
        if not self.path.read_bytes().startswith(TRIGGER):
            return
        if not self._takes:
            self.path.write_text("0\n", encoding="ascii")
            return
        self.path.write_text("-1\n", encoding="ascii")
        if not self._ends:
            return
        time.sleep(self._conversion_s)
        self.conversions += 1
        for index, rom in enumerate(ROMS):
            put(self._root, rom, w1_text(scratchpad(400 + index + self.conversions)))
        self.path.write_text("1\n", encoding="ascii")


@pytest.fixture
def kernel(root: Path) -> Iterator[Kernel]:
    one = Kernel(root)
    yield one
    one.close()


def test_one_conversion_serves_every_sensor(root: Path, kernel: Kernel) -> None:
    reader = FolderReader(root, "bulk")
    assert [got for _, got in reader.read(ROMS)] == [
        TemperatureReading(401 + index, 12) for index in range(3)
    ]
    assert [got for _, got in reader.read(ROMS)] == [
        TemperatureReading(402 + index, 12) for index in range(3)
    ]
    assert kernel.conversions == 2
    assert reader.notes() == []


def test_the_trigger_is_exactly_eight_bytes_in_one_write(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (root / "w1_bus_master1" / "therm_bulk_read").write_text("1\n", encoding="ascii")
    writes: list[bytes] = []
    write = os.write

    def record(descriptor: int, data: bytes) -> int:
        writes.append(data)
        return write(descriptor, b"1\n")

    monkeypatch.setattr(os, "write", record)
    list(FolderReader(root, "bulk").read(ROMS))
    assert writes == [b"trigger\n"]
    assert len(writes[0]) == 8


def test_each_fault_is_still_told_apart(root: Path, kernel: Kernel) -> None:
    reader = FolderReader(root, "bulk")
    readings = reader.read((ROMS[0], "28-000000000000"))
    assert next(readings)[1] == TemperatureReading(401, 12)
    assert next(readings)[1] is ReadingFault.ABSENT


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ("missing", "the kernel is too old for it, or this is not the first bus master"),
        ("ignored", "did not take the trigger (it shows “0”)"),
        ("endless", "the common conversion did not end within 2 s"),
        ("forbidden", "may not be written; bulk reading needs root, or a udev rule"),
    ],
)
def test_without_a_common_conversion_the_sensors_are_read_one_by_one_and_it_is_said_once(
    root: Path, how: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = None
    if how in {"ignored", "endless"}:
        kernel = Kernel(root, takes=how == "endless", ends=False)
    if how == "forbidden":

        def refuse(*_: object) -> int:
            raise PermissionError(13, "no")

        monkeypatch.setattr(os, "open", refuse)
    now = [0.0]

    def sleep(duration_s: float) -> None:
        now[0] += duration_s * 10
        time.sleep(0.01)

    reader = FolderReader(root, "bulk", wall_s=lambda: now[0], sleep=sleep)
    try:
        for _ in range(2):
            assert [got for _, got in reader.read(ROMS)] == [
                TemperatureReading(336 + index, 12) for index in range(3)
            ]
        (note,) = reader.notes()
        assert message in note
        assert note.endswith("the sensors are converted one by one, which takes longer")
    finally:
        if kernel is not None:
            kernel.close()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("21000\n", TemperatureReading(336, 12)),
        ("-62\n", TemperatureReading(-1, 12)),
        ("125000\n", TemperatureReading(2000, 12)),
        ("", ReadingFault.EMPTY),
        ("127937\n", ReadingFault.NO_POWER),
        ("127000\n", ReadingFault.OUT_OF_RANGE),
        ("warm\n", ReadingFault.GARBLED),
        ("85000\n", None),
        ("0\n", None),
    ],
)
def test_the_temperature_file(text: str, found: TemperatureReading | ReadingFault | None) -> None:
    assert decode_temperature(text) == found


@pytest.mark.parametrize(
    ("text", "pad", "found"),
    [
        ("85000\n", scratchpad(0x0550, byte_6=0x0C), ReadingFault.POWER_ON),
        ("85000\n", scratchpad(0x0550), TemperatureReading(0x0550, 12)),
        ("0\n", bytes(9), ReadingFault.ALL_ZERO),
        ("0\n", scratchpad(0), TemperatureReading(0, 12)),
        ("22000\n", scratchpad(336), TemperatureReading(352, 12)),
    ],
)
def test_what_the_number_cannot_tell_is_looked_up(
    root: Path, text: str, pad: bytes, found: TemperatureReading | ReadingFault
) -> None:
    put(root, ROMS[0], w1_text(pad))
    (root / ROMS[0] / "temperature").write_text(text, encoding="ascii")
    assert read_temperature(root, ROMS[0]) == found
    assert list(FolderReader(root, "temperature").read(ROMS[:1])) == [(ROMS[0], found)]
