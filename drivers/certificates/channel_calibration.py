"""What a channel of a stand takes of a certificate: calibration, and limits of its errors.

A certificate of a transducer says what it gives at each force (mV/V): that becomes a table of the channel's
input. One of a whole chain says what it shows in the channel's own unit: counts become values as before, and
what it is off, with U, becomes a limit. U with k = 2 is taken for the half-width of a limit (rectangular),
which makes the standard uncertainty 2/√3 of the certificate's.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any

from bufferstand.drivers.certificates.certificate import Certificate, CertificateTable, Values
from bufferstand.foundation import DSI_UNITS, FACTORS, BadInput, conversion
from bufferstand.foundation.channels import Calibration, Quantity

FILL_IN = "fill-in"
"""Stands for a number that only the stand has; a stand file with it is refused until it is filled in."""
_FURTHER: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "force": {r"\mega\newton": (1000.0, 0.0)},
    "stroke": {r"\micro\metre": (1e-3, 0.0), r"\centi\metre": (10.0, 0.0)},
}
"""Further units of certificates (:data:`bufferstand.foundation.DSI_UNITS`): factor and offset to ours."""
_INPUTS: Mapping[str, Mapping[str, float]] = {
    "mV/V": {
        r"\milli\volt\per\volt": 1.0,
        r"\milli\volt\volt\tothe{-1}": 1.0,
        r"\volt\per\volt": 1000.0,
        r"\volt\volt\tothe{-1}": 1000.0,
    },
}
"""Units in which a transducer gives its signal: factor to the input's unit."""
_OF_LENGTH = ("stroke", "position")


@dataclass(frozen=True)
class ChannelCalibration:
    """What is to be written into a stand file.

    Attributes
    ----------
    calibration, uncertainty : mapping
        Keys and their new values; None: the key goes.
    notes : tuple of str
        What whoever imports it must know.
    """

    calibration: Mapping[str, Any]
    uncertainty: Mapping[str, Any]
    notes: tuple[str, ...]


def calibrated(
    certificate: Certificate,
    quantity: Quantity,
    before: Calibration | None,
    *,
    table: int | None = None,
    valid_until: date | None = None,
) -> ChannelCalibration:
    """Return what a channel takes of a certificate.

    Parameters
    ----------
    certificate : Certificate
    quantity : str
        What the channel measures.
    before : Calibration or None
        Its calibration up to now; None: it is not known here.
    table : int, optional
        Which of the certificate's tables, from 1; the only one otherwise.
    valid_until : date, optional
        Instead of what the certificate says.

    Raises
    ------
    BadInput
        If the table is not clear, its units are not the channel's, or it states no uncertainty.
    """
    chosen = _chosen(certificate, table)
    until = valid_until or certificate.valid_until
    if until is not None and until < certificate.day:
        raise BadInput(
            f"it would be valid until {until}, before its own day, {certificate.day}",
            file=certificate.file,
            remedy="look at both days",
        )
    reference = _of_quantity(certificate, chosen.reference, quantity, "reference values")
    written = {
        "id": certificate.item or certificate.number,
        "certificate": f"{certificate.number}, {certificate.laboratory}",
        "date": certificate.day,
        "valid_until": until,
    }
    found = _input_table(certificate, chosen, reference, before)
    if found is None:
        found = _errors(certificate, chosen, reference, quantity)
        if before is None:
            found[0]["coefficients"] = FILL_IN
    curve, limits, notes = found
    notes += [] if until else ["The certificate names no day of recalibration: valid_until is not written."]
    if certificate.signed:
        notes.append("The certificate has a signature, which was not checked.")
    return ChannelCalibration({**written, **curve}, _limits(quantity, reference, limits), tuple(notes))


def _chosen(certificate: Certificate, number: int | None) -> CertificateTable:
    tables = certificate.tables
    if number is None and len(tables) == 1:
        return tables[0]
    names = "; ".join(f"{n} {table.name}" for n, table in enumerate(tables, start=1))
    if number is None or not 1 <= number <= len(tables):
        what = f"it has {len(tables)} tables: {names}" if number is None else f"it has no table {number}"
        raise BadInput(what, file=certificate.file, remedy=f"name one by --table 1 to {len(tables)}")
    return tables[number - 1]


_Found = tuple[dict[str, Any], Sequence[float], list[str]]
"""Keys of the calibration, the limit of each point's error in the channel's unit, and notes."""


def _input_table(
    certificate: Certificate, table: CertificateTable, reference: Values, before: Calibration | None
) -> _Found | None:
    """Return the table of a transducer's signal; None where the certificate shows no signal."""
    for unit, factors in _INPUTS.items():
        for shown in table.shown:
            if shown.unit not in factors:
                continue
            _demand_input(certificate, unit, before)
            signal = [factors[shown.unit] * value for value in shown.values]
            points = _rising(certificate, signal, reference.values)
            expanded = _expanded_of_signal(certificate, table, shown, factors, points, reference)
            curve: dict[str, Any] = {"table": points, "input_unit": unit}
            curve |= dict.fromkeys(("coefficients", "falling", "turn_counts"))
            if before is None:
                curve["input_per_count"] = FILL_IN
            low, high = points[0][1], points[-1][1]
            notes = [f"Below {low:g} and above {high:g} the curve goes on straight: no point lies there."]
            if before is not None and before.falling:
                notes.append("The falling branch of the former calibration is gone: this table has none.")
            return curve, expanded, notes
    return None


def _demand_input(certificate: Certificate, unit: str, before: Calibration | None) -> None:
    if before is not None and before.input_unit != unit:
        raise BadInput(
            f"its measured values are in {unit}, and the channel does not say what a count is in {unit}",
            file=certificate.file,
            remedy=f"write input_per_count and input_unit = “{unit}” first, from the amplifier's manual",
        )


def _rising(
    certificate: Certificate, signal: Sequence[float], values: Sequence[float]
) -> tuple[tuple[float, float], ...]:
    """Return the points in the order of their signal; a signal that comes twice is a falling branch."""
    if len(signal) != len(values):
        raise BadInput(
            f"{len(values)} reference values stand beside {len(signal)} measured ones",
            file=certificate.file,
            remedy="ask its laboratory",
        )
    points = tuple(sorted(zip(signal, values, strict=True)))
    steps = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(points)]
    flat = any(x <= 0.0 or y == 0.0 for x, y in steps)
    if flat or len({y > 0.0 for _, y in steps}) != 1:  # no steps at all: one point
        raise BadInput(
            "its points do not rise, or fall, all along: a calibration table here has one branch",
            file=certificate.file,
            remedy="choose a table with rising loads only, or write the points by hand",
        )
    return points


def _expanded_of_signal(
    certificate: Certificate,
    table: CertificateTable,
    shown: Values,
    factors: Mapping[str, float],
    points: Sequence[tuple[float, float]],
    reference: Values,
) -> Sequence[float]:
    """Return U of each point in the channel's unit; that of the signal by the steepest slope."""
    slopes = [abs((b[1] - a[1]) / (b[0] - a[0])) for a, b in itertools.pairwise(points)]
    steepest = max(slopes)
    stated = [] if reference.expanded is None else [reference.expanded]
    stated += [
        tuple(steepest * factors[column.unit] * one for one in column.expanded)
        for column in (shown, *table.error)
        if column.expanded is not None and column.unit in factors
    ]
    return _largest(certificate, stated, len(points))


def _errors(
    certificate: Certificate, table: CertificateTable, reference: Values, quantity: Quantity
) -> _Found:
    """Return how far each point is off, with U, where the certificate is of the whole chain."""
    shown = _of_quantity(certificate, table.shown, quantity, "measured values")
    points = len(reference.values)
    stated = [column.expanded for column in (reference, shown) if column.expanded is not None]
    if table.error:
        error = _of_quantity(certificate, table.error, quantity, "measurement errors", difference=True)
        off = error.values
        if error.expanded is not None:
            stated.append(error.expanded)
    else:
        off = tuple(a - b for a, b in zip(shown.values, reference.values, strict=False))
    if not len(off) == len(shown.values) == points:
        raise BadInput(
            f"{points} reference values stand beside {len(shown.values)} measured ones and {len(off)} errors",
            file=certificate.file,
            remedy="ask its laboratory",
        )
    expanded = _largest(certificate, stated, points)
    notes = ["A certificate of the whole chain: counts become values as before, errors with U become limits."]
    rises = {b > a for a, b in itertools.pairwise(reference.values)}
    if len(rises) > 1:
        notes.append("Its points rise and fall: the limits hold for both directions.")
    return {}, [abs(error) + u for error, u in zip(off, expanded, strict=True)], notes


def _largest(certificate: Certificate, stated: Sequence[Sequence[float]], points: int) -> Sequence[float]:
    """Return the largest U that is stated of each point."""
    if not stated:
        raise BadInput(
            "it states no expanded uncertainty of its values",
            file=certificate.file,
            place="si:expandedUncXMLList",
            remedy="a calibration without U is of no use here: ask its laboratory",
        )
    if any(len(one) != points for one in stated):
        raise BadInput(
            "it has not one uncertainty a point", file=certificate.file, remedy="ask its laboratory"
        )
    return [max(of_point) for of_point in zip(*stated, strict=True)]


def _limits(quantity: Quantity, reference: Values, limits: Sequence[float]) -> dict[str, Any]:
    """Return the limits as keys of a channel: in per cent, or absolute for strokes and temperatures."""
    if quantity in _OF_LENGTH:
        return {"linearity": _short(max(limits))}
    if quantity == "temperature":
        return {"zero": _short(max(limits))}
    shares = [
        100.0 * limit / abs(value) for limit, value in zip(limits, reference.values, strict=True) if value
    ]
    written = {"accuracy_percent": _short(max(shares))} if shares else {}
    at_zero = [limit for limit, value in zip(limits, reference.values, strict=True) if not value and limit]
    return {**written, "zero": _short(max(at_zero))} if at_zero else written


def _short(limit: float) -> float:
    """Return a limit with three digits, rounded up: one that is too small would be a false claim."""
    if limit <= 0.0:
        return 0.0
    decimals = 2 - math.floor(math.log10(limit))
    steps = math.ceil(round(limit * 10.0**decimals, 6))  # not because of a last bit
    return round(steps / 10.0**decimals, decimals)


def _of_quantity(
    certificate: Certificate,
    given: Sequence[Values],
    quantity: Quantity,
    what: str,
    *,
    difference: bool = False,
) -> Values:
    """Return a column in the unit of the channel's quantity; a difference takes no offset (K, °C)."""
    scales = _scales("stroke" if quantity in _OF_LENGTH else quantity)
    for column in given:
        if column.unit in scales:
            factor, offset = scales[column.unit]
            moved = 0.0 if difference else offset
            return Values(
                column.unit,
                tuple(factor * value + moved for value in column.values),
                None if column.expanded is None else tuple(factor * one for one in column.expanded),
            )
    units = ", ".join(column.unit[:80] for column in given)
    raise BadInput(
        f"its {what} are in {units}, which is no unit of {quantity} that is known here",
        file=certificate.file,
        remedy=f"known are {', '.join(scales)}",
    )


def _scales(quantity: str) -> dict[str, tuple[float, float]]:
    named = {
        DSI_UNITS[unit]: conversion(quantity, unit) for unit in FACTORS.get(quantity, {}) if unit in DSI_UNITS
    }
    return {**named, **_FURTHER.get(quantity, {})}
