"""The limits of a zero, and the messages that refuse one beyond them."""

from __future__ import annotations

from dataclasses import dataclass

from bufferstand.daq.guards.wiring.forces import apart_at_rest
from bufferstand.foundation.channels import STROKE_CHANNELS, Zero, farthest_strokes
from bufferstand.protocols.campaign_file import ZeroTable

BEYOND_MM = 5.0
"""A piston that stands farther out than a command goes has the controller's own limit so far beyond it."""


@dataclass(frozen=True)
class LimitNames:
    """What a person changes to move a limit: keys of a campaign file, or options of a command.

    Parameters
    ----------
    travel, touch_force : str
        Of how far it creeps, and of the force at which it turns.
    stroke, wires_apart, force : str
        Of what draw wires, their difference and the force may read; empty where it is a fixed figure.
    """

    travel: str
    touch_force: str
    stroke: str
    wires_apart: str
    force: str


CAMPAIGN = LimitNames(
    travel="[zero] travel_max_mm",
    touch_force="touch_force_kN",
    stroke="[zero] stroke_max_mm",
    wires_apart="[zero] wires_apart_max_mm, else the tilt in force",
    force="[guards] zero_force_max_kN",
)
BY_HAND = LimitNames(
    travel="--travel",
    touch_force="--touch-force",
    stroke="",
    wires_apart="[stand] tilt_max_mm of the stand file, 5 where it has none",
    force="",
)


@dataclass(frozen=True)
class ZeroLimits:
    """How far off the channels may be found.

    Parameters
    ----------
    force_kN : float
        At rest.
    apart_mm : float
        Difference of any two draw wires at first contact.
    release_speed_mm_per_s : float
        Of the release before the touch.
    names : LimitNames
        What messages call the limits.
    """

    force_kN: float
    apart_mm: float
    release_speed_mm_per_s: float
    names: LimitNames = CAMPAIGN


def zero_refusal(zero: Zero, table: ZeroTable, limits: ZeroLimits) -> str:
    """Return why a zero is too far off to be one, empty if it is not."""
    names = limits.names
    for name in STROKE_CHANNELS:
        value = zero.value(name)
        if not abs(value) <= table.stroke_max_mm:  # true for NaN, too
            most = _most(names.stroke, table.stroke_max_mm, "mm")
            return (
                f"{name} reads {value:+.2f} mm {_where(zero)}, more than {most}: hook the wire in anew, or "
                "correct its calibration"
            )
    if text := wires_apart(zero, limits.apart_mm):
        return (
            f"{text}, more than {limits.apart_mm:g} mm ({names.wires_apart}): "
            "align the specimen, or hook the wires in anew"
        )
    force_kN = zero.value("force")
    if not abs(force_kN) <= limits.force_kN:  # true for NaN, too
        most = _most(names.force, limits.force_kN, "kN")
        beside = forces_apart(zero)
        return (
            f"the force reads {force_kN:+.2f} kN at rest, more than {most}: "
            + (f"{beside}; where the specimen bears one: " if beside else "")
            + "unload the specimen, or set the zero of transducer or calibration"
        )
    return ""


def forces_apart(zero: Zero) -> str:
    """Return that force and force_2 do not agree at rest, empty where they do or one of them is not there."""
    first, second = zero.of("force"), zero.of("force_2")
    if first is None or second is None:
        return ""
    return apart_at_rest(first.value, second.value, counted=False)


def wires_apart(zero: Zero, most_mm: float) -> str:
    """Return by how much two draw wires differ at the zero, empty if by no more than ``most_mm``."""
    farthest = farthest_strokes({one.name: one.value for one in zero.channel})
    if farthest is None or abs(farthest[2]) <= most_mm:
        return ""
    one, two, apart_mm = farthest
    return f"{_where(zero)} the draw wires differ by {apart_mm:+.2f} mm ({one} − {two})"


def _where(zero: Zero) -> str:
    return "at rest" if zero.how == "tare" else "at first contact"


def _most(name: str, most: float, unit: str) -> str:
    return f"{name} = {most:g} {unit}" if name else f"{most:g} {unit}"
