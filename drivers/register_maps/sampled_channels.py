"""Which channels a controller can sample: their names say what they measure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from bufferstand.foundation.channels import CHANNEL_UNITS, STROKE_CHANNELS, Quantity

REQUIRED_CHANNELS: Mapping[str, str] = {
    "force": "limits, guards and every figure are made of it",
    "stroke_1": "limits, guards and every figure are made of it",
    "position": "the following error is counted from it, and the draw wires are compared with it",
    "command": "following error and standing channels are judged by it",
}
"""Channels that a controller must sample, and why."""

_FIRST_WITHOUT_NUMBER = ("force", "position", "command")
_NUMBER = re.compile(r"[1-9][0-9]?")


def quantity_of(name: str) -> Quantity | None:
    """Return what the channel of a name measures; None if no channel of a controller has this name.

    Names are ``force``, ``position`` and ``command``, with further ones of a kind numbered from 2 on
    (``force_2``); ``stroke_1`` to ``stroke_4``; and of any other quantity its name and a number from 1 to 99
    (``pressure_1``).
    """
    word, _, number = name.partition("_")
    quantity = next((one for one in CHANNEL_UNITS if one == word), None)
    if quantity in _FIRST_WITHOUT_NUMBER:
        named = name == quantity or (number != "1" and _NUMBER.fullmatch(number) is not None)
    elif quantity == "stroke":
        named = name in STROKE_CHANNELS
    else:
        named = _NUMBER.fullmatch(number) is not None
    return quantity if named else None


def unknown_name(name: str) -> str:
    """Return that a controller can have no channel of this name, and which names there are."""
    others = [f"{one}_1 …" for one in CHANNEL_UNITS if one not in (*_FIRST_WITHOUT_NUMBER, "stroke")]
    return (
        f"the controller has no channel “{name}”; its channels are {', '.join(_FIRST_WITHOUT_NUMBER)} "
        f"(further ones force_2 …), {STROKE_CHANNELS[0]} to {STROKE_CHANNELS[-1]}, {', '.join(others)}"
    )


def missing_channels(names: Iterable[str]) -> list[str]:
    """Return the channels that a controller must sample and that are not among ``names``."""
    there = set(names)
    return [name for name in REQUIRED_CHANNELS if name not in there]


def hole_in_strokes(names: Iterable[str]) -> str:
    """Return what is wrong with the numbers of the stroke channels among ``names``; empty if nothing is."""
    there = [name in set(names) for name in STROKE_CHANNELS]
    if there == sorted(there, reverse=True):
        return ""
    missing = STROKE_CHANNELS[there.index(False)]
    return f"“{missing}” is not there, though a later one is; number the draw wires from 1 on"
