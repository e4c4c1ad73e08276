"""The byte stream of a GSV-2 amplifier: frames of five bytes without a checksum, found by their spacing.

A frame is ``,`` (0x2C), a status byte (only bits 3 and 4, the threshold switches, can be set) and 24 bits,
big-endian, offset binary: 0x800000 is zero. 0x2C also occurs inside data, so one byte proves nothing: a frame
counts only if the next one begins right behind it, and after garbage four in a row are needed.
Source: ME-Messysteme, GSV-2 manual, binary format; set of facts in docs/drivers.md.
"""

from __future__ import annotations

from dataclasses import dataclass

SYNC = 0x2C
ZERO = 0x800000
"""24-bit value of zero in bipolar operation."""
FRAME_BYTES = 5
_STATUS_BITS = 0x18
_AHEAD = FRAME_BYTES + 2  # a frame, and sync and status of the next
_CONFIRM = 4
_SEARCH_BYTES = (FRAME_BYTES - 1) + (_CONFIRM - 1) * FRAME_BYTES + 2  # so that each offset can show them
_UNDECIDED = 64  # frames after which two readings of the stream are not told apart by waiting


@dataclass(frozen=True)
class Frame:
    """One measured value.

    Parameters
    ----------
    count : int
        Value minus 0x800000, −8388608 … 8388607.
    status : int
        Status byte.
    lost : int
        Frames missing before this one (estimated from the bytes that were skipped).
    """

    count: int
    status: int
    lost: int


class FrameDecoder:
    """Finds frames in a stream of bytes that comes in pieces.

    Parameters
    ----------
    aligned : bool
        Whether the first byte is known to begin a frame (the stream was stopped and started).
    """

    def __init__(self, *, aligned: bool = False) -> None:
        self._buffer = bytearray()
        self._aligned = aligned
        self._found_once = aligned
        self._skipped = 0
        self.resyncs = 0
        """How often the spacing was lost."""
        self.skipped_bytes = 0
        """Bytes that belonged to no frame."""

    @property
    def pending_frames(self) -> int:
        """Frames that have begun to come in and are not delivered yet."""
        return -(-len(self._buffer) // FRAME_BYTES)

    @property
    def undecided(self) -> bool:
        """Whether the stream can be read in two ways for so long that only a restart helps."""
        return not self._aligned and len(self._buffer) > (_UNDECIDED + 1) * FRAME_BYTES

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that are certain by now."""
        self._buffer += data
        frames: list[Frame] = []
        while self._aligned or self._search():
            if len(self._buffer) < _AHEAD:
                break
            if not (self._begins(0) and self._begins(FRAME_BYTES)):
                self._aligned = False
                self.resyncs += 1
                self._skip(1)
                continue
            lost = round(self._skipped / FRAME_BYTES) if self._found_once else 0
            self._found_once = True
            self._skipped = 0
            count = int.from_bytes(self._buffer[2:FRAME_BYTES], "big") - ZERO
            frames.append(Frame(count, self._buffer[1], lost))
            del self._buffer[:FRAME_BYTES]
        return frames

    def _begins(self, offset: int) -> bool:
        return self._buffer[offset] == SYNC and not self._buffer[offset + 1] & ~_STATUS_BITS

    def _run(self, offset: int) -> tuple[int, bool]:
        """Return how many frames follow each other from ``offset``, and whether the bytes end there."""
        frames = 0
        while offset + 1 < len(self._buffer):
            if not self._begins(offset):
                return frames, False
            frames += 1
            offset += FRAME_BYTES
        return frames, True

    def _search(self) -> bool:
        """Look for frames in a row, dropping what cannot begin one; return whether they are found.

        Steady values can make 0x2C appear at two places of every frame. Then it waits until noise breaks
        one of the two readings.
        """
        while len(self._buffer) >= _SEARCH_BYTES:
            runs = [(*self._run(offset), offset) for offset in range(FRAME_BYTES)]
            likely = [run for run in runs if run[0] >= _CONFIRM]
            still_true = [run for run in likely if run[1]]
            if len(still_true) > 1:
                return False
            if not likely:
                self._skip(1)
                continue
            self._skip((still_true or [max(likely)])[0][2])
            self._aligned = True
            return True
        return False

    def _skip(self, count: int) -> None:
        del self._buffer[:count]
        self._skipped += count
        self.skipped_bytes += count
