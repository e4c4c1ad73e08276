"""A temperature sensor that does not sit where the stand file says."""

from __future__ import annotations

import math

from bufferstand.drivers.simulated.miswiring.settings import MiswiredThermometer


class MisplacedThermometer:
    """What a sensor feels that was swapped, never attached, falls off or hangs.

    Parameters
    ----------
    role : str
        Where it should sit: ``specimen`` or ``ambient``.
    facts : MiswiredThermometer
    """

    def __init__(self, role: str, facts: MiswiredThermometer) -> None:
        self._facts = facts
        self._where = facts.feels or role
        self._when_it_fell: tuple[float, float] | None = None
        self._held: float | None = None

    def feel(self, time_s: float, specimen_C: float, ambient_C: float) -> float:
        """Return what the sensor feels at a stand time.

        Parameters
        ----------
        time_s : float
            Stand time, never before that of the call before [s].
        specimen_C, ambient_C : float
            What a sensor on the specimen and one in the air feel then [°C].
        """
        facts = self._facts
        felt = specimen_C if self._where == "specimen" else ambient_C
        if facts.falls_off_at_s is not None and time_s >= facts.falls_off_at_s:
            if self._when_it_fell is None:
                self._when_it_fell = time_s, felt
            fell_s, was_C = self._when_it_fell
            felt = ambient_C + (was_C - ambient_C) * math.exp(-(time_s - fell_s) / facts.falls_s)
        if facts.frozen_at_s is not None:
            if time_s < facts.frozen_at_s or self._held is None:
                self._held = felt
            felt = self._held
        return facts.scale * felt + facts.zero
