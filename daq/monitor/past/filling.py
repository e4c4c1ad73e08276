"""The history of a campaign as its page's server keeps it: what it hears, and what was recorded before."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path

from bufferstand.daq.monitor.past.history import History
from bufferstand.daq.monitor.past.recorded import recorded_history
from bufferstand.daq.monitor.view import View


class KeptHistory:
    """A history that is filled from the campaign's files once for each of its starts.

    Parameters
    ----------
    folder : Path
        The campaign's.
    view : View
        Is told when the past has come in.
    """

    def __init__(self, folder: Path, view: View) -> None:
        self.history = History()
        self._folder = folder
        self._view = view
        self._filled: int | None = None
        self._began_s: float | None = None
        self._wanted = asyncio.Event()

    def add(self, at_s: float, extremes: Mapping[str, Sequence[float | None]], starts: int | None) -> None:
        """Take what is heard of a campaign that runs.

        Parameters
        ----------
        at_s : float
            Stand time [s].
        extremes : mapping
            As of :meth:`History.add`.
        starts : int or None
            How often the campaign was started so far, as its record says; None before that was read.
        """
        self.want(starts, at_s)
        self.history.add(at_s, extremes)

    def want(self, starts: int | None, began_s: float | None = None) -> None:
        """Have the past put in, if it is not yet there for this start."""
        if starts is None or starts == self._filled:
            return
        self._filled, self._began_s = starts, began_s
        self._wanted.set()

    async def run(self) -> None:
        """Fill it whenever that is wanted, until cancelled."""
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            starts, began_s = self._filled, self._began_s
            if not await asyncio.to_thread(self._has_files):
                continue
            found = await recorded_history(self._folder, began_s)
            if found is None or starts != self._filled:
                continue
            if starts is not None and starts > 1 and began_s is not None:
                self.history.forget_before(began_s)  # an earlier start's, as it was told: its files are in it
            self.history.merge(found)
            self._view.put("history", {"first_s": self.history.first_s})

    def _has_files(self) -> bool:
        runs = self._folder / "runs"
        return any(True for pattern in ("*.h5", "*.journal") for _ in runs.glob(pattern))
