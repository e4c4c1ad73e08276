"""Whole scans out of the samples of a stream, each with its number; what is missing is counted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bufferstand.drivers.acquisition.labjack.packets import RECOVERED, SEPARATOR, StreamPacket

SEPARATOR_WITHIN = 4
"""Packets, from the one that says that an overflow is over, in which the separator is looked for."""


@dataclass(frozen=True)
class Scans:
    """Scans that follow each other.

    Parameters
    ----------
    first : int
        Number of the first since the stream's start, with those that were lost.
    samples : NDArray[uint16]
        Shape (scans, inputs).
    lost : int
        Scans missing just before the first.
    """

    first: int
    samples: NDArray[np.uint16]
    lost: int


class ScanAssembly:
    """Puts packets together to scans.

    Parameters
    ----------
    inputs : int
        Samples of a scan.
    samples_per_packet : int
        Samples of a full packet: so many are missing with each packet that is.
    separator_counted : bool
        Whether the scan of 0xFFFF behind an overflow is one of those that the device says it skipped.
    """

    def __init__(self, inputs: int, samples_per_packet: int, *, separator_counted: bool = True) -> None:
        self._inputs, self._per_packet = inputs, samples_per_packet
        self._counted = separator_counted
        self._rest = np.zeros(0, dtype=np.uint16)
        self._transaction: int | None = None
        self.next = 0
        """Number of the next scan."""
        self._lost = 0
        self._skipped: int | None = None
        self._waited = 0

    def miss(self, scans: int) -> None:
        """Count scans that will not come: the stream was started anew."""
        self._rest = self._rest[:0]
        self._transaction = self._skipped = None
        self.next += scans
        self._lost += scans

    def take(self, packet: StreamPacket) -> tuple[list[Scans], int]:
        """Take a packet.

        Returns
        -------
        (list of Scans, int)
            Its scans, in stretches without a hole; and how many packets were missing before it.
        """
        missing = self._missing(packet)
        if missing:
            # A packet holds whole scans; a rest of one before the hole would be of no whole scan.
            self.miss(missing * self._per_packet // self._inputs)
            self._transaction = packet.transaction
        if packet.status == RECOVERED:
            self._skipped = packet.additional + (0 if self._counted else 1)
            self._waited = 0
        joined = np.concatenate((self._rest, packet.samples)) if self._rest.size else packet.samples
        whole = joined.size // self._inputs
        self._rest = joined[whole * self._inputs :]
        return self._parted(joined[: whole * self._inputs].reshape(whole, self._inputs)), missing

    def _missing(self, packet: StreamPacket) -> int:
        before, self._transaction = self._transaction, packet.transaction
        if before is None or packet.transaction is None:
            return 0
        return (packet.transaction - before - 1) % 0x10000

    def _parted(self, scans: NDArray[np.uint16]) -> list[Scans]:
        """Part scans at the separator of an overflow, where one is due; it is no measurement."""
        found: list[Scans] = []
        if self._skipped is not None:
            at = np.flatnonzero(np.all(scans == SEPARATOR, axis=1))
            self._waited += 1
            if at.size or self._waited > SEPARATOR_WITHIN:
                before = at[0] if at.size else 0
                found += self._numbered(scans[:before])
                scans = scans[before + (1 if at.size else 0) :]
                self.next += self._skipped
                self._lost += self._skipped
                self._skipped = None
        return found + self._numbered(scans)

    def _numbered(self, scans: NDArray[np.uint16]) -> list[Scans]:
        if not len(scans):
            return []
        one = Scans(self.next, scans, self._lost)
        self.next += len(scans)
        self._lost = 0
        return [one]
