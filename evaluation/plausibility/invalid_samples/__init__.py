"""Samples that are no readings: error codes of loggers and single spikes, and how they are left out."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.invalid_samples.error_codes import (
        codes,
        without_codes,
    )
    from bufferstand.evaluation.plausibility.invalid_samples.spike_samples import (
        spike_rows,
        spikes,
        without_spikes,
    )

__all__ = [
    "codes",
    "spike_rows",
    "spikes",
    "without_codes",
    "without_spikes",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
