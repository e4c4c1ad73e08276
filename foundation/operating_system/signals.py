"""Signals that ask a program to end."""

from __future__ import annotations

import signal
from collections.abc import Collection, Iterator
from contextlib import contextmanager

ENDING_SIGNALS: tuple[signal.Signals, ...] = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Those of this system: Ctrl-C, a polite kill, and a terminal that was closed (not on Windows)."""


@contextmanager
def signals_held(numbers: Collection[signal.Signals] = ENDING_SIGNALS) -> Iterator[None]:
    """While inside, these signals wait in this thread; Windows cannot let them wait.

    A process that is started inside lets them wait, too, until it calls :func:`let_signals_come`.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def let_signals_come(numbers: Collection[signal.Signals] = ENDING_SIGNALS) -> None:
    """Let signals come in a process that was started while they were held."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)
