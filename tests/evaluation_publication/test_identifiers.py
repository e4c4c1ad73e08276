"""Identifiers with a check are accepted in every usual form, and refused with one character mistyped."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bufferstand.evaluation.publication import identifiers

ORCIDS = ("0000-0002-1825-0097", "0000-0001-5109-3700", "0000-0002-1694-233X", "0000-0002-9079-593X")
"""Those that ORCID's own pages give as examples."""
RORS = ("05dxps055", "03yrm5c26", "02mhbdp94", "00k4n6c32")
"""Caltech, the California Digital Library, Universidad de los Andes, the European Commission."""


@pytest.mark.parametrize("good", ORCIDS)
def test_an_orcid_is_known_by_its_check_digit(good: str) -> None:
    assert identifiers.orcid(good) == identifiers.orcid(f"https://orcid.org/{good}") == good
    for place in [place for place, letter in enumerate(good) if letter.isdigit()]:
        for digit in "0123456789":
            if digit != good[place]:
                with pytest.raises(ValueError, match="check digit"):
                    identifiers.orcid(good[:place] + digit + good[place + 1 :])


@pytest.mark.parametrize("good", RORS)
def test_a_ror_is_known_by_its_check_digits(good: str) -> None:
    assert identifiers.ror(good) == identifiers.ror(f"https://ror.org/{good}") == f"https://ror.org/{good}"
    for place in range(1, 7):
        for letter in "0123456789abcdefghjkmnpqrstvwxyz":
            if letter != good[place]:
                with pytest.raises(ValueError, match="check digits"):
                    identifiers.ror(good[:place] + letter + good[place + 1 :])


def test_a_doi_is_kept_in_its_short_form() -> None:
    for form in (
        "10.1000/182",
        "doi:10.1000/182",
        "https://doi.org/10.1000/182",
        "http://dx.doi.org/10.1000/182",
    ):
        assert identifiers.doi(form) == "10.1000/182"


@pytest.mark.parametrize(
    ("given", "spelt"), [("cc-by-4.0", "CC-BY-4.0"), ("CC0-1.0", "CC0-1.0"), ("odbl-1.0", "ODbL-1.0")]
)
def test_a_licence_is_spelt_as_spdx_spells_it(given: str, spelt: str) -> None:
    assert identifiers.licence(given) == spelt


@pytest.mark.parametrize(
    ("check", "text"),
    [
        (identifiers.licence, "CC-BY"),
        (identifiers.licence, "CC BY 4.0"),
        (identifiers.licence, "MIT OR Apache-2.0"),
        (identifiers.licence, "LicenseRef-ours"),
        (identifiers.licence, ""),
        (identifiers.orcid, "0000-0002-1825"),
        (identifiers.orcid, "https://example.org/0000-0002-1825-0097"),
        (identifiers.ror, "05dxps0"),
        (identifiers.doi, "11.1000/182"),
        (identifiers.doi, "10.1000"),
        (identifiers.address, "example.org"),
        (identifiers.address, "ftp://example.org/x"),
        (identifiers.address, "https://localhost"),
    ],
)
def test_what_is_none_is_refused_in_words(check: Callable[[str], str], text: str) -> None:
    with pytest.raises(ValueError, match=r"write (it|one)"):
        check(text)
