"""A dose of the study that always runs: the first records without imperfection, with one each, and mixtures.

A stand, a measuring chain and noise they all have. With one each: noise, thermometers, rows and stamps.
Mixtures are drawn from all kinds, channels that fail and false statements among them: no verdict of them may
be false or without ground. That every fault of them is named, and nothing else, the study counts.
"""

from __future__ import annotations

import pytest

from . import study
from .imperfections import KINDS
from .judgement import Judgement
from .kinds import noise, rows, stamps, thermometers

SOUND, MOST = 16, 10
MIXTURES, MIXED = 20_000, 40
NAMING = ("unnamed", "false alarm")
ROOMS = {room.__name__ for room in (noise, rows, stamps, thermometers)}
ASKED = [kind.name for kind in KINDS if kind.make.__module__ in ROOMS]


@pytest.mark.dose(8)
@pytest.mark.parametrize("number", range(SOUND))
def test_a_sound_record_is_evaluated_without_a_falsehood_or_a_need(number: int) -> None:
    judgement = study.one(number, "clean")
    assert judgement.falsehoods == []
    assert [f for f in judgement.findings if f[0] == "needless"] == []


@pytest.mark.dose(8)
@pytest.mark.parametrize("name", ASKED)
def test_a_record_with_one_imperfection_is_evaluated_without_a_falsehood(name: str) -> None:
    assert _first(name).falsehoods == []


@pytest.mark.dose(10)
@pytest.mark.parametrize("number", range(MIXTURES, MIXTURES + MIXED))
def test_a_record_with_several_imperfections_has_no_false_verdict(number: int) -> None:
    assert [f for f in study.one(number).falsehoods if f[0] not in NAMING] == []


def _first(name: str) -> Judgement:
    """Return the judgement of the first record that takes this imperfection."""
    for number in range(MOST):
        judgement = study.one(number, name)
        if judgement.kinds or judgement.falsehoods:
            return judgement
    raise AssertionError(f"none of {MOST} records takes {name}")
