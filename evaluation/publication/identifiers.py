"""Identifiers that others look a publication up by: a mistyped one would name somebody else."""

from __future__ import annotations

import re

_ORCID = re.compile(r"(?:https?://orcid\.org/)?(\d{4}-\d{4}-\d{4}-\d{3}[\dX])")
_ROR = re.compile(r"(?:https?://)?(?:ror\.org/)?(0[a-hj-km-np-tv-z0-9]{6}\d{2})")
_DOI = re.compile(r"(?:https?://(?:dx\.)?doi\.org/|doi:)?(10\.\d{4,9}/\S+)", re.IGNORECASE)
_CROCKFORD = "0123456789abcdefghjkmnpqrstvwxyz"


def orcid(text: str) -> str:
    """Return an ORCID iD in its short form.

    The last character is the check digit of ISO/IEC 7064, MOD 11-2, over the 15 before it.

    Parameters
    ----------
    text : str
        ``0000-0002-1825-0097``, or as an address.

    Raises
    ------
    ValueError
        If it has another form, or another check digit.
    """
    match = _ORCID.fullmatch(text)
    if match is None:
        raise ValueError("no ORCID iD; write it as 0000-0002-1825-0097")
    digits = match[1].replace("-", "")
    total = 0
    for digit in digits[:-1]:
        total = (total + int(digit)) * 2 % 11
    if digits[-1] != "0123456789X"[(12 - total) % 11]:
        raise ValueError("its check digit is wrong: a digit was mistyped; copy it from orcid.org")
    return match[1]


def ror(text: str) -> str:
    """Return the address of an organisation in the Research Organization Registry.

    Its last two digits are the check of ISO/IEC 7064, MOD 97-10, over the six before them, which are a number
    in Crockford's base 32.

    Parameters
    ----------
    text : str
        ``https://ror.org/05dxps055``, or its last part.

    Raises
    ------
    ValueError
        If it has another form, or another check.
    """
    match = _ROR.fullmatch(text)
    if match is None:
        raise ValueError("no identifier of ROR; write it as https://ror.org/05dxps055")
    number = 0
    for letter in match[1][1:-2]:
        number = number * 32 + _CROCKFORD.index(letter)
    if int(match[1][-2:]) != 98 - number * 100 % 97:
        raise ValueError("its check digits are wrong: it was mistyped; copy it from ror.org")
    return f"https://ror.org/{match[1]}"


def doi(text: str) -> str:
    """Return a DOI in its short form.

    Parameters
    ----------
    text : str
        ``10.1000/182``, or as an address.

    Raises
    ------
    ValueError
        If it has another form.
    """
    match = _DOI.fullmatch(text)
    if match is None:
        raise ValueError("no DOI; write it as 10.1000/182")
    return match[1]


def address(text: str) -> str:
    """Return an address of the web.

    Raises
    ------
    ValueError
        If it is none.
    """
    if re.fullmatch(r"https?://[\w.-]+\.\w+(?:/\S*)?", text) is None:
        raise ValueError("no address; write it as https://doi.org/10.1000/182")
    return text


def licence(text: str) -> str:
    """Return the identifier of one licence as SPDX spells it.

    Parameters
    ----------
    text : str
        E.g. ``CC-BY-4.0``.

    Raises
    ------
    ValueError
        If SPDX lists no such licence, or it is an expression of several.
    """
    from packaging.licenses import (  # noqa: PLC0415 - only where a publication is read
        InvalidLicenseExpression,
        canonicalize_license_expression,
    )

    remedy = "write one identifier of spdx.org/licenses, as CC-BY-4.0"
    try:
        known = str(canonicalize_license_expression(text))
    except InvalidLicenseExpression:
        raise ValueError(f"SPDX lists no licence “{text}”; {remedy}") from None
    if re.search(r"[\s()+]", known) or known.startswith("LicenseRef-"):
        raise ValueError(f"“{text}” is not one licence that SPDX lists; {remedy}")
    return known
