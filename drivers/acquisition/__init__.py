"""Acquisition devices: many channels sampled by one clock of their own.

A folder for each kind, beside what a kind is and which there are.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.drivers.acquisition.catalogue import (
        acquisition_kind_of,
        acquisition_kinds,
    )
    from bufferstand.drivers.acquisition.kind import (
        AcquisitionDevice,
        AcquisitionKind,
        AcquisitionSettings,
    )

__all__ = [
    "AcquisitionDevice",
    "AcquisitionKind",
    "AcquisitionSettings",
    "acquisition_kind_of",
    "acquisition_kinds",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
