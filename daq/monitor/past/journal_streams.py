"""What the header of a journal says of its streams, and its samples in their units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bufferstand.daq.guards import CONTROLLER_STREAM
from bufferstand.daq.scaling import DERIVED, ScaledBlock, scale
from bufferstand.drivers import SampleBlock, StreamFacts
from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import Branch, Channel
from bufferstand.recording import Anchor
from bufferstand.recording.journal import DataRecord


class JournalStreams:
    """Streams of a journal.

    Parameters
    ----------
    metadata : mapping
        Of the journal's header.
    path : Path
        For messages.

    Raises
    ------
    BadInput
        If the header cannot be understood.
    """

    def __init__(self, metadata: Mapping[str, Any], path: Path) -> None:
        try:
            self.facts = {
                name: StreamFacts(
                    name,
                    content["clock"],
                    tuple(Channel.model_validate(channel) for channel in content["channels"]),
                    content["rate_Hz"] or 0.0,
                    content["device"],
                )
                for name, content in metadata["streams"].items()
            }
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise BadInput(f"the journal's header cannot be understood ({error})", file=path) from None
        self.anchor: Anchor | None = None
        """The newest pair of readings of both clocks; whoever reads the journal keeps it up to date."""
        self._branches = {c.name: Branch() for facts in self.facts.values() for c in facts.channels}

    @property
    def ahead_s(self) -> float:
        """Get by how much the host's clock is ahead of the controller's [s]; 0 before any anchor."""
        return 0.0 if self.anchor is None else self.anchor.ahead_s

    def scaled(self, record: DataRecord, newest_us: int) -> ScaledBlock:
        """Return a record's samples in their units.

        Those of a device with a clock of its own are placed at the controller's newest sample: for display
        and margins that is near enough; figures go by the readings of both clocks.

        Parameters
        ----------
        record : DataRecord
            Of a stream that there is, with at least one sample.
        newest_us : int
            Time stamp of the controller's newest sample [µs].
        """
        facts, main = self.facts[record.stream], record.stream == CONTROLLER_STREAM
        at_s = int(record.time_us[-1]) / 1e6 + (self.ahead_s if main else 0.0)
        block = SampleBlock(record.stream, record.sequence, record.time_us, record.counts, record.lost, at_s)
        scaled = scale(block, facts, self._branches)
        if main or facts.clock != "device" or self.anchor is None:
            return scaled
        host_us = round(newest_us + 1e6 * self.ahead_s)
        own = {name: value for name, value in scaled.values.items() if name not in DERIVED}
        return replace(scaled, time_us=scaled.time_us - scaled.time_us[-1] + host_us, values=own)
