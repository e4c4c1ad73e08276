"""ME GSV-2 measuring amplifier on a serial line: its commands, and the stream of values that it sends.

Sources: ME-Messysteme, GSV-2AS manual: data output (p. 16), table of commands (p. 18), read frequency
(p. 29), transmission mode (p. 38). Where no text was found it is said; see docs/sensors.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from bufferstand.drivers.amplifiers.gsv2.frames import SHORT, FrameDecoder
from bufferstand.drivers.amplifiers.gsv2.settings import Gsv2AmplifierSettings, Gsv2Settings
from bufferstand.drivers.amplifiers.serial import STREAM, Complain, Decoder, SerialAmplifier, StreamValue
from bufferstand.drivers.amplifiers.text_values import LineDecoder, decimal_counts
from bufferstand.drivers.serial_line import SerialLine
from bufferstand.foundation import Clock, DeviceFault

SET_ZERO = b"\x0c"
SET_FREQUENCY = b"\x12"
READ_FREQUENCY = b"\x16"
GET_SERIAL_NUMBER = b"\x1f"
STOP = b"\x23"
START = b"\x24"
SET_MODE = b"\x26"
GET_MODE = b"\x27"
FIRMWARE_VERSION = b"\x2b"
SET_TX_MODE = b"\x80"
GET_TX_MODE = b"\x81"

MODE_TEXT = 0x02
"""Bit of the mode register for lines of text (its place is not in any text found; read back)."""
TX_FIVE_BYTES = 0x08
"""Bit of the transmission mode for frames of five bytes instead of three."""

_RATE_TOLERANCE = 0.01
_FORMS = {
    "binary5": "5-byte binary frames",
    "binary3": "3-byte binary frames",
    "text": "lines of text with the stated decimals",
}


def frequency_of(register: int) -> float:
    """Return the data rate [Hz] that a frequency register stands for: 5·10⁶ / (2²⁴ − register).

    Raises
    ------
    ValueError
        If the register is not 0 … 2²⁴ − 1.
    """
    if not 0 <= register < 1 << 24:
        raise ValueError(f"{register} is no 24-bit register")
    return 5e6 / ((1 << 24) - register)


def register_of(rate_Hz: float) -> int:
    """Return the frequency register of a data rate: the inverse of :func:`frequency_of`, rounded.

    Raises
    ------
    ValueError
        If no register stands for that rate.
    """
    register = (1 << 24) - round(5e6 / rate_Hz)
    frequency_of(register)
    return register


class Gsv2Dialect:
    """The commands of a GSV-2: stop, look, set up, start.

    Parameters
    ----------
    settings : Gsv2AmplifierSettings
        With the data rate, and the table ``gsv2``.
    """

    request = b""

    def __init__(self, settings: Gsv2AmplifierSettings) -> None:
        self._rate_Hz = settings.rate_Hz
        self._settings: Gsv2Settings = settings.gsv2
        self.saturation = settings.gsv2.ends
        self.form = _FORMS[settings.gsv2.frame]
        self.identity = ""

    def begin(self, line: SerialLine, complain: Complain) -> Decoder:
        """Stop the stream, set up or check form and rate, start it.

        Raises
        ------
        DeviceFault
            If the amplifier is set to another rate or form than the stand file says.
        """
        line.write(STOP)
        quiet = line.quieten()
        if not quiet:
            complain("it does not stop sending on command 0x23; its data rate could not be checked")
        else:
            if self._settings.set_up:
                self._set_up(line)
            self._check_rate(line, complain)
        line.write(START)
        return self._decoder(aligned=quiet)

    def restart(self, line: SerialLine) -> Decoder:
        """Stop and start the stream, so that its first byte begins a frame."""
        line.write(STOP)
        quiet = line.quieten()
        line.write(START)
        return self._decoder(aligned=quiet)

    def zero(self, line: SerialLine) -> Decoder | None:
        """Set the present value as zero (0x0C); the stream need not stop for it."""
        line.write(SET_ZERO)
        return None

    def judge(self, values: Sequence[StreamValue]) -> Iterable[tuple[str, str]]:
        """Yield nothing: the frames carry no word about the measurement."""
        del values
        return ()

    def _decoder(self, *, aligned: bool) -> Decoder:
        match self._settings.frame:
            case "binary3":
                return FrameDecoder(aligned=aligned, form=SHORT)
            case "text":
                decimals = self._settings.decimals
                return LineDecoder(lambda text: decimal_counts(text, decimals), aligned=aligned)
            case _:
                return FrameDecoder(aligned=aligned)

    def _set_up(self, line: SerialLine) -> None:
        """Read who it is; set form and rate; read back what can be read back."""
        firmware = self._demand(line, FIRMWARE_VERSION, 2, "firmware version")
        serial_number = self._demand(line, GET_SERIAL_NUMBER, 8, "serial number")
        shown = serial_number.decode("ascii", errors="replace").strip("\0 ")
        self.identity = f"GSV-2 serial {shown}, firmware {firmware[0]}.{firmware[1]:02d}"
        text = self._settings.frame == "text"
        mode = self._demand(line, GET_MODE, 1, "mode")[0]
        self._set(line, SET_MODE, GET_MODE, mode, MODE_TEXT, text, "mode")
        if not text:
            tx_mode = self._demand(line, GET_TX_MODE, 1, "transmission mode")[0]
            five = self._settings.frame == "binary5"
            self._set(line, SET_TX_MODE, GET_TX_MODE, tx_mode, TX_FIVE_BYTES, five, "transmission mode")
        if self._settings.rate_code is not None:
            line.write(SET_FREQUENCY + self._settings.rate_code.to_bytes(2, "big"))

    def _set(
        self, line: SerialLine, write: bytes, read: bytes, now: int, bit: int, on: bool, name: str
    ) -> None:
        """Set one bit of a register and see that it is set; leave the others as they are."""
        if bool(now & bit) == on:
            return
        wanted = now | bit if on else now & ~bit
        line.write(write + bytes([wanted]))
        got = self._demand(line, read, 1, name)[0]
        if bool(got & bit) != on:
            raise DeviceFault(
                f"{line.name}: its {name} stays at 0x{got:02X} and cannot be set to {self.form}; "
                "look whether changes are locked (jumper JP2), or set it with the maker's program"
            )

    @staticmethod
    def _demand(line: SerialLine, question: bytes, count: int, name: str) -> bytes:
        answer = line.ask(question, count)
        if len(answer) < count:
            raise DeviceFault(
                f"{line.name}: no answer to “{name}” (0x{question[0]:02X}); "
                "look at the baud rate, the cable's transmit wire, and whether it is a GSV-2"
            )
        return answer

    def _check_rate(self, line: SerialLine, complain: Complain) -> None:
        """Ask for the frequency register; a rate that is not the stated one would falsify the time base."""
        answer = line.ask(READ_FREQUENCY, 3)
        if len(answer) < 3:
            complain("no answer to “read frequency” (0x16); its data rate could not be checked")
            return
        rate_Hz = frequency_of(int.from_bytes(answer, "big"))
        if abs(rate_Hz - self._rate_Hz) > _RATE_TOLERANCE * self._rate_Hz:
            raise DeviceFault(
                f"{line.name}: it is set to {rate_Hz:.4g} values a second, the stand file says "
                f"{self._rate_Hz:.4g}; set the one or the other (amplifier.rate_Hz)"
            )


class Gsv2Amplifier(SerialAmplifier):
    """Sensor of :mod:`bufferstand.drivers.interfaces`: force through a GSV-2, stamped with host time.

    Parameters
    ----------
    port : Path
        Serial device.
    settings : Gsv2AmplifierSettings
        Baud rate, data rate, channel, table ``gsv2``.
    clock : Clock
        Stand time for the stamps, wall time for the judgement of silence.
    stream : str
        What its samples are called.
    """

    def __init__(
        self, port: Path, settings: Gsv2AmplifierSettings, clock: Clock, stream: str = STREAM
    ) -> None:
        device = f"GSV-2 at {Path(settings.port).name}"
        super().__init__(port, settings, clock, Gsv2Dialect(settings), device, stream=stream)
