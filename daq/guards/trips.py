"""What a guard says.

The trip, and what it leads to. The latch lies in :mod:`bufferstand.daq.guards.panel`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal


class Action(IntEnum):
    """What a trip leads to; a higher one overrides a lower one."""

    NOTE = 0
    """Said and recorded; the campaign goes on."""
    STOP_AFTER_CYCLE = 1
    """The cycle under way ends, then the safe stop."""
    STOP = 2
    """Safe stop at once: hold, ramp to zero force, valve off."""
    EMERGENCY = 3
    """Safe stop at once without the hold: unload first."""


@dataclass(frozen=True)
class Trip:
    """A guard that tripped: who, what to do, and all that a person needs to understand it.

    Parameters
    ----------
    guard : str
        Name of the guard (``force``, ``temperature_1`` …).
    action : Action
        What it leads to.
    reason : str
        One sentence with value, limit, unit, sensor and place.
    at_s : float
        Host stand time at which it was noticed [s].
    value, limit : float or None
        The offending value and the limit, in ``unit``.
    unit : str
        Unit of both.
    stream : str
        The stream of the causing sample, empty if none caused it.
    sequence : int or None
        Absolute sequence number of the causing sample.
    time_us : int or None
        Its time stamp [µs].
    device_fault : bool
        True if a device or its wire failed (exit status 4), False for a limit or an operator (3).
    sensor, setting, doubt : str
        Of a signal that does not fit the others: its channel, where in the stand file to look, and what is
        wrong with it; empty for any other trip.
    believed : bool
        Whether it rests on a signal that the guard believed: those that doubt signals are asked of it before
        it is latched.
    limited : str or None
        What a limit of the device's own was of that has led to it; None without one.
    """

    guard: str
    action: Action
    reason: str
    at_s: float
    value: float | None = None
    limit: float | None = None
    unit: str = ""
    stream: str = ""
    sequence: int | None = None
    time_us: int | None = None
    device_fault: bool = False
    sensor: str = ""
    setting: str = ""
    doubt: str = ""
    believed: bool = False
    limited: Literal["force", "stroke"] | None = None

    def facts(self) -> dict[str, object]:
        """Return the trip as data of a run's event (only what is known)."""
        content: dict[str, object] = {"guard": self.guard, "action": self.action.name.lower()}
        for name in ("value", "limit", "sequence", "time_us"):
            number = getattr(self, name)
            if number is not None and math.isfinite(number):  # a run's event holds numbers only
                content[name] = number
        if self.unit:
            content["unit"] = self.unit
        for name in ("stream", "sensor", "setting", "doubt"):
            if getattr(self, name):
                content[name] = getattr(self, name)
        if self.device_fault:
            content["device_fault"] = True
        return content


def run_status(trip: Trip) -> Literal["stopped", "failed"]:
    """Return how a run ends that a trip stopped: ``failed`` where its last moment may be missing."""
    return "failed" if trip.guard in ("controller", "recorder", "internal") else "stopped"
