"""The measured values of an HBM AED amplifier in each of its output formats (command COF).

Source: HBM, AD104-R2/R5 operating instructions, COF (pp. 20–24), MSV (pp. 37–39): lengths, order of bytes,
status bits, continuous output. The checksum that replaces the status byte (CSM) is not described there; its
form here, the exclusive or of the three value bytes, is from memory.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from bufferstand.drivers.amplifiers.text_values import LineDecoder, TextValue

NET_OVERFLOW, GROSS_OVERFLOW, CONVERTER_OVERFLOW, STANDSTILL = 0x01, 0x02, 0x04, 0x08
"""Bits of the status byte."""
INCOHERENT = 0xC0
STATUS_TEXTS = {
    CONVERTER_OVERFLOW: "its converter is overdriven (input beyond ±2.5 mV/V); look at load, "
    "transducer cable and bridge",
    GROSS_OVERFLOW: "its gross value overflows; its scaling is too sensitive for this load",
    NET_OVERFLOW: "its net value overflows; its tare value is too large",
    INCOHERENT: "it says that its values do not fit its settings; set it up anew",
}
"""What each status bit means, and where to look."""
_NEVER_SET = 0x30
_LITTLE = {4, 6, 12}
_TWO_BYTES = {2, 6}
_WITH_STATUS = {8, 12}
_TEXT = {1, 3, 9, 11}
_BAD_TO_RESTART = 3
_GOOD_TO_TRUST = 8
_WHOLE = re.compile(rb"^\s*([+-]? *\d+)\s*$")


def is_text(output: int) -> bool:
    """Return whether an output format is lines of text."""
    return output in _TEXT


def has_status(output: int) -> bool:
    """Return whether an output format tells overflow with each value."""
    return output in _WITH_STATUS or output in {9, 11}


def decode_binary(data: bytes, output: int, *, checksum: bool = False) -> TextValue | None:
    """Return the value of a binary output format; None if its status or checksum cannot be.

    Parameters
    ----------
    data : bytes
        Two or four bytes.
    output : int
        Number of the format, without its additions.
    checksum : bool
        Whether the last byte is a checksum instead of the status.
    """
    order = data[::-1] if output in _LITTLE else data
    if output in _TWO_BYTES:
        return TextValue(int.from_bytes(order, "big", signed=True), 0)
    value, status = order[:3], order[3]
    if checksum:
        if status != value[0] ^ value[1] ^ value[2]:
            return None
        status = 0
    elif output not in _WITH_STATUS:
        # “LSB = 0 (no status)”: a fourth byte that is not 0 is none
        if status:
            return None
    elif status & _NEVER_SET:
        return None
    return TextValue(int.from_bytes(value, "big", signed=True), 0, status)


def parse_text(line: bytes, output: int, address: int | None) -> tuple[int, int] | None:
    """Return count and status of a line of text; None if it is none of that format or from elsewhere."""
    fields = line.split(b",")
    wanted = {1: 2, 3: 1, 9: 3, 11: 2}[output]
    number = _WHOLE.match(fields[0]) if len(fields) == wanted else None
    if number is None:
        return None
    found = int(number[1].replace(b" ", b"")), 0
    if output in {1, 9}:
        sender = _number(fields[1], 2)
        if sender is None or address not in {None, sender}:
            return None
    if output in {9, 11}:
        status = _number(fields[-1], 3)
        return None if status is None or status > 0xFF else (found[0], status)
    return found


def _number(field: bytes, digits: int) -> int | None:
    text = field.strip()
    return int(text) if len(text) == digits and text.isdigit() else None


@dataclass
class BinaryDecoder:
    """Cuts a binary stream into values by counting bytes.

    Nothing in the stream marks where a value begins. A slip shows in status bytes that cannot be (unless a
    small value stands there), in CR LF at the wrong place, and in jumps. After a value that cannot be, those
    that follow are held back until eight in a row can; three that cannot mean that the place is lost: the
    stream must be stopped and started (``undecided``).

    Parameters
    ----------
    output : int
        Number of the format, without its additions.
    trailer : bytes
        What follows each value: CR LF for single values, nothing in continuous output.
    checksum : bool
        Whether the last byte is a checksum.
    jump : float, optional
        Change from one value to the next that cannot be; a restart forgets the last value.
    """

    output: int
    trailer: bytes = b""
    checksum: bool = False
    jump: float | None = None

    def __post_init__(self) -> None:
        """Begin with an empty buffer."""
        self.resyncs = 0
        self._buffer = bytearray()
        self._bad = 0
        self._lost = 0
        self._held: list[TextValue] = []
        self._trusted: int | None = None

    @property
    def size(self) -> int:
        """Bytes of one value, with what follows it."""
        return (2 if self.output in _TWO_BYTES else 4) + len(self.trailer)

    @property
    def pending_frames(self) -> int:
        """Values that have begun to come in and are not delivered yet."""
        return -(-len(self._buffer) // self.size)

    @property
    def undecided(self) -> bool:
        """Whether the place of the values is lost."""
        return self._bad >= _BAD_TO_RESTART

    def feed(self, data: bytes) -> list[TextValue]:
        """Return the values that are whole by now; nothing any more once the place is lost."""
        self._buffer += data
        values: list[TextValue] = []
        while len(self._buffer) >= self.size and not self.undecided:
            piece = bytes(self._buffer[: self.size])
            del self._buffer[: self.size]
            body = piece[: self.size - len(self.trailer)]
            found = decode_binary(body, self.output, checksum=self.checksum)
            if found is None or piece[len(body) :] != self.trailer or self._jumps(found.count):
                self._refuse()
            elif self._bad and len(self._held) + 1 < _GOOD_TO_TRUST:
                self._held.append(found)
            else:
                first, *others = [*self._held, found]
                values += [replace(first, lost=self._lost), *others]
                self._held, self._bad, self._lost = [], 0, 0
                if not self._at_end(found.count):
                    self._trusted = found.count
        return values

    def _at_end(self, count: int) -> bool:
        """Return whether a value is at an end of the range: an overdriven input gets there at once."""
        most = 0x7FFF if self.output in _TWO_BYTES else 0x7FFFFF
        return abs(count) >= most

    def _jumps(self, count: int) -> bool:
        """Return whether a value cannot follow the last one that was trusted."""
        if self.jump is None or self._trusted is None or self._at_end(count):
            return False
        return abs(count - self._trusted) > self.jump

    def _refuse(self) -> None:
        if not self._bad:
            self.resyncs += 1
        self._bad += 1
        self._lost += 1 + len(self._held)
        self._held = []


def continuous_decoder(
    output: int, *, checksum: bool, address: int | None, aligned: bool, jump: float | None = None
) -> BinaryDecoder | LineDecoder:
    """Return the decoder of a continuous stream (``MSV?0;``)."""
    if not is_text(output):
        return BinaryDecoder(output, checksum=checksum, jump=jump)
    return LineDecoder(_parser(output, address), aligned=aligned)


def single_decoder(output: int, *, checksum: bool, address: int | None) -> BinaryDecoder | LineDecoder:
    """Return the decoder of single answers (``MSV?;``), each ended by CR LF."""
    if not is_text(output):
        return BinaryDecoder(output, trailer=b"\r\n", checksum=checksum)
    return LineDecoder(_parser(output, address), aligned=True)


def _parser(output: int, address: int | None) -> Callable[[bytes], tuple[int, int] | None]:
    return lambda line: parse_text(line, output, address)


def status_words(statuses: Sequence[int]) -> list[tuple[str, str]]:
    """Return what status bytes say is wrong: a key for each state, and its words."""
    seen = 0
    for status in statuses:
        seen |= status
    return [(f"status {bit:#04x}", text) for bit, text in STATUS_TEXTS.items() if seen & bit]
