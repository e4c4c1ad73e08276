"""Amplifiers that speak lines by a description: the manuals' own lines, sessions, losses, refusals."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.amplifiers.ascii_line.amplifier import ReplyDecoder
from bufferstand.drivers.amplifiers.ascii_line.description import (
    MOST_DIGITS,
    SHIPPED,
    SpokenLines,
    load_line_description,
    shipped_line_descriptions,
    spoken,
)
from bufferstand.drivers.amplifiers.ascii_line.kind import KIND
from bufferstand.drivers.amplifiers.ascii_line.simulated import AsciiLineDevice
from bufferstand.drivers.amplifiers.serial import SerialAmplifier
from bufferstand.drivers.instruments.kind import InstrumentSite
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput, DeviceFault
from tests.drivers.amplifiers import Collector, FarEnd, until

ANSWERS: dict[str, dict[str, int | float | str]] = {
    "tecsis-eze30": {"address": 1, "decimals": 3},
    "tecsis-eze30-sends": {"address": 1, "decimals": 3},
    "mantracourt-dsc": {"station": "001", "decimals": 3},
    "mark-10-series-4": {"decimals": 2, "unit": "lbF"},
}
AMPLIFIER, SENSOR = KIND


def lines_of(name: str, **other: int | float | str) -> SpokenLines:
    return spoken(name, {**ANSWERS[name], **other}, Path())


def decoded(lines: SpokenLines, data: bytes) -> list[int]:
    return [value.count for value in ReplyDecoder(lines, aligned=True).feed(data)]


def entry(folder: Path, name: str, rate_Hz: float = 40.0, **answers: int | float | str) -> Any:
    """Return a sensor's entry: any quantity may speak lines."""
    return SENSOR.settings.model_validate(
        {
            "kind": "ascii-line",
            "port": str(folder / "wire"),
            "baud": 115200,
            "rate_Hz": rate_Hz,
            "channel": {"name": "force", "quantity": "force", "unit": "kN"},
            "line": {"description": name, "answers": {**ANSWERS.get(name, {}), **answers}},
        }
    )


@contextmanager
def reading(
    folder: Path, name: str, device: AsciiLineDevice | None = None, **more: Any
) -> Iterator[tuple[SerialAmplifier, FarEnd]]:
    settings = entry(folder, name, **more)
    far = FarEnd(folder / "wire", device or SENSOR.simulated_in(settings, folder))
    driver = SENSOR.driver(settings, InstrumentSite(folder, WallClock(), "sensor"))
    assert isinstance(driver, SerialAmplifier)
    try:
        driver.start()
        yield driver, far
    finally:
        driver.close()
        far.close()


class Rising(AsciiLineDevice):
    """One whose value rises by one with each question; some questions it does not answer."""

    def __init__(self, lines: SpokenLines, deaf: Callable[[int], bool] = lambda _: False) -> None:
        super().__init__(lines)
        self._deaf = deaf

    def obey(self, data: bytes) -> bytes:
        """Answer each question with its number."""
        self._last = self.asked + 1
        answers = super().obey(data)
        return b"" if data and self._deaf(self.asked) else answers


# --- the manuals' own lines ------------------------------------------------------------------------------


def test_every_shipped_description_is_answered_here_and_says_what_it_is_made_from() -> None:
    assert set(ANSWERS) == set(shipped_line_descriptions())
    for name in shipped_line_descriptions():
        found = load_line_description(name, Path())
        assert found.id == name
        assert not found.confirmed
        assert all(one.document and one.edition and one.place for one in found.source)
        assert (SHIPPED / f"{name}.toml").read_text(encoding="utf-8").startswith("# ")


@pytest.mark.parametrize(
    ("name", "answers", "line", "count"),
    [
        ("tecsis-eze30", {}, b"G+01.100\r", 1100),
        ("tecsis-eze30", {"decimals": 2}, b"G+123.45\r", 12345),
        ("mantracourt-dsc", {}, b"+00032.100\r", 32100),
        ("mark-10-series-4", {}, b"-18.78 lbF\r\n", -1878),
        ("mark-10-series-4", {"decimals": 3, "unit": "N"}, b"4.285 N\r\n", 4285),
    ],
)
def test_a_line_of_the_manual(name: str, answers: dict[str, Any], line: bytes, count: int) -> None:
    lines = lines_of(name, **answers)
    assert decoded(lines, line) == [count]
    assert decoded(lines, line * 3) == [count] * 3


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("tecsis-eze30", b"N+01.100\r"),  # the net value
        ("tecsis-eze30", b"G+1.1000\r"),  # another number of decimals: it would be ten times off
        ("tecsis-eze30", b"G+123456.789\r"),  # more digits than it has
        ("mark-10-series-4", b"-18.78 N\r\n"),  # another unit
        ("mark-10-series-4", b"-18.78\r\n"),  # none
        ("mantracourt-dsc", b"00032.100\r"),  # a digit or the sign was lost
    ],
)
def test_what_is_not_of_that_form_is_no_value(name: str, line: bytes) -> None:
    decoder = ReplyDecoder(lines_of(name), aligned=True)
    assert decoder.feed(line) == []
    assert decoder.resyncs == 1


def test_what_is_sent() -> None:
    assert lines_of("mantracourt-dsc").sent("!{station}:SOUT?") == b"!001:SOUT?\r"
    assert lines_of("tecsis-eze30", address=7).sent("OP {address}") == b"OP 7\r"
    assert lines_of("tecsis-eze30").sent("") == b""


# --- what must always hold -------------------------------------------------------------------------------


@given(
    st.sampled_from(sorted(ANSWERS)),
    st.integers(0, 4),
    st.lists(st.integers(-99999, 99999), max_size=8),
    st.data(),
)
def test_what_a_simulated_one_sends_is_read_whatever_the_pieces(
    name: str, decimals: int, counts: list[int], data: st.DataObject
) -> None:
    lines = lines_of(name, decimals=decimals)
    device = AsciiLineDevice(lines)
    sent = b"".join(device._line(count, overload=False) for count in counts)
    decoder = ReplyDecoder(lines, aligned=True)
    found: list[int] = []
    while sent:
        cut = data.draw(st.integers(1, len(sent)))
        found += [value.count for value in decoder.feed(sent[:cut])]
        sent = sent[cut:]
    # A line that ends with CR LF is whole with the CR LF; -0 is 0.
    assert found == counts
    assert decoder.resyncs == 0


# --- sessions --------------------------------------------------------------------------------------------


def test_one_that_is_asked_is_opened_and_asked_at_its_rate(tmp_path: Path) -> None:
    device = Rising(lines_of("tecsis-eze30"))
    with reading(tmp_path, "tecsis-eze30", device) as (driver, far):
        got = Collector(driver)
        until(lambda: len(got.take().counts) >= 20)
    assert far.heard.startswith(b"OP 1\rGG\r")
    assert set(far.heard.split(b"\r")) == {b"OP 1", b"GG", b""}
    assert got.counts == list(range(got.counts[0], got.counts[0] + len(got.counts)))
    assert got.said == []
    assert driver.identity == "tecsis EZE30, asked for each gross value"
    times = np.concatenate([block.time_us for block in got.blocks])
    assert np.all(np.diff(times) > 0)


def test_an_answer_that_does_not_come_is_a_gap(tmp_path: Path) -> None:
    device = Rising(lines_of("mantracourt-dsc"), deaf=lambda asked: asked % 5 == 0)
    with reading(tmp_path, "mantracourt-dsc", device) as (driver, _):
        got = Collector(driver)
        until(lambda: len(got.take().counts) >= 20)
    assert all(count % 5 for count in got.counts)
    following = got.blocks[0].first_sequence
    for block in got.blocks[1:]:
        following += len(got.blocks[got.blocks.index(block) - 1].time_us)
        assert block.first_sequence == following + block.lost
        following = block.first_sequence
    assert sum(block.lost for block in got.blocks) >= 3
    for before, block in pairwise(got.blocks):
        if block.counts["force"][0] - before.counts["force"][-1] == 2:  # a question between was not answered
            assert block.lost >= 1


def test_one_that_sends_by_itself_is_started_and_stopped(tmp_path: Path) -> None:
    with reading(tmp_path, "tecsis-eze30-sends") as (driver, far):
        got = Collector(driver)
        time.sleep(0.05)
        far.give(*range(100, 120))
        until(lambda: len(got.take().counts) >= 20)
        assert got.counts == list(range(100, 120))
        assert far.heard.startswith(b"GG\rOP 1\rSG\r")
    assert got.said == []


def test_zero_is_set_where_there_is_a_command_for_it(tmp_path: Path) -> None:
    with reading(tmp_path, "tecsis-eze30") as (driver, far):
        got = Collector(driver)
        far.give(700)
        until(lambda: 700 in got.take().counts)
        driver.zero()
        until(lambda: b"SZ\r" in far.heard)
        until(lambda: 0 in got.take().counts)
        far.give(750)
        until(lambda: 50 in got.take().counts)


def test_where_there_is_none_it_says_so(tmp_path: Path) -> None:
    with reading(tmp_path, "mantracourt-dsc") as (driver, far):
        got = Collector(driver)
        far.give(700)
        until(lambda: bool(got.take().counts))
        driver.zero()
        until(lambda: any("has no command for zero" in text for text in got.take().said))


def test_another_device_is_refused_with_what_it_said(tmp_path: Path) -> None:
    settings = entry(tmp_path, "tecsis-eze30")
    far = FarEnd(tmp_path / "wire", AsciiLineDevice(lines_of("mantracourt-dsc")))
    driver = SENSOR.driver(settings, InstrumentSite(tmp_path, WallClock(), "sensor"))
    try:
        with pytest.raises(DeviceFault, match=re.escape("it answers “?” to “OP 1”, expected “OK”")):
            driver.start()
    finally:
        driver.close()
        far.close()


def test_nobody_there_is_said(tmp_path: Path) -> None:
    class Deaf(AsciiLineDevice):
        def obey(self, data: bytes) -> bytes:
            del data
            return b""

    settings = entry(tmp_path, "tecsis-eze30")
    far = FarEnd(tmp_path / "wire", Deaf(lines_of("tecsis-eze30")))
    driver = SENSOR.driver(settings, InstrumentSite(tmp_path, WallClock(), "sensor"))
    try:
        with pytest.raises(DeviceFault, match="no answer to “OP 1”"):
            driver.start()
    finally:
        driver.close()
        far.close()


def test_refusals_are_said_once_and_are_no_values(tmp_path: Path) -> None:
    with reading(
        tmp_path, "mantracourt-dsc", AsciiLineDevice(lines_of("mantracourt-dsc", station="002"))
    ) as (
        driver,
        _,
    ):
        got = Collector(driver)
        until(lambda: bool(got.take().said))
        time.sleep(0.3)
        got.take()
    assert got.counts == []
    (said,) = got.said
    assert "it refuses what it is sent (“?”)" in said


# --- what a description and a stand file may not say -----------------------------------------------------

WHOLE = """
id = "x"
edition = 1
title = "x"
request = "V"
reply = '(?P<value>[0-9.]+)'
example = "1.5"
decimals = 1

[[source]]
document = "m"
edition = "1"
place = "p. 1"
"""


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("(?P<value>[0-9.]+)", "[0-9.]+", "no group"),
        ("(?P<value>[0-9.]+)", "(?P<value>[0-9.]+", "no regular expression"),
        ('example = "1.5"', 'example = "-1.5"', "does not match the example"),
        ('request = "V"', 'request = "V"\nstart = "G"', "either asked for each value"),
        ('request = "V"', 'request = "{station}V"', "what is asked is not what is used: station"),
        ("decimals = 1", 'decimals = "?decimals"', "what is asked is not what is used: decimals"),
        ("decimals = 1", "decimals = 10", "decimals"),
        ('request = "V"', 'request = "V"\nend = ";"', "end must be"),
        ('title = "x"', 'title = "x"\nunit = "kN"', "group (?P<unit>"),
        ("[[source]]", "[[sauce]]", "sauce"),
    ],
)
def test_a_description_that_makes_no_sense_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(WHOLE, encoding="utf-8")
    assert load_line_description("mine.toml", tmp_path).id == "x"
    assert old in WHOLE
    path.write_text(WHOLE.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load_line_description("mine.toml", tmp_path)
    assert refused.value.file == str(path)
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("name", "answers", "place", "said"),
    [
        ("burster-9250", {}, "sensor.line.description", "mantracourt-dsc"),
        ("mantracourt-dsc", {"decimals": "three"}, "sensor.line.answers.decimals", "not a whole number"),
        ("mantracourt-dsc", {"decimals": MOST_DIGITS + 1}, "sensor.line.answers", "cannot be"),
        ("mantracourt-dsc", {"stations": "1"}, "sensor.line.answers.stations", "did you mean station"),
    ],
)
def test_what_does_not_fit_is_refused_by_its_key(
    tmp_path: Path, name: str, answers: dict[str, Any], place: str, said: str
) -> None:
    with pytest.raises(BadInput, match=said) as refused:
        SENSOR.driver(entry(tmp_path, name, **answers), InstrumentSite(tmp_path, WallClock(), "sensor"))
    assert refused.value.place == place


def test_a_rate_that_the_line_cannot_carry_is_reckoned(tmp_path: Path) -> None:
    # 11 characters of question and 11 of answer, ten bits each: 436 a second at 96 000 baud would be.
    settings = entry(tmp_path, "mantracourt-dsc").model_copy(update={"baud": 9600})
    site = InstrumentSite(tmp_path, WallClock(), "sensor")
    SENSOR.driver(settings.model_copy(update={"rate_Hz": 43.6}), site)
    with pytest.raises(BadInput, match=r"9600 baud and the device take 43\.6 values"):
        SENSOR.driver(settings.model_copy(update={"rate_Hz": 44.0}), site)


def test_a_stand_lists_one_and_checks_it(tmp_path: Path) -> None:
    """An amplifier of a stand file: written back as it was, and served by the simulated stand."""
    settings = AMPLIFIER.settings.model_validate(
        {
            "protocol": "ascii-line",
            "port": "wire",
            "rate_Hz": 10.0,
            "range_kN": 630.0,
            "channel": {"name": "force_2", "quantity": "force", "unit": "kN"},
            "line": {"description": "tecsis-eze30", "answers": {"address": 1, "decimals": 3}},
        }
    )
    again = AMPLIFIER.settings.model_validate_json(settings.model_dump_json())
    assert again == settings
    assert AMPLIFIER.ends(settings, tmp_path) == (-99999, 99999)
