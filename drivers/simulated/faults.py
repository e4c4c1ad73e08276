"""Faults that a simulated stand can be told to show, by stand time."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from foundation.errors import BadInput

FaultKind = Literal["silent", "power-on", "lost"]
"""``silent``: a sensor gives nothing; ``power-on``: a DS18B20 reads 85.0 °C; ``lost``: the link is cut."""

_FORM = re.compile(r"^(?P<target>[a-z][a-z0-9_]*)=(?P<kind>[a-z-]+)@(?P<start>[0-9.]+)(:(?P<end>[0-9.]+))?$")


@dataclass(frozen=True)
class ScheduledFault:
    """A fault of one device between two instants of stand time.

    Parameters
    ----------
    target : str
        ``temperature_1`` …, ``amplifier`` or ``controller``.
    kind : str
        ``silent`` or ``power-on`` for a temperature sensor, ``silent`` for the amplifier, ``lost`` for the
        controller's link.
    start_s, end_s : float
        Stand time [s].
    """

    target: str
    kind: FaultKind
    start_s: float
    end_s: float = float("inf")


class FaultSchedule:
    """Which fault a device shows at an instant.

    Parameters
    ----------
    faults : sequence of ScheduledFault
    """

    def __init__(self, faults: Sequence[ScheduledFault] = ()) -> None:
        self._faults = list(faults)

    def add(self, fault: ScheduledFault) -> None:
        """Add a fault."""
        self._faults.append(fault)

    def at(self, target: str, time_s: float) -> FaultKind | None:
        """Return the fault that ``target`` shows at stand time ``time_s`` [s]."""
        for fault in self._faults:
            if fault.target == target and fault.start_s <= time_s < fault.end_s:
                return fault.kind
        return None


def parse_fault(text: str) -> ScheduledFault:
    """Return the fault that ``TARGET=KIND@START[:END]`` describes (stand time in s).

    Raises
    ------
    BadInput
        If it does not have this form, or the target cannot have this fault.
    """
    found = _FORM.match(text)
    fits = {"controller": ("lost",), "amplifier": ("silent",)}
    if found:
        target, kind = found["target"], found["kind"]
        kinds = ("silent", "power-on") if target.startswith("temperature_") else fits.get(target, ())
        if kind in kinds:
            end = float(found["end"]) if found["end"] else float("inf")
            return ScheduledFault(target, kind, float(found["start"]), end)  # type: ignore[arg-type]
    raise BadInput(
        f"“{text}” is no fault that can be simulated",
        file="--fault",
        remedy="write controller=lost@12:15, amplifier=silent@30 or temperature_1=silent@30 (or power-on)",
    )
