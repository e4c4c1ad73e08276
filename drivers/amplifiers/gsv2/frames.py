"""The byte stream of a GSV-2 amplifier: frames without a checksum, found by their spacing.

A frame is ``,`` (0x2C), a status byte (only bits 3 and 4, the threshold switches, can be set) and 24 bits,
big-endian, offset binary: 0x800000 is zero. 0x2C also occurs inside data, so one byte proves nothing: a frame
counts only if the next one begins right behind it, and after garbage four in a row are needed.

The short form is 0xA5 and 16 bits; with no status byte to tell, eight in a row are needed after garbage.
Source: ME-Messysteme, GSV-2AS manual, data output (p. 16) and “Set TXmode” (p. 38); see docs/sensors.md.
"""

from __future__ import annotations

from dataclasses import dataclass

SYNC = 0x2C
ZERO = 0x800000
"""24-bit value of zero in bipolar operation."""
FRAME_BYTES = 5
SHORT_SYNC = 0xA5
SHORT_ZERO = 0x8000
"""16-bit value of zero in bipolar operation."""
SHORT_FRAME_BYTES = 3
_STATUS_BITS = 0x18
_UNDECIDED = 64  # frames after which two readings of the stream are not distinguished by waiting


@dataclass(frozen=True)
class Gsv2Frame:
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


@dataclass(frozen=True)
class FrameForm:
    """How a frame is made.

    Parameters
    ----------
    size : int
        Bytes of a frame.
    sync : int
        Its first byte.
    has_status : bool
        Whether a status byte follows, of which only the threshold switches can be set.
    zero : int
        Value of zero.
    confirm : int
        Frames in a row that prove the spacing after garbage.
    """

    size: int
    sync: int
    has_status: bool
    zero: int
    confirm: int

    @property
    def head(self) -> int:
        """Bytes by which the beginning of a frame is known."""
        return 2 if self.has_status else 1

    @property
    def search_bytes(self) -> int:
        """Bytes in which a frame can show itself ``confirm`` times, wherever it begins."""
        return (self.size - 1) + (self.confirm - 1) * self.size + self.head


LONG = FrameForm(FRAME_BYTES, SYNC, True, ZERO, 4)
SHORT = FrameForm(SHORT_FRAME_BYTES, SHORT_SYNC, False, SHORT_ZERO, 8)


class FrameDecoder:
    """Finds frames in a stream of bytes that comes in pieces.

    Parameters
    ----------
    aligned : bool
        Whether the first byte is known to begin a frame (the stream was stopped and started).
    form : FrameForm
        How a frame is made.
    """

    def __init__(self, *, aligned: bool = False, form: FrameForm = LONG) -> None:
        self._form = form
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
        return -(-len(self._buffer) // self._form.size)

    @property
    def undecided(self) -> bool:
        """Whether the stream can be read in two ways for so long that only a restart helps."""
        return not self._aligned and len(self._buffer) > (_UNDECIDED + 1) * self._form.size

    def feed(self, data: bytes) -> list[Gsv2Frame]:
        """Return the frames that are certain by now."""
        self._buffer += data
        frames: list[Gsv2Frame] = []
        while self._aligned or self._search():
            if len(self._buffer) < self._form.size + self._form.head:
                break
            if not (self._begins(0) and self._begins(self._form.size)):
                self._aligned = False
                self.resyncs += 1
                self._skip(1)
                continue
            lost = round(self._skipped / self._form.size) if self._found_once else 0
            self._found_once = True
            self._skipped = 0
            form = self._form
            count = int.from_bytes(self._buffer[form.head : form.size], "big") - form.zero
            frames.append(Gsv2Frame(count, self._buffer[1] if form.has_status else 0, lost))
            del self._buffer[: self._form.size]
        return frames

    def _begins(self, offset: int) -> bool:
        if self._buffer[offset] != self._form.sync:
            return False
        return not self._form.has_status or not self._buffer[offset + 1] & ~_STATUS_BITS

    def _run(self, offset: int) -> tuple[int, bool]:
        """Return how many frames follow each other from ``offset``, and whether the bytes end there."""
        frames = 0
        while offset + self._form.head <= len(self._buffer):
            if not self._begins(offset):
                return frames, False
            frames += 1
            offset += self._form.size
        return frames, True

    def _search(self) -> bool:
        """Look for frames in a row, dropping what cannot begin one; return whether they are found.

        Steady values can make 0x2C appear at two places of every frame. Then it waits until noise breaks
        one of the two readings.
        """
        while len(self._buffer) >= self._form.search_bytes:
            runs = [(*self._run(offset), offset) for offset in range(self._form.size)]
            likely = [run for run in runs if run[0] >= self._form.confirm]
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
