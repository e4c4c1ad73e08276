"""Quantities: a value with U in D-SI, rounded as the printed report has it; or the reason why there is none.

D-SI: Digital System of Units, PTB and SmartCom, version 2.1.0, doi 10.5281/zenodo.3366901.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree as ET

from bufferstand.evaluation.report.content import decimals_of, usable
from bufferstand.evaluation.report.digital.elements import NOT_ON_RECORD, add, add_si, add_text

COVERAGE_FACTOR = "2"
COVERAGE_PROBABILITY = "0.95"
"""U = 2 u covers about 95 %, as the printed report says."""
_MOST_DECIMALS = 3
_SIGNIFICANT = 4

DSI_UNITS: Mapping[str, str] = {
    "1": r"\one",
    "": r"\one",
    "cycles": r"\one",
    "%": r"\percent",
    "kN": r"\kilo\newton",
    "N": r"\newton",
    "mm": r"\milli\metre",
    "mm/s": r"\milli\metre\per\second",
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
    "m/s²": r"\metre\per\second\tothe{2}",
}
"""Units of results, limits and channels in D-SI."""


def add_quantity(
    parent: ET.Element,
    name: str,
    value: object,
    unit: str,
    *,
    expanded: object = None,
    why: str = "",
    kind: str = "",
    element: str = "quantity",
) -> ET.Element:
    """Add a quantity and return it; one without a value says why, one in a unit unknown to D-SI is a text.

    Parameters
    ----------
    parent : Element
    name : str
        In words.
    value, expanded : float or None
        In ``unit``; U with k = 2.
    unit : str
        As the evaluation document has it, e.g. ``kN/mm``.
    why : str
        Why the value is missing, if it is.
    kind : str
        Its refType.
    element : str
        ``quantity``, ``itemQuantity`` or ``measuringEquipmentQuantity``.
    """
    quantity = add(parent, element, kind=kind)
    add_text(quantity, "name", name)
    number, uncertainty = usable(value), usable(expanded)
    if number is None:
        add_text(quantity, "noQuantity", f"no value: {why or NOT_ON_RECORD}")
        return quantity
    text, beside = numbers(number, uncertainty)
    if unit not in DSI_UNITS:
        add_text(quantity, "noQuantity", f"{text}{f' ± {beside} (k = 2)' if beside else ''} {unit}")
        return quantity
    real = add_si(quantity, "real")
    add_si(real, "value", text)
    add_si(real, "unit", DSI_UNITS[unit])
    if beside:
        spread = add_si(real, "expandedUnc")
        add_si(spread, "uncertainty", beside)
        add_si(spread, "coverageFactor", COVERAGE_FACTOR)
        add_si(spread, "coverageProbability", COVERAGE_PROBABILITY)
    return quantity


def numbers(value: float, expanded: float | None) -> tuple[str, str]:
    """Return a value and its U as D-SI writes them: U to two significant digits, the value to its place.

    Where no U is known, at most four significant digits and three decimals are given, as in print.
    """
    if expanded is not None and expanded > 0.0:
        decimals = decimals_of(expanded)
        return _decimal(value, decimals), _decimal(expanded, decimals)
    value = round(value, _MOST_DECIMALS)
    decimals = 0 if value == 0.0 else _SIGNIFICANT - 1 - math.floor(math.log10(abs(value)))
    text = _decimal(value, decimals)
    return text.rstrip("0").rstrip(".") if "." in text else text, ""


def exact(value: float) -> str:
    """Return a number that was set and not measured (a limit), with every digit that it has."""
    text = f"{value:.12f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _decimal(value: float, decimals: int) -> str:
    text = f"{round(value, decimals):.{max(0, decimals)}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
