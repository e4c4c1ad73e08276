"""HBM AED amplifiers (AD101B, AD104) on a serial line: commands in text, values in text or binary.

Sources: HBM, AD104-R2/R5 operating instructions: command format and answers (pp. 14–16), BDR (p. 19), COF
(pp. 20–24), MSV (pp. 37–39), TAR, TAV (pp. 44–45), IDN (p. 51), bus mode (pp. 22, 71). See docs/sensors.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from bufferstand.drivers.amplifiers.aed.settings import AedAmplifierSettings
from bufferstand.drivers.amplifiers.aed.values import continuous_decoder, single_decoder, status_words
from bufferstand.drivers.amplifiers.serial import STREAM, Complain, Decoder, SerialAmplifier, StreamValue
from bufferstand.drivers.serial_line import SerialLine
from bufferstand.foundation import Clock, DeviceFault

STOP = b"STP;"
CONTINUOUS = b"MSV?0;"
SINGLE = b"MSV?;"
CLEAR = b";"
"""An end character alone clears the input buffer of the amplifier."""
_NO_CR_LF = 32
_WITHOUT_TRAILER = frozenset({0, 2, 4, 6, 8, 12})
_RATE_TOLERANCE = 0.05
_TARE_WAIT_S = 2.0
_FAST_HZ = 50.0


def icr_of(rate_Hz: float, top_rate_Hz: float) -> int:
    """Return the ICR parameter for a rate: each step halves the rate at ICR 0.

    Raises
    ------
    ValueError
        If none of ICR 0 … 7 comes within 5 % of that rate.
    """
    icr = round(math.log2(top_rate_Hz / rate_Hz))
    if not 0 <= icr <= 7 or abs(top_rate_Hz / 2**icr - rate_Hz) > _RATE_TOLERANCE * rate_Hz:
        rates = ", ".join(f"{top_rate_Hz / 2**n:g}" for n in range(8))
        raise ValueError(f"{rate_Hz:g} values a second are not one of {rates}")
    return icr


class AedDialect:
    """The commands of an AED: stop, ask who it is, set format and rate, read them back, start.

    Parameters
    ----------
    settings : AedAmplifierSettings
        With the data rate, and the table ``aed``.
    """

    def __init__(self, settings: AedAmplifierSettings) -> None:
        self._settings = settings.aed
        self.identity = ""
        self.request = b""
        self._rate_Hz = settings.rate_Hz
        address = settings.aed.address
        self._select = b"" if address is None else f"S{address:02d};".encode()
        if address is not None:
            self.request = self._select + SINGLE
        self.saturation: tuple[float, float] | None = settings.aed.ends
        self._jump = _jump(settings, (settings.aed.ends[1] + 1) / 4)
        self.form = f"values in output format {settings.aed.output}"

    def begin(self, line: SerialLine, complain: Complain) -> Decoder:  # noqa: ARG002 - a Dialect's signature
        """Stop it, ask who it is, set up format and rate, read them back, start it.

        Raises
        ------
        DeviceFault
            If it does not answer, refuses a command, or keeps another setting.
        """
        line.write(CLEAR + STOP)
        if not line.quieten():
            raise DeviceFault(
                f"{line.name}: it does not stop sending on STP; look at the cable's transmit wire, "
                "baud rate and parity"
            )
        if self._select:
            line.write(self._select)  # S.. is not answered
        self.identity = self._query(line, "IDN?").strip()
        output = self._settings.output
        if not self._select and output in _WITHOUT_TRAILER:
            output += _NO_CR_LF
        self._set(line, "COF", output)
        if self._settings.output in {8, 12}:
            self._set(line, "CSM", int(self._settings.checksum), optional=not self._settings.checksum)
        self._set(line, "TAS", 0 if self._settings.net else 1)
        if not self._select:
            try:
                icr = icr_of(self._rate_Hz, self._settings.top_rate_Hz)
            except ValueError as error:
                raise DeviceFault(
                    f"{line.name}: {error}; set amplifier.rate_Hz, or aed.top_rate_Hz for this model"
                ) from None
            self._set(line, "ICR", icr)
        return self._go(line)

    def restart(self, line: SerialLine) -> Decoder:
        """Stop and start the stream, so that its first byte begins a value."""
        line.write(CLEAR + STOP)
        line.quieten()
        return self._go(line)

    def zero(self, line: SerialLine) -> Decoder | None:
        """Tare (TAR) and switch to net values: the stream must stop for it.

        Raises
        ------
        DeviceFault
            If it is refused, or the stand file wants gross values: they would not show it.
        """
        if not self._settings.net:
            raise DeviceFault(
                f"{line.name}: it shows gross values (aed.net = false), a tare would not be seen; "
                "set aed.net, or zero_counts of the channel's calibration"
            )
        line.write(CLEAR + STOP)
        line.quieten()
        line.write(self._select + b"TAR;")
        answer = line.read_line(_TARE_WAIT_S)
        if answer.strip() != b"0":
            raise DeviceFault(f"{line.name}: it refused to tare (TAR): {_shown(answer)}")
        return self._go(line)

    def judge(self, values: Sequence[StreamValue]) -> Iterable[tuple[str, str]]:
        """Return what the status bytes say is wrong."""
        return status_words([getattr(value, "status", 0) for value in values])

    def _go(self, line: SerialLine) -> Decoder:
        output, settings = self._settings.output, self._settings
        if self._select:
            return single_decoder(output, checksum=settings.checksum, address=settings.address)
        line.write(CONTINUOUS)
        return continuous_decoder(
            output, checksum=settings.checksum, address=None, aligned=True, jump=self._jump
        )

    def _query(self, line: SerialLine, command: str) -> str:
        line.write(command.encode() + b";")
        answer = line.read_line()
        if not answer.endswith(b"\n"):
            raise DeviceFault(
                f"{line.name}: no answer to {command}; look at power, cable, baud rate, parity"
                + (f" and the address {self._settings.address}" if self._select else "")
                + (f" (only {_shown(answer)} came)" if answer else "")
            )
        if answer.strip() == b"?":
            raise DeviceFault(
                f"{line.name}: it does not know {command}; look whether it is an AED of this kind"
            )
        return answer.decode("ascii", errors="replace")

    def _set(self, line: SerialLine, command: str, value: int, *, optional: bool = False) -> None:
        """Set a parameter and read it back."""
        line.write(f"{command}{value};".encode())
        answer = line.read_line()
        if answer.strip() != b"0":
            if optional and answer.strip() == b"?":
                return
            raise DeviceFault(
                f"{line.name}: it refused {command}{value}: {_shown(answer)}; "
                "look at its model, its password (DPW, SPW) and the stand file"
            )
        got = self._query(line, f"{command}?").strip()
        if got.lstrip("0") != str(value).lstrip("0"):
            raise DeviceFault(f"{line.name}: {command} was set to {value} and reads back {got}")


class AedAmplifier(SerialAmplifier):
    """Sensor of :mod:`bufferstand.drivers.interfaces`: force through an AED, stamped with host time.

    Parameters
    ----------
    port : Path
        Serial device.
    settings : AedAmplifierSettings
        Baud rate, data rate, channel, table ``aed``.
    clock : Clock
        Stand time for the stamps, wall time for the judgement of silence.
    stream : str
        What its samples are called.
    """

    def __init__(
        self, port: Path, settings: AedAmplifierSettings, clock: Clock, stream: str = STREAM
    ) -> None:
        super().__init__(
            port,
            settings,
            clock,
            AedDialect(settings),
            f"AED at {Path(settings.port).name}",
            even_parity=settings.aed.parity == "even",
            stream=stream,
        )


def _jump(settings: AedAmplifierSettings, most: float) -> float | None:
    """Return the change in counts from value to value that cannot be; None if any can at so low a rate.

    By the channel's ``rate_per_s`` if it states one (and its calibration is a line), else ``most`` at rates
    where a harmonic at 2.5 Hz over half the range stays below a third of that.
    """
    calibration, limits = settings.channel.calibration, settings.channel.plausible
    if limits is not None and limits.rate_per_s is not None and len(calibration.coefficients) == 2:
        per_count = abs(calibration.coefficients[1] * calibration.input_per_count)
        return limits.rate_per_s / settings.rate_Hz / per_count
    return most if settings.rate_Hz >= _FAST_HZ else None


def _shown(answer: bytes) -> str:
    return f"“{answer.decode('ascii', errors='replace').strip()}”" if answer else "no answer"
