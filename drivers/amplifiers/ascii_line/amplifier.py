"""An amplifier on a serial line that speaks lines of text: asked for each value, or sending by itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from bufferstand.drivers.amplifiers.ascii_line.description import Exchange, SpokenLines
from bufferstand.drivers.amplifiers.serial import Complain, Decoder, StreamValue
from bufferstand.drivers.amplifiers.text_values import LineDecoder, TextValue, decimal_counts
from bufferstand.drivers.serial_line import SerialLine
from bufferstand.foundation import DeviceFault

_ZERO_WAIT_S = 2.0
SHOWN = 60
"""Characters of a wrong answer that are shown."""


class ReplyDecoder(LineDecoder):
    """Finds values in lines, and what a device says instead of one.

    Parameters
    ----------
    lines : SpokenLines
    aligned : bool
        Whether the first byte is known to begin a line.
    """

    def __init__(self, lines: SpokenLines, *, aligned: bool) -> None:
        self._lines = lines
        self._pattern = re.compile(lines.found.reply)
        self._said: list[str] = []
        self._instead = {one.text: f"it sends “{one.text}”: {one.what}" for one in lines.found.overload}
        self._instead |= {
            one: f"it refuses what it is sent (“{one}”); look at its address and mode"
            for one in lines.found.refusals
        }
        super().__init__(self._value, aligned=aligned, end=lines.end)

    def take_said(self) -> Sequence[str]:
        """Get (and forget) what it has said instead of values."""
        said, self._said = self._said, []
        return said

    def _take(self, line: bytes, values: list[TextValue]) -> None:
        if (said := self._instead.get(line.decode("ascii", errors="replace").strip())) is not None:
            self._said.append(said)
            self._aligned = True
            self._lost += 1
            return
        super()._take(line, values)

    def _value(self, line: bytes) -> tuple[int, int] | None:
        """Return count and status; None where a line holds no value in the described form."""
        found = self._pattern.fullmatch(line.decode("ascii", errors="replace"))
        if found is None or (self._lines.unit and found["unit"] != self._lines.unit):
            return None
        counts = decimal_counts(found["value"].encode(), self._lines.decimals)
        low, high = self._lines.ends
        return counts if counts is not None and low <= counts[0] <= high else None


class AsciiLineDialect:
    """What is said on the line of such an amplifier.

    Parameters
    ----------
    lines : SpokenLines
    """

    saturation: tuple[float, float] | None = None

    def __init__(self, lines: SpokenLines) -> None:
        self._lines, self._found = lines, lines.found
        self.request = lines.sent(self._found.request)
        self.form = f"lines such as “{self._found.example}” with {lines.decimals} decimals"
        if lines.unit:
            self.form += f" in {lines.unit}"
        self.identity = ""

    def begin(self, line: SerialLine, complain: Complain) -> Decoder:
        """Stop it, say what it has to be told first, and start it.

        Raises
        ------
        DeviceFault
            If a command is not answered as it should.
        """
        del complain
        self._stop(line)
        for one in self._found.begin:
            self._demand(line, one)
        self.identity = self._found.title
        return self._go(line)

    def restart(self, line: SerialLine) -> Decoder:
        """Stop and start it, so that its first byte begins a line."""
        self._stop(line)
        return self._go(line)

    def zero(self, line: SerialLine) -> Decoder | None:
        """Set the present value as zero in the amplifier.

        Raises
        ------
        DeviceFault
            If its description has no command for it, or it refuses.
        """
        if self._found.zero is None:
            raise DeviceFault(
                f"{line.name}: description “{self._found.id}” has no command for zero; set it at the device, "
                "or zero_counts of the channel's calibration"
            )
        self._stop(line)
        self._demand(line, self._found.zero, _ZERO_WAIT_S)
        return self._go(line)

    def judge(self, values: Sequence[StreamValue]) -> Iterable[tuple[str, str]]:
        """Yield nothing: a line with a value says nothing else."""
        del values
        return ()

    def _stop(self, line: SerialLine) -> None:
        if stop := self._lines.sent(self._found.stop):
            line.write(stop)
        self._quiet = line.quieten()

    def _go(self, line: SerialLine) -> Decoder:
        if start := self._lines.sent(self._found.start):
            line.write(start)
        return ReplyDecoder(self._lines, aligned=self._quiet)

    def _demand(self, line: SerialLine, one: Exchange, wait_s: float | None = None) -> None:
        command = self._lines.sent(one.send)
        line.write(command)
        answer = (
            line.read_line(end=self._lines.end) if wait_s is None else line.read_line(wait_s, self._lines.end)
        )
        said = answer.decode("ascii", errors="replace").strip()
        if said != one.expect:
            heard = _heard(said) if said else "no answer"
            raise DeviceFault(
                f"{line.name}: {heard} to “{command.decode('ascii').strip()}”, expected “{one.expect}”; "
                "look at power, cable, baud rate, parity, and whether it is this device "
                f"(description “{self._found.id}”)"
            )


def _heard(said: str) -> str:
    """Say what was answered; of what is no text only how much: a terminal would obey its bytes."""
    if not said.isprintable() or "\ufffd" in said:
        return f"it sends {len(said)} bytes that are no text, as another device or another baud rate does,"
    return f"it answers “{said[:SHOWN]}{'…' * (len(said) > SHOWN)}”"
