"""Dates in queries, converted to the form in which they are compared as texts."""

from __future__ import annotations

import re
from datetime import UTC, datetime

_WRITTEN = re.compile(
    r"(?P<date>\d{4}(-\d{2}(-\d{2}([T ]([01]\d|2[0-3])(:\d{2}(:\d{2})?)?)?)?)?)"
    r"((?<=:\d\d:\d\d)(?P<fraction>\.\d+))?((?<=.{16})(?P<zone>Z|[+-]\d{2}:?\d{2}))?"
)
_KNOWN = re.compile(r"\d{4}-\d{2}-\d{2}.*")
_REST = "0001-01-01T00:00:00"
_FRACTION_DIGITS = 9


def written_date(text: str) -> str:
    """Return the beginning of a date and time in UTC that a text stands for: ``2026-03``, ``2026-03-05T14``.

    Parameters
    ----------
    text : str
        As far as it matters; from the minutes on with a zone, if that is not UTC.

    Raises
    ------
    ValueError
        If it is no date, or there is none such; the text says which, to be read behind the date.
    """
    found = _WRITTEN.fullmatch(text)
    if found is None:
        raise ValueError("is no date")
    start, fraction = found["date"].replace(" ", "T"), found["fraction"] or ""
    zone = (found["zone"] or "Z").replace("Z", "+00:00")
    try:
        moment = datetime.fromisoformat(start + _REST[len(start) :] + zone).astimezone(UTC)
    except (ValueError, OverflowError):
        raise ValueError("is a date that there is not") from None
    return moment.isoformat()[: len(start)] + fraction[: 1 + _FRACTION_DIGITS]


def comparable(known: str) -> str | None:
    """Return a run's start so that a written date compares with as much of it as is written.

    None if it is no date, which a foreign writer may have stated: it is before and after nothing.
    """
    if not _KNOWN.fullmatch(known):
        return None
    fraction = re.match(r"\.\d+", known[19:])
    digits = fraction[0][1 : 1 + _FRACTION_DIGITS] if fraction else ""
    return f"{known[:19].replace(' ', 'T')}.{digits:0<{_FRACTION_DIGITS}}" if len(known) >= 19 else known
