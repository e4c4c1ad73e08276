"""What stands on the track: vehicles, and what is between two of them."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.model.spring import SpringModel


@dataclass(frozen=True)
class Vehicle:
    """A rigid mass.

    Parameters
    ----------
    name : str
        What it is called in results.
    mass_t : float
        Its mass [t], that of turning parts included where somebody wants it so.
    speed_m_per_s : float
        At the beginning; positive towards the vehicle behind it in the list.
    """

    name: str
    mass_t: float
    speed_m_per_s: float


@dataclass(frozen=True)
class Springs:
    """Two springs in a row, one of either vehicle, and how many such rows work beside each other.

    Parameters
    ----------
    left, right : SpringModel
        Of the vehicle before the gap, and of the one behind it.
    abreast : int
        Rows beside each other: 2 for side buffers, 1 for a coupling.
    """

    left: SpringModel
    right: SpringModel
    abreast: int


@dataclass(frozen=True)
class Gap:
    """What is between two vehicles.

    Parameters
    ----------
    push : Springs
        The buffers, face to face.
    pull : Springs or None
        The draw gears of a coupling; None where the vehicles are not coupled.
    distance_mm : float
        Between the buffers' faces at the beginning.
    play_mm : float
        Further opening, from the beginning, before the draw gears pull.
    """

    push: Springs
    pull: Springs | None
    distance_mm: float
    play_mm: float


@dataclass(frozen=True)
class Train:
    """Vehicles in the order of the track, n of them, and the n - 1 gaps between them.

    Parameters
    ----------
    name : str
    vehicles : tuple of Vehicle
    gaps : tuple of Gap
    temperature_C : float
        Of all springs and of the air at the beginning.
    duration_s, step_s : float
        How long to watch, and the step of the integration.
    """

    name: str
    vehicles: tuple[Vehicle, ...]
    gaps: tuple[Gap, ...]
    temperature_C: float
    duration_s: float
    step_s: float
