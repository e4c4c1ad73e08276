"""Asking a campaign to stop: a flag that signals, terminals and programs set, and the loop obeys.

A signal handler does nothing but set the flag, so that no signal can break into a safe stop.
"""

from __future__ import annotations

import signal
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from types import FrameType
from typing import TypeVar

from bufferstand.foundation.operating_system import ENDING_SIGNALS

Taken = TypeVar("Taken")
STOP_SIGNALS = ENDING_SIGNALS
"""Every one of them ends the campaign by the same safe stop."""


class StopLevel(IntEnum):
    """How soon the operator wants the campaign to end."""

    NONE = 0
    AFTER_STEP = 1
    AFTER_CYCLE = 2
    NOW = 3


_HOW = {
    StopLevel.NOW: "now",
    StopLevel.AFTER_CYCLE: "after the cycle",
    StopLevel.AFTER_STEP: "after the step",
}
LATER_SIGNALS = {
    getattr(signal, name): (level, f"{name} ({_HOW[level]})")
    for name, level in (("SIGUSR1", StopLevel.AFTER_CYCLE), ("SIGUSR2", StopLevel.AFTER_STEP))
    if hasattr(signal, name)
}
"""They let what is under way come to its end first."""


class StopRequest:
    """A wish to stop that can be raised, never lowered; safe to set from a signal handler."""

    def __init__(self) -> None:
        self._level = StopLevel.NONE
        self._reason = ""
        self._notes: deque[str] = deque()
        self._wishes: deque[str] = deque()
        self._findings: deque[tuple[str, str]] = deque()

    def ask(self, level: StopLevel, reason: str) -> None:
        """Ask for a stop; the strongest wish counts, and its first reason is kept."""
        if level > self._level:
            self._reason = reason
            self._level = level
            self._wishes.append(f"asked to stop {_HOW[level]}: {reason}")

    @property
    def level(self) -> StopLevel:
        """Return how soon."""
        return self._level

    @property
    def reason(self) -> str:
        """Return who or what asked, for a person."""
        return self._reason

    def take_wishes(self) -> list[str]:
        """Return (and forget) what was asked for, each in one line: it belongs into the run at once."""
        return _drained(self._wishes)

    def note(self, text: str) -> None:
        """Hand over a note of the operator's."""
        self._notes.append(text)

    def find(self, by: str, text: str) -> None:
        """Hand over what a program beside the campaign has found in its data (the twin)."""
        self._findings.append((by, text))

    def take_findings(self) -> list[tuple[str, str]]:
        """Return (and forget) what was found: by whom, and the text."""
        return _drained(self._findings)

    def take_notes(self) -> list[str]:
        """Return (and forget) the notes that were handed over."""
        return _drained(self._notes)


def _drained(waiting: deque[Taken]) -> list[Taken]:
    """Return (and forget) what waits; what another thread hands over meanwhile is taken now or next time."""
    taken: list[Taken] = []
    while waiting:
        taken.append(waiting.popleft())
    return taken


@contextmanager
def stop_on_signals(request: StopRequest) -> Iterator[StopRequest]:
    """While inside, SIGINT, SIGTERM and SIGHUP ask for a stop now, SIGUSR1 and SIGUSR2 for a later one.

    The handlers before are put back. Must be entered in the main thread. Further signals change
    nothing: the safe stop runs to its end.

    Raises
    ------
    ValueError
        If entered in another thread than the main one (Python's rule for signal handlers).
    """

    def handler(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - Python's signature
        name = signal.Signals(number).name
        if later := LATER_SIGNALS.get(signal.Signals(number)):
            request.ask(*later)
            return
        request.ask(StopLevel.NOW, "Ctrl-C (SIGINT)" if name == "SIGINT" else name)

    before = {number: signal.signal(number, handler) for number in (*STOP_SIGNALS, *LATER_SIGNALS)}
    try:
        yield request
    finally:
        for number, handle in before.items():
            signal.signal(number, handle)


@contextmanager
def signals_held_back() -> Iterator[None]:
    """While inside, the stop signals wait; the last one that came is delivered on the way out.

    In another thread than the main one it does nothing: Python delivers signals to the main thread only.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[int] = []

    def handler(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - Python's signature
        waiting.append(number)

    before = {number: signal.signal(number, handler) for number in STOP_SIGNALS}
    try:
        yield
    finally:
        for number, handle in before.items():
            signal.signal(number, handle)
        if waiting:
            signal.raise_signal(waiting[-1])
