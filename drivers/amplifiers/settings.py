"""What a stand file says about a measuring amplifier on a load cell, whatever its protocol."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from bufferstand.drivers.instruments import Baud, CellRange, SampleRate, demand_channel
from bufferstand.foundation.channels import Channel
from bufferstand.foundation.settings import Settings

BITS_16, BITS_24 = (-0x8000, 0x7FFF), (-0x800000, 0x7FFFFF)
"""Counts of converters of so many bits."""


class AmplifierSettings(Settings):
    """A measuring amplifier beside the controller: on a serial line, or with registers.

    A kind adds a table of its own name, and narrows ``protocol`` to that name.
    """

    OPTIONAL: ClassVar[bool] = True
    """Whether the table of the kind's own may be left out; the record of a stand leaves it out then."""

    protocol: str
    """The kind."""
    port: str = ""
    """Serial device; none for Modbus TCP."""
    baud: Baud = 38400
    """Speed of the serial line."""
    rate_Hz: SampleRate
    """Values a second that the amplifier is set to, or asked for."""
    range_kN: CellRange
    """Force at the nominal range; the full scale of a GSV-2's 24-bit value is 1.05 times this."""
    channel: Channel
    """What it measures."""

    @model_validator(mode="after")
    def _measures_force(self) -> AmplifierSettings:
        demand_channel(self.channel, "force", "kN", place=("channel",))
        return self

    @model_serializer(mode="wrap")
    def _own_table(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the kind's own table where it says nothing."""
        content: dict[str, Any] = handler(self)
        if self.protocol not in self.model_fields_set:
            content.pop(self.protocol, None)
        return content
