"""What a stand file says about a LabJack T7 or T8."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from bufferstand.drivers.acquisition.kind import AcquisitionSettings
from bufferstand.drivers.acquisition.labjack.registers import TICKS_PER_S, analog_input, digital_line
from bufferstand.drivers.acquisition.labjack.volts import RANGES_V
from bufferstand.drivers.instruments import ReplyTime
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings, Within, WrongKeyError

MOST_INPUTS = 128
"""Entries of a scan list (ljm_constants.json, STREAM_SCANLIST_ADDRESS#(0:127))."""
T7_SAMPLES_PER_S = 100_000.0
"""Samples a second of all inputs of a T7 together (data sheet 3.2). Of the T8 no figure was found: its own
refusal is passed on."""


def _as_tuple(value: object) -> object:
    if isinstance(value, dict):
        return (value,)
    return tuple(value) if isinstance(value, list) else value


class LabJackInput(Settings):
    """An analog input and what is measured with it."""

    terminal: str
    """As it is written on the device: ``AIN0``."""
    differential: bool = False
    """Measured against the next input (AIN1 of AIN0) instead of ground. The T8's inputs are so always."""
    range_V: Annotated[float, Field(gt=0, le=11)] = 10.0
    """Range in volts, plus and minus."""
    channel: Channel
    """Its calibration takes volts: coefficients in the channel's unit per volt."""

    @model_validator(mode="after")
    def _is_there(self) -> LabJackInput:
        if (number := analog_input(self.terminal)) is None:
            raise WrongKeyError(
                f"“{self.terminal}” is no analog input; write “AIN0”, as on the device", "terminal"
            )
        if self.differential and number % 2:
            raise WrongKeyError(
                f"{self.terminal} cannot be the positive side of a differential input; write an even one, "
                f"AIN{number - 1}",
                "terminal",
                "differential",
            )
        return self


class LabJackSettings(AcquisitionSettings):
    """A LabJack T7 or T8."""

    kind: Literal["labjack"]
    """The kind."""
    model: Literal["T7", "T8"]
    """``T7`` or ``T8``; another one that answers is refused."""
    host: str = Field(min_length=1)
    """Address."""
    port: int = Field(default=502, ge=1, le=65535)
    """Port of Modbus TCP."""
    stream_port: int = Field(default=702, ge=1, le=65535)
    """Port of its packets."""
    timeout_s: ReplyTime = 0.5
    """Longest wait for one reply [s]."""
    delivery: Literal["packets", "requests"] = "packets"
    """``packets`` come by themselves on ``stream_port``; ``requests`` ask for what the device has kept."""
    settling_us: Annotated[float, Field(ge=0.0, le=4400.0)] = 0.0
    """Time for a signal to settle behind the multiplexer of a T7 [µs]; 0 lets the device choose."""
    resolution_index: Annotated[int, Field(ge=0, le=16)] = 0
    """0 lets the device choose; at most 8 of a T7."""
    buffer_bytes: Annotated[int, Field(ge=0, le=262144)] = 0
    """What the device keeps while nobody reads: a power of 2, at most 32768 (T7) or 262144 (T8); 0: that."""
    channel_interval_us: (
        Annotated[float, Field(ge=0.0), Within(0.0, 5000.0, "no scan of a stand takes longer")] | None
    ) = None
    """How much later each input of a scan is sampled than the one before [µs]. A T8 samples all at once; of a
    T7 it is to be measured: what is not stated counts as 0, and then belongs into ``u_delay_s``."""
    separator_counted: bool = True
    """Whether the scan of 0xFFFF behind an overflow is one of the scans that the device says it skipped."""
    stop_output: str = ""
    """Digital line by which the stand that moves is asked to stop, ``FIO0``; none without it."""
    stop_level: Literal["low", "high"] = "low"
    """Level of that line that asks for a stop; the other one is set at the start."""
    input: Annotated[tuple[LabJackInput, ...], BeforeValidator(_as_tuple)]
    """``[[acquisition.input]]``: its inputs."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The channels, each with the delay that its place in the scan gives it."""
        later_s = 1e-6 * (self.channel_interval_us or 0.0)
        return tuple(
            one.channel.model_copy(update={"delay_s": one.channel.delay_s - place * later_s})
            for place, one in enumerate(self.input)
        )

    @property
    def ends(self) -> tuple[tuple[float, float], ...]:
        """Range of each input [V]."""
        return tuple((-one.range_V, one.range_V) for one in self.input)

    @property
    def raw_units(self) -> dict[str, str]:
        """Volts, all of them."""
        return {one.channel.name: "V" for one in self.input}

    @property
    def clock_is_readable(self) -> bool:
        """Whether the documents say how fast CORE_TIMER runs: of the T7 they do."""
        return int(self.model[1:]) in TICKS_PER_S

    @property
    def buffer_bytes_set(self) -> int:
        """The size of the buffer that is written."""
        return self.buffer_bytes or (32768 if self.model == "T7" else 262144)

    @model_validator(mode="after")
    def _fits_the_device(self) -> LabJackSettings:
        self._inputs_fit()
        most = T7_SAMPLES_PER_S
        if self.model == "T7" and (all_of_them := self.rate_Hz * len(self.input)) > most:
            raise WrongKeyError(
                f"rate_Hz = {self.rate_Hz:g} is too fast: {len(self.input)} inputs make {all_of_them:g} "
                f"samples a second, a T7 takes {most:g}; write rate_Hz = {most / len(self.input):g} or less",
                "rate_Hz",
                "input",
            )
        if self.model == "T7" and self.resolution_index > 8:
            raise WrongKeyError(
                f"resolution_index = {self.resolution_index}: a stream of a T7 has 0 to 8; write one of them",
                "resolution_index",
            )
        size = self.buffer_bytes
        if size and (size & (size - 1) or size > LabJackSettings.largest_buffer(self.model)):
            raise WrongKeyError(
                f"buffer_bytes = {size} is not possible; write a power of 2 up to "
                f"{LabJackSettings.largest_buffer(self.model)}",
                "buffer_bytes",
            )
        if self.stop_output and digital_line(self.stop_output) is None:
            raise WrongKeyError(
                f"“{self.stop_output}” is no digital line; write “FIO0” to “MIO2”, as on the device",
                "stop_output",
            )
        return self

    @staticmethod
    def largest_buffer(model: str) -> int:
        """Return the largest buffer of a model [bytes]."""
        return 32768 if model == "T7" else 262144

    def _inputs_fit(self) -> None:
        if not 0 < len(self.input) <= MOST_INPUTS:
            raise WrongKeyError(f"there must be 1 to {MOST_INPUTS} inputs", "input")
        taken: set[int] = set()
        names: set[str] = set()
        for place, one in enumerate(self.input):
            number = analog_input(one.terminal)
            assert number is not None
            ends = {number, number + 1} if one.differential else {number}
            if taken & ends:
                raise WrongKeyError(
                    f"{one.terminal} is taken twice; give each input its own terminals",
                    ("input", place, "terminal"),
                )
            taken |= ends
            if one.channel.name in names:
                raise WrongKeyError(
                    f"channel “{one.channel.name}” is there twice; give each its own name",
                    ("input", place, "channel"),
                )
            names.add(one.channel.name)
            if one.range_V not in RANGES_V[self.model]:
                known = ", ".join(f"{value:g}" for value in RANGES_V[self.model])
                stated = "" if "range_V" in one.model_fields_set else ", which is taken where none is stated,"
                raise WrongKeyError(
                    f"range_V = {one.range_V:g}{stated} is none of a {self.model}; write one of {known}",
                    ("input", place, "range_V"),
                )
            if self.model == "T8" and (number > 7 or one.differential):
                raise WrongKeyError(
                    "a T8 has AIN0 to AIN7, each with a negative terminal of its own; leave differential out",
                    ("input", place, "terminal"),
                )
