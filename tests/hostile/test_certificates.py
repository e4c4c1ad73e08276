"""Calibration certificates from strangers: odd ones get one message, and the stand file stays whole."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path

import pytest

from bufferstand.drivers.stand_file.loading import load_stand
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.made_certificate import CHAIN, TRANSDUCER, certificate
from tests.hostile.attempts import Outcome, attempt, bugs
from tests.hostile.mutations import mutated

ODD = (
    "",
    "1e400",
    "-1e308",
    "1e308",
    "5e-324",
    "0",
    "1 2 3",
    "∞",
    "\u202e1",
    "]]>",
    "&#10;",
    "a" * 5000,
    '"',
    "\\",
)
"""In place of a number, a name or a day."""


@pytest.fixture
def stand(tmp_path: Path) -> Path:
    return Path(shutil.copy(SAMPLE_STAND, tmp_path / "stand.toml"))


def imported(stand: Path, content: bytes) -> list[tuple[str, Outcome]]:
    """Import a certificate for a channel, printed and written; the stand file can be used afterwards."""
    file = stand.with_name("certificate.xml")
    file.write_bytes(content)
    found = []
    for channel in ("force", "temperature_1"):
        found.append((f"{channel}", attempt("calibration", "import", file, "--channel", channel)))
        before = stand.read_bytes()
        ended = attempt("calibration", "import", file, "--channel", channel, "--stand", stand)
        found.append((f"{channel} in the stand file", ended))
        if ended.status:
            assert stand.read_bytes() == before
        load_stand(stand)
    return found


@pytest.mark.parametrize("seed", range(8))
def test_damaged_bytes_end_in_one_message(stand: Path, seed: int) -> None:
    pick = random.Random(seed)
    for result in (TRANSDUCER, CHAIN):
        assert bugs(imported(stand, mutated(certificate(result).encode(), pick))) == []


@pytest.mark.parametrize("odd", ODD)
def test_odd_texts_in_place_of_any_number_end_in_one_message(stand: Path, odd: str) -> None:
    text = certificate(CHAIN)
    places = list(re.finditer(r"(?<=>)[^<>\n]+(?=<)", text))
    for place in places[::4]:
        changed = text[: place.start()] + odd + text[place.end() :]
        assert bugs(imported(stand, changed.encode())) == []


def test_very_many_points_are_taken_or_refused_in_words(stand: Path) -> None:
    many = certificate(CHAIN).replace("0.0 63.0 315.0 630.0", " ".join(map(str, range(200_000))))
    for _, ended in imported(stand, many.encode()):
        assert (ended.status, ended.bug) == (2, "")
