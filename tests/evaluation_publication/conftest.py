from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from bufferstand.evaluation.facts import Options
from bufferstand.evaluation.publication import Judging, Published, publish

ROOT = Path(__file__).resolve().parents[2]
QUICK = Judging(options=Options(draws=10))
FULL = """\
title = "Stiffness of a buffer"
description = "Static and harmonic tests."
published = 2026-11-28
licence = "cc-by-4.0"
keywords = ["railway", "buffer"]
publisher = "Zenodo"
version = "2"
software_url = "https://example.org/bufferstand"

[[author]]
name = "Jana Nováková"
orcid = "https://orcid.org/0000-0002-1825-0097"
affiliation = "Laboratory"
ror = "05dxps055"

[[author]]
name = "J. Svoboda"
affiliation = "Laboratory"

[[citation]]
text = "The paper."
doi = "https://doi.org/10.1000/182"
"""
LEAST = """\
title = "Stiffness of a buffer"
description = "Static and harmonic tests."
published = 2026-11-28
licence = "CC0-1.0"

[[author]]
name = "J. Svoboda"
affiliation = "Laboratory"
"""


def campaign(folder: Path, text: str = FULL, runs: str = "003*.h5") -> Path:
    """Make a folder with shipped runs and a publication file."""
    (folder / "runs").mkdir(parents=True)
    for path in sorted((ROOT / "sample_runs" / "runs").glob(runs)):
        shutil.copy(path, folder / "runs")
    (folder / "publication.toml").write_text(text, encoding="utf-8")
    return folder


@dataclass(frozen=True)
class Crate:
    folder: Path
    campaign: Path
    published: Published
    graph: Mapping[str, Mapping[str, Any]]


@pytest.fixture(scope="session")
def crate(tmp_path_factory: pytest.TempPathFactory) -> Crate:
    """A crate of two shipped runs, as a folder."""
    import json

    place = tmp_path_factory.mktemp("publication")
    made = campaign(place / "campaign", runs="00[34]*.h5")
    published = publish(made, place / "crate", judging=QUICK)
    document = json.loads((place / "crate" / "ro-crate-metadata.json").read_text(encoding="utf-8"))
    return Crate(place / "crate", made, published, {one["@id"]: one for one in document["@graph"]})
