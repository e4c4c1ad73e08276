"""Conversion at the edges; inside, every number is in the unit that its name says.

Inside: mm, kN, s, °C, J (1 kN·mm = 1 J). A conversion is ``value * factor + offset``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bufferstand.foundation.errors import BadInput

Number = TypeVar("Number", float, NDArray[np.float64])

# Exact by definition: inch 25.4 mm, pound 0.45359237 kg, standard gravity 9.80665 m/s².
_POUND_FORCE_KN = 0.45359237 * 9.80665 / 1000.0

FACTORS: dict[str, dict[str, tuple[float, float]]] = {
    "time": {"s": (1.0, 0.0), "ms": (1e-3, 0.0), "min": (60.0, 0.0)},
    "stroke": {"mm": (1.0, 0.0), "m": (1000.0, 0.0), "in": (25.4, 0.0)},
    "speed": {"mm/s": (1.0, 0.0), "m/s": (1000.0, 0.0), "in/s": (25.4, 0.0)},
    "force": {
        "kN": (1.0, 0.0),
        "N": (1e-3, 0.0),
        "lbf": (_POUND_FORCE_KN, 0.0),
        "kip": (1000.0 * _POUND_FORCE_KN, 0.0),
    },
    "temperature": {
        "°C": (1.0, 0.0),
        "C": (1.0, 0.0),
        "degC": (1.0, 0.0),
        "K": (1.0, -273.15),
        "°F": (5.0 / 9.0, -160.0 / 9.0),
    },
    "pressure": {"bar": (1.0, 0.0), "MPa": (10.0, 0.0), "kPa": (0.01, 0.0), "Pa": (1e-5, 0.0)},
    "acceleration": {"m/s²": (1.0, 0.0)},
}
"""Factor and offset to the inside unit, by quantity and unit name."""

INSIDE_UNIT = {
    "time": "s",
    "stroke": "mm",
    "speed": "mm/s",
    "force": "kN",
    "temperature": "°C",
    "pressure": "bar",
    "acceleration": "m/s²",
}
"""The unit in which each quantity is kept inside."""


DSI_UNITS: Mapping[str, str] = {
    "1": r"\one",
    "": r"\one",
    "cycles": r"\one",
    "%": r"\percent",
    "kN": r"\kilo\newton",
    "N": r"\newton",
    "mm": r"\milli\metre",
    "mm/s": r"\milli\metre\per\second",
    "m": r"\metre",
    "m/s": r"\metre\per\second",
    "km/h": r"\kilo\metre\per\hour",
    "kN/mm": r"\kilo\newton\per\milli\metre",
    "J": r"\joule",
    "kJ": r"\kilo\joule",
    "Hz": r"\hertz",
    "°C": r"\degreecelsius",
    "K": r"\kelvin",
    "s": r"\second",
    "min": r"\minute",
    "h": r"\hour",
    "bar": r"\bar",
    "MPa": r"\mega\pascal",
    "kPa": r"\kilo\pascal",
    "Pa": r"\pascal",
    "m/s²": r"\metre\per\second\tothe{2}",
}
"""Units of results, limits and channels in D-SI (PTB and SmartCom, 2.1.0, doi 10.5281/zenodo.3366901)."""


def conversion(quantity: str, unit: str) -> tuple[float, float]:
    """Return factor and offset that take ``unit`` to the inside unit of ``quantity``.

    Raises
    ------
    BadInput
        If the unit is not one of the quantity's; the message lists those that are.
    """
    known = FACTORS[quantity]
    if unit not in known:
        raise BadInput(
            f"unit “{unit}” is not understood for {quantity}", remedy=f"use one of {', '.join(known)}"
        )
    return known[unit]


def to_inside(value: Number, quantity: str, unit: str) -> Number:
    """Return ``value`` given in ``unit``, in the inside unit of ``quantity``: itself where that is its unit.

    Raises
    ------
    BadInput
        If the unit is not one of the quantity's.
    """
    factor, offset = conversion(quantity, unit)
    if factor == 1.0 and offset == 0.0:
        return value
    return value * factor + offset
