"""Where an instrument is reached, whatever is spoken there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class SerialAddress:
    """A serial device and how its line is set.

    Parameters
    ----------
    path : Path
        Of the device.
    baud : int
    parity : str
    stop_bits : int
    """

    path: Path
    baud: int
    parity: Literal["none", "even", "odd"] = "none"
    stop_bits: int = 1


@dataclass(frozen=True)
class TcpAddress:
    """A port of a host."""

    host: str
    port: int


@dataclass(frozen=True)
class FolderAddress:
    """A folder of files that the kernel makes of a bus."""

    path: Path


WireAddress = SerialAddress | TcpAddress | FolderAddress
Place = Path | TcpAddress
"""Where else a wire may end: another serial device or folder, or another port."""
