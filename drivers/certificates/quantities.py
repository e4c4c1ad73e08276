"""Columns of a certificate's table, in D-SI 2.1 (DCC 3.0 to 3.2) and 2.2 (DCC 3.3)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from xml.etree import ElementTree as ET

from bufferstand.drivers.certificates.certificate import Values
from bufferstand.foundation import BadInput

SI = "https://ptb.de/si"
_K = 2.0
_LISTS = (
    ("expandedUncXMLList", "uncertaintyXMLList", "coverageFactorXMLList"),
    (
        "measurementUncertaintyUnivariateXMLList/expandedMUXMLList",
        "valueExpandedMUXMLList",
        "coverageFactorXMLList",
    ),
)
_SINGLE = (
    ("expandedUnc", "uncertainty", "coverageFactor"),
    ("measurementUncertaintyUnivariate/expandedMU", "valueExpandedMU", "coverageFactor"),
)
"""Where expanded uncertainties stand: element, value and coverage factor in it, by version of D-SI."""

Refuse = Callable[[str, str], BadInput]
"""Makes the refusal of a problem and its remedy, with file and place."""


def columns(quantity: ET.Element, refuse: Refuse) -> tuple[Values, ...]:
    """Return what a quantity lists: once in each unit that it is given in; nothing where it is no list.

    Raises
    ------
    BadInput
        By ``refuse``: a number or an uncertainty that is none, or units that differ from point to point.
    """
    found = []
    for element in _lists(quantity):
        single = element.tag == f"{{{SI}}}real"
        value, unit, stated = (
            ("value", "unit", _SINGLE) if single else ("valueXMLList", "unitXMLList", _LISTS)
        )
        values = _numbers(element, value, refuse)
        units = {*_words(element, unit)}
        if len(units) != 1:
            raise refuse(
                f"its points have {'no unit' if not units else 'different units'}", "one unit is wanted"
            )
        found.append(Values(units.pop(), values, _expanded(element, stated, len(values), refuse)))
    return tuple(found)


def _lists(quantity: ET.Element) -> Iterator[ET.Element]:
    for path in ("realListXMLList", "hybrid/realListXMLList", "real", "hybrid/real"):
        yield from quantity.iterfind(_path(path))


def _expanded(
    element: ET.Element, stated: tuple[tuple[str, str, str], ...], points: int, refuse: Refuse
) -> tuple[float, ...] | None:
    for place, value, factor in stated:
        inside = element.find(_path(place))
        if inside is None:
            continue
        expanded, factors = _numbers(inside, value, refuse), _numbers(inside, factor, refuse)
        if not {len(expanded), len(factors)} <= {1, points}:
            raise refuse(
                f"{points} points have {len(expanded)} uncertainties and {len(factors)} coverage factors",
                "one for all, or one a point is wanted",
            )
        if min(expanded) < 0.0 or min(factors) <= 0.0:
            raise refuse("an uncertainty is negative, or a coverage factor not above 0", "ask its laboratory")
        spread = expanded if len(expanded) == points else expanded * points
        scales = factors if len(factors) == points else factors * points
        return tuple(_K * one / k for one, k in zip(spread, scales, strict=True))
    return None


def _numbers(element: ET.Element, name: str, refuse: Refuse) -> tuple[float, ...]:
    numbers = []
    for word in _words(element, name):
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise refuse(f"“{word[:40]}” in si:{name} is no number", "ask its laboratory")
        numbers.append(number)
    if not numbers:
        raise refuse(f"si:{name} is missing or empty", "ask its laboratory")
    return tuple(numbers)


def _words(element: ET.Element, name: str) -> list[str]:
    return (element.findtext(_path(name)) or "").split()


def _path(names: str) -> str:
    return "/".join(f"{{{SI}}}{name}" for name in names.split("/"))
