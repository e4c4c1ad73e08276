"""A simulated amplifier that speaks lines: it answers as its description says, in the form of its example."""

from __future__ import annotations

import re

from bufferstand.drivers.amplifiers.ascii_line.description import SpokenLines
from bufferstand.drivers.instruments import Counts


class AsciiLineDevice:
    """One.

    Parameters
    ----------
    lines : SpokenLines
    """

    def __init__(self, lines: SpokenLines) -> None:
        self._lines, self._found = lines, lines.found
        self._pending = b""
        self._streaming = not (self._found.request or self._found.start)
        self._last = self._zero = 0
        self._overloaded = False
        self.asked = 0
        """How often it was asked for a value."""

    def obey(self, data: bytes) -> bytes:
        """Take commands; return the answers."""
        self._pending += data
        end = self._found.command_end.encode()
        answers = b""
        while (at := self._pending.find(end)) >= 0:
            command, self._pending = self._pending[: at + len(end)], self._pending[at + len(end) :]
            answers += self._do(command)
        return answers

    def send(self, counts: Counts, *, overload: bool = False) -> bytes:
        """Return a line for each value, while it sends by itself."""
        if not counts.size:
            return b""
        self._last, self._overloaded = int(counts[-1]), overload
        if not self._streaming:
            return b""
        return b"".join(self._line(int(count), overload=overload) for count in counts)

    def _do(self, command: bytes) -> bytes:
        found, sent = self._found, self._lines.sent
        if command == sent(found.request) and found.request:
            self.asked += 1
            return self._line(self._last, overload=self._overloaded)
        if found.start and command == sent(found.start):
            self._streaming = True
            return b""
        if found.stop and command == sent(found.stop):
            self._streaming = False
            return b""
        if found.zero is not None and command == sent(found.zero.send):
            self._zero = self._last
            return self._ended(found.zero.expect)
        for one in found.begin:
            if command == sent(one.send):
                return self._ended(one.expect)
        return self._ended(found.refusals[0]) if found.refusals else b""

    def _line(self, count: int, *, overload: bool) -> bytes:
        if overload and self._found.overload:
            return self._ended(self._found.overload[0].text)
        low, high = self._lines.ends
        shown = high if overload else min(max(count - self._zero, low), high)
        return self._ended(self._formed(shown))

    def _formed(self, count: int) -> str:
        """Return a line in the form of the description's example."""
        example = re.fullmatch(self._found.reply, self._found.example)
        assert example is not None
        number, decimals = example["value"], self._lines.decimals
        sign = "-" if count < 0 else "+" if number.startswith("+") else ""
        whole, rest = divmod(abs(count), 10**decimals)
        width = len(number.lstrip("+-").partition(".")[0]) if number.lstrip("+-").startswith("0") else 1
        value = f"{sign}{whole:0{width}d}" + (f".{rest:0{decimals}d}" if decimals else "")
        line = self._found.example
        if self._lines.unit:
            line = line[: example.start("unit")] + self._lines.unit + line[example.end("unit") :]
        return line[: example.start("value")] + value + line[example.end("value") :]

    def _ended(self, text: str) -> bytes:
        return (text + self._found.end).encode("ascii")
