"""In which numbers a simulated amplifier measures: by its protocol, or by its register map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bufferstand.drivers.register_maps import DTYPES, AmplifierMap, load_amplifier_map
from bufferstand.drivers.stand_file import AmplifierSettings, StandFile

FULL_SCALE = 0x7FFFFF
"""Largest count of a serial amplifier's bipolar 24-bit value."""
OVER_RANGE = 1.05
"""Where an amplifier ends whose values are no whole numbers, as a share of its range."""
MEASURED_PER_VALUE = 4
"""Measurements that an amplifier with registers makes between two requests: each finds a new one."""


@dataclass(frozen=True)
class AmplifierForm:
    """Numbers of an amplifier.

    Parameters
    ----------
    low, high : float
        Ends of its converter, in raw counts.
    whole : bool
        Whether counts are whole numbers.
    dtype : str
        In which its driver records them.
    rate_Hz : float
        Measurements a second.
    every : int
        Each so many-th of them is recorded.
    """

    low: float
    high: float
    whole: bool
    dtype: str
    rate_Hz: float
    every: int


def amplifier_map(stand_file: StandFile) -> AmplifierMap | None:
    """Return the register map of the stand's amplifier, if it is one with registers.

    Raises
    ------
    BadInput
        If it cannot be read.
    """
    amplifier = stand_file.amplifier
    if amplifier is None or amplifier.modbus is None:
        return None
    return load_amplifier_map(amplifier.modbus.map, stand_file.folder)


def amplifier_form(amplifier: AmplifierSettings, registers: AmplifierMap | None) -> AmplifierForm:
    """Return in which numbers an amplifier measures.

    Parameters
    ----------
    amplifier : AmplifierSettings
    registers : AmplifierMap or None
        Its map, if it is one with registers.
    """
    rate_Hz = amplifier.rate_Hz
    if registers is None:
        return AmplifierForm(-FULL_SCALE, FULL_SCALE, True, "i4", rate_Hz, 1)
    measured_Hz = MEASURED_PER_VALUE * rate_Hz
    dtype = DTYPES[registers.value.type]
    ends = registers.saturation
    if ends is not None:
        return AmplifierForm(*ends, True, dtype, measured_Hz, MEASURED_PER_VALUE)
    if registers.value.type == "u32":
        return AmplifierForm(0, 0xFFFFFFFF, True, dtype, measured_Hz, MEASURED_PER_VALUE)
    reach_kN = OVER_RANGE * amplifier.range_kN
    counts = amplifier.channel.calibration.counts_of(np.array([-reach_kN, reach_kN]))
    return AmplifierForm(
        float(min(counts)), float(max(counts)), False, dtype, measured_Hz, MEASURED_PER_VALUE
    )
