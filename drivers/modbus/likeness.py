"""Which of the devices that this software knows a foreign one could be, by a few harmless reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from bufferstand.drivers.interfaces import NO_REPLY
from bufferstand.drivers.modbus.link import ModbusLink, ModbusRefusal
from bufferstand.foundation import DeviceFault, WireLost

Verdict = Literal["fits", "may fit", "does not fit"]


@dataclass(frozen=True)
class Likeness:
    """How well a device fits.

    Parameters
    ----------
    verdict : str
        ``fits``: what its documents say tells it from others is there. ``may fit``: it answers where the
        values lie, and nothing is known that would tell it. ``does not fit``.
    why : str
    """

    verdict: Verdict
    why: str


@dataclass(frozen=True)
class Candidate:
    """A device that this software knows.

    Parameters
    ----------
    table : str
        Where a stand file names it: ``controller``, ``acquisition``, ``map`` …
    name : str
        What it writes there.
    title : str
    look : callable
        Reads what tells it, through a link; must not write.
    """

    table: str
    name: str
    title: str
    look: Callable[[ModbusLink], Likeness]


@dataclass(frozen=True)
class Found:
    """What was found out about a candidate."""

    candidate: Candidate
    likeness: Likeness
    answered: bool
    """Whether the device has answered, be it by a refusal."""


def look_at(candidate: Candidate, link: ModbusLink) -> Found:
    """Return how well the device at the other end fits a candidate; only wires that are lost raise.

    Raises
    ------
    WireLost
        If there is no connection at all.
    """
    try:
        return Found(candidate, candidate.look(link), True)
    except ModbusRefusal as refusal:
        _, _, said = str(refusal).partition(f"{link.address}: ")
        return Found(candidate, Likeness("does not fit", said.partition(";")[0]), True)
    except WireLost as fault:
        text = str(fault)
        if NO_REPLY not in text and "closed the connection" not in text and "decoded" not in text:
            raise
        return Found(candidate, Likeness("does not fit", "it does not answer this request"), False)
    except DeviceFault as fault:
        return Found(candidate, Likeness("does not fit", str(fault)), True)
