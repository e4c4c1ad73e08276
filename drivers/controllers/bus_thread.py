"""The owner of a bus: one thread that polls in time and does what others ask for in between."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, Protocol, TypeVar

from bufferstand.foundation import Clock

_LONGEST_WAIT_S = 0.05
_FIRST_WAIT_S = 0.001

_Result = TypeVar("_Result")


class Bus(Protocol):
    """Who owns a bus."""

    def call(self, job: Callable[[], _Result]) -> _Result:
        """Have a job done by the owner, and return its result; what it raises is raised here."""
        ...

    def begin(self) -> None:
        """Poll from now on."""
        ...

    def close(self) -> None:
        """End after the job under way; never raises."""
        ...


class BusThread:
    """Runs jobs, and a poll each time that one is due, all in one thread.

    Parameters
    ----------
    poll : callable
        Makes one poll for a slot, by its number; never raises.
    period_s : float
        Time between two slots [s of stand time].
    clock : Clock
        Stand time.
    """

    def __init__(self, poll: Callable[[int], None], period_s: float, clock: Clock) -> None:
        self._poll = poll
        self._period_s = period_s
        self._clock = clock
        self._jobs: queue.SimpleQueue[tuple[Callable[[], Any], Future[Any]] | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._origin: tuple[float, float] | None = None
        self._slot = 0

    def call(self, job: Callable[[], _Result]) -> _Result:
        """Have a job done by the owner, and return its result; what it raises is raised here.

        Raises
        ------
        Exception
            Whatever the job raised.
        """
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="bus", daemon=True)
            self._thread.start()
        done: Future[_Result] = Future()
        self._jobs.put((job, done))
        return done.result()

    def begin(self) -> None:
        """Poll from now on: slot 0 is due at once. To be called by a job."""
        if self._origin is None:
            self._origin = (self._clock.now_s(), self._clock.wall_s())

    def close(self) -> None:
        """End the thread after the job under way; never raises."""
        thread, self._thread = self._thread, None
        if thread is not None:
            self._jobs.put(None)
            thread.join()

    def _run(self) -> None:
        while True:
            try:
                wait_s = self._wait_s()
                item = self._jobs.get(timeout=wait_s) if wait_s > 0.0 else self._jobs.get_nowait()
            except queue.Empty:
                self._poll_if_due()
                continue
            if item is None:
                return
            job, done = item
            try:
                done.set_result(job())
            except BaseException as error:  # noqa: BLE001 - it is raised where the job came from
                done.set_exception(error)
            self._poll_if_due()

    def _poll_if_due(self) -> None:
        """Make the newest poll that is due; those before it that nobody had time for are left out."""
        if self._origin is None:
            return
        due = int((self._clock.now_s() - self._origin[0]) / self._period_s)
        if due >= self._slot:
            self._slot = due + 1
            self._poll(due)

    def _wait_s(self) -> float:
        """Return how long the wall takes until the next slot."""
        if self._origin is None:
            return _LONGEST_WAIT_S
        now_s, wall_s = self._clock.now_s(), self._clock.wall_s()
        gone_s = now_s - self._origin[0]
        left_s = self._slot * self._period_s - gone_s
        if left_s <= 0.0:
            return 0.0
        if gone_s <= 0.0:
            return _FIRST_WAIT_S
        # A simulated stand's second may be shorter than the wall's.
        return min(_LONGEST_WAIT_S, left_s * (wall_s - self._origin[1]) / gone_s)
