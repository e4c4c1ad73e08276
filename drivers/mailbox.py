"""Holds what a sensor's thread has read until the acquisition loop fetches it."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import replace

from bufferstand.drivers.interfaces import SampleBlock, SensorFault


class Mailbox:
    """Keeps blocks and faults of one stream in order; if nobody fetches them, the oldest blocks go, counted.

    Parameters
    ----------
    limit : int
        Blocks and faults that are kept at most.
    """

    def __init__(self, limit: int = 10_000) -> None:
        self._limit = limit
        self._items: deque[SampleBlock | SensorFault] = deque()
        self._dropped_samples = 0
        self._lock = threading.Lock()

    def put(self, item: SampleBlock | SensorFault) -> None:
        """Leave a block or a fault."""
        with self._lock:
            if len(self._items) >= self._limit:
                oldest = self._items.popleft()
                if isinstance(oldest, SampleBlock):
                    self._dropped_samples += len(oldest.time_us) + oldest.lost
            self._items.append(item)

    def take(self) -> Sequence[SampleBlock | SensorFault]:
        """Fetch everything; samples that had to go are ``lost`` before the first block."""
        with self._lock:
            items = list(self._items)
            self._items.clear()
            if self._dropped_samples:
                for position, item in enumerate(items):
                    if isinstance(item, SampleBlock):
                        items[position] = replace(item, lost=item.lost + self._dropped_samples)
                        self._dropped_samples = 0
                        break
            return items
