"""The sample stream: a plot that captures continuously, read by its dynamic upload area.

Source: RMC70/150 and RMCTools User Manual 3.62, pp. 187 to 192. A read begins at register 0 and gives
mode and status, samples asked for, index of the first sample, plot number, samples given, then the data, one
data set after the other. A read without enough captured samples gives none.

Not said there: whether a lost reply has moved the index. So each reply's own index is compared with the one
that is due; where it is ahead, the due one is written (the register can be) and read again.
"""

from __future__ import annotations

import math
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.controllers.rmc.addresses import RmcAddress
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters
from bufferstand.foundation import DeviceFault

RECENT_S = 1.0
"""So long a sample tells the plot's clock [s]: the two clocks drift apart."""
HEAD = 5
"""Registers of 32 bits before the data."""
CONTINUOUS = 2
MODE_ASKED, REQUESTED, INDEX = 0, 1, 2
MISMATCH, OVERRAN = 1, 2
SAMPLE_PERIOD, STATE = 2, 9
CAPTURING_ON = 0
"""State of a plot that captures continuously."""
_WHOLE, _HALF = 1 << 32, 1 << 31
REARM = "issue Rearm Plot (103) for it in RMCTools and disable its automatic trigger"


def samples_per_read(largest_read: int, sets: int) -> int:
    """Return how many samples a set one read can give.

    Parameters
    ----------
    largest_read : int
        Registers of 16 bits.
    sets : int
        Data sets of the plot.
    """
    return max(0, (largest_read // 2 - HEAD) // sets)


@dataclass(frozen=True)
class PlotBlock:
    """Samples of one read.

    Parameters
    ----------
    first : int
        Sequence number of the first, from 0 at the start of the upload.
    rows : NDArray[float32]
        Shape (samples, data sets).
    lost : int
        Samples known to be lost before it.
    """

    first: int
    rows: NDArray[np.float32]
    lost: int


class PlotUpload:
    """Reads one plot from its start of uploading on.

    Parameters
    ----------
    registers : RmcRegisters
    setup, upload : RmcAddress
        Of the plot.
    sets : int
        Data sets that it must have.
    samples : int
        Of a set in one read.
    now_s : callable
        The computer's clock, by which what an overrun lost is counted [s].
    note : callable
        Takes what is to be said.
    """

    def __init__(
        self,
        registers: RmcRegisters,
        setup: RmcAddress,
        upload: RmcAddress,
        *,
        sets: int,
        samples: int,
        now_s: Callable[[], float],
        note: Callable[[str], None],
    ) -> None:
        self._registers, self._setup, self._upload = registers, setup, upload
        self._sets, self._samples, self._now_s, self._note = sets, samples, now_s, note
        self._plot_id: int | None = None
        self._base = 0  # sequence number of the RMC's index 0
        self._rate_Hz = 0.0
        self._offsets_s: deque[tuple[float, float]] = deque()
        self._anchored = self._overran = False
        self._restarts = 0
        self.next = 0
        """Sequence number of the sample that is due."""
        self.overruns = 0

    def rate(self) -> float:
        """Get the plot's sample rate [Hz]; see that it captures continuously.

        Raises
        ------
        DeviceFault
            If it does not, or its period is none.
        """
        found = self._registers.reals(self._setup, STATE + 1, "the plot's settings")
        period_s, state = found[SAMPLE_PERIOD], found[STATE]
        if state != CAPTURING_ON:
            raise DeviceFault(f"plot {self._setup} does not capture continuously (state {state:g}); {REARM}")
        if not (math.isfinite(period_s) and period_s > 0.0):
            raise DeviceFault(
                f"plot {self._setup} states a sample period of {period_s:g} s; look in RMCTools"
            )
        # 32-bit seconds of a period like 0.001 are not exact: the rate is one of whole microseconds
        self._rate_Hz = 1e6 / max(1, round(period_s * 1e6))
        return self._rate_Hz

    def begin(self) -> None:
        """Set the upload to continuous, from the plot's present start on."""
        self._registers.set_whole(self._upload.plus(REQUESTED), self._samples, "samples a read")
        self._registers.set_whole(self._upload, CONTINUOUS, "the mode of the plot's upload")
        self._plot_id, self._anchored = None, False

    def clock_us(self) -> int:
        """Return the plot's clock about now [µs], never behind what a look at the axis has shown.

        The upload shows none: it is told by the sample of the last second that was read soonest, and what one
        read holds is added.
        """
        if not self._offsets_s:
            return 0
        return round((self._now_s() - self._earliest_s + self._samples / self._rate_Hz) * 1e6)

    @property
    def _earliest_s(self) -> float:
        """When sample 0 was made at the latest, by the computer's clock [s]: what was read soonest tells."""
        return min(offset_s for _, offset_s in self._offsets_s)

    @property
    def has_begun(self) -> bool:
        """Whether a first block has come."""
        return self._plot_id is not None

    def read(self) -> PlotBlock | None:
        """Get the samples that are due; None where there are not enough yet.

        Raises
        ------
        DeviceFault
            If the plot is another, is triggered, or the upload answers something else than asked for.
        """
        for _ in range(2):
            mode, asked, index, plot_id, given, data = self._once()
            status = mode >> 4 & 0xF
            if status == MISMATCH:
                raise DeviceFault(f"plot {self._upload} was triggered and is complete; {REARM}")
            if status == OVERRAN:
                self._restart()
                return None
            if asked != self._samples or mode & 0xF != CONTINUOUS:
                raise DeviceFault(
                    f"plot {self._upload} is read by another program: it gives {asked} samples in mode "
                    f"{mode & 0xF}, {self._samples} in mode {CONTINUOUS} were asked for"
                )
            if not given:
                return None
            if self._plot_id not in (None, plot_id):
                raise DeviceFault(f"plot {self._upload} was begun anew; {REARM}")
            self._plot_id = plot_id
            if given != self._samples:
                raise DeviceFault(
                    f"plot {self._upload} gives {given} samples, {self._samples} were asked for"
                )
            ahead = (index - (self.next - self._base) + _HALF) % _WHOLE - _HALF
            if ahead == 0 or not self._anchored:
                return self._taken(data, 0, index)
            due = (self.next - self._base) % _WHOLE
            self._note(f"plot {self._upload} answers from sample {index}, {due} is due; asked for again")
            self._registers.set_whole(self._upload.plus(INDEX), due, "the plot's current index")
        if ahead < 0:
            raise DeviceFault(
                f"plot {self._upload} answers from sample {index}, before {due} which was asked for twice"
            )
        return self._taken(data, ahead, index)  # it does not go back: what lies between is lost

    def _once(self) -> tuple[int, int, int, int, int, NDArray[np.float32]]:
        raw = self._registers.raw(self._upload, HEAD + self._samples * self._sets, "the plot's samples")
        head = struct.unpack(f">{HEAD}I", raw[: 4 * HEAD])
        data = np.frombuffer(raw[4 * HEAD :], dtype=">f4").astype(np.float32)
        return *head, data

    def _taken(self, data: NDArray[np.float32], lost: int, index: int) -> PlotBlock:
        now_s = self._now_s()
        if self._overran:
            last = math.floor((now_s - self._earliest_s) * self._rate_Hz)
            lost = max(1, last - self._samples + 1 - self.next)
            self._overran = False
            self._note(
                f"plot {self._upload} overran: about {lost} samples are lost, counted by the computer's clock"
            )
        if lost:
            self.overruns += 1
        first = self.next + lost
        if not self._anchored:  # wherever its index begins: the pages say zero
            self._base, self._anchored, self._restarts = first - index, True, 0
        self.next = first + self._samples
        self._offsets_s.append((now_s, now_s - (self.next - 1) / self._rate_Hz))
        while self._offsets_s[0][0] < now_s - RECENT_S:
            self._offsets_s.popleft()
        return PlotBlock(first, data.reshape(self._sets, self._samples).T, lost)

    def _restart(self) -> None:
        """Recover from an overrun by index 0, as on p. 189; where that does not help, by the mode."""
        self._restarts += 1
        if self._restarts % 2:
            self._registers.set_whole(self._upload.plus(INDEX), 0, "the plot's current index")
        else:
            self._registers.set_whole(self._upload, CONTINUOUS, "the mode of the plot's upload")
        self._overran, self._anchored = self.has_begun, False
