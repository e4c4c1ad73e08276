"""Thresholds and expectations for the signals as data, part of the limits in a run file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.guards.trips import Action

Floats = NDArray[np.float64]
Compared = Literal["all", "piston", "none"]

SOFTEST_FRAME_KN_PER_MM, STIFFEST_FRAME_KN_PER_MM = 80.0, 2000.0
"""A machine of which nothing is stated gives way within these."""
FRAME_SHARES = (0.4, 2.0)
"""One that is stated may give way by so many times as much."""


@dataclass(frozen=True)
class ForceCurve:
    """The force of a first slow compression that is expected of the specimen, at two temperatures.

    Parameters
    ----------
    stroke_mm, cold_kN, warm_kN : tuple of float
        Rising strokes, and the forces there; alike where nobody states how they change with temperature.
    cold_C, warm_C : float
        The two temperatures; forces are linear between and beyond them, as far as ``_FARTHEST_K``.
    fast : float
        By so much the forces rise at the campaign's greatest speed.
    source : str
        Where the curve is from, for messages.
    factor : float or None
        Its own factor, where it is a wide window and no curve; None: the campaign's.
    from_mm : float
        It says nothing of smaller strokes.
    """

    stroke_mm: tuple[float, ...]
    cold_kN: tuple[float, ...]
    warm_kN: tuple[float, ...]
    cold_C: float
    warm_C: float
    fast: float
    source: str
    factor: float | None = None
    from_mm: float = 0.0

    @cached_property
    def _tables(self) -> tuple[Floats, Floats, Floats]:
        return np.array(self.stroke_mm), np.array(self.cold_kN), np.array(self.warm_kN)

    @property
    def end_mm(self) -> float:
        """Return to which stroke it is known [mm]."""
        return self.stroke_mm[-1]

    def at(self, stroke_mm: float, temperature_C: float | None) -> float:
        """Return the force [kN] at a stroke; 0 before first contact, as at ``cold_C`` with no temperature."""
        if stroke_mm <= 0.0:
            return 0.0
        stroke, cold, warm = self._tables
        cold_kN, warm_kN = (
            float(np.interp(stroke_mm, stroke, cold)),
            float(np.interp(stroke_mm, stroke, warm)),
        )
        if temperature_C is None or self.warm_C == self.cold_C:
            return cold_kN
        share = (temperature_C - self.cold_C) / (self.warm_C - self.cold_C)
        return max(0.0, cold_kN + min(max(share, -_FARTHEST), _FARTHEST) * (warm_kN - cold_kN))


_FARTHEST = 2.0
"""So many times the way between both temperatures the linear law is believed."""


@dataclass(frozen=True)
class WiringGuard:
    """Signals that must fit each other; the judges of :mod:`bufferstand.daq.guards.wiring` say how.

    Parameters
    ----------
    action : Action
        What a doubt leads to.
    force_factor : float
        The specimen's force may differ by this factor from what is expected of it, either way.
    curve : ForceCurve or None
        What is expected; None where nothing is known of the specimen's forces.
    frame_kN_per_mm : float or None
        Stiffness of the machine as stated; None: not known.
    force_max_kN : float
        Of the stand.
    delays_s : mapping of str to float
        Stated delay of each channel.
    specimen, ambient : tuple of str
        Temperature streams on the specimen, and beside it.
    ambient_C : float
        Temperature of the air as planned; a thermometer beside the specimen goes before.
    capacity_J_per_K : float or None
        Heat capacity of the specimen; None: not known.
    sensor_lag_s : float or None
        By how much a sensor on it lags behind [s]; None: not known.
    speed : float
        Seconds of the stand in one of the wall: of a simulated stand that runs fast, an amplifier whose
        samples are stamped by the wall tells less of delays.
    motion : str
        What is judged of force, strokes and position: ``all``; ``piston`` and the sign of the force while
        first contact is touched off, which has eyes of its own for the rest
        (:mod:`bufferstand.daq.guards.wiring.first_touch`); ``none`` with the valve off.
    """

    action: Action = Action.STOP
    force_factor: float = 1.8
    curve: ForceCurve | None = None
    frame_kN_per_mm: float | None = None
    force_max_kN: float = 600.0
    delays_s: Mapping[str, float] = field(default_factory=dict)
    specimen: tuple[str, ...] = ()
    ambient: tuple[str, ...] = ()
    ambient_C: float = 21.0
    capacity_J_per_K: float | None = None
    sensor_lag_s: float | None = None
    speed: float = 1.0
    motion: Compared = "all"

    @property
    def factor(self) -> float:
        """Return the factor within which a force is right."""
        own = None if self.curve is None else self.curve.factor
        return self.force_factor if own is None else max(own, self.force_factor)

    @property
    def stiffest_kN_per_mm(self) -> float:  # noqa: N802 - the unit keeps its capital
        """Return the stiffest that the machine may be: a rigid specimen's force rises by no more."""
        frame = self.frame_kN_per_mm
        return STIFFEST_FRAME_KN_PER_MM if frame is None else frame / FRAME_SHARES[0]

    def given_way_mm(self, force_kN: float) -> tuple[float, float]:
        """Return the least and the most that the machine gives way under a force [mm]."""
        size_kN = max(0.0, force_kN)
        if self.frame_kN_per_mm is None:
            return size_kN / STIFFEST_FRAME_KN_PER_MM, size_kN / SOFTEST_FRAME_KN_PER_MM
        least, most = FRAME_SHARES
        return least * size_kN / self.frame_kN_per_mm, most * size_kN / self.frame_kN_per_mm

    def believable_kN(  # noqa: N802 - the unit keeps its capital
        self, force_kN: float, stroke_mm: float, specimen_C: float | None
    ) -> float:
        """Return a force's size, no more than the specimen has at a stroke: a wrong one misleads [kN]."""
        size_kN = abs(force_kN)
        if self.curve is None:
            return size_kN
        most_kN = self.factor * self.curve.fast * self.curve.at(stroke_mm + 2.0, specimen_C)
        return min(size_kN, most_kN)
