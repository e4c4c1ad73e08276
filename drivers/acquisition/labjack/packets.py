"""What a stream sends: packets on the stream port, and replies at STREAM_DATA_CR.

Sources: T-Series Datasheet 3.2.4 (Low-Level Stream); statuses: ``ljm_constants.json``. The layout of the
packet's head is also in LabJack's C example for the T7 (function 76, type 16).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HEAD_BYTES = 16
FUNCTION, TYPE = 76, 16
MOST_SAMPLES = 512
"""Samples in a packet on the network."""
REPLY_HEAD = 4
"""Registers before the samples at STREAM_DATA_CR."""
RECOVERING, RECOVERED, OVERLAP, SKIPPED_OVERFLOW, BURST_COMPLETE, FULL = 2940, 2941, 2942, 2943, 2944, 2945
SEPARATOR = 0xFFFF
"""A scan of such samples parts what was taken before an overflow from what was taken after it."""
ENDS = (SKIPPED_OVERFLOW, BURST_COMPLETE, FULL)
"""Behind these the stream has ended, or how much was skipped is not known."""


@dataclass(frozen=True)
class StreamPacket:
    """Samples and what the device says of its stream.

    Parameters
    ----------
    samples : NDArray[uint16]
        Input by input, scan by scan.
    backlog_bytes : int
        What waits in the device.
    status : int
        0, or one of the statuses above.
    additional : int
        With RECOVERED the scans that were skipped.
    transaction : int or None
        Number of a packet, from 0 to 65535 and over again; None of a reply.
    """

    samples: NDArray[np.uint16]
    backlog_bytes: int
    status: int
    additional: int
    transaction: int | None = None


class NotAPacketError(ValueError):
    """The bytes are no packet of a stream: the connection is to be closed."""


def body_bytes(head: bytes) -> int:
    """Return how many bytes follow on the head of a packet.

    Raises
    ------
    NotAPacketError
        If it is no head of one.
    """
    _, protocol, length, _, function, kind = struct.unpack(">HHHBBB", head[:9])
    if protocol != 0 or function != FUNCTION or kind != TYPE or length < HEAD_BYTES - 6 or length % 2:
        raise NotAPacketError(f"{head.hex(' ')} is no head of a stream packet")
    return int(length) - (HEAD_BYTES - 6)


def packet_of(head: bytes, body: bytes) -> StreamPacket:
    """Return a packet from its head and what follows."""
    backlog, status, additional = struct.unpack(">HHH", head[10:16])
    transaction = int.from_bytes(head[:2], "big")
    samples = np.frombuffer(body, dtype=">u2").astype(np.uint16)
    return StreamPacket(samples, backlog, status, additional, transaction)


def reply_of(words: Sequence[int]) -> StreamPacket:
    """Return what a read at STREAM_DATA_CR gave.

    Raises
    ------
    NotAPacketError
        If it says that it holds more samples than were asked for.
    """
    count, backlog, status, additional = words[:REPLY_HEAD]
    if count > len(words) - REPLY_HEAD:
        raise NotAPacketError(f"it says {count} samples, {len(words) - REPLY_HEAD} were asked for")
    samples = np.array(words[REPLY_HEAD : REPLY_HEAD + count], dtype=np.uint16)
    return StreamPacket(samples, backlog, status, additional)
