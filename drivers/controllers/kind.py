"""A kind of controller: its table of a stand file, and how it is reached."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

from bufferstand.drivers.modbus import Candidate, ModbusLink, Wire
from bufferstand.drivers.register_maps import Profile
from bufferstand.foundation.settings import Settings


@dataclass(frozen=True)
class ControllerSite:
    """Where a controller of a stand is used.

    Parameters
    ----------
    wire : Wire
        The link owns it.
    profile : Profile
        The register map that the stand file names.
    device_id : int
        Unit identifier.
    timeout_s : float
        Longest wait for a reply [s].
    speed_max_mm_per_s, frequency_max_Hz : float
        Of the stand's limits.
    now_s : callable
        Stand time [s].
    """

    wire: Wire
    profile: Profile
    device_id: int
    timeout_s: float
    speed_max_mm_per_s: float
    frequency_max_Hz: float
    now_s: Callable[[], float]


class ControllerKind(ABC):
    """One kind of controller. A stand file names it; everything else is asked of it.

    A kind lies in a folder of its own below ``drivers/controllers``, whose ``kind.py`` has one as ``KIND``,
    or in another package that names it as an entry point of the group ``bufferstand.controllers``.
    """

    name: ClassVar[str]
    """What a stand file calls it: ``[controller] kind``."""
    title: ClassVar[str]
    """What it is, in words."""
    settings: ClassVar[type[Settings] | None]
    """Schema of its table ``[controller.NAME]``; None where it has none."""
    profile: ClassVar[str]
    """Register profile where the stand file names none."""
    sources: ClassVar[tuple[str, ...]]
    """Documents that it is made from, with edition and pages."""
    confirmed: ClassVar[bool]
    """Whether it was confirmed on hardware."""

    def candidates(self) -> Iterable[Candidate]:
        """Return the controllers of this kind that a foreign device could be; none by default."""
        return ()

    @abstractmethod
    def link(self, settings: Any, site: ControllerSite) -> ModbusLink:
        """Return the link to one, not opened yet: its registers have the names of the profile."""
