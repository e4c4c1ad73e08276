"""The upload of a plot: what the manual says of index, status and order, and what is left to find out."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
import pytest

from bufferstand.drivers.controllers.rmc.addresses import RmcAddress
from bufferstand.drivers.controllers.rmc.plot import PlotUpload, samples_per_read
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters, bytes_of, words_of
from bufferstand.foundation import DeviceFault

SETUP, UPLOAD, SAMPLES = RmcAddress(96, 0), RmcAddress(104, 0), 3


class Plot:
    """A plot of two data sets: the sample's number, and a hundred times it."""

    def __init__(self) -> None:
        self.mode, self.asked, self.index, self.plot_id, self.status = 0, 0, 0, 4, 0
        self.captured, self.state, self.period_s, self.stays = 100, 0.0, 0.001, False
        self.now_s = 1.0
        self.said: list[str] = []
        registers = RmcRegisters(self.read, self.write, "little")
        self.upload = PlotUpload(
            registers,
            SETUP,
            UPLOAD,
            sets=2,
            samples=SAMPLES,
            now_s=lambda: self.now_s,
            note=self.said.append,
        )

    def read(self, address: int, count: int, what: str) -> list[int]:
        del what
        if address == SETUP.wire:
            values = [0.0, 4096.0, self.period_s, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, self.state]
            return words_of(struct.pack(">10f", *values), "little")[:count]
        assert address == UPLOAD.wire, "each read begins at register 0"
        given = SAMPLES if not self.status and self.index + SAMPLES <= self.captured else 0
        head = struct.pack(">5I", self.mode | self.status << 4, self.asked, self.index, self.plot_id, given)
        numbers = [float(self.index + step) for step in range(SAMPLES)]
        data = struct.pack(f">{2 * SAMPLES}f", *numbers, *(100.0 * one for one in numbers))
        if given and not self.stays:
            self.index += SAMPLES
        return words_of(head + data, "little")[:count]

    def write(self, address: int, values: Sequence[int], what: str, once: bool) -> None:
        del what, once
        (value,) = struct.unpack(">I", bytes_of(values, "little"))
        at = (address - UPLOAD.wire) // 2
        if at == 0:
            self.mode, self.index = value, 0
        elif at == 1:
            self.asked = value
        elif at == 2:
            self.index, self.status = value, 0

    def begun(self) -> PlotUpload:
        assert self.upload.rate() == 1000.0
        self.upload.begin()
        return self.upload


def test_samples_of_a_read_are_those_of_the_arithmetic() -> None:
    assert samples_per_read(125, 4) == 14  # 5 + 57 words of 32 bits
    assert samples_per_read(125, 5) == 11
    assert samples_per_read(21, 4) == 1
    assert samples_per_read(21, 6) == 0


def test_data_sets_are_read_one_after_the_other() -> None:
    plot = Plot()
    block = plot.begun().read()
    assert block is not None
    assert (plot.mode, plot.asked) == (2, SAMPLES)
    np.testing.assert_array_equal(block.rows, [[0, 0], [1, 100], [2, 200]])
    second = plot.upload.read()
    assert second is not None
    assert (block.first, second.first, second.lost) == (0, 3, 0)


def test_nothing_is_given_while_there_is_not_enough() -> None:
    plot = Plot()
    plot.captured = 2
    assert plot.begun().read() is None
    plot.captured = 3
    block = plot.upload.read()
    assert block is not None and block.first == 0  # noqa: PT018


def test_an_index_that_a_lost_reply_has_moved_is_written_back() -> None:
    plot = Plot()
    plot.begun().read()
    plot.index += SAMPLES  # moved, and its reply was lost
    block = plot.upload.read()
    assert block is not None
    assert (block.first, block.lost) == (3, 0)
    np.testing.assert_array_equal(block.rows[:, 0], [3, 4, 5])
    assert len(plot.said) == 1


def test_what_cannot_be_had_again_is_counted() -> None:
    plot = Plot()
    plot.begun().read()
    plot.index = 33
    plot.stays = True
    write = plot.write

    def refuse_index(address: int, values: Sequence[int], what: str, once: bool) -> None:
        if address != UPLOAD.plus(2).wire:
            write(address, values, what, once)

    plot.upload._registers._write = refuse_index
    block = plot.upload.read()
    assert block is not None
    assert (block.first, block.lost) == (33, 30)
    assert plot.upload.overruns == 1


def test_an_overrun_is_counted_by_the_clock() -> None:
    plot = Plot()
    upload = plot.begun()
    upload.read()  # its newest sample, number 2, is of now
    plot.status, plot.now_s = 2, plot.now_s + 5.0
    assert upload.read() is None
    block = upload.read()
    assert block is not None
    assert block.first + SAMPLES - 1 == 2 + 5000
    assert block.lost == block.first - 3
    assert "overran" in plot.said[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"status": 1}, "Rearm Plot"),
        ({"plot_id": 5}, "begun anew"),
        ({"asked": 7}, "another program"),
        ({"mode": 3}, "another program"),
    ],
)
def test_what_is_wrong_with_the_plot_is_told(change: dict[str, int], said: str) -> None:
    plot = Plot()
    plot.begun().read()
    for name, value in change.items():
        setattr(plot, name, value)
    with pytest.raises(DeviceFault, match=said):
        plot.upload.read()


@pytest.mark.parametrize(
    ("state", "period_s", "said"), [(2.0, 0.001, "does not capture"), (0.0, 0.0, "sample period")]
)
def test_a_plot_that_does_not_run_is_refused_at_connect(state: float, period_s: float, said: str) -> None:
    plot = Plot()
    plot.state, plot.period_s = state, period_s
    with pytest.raises(DeviceFault, match=said):
        plot.upload.rate()
