"""Keys in the terminal of a running campaign: c, s and n; Ctrl-C stays what it is."""

from __future__ import annotations

import os
import select
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from bufferstand.daq.operator.notes import LONGEST
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest

HELP = "keys: Ctrl-C stop now · c stop after the cycle · s stop after the step · n note (end with Enter)"
_POLL_S = 0.2
_BACKSPACE = ("\x7f", "\b")


class Keys:
    """Understands keys, one character after the other.

    Parameters
    ----------
    request : StopRequest
        Where wishes and notes go.
    say : callable
        Shows a line.
    """

    def __init__(self, request: StopRequest, say: Callable[[str], object]) -> None:
        self._request = request
        self._say = say
        self._note: str | None = None

    def press(self, key: str) -> None:
        """Take one character; while a note is written, every key belongs to it."""
        if self._note is not None:
            self._write(key)
        elif key == "c":
            self._request.ask(StopLevel.AFTER_CYCLE, "key c")
            self._say("stopping after the cycle")
        elif key == "s":
            self._request.ask(StopLevel.AFTER_STEP, "key s")
            self._say("stopping after the step")
        elif key == "n":
            self._note = ""
            self._say("note: write it and press Enter (Escape drops it)")
        elif key.isprintable() and key.strip():
            self._say(HELP)

    def _write(self, key: str) -> None:
        note = self._note or ""
        if key in ("\r", "\n"):
            self._note = None
            if note.strip():
                self._request.note(note.strip())
        elif key == "\x1b":
            self._note = None
            self._say("note dropped")
        elif key in _BACKSPACE:
            self._note = note[:-1]
        elif key.isprintable() and len(note) < LONGEST:
            self._note = note + key


@contextmanager
def keys_from(stream: TextIO, request: StopRequest, say: Callable[[str], object]) -> Iterator[None]:
    """While inside, keys of a terminal are heard at once and not echoed; anything else is left alone.

    Parameters
    ----------
    stream : TextIO
        Standard input.
    request, say
        As of :class:`Keys`.
    """
    with characters_from(stream, Keys(request, say).press) as heard:
        if heard:
            say(HELP)
        yield


@contextmanager
def characters_from(stream: TextIO, press: Callable[[str], object]) -> Iterator[bool]:
    """While inside, every character of a terminal is handed on at once, from a thread, and not echoed.

    Yields
    ------
    bool
        Whether there is a terminal that is ours; anything else is left alone.
    """
    try:
        descriptor = stream.fileno()
        # A process in the background must not touch the terminal: it would be stopped for it.
        ours = os.isatty(descriptor) and os.tcgetpgrp(descriptor) == os.getpgrp()
        before = termios.tcgetattr(descriptor) if ours else None
    except (OSError, ValueError, termios.error):
        before = None
    if before is None:
        yield False
        return
    ending = threading.Event()
    thread = threading.Thread(target=_read, args=(descriptor, press, ending), name="keys", daemon=True)
    tty.setcbreak(descriptor)
    thread.start()
    try:
        yield True
    finally:
        ending.set()
        thread.join()
        with suppress(termios.error):  # the terminal may be gone: why it ends is said by SIGHUP
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _read(descriptor: int, press: Callable[[str], object], ending: threading.Event) -> None:
    pending = b""
    while not ending.is_set():
        if not select.select([descriptor], [], [], _POLL_S)[0]:
            continue
        try:
            came = os.read(descriptor, 64)
        except OSError:
            return
        if not came:
            return  # the terminal is gone; SIGHUP says the rest
        pending += came
        try:
            text, pending = pending.decode(), b""
        except UnicodeDecodeError:
            if len(pending) > 4:
                pending = b""
            continue
        for key in text:
            press(key)
