"""A device at the far end of a wire: what it does again and again, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Pump:
    """Does ``once`` every ``pause_s`` until it is closed."""

    def __init__(self, once: Callable[[], object], pause_s: float = 0.001) -> None:
        self._once = once
        self._pause_s = pause_s
        self.ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        self.ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self.ended.wait(self._pause_s):
            self._once()
