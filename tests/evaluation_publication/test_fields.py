"""What is missing or wrong in publication.toml is said by its key, all at once."""

from __future__ import annotations

import json
import re
import tomllib
from datetime import date
from pathlib import Path

import jsonschema
import pytest

from bufferstand.cli.commands.schema import schema_of
from bufferstand.evaluation.publication.fields import Publication, read_publication
from bufferstand.foundation.errors import BadInput

from .conftest import FULL, LEAST, ROOT


def read(folder: Path, text: str) -> Publication:
    (folder / "publication.toml").write_text(text, encoding="utf-8")
    return read_publication(folder)


def test_identifiers_are_kept_in_one_form(tmp_path: Path) -> None:
    fields = read(tmp_path, FULL)
    assert (fields.licence, fields.published) == ("CC-BY-4.0", date(2026, 11, 28))
    assert (fields.author[0].orcid, fields.author[0].ror) == (
        "0000-0002-1825-0097",
        "https://ror.org/05dxps055",
    )
    assert fields.citation[0].doi == "10.1000/182"
    assert fields.wanting() == ["author[2].orcid"]


def test_what_is_only_wished_for_is_named(tmp_path: Path) -> None:
    wished = ["keywords", "citation", "software_url", "author[1].orcid"]
    assert read(tmp_path, LEAST).wanting() == wished


def test_without_a_file_it_is_said_what_one_needs(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput, match=r"publication\.toml: .*title, description, published, licence, author"
    ):
        read_publication(tmp_path)


def test_every_missing_key_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput) as refused:
        read(tmp_path, '[[author]]\nname = "J. Svoboda"\n')
    for key in ("title", "description", "published", "licence", "line 1: author.affiliation"):
        assert f" {key}: this key is missing" in str(refused.value), key


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0000-0002-1825-0097", "0000-0002-1825-0079", "orcid.*check digit"),
        ('"05dxps055"', '"05dxps056"', "ror.*check digits"),
        ("cc-by-4.0", "CC-BY", "licence.*SPDX"),
        ("10.1000/182", "x", "doi.*no DOI"),
        ('doi = "https://doi.org/10.1000/182"', "", "doi, or else a url"),
        ("keywords", "keyword", "keyword.*keywords"),
        ("2026-11-28", '"28.11.2026"', "published.*no.* date"),
    ],
)
def test_what_is_mistyped_is_refused_with_its_key_and_line(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    assert old in FULL
    with pytest.raises(BadInput, match=rf"publication\.toml: line \d+.*{said}"):
        read(tmp_path, FULL.replace(old, new))


def test_the_schema_takes_what_the_command_takes_and_the_page_shows_such_a_file(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "how-to" / "publish-a-campaign.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"^   ```toml\n(.*?)^   ```$", page, re.MULTILINE | re.DOTALL)
    example = "\n".join(line.removeprefix("   ") for line in block.splitlines())
    assert read(tmp_path, example).wanting() == []
    schema = jsonschema.Draft202012Validator(schema_of("publication"))
    for text in (FULL, LEAST, example):
        content = json.loads(json.dumps(tomllib.loads(text), default=str))
        schema.validate(content)
        assert not schema.is_valid({**content, "licence": "MIT OR GPL"})
        assert not schema.is_valid({**content, "nonsense": 1})
    for key in (*Publication.model_fields, "orcid", "ror", "doi", "url"):
        assert f"`{key}`" in page, key
