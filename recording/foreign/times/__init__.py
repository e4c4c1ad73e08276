"""The times of a foreign record: time stamps, instants of each channel, and time bases."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.recording.foreign.times.bases import (
        TimeBase,
        rate_findings,
        time_bases,
        value_findings,
    )
    from bufferstand.recording.foreign.times.instants import (
        doubled_rows,
        has_own_instants,
        shared_stamps,
        spread_stamps,
    )

__all__ = [
    "TimeBase",
    "doubled_rows",
    "has_own_instants",
    "rate_findings",
    "shared_stamps",
    "spread_stamps",
    "time_bases",
    "value_findings",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
