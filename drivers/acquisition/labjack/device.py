"""A LabJack T7 or T8: who it is, how its stream is set up, started and stopped. One thread at a time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bufferstand.drivers.acquisition.labjack import registers as reg
from bufferstand.drivers.acquisition.labjack.packets import (
    MOST_SAMPLES,
    REPLY_HEAD,
    NotAPacketError,
    StreamPacket,
    reply_of,
)
from bufferstand.drivers.acquisition.labjack.settings import LabJackSettings
from bufferstand.drivers.acquisition.labjack.volts import VoltScale, flash_address, scale_of
from bufferstand.drivers.modbus import ModbusLink, ModbusRefusal
from bufferstand.foundation import DeviceFault

LARGEST_READ = 125
"""Registers of one reply to function 3 (Modbus application protocol 1.1b3)."""
PACKET_S = 0.02
"""So much time a packet holds at most, where its size allows it [s]."""
RATE_TOLERANCE = 0.01
"""Larger share by which the device's own scan rate may differ from the one asked for."""


class LabJack:
    """Registers of one device.

    Parameters
    ----------
    link : ModbusLink
        To port 502; this object owns it.
    settings : LabJackSettings
    name : str
        What messages call it.
    """

    def __init__(self, link: ModbusLink, settings: LabJackSettings, name: str) -> None:
        self.link, self._settings, self._name = link, settings, name
        self.identity = ""
        self.simulated = False
        """Whether it says by its serial number that it is the simulated one."""
        self.rate_Hz = settings.rate_Hz
        self.scales: tuple[VoltScale, ...] = ()
        inputs = len(settings.input)
        scans = max(1, min(MOST_SAMPLES // inputs, math.floor(PACKET_S * settings.rate_Hz)))
        self.samples_per_packet = scans * inputs

    def identify(self) -> None:
        """See that it is the model of the stand file, and read its constants.

        Raises
        ------
        DeviceFault
            If nobody answers, it is another device, or its constants cannot be used.
        """
        try:
            test = reg.number_of(self.link.read(reg.TEST, 2, "test value"))
        except ModbusRefusal as refusal:
            raise DeviceFault(
                f"{self._where}: it has no test register of a LabJack (Modbus exception {refusal.code}): "
                "another device answers here; look at host and port, or ask it with “bufferstand instruments "
                "--probe HOST:PORT”"
            ) from None
        if test != reg.TEST_VALUE:
            raise DeviceFault(
                f"{self._where}: its test register reads 0x{test:08X} instead of 0x{reg.TEST_VALUE:08X}; is "
                "it a LabJack, and nothing between that swaps words?"
            )
        product = round(self._real(reg.PRODUCT_ID, "product id"))
        if f"T{product}" != self._settings.model:
            raise DeviceFault(
                f"{self._where}: it is a T{product}, the stand file says {self._settings.model}; write model "
                f"= “T{product}”, or look at host"
            )
        serial = reg.number_of(self.link.read(reg.SERIAL_NUMBER, 2, "serial number"))
        firmware = self._real(reg.FIRMWARE_VERSION, "firmware version")
        self.simulated = serial == reg.SIMULATED_SERIAL
        which = "simulated " if self.simulated else ""
        self.identity = f"{which}LabJack T{product} serial {serial}, firmware {firmware:.4f}"
        self.scales = tuple(self._scale(one.terminal, one.range_V) for one in self._settings.input)

    def start_stream(self) -> int | None:
        """Set up the inputs and the stream, and start it.

        Returns
        -------
        int or None
            CORE_TIMER at the first scan; None of a device that does not keep it.

        Raises
        ------
        DeviceFault
            If it refuses a setting, or samples at another rate.
        """
        self.stop_stream()
        settings = self._settings
        for one in settings.input:
            number = _number(one.terminal)
            self._set(reg.AIN_RANGE + 2 * number, reg.words_of_real(one.range_V), f"range of {one.terminal}")
            if settings.model == "T7":
                negative = number + 1 if one.differential else reg.SINGLE_ENDED
                self._set(reg.AIN_NEGATIVE + number, [negative], f"negative channel of {one.terminal}")
        requests = settings.delivery == "requests"
        for address, words, what in (
            (reg.SCAN_RATE, reg.words_of_real(settings.rate_Hz), "scan rate"),
            (reg.NUMBER_OF_ADDRESSES, reg.words_of_number(len(settings.input)), "number of inputs"),
            (reg.SAMPLES_PER_PACKET, reg.words_of_number(self.samples_per_packet), "samples of a packet"),
            (reg.SETTLING_US, reg.words_of_real(settings.settling_us), "settling time"),
            (reg.RESOLUTION, reg.words_of_number(settings.resolution_index), "resolution index"),
            (reg.BUFFER_BYTES, reg.words_of_number(settings.buffer_bytes_set), "buffer size"),
            (reg.CLOCK_SOURCE, reg.words_of_number(0), "clock source"),
            (
                reg.AUTO_TARGET,
                reg.words_of_number(reg.TARGET_REQUESTS if requests else reg.TARGET_PACKETS),
                "target of the stream",
            ),
            (reg.DATA_TYPE, reg.words_of_number(0), "data type"),
            (reg.NUMBER_OF_SCANS, reg.words_of_number(0), "number of scans"),
            (reg.TRIGGER, reg.words_of_number(0), "trigger"),
        ):
            self._set(address, words, what)
        for place, one in enumerate(settings.input):
            words = reg.words_of_number(2 * _number(one.terminal))
            self._set(reg.SCAN_LIST + 2 * place, words, f"place {place} of the scan list")
        self._set(reg.ENABLE, reg.words_of_number(1), "start of the stream")
        # Only now does the device say at which rate it samples: it divides a clock.
        self.rate_Hz = self._real(reg.SCAN_RATE, "scan rate")
        if not abs(self.rate_Hz - settings.rate_Hz) <= RATE_TOLERANCE * settings.rate_Hz:
            self.stop_stream()
            raise DeviceFault(
                f"{self._where}: it samples {self.rate_Hz:g} scans a second, the stand file asks for "
                f"{settings.rate_Hz:g}; write rate_Hz = {self.rate_Hz:g}"
            )
        return self._start_stamp()

    def stop_stream(self) -> None:
        """Stop a stream that runs; does nothing where none does.

        Raises
        ------
        DeviceFault
            If nobody answers.
        """
        if reg.number_of(self.link.read(reg.ENABLE, 2, "whether a stream runs")):
            self._set(reg.ENABLE, reg.words_of_number(0), "end of the stream")

    def request(self) -> StreamPacket:
        """Ask for what the device has kept.

        Raises
        ------
        DeviceFault
            If no true reply comes, or it makes no sense.
        """
        inputs = len(self._settings.input)
        count = REPLY_HEAD + max(1, (LARGEST_READ - REPLY_HEAD) // inputs) * inputs
        words = self.link.read(reg.DATA_BY_REQUEST, min(count, LARGEST_READ), "samples")
        try:
            return reply_of(words)
        except NotAPacketError as error:
            raise DeviceFault(f"{self._where}: its reply makes no sense: {error}") from None

    def core_timer(self) -> int:
        """Get CORE_TIMER, whose ticks the start of the stream is stamped with.

        Raises
        ------
        DeviceFault
            If it does not answer.
        """
        return reg.number_of(self.link.read(reg.CORE_TIMER, 2, "core timer"))

    def set_line(self, terminal: str, *, high: bool) -> None:
        """Set a digital line, which makes it an output.

        Raises
        ------
        DeviceFault
            If it is not taken.
        """
        line = reg.digital_line(terminal)
        assert line is not None
        self._set(reg.FIO0 + line, [int(high)], f"line {terminal}")

    @property
    def _where(self) -> str:
        return f"{self._name} at {self.link.address}"

    def _real(self, address: int, what: str) -> float:
        return reg.real_of(self.link.read(address, 2, what))

    def _start_stamp(self) -> int | None:
        try:
            return reg.number_of(self.link.read(reg.START_STAMP, 2, "start of the stream"))
        except ModbusRefusal:
            return None  # firmware before 1.0214

    def _scale(self, terminal: str, range_V: float) -> VoltScale:
        at = flash_address(self._settings.model, _number(terminal), range_V)
        words: list[int] = []
        for step in range(4):
            self.link.write(reg.FLASH_POINTER, reg.words_of_number(at + 4 * step), "place in the flash")
            words += self.link.read(reg.FLASH_READ, 2, "calibration constants")
        try:
            return scale_of(words)
        except ValueError as error:
            raise DeviceFault(
                f"{self._where}: the constants of {terminal} at ±{range_V:g} V are none ({error}); restore "
                "its factory calibration with the maker's program"
            ) from None

    def _set(self, address: int, words: Sequence[int], what: str) -> None:
        try:
            self.link.write(address, words, what)
        except ModbusRefusal as refusal:
            raise DeviceFault(f"{refusal}; {self._refused_why()}") from None

    def _refused_why(self) -> str:
        number = reg.number_of(self.link.read(reg.LAST_ERROR, 2, "number of the error"))
        return f"its own number for that is {number}: {REASONS.get(number, 'see its error codes')}"


REASONS = {
    2605: "a stream runs already, of another program; end that one",
    2606: "the resolution index is too large",
    2607: "an input of the list cannot be streamed",
    2608: "scan rate times inputs is too much for it; write a smaller rate_Hz",
    2615: "buffer_bytes must be a power of 2 that it has",
    2618: "too many samples in a packet",
    2621: "settling_us is too long",
}
"""What the device's numbers mean (ljm_constants.json, errors), with what to do."""


def _number(terminal: str) -> int:
    number = reg.analog_input(terminal)
    assert number is not None
    return number
