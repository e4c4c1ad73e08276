"""Tap, witness and rules see what they are to see: against made-up requests and looks, and a served stand."""

from __future__ import annotations

import struct
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.two_programs import rules
from tests.two_programs.programs import patiently
from tests.two_programs.registers import ADDRESSES, WRITE_MANY, WRITE_ONE, WRITTEN, decode
from tests.two_programs.tap import Request, parse
from tests.two_programs.witness import Look, Witness

FIRST, SECOND = 11, 22


def wrote(time_s: float, pid: int, name: str, value: int, refused: int | None = None) -> Request:
    return Request(time_s, pid, WRITE_ONE, None, {ADDRESSES[name][0]: value}, refused)


def met(*requests: Request) -> Any:
    """As much of a bench as the lock's rule looks at."""
    return SimpleNamespace(tap=SimpleNamespace(requests=list(requests)), name=str)


TAKEN = wrote(1.0, FIRST, "writer", 7)


@pytest.mark.parametrize(
    "request_of_second",
    [
        wrote(2.0, SECOND, "control_word", 0),
        wrote(2.0, SECOND, "watchdog_feed", 3),
        wrote(2.0, SECOND, "writer", 0),
        wrote(2.0, SECOND, "execute", 4),
    ],
    ids=str,
)
def test_what_another_writes_under_the_first_ones_lock_is_seen(request_of_second: Request) -> None:
    (found,) = rules.written_without_lock(met(TAKEN, request_of_second))
    assert found.startswith(str(SECOND))


def test_what_is_allowed_is_not_complained_of() -> None:
    assert not rules.written_without_lock(
        met(
            TAKEN,
            wrote(1.5, FIRST, "control_word", 15),
            wrote(2.0, SECOND, "writer", 9, refused=3),
            wrote(2.1, SECOND, "request_number", 5),
            wrote(2.2, SECOND, "ring_acknowledge", 5),
            wrote(3.0, FIRST, "control_word", 0),
            wrote(3.1, FIRST, "writer", 0),
            wrote(4.0, SECOND, "writer", 9),
            wrote(4.1, SECOND, "watchdog_feed", 1),
        )
    )


def test_a_lock_that_was_given_back_or_forgotten_covers_nothing_more() -> None:
    late = met(TAKEN, wrote(1.0 + rules.FORGOTTEN_S + 0.1, FIRST, "watchdog_feed", 3))
    given = met(TAKEN, wrote(2.0, FIRST, "writer", 0), wrote(2.1, FIRST, "watchdog_feed", 3))
    assert len(rules.written_without_lock(late)) == len(rules.written_without_lock(given)) == 1


def test_a_request_is_read_from_its_bytes() -> None:
    many = struct.pack(">HHHBBHHB4H", 1, 0, 15, 1, WRITE_MANY, 66, 4, 8, 0x41F0, 0, 0x41A0, 0)
    request = parse(many, FIRST)
    assert request.value("target_mm") == 30.0
    assert "target_mm" in request.commands
    both = struct.pack(">HHHBBHHHHBH", 1, 0, 13, 1, 23, 16, 25, 99, 1, 2, 77)
    assert parse(both, FIRST).value("request_number") == 77
    assert not parse(both, FIRST).commands


def look(time_s: float, force_kN: float, *, on: bool) -> Look:
    return Look(time_s, {"force_kN": force_kN, "status_word": 0x27 if on else 0x40})


def witness(*looks: Look) -> Witness:
    """A witness that has seen this, and looks no more."""
    made = Witness.__new__(Witness)
    made._looks = list(looks)
    return made


def test_a_valve_that_goes_off_under_load_is_seen() -> None:
    cut = witness(look(0.0, 80.0, on=True), look(0.1, 79.0, on=False), look(5.0, 0.0, on=False))
    released = witness(look(0.0, 80.0, on=True), look(2.0, 0.3, on=True), look(2.1, 0.2, on=False))
    assert [seen.force_kN for seen in cut.cut_off(0.0)] == [79.0]
    assert not list(released.cut_off(0.0))
    assert cut.safe_since(0.0) == 5.0
    assert released.safe_since(0.0) == 2.1


def test_a_register_that_changes_past_the_tap_is_seen() -> None:
    held = dict.fromkeys(WRITTEN, 0.0)
    seen = witness(Look(5.0, held), Look(5.1, {**held, "watchdog_feed": 8.0}))
    assert list(seen.changed()) == [("watchdog_feed", 5.0, 5.1)]
    for time_s, wrong in ((5.0, 0), (3.0, 1)):
        requests = [wrote(time_s, FIRST, "watchdog_feed", 8)]
        stand: Any = SimpleNamespace(tap=SimpleNamespace(requests=requests), witness=seen)
        assert len(rules.past_the_tap(stand)) == wrong


def test_a_meeting_is_had_again_only_where_the_computer_was_too_busy(tmp_path: Path) -> None:
    def busy_once(folder: Path) -> str:
        folder.mkdir(parents=True)
        first = folder.name == "0"
        (folder / "1-run.txt").write_text(
            "note: the reader has been behind the stand for 2 s" if first else ""
        )
        return "wrong" if first else "wrong again"

    assert patiently(busy_once, tmp_path / "a", lambda result: result == "fine") == "wrong again"
    assert patiently(busy_once, tmp_path / "b", lambda result: result == "wrong") == "wrong"


def test_both_words_of_a_value_are_read() -> None:
    high, low = struct.unpack(">HH", struct.pack(">f", 83.25))
    assert decode("force_kN", {28: high, 29: low}) == 83.25
