"""Numbers as a report prints them: as many digits as they deserve, with unit and uncertainty, never a NaN."""

from __future__ import annotations

import math
from datetime import date, datetime

from bufferstand.evaluation.catalogue import QUANTITIES, Rounding
from bufferstand.evaluation.report.content.content import DASH, Cell
from bufferstand.evaluation.wording import day, moment, numeral

_ROUNDINGS = {entry.name: entry.rounding for entry in QUANTITIES} | {"temperature_C": Rounding(1)}
_SIGNIFICANT = 4
_MOST_DECIMALS = 3
_MINUS = "−"
_NUMBER = "[−+]?[0-9][0-9\u202f]*(?:[.,][0-9]+)?"
_UNIT = r"(?:kN/mm|mm/s|km/h|kN|mm|°C|K|Hz|kJ|J|kg|ms|min|s|h|t)\b"
_NAMED = (
    r"EN|ISO|§|[Rr]uns?|[Cc]ycles?|Figure|Table|\b[kwν] =|\bE_n|"
    r"Lauf|Läufen?|Zyklus|Zyklen|Bild|"
    r"[Bb]ěh[yu]?|[Cc]ykl(?:us|u|y|ů|ech)|[Oo]br\.|[Ee]ssais?|figure"
)
"""Words that a number belongs to, in the languages of a report."""
UNBROKEN = (
    rf"(?:{_NAMED}) {_NUMBER}|"
    r"--[a-z][a-z-]*|± U\b|U = k u\b|"
    rf"{_NUMBER}(?: [±…] {_NUMBER})+(?: {_UNIT}| %)?|"
    rf"[≤≥<>] {_NUMBER}(?: {_UNIT}| %)?|{_NUMBER}(?: {_UNIT}| %)"
)
"""What no line is broken in: a number with its uncertainty and unit, an option; kept by both renderers."""
SUBSCRIPTED = (
    rf"\b(?:{'|'.join(sorted({one.symbol for one in QUANTITIES if '_' in one.symbol} | {'E_n'}))})\b"
)
"""Symbols of quantities whose letters behind the underscore both renderers set as a subscript."""


def fixed(value: float, decimals: int) -> str:
    """Return a number with so many decimals, a true minus sign, and no negative zero."""
    text = f"{value:.{decimals}f}"
    if text.startswith("-"):
        text = _MINUS + text[1:] if float(text) != 0.0 else text[1:]
    return numeral(text)


def significant(value: float, digits: int = _SIGNIFICANT) -> str:
    """Return a number with so many significant digits, never in exponent form above 1e-6."""
    if value == 0.0:
        return numeral("0")
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    text = fixed(round(value, decimals), max(0, decimals))
    return numeral(text.rstrip("0").rstrip(".")) if "." in text else text


def to_digits(value: float, digits: int) -> str:
    """Return a number with just so many significant digits, zeros at its end too: for columns."""
    if value == 0.0:
        return numeral("0")
    decimals = decimals_of(abs(value), digits)
    return fixed(round(value, decimals), max(0, decimals))


def with_uncertainty(value: float, expanded: float) -> str:
    """Return ``value ± U``: U with two significant digits, the value to the same place (GUM 7.2.6)."""
    if expanded <= 0.0:
        return significant(value)
    decimals = decimals_of(expanded)
    value, expanded = round(value, decimals), round(expanded, decimals)
    return numeral(f"{fixed(value, max(0, decimals))} ± {fixed(expanded, max(0, decimals))}")


def decimals_of(expanded: float, digits: int = 2) -> int:
    """Return to how many decimals U (above 0) has so many significant digits; a negative number: to tens."""
    decimals = digits - 1 - math.floor(math.log10(expanded))
    # 0.0996 is 0.10, not 0.100
    return decimals - 1 if round(expanded, decimals) >= 10.0 ** (digits - decimals) else decimals


def span_text(low: float, high: float, expanded: float | None) -> str:
    """Return ``low … high``, or one of them where both print alike; to the place of U where it is known.

    Both have the same decimals.
    """
    texts = [value_text(end, expanded).partition(" ±")[0] for end in (low, high)]
    decimals = [len(text.partition(".")[2]) for text in texts]
    if decimals[0] != decimals[1]:
        texts = [fixed(end, max(decimals)) for end in (low, high)]
    return numeral(" … ".join(dict.fromkeys(texts)))


def usable(value: object) -> float | None:
    """Return ``value`` as a finite number, or None if it is none: a NaN must never be printed."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if math.isfinite(value) else None


def quantity_cell(name: str, value: object, why: str) -> Cell:
    """Return a result by its name in the evaluation document, with that quantity's decimals.

    Parameters
    ----------
    name : str
        As in the evaluation document, e.g. ``force_max_kN``.
    value : float or None
        The value; None or not finite is shown as a dash.
    why : str
        Why it is missing, if it is.
    """
    number = usable(value)
    if number is None:
        return Cell(DASH, "missing", why)
    rounding = _ROUNDINGS[name]
    if rounding.significant is not None:
        return Cell(significant(number, rounding.significant), "number")
    return Cell(fixed(number, rounding.decimals + (abs(number) < rounding.finer_below)), "number")


def measured_cell(value: object, expanded: object, why: str) -> Cell:
    """Return ``value ± U``, the value alone where no uncertainty is known, or a dash and why."""
    number, uncertainty = usable(value), usable(expanded)
    if number is None:
        return Cell(DASH, "missing", why)
    return Cell(value_text(number, uncertainty), "number")


def value_text(value: float, expanded: float | None) -> str:
    """Return ``value ± U``, or the value alone where no uncertainty is known."""
    if expanded is None:
        # Without an uncertainty nothing says how many digits count; the fourth decimal surely does not.
        return significant(round(value, _MOST_DECIMALS))
    return with_uncertainty(value, expanded)


def limits_text(lower: object, upper: object) -> str:
    """Return ``10 … 50``, ``≥ 12 500``, ``≤ 50`` or a dash where a requirement has no numbers."""
    low, high = usable(lower), usable(upper)
    if low is not None and high is not None:
        return numeral(f"{significant(low)} … {significant(high)}")
    if low is not None:
        return numeral(f"≥ {significant(low)}")
    return DASH if high is None else numeral(f"≤ {significant(high)}")


def probability_text(value: float) -> str:
    """Return a conformance probability in per cent, never rounded to certainty."""
    if value > 0.999:
        return numeral("> 99.9 %")
    return numeral("< 0.1 %" if value < 0.001 else f"{100.0 * value:.1f} %")


def moment_text(value: object) -> str | None:
    """Return an ISO 8601 moment as ``2026-03-05 14:02:11 UTC``, or None if it is none."""
    at = moment_of(value)
    return None if at is None else moment(at)


def day_text(value: object) -> str:
    """Return a day of ISO 8601 as one that a language can say; another text as it is, empty for None."""
    text = str(value or "")
    try:
        at = date.fromisoformat(text)
    except ValueError:
        return text
    return day(at) if at.isoformat() == text else text


def moment_of(value: object) -> datetime | None:
    """Return a moment given as ISO 8601 text, or None if it is missing or no moment."""
    if not isinstance(value, str) or not value:
        return None
    try:
        return datetime.fromisoformat(value)
    except ValueError:
        return None
