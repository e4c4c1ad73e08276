"""What a simulated instrument is, seen from its wire."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int64]


class WireDevice(Protocol):
    """An instrument at the far end of a serial line. It keeps to its maker's manual, not to our driver."""

    def obey(self, data: bytes) -> bytes:
        """Take bytes from the line; return the answers."""
        ...

    def send(self, counts: Counts, *, overload: bool = False) -> bytes:
        """Take new values, shape (n,) about zero; return what goes onto the line by itself."""
        ...
