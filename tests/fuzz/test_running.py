"""What fuzzing looks for is seen: tracebacks, hangs, false figures, words that are no message."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest

from bufferstand.foundation.errors import LONGEST_WORD, BadInput
from tests.fuzz import mutators
from tests.fuzz.catalogue import TARGETS
from tests.fuzz.running import input_of, run_in
from tests.fuzz.target import Altered, Case, Read, Target


def of(read: Read, cpu_s: float = 10.0) -> Target:
    """Return a target with a reader of one's choice."""

    @contextmanager
    def begin(_: Path) -> Iterator[Case]:
        yield Case([b"a = 1\n"], read, mutators.of_text)

    return Target("one", "a test", begin, cpu_s=cpu_s)


def wrong(read: Read, folder: Path, cpu_s: float = 10.0) -> str:
    """Return what is told of the first input."""
    done, failures = run_in(folder, of(read, cpu_s), 0, range(1))
    assert done == 1
    return failures[0].what if failures else ""


def refused(_: bytes) -> object:
    raise BadInput("it is none", file="a.toml")


def two_lines(_: bytes) -> object:
    raise BadInput("it is\nnone", file="a.toml")


def altered(_: bytes) -> object:
    raise Altered("7 for 8")


def a_bug(_: bytes) -> object:
    return {}["key"]


def circles(_: bytes) -> object:
    while True:
        pass


def waits(_: bytes) -> object:
    return threading.Event().wait()


def prints(_: bytes) -> object:
    print("Traceback (most recent call last)", file=sys.stderr)
    return 0


def logs(_: bytes) -> object:
    try:
        return 1 / 0
    except ZeroDivisionError:
        logging.getLogger("asyncio").exception("in a task")
        return 0


@pytest.mark.parametrize(
    ("read", "told"),
    [
        (len, ""),
        (refused, ""),
        (two_lines, "its message is no line"),
        (altered, "altered without a word: 7 for 8"),
        (a_bug, "KeyError: 'key' (tests/fuzz/test_running.py"),
        (prints, "it printed a traceback"),
        (logs, "a traceback in the log: ZeroDivisionError"),
    ],
)
def test_what_an_input_ends_in_is_told(read: Callable[[bytes], object], told: str, tmp_path: Path) -> None:
    found = wrong(read, tmp_path)
    assert found.startswith(told)
    assert bool(found) is bool(told)


@pytest.mark.parametrize("read", [circles, waits])
def test_what_does_not_end_is_ended(read: Read, tmp_path: Path) -> None:
    assert wrong(read, tmp_path, 0.02) == "no end within 0.02 s"


def test_an_input_is_that_of_its_seed_and_number(tmp_path: Path) -> None:
    for name in ("campaign", "evaluation", "rmc-plot", "monitor"):
        folder = tmp_path / name
        folder.mkdir()
        with TARGETS[name].begin(folder) as case:
            made = [input_of(TARGETS[name], case, seed, number) for seed in (0, 1) for number in range(20)]
            again = [input_of(TARGETS[name], case, seed, number) for seed in (0, 1) for number in range(20)]
        assert made == again
        assert len(set(made)) > 30


@pytest.mark.parametrize("name", TARGETS)
def test_every_sample_is_taken_as_it_is(name: str, tmp_path: Path) -> None:
    with TARGETS[name].begin(tmp_path) as case:
        assert case.corpus
        for content in case.corpus[:1] if name in FIRST else case.corpus * (name not in DIALOGUES):
            case.read(content)


FIRST = ("plan", "run-document")
"""Reading the others takes seconds."""
DIALOGUES = ("gsv2-dialogue", "ascii-dialogue", "ds2480b", "desk", "modbus-tcp-client", "modbus-rtu-client")
"""Their samples end in a refusal: what they answer is a part of a dialogue only."""


def test_pieces_are_those_that_were_joined() -> None:
    parts = [b"", b"a", bytes(300)]
    assert mutators.pieces(mutators.joined(parts)) == parts
    swap = mutators.of_pieces(lambda piece, _: piece + b"x")
    assert any(swap(mutators.joined(parts), Random(seed)) != mutators.joined(parts) for seed in range(9))


def test_a_message_shows_the_ends_of_what_is_too_long() -> None:
    """Found by fuzzing: a name of 5,000 letters was repeated whole, and hid what was wrong with it."""
    told = str(BadInput(f"“{'a' * 5000}b” is no terminal", file="a.toml", place="input"))
    assert len(told) < 2 * LONGEST_WORD
    assert told.startswith("a.toml: input: “aaa")
    assert told.endswith("aab” is no terminal")
    assert "(5003 characters)" in told
    nested = str(BadInput(f"reply “{'{a = ' * 5000}1” does not match", file="a.toml"))
    assert len(nested) < 2 * LONGEST_WORD
