"""What a calibration certificate says, as plain facts."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import date
from pathlib import Path


@dataclass(frozen=True)
class Values:
    """A column of a certificate's table.

    Attributes
    ----------
    unit : str
        In D-SI, e.g. ``\\kilo\\newton``.
    values : tuple of float
    expanded : tuple of float or None
        U of each with k = 2, in the same unit; None where none is stated.
    """

    unit: str
    values: tuple[float, ...]
    expanded: tuple[float, ...] | None


@dataclass(frozen=True)
class CertificateTable:
    """A table of calibration points.

    Attributes
    ----------
    name : str
        Of the result that it belongs to.
    reference, shown : tuple of Values
        Reference and measured value of each point; several where they are given in several units.
    error : tuple of Values
        Measured less reference value, where that is stated.
    """

    name: str
    reference: tuple[Values, ...]
    shown: tuple[Values, ...]
    error: tuple[Values, ...]


@dataclass(frozen=True)
class Certificate:
    """A calibration certificate.

    Attributes
    ----------
    file : Path
    number, laboratory : str
    item : str
        Model and serial number of what was calibrated.
    day : date
        Last day of the calibration.
    valid_until : date or None
        Day until which it is to be calibrated again, where the certificate says it.
    signed : bool
        Whether it has a signature. Nothing here checks that.
    tables : tuple of CertificateTable
        In their order; at least one.
    """

    file: Path
    number: str
    laboratory: str
    item: str
    day: date
    valid_until: date | None
    signed: bool
    tables: tuple[CertificateTable, ...]
