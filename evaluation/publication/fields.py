"""``publication.toml``: what only the laboratory knows of a publication."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, model_validator

from bufferstand.evaluation.publication.identifiers import address, doi, licence, orcid, ror
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import Day, Settings, WrongKeyError, load_settings

PUBLICATION_FILE = "publication.toml"

_Text = Annotated[str, Field(min_length=1)]
_as_tuple = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)


def _pattern(text: str) -> WithJsonSchema:
    """Return what the JSON Schema says of a value that a function checks."""
    return WithJsonSchema({"type": "string", "pattern": text})


Orcid = Annotated[str, AfterValidator(orcid), _pattern(r"\d{4}-\d{4}-\d{4}-\d{3}[\dX]$")]
"""ORCID iD, with its check digit."""
Ror = Annotated[str, AfterValidator(ror), _pattern(r"0[a-z0-9]{6}\d{2}$")]
"""Identifier of an organisation in ror.org, with its check digits."""
Doi = Annotated[str, AfterValidator(doi), _pattern(r"10\.\d{4,9}/\S+$")]
Address = Annotated[str, AfterValidator(address), _pattern(r"^https?://\S+$")]
Licence = Annotated[str, AfterValidator(licence), _pattern(r"^[A-Za-z0-9.-]+$")]


class Author(Settings):
    """Who made the data."""

    name: _Text
    affiliation: _Text
    """The organisation for which it was done."""
    orcid: Orcid | None = None
    """ORCID iD, as 0000-0002-1825-0097; its check digit is checked."""
    ror: Ror | None = None
    """Identifier of the affiliation in ror.org; its check digits are checked."""


class Citation(Settings):
    """A work that the data belong to or rest on, e.g. the paper."""

    text: _Text
    """As it stands in a list of references."""
    doi: Doi | None = None
    url: Address | None = None
    """Its address, where it has no DOI."""

    @model_validator(mode="after")
    def _found(self) -> Citation:
        if self.doi is None and self.url is None:
            raise WrongKeyError("a work that is cited needs a doi, or else a url", "doi")
        return self


class Publication(Settings):
    """What only the laboratory knows of a publication."""

    title: _Text
    description: _Text
    """What was tested and why, and what the data may be used for."""
    published: Day
    """Date of the publication: it is part of the crate, whose bytes are the same each time it is made."""
    licence: Licence
    """One licence of spdx.org/licenses by its identifier, e.g. CC-BY-4.0."""
    author: Annotated[tuple[Author, ...], _as_tuple, Field(min_length=1)]
    keywords: Annotated[tuple[_Text, ...], _as_tuple] = ()
    publisher: str = ""
    """The repository or organisation that publishes, e.g. Zenodo."""
    version: str = ""
    """Version of the data set, where there was one before."""
    citation: Annotated[tuple[Citation, ...], _as_tuple] = ()
    software_url: Address | None = None
    """Where this version of bufferstand can be had, e.g. its DOI as an address: it is cited with it."""

    def wanting(self) -> list[str]:
        """Return the keys that a repository would like to have and that are not there."""
        keys = [
            f"author[{number}].orcid"
            for number, author in enumerate(self.author, start=1)
            if author.orcid is None
        ]
        return [*(key for key in ("keywords", "citation", "software_url") if not getattr(self, key)), *keys]


def read_publication(folder: Path, file: Path | None = None) -> Publication:
    """Read what the laboratory says of a publication.

    Parameters
    ----------
    folder : Path
        The campaign's folder.
    file : Path, optional
        The file; ``publication.toml`` in the folder if not given.

    Raises
    ------
    BadInput
        If there is none, or it breaks the schema: with every key that is missing or wrong.
    """
    path = file or folder / PUBLICATION_FILE
    if not path.exists():
        needed = ", ".join(key for key, field in Publication.model_fields.items() if field.is_required())
        raise BadInput(
            f"no such file: a publication needs {needed}, which only the laboratory knows",
            file=path,
            remedy="write it as docs/how-to/publish-a-campaign.md shows (“bufferstand schema publication”)",
        )
    return load_settings(path, Publication)
